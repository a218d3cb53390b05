"""Answer and budget in words: digits that the interval justifies, both sides of a limit, what could not be found."""

import copy
import json
from dataclasses import asdict
from pathlib import Path

from roughslip.report.budget_words import bars, budget_summary
from roughslip.report.page import plots
from roughslip.report.words import (
    amount,
    answer_summary,
    change_rows,
    digits,
    factor,
    facts,
    friction_curve,
    verdict,
)


def number(value, low=None, high=None, unit="1", **more):
    return {"value": value, "interval": None if low is None else [low, high], "unit": unit, **more}


def limits(title, value, unit, **sides):
    ends = {"0.05": None, "0.95": None, "without_scatter": number(None), "steady_without_scatter": number(None)}
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
BEYOND_IT = {"without_scatter": number(0.19), "steady_without_scatter": number(0.31)}
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
    "smallest_change": {"parameter": "damping"},
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
AT_TIMES, NEVER = shares((0.4, 0.0), (0.4, 0.0)), shares((0.0, 0.0), (0.0, 0.0))
NOTHING = dict.fromkeys(("existence_limit", "vibration_limit", "band_over_distance", "hopf_by_lines"), number(None))
NOTHING |= {"friction_slope": number(0.01), "hopf_damping": number(-0.02)}
DURATIONS = {
    "mean_stick_slip_s": [0.5, 0.4, 0.7],
    "mean_vibration_s": [None] * 3,
    "mean_sliding_s": [None, 7200.0, None],
}
VIBRATION = {"amplitude": number(1.25e-4, unit="m"), "amplitude_scatter": number(4.2e-6, unit="m")}
VIBRATION |= {"frequency": number(49.8, unit="Hz"), "frequency_scatter": number(0.54, unit="Hz")}
OF_BAND = OTHERS | {"mass": limits("mass m", 1.0, "kg")}
VIBRATES = MACHINE | {
    "vibration": VIBRATION,
    "decides": MACHINE["decides"] | {"vibration_limit": number(0.31)},
    "limits": {"damping": limits("damping ratio D", 0.25, "1", above={"steady_without_scatter": number(0.31)})}
    | OF_BAND,
    "states": {**MACHINE["states"], **dict.fromkeys(("mean_stick_slip_s", "mean_sliding_s"), [None] * 3)}
    | {"mean_vibration_s": [None, 60.0, None]},
}
NO_CYCLE = {"amplitude": number(None)}
PAD = {"friction_deviation": number(0.04), "friction_pad_deviation": number(4e-4), "windows": number(1600)}
BEYOND = copy.deepcopy(MACHINE) | {"outside_measured_speeds": True}
BEYOND["limits"]["damping"]["above"]["0.05"]["outside_measured_speeds"] = True
RISING = {"0.05": number(2.0, unit="kg"), "0.95": number(3.0, 2.5, 3.5, unit="kg")}
ANSWERS = {
    "certain": MACHINE,
    "at times, of a pad": MACHINE | AT_TIMES | PAD | {"states": {"share_of_time": [0.4, 0.3, 0.52], **DURATIONS}},
    "the start decides": MACHINE | {"starts_differ": True} | shares((1.0, 0.0), (0.0, 0.0)),
    "too short": MACHINE | {"starts_differ": True, "decided": False},
    "outside the measured speeds": BEYOND,
    "nothing found": MACHINE
    | NEVER
    | {"smallest_change": None, "amplitude": number(None, unit="m"), "decides": {"by": "scatter", **NOTHING}}
    | {"limits": OTHERS | {"mass": limits("mass m", 1.0, "kg")}},
    "vibrates": VIBRATES | NO_CYCLE | shares((0.0, 1.0), (0.0, 1.0)),
    "vibrates at times": VIBRATES | NO_CYCLE | shares((0.0, 0.4), (0.0, 0.6)),
    "vibrates after a stop": VIBRATES | NO_CYCLE | {"starts_differ": True} | shares((0.0, 1.0), (0.0, 0.0)),
    "sticks after a stop and else vibrates": VIBRATES | {"starts_differ": True} | shares((1.0, 0.0), (0.0, 1.0)),
    "vibrates beyond stick-slip": VIBRATES
    | {"vibration": MACHINE["vibration"]}
    | {"limits": {"damping": limits("damping ratio D", 0.17, "1", above=END_OF_DAMPING | BEYOND_IT)} | OF_BAND},
    "vibrates before stick-slip begins": VIBRATES
    | NEVER
    | NO_CYCLE
    | {"limits": {"damping": limits("damping ratio D", 0.35, "1", below=END_OF_DAMPING | BEYOND_IT)} | OF_BAND},
    "begins": MACHINE
    | NEVER
    | {"smallest_change": {"parameter": "mass"}}
    | {"limits": OTHERS | {"mass": limits("mass m", 1.0, "kg", above=RISING)}},
}
PARTS = {"damping": (0.8, 0.7, 0.9), "mass": (0.1, 0.0, 0.2)}
BUDGET = {
    "probability": {"mean": 0.62},
    "answer": {"value": 0.98},
    "outcome": {"damping": (0.5, 0.4, 0.62), "mass": (0.05, 0.0, 0.1)},
    "scatter": 0.4,
    "limits": {"damping": {"value": 0.32, "interval": (0.28, 0.36), "first": PARTS, "beyond": 0.08}},
    "units": {"damping": "1"},
}
BUDGETS = {
    "unsure": BUDGET,
    "sure": BUDGET | {"probability": {"mean": 0.99}},
    "vibration ends": BUDGET
    | {"limits": BUDGET["limits"] | {"vibration": BUDGET["limits"]["damping"] | {"value": 0.7, "beyond": 0.0}}}
    | {"units": {"damping": "1", "vibration": "1"}},
    "nothing uncertain": BUDGET | {"outcome": {}},
}
FROZEN = Path(__file__).with_name("words.json")


def words():
    """All that is said of each answer and budget."""
    of_answers = {
        name: {
            "summary": answer_summary(answer),
            "verdict": verdict(answer),
            "facts": facts(answer),
            "rows": [list((asdict(row) | {"far": round(row.far)}).values()) for row in change_rows(answer)],
        }
        for name, answer in ANSWERS.items()
    }
    return of_answers | {name: [budget_summary(budget), bars(budget)] for name, budget in BUDGETS.items()}


def test_words_are_those_that_are_kept():
    """Read words.json: it is what a user reads. `python -m tests.report.test_words` writes it."""
    kept, said = json.loads(FROZEN.read_text(encoding="utf-8")), json.loads(json.dumps(words()))
    for name, expected in kept.items():
        assert said[name] == expected, name
    assert said.keys() == kept.keys()


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
    ticks = drawn["displacement"]["ticks"].split()  # at each tenth of both axes
    assert ticks[:4] == ["M0", "100v-4", "M10", "100v-4"]
    assert len(ticks) == 44


def test_digits_and_units_are_those_of_readers():
    """A unit below the SI unit from a tenth on, one above it from the whole on; beyond the smallest that one."""
    texts = [digits(*one) for one in ((99856.0, 3), (0.0, 3), (26.8061, 2), (5e-4, 3))]
    assert texts == ["99,900", "0", "27", "0.0005"]
    texts = [amount(value, "m") for value in (2.0, 2e-2, 1.3e-4, 2e-5, 2e-8, 2e-12)]
    assert texts == ["2 m", "20 mm", "0.13 mm", "20 µm", "20 nm", "0.002 nm"]
    assert [amount(value, "N") for value in (0.0, 500.0, 2000.0)] == ["0 N", "500 N", "2 kN"]


def test_the_curve_of_a_machine_with_a_record_is_that_of_the_record():
    of_record = {"oscillator": {}, "friction": {"record": {"file": ["up.csv", "down.csv"]}}}
    assert friction_curve(of_record, {}) == "The curve is that of the records up.csv, down.csv."


if __name__ == "__main__":
    FROZEN.write_text(json.dumps(words(), indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
