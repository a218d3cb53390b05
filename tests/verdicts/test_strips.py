"""Strips that decide statements on friction: closed forms of single numbers, and shares of Gaussian pilots."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize, stats

from roughslip.compilation.source_hash import closure_hash
from roughslip.probability import Estimate
from roughslip.probability.estimate import variance_margin
from roughslip.verdicts import strips
from roughslip.verdicts.finding import EVERY, MEDIAN, TREND, Bound
from roughslip.verdicts.rules import BOUNDS
from roughslip.verdicts.strips import ODDS, STEP, strips_from_pilot, strips_that_decide
from tests.verdicts.claimed import LEVELS, friction, with_interval

SKEWED = "mu-right-skewed"
SKEWED_ALONE = {SKEWED: BOUNDS[SKEWED]}


def levels(name, value, half):
    return with_interval(name, *(np.full(LEVELS, one) for one in (value, value - half, value + half)))


def scattered(value, replicates):
    return Estimate(np.array(value), *np.quantile(replicates, (0.025, 0.975), axis=-1), replicates)


@pytest.mark.parametrize(
    ("statement", "numbers", "times"),
    [
        ("mu-correlation-250um", levels("combined_length_least_squares", 285e-6, 30e-6), (30 / 15) ** 2),
        ("mu-correlation-250um", levels("combined_length_least_squares", 295e-6, 30e-6), None),  # 1.7 % from 300 µm
        ("mu-correlation-250um", levels("combined_length_least_squares", 260e-6, 30e-6), None),  # decided
        (SKEWED, levels("combined_skewness", 0.02, 0.06), (0.06 / 0.02) ** 2),
        ("mu-beta-2.1-5", levels("beta_distance_standardised", 0.08, 0.04), (0.04 / 0.02) ** 2),
        # both numbers of a rule: the farther from decided is 0.02 inside the lower end of the skewness, 0.28
        (
            "mu-beta-2.1-5",
            levels("beta_distance_standardised", 0.08, 0.04) | levels("combined_skewness", 0.30, 0.06),
            (0.06 / (0.30 - 0.5 * 0.5597)) ** 2,
        ),
        ("mu-leptokurtic", levels("combined_kurtosis", 0.02, 0.1), None),  # the paper contradicts itself
    ],
)
def test_intervals_narrow_with_the_root_of_the_strips_until_a_rule_decides(statement, numbers, times):
    """n = strips (half width / distance from the threshold)^2, up to one step of the search."""
    found = strips_that_decide(friction() | numbers, 100, BOUNDS)
    if times is None:
        assert statement not in found
    else:
        assert 100 * times <= found[statement] <= math.ceil(100 * times * STEP) + 1


@pytest.mark.parametrize("distance", [0.0, 2.0, 4.0])
def test_a_gaussian_pilot_asks_for_the_strips_of_a_quantile_of_the_distance(distance):
    """q = N(distance, 1) in standard errors: for ODDS of these |q| exceeds d, so n = strips margin (1.96 / d)^2.

    400 replicates know the share of ODDS to 0.024, so d, where the density is 0.25 at least, to 0.1.
    """
    normal = np.random.default_rng(41).standard_normal((LEVELS, 400))
    normal = (normal - normal.mean(axis=1, keepdims=True)) / normal.std(axis=1, keepdims=True)
    table = {name: value for name, value in friction().items() if f"{name}_low" in friction()}
    estimates = {name: scattered(value, value[..., None] + np.zeros(400)) for name, value in table.items()}
    estimates["combined_skewness"] = scattered(np.full(LEVELS, distance), distance + normal)
    found = strips_from_pilot(estimates, friction()["percentile"], 24, SKEWED_ALONE)
    below = lambda d: stats.norm.cdf(d - distance) - stats.norm.cdf(-d - distance) - (1 - ODDS)  # noqa: E731
    d = optimize.brentq(below, 0.0, 6.0)
    exact = [24 * max(1.0, variance_margin(24) * (1.96 / (d + error)) ** 2) for error in (0.1, -0.1)]
    assert exact[0] <= found[SKEWED] <= STEP * exact[1] + 1


def test_noise_raises_a_distance_and_the_pivot_takes_that_off():
    """Replicates at 0.095 around 0.07 say that noise adds 0.025, so the truth is near 0.045, far below 0.1.

    A half width of 0.04 widened by the margin is less than that distance. Taken as they are, the replicates would ask
    for (0.05 / 0.005)^2 times the strips.
    """
    table = {name: value for name, value in friction().items() if f"{name}_low" in friction()}
    estimates = {name: scattered(value, value[..., None] + np.zeros(50)) for name, value in table.items()}
    replicates = 0.095 + 0.003 * np.random.default_rng(43).standard_normal((LEVELS, 50))
    ends = np.full(LEVELS, 0.03), np.full(LEVELS, 0.11)
    estimates["beta_distance_standardised"] = Estimate(np.full(LEVELS, 0.07), *ends, replicates)
    found = strips_from_pilot(estimates, friction()["percentile"], 24, BOUNDS)
    assert found["mu-beta-2.1-5"] == found["mu-beta-any-depth"] == 24


@pytest.mark.slow
def test_with_these_strips_more_than_the_odds_are_decided():
    """Truths spread evenly about a threshold, and of 24 strips each the pilots that leave them undecided: some 120.

    Then means of as many strips as each pilot asks for. The share decided is ODDS and more, as the margin for few
    strips comes on top. The number that a pilot shows alone, (half width / distance)^2, decides fewer.
    """
    rng, asked_decides, shown_decides = np.random.default_rng(42), [], []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "STEPS", 120)
        for truth in rng.uniform(-0.8, 0.8, 300):
            own = truth + rng.standard_normal(24)
            half = 1.96 * own.std() / math.sqrt(24)
            if abs(own.mean()) > half:
                continue
            skewness = scattered(
                np.full(LEVELS, own.mean()), np.tile(rng.choice(own, (60, 24)).mean(axis=1), (LEVELS, 1))
            )
            pilot = {"combined_skewness": skewness}
            asked = strips_from_pilot(pilot, friction()["percentile"], 24, SKEWED_ALONE)[SKEWED]
            for decides, number in ((asked_decides, asked), (shown_decides, 24 * (half / own.mean()) ** 2)):
                more = number - 24
                end = (24 * own.mean() + rng.normal(more * truth, math.sqrt(more))) / number
                decides.append(abs(end) > 1.96 / math.sqrt(number))
    assert np.mean(asked_decides) > ODDS
    assert np.mean(shown_decides) < ODDS


STAGE = "roughslip.stages.strip_allocation"


@pytest.mark.parametrize(
    ("file", "old", "new", "changes"),
    [
        ("friction_distribution.py", "is found to be right skewed", "is right skewed", False),
        ("friction_correlation.py", "rms distance from the exponential", "distance", False),
        ("friction_over_penetration.py", "decreases with penetration", "falls", False),
        ("reading.py", "VISIBLE = 0.1 ", "VISIBLE = 0.2 ", False),  # it is given, see the next test
        ("strips.py", "ODDS = 0.75", "ODDS = 0.8", True),
    ],
)
def test_the_stage_that_asks_for_strips_depends_on_no_text(tmp_path, file, old, new, changes):
    """An edit of a statement, a note or a title must not solve strips again: the hash of the code stays."""
    source = Path(strips.__file__).parents[2]
    shutil.copytree(source, tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    edited = tmp_path / "src" / "roughslip" / "verdicts" / file
    text = edited.read_text(encoding="utf-8")
    assert old in text
    edited.write_text(text.replace(old, new), encoding="utf-8")
    assert (closure_hash(STAGE, source) != closure_hash(STAGE, tmp_path / "src")) == changes


def test_the_bounds_are_numbers_alone_and_pass_through_a_key_file():
    given = json.loads(json.dumps(BOUNDS, allow_nan=False))
    assert {name: [Bound(*row) for row in rows] for name, rows in given.items()} == {
        name: list(rows) for name, rows in BOUNDS.items()
    }
    texts = {entry for rows in given.values() for row in rows for entry in row if isinstance(entry, str)} - {""}
    assert texts <= {MEDIAN, EVERY, TREND, *friction()}
