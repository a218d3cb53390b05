"""The report is one valid page that needs no network and shows text of users as text."""

import base64
import json
import re
from html.parser import HTMLParser
from itertools import pairwise

from roughslip.report.page import SceneReport, page
from roughslip.report.sections import SECTIONS, in_brackets
from roughslip.report.words import answer_summary
from roughslip.study.plan import captions
from tests.report.test_words import BUDGET, MACHINE

VOID = {"meta", "img", "br", "hr", "link", "input"}
PICTURE = b'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 864 252"><path d="M0 0L9 9"/></svg>'
CAPTIONS = {"figure2": "Pressure.", "figure3": "Friction.", "figure5": "Cycles."}


class Page(HTMLParser):
    """Elements and text of a page; an end tag that does not close the last open element is an error."""

    def __init__(self, text):
        super().__init__()
        self.open, self.elements, self.text, self.mistakes = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        names = [name for name, _ in attrs]
        if len(names) != len(set(names)):
            self.mistakes.append(f"attribute twice in {tag}")
        self.elements.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.mistakes.append(f"</{tag}> closes nothing")

    def handle_data(self, data):
        if not self.open or self.open[-1] != "style":
            self.text.append(data)

    def all(self, tag):
        return [attrs for name, attrs in self.elements if name == tag]


def claim(**changes):
    """A claim with its natural reading and another one, which is contradicted."""
    one = {"statement": "The mean decreases", "paper": "decreases", "rule": "the interval lies below zero", "unit": "1"}
    one |= {"ours": -0.08912, "interval": [-0.0942, -0.0839], "shown": "-0.0891 (-0.0942 to -0.0839)"}
    one |= {"verdict": "reproduced", "note": "change of the mean"}
    one |= {name: value for name, value in changes.items() if name in one}
    natural = one | {"id": "over-all", "place": "section 4", "natural": True, "why": "the range", "apart": ""}
    other = natural | {"id": "every-step", "verdict": "contradicted", "natural": False, "why": ""}
    of_statement = {"id": "fig3-mean-decreases", "figure": "figure3", "number": "change of the mean"}
    of_statement |= {"headline": one["verdict"], "tried": 2, "hold": 1}
    return one | of_statement | changes | {"readings": [natural, other]}


def cost(**changes):
    numbers = {"jobs": 2, "cpu_seconds": 10.71, "wall_seconds": 33.0, "peak_memory_mib": 284.1}
    return {"stage": "contact", **numbers, "did": {"convolutions": 80400, "field_fits": 3}} | changes


def scene(**changes):
    return SceneReport(
        **{
            "name": "mine",
            "description": "A scan of my own",
            "figures": dict.fromkeys(CAPTIONS, PICTURE),
            "captions": CAPTIONS,
            "surfaces": {},
            "claims": [claim()],
            "costs": [cost(), cost(stage="all", did={"everything": 1})],
            "configuration": '{"seed": 1}',
        }
        | changes
    )


def parsed(*scenes):
    content = Page(page(scenes, {"numpy": "2.0", "python": "3.11"}))
    assert content.mistakes == []
    assert content.open == []
    return content


def test_one_page_without_a_network():
    """Its pictures are inside once, thumbnails show them again; each link inside leads to an element with that id."""
    text = page([scene(), scene(name="yours")], {"numpy": "2.0"})
    assert text.startswith("<!DOCTYPE html>")
    content = parsed(scene(), scene(name="yours"))
    assert not re.search(r"https?:|//[a-z]|url\(|@import|<script|<link|<iframe", text)
    sources = [value for _, attrs in content.elements for name, value in attrs.items() if name in ("src", "href")]
    pictures = [source for source in sources if source.startswith("data:image/svg+xml;base64,")]
    assert len(pictures) == 2 * len(CAPTIONS)
    assert base64.b64decode(pictures[0].partition(",")[2]) == PICTURE
    ids = [attrs["id"] for _, attrs in content.elements if "id" in attrs]
    assert len(ids) == len(set(ids))
    places = {source[1:] for source in sources if source.startswith("#")}
    assert {"main", "mine", "yours", *CAPTIONS, *(f"yours-{name}-drawing" for name in CAPTIONS)} <= places
    assert places <= set(ids)
    assert {"mine-fig3-mean-decreases", "yours-fig3-mean-decreases"} <= set(ids)
    labels = [attrs["aria-label"] for attrs in content.all("svg") if "aria-label" in attrs]
    assert labels[0] == "figure2 of the scene mine. Pressure."
    files = {source for source in sources if not source.startswith(("#", "data:"))}
    kept = {"claims.json", "costs.json", "summary.csv"}
    assert files == kept | {f"{name}.{kind}" for name in CAPTIONS for kind in ("svg", "nc")}


def test_every_figure_has_a_title_and_numbers_are_written_with_their_unit_once():
    assert set(SECTIONS) == set(captions())
    shown = ["-0.0891 (-0.0942 to -0.0839)", "18.4 µm (-23.4 µm to 58.5 µm)", "100 % (98.4 % to 100 %)", None]
    texts = ["-0.0891 [-0.0942, -0.0839]", "18.4 µm [-23.4, 58.5]", "100 % [98.4, 100]", ""]
    assert [in_brackets(text) for text in shown] == texts


def test_the_page_says_which_scene_gives_each_number():
    oscillator = json.loads(OSCILLATOR)["oscillator"] | {"mass_kg": 8.0}
    configuration = {"oscillator": oscillator, "strip": {"samples": 60}}
    origins = {"oscillator.mass_kg": "mine", "oscillator.friction_table": "disc_brake", "strip.samples": "paper"}
    text = texts(machine_scene(configuration=json.dumps(configuration), origins=origins))
    for line in ("mass_kg: 8.0 # scene mine", 'law: "table" # default, or follows', "samples: 60 # scene paper"):
        assert line in text
    assert "The curve is the friction_table of scene disc_brake: 0.45 at rest" in text


OSCILLATOR = '{"oscillator": {"law": "table", "static_friction": 0.45, "friction_table": [[0, 0.45], [0.5, 0.38]]}}'


def machine_scene(answer=MACHINE, **changes):
    return scene(**{"configuration": OSCILLATOR, "answer": answer | {"summary": answer_summary(answer)}} | changes)


def texts(one):
    return " ".join(" ".join(parsed(one).text).split())


def test_the_page_of_a_machine_begins_with_its_answer_and_folds_the_figures_behind_it():
    asked = machine_scene(description="A brake <of mine>.", budget=BUDGET | {"summary": ["What matters."]})
    content, text = parsed(asked), texts(asked)
    parts = ("A brake <of mine>", "Yes", "What would end it", "The machine", "What is worth measuring What matters.")
    places = [text.index(part) for part in (*parts, "damping 50 %", "scatter of friction 40 %", "Pressure.")]
    assert places == sorted(places)
    for part in (
        "The smallest change that ends it: more damping, D, +17 %, from 0.17 to 0.199",
        "The curve is the friction_table of the scene: 0.45 at rest, 0.38 at 0.5 m/s.",
        "Figures behind the answer",
        "the probability of stick-slip is 62 %",
        "how sure the inputs are; that is above",
    ):
        assert part in text, part
    assert len(content.all("polyline")) == 6
    levels = [int(tag[1]) for tag, _ in content.elements if re.fullmatch("h[1-6]", tag)]
    assert all(after <= before + 1 for before, after in pairwise(levels))
    refused = texts(scene(answer={"given": False, "summary": ["Stick-slip: no answer, because <it>."]}))
    assert "Stick-slip: no answer, because <it>." in refused
