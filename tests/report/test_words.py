"""Answer and budget in words: digits that the interval justifies, both sides of a limit, what could not be found."""

import re

import pytest

from roughslip.report.budget_words import budget_summary
from roughslip.report.page import plots
from roughslip.report.words import (
    amount,
    answer_summary,
    chance,
    change_rows,
    digits,
    factor,
    facts,
    other_chances,
    smallest_change,
    verdict,
)


def number(value, low=None, high=None, unit="1", **more):
    return {"value": value, "interval": None if low is None else [low, high], "unit": unit, **more}


def limits(title, value, unit, **sides):
    ends = {
        "0.05": None,
        "0.95": None,
        "without_scatter": number(None),
        "unsteady_0.05": None,
        "steady_without_scatter": number(None),
    }
    found = {side: ends | sides.get(side, {}) for side in ("below", "above")}
    return {"title": title, **number(value, unit=unit), **found}


def shares(rest, sliding):
    """Probabilities and shares of three states; rest, sliding : of stick-slip and of vibration from either start"""
    wide = {0.0: (0.0, 0.037), 0.4: (0.3, 0.5), 0.5: (0.404, 0.596), 0.6: (0.5, 0.7), 1.0: (0.963, 1.0)}
    seen = {}
    for name, (stuck, vibrates) in (("from_rest", rest), ("from_sliding", sliding)):
        parts = {"stick_slip": stuck, "vibration": vibrates, "sliding": 1.0 - stuck - vibrates}
        seen[name] = {state: number(part, *wide[part]) for state, part in parts.items()}
    probabilities = {"": seen["from_rest"], "_from_sliding": seen["from_sliding"]}
    return {f"probability{name}": one["stick_slip"] for name, one in probabilities.items()} | {"shares": seen}


MOTION = {
    "with_scatter": {"time_s": [0, 0.25, 0.5], "displacement_m": [0, 2e-3, 0], "velocity_m_per_s": [1, -1, 1]},
    "without_scatter": {"time_s": [0, 0.5], "displacement_m": [0, 1e-3], "velocity_m_per_s": [1, -1]},
}
MOTION["with_scatter"]["cycles"] = 1
OTHERS = {
    "belt_velocity": limits("belt velocity v0", 0.02, "m s-1"),
    "stiffness": limits("stiffness k", 1e3, "N m-1"),
    "load": limits("normal force N", 500.0, "N"),
}
END_OF_DAMPING = {"0.05": number(0.19923, 0.1904, 0.2103), "0.95": number(0.181, 0.1804, 0.1823)}
END_OF_MASS = {"0.05": number(0.02, None, unit="kg") | {"interval": [None, 0.03]}}
LIMITS = {
    "damping": limits("damping ratio D", 0.17, "1", above=END_OF_DAMPING),
    "mass": limits("mass m", 1.0, "kg", below=END_OF_MASS),
}
MACHINE = {
    "given": True,
    "runs": 100,
    "periods": number(40.0),
    **shares((1.0, 0.0), (0.5, 0.0)),
    "amplitude": number(4.7728e-3, unit="m"),
    "amplitude_scatter": number(8.348e-4, unit="m"),
    "frequency": number(44.893, unit="Hz"),
    "frequency_scatter": number(3.0799, unit="Hz"),
    "vibration": {"amplitude": number(None), "frequency": number(None)},
    "limits": LIMITS | OTHERS,
    "starts_differ": False,
    "decided": True,
    "needs": number(93.6, scale="decays of a free vibration"),
    "states": {
        "share_of_time": [None] * 3,
        "mean_stick_slip_s": [None, 1632, None],
        "mean_vibration_s": [None] * 3,
        "mean_sliding_s": [None, 2.38, None],
    },
    "smallest_changes": [{"parameter": "damping"}],
    "without_scatter": {"from_rest": {"state": "stick_slip"}},
    "decides": {
        "by": "mean curve",
        "friction_slope": number(-0.0542, unit="s m-1"),
        "existence_limit": number(0.19),
        "hopf_damping": number(0.216),
        "hopf_by_lines": number(None, 0.12, 0.47),
        "vibration_limit": number(None),
        "band_over_distance": number(0.91),
    },
    "motion": MOTION,
    "friction_mean": number(0.4),
    "friction_deviation": number(0.08),
    "windows": number(1),
}
NOTHING = dict.fromkeys(("existence_limit", "vibration_limit", "band_over_distance", "hopf_by_lines"), number(None))
NOTHING |= {"by": "scatter", "friction_slope": number(0.01), "hopf_damping": number(-0.02)}
VIBRATION = {"amplitude": number(1.25e-4, unit="m"), "amplitude_scatter": number(4.2e-6, unit="m")}
VIBRATION |= {"frequency": number(49.8, unit="Hz"), "frequency_scatter": number(0.54, unit="Hz")}
PARTS = {"damping": (0.8, 0.7, 0.9), "mass": (0.1, 0.0, 0.2)}
BUDGET = {
    "probability": {"mean": 0.62},
    "answer": {"value": 0.98},
    "outcome": {"damping": (0.5, 0.4, 0.62), "mass": (0.05, 0.0, 0.1)},
    "scatter": 0.4,
    "limits": {"damping": {"value": 0.32, "interval": (0.28, 0.36), "first": PARTS, "beyond": 0.08}},
    "units": {"damping": "1"},
}


@pytest.mark.parametrize(
    ("rest", "sliding", "differ", "decided", "word", "kind"),
    [  # shares of stick-slip and of vibration from either start
        ((1.0, 0.0), (1.0, 0.0), False, True, "Yes", "bad"),
        ((0.4, 0.6), (0.4, 0.6), False, True, "At times", "odd"),
        ((0.0, 0.0), (0.0, 0.0), False, True, "No", "good"),
        ((1.0, 0.0), (0.0, 0.0), True, True, "After a stop", "bad"),
        ((0.0, 1.0), (0.0, 0.0), True, True, "After a stop", "odd"),
        ((1.0, 0.0), (0.5, 0.0), True, False, "Not decided", "odd"),
        ((0.0, 1.0), (0.0, 1.0), False, True, "No, but it vibrates", "odd"),
        ((0.0, 0.4), (0.0, 0.6), False, True, "No, but it vibrates at times", "odd"),
    ],
)
def test_the_verdict_follows_from_the_shares_of_states(rest, sliding, differ, decided, word, kind):
    """And no sentence has a number that does not exist: without a limit in reach, without a cycle."""
    answer = MACHINE | shares(rest, sliding) | {"starts_differ": differ, "decided": decided}
    said = verdict(answer)
    assert (said["word"], said["kind"]) == (word, kind)
    none = {"smallest_changes": [], "amplitude": number(None, unit="m"), "decides": NOTHING}
    bare = none | {"limits": OTHERS | {"mass": limits("mass m", 1.0, "kg")}}
    for one in (answer, answer | bare, answer | {"vibration": VIBRATION}):
        summary = " ".join(answer_summary(one))
        assert summary.startswith(f"Stick-slip: {word[0].lower()}{word[1:]}, ")
        assert not re.search("None|nan", f"{summary} {facts(one)} {change_rows(one)}".replace("=None", ""))


def test_a_vibration_that_scatter_hides_and_durations_of_the_state_that_goes_on():
    """Sliding that only leads to a stick-slip without end has no duration in the words."""
    hidden = {"without_scatter": {"from_rest": {"state": "vibration"}}}
    said = verdict(MACHINE | shares((0.0, 0.0), (0.0, 0.0)) | hidden)
    assert (said["word"], said["kind"], "hides" in said["text"]) == ("No", "odd", True)
    lasting = MACHINE["states"] | {"mean_sliding_s": [0.096, 0.090, 0.1]}
    note = next(note for title, _, note in facts(MACHINE | {"states": lasting}) if title == "time in stick-slip")
    assert note.endswith("in the mean stick-slip lasts longer than 27 min")


def test_a_budget_names_what_to_measure_next():
    """The damping takes half of the variance of the outcome, or 80 % of that of the limit where the outcome is sure."""
    for changes, words in (
        ({}, "Measure the damping next: known exactly, it takes away 50 % (40 to 62 %) of the variance of whether"),
        ({"probability": {"mean": 0.99}}, "That is sure enough. Measure the damping next: known exactly, it takes"),
        ({"outcome": {"mass": (1e-17, 0.0, 0.0)}}, "No number that the scene gives with an uncertainty matters here."),
    ):
        assert budget_summary(BUDGET | changes)[-1].startswith(words)


def test_a_change_is_given_in_per_cent_or_as_a_factor_and_a_bar_is_its_logarithm():
    """log(1.172) / log(100) = 3.4 % of the search and log(50) / log(100) = 85 %."""
    assert [factor(ratio) for ratio in (0.9, 1.5, 0.5)] == ["−10 %", "× 1.5", "÷ 2"]
    assert [round(row.far, 1) for row in change_rows(MACHINE | {"limits": LIMITS})] == [3.4, 84.9]


def test_the_curves_fill_their_boxes():
    """From (0, 100) at the lower left to (100, 0) at the upper right of a plot, as SVG has it."""
    drawn = plots(MOTION)
    assert drawn["displacement"]["with_scatter"] == "0,100 50,0 100,100"
    assert drawn["speed"]["without_scatter"] == "0,0 100,100"
    assert drawn["cycle"]["with_scatter"] == "0,0 100,100 0,0"
    assert (drawn["displacement"]["along"], drawn["displacement"]["across"]) == ("2 mm", "0.5 s")
    assert drawn["displacement"]["each"] == ["50 ms", "0.2 mm"]


def test_digits_and_units_are_those_of_readers():
    """A unit below the SI unit from a tenth on, one above it from the whole on; beyond the smallest that one."""
    texts = [digits(*one) for one in ((99856.0, 3), (0.0, 3), (26.8061, 2), (5e-4, 3))]
    assert texts == ["99,900", "0", "27", "0.0005"]
    texts = [amount(value, "m") for value in (2.0, 2e-2, 1.3e-4, 2e-5, 2e-8, 2e-12)]
    assert texts == ["2 m", "20 mm", "0.13 mm", "20 µm", "20 nm", "0.002 nm"]
    assert [amount(value, "N") for value in (0.0, 500.0, 2000.0)] == ["0 N", "500 N", "2 kN"]


def test_changes_of_the_same_factor_and_those_that_the_machine_does_not_allow():
    """At the Hopf damping D / N alone counts; away from it the two are two changes of the same factor."""
    at_hopf = limits("damping ratio D", 0.1, "1", above={"0.05": number(0.216)})
    load = limits("normal force N", 2160.0, "N", below={"0.05": number(1000.0, unit="N")})
    both = {"smallest_changes": [{"parameter": "damping"}, {"parameter": "load"}]}
    answer = MACHINE | both | {"limits": LIMITS | OTHERS | {"damping": at_hopf, "load": load}}
    text = "more damping, D, × 2.2, from 0.1 to 0.216; or less normal force, ÷ 2.2, from 2.16 kN to 1 kN."
    assert smallest_change(answer).startswith(
        f"The smallest changes that end it, of the same factor: {text} Damping and"
    )
    off = answer | {"decides": MACHINE["decides"] | {"hopf_damping": number(0.1)}}
    assert smallest_change(off).endswith(text)
    fixed = MACHINE | {"can_change": {"damping": [0.1, 0.18]}, "smallest_changes": []}
    assert smallest_change(fixed) == "No change of one parameter in its range ends it."
    notes = [note for row in change_rows(fixed) for note in row.notes]
    assert [notes.count(why) for why in ("beyond its range", "cannot change")] == [1, 1]


def test_one_probability_stands_in_the_head_and_the_others_below_it():
    answer = MACHINE | shares((1.0, 0.0), (0.0, 0.6)) | {"starts_differ": True}
    assert chance(answer) == "100 % [96, 100] from rest"
    assert "0 % [0, 4] of the runs stick-slip and 60 % [50, 70] vibrate" in other_chances(answer)
    assert other_chances(MACHINE) == ""
