"""The lines of the page that tell how far verdicts stand."""

import pytest

from roughslip.report.page import SceneReport, page
from roughslip.report.sensitivity_table import legend, standing_line
from tests.report.test_report import NASTY, Page

SCALE = ["material.young_modulus_pa", "roughness.rms_height_m"]


def reach(name, value, low, low_changes, high, high_changes, by=""):
    keys = ("input", "value", "low", "low_changes", "high", "high_changes", "by")
    return dict(zip(keys, (name, value, low, low_changes, high, high_changes, by), strict=True))


def standing(*ranges, always="", any_value=(), new_runs=(), new_solves=()):
    stands = {"always": always, "any_value": [*SCALE, *any_value], "ranges": list(ranges)}
    return {"id": "a", "stands": stands | {"new_runs": list(new_runs), "new_solves": list(new_solves)}}


CYCLE = standing(
    reach("oscillator.mass_kg", 1.0, 0.1, None, 1.3596, 1.95787),
    reach("ensemble.realisations", 400, 73, 72, 4000, None),
    any_value=["oscillator.normal_force_n with mass in proportion"],
    new_runs=["ensemble.duration_periods"],
    new_solves=["roughness.covariance", "roughness.correlation_length_m", "strip.cell_m"],
)
LENGTH = standing(
    reach("strip.window_m", 6e-4, 4.978e-4, 4.9779e-4, 6e-3, None, "with all lengths in proportion"),
    reach("friction.least_contact_fraction", 1e-3, 0.0, None, 1e-3, None, "no window has less"),
)
PAPER = standing(always="the paper is at odds with itself", any_value=())
NOT_TESTED = {"id": "b", "stands": None}
ALL = [CYCLE, LENGTH, PAPER, NOT_TESTED]


def test_ends_units_and_what_is_not_known():
    """A star where nothing changed, brackets where the change lies further on, one number where it is next to it."""
    assert standing_line(CYCLE, ALL) == (
        "Stands for mass 0.1* to 1.36 (1.958) kg; runs 73 to 4000*; any normal force with mass in proportion; needs a "
        "run: duration periods; needs contact solves: shape of the roughness, mesh and penetrations of the strip"
    )
    assert standing_line(LENGTH, ALL) == (
        "Stands for window 0.0004978 to 0.006* m (with all lengths in proportion); least contact fraction 0 to 0.001*"
    )


def test_what_hangs_on_nothing_or_was_not_tested():
    assert standing_line(PAPER, ALL) == "Stands in any case: the paper is at odds with itself"
    assert standing_line(NOT_TESTED, ALL) == standing_line({"id": "of an older run"}, ALL) == ""


def test_what_no_verdict_hangs_on_is_told_once():
    text = legend(ALL, "mine")
    assert text.startswith("No verdict depends on Young's modulus, rms height. ")
    assert text.endswith("edit mine.yaml and run snakemake -j2 mine")
    assert "Young" not in standing_line(CYCLE, ALL)
    with_one_more = [*ALL, standing() | {"stands": standing()["stands"] | {"any_value": []}}]
    assert legend(with_one_more, "mine").startswith("Notes end in")
    assert "any Young's modulus" in standing_line(CYCLE, with_one_more)


@pytest.mark.parametrize("words", ["the paper", NASTY])
def test_the_page_has_a_line_a_claim_as_text(words):
    claim = {"statement": "s", "paper": "p", "ours": 1.0, "interval": [0.0, 2.0], "verdict": "reproduced", "note": "n"}
    claims = [
        claim | {"rule": "r", "id": "one"} | {"stands": CYCLE["stands"]},
        claim | {"rule": "r", "id": "two"} | {"stands": PAPER["stands"] | {"always": words}},
    ]
    content = Page(page([SceneReport("mine", "Mine", {}, {}, claims, [], "{}")], {}))
    assert content.mistakes == content.open == []
    text = " ".join(content.text)
    assert "mass 0.1* to 1.36 (1.958) kg; runs 73 to 4000*" in text
    assert f"Stands in any case: {words}." in text
    assert "No verdict depends on Young's modulus, rms height, normal force with mass in proportion." in text
    assert content.all("script") == []
