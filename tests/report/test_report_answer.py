"""The answer in words: digits that the interval justifies, both sides of a limit, and what could not be found."""

import copy

import pytest

from roughslip.report.answer import digits, limit_rows, regions, shown, summary
from tests.report.test_report import parsed, scene


def number(value, low=None, high=None, unit="1", **more):
    return {"value": value, "interval": None if low is None else [low, high], "unit": unit, **more}


def limits(title, value, unit, searched, **sides):
    empty = {"0.05": None, "0.95": None, "without_scatter": number(None, unit=unit)}
    sides = {side: empty | sides.get(side, {}) for side in ("below", "above")}
    return {"title": title, **number(value, unit=unit), **sides, "searched": number(None, *searched, unit=unit)}


FALLS, RISES = {"change": "falls below"}, {"change": "rises above"}
ANSWER = {
    "given": True,
    "runs": 100,
    "periods": number(40.0),
    "probability": number(1.0, 0.963, 1.0),
    "probability_from_sliding": number(0.5, 0.404, 0.596),
    "amplitude": number(4.7728e-3, 4.7331e-3, 4.8109e-3, "m"),
    "amplitude_scatter": number(8.348e-4, 8.1e-4, 8.6e-4, "m"),
    "frequency": number(44.893, 44.741, 45.043, "Hz"),
    "frequency_scatter": number(3.0799, 2.9, 3.2, "Hz"),
    "limits": {
        "damping": limits(
            "damping ratio D",
            0.17,
            "1",
            (0.0017, 17.0),
            above={
                "0.05": number(0.19923, 0.1904, 0.2103, **FALLS),
                "0.95": number(0.181, 0.1804, 0.1823, **FALLS),
                "without_scatter": number(0.19),
            },
        ),
        "mass": limits(
            "mass m",
            1.0,
            "kg",
            (0.01, 100.0),
            below={"0.05": number(0.02, unit="kg", **FALLS) | {"interval": [None, 0.03]}},
        ),
    },
    "starts_differ": False,
    "decided": True,
    "needs": number(93.6, scale="decays of a free vibration"),
    "stick_slip_lifetime": number(None) | {"interval": [8200.0, None]},
    "sliding_lifetime": number(31.0, 12.0, 80.0),
    "smallest_change": number(0.1719, 0.12, 0.237, parameter="damping", side="above", aim="end"),
    "decides": {
        "by": "mean curve",
        "existence_limit": number(0.19),
        "hopf_damping": number(0.15),
        "band_over_distance": number(0.91),
    },
}


def test_the_three_lines():
    first, second, third = summary(ANSWER)
    assert first == (
        "Stick-slip is practically certain (100 % [96, 100]) at D = 0.17 and m = 1 kg; 50 % [40, 60] if the mass "
        "slides steadily at first. Its cycle has an amplitude of 4.773 mm [4.733, 4.811], scattering by 835 µm, and a "
        "frequency of 44.89 Hz [44.74, 45.04], scattering by 3.08 Hz."
    )
    assert second == (
        "It is below 5 % for D above 0.199 [0.190, 0.210] or m below 0.0200 kg [open, 0.0300]; above 95 % for D up to "
        "0.1810 [0.1804, 0.1823] (no limit of m within the search)."
    )
    assert third == (
        "The smallest relative change that ends stick-slip is +17 % [12, 24] of the damping ratio D. The mean friction "
        "curve decides: without scatter the cycle exists up to D = 0.19; from 95 to 5 % it is 0.91 times as far as "
        "from the scene to that limit."
    )


def test_a_start_that_decides_and_a_run_that_is_too_short():
    first, *_ = summary(ANSWER | {"starts_differ": True})
    assert (
        "slides steadily at first. The start decides, because both states live longer than a run: stick-slip at least "
        "8,200 and steady sliding at least 12 natural periods in the mean. Its cycle" in first.replace("8200", "8,200")
    )
    first, *_ = summary(ANSWER | {"starts_differ": True, "decided": False})
    assert (
        "Not decided: a run of 40 natural periods still depends on its start; set answer.duration_periods to 93.6, the "
        "time of its decays of a free vibration." in first
    )


def test_numbers_outside_the_measured_speeds_say_so():
    beyond = copy.deepcopy(ANSWER) | {"outside_measured_speeds": True}
    beyond["limits"]["damping"]["above"]["0.05"]["outside_measured_speeds"] = True
    first, second, _ = summary(beyond)
    assert "m = 1 kg (outside the measured speeds); 50 %" in first
    assert "D above 0.199 [0.190, 0.210] (outside the measured speeds) or m" in second
    assert second.count("outside") == 1


def test_what_was_not_found_is_said_in_words():
    nothing = copy.deepcopy(ANSWER) | {"smallest_change": None, "probability": number(0.0, 0.0, 0.037)}
    nothing |= {"amplitude": number(None, unit="m")}
    nothing["decides"] |= {"existence_limit": number(None), "by": "scatter"}
    nothing["limits"] = {"mass": limits("mass m", 1.0, "kg", (0.01, 100.0))}
    first, second, third = summary(nothing)
    assert "practically excluded (0 % [0, 4])" in first
    assert first.endswith("Too few runs show a cycle to give its amplitude and frequency.")
    assert second == "It is below 5 % everywhere in the search; above 95 % nowhere in the search."
    assert third == (
        "No change of one parameter within the search begins stick-slip. The scatter of friction decides: without "
        "scatter no existence limit is found."
    )
    (row,) = limit_rows(nothing)
    assert (row["excluded"], row["certain"]) == ("all from 0.01 to 100", "none from 0.01 to 100")
    assert row["without_scatter"] == "none"


def test_a_level_is_passed_from_either_side():
    """Where stick-slip is excluded at the scene, the level 5 % ends that region and 95 % begins the other one."""
    one = limits("load N", 1.0, "N", (0.01, 100.0), above={"0.05": number(2.0, **RISES), "0.95": number(3.0, **RISES)})
    assert (regions(one, "0.05"), regions(one, "0.95")) == (["up to 2"], ["above 3"])


@pytest.mark.parametrize(
    ("value", "width", "text"),
    [
        (99856.0, 0.0, "99,900"),
        (0.0, 0.0, "0"),
        (46.0098, 0.0172, "46.010"),
        (1257.5, 192.0, "1,260"),
        (5e-4, 0, "0.0005"),
    ],
)
def test_digits(value, width, text):
    assert digits(value, width) == text


def test_units_of_small_lengths():
    texts = [shown(number(value, unit="m")) for value in (2.0, 2e-2, 2e-5, 2e-8)]
    assert texts == ["2 m", "20 mm", "20 µm", "20 nm"]


def test_the_answer_stands_first_on_its_scene():
    content = parsed(scene(answer=ANSWER | {"summary": summary(ANSWER)}))
    text = "\n".join(content.text)
    assert text.index("practically certain") < text.index("Pressure.") < text.index("all from 0.01 to 100")
    refused = parsed(scene(answer={"given": False, "summary": ["Stick-slip: no answer, because <it>."]}))
    assert "Stick-slip: no answer, because <it>." in refused.text
