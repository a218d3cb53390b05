"""The paper's statements, each with our number, its interval and a verdict that a written rule decides.

A rule compares an interval with an effect size; no verdict is set by hand. `reproduced` needs the whole interval on the
right side; a statement at odds with another number of the paper `contradicts itself`; one whose stage the scene does
not run is `not tested`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

REPRODUCED, NOT_REPRODUCED, CONTRADICTS, NOT_TESTED = (
    "reproduced",
    "not reproduced",
    "contradicts itself",
    "not tested",
)
VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print
TAIL = float(np.log10(2.0))  # factor of two in a small probability
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
PAPER_LENGTH = 250e-6  # m
PAPER_BETA = (2.1, 5.0)

Arrays = Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Claim:
    """One statement: what the paper says, our number with its 95 % interval, the verdict and the rule behind it."""

    id: str
    statement: str
    paper: str
    ours: float | None
    interval: tuple[float, float] | None
    verdict: str
    note: str
    rule: str


STATEMENTS = {
    "fig2-mcs-lhs": ("Latin hypercube sampling gives the distribution of Monte Carlo sampling", "curves coincide"),
    "fig2-pc-lhs": ("The polynomial chaos of eq. (8) gives the sampled distribution", "curves coincide"),
    "fig2-pc-tail": ("Polynomial chaos matches even for low probabilities", "matches well"),
    "fig2-variants-agree": ("The variants of eqs. (8) and (9) are nearly indistinguishable", "curves coincide"),
    "fig3-mean-decreases": ("The mean friction coefficient decreases with penetration", "decreases"),
    "fig3-std-decreases": ("The standard deviation decreases with penetration", "decreases"),
    "fig3-cov-decreases": ("The coefficient of variation decreases with penetration", "decreases"),
    "mu-correlation-exponential": ("The friction coefficient is exponentially correlated", "exponential"),
    "mu-correlation-250um": ("Its correlation length is 250 um", "250 um"),
    "mu-correlation-any-depth": ("The correlation length does not depend on the penetration", "independent"),
    "mu-right-skewed": ("The friction coefficient is right skewed", "skewness > 0"),
    "mu-leptokurtic": ("The friction coefficient is leptokurtic", "excess kurtosis > 0"),
    "mu-beta-2.1-5": ("Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)", "Beta(2.1, 5)"),
    "mu-beta-any-depth": ("It follows Beta(2.1, 5) at every penetration", "independent"),
    "fig5-limit-cycle": ("The mass moves on a stick-slip limit cycle, with and without scatter", "limit cycle"),
    "fig5-reattachment-nonnormal": ("The reattachment point is not normally distributed", "non-normal"),
    "fig5-sharp-limit": ("Without scatter the cycle ceases at a sharp limit of damping", "sharp limit"),
    "fig5-range-beyond-limit": ("With scatter there is a range of damping where the cycle goes on", "a range"),
}

RULES = {
    "fig2-mcs-lhs": f"the interval of the Kolmogorov distance given contact lies below {VISIBLE}",
    "fig2-pc-lhs": f"the interval of the Kolmogorov distance given contact lies below {VISIBLE}",
    "fig2-pc-tail": "where Monte Carlo lies between 0.001 and 0.1, eq. (8) is within a factor of two, interval and all",
    "fig2-variants-agree": f"the interval of their Kolmogorov distance lies below {VISIBLE}",
    "fig3-mean-decreases": "intervals of the slope over penetration and of last less first level both lie below zero",
    "fig3-std-decreases": "intervals of the slope over penetration and of last less first level both lie below zero",
    "fig3-cov-decreases": "intervals of the slope over penetration and of last less first level both lie below zero",
    "mu-correlation-exponential": "mean square distance to the fitted exponential less that to the triangle of the "
    "window itself: the interval lies below zero",
    "mu-correlation-250um": "the interval of the least-squares length lies within 20 % of 250 um",
    "mu-correlation-any-depth": "the interval of the change from first to last level is within 20 % of the mean length",
    "mu-right-skewed": "the interval of the skewness at median penetration lies above zero",
    "mu-leptokurtic": "the paper's own Beta(2.1, 5) has negative excess kurtosis, so the statement contradicts it",
    "mu-beta-2.1-5": f"the interval of the Kolmogorov distance of the standardised laws lies below {VISIBLE / 2}",
    "mu-beta-any-depth": f"as for Beta(2.1, 5) at every level, so the largest upper end lies below {VISIBLE / 2}",
    "fig5-limit-cycle": "the damping lies below the deterministic limit and 95 % of the runs cycle, interval and all",
    "fig5-reattachment-nonnormal": "the interval of the Kolmogorov distance to the normal lies above 0.01, "
    "and that of the skewness or of the kurtosis excludes zero",
    "fig5-sharp-limit": "every damping below the limit gives at least half the cycles of the least damping, "
    "every one above at most one",
    "fig5-range-beyond-limit": "at some damping above the deterministic limit the interval of the mean number of "
    "cycles lies above one",
}  # fmt: skip


def claims(square: Arrays | None, friction: Arrays | None, oscillator: Arrays | None) -> list[dict[str, Any]]:
    """Every statement in the order of the paper, from the results of the branches that the scene runs.

    square, friction, oscillator : contents of chaos/square.nc, friction/statistics.nc, oscillator/statistics.nc
    """
    found: dict[str, tuple[float, tuple[float, float], bool | str, str]] = {}
    if square is not None:
        found |= _figure_2(square)
    if friction is not None:
        found |= _figure_3(friction) | _correlation(friction) | _marginal(friction)
    if oscillator is not None:
        found |= _figure_5(oscillator)
    return [asdict(_claim(name, found.get(name))) for name in STATEMENTS]


def _claim(name: str, result: tuple[float, tuple[float, float], bool | str, str] | None) -> Claim:
    statement, paper = STATEMENTS[name]
    if result is None:
        return Claim(name, statement, paper, None, None, NOT_TESTED, "the scene does not run this stage", RULES[name])
    ours, interval, holds, note = result
    verdict = holds if isinstance(holds, str) else REPRODUCED if holds else NOT_REPRODUCED
    ends = float(interval[0]), float(interval[1])
    return Claim(name, statement, paper, float(ours), ends, verdict, note, RULES[name])


def _interval(arrays: Arrays, name: str, *index: Any) -> tuple[float, tuple[float, float]]:
    value, low, high = (float(np.asarray(arrays[name + suffix])[index]) for suffix in ("", "_low", "_high"))
    return value, (low, high)


def _figure_2(square: Arrays) -> dict[str, Any]:
    row = {str(name): i for i, name in enumerate(square["method"])}
    fit = {str(name): i for i, name in enumerate(square["fit"])}
    lhs, lhs_interval = _interval(square, "distance_in_contact", row["latin_hypercube"])
    eq8, eq8_interval = _interval(square, "distance_in_contact", row["equation_8"])
    eq9 = float(square["distance_in_contact"][row["equation_9"]])
    ours, ours_interval = _interval(square, "distance_in_contact", row["roughslip"])
    tail, tail_interval = _interval(square, "tail_error", row["equation_8"])
    between, between_interval = _interval(square, "distance_between_variants")
    samples = int(square["fit_samples"][fit["equation_8"]])
    all_samples = int(square["fit_samples"][fit["roughslip"]])
    return {
        "fig2-mcs-lhs": (lhs, lhs_interval, lhs_interval[1] < VISIBLE, "Kolmogorov distance given contact"),
        "fig2-pc-lhs": (
            eq8,
            eq8_interval,
            eq8_interval[1] < VISIBLE,
            f"Kolmogorov distance given contact of eq. (8) fitted to {samples} samples in contact; eq. (9) {eq9:.2f}; "
            f"the expansion of {all_samples} samples, in contact or not, {ours:.3f} "
            f"({ours_interval[0]:.3f} to {ours_interval[1]:.3f})",
        ),
        "fig2-pc-tail": (
            tail,
            tail_interval,
            tail_interval[1] < TAIL,
            "largest |log10| of the ratio to Monte Carlo; that of the expansion of all samples "
            f"{float(square['tail_error'][row['roughslip']]):.2f}",
        ),
        "fig2-variants-agree": (between, between_interval, between_interval[1] < VISIBLE, "Kolmogorov distance"),
    }


def _figure_3(friction: Arrays) -> dict[str, Any]:
    found = {}
    for name, key, title in (
        ("fig3-mean-decreases", "mean", "mean"),
        ("fig3-std-decreases", "std", "standard deviation"),
        ("fig3-cov-decreases", "variation", "coefficient of variation"),
    ):
        change, interval = _interval(friction, f"trend_combined_{key}_change")
        _, slope = _interval(friction, f"trend_combined_{key}_slope")
        values = friction[f"combined_{key}"]
        note = f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"
        found[name] = (change, interval, interval[1] < 0 and slope[1] < 0, note)
    return found


def _correlation(friction: Arrays) -> dict[str, Any]:
    median = int(np.flatnonzero(friction["percentile"] == 50.0)[0])
    nearer, nearer_interval = _interval(friction, "misfit_difference", 0, median)
    length, interval = _interval(friction, "length_least_squares", 0, median)
    change, change_interval = _interval(friction, "trend_length_least_squares_change", 0)
    allowed = SAME_LENGTH * float(np.mean(friction["length_least_squares"][0]))
    exponential, triangle = (float(friction[f"misfit_{name}"][0, median]) for name in ("exponential", "triangle"))
    other = {name: 1e6 * float(friction[f"length_{name}"][0, median]) for name in ("one_over_e", "integral")}
    return {
        "mu-correlation-exponential": (
            nearer,
            nearer_interval,
            nearer_interval[1] < 0,
            f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window",
        ),
        "mu-correlation-250um": (
            length,
            interval,
            interval[0] > PAPER_LENGTH * (1 - SAME_LENGTH) and interval[1] < PAPER_LENGTH * (1 + SAME_LENGTH),
            f"metres, least squares over lags to three windows; 1/e {other['one_over_e']:.0f} um, "
            f"integral {other['integral']:.0f} um",
        ),
        "mu-correlation-any-depth": (
            change,
            change_interval,
            change_interval[0] > -allowed and change_interval[1] < allowed,
            f"metres, change from the first to the last level; {1e6 * allowed:.0f} um are allowed",
        ),
    }


def _marginal(friction: Arrays) -> dict[str, Any]:
    median = int(np.flatnonzero(friction["percentile"] == 50.0)[0])
    skewness, skewness_interval = _interval(friction, "skewness", 0, median)
    kurtosis, kurtosis_interval = _interval(friction, "kurtosis", 0, median)
    distance, distance_interval = _interval(friction, "beta_distance_standardised", 0, median)
    farthest = int(np.argmax(friction["beta_distance_standardised_high"][0]))
    worst, worst_interval = _interval(friction, "beta_distance_standardised", 0, farthest)
    a, b = PAPER_BETA
    excess = 6 * ((a - b) ** 2 * (a + b + 1) - a * b * (a + b + 2)) / (a * b * (a + b + 2) * (a + b + 3))
    fitted = ", ".join(f"{float(friction[f'beta_{shape}'][0, median]):.2g}" for shape in "ab")
    scaled = ", ".join(f"{float(friction[f'scaled_beta_{shape}'][0, median]):.2g}" for shape in "ab")
    return {
        "mu-right-skewed": (skewness, skewness_interval, skewness_interval[0] > 0, "skewness at median penetration"),
        "mu-leptokurtic": (
            kurtosis,
            kurtosis_interval,
            CONTRADICTS if excess < 0 else kurtosis_interval[0] > 0,
            f"excess kurtosis at median penetration; Beta(2.1, 5) has {excess:.3f}",
        ),
        "mu-beta-2.1-5": (
            distance,
            distance_interval,
            distance_interval[1] < VISIBLE / 2,
            f"Kolmogorov distance, both standardised; fitted Beta({fitted}), after scaling by extremes Beta({scaled})",
        ),
        "mu-beta-any-depth": (
            worst,
            worst_interval,
            worst_interval[1] < VISIBLE / 2,
            f"Kolmogorov distance at percentile {float(friction['percentile'][farthest]):g}, the largest upper end",
        ),
    }


def _figure_5(oscillator: Arrays) -> dict[str, Any]:
    share, share_interval = _interval(oscillator, "cycling_share")
    nominal, limit = float(oscillator["nominal_damping"]), float(oscillator["deterministic_existence_limit"])
    found: dict[str, Any] = {}
    if np.isfinite(oscillator["reattachment_distance_to_normal"]):
        found["fig5-reattachment-nonnormal"] = _reattachment(oscillator)
    if not np.isfinite(limit):  # with excitation there is no equilibrium and no cycle of the free oscillator
        return found
    found["fig5-limit-cycle"] = (
        share,
        share_interval,
        nominal < limit and share_interval[0] > 0.95,
        f"share of the runs that cycle to the end at D = {nominal:g}; without scatter it exists up to {limit:.4f}",
    )
    damping, cycles = oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    below, above = damping < limit, damping > limit
    sharp = bool(np.all(cycles[below] >= 0.5 * cycles[0]) and np.all(cycles[above] <= 1) and above.any())
    found["fig5-sharp-limit"] = (limit, (limit - 1e-8, limit + 1e-8), sharp, "damping ratio, by bisection to 1e-8")
    low = oscillator["mean_cycles"] - 1.96 * oscillator["mean_cycles_error"]
    beyond = np.flatnonzero(above & (low > 1))
    farthest = float(damping[beyond[-1]]) if beyond.size else limit
    found["fig5-range-beyond-limit"] = (
        farthest,
        (limit, farthest),
        beyond.size > 0,
        "largest damping ratio of the list at which the mean number of cycles exceeds one; the interval is the range",
    )
    return found


def _reattachment(oscillator: Arrays) -> tuple[float, tuple[float, float], bool, str]:
    distance, interval = _interval(oscillator, "reattachment_distance_to_normal")
    skewness, skewness_interval = _interval(oscillator, "reattachment_skewness")
    kurtosis, kurtosis_interval = _interval(oscillator, "reattachment_kurtosis")
    shaped = any(low > 0 or high < 0 for low, high in (skewness_interval, kurtosis_interval))
    note = (
        f"Kolmogorov distance to the normal; skewness {skewness:.2f} ({skewness_interval[0]:.2f} to "
        f"{skewness_interval[1]:.2f}), excess kurtosis {kurtosis:.2f} ({kurtosis_interval[0]:.2f} to "
        f"{kurtosis_interval[1]:.2f})"
    )
    return distance, interval, interval[0] > 0.01 and shaped, note
