"""Drawings inside the page: reduced without a visible change, with ids that no other drawing has.

The page that compares variants: numbers of the answer in units for readers, the same in SI in the table."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from roughslip import store
from roughslip.figures.style import draw_map, panels, save
from roughslip.report.answer import summary
from roughslip.report.drawing import chosen, element, reduced, size, thumbnail
from roughslip.report.sweep_page import Row, sweep_page, sweep_table
from roughslip.stages.sweep import TITLES, of_answer, row
from tests.report.test_report import Page
from tests.report.test_report_answer import MACHINE

NUMBER = re.compile(r"-?\d+\.?\d*(?:e-?\d+)?")


@pytest.fixture(scope="module")
def svg(tmp_path_factory):
    """A curve with markers, text that looks like markup, and a map twice, whose images have the same id."""
    figure, (curve, *fields) = panels(3, 1, 4.0)
    curve.plot(np.linspace(0, 1, 50), np.sin(np.linspace(0, 7, 50)), "o-", label="<script>-->")
    curve.legend()
    for field in fields:
        draw_map(field, np.arange(5.0), np.arange(5.0), np.random.default_rng(1).random((5, 5)), "viridis", (0, 1))
    path = tmp_path_factory.mktemp("drawing") / "figure.svg"
    save(figure, path)
    return path.read_text()


def paths(text):
    return [one.get("d") for one in ET.fromstring(text).iter() if one.tag.endswith("path") and one.get("d")]


def test_coordinates_keep_a_hundredth_of_a_point(svg):
    """Digits are cut, not rounded: less than 0.01 point is lost, and neither a path nor the scale of a text."""
    small = reduced(svg)
    assert len(small) < 0.8 * len(svg)
    assert "script" not in small
    before, after = paths(svg), paths(small)
    assert len(before) == len(after) > 40
    for old, new in zip(before, after, strict=True):
        a, b = (np.array([float(number) for number in NUMBER.findall(text)]) for text in (old, new))
        assert np.abs(a - b).max(initial=0.0) < 0.01
    assert re.findall(r"scale\([^)]*\)", small) == re.findall(r"scale\([^)]*\)", svg)


def test_ids_are_those_of_one_drawing_and_every_reference_is_met(svg):
    small = reduced(svg).encode()
    page = f"<body>{element(small, 'a', 'one')}{element(small, 'b', 'two')}{thumbnail(small, 'a')}</body>"
    elements = list(ET.fromstring(page).iter())
    ids = [one.get("id") for one in elements if one.get("id")]
    assert len(ids) == len(set(ids)) > 20
    links = {one.get("href")[1:] for one in elements if (one.get("href") or "").startswith("#")}
    clips = set(re.findall(r"url\(#([^)]*)\)", page))
    assert "a-drawing" in links
    assert clips
    assert links | clips <= set(ids)


def test_what_a_picture_shows_is_text(svg):
    assert 'aria-label="&lt;b&gt; &amp; &quot;"' in element(reduced(svg).encode(), "a", '<b> & "')


def test_a_png_takes_the_place_of_a_large_drawing(svg, tmp_path):
    figure, _ = panels(1, 1, 3.0)
    save(figure, tmp_path / "figure.png")
    png = (tmp_path / "figure.png").read_bytes()
    assert size(png) == (480, 560)  # 3.0 and 3.5 inches at 160 dots
    assert size(reduced(svg).encode()) == pytest.approx((864, 252))  # points, three panels of 4 inches
    assert chosen(svg, png) == reduced(svg).encode()
    long = svg.replace("</svg>", '<path d="M 0 0"/>' * 20_000 + "</svg>")
    assert chosen(long, png) == png
    assert "data:image/png;base64," in element(png, "a", "one")


def test_a_variant_has_its_answer_and_how_far_it_is():
    """A letter stands at 320 + 300 log(limit / own) / log(100): m at 1 / 50 and D at 1.172."""
    numbers = of_answer(MACHINE | {"summary": summary(MACHINE)})
    assert numbers["limit_damping"] == (0.19923, 0.1904, 0.2103)
    assert "limit_load" not in numbers
    rows = [Row("mine", {"oscillator.damping_ratio": 0.17}, numbers, MACHINE), Row("mine-1", {"a.b": None}, {})]
    page = Page(sweep_page(rows, "Of <mine>.", TITLES))
    assert page.mistakes == page.open == []
    text = " ".join(" ".join(page.text).split())
    for part in ("Of <mine>", "4.77 mm", "4.73 to 4.81", "0.199", "0.19 to 0.21", "not given"):
        assert part in text
    assert [(attrs["x"], attrs["y"]) for attrs in page.all("text")] == [("330.3", "13"), ("65.2", "13")]
    head, first, second = sweep_table(rows, TITLES).splitlines()
    assert head.startswith("scene,oscillator.damping_ratio,probability,probability_low,probability_high,friction_mean")
    assert first.startswith("mine,0.17,1,0.963,1,0.4,,")
    assert second.startswith("mine-1,not given,,,")


def test_a_variant_without_an_answer_has_the_numbers_that_its_files_hold(tmp_path):
    """Friction under a load has no statistics by penetration; an answer that is not given has no numbers."""
    held = {"oscillator/deterministic.nc": ("hopf_damping", 0.2), "friction/statistics.nc": ("mean", 0.3)}
    files = {file: {name: store.Variable((), value, "1", name)} for file, (name, value) in held.items()}
    paths = {name: tmp_path / str(number) for number, name in enumerate((*files, "answer.json"))}
    for name, variables in files.items():
        store.write(paths[name], variables, store.Key({}, "code"))
    store.write_json(paths["answer.json"], {"given": False})
    assert row("mine", {}, paths) == Row("mine", {}, {"hopf_damping": (0.2, None, None)})
