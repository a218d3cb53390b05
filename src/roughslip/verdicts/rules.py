"""The paper's statements, each with our number, its interval and a verdict that a written rule decides.

A rule asks for an interval on one side of an effect size; no verdict is set by hand. `reproduced` needs the whole
interval there, else the verdict is `not reproduced`. Where the interval reaches both sides the note says `undecided`. A
statement at odds with another number of the paper `contradicts itself`. Without numbers it is `not tested`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from roughslip.probability import beta_moments
from roughslip.verdicts.statements import P_VALUES, STATEMENTS

REPRODUCED, NOT_REPRODUCED = "reproduced", "not reproduced"
CONTRADICTS, NOT_TESTED = "contradicts itself", "not tested"
VISIBLE = 0.1  # Kolmogorov distance that a reader sees between two curves in print
WELL_CAPTURED = 0.9  # share of the variance below which the notes say what the modes carry
FACTOR = 2.0  # between small probabilities that still match
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
SAME_SKEWNESS = 0.5  # relative; the normal law, 0.05 from Beta(2.1, 5) in Kolmogorov distance, is off by 1
NON_NORMAL = 0.1  # skewness or excess kurtosis
CYCLING = 0.95  # share of the runs
CAN_CYCLE = 0.05  # share of the runs
LEAST_P = 1e-16  # smallest p-value reported
PAPER_LENGTH = 250e-6  # m
PAPER_BETA = (2.1, 5.0)
_, _, BETA_SKEWNESS, BETA_KURTOSIS = beta_moments(*PAPER_BETA)
SKEWNESS_RANGE = BETA_SKEWNESS * (1 - SAME_SKEWNESS), BETA_SKEWNESS * (1 + SAME_SKEWNESS)

SOLVED = 0  # row of the sources of the friction statistics

Arrays = Mapping[str, np.ndarray]
Interval = tuple[float, float]


@dataclass(frozen=True)
class Claim:
    """One statement: what the paper says, our number with its 95 % interval, the verdict and the rule behind it."""

    id: str
    statement: str
    paper: str
    ours: float | None
    interval: Interval | None
    verdict: str
    note: str
    rule: str


@dataclass(frozen=True)
class Finding:
    """Our number on a statement with its 95 % interval.

    holds : what the rule says, as `inside` does
    note : what the number is, and others that belong to it
    contradicts : whether another number of the paper is at odds with the statement
    """

    ours: float
    interval: Interval
    holds: int
    note: str
    contradicts: bool = False


_COINCIDE = f"the interval of the Kolmogorov distance given contact lies below {VISIBLE}"
_DECREASES = "the intervals of the slope over penetration and of last less first level both lie below zero"
_SKEWED_ALIKE = "that of the skewness from {:.2f} to {:.2f}, around the {:.2f} of Beta(2.1, 5)".format(
    *SKEWNESS_RANGE, BETA_SKEWNESS
)

RULES = {
    "fig2-mcs-lhs": _COINCIDE,
    "fig2-pc-lhs": _COINCIDE,
    "fig2-pc-tail": f"where Monte Carlo lies between 0.001, or the least that its samples resolve, and 0.1, eq. (8) is "
    f"within a factor of {FACTOR:g} of it: the interval of the largest |log10| of their ratio lies below "
    f"{np.log10(FACTOR):.3f}",
    "fig2-variants-agree": _COINCIDE,
    "fig3-mean-decreases": _DECREASES,
    "fig3-std-decreases": _DECREASES,
    "fig3-cov-decreases": _DECREASES,
    "mu-correlation-exponential": "at median penetration, mean square distance to the fitted exponential less "
    "that to the triangle of the window itself: the interval lies below zero",
    "mu-correlation-250um": "at median penetration the interval of the least-squares length lies within "
    f"{SAME_LENGTH:.0%} of 250 um",
    "mu-correlation-any-depth": f"the interval of the change from first to last level is within {SAME_LENGTH:.0%} of "
    "the mean length",
    "mu-right-skewed": "the interval of the skewness at median penetration lies above zero",
    "mu-leptokurtic": "contradicts itself if the paper's own Beta(2.1, 5) has negative excess kurtosis; else the "
    "interval of the excess kurtosis at median penetration lies above zero",
    "mu-beta-2.1-5": f"at median penetration the interval of the Kolmogorov distance, both standardised, lies below "
    f"{VISIBLE} and {_SKEWED_ALIKE}",
    "mu-beta-any-depth": f"at every level the interval of the Kolmogorov distance, both standardised, lies below "
    f"{VISIBLE} and {_SKEWED_ALIKE}",
    "fig5-limit-cycle": f"the damping lies below the deterministic limit, and the interval of the share of runs that "
    f"cycle to the end above {CYCLING}",
    "fig5-reattachment-nonnormal": f"the interval of the skewness or that of the excess kurtosis lies beyond "
    f"{NON_NORMAL} on either side of zero",
    "fig5-sharp-limit": "every damping of the list below the limit gives at least half the cycles of the least "
    "damping, every one above at most one. It is not tested if the list has only one side",
    "fig5-range-beyond-limit": "at some damping of the list above the deterministic limit the interval of the share of "
    f"runs that cycle to the end lies above {CAN_CYCLE}; not tested if the list has none",
}

NO_STAGE = "the scene does not run this stage"
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"
ONE_LEVEL = "the scene has one penetration only"
NO_LIMIT = "the oscillator has no limit of its own: it is excited, or has no cycle at any damping ratio"
ONE_SIDE = "the list of damping ratios does not reach both sides of the limit {:.4f}"


def claims(square: Arrays | None, friction: Arrays | None, oscillator: Arrays | None) -> list[dict[str, Any]]:
    """Every statement in the order of the paper, from the results of the branches that the scene runs.

    square, friction, oscillator : contents of chaos/square.nc, friction/statistics.nc, oscillator/statistics.nc
    """
    found: dict[str, Finding | str] = {}
    if square is not None:
        found |= _figure_2(square)
    if friction is not None:
        found |= _with_p_values(_figure_3(friction) | _correlation(friction) | _marginal(friction), friction)
    if oscillator is not None:
        found |= _figure_5(oscillator)
    return [asdict(_claim(name, found.get(name, NO_STAGE))) for name in STATEMENTS]


def _claim(name: str, found: Finding | str) -> Claim:
    """The verdict on a finding, or the reason why there is none."""
    statement, paper = STATEMENTS[name]
    if isinstance(found, Finding) and not np.isfinite([found.ours, *found.interval]).all():
        found = NO_NUMBER
    if isinstance(found, str):
        return Claim(name, statement, paper, None, None, NOT_TESTED, found, RULES[name])
    verdict, note = REPRODUCED if found.holds > 0 else NOT_REPRODUCED, found.note
    if found.contradicts:
        verdict = CONTRADICTS
    elif found.holds == 0:
        note += "; undecided, since the interval reaches both sides"
    return Claim(name, statement, paper, found.ours, found.interval, verdict, note, RULES[name])


def inside(interval: Interval, low: float = -np.inf, high: float = np.inf) -> int:
    """1 for an interval inside [low, high], -1 for one outside, 0 for one that reaches both sides and decides nothing.

    The least of several numbers is their conjunction, the largest their disjunction (Kleene's logic).
    """
    if low < interval[0] and interval[1] < high:
        return 1
    return -1 if interval[1] <= low or high <= interval[0] else 0


def _number(arrays: Arrays, name: str, *index: int) -> tuple[float, Interval]:
    value, low, high = (float(np.asarray(arrays[name + suffix])[index]) for suffix in ("", "_low", "_high"))
    return value, (low, high)


def _judged(arrays: Arrays, name: str, *index: int, low: float = -np.inf, high: float = np.inf, note: str) -> Finding:
    """The rule that wants the interval of one stored number between low and high."""
    value, interval = _number(arrays, name, *index)
    return Finding(value, interval, inside(interval, low, high), note)


def _shown(number: tuple[float, Interval], digits: int = 2) -> str:
    value, (low, high) = number
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _figure_2(square: Arrays) -> dict[str, Finding | str]:
    row = {str(name): i for i, name in enumerate(square["method"])}
    samples = {str(name): f"{count:.0f}" for name, count in zip(square["fit"], square["fit_samples"], strict=True)}
    fit = {str(name): i for i, name in enumerate(square["fit"])}
    at_contact = [float(square["fit_distance_at_contact"][fit[name]]) for name in ("equation_8", "equation_9")]
    positive = float(square["fit_positive_share"][fit["equation_8"]])
    equation_9, ours = (_number(square, "distance_in_contact", row[name]) for name in ("equation_9", "roughslip"))
    note = "Kolmogorov distance given contact"
    captured = float(square["captured_variance"])
    if captured < WELL_CAPTURED:
        note = f"the modes carry {captured:.0%} of the variance of the surface; {note}"
    return {
        "fig2-mcs-lhs": _judged(square, "distance_in_contact", row["latin_hypercube"], high=VISIBLE, note=note),
        "fig2-pc-lhs": _judged(
            square,
            "distance_in_contact",
            row["equation_8"],
            high=VISIBLE,
            note=f"{note} of eq. (8), fitted to {samples['equation_8']} samples in contact; that of eq. (9) "
            f"{_shown(equation_9)}, of the expansion of {samples['roughslip']} samples, in contact or not, "
            f"{_shown(ours, 3)}. At samples that a solve found in contact, new ones too, eqs. (8) and (9) have "
            f"{at_contact[0]:.3f} and {at_contact[1]:.3f}; at all samples eq. (8) is positive in {positive:.0%}",
        ),
        "fig2-pc-tail": _judged(
            square,
            "tail_error",
            row["equation_8"],
            high=float(np.log10(FACTOR)),
            note="largest |log10| of the ratio to Monte Carlo; that of the expansion of all samples "
            f"{_shown(_number(square, 'tail_error', row['roughslip']))}",
        ),
        "fig2-variants-agree": _judged(square, "distance_between_variants", high=VISIBLE, note=note),
    }


def _figure_3(friction: Arrays) -> dict[str, Finding | str]:
    titles = {"mean": "mean", "std": "standard deviation", "variation": "coefficient of variation"}
    found: dict[str, Finding | str] = {}
    for name, (key, title) in zip(("mean", "std", "cov"), titles.items(), strict=True):
        if len(friction["percentile"]) == 1:
            found[f"fig3-{name}-decreases"] = ONE_LEVEL
            continue
        change, interval = _number(friction, f"trend_combined_{key}_change")
        _, slope = _number(friction, f"trend_combined_{key}_slope")
        values = friction[f"combined_{key}"]
        note = f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"
        holds = min(inside(interval, high=0.0), inside(slope, high=0.0))
        found[f"fig3-{name}-decreases"] = Finding(change, interval, holds, note)
    return found


def _with_p_values(found: dict[str, Finding | str], friction: Arrays) -> dict[str, Finding | str]:
    """The findings, whose notes end in the p-value of the hypothesis that goes with them where there is one."""
    for name, (variable, hypothesis) in P_VALUES.items():
        finding, p = found[name], float(friction[variable])
        if isinstance(finding, Finding) and np.isfinite(p):
            found[name] = replace(finding, note=f"{finding.note}; {hypothesis}: p = {p:.2g}")
    return found


def _median(friction: Arrays) -> int:
    return int(np.flatnonzero(friction["percentile"] == 50.0)[0])


def _correlation(friction: Arrays) -> dict[str, Finding | str]:
    median, lengths = _median(friction), friction["length_least_squares"][SOLVED]
    exponential, triangle = (float(friction[f"misfit_{name}"][SOLVED, median]) for name in ("exponential", "triangle"))
    one_over_e, integral = (
        1e6 * float(friction[f"length_{name}"][SOLVED, median]) for name in ("one_over_e", "integral")
    )
    allowed = SAME_LENGTH * float(np.mean(lengths))
    shorter = _window(friction) * PAPER_LENGTH / float(lengths[median])
    return {
        "mu-correlation-exponential": _judged(
            friction,
            "misfit_difference",
            SOLVED,
            median,
            high=0.0,
            note=f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window",
        ),
        "mu-correlation-250um": _judged(
            friction,
            "length_least_squares",
            SOLVED,
            median,
            low=PAPER_LENGTH * (1 - SAME_LENGTH),
            high=PAPER_LENGTH * (1 + SAME_LENGTH),
            note="metres, least squares to lags of three windows; "
            f"1/e {one_over_e:.0f} um, integral {integral:.0f} um; "
            f"the length goes with the window, and one of {1e6 * shorter:.0f} um would give the paper's",
        ),
        "mu-correlation-any-depth": ONE_LEVEL
        if len(lengths) == 1
        else _judged(
            friction,
            "trend_length_least_squares_change",
            SOLVED,
            low=-allowed,
            high=allowed,
            note=f"metres, change from the first to the last level; {1e6 * allowed:.0f} um are allowed; over all "
            f"levels {1e6 * lengths.min():.0f} to {1e6 * lengths.max():.0f} um",
        ),
    }


def _window(friction: Arrays) -> float:
    """Length of a window [m], at which its own triangle ends."""
    return float(friction["lag"][1] / (1.0 - friction["triangle"][1]))


def _window_of_the_beta(friction: Arrays, skewness: float) -> str:
    """Which window would have the skewness of the paper's Beta: that of a mean falls with the root of what it is of."""
    if not skewness > 0:
        return "no window would have the skewness of Beta(2.1, 5)"
    window = 1e6 * _window(friction) * (skewness / BETA_SKEWNESS) ** 2
    return f"a window of {window:.0f} um would have the skewness of Beta(2.1, 5), {BETA_SKEWNESS:.2f}"


def _follows_beta(friction: Arrays, level: int) -> int:
    """Whether the law at a level has the shape of the paper's: by its distance alone the normal law would pass."""
    _, distance = _number(friction, "beta_distance_standardised", SOLVED, level)
    _, skewness = _number(friction, "skewness", SOLVED, level)
    return min(inside(distance, high=VISIBLE), inside(skewness, *SKEWNESS_RANGE))


def _marginal(friction: Arrays) -> dict[str, Finding | str]:
    median, levels = _median(friction), range(len(friction["percentile"]))
    kurtosis, kurtosis_interval = _number(friction, "kurtosis", SOLVED, median)
    follows = [_follows_beta(friction, level) for level in levels]
    farthest = int(np.argmax(friction["beta_distance_standardised_high"][SOLVED]))
    skewness = friction["skewness"][SOLVED]
    at_bound = " (at the end of the range of shapes: they are not determined)"
    at_bound = at_bound if friction["beta_at_bound"][SOLVED, median] else ""
    fitted, scaled = (
        ", ".join(f"{float(friction[f'{name}_{shape}'][SOLVED, median]):.3g}" for shape in "ab")
        for name in ("beta", "scaled_beta")
    )
    return {
        "mu-right-skewed": _judged(
            friction,
            "skewness",
            SOLVED,
            median,
            low=0.0,
            note=f"skewness at median penetration; over all levels {skewness.min():.2f} to {skewness.max():.2f}",
        ),
        "mu-leptokurtic": Finding(
            kurtosis,
            kurtosis_interval,
            inside(kurtosis_interval, low=0.0),
            f"excess kurtosis at median penetration; Beta(2.1, 5) has {BETA_KURTOSIS:.3f}",
            contradicts=BETA_KURTOSIS < 0,
        ),
        "mu-beta-2.1-5": Finding(
            *_number(friction, "beta_distance_standardised", SOLVED, median),
            follows[median],
            f"Kolmogorov distance; skewness {_shown(_number(friction, 'skewness', SOLVED, median))}; fitted "
            f"Beta({fitted}){at_bound}, after scaling by the sample extremes Beta({scaled}); "
            f"{_window_of_the_beta(friction, float(skewness[median]))}",
        ),
        "mu-beta-any-depth": Finding(
            *_number(friction, "beta_distance_standardised", SOLVED, farthest),
            min(follows),
            f"Kolmogorov distance at percentile {float(friction['percentile'][farthest]):g}, of the largest upper end; "
            f"{follows.count(1)} of {len(levels)} levels follow it; skewness {skewness.min():.2f} to "
            f"{skewness.max():.2f}",
        ),
    }


def _figure_5(oscillator: Arrays) -> dict[str, Finding | str]:
    found: dict[str, Finding | str] = {"fig5-reattachment-nonnormal": _reattachment(oscillator)}
    nominal, limit = float(oscillator["nominal_damping"]), float(oscillator["deterministic_existence_limit"])
    if not np.isfinite(limit):
        return found | dict.fromkeys(("fig5-limit-cycle", "fig5-sharp-limit", "fig5-range-beyond-limit"), NO_LIMIT)
    share, interval = _number(oscillator, "cycling_share")
    found["fig5-limit-cycle"] = Finding(
        share,
        interval,
        min(inside((nominal, nominal), high=limit), inside(interval, low=CYCLING)),
        f"share of the runs that cycle to the end at D = {nominal:g}; without scatter the cycle exists up to "
        f"{limit:.4f}",
    )
    damping, cycles = oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    below, above = damping < limit, damping > limit
    if below.any() and above.any():
        sharp = np.all(cycles[below] >= 0.5 * cycles[0]) and np.all(cycles[above] <= 1)
        note = "damping ratio, root of the return map of slip, to 1e-8"
        found["fig5-sharp-limit"] = Finding(limit, (limit - 1e-8, limit + 1e-8), 1 if sharp else -1, note)
    else:
        found["fig5-sharp-limit"] = ONE_SIDE.format(limit)
    found["fig5-range-beyond-limit"] = _beyond(oscillator, above) if above.any() else ONE_SIDE.format(limit)
    return found


def _beyond(oscillator: Arrays, above: np.ndarray) -> Finding:
    """The share of runs that cycle to the end at the damping above the limit where it is largest, and the reach.

    The mean number of cycles would not do: just above the limit every run makes a few before its cycle dies out.
    """
    damping, cycles = oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    low = np.where(above, oscillator["still_cycling_low"], -np.inf)
    surest = int(np.argmax(low))
    cycling = damping[low > CAN_CYCLE]
    note = f"share of the runs that cycle to the end at D = {damping[surest]:g}, where M_d = {int(cycles[surest])} and "
    note += f"E[M_S] = {float(oscillator['mean_cycles'][surest]):.1f}"
    reach = f"; above {CAN_CYCLE:g} up to D = {cycling[-1]:g}" if cycling.size else ""
    share, interval = _number(oscillator, "still_cycling", surest)
    return Finding(share, interval, inside(interval, low=CAN_CYCLE), note + reach)


def _reattachment(oscillator: Arrays) -> Finding:
    distance, interval = _number(oscillator, "reattachment_distance_to_normal")
    skewness, kurtosis = (_number(oscillator, f"reattachment_{moment}") for moment in ("skewness", "kurtosis"))
    beyond = (max(inside(m, low=NON_NORMAL), inside(m, high=-NON_NORMAL)) for _, m in (skewness, kurtosis))
    moments_p, anderson_p = (float(oscillator[f"normality_{test}_p"]) for test in ("jarque_bera", "anderson_darling"))
    note = f"skewness; excess kurtosis {_shown(kurtosis)}; "
    note += f"p of normality {max(moments_p, LEAST_P):.1g} by these two and "
    note += f"{anderson_p:.1g} by Anderson and Darling, of cycles as dependent as those of a run; "
    note += f"Kolmogorov distance to the normal {distance:.3f} "
    note += f"({interval[0]:.3f} to {interval[1]:.3f}), less than an eye sees in a histogram"
    return Finding(*skewness, max(beyond), note if interval[1] < VISIBLE else note.rpartition(",")[0])
