"""The report is one valid page that needs no network and shows text as text."""

import base64
import re
import struct
from html.parser import HTMLParser

import pytest

from roughslip.report.page import MEASURED, Evidence, SceneReport, page
from roughslip.report.sections import ASKED, MARKS, SECTIONS, answers, in_brackets
from roughslip.study.plan import captions

VOID = {"meta", "img", "br", "hr", "link", "input"}
PICTURE = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + struct.pack(">II", 1920, 560) + b" not much of a picture"
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
    judged = {
        "statement": "The mean decreases",
        "paper": "decreases",
        "rule": "the interval lies below zero",
        "unit": "1",
        "ours": -0.08912,
        "interval": [-0.0942, -0.0839],
        "shown": "-0.0891 (-0.0942 to -0.0839)",
        "verdict": "reproduced",
        "note": "change of the mean",
    }
    judged |= {name: value for name, value in changes.items() if name in judged}
    natural = judged | {"id": "over-all", "place": "section 4", "natural": True, "why": "the range", "apart": ""}
    other = {"id": "every-step", "verdict": "contradicted", "natural": False, "why": ""}
    of_statement = {"id": "fig3-mean-decreases", "figure": "figure3", "number": "change of the mean"}
    of_statement |= {"headline": judged["verdict"], "tried": 2, "hold": 1}
    return judged | of_statement | changes | {"readings": [natural, natural | other]}


def cost(**changes):
    return {
        "stage": "contact",
        "jobs": 2,
        "cpu_seconds": 10.71,
        "wall_seconds": 33.0,
        "peak_memory_mib": 284.1,
        "did": {"convolutions": 80400, "field_fits": 3},
        "skipped": {"nodes: below <the> plane": 1234, "solves: no contact": 0},
    } | changes


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
    text = page([scene(), scene(name="yours")], {"numpy": "2.0"})
    assert text.startswith("<!DOCTYPE html>")
    content = parsed(scene(), scene(name="yours"))
    assert not re.search(r"https?:|//[a-z]|url\(|@import|<script|<link|<iframe", text)
    sources = [value for _, attrs in content.elements for name, value in attrs.items() if name in ("src", "href")]
    pictures = [source for source in sources if source.startswith("data:image/png;base64,")]
    assert len(pictures) == 2 * len(CAPTIONS)  # thumbnails show them again without a copy
    assert base64.b64decode(pictures[0].partition(",")[2]) == PICTURE
    ids = [attrs["id"] for _, attrs in content.elements if "id" in attrs]
    assert len(ids) == len(set(ids))
    places = {source[1:] for source in sources if source.startswith("#")}
    assert {"main", "mine", "yours", *CAPTIONS, *(f"yours-{name}-drawing" for name in CAPTIONS)} <= places
    assert places <= set(ids)
    assert {"mine-fig3-mean-decreases", "yours-fig3-mean-decreases"} <= set(ids)
    files = {source for source in sources if not source.startswith(("#", "data:"))}
    kept = {"claims.json", "costs.json", "summary.csv"}
    assert files == kept | {f"{name}.{kind}" for name in CAPTIONS for kind in ("svg", "nc")}


def test_the_page_of_a_scene_that_does_not_read_the_paper_begins_with_itself():
    """The paper stands in its folded statements alone; on a reading its statements and numbers come first."""
    own = "\n".join(parsed(scene()).text)
    assert "paper" not in own[: own.index("Statements of the paper")].lower()
    text = "\n".join(parsed(scene(name="paper")).text)
    assert text.index("The paper's statements: 1 reproduced in scene paper.") < text.index("Pressure.")


def test_the_answer_of_the_study_is_at_most_five_sentences_from_its_verdicts():
    rows = answers(
        {
            "paper": [claim()],
            "resolved": [
                claim(id="mu-correlation-250um", number="correlation length", shown="296 µm (282 µm to 312 µm)")
            ],
        }
    )
    assert rows == [
        "The paper's statements: 1 reproduced in scene paper; 1 reproduced in scene resolved.",
        "Along the path friction is correlated over 250 µm: reproduced in resolved (correlation length 296 µm [282, "
        "312]).",
    ]
    assert len(ASKED) < 5
    assert answers({}) == []


def test_every_figure_has_its_texts():
    assert set(SECTIONS) == set(captions())
    assert all(text.rstrip(".").count(". ") <= 2 for text in captions().values())  # with "Figure 2." two sentences


def test_numbers_are_written_with_their_unit_once():
    shown = ["-0.0891 (-0.0942 to -0.0839)", "18.4 µm (-23.4 µm to 58.5 µm)", "100 % (98.4 % to 100 %)", None]
    assert [in_brackets(text) for text in shown] == [
        "-0.0891 [-0.0942, -0.0839]",
        "18.4 µm [-23.4, 58.5]",
        "100 % [98.4, 100]",
        "",
    ]


NASTY = """<script>alert("x")</script> & 'quoted' \u00b5 {braces}"""


@pytest.mark.parametrize("key", ["statement", "paper", "note", "rule", "description", "configuration"])
def test_what_a_user_wrote_is_text(key):
    of_claim = claim(**{key: NASTY})
    content = parsed(scene(**({key: NASTY} if key in ("description", "configuration") else {"claims": [of_claim]})))
    assert content.all("script") == []
    assert NASTY in " ".join(content.text)


def test_numbers_verdicts_and_what_has_none():
    absent = claim(ours=None, interval=None, verdict="not tested", note="the scene does not run this stage")
    second, absent = claim(id="fig3-std-decreases"), absent | {"id": "fig3-cov-decreases"}
    content = parsed(scene(name="paper", claims=[claim(), second, absent]))
    text = " ".join(content.text)
    assert "change of the mean -0.0891 [-0.0942, -0.0839]" in text
    assert "None" not in text
    for verdict, count in (("reproduced", 2), ("not-tested", 1)):
        assert [attrs.get("class") for attrs in content.all("a")].count(verdict) == count
    assert text.count(MARKS["not tested"]) == 4  # in the matrix, in its key, with the figure and its natural reading


def test_the_natural_reading_is_shown_and_the_others_are_folded():
    """Each with its rule; next to the headline how many hold of those tried; a trap says why it stands apart."""
    one = claim(headline="reproduced; contradicted if it rains")
    one["readings"][1]["apart"] = "a trap"
    text = " ".join(" ".join(parsed(scene(name="paper", claims=[one])).text).split())
    for part in (
        *("Natural reading: ✓ reproduced , ours with", "Natural: the range.", "Other readings: 1", "1 of 2"),
        *("reproduced; contradicted if it rains", "Shown apart: ✗ contradicted", "It supports no headline: a trap."),
        "2 verdicts on readings are decided by 95 % intervals",
    ):
        assert part in text, part


def test_statements_of_the_paper_are_folded_away_where_the_scene_is_none_of_its_readings():
    """There those on the paper's own numbers, and those that are not tested, are left out; a scene may have none."""
    claims = [claim(), claim(id="mu-correlation-250um"), claim(id="fig2-mcs-lhs", verdict="not tested")]
    for name, count in (("paper", 3), ("resolved", 3), ("mine", 1)):
        content = parsed(scene(name=name, claims=claims))
        shown = {attrs["id"] for attrs in content.all("h3") if "id" in attrs}
        assert shown == {f"{name}-{one['id']}" for one in claims[:count]}
        summaries = [line for line in content.text if line.startswith("Statements of the paper")]
        assert len(summaries) == (name == "mine")
    assert "statements:" not in " ".join(parsed(scene(claims=claims[1:])).text)


EVIDENCE = Evidence(
    pictures=dict.fromkeys(MEASURED, PICTURE),
    stress=[
        {
            "stage": "contact",
            "problems": 3000,
            "outcomes": {"converged": 2990, "IllPosedError": 10},
            "worst_residual_over_tolerance": 0.5,
        },
        {"stage": "chaos", "problems": 1, "outcomes": {"InputError": 1}, "worst_residual_over_tolerance": None},
    ],
    machine={"contact": "a <processor>"},
)
COSTS = [
    cost(stage="contact_square", did={"surfaces": 1000}),
    cost(),
    cost(
        stage="all",
        warnings=["slope of <0.7>", "few strips"],
        not_needed={"contact": "given & done", "friction": "given & done", "cycles": "a number"},
    ),
]


def test_all_that_a_run_found_stands_on_its_page():
    """Costs, with skipped work and stages; warnings above the figures; how
    surfaces are made; evidence. A scene without them has no empty place for them."""
    asked = scene(costs=COSTS, surfaces={"figure2": ["It has 7 modes.", NASTY]})
    content = Page(page([asked], {"numpy": "2.0"}, EVIDENCE))
    assert content.mistakes == content.open == content.all("script") == []
    text = " ".join(" ".join(content.text).split())
    shown = (
        *("slope of <0.7>", "few strips", "Pressure.", "80,400 convolutions, 3 field fits"),
        *("1,234 nodes: below <the> plane", "contact, friction (given & done); cycles (a number)."),
        *("1,000 surfaces", "It has 7 modes.", NASTY),
        *("3,000", "2,990 converged, 10 IllPosedError", "a <processor>"),
    )
    assert [part for part in shown if part not in text] == []
    assert text.index("A scan of my own") < text.index("slope of <0.7>") < text.index("Pressure.")
    assert [word for word in ("None", "no contact") if word in text] == []
    labels = " ".join(attrs.get("aria-label", "") for attrs in content.all("svg"))
    assert [f"Benchmark {name}. " in labels for name in MEASURED] == [True] * len(MEASURED)
    older = {name: value for name, value in cost().items() if name != "skipped"}
    plain = " ".join(parsed(scene(costs=[older])).text)
    places = ("Warnings", "Stages that did not run", "How its surfaces are made")
    assert [word for word in places if word in plain] == []
