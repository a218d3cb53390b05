"""Verdicts on the paper's statements, each from our number and its interval by its written rule.

A rule asks for an interval on one side of an effect size; no verdict is set by hand. A statement is `reproduced` where
the whole interval lies there, `contradicted` where it lies on the other side, `undecided` where it reaches both. One at
odds with another number of the paper `contradicts itself`. Without numbers it is `not tested`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from roughslip.friction.penetration import between
from roughslip.verdicts.finding import (
    CONTRADICTS,
    NOT_TESTED,
    VERDICTS,
    Arrays,
    Finding,
    Interval,
    inside,
    judged_inside,
    number,
)
from roughslip.verdicts.friction_rules import FRICTION_RULES, at_median, farthest, follows_beta, median
from roughslip.verdicts.statements import P_VALUES, RULES, STATEMENTS, UNITLESS, UNITS
from roughslip.verdicts.thresholds import (
    BETA_KURTOSIS,
    BETA_SKEWNESS,
    CAN_CYCLE,
    CYCLING,
    FACTOR,
    NON_NORMAL,
    PAPER_LENGTH,
    SEEN_RANGE,
    VISIBLE,
)
from roughslip.verdicts.turning import in_unit, what_turns

WELL_CAPTURED = 0.9  # share of the variance below which the notes say what the modes carry
LEAST_P = 1e-16  # smallest p-value reported

NO_STAGE = "the scene does not run this stage"
NO_NUMBER = "the number does not exist in this scene: a fit was refused, or no run sticks again; the logs say why"
ONE_LEVEL = "the scene has one penetration only"
NO_LIMIT = "the oscillator has no limit of its own: it is excited, or has no cycle at any damping ratio"
OF_LOAD = "penetration and windows follow from the load, so the runs have its scatter already"
NO_END = "the list of damping ratios does not reach surely beyond the range, or its runs are too few"
ONE_SIDE = "the list of damping ratios does not reach both sides of the limit {:.4f}"

Rule = Callable[[Arrays], Finding | str]  # a text says why the statement cannot be tested


def claims(square: Arrays | None, friction: Arrays | None, oscillator: Arrays | None) -> list[dict[str, Any]]:
    """Every statement in the order of the paper and then our own, from the results of the branches that the scene runs.

    square, friction, oscillator : contents of chaos/square.nc, friction/statistics.nc, oscillator/statistics.nc

    Each is a mapping with id, statement, paper, unit (of the next two), ours, interval (low, high), shown (both in the
    unit that a reader uses), verdict, turns (what would turn it), note and rule.
    """
    both = None if friction is None or oscillator is None else {**friction, **oscillator}
    of_paper = (square, ON_THE_SQUARE), (friction, ON_FRICTION), (oscillator, ON_THE_OSCILLATOR)
    branches = (*of_paper, (both, ON_LOAD))
    return [_claim(name, rule, arrays) for arrays, rules in branches for name, rule in rules.items()]


def _claim(name: str, rule: Rule, arrays: Arrays | None) -> dict[str, Any]:
    """The verdict on a statement, or the reason why there is none."""
    found = NO_STAGE if arrays is None else rule(arrays)
    if arrays is None or isinstance(found, str) or not np.isfinite([found.ours, *found.interval]).all():
        why = found if isinstance(found, str) else NO_NUMBER
        judged: dict[str, Any] = dict.fromkeys(("ours", "interval", "shown", "turns"))
        judged |= {"verdict": NOT_TESTED, "note": why}
    else:
        verdict, note = CONTRADICTS if found.contradicts else VERDICTS[found.holds(found.interval)], found.note
        variable, hypothesis = P_VALUES.get(name, ("", ""))
        if variable and np.isfinite(p := float(arrays[variable])):
            note += f"; {hypothesis}: p = {p:.2g}"
        low, high = found.interval
        shown = f"{in_unit(name, found.ours)} ({in_unit(name, low)} to {in_unit(name, high)})"
        judged = {"ours": found.ours, "interval": found.interval, "shown": shown, "turns": what_turns(name, found)}
        judged |= {"verdict": verdict, "note": note}
    statement, paper = STATEMENTS[name]
    unit = UNITS.get(name, UNITLESS)[0]
    return {"id": name, "statement": statement, "paper": paper, "unit": unit, **judged, "rule": RULES[name]}


def _shown(stored: tuple[float, Interval], digits: int = 2) -> str:
    value, (low, high) = stored
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _of_method(square: Arrays, name: str, method: str) -> tuple[float, Interval]:
    return number(square, name, [str(one) for one in square["method"]].index(method))


def _distance_note(square: Arrays) -> str:
    captured = float(square["captured_variance"])
    truncated = f"the modes carry {captured:.0%} of the variance of the surface; " if captured < WELL_CAPTURED else ""
    return f"{truncated}Kolmogorov distance given contact"


def _coincide(square: Arrays, distance: tuple[float, Interval]) -> Finding:
    return judged_inside(distance, _distance_note(square), high=VISIBLE)


def _equation_8(square: Arrays) -> Finding:
    first, second, ours = (
        _of_method(square, "distance_in_contact", m) for m in ("equation_8", "equation_9", "roughslip")
    )
    fits = [str(name) for name in square["fit"]]
    row_8, row_9, row_all = (fits.index(name) for name in ("equation_8", "equation_9", "roughslip"))
    samples, at_contact = square["fit_samples"], square["fit_distance_at_contact"]
    note = (
        f"{_distance_note(square)} of eq. (8), fitted to {samples[row_8]:.0f} samples in contact; that of eq. (9) "
        f"{_shown(second)}, of the expansion of {samples[row_all]:.0f} samples, in contact or not, {_shown(ours, 3)}. "
        f"At samples that a solve found in contact, new ones too, eqs. (8) and (9) have {at_contact[row_8]:.3f} and "
        f"{at_contact[row_9]:.3f}; at all samples eq. (8) is positive in {square['fit_positive_share'][row_8]:.0%}"
    )
    return judged_inside(first, note, high=VISIBLE)


def _tail(square: Arrays) -> Finding:
    ours = _shown(_of_method(square, "tail_error", "roughslip"))
    note = f"largest |log10| of the ratio to the solved samples; that of the expansion of all samples {ours}"
    return judged_inside(_of_method(square, "tail_error", "equation_8"), note, high=float(np.log10(FACTOR)))


def _noted(name: str) -> Rule:
    """The rule of a statement on friction, with the note on its finding."""

    def rule(friction: Arrays) -> Finding | str:
        found = FRICTION_RULES[name](friction)
        return ONE_LEVEL if found is None else replace(found, note=NOTES[name](friction, found))

    return rule


def _on_decrease(friction: Arrays, _: Finding, key: str, title: str) -> str:
    values = friction[f"combined_{key}"]
    return f"change of the {title} from the first to the last level, from {values[0]:.3g} to {values[-1]:.3g}"


def _window(friction: Arrays) -> float:
    """Length of a window [m], at which its own triangle ends."""
    return float(friction["lag"][1] / (1.0 - friction["triangle"][1]))


def _on_exponential(friction: Arrays, _: Finding) -> str:
    exponential, triangle = (friction[f"misfit_{name}"][median(friction)] for name in ("exponential", "triangle"))
    return f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window"


def _on_length(friction: Arrays, found: Finding) -> str:
    one_over_e, integral = (1e6 * friction[f"length_{name}"][median(friction)] for name in ("one_over_e", "integral"))
    shorter = 1e6 * _window(friction) * PAPER_LENGTH / found.ours
    return (
        f"metres, least squares to lags of three windows; 1/e {one_over_e:.0f} µm, integral {integral:.0f} µm; the "
        f"length goes with the window, and one of {shorter:.0f} µm would give the paper's"
    )


def _on_length_at_any_depth(friction: Arrays, found: Finding) -> str:
    lengths = friction["combined_length_least_squares"]
    return (
        f"metres, change along a straight line through all levels; {1e6 * found.thresholds[1]:.0f} µm are allowed; the "
        f"levels have {1e6 * lengths.min():.0f} to {1e6 * lengths.max():.0f} µm"
    )


def _on_skewness(friction: Arrays, _: Finding) -> str:
    skewness = friction["combined_skewness"]
    return f"skewness at median penetration; over all levels {skewness.min():.2f} to {skewness.max():.2f}"


def _on_beta(friction: Arrays, _: Finding) -> str:
    middle, skewness = median(friction), at_median(friction, "skewness")
    fitted, scaled = (
        ", ".join(f"{friction[f'{name}_{shape}'][middle]:.3g}" for shape in "ab") for name in ("beta", "scaled_beta")
    )
    at_bound = friction["beta_at_bound"][middle]
    undetermined = " (at the end of the range of shapes: they are not determined)" if at_bound else ""
    return (
        f"Kolmogorov distance; skewness {_shown(skewness)}; fitted Beta({fitted}){undetermined}, after scaling by the "
        f"sample extremes Beta({scaled}); {_window_of_the_beta(friction, skewness[0])}"
    )


def _window_of_the_beta(friction: Arrays, skewness: float) -> str:
    """Which window would have the skewness of the paper's Beta: that of a mean falls with the root of its window."""
    if not skewness > 0:
        return "no window would have the skewness of Beta(2.1, 5)"
    window = 1e6 * _window(friction) * (skewness / BETA_SKEWNESS) ** 2
    return f"a window of {window:.0f} µm would have the skewness of Beta(2.1, 5), {BETA_SKEWNESS:.2f}"


def _on_beta_at_any_depth(friction: Arrays, _: Finding) -> str:
    follows, skewness = follows_beta(friction), friction["combined_skewness"]
    return (
        f"Kolmogorov distance at percentile {friction['percentile'][farthest(friction)]:g}, of the largest upper end; "
        f"{follows.count(1)} of {len(follows)} levels follow it; skewness {skewness.min():.2f} to {skewness.max():.2f}"
    )


def _limit(oscillator: Arrays) -> float:
    return float(oscillator["deterministic_existence_limit"])


def _limit_cycle(oscillator: Arrays) -> Finding | str:
    nominal, limit = float(oscillator["nominal_damping"]), _limit(oscillator)
    if not np.isfinite(limit):
        return NO_LIMIT
    damping = judged_inside((nominal, (nominal, nominal)), "damping ratio", high=limit)
    note = (
        f"share of the runs that cycle to the end at D = {nominal:g}; without scatter a cycle exists up to {limit:.4f}"
    )
    return replace(judged_inside(number(oscillator, "cycling_share"), note, low=CYCLING), other=damping)


def _sharp_limit(oscillator: Arrays) -> Finding | str:
    limit, damping, cycles = _limit(oscillator), oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    if not np.isfinite(limit):
        return NO_LIMIT
    below, above = damping < limit, damping > limit
    if not (below.any() and above.any()):
        return ONE_SIDE.format(limit)
    sharp = np.all(cycles[below] >= 0.5 * cycles[0]) and np.all(cycles[above] <= 1)
    note = "damping ratio, root of the return map of slip, to 1e-8"
    return Finding(limit, (limit - 1e-8, limit + 1e-8), note, lambda _: 1 if sharp else -1)


def _beyond_limit(oscillator: Arrays) -> Finding | str:
    """The share of runs that cycle to the end at the damping above the limit where it is largest, and the reach.

    The mean number of cycles would not do: just above the limit every run makes a few before its cycle dies out.
    """
    limit, damping, cycles = _limit(oscillator), oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    if not np.isfinite(limit):
        return NO_LIMIT
    if not np.any(damping > limit):
        return ONE_SIDE.format(limit)
    low = np.where(damping > limit, oscillator["still_cycling_low"], -np.inf)
    surest, cycling = int(np.argmax(low)), damping[low > CAN_CYCLE]
    reach = f"; above {CAN_CYCLE:g} up to D = {cycling[-1]:g}" if cycling.size else ""
    note = (
        f"share of the runs that cycle to the end at D = {damping[surest]:g}, where M_d = {int(cycles[surest])} and "
        f"E[M_S] = {oscillator['mean_cycles'][surest]:.1f}{reach}"
    )
    return judged_inside(number(oscillator, "still_cycling", surest), note, low=CAN_CYCLE)


def _under_load(both: Arrays) -> Finding | str:
    """The range of damping beyond the limit, scaled from the scatter of the runs to that of the load's windows."""
    limit, damping = _limit(both), both["damping_ratio"]
    if not np.isfinite(limit):
        return NO_LIMIT
    still = damping[(damping > limit) & (both["still_cycling_low"] > CAN_CYCLE)]
    last = float(still.max(initial=limit))
    beyond = damping[(damping > last) & (both["still_cycling_high"] < CAN_CYCLE)]
    if not beyond.size:
        return NO_END
    percentile, scatter = float(both["friction_percentile"]), float(both["friction_scatter"])
    if percentile < both["percentile"][0]:
        return OF_LOAD
    names = ("load_windows", "load_std", "load_std_low", "load_std_high")
    windows, *std = (between(both["percentile"], both[name], percentile) for name in names)
    low, high = last / limit - 1.0, float(beyond[0]) / limit - 1.0
    ends = np.array([(low + high) / 2.0, low, high])
    ours, *interval = (ends * std / scatter).tolist()
    note = (
        f"share of the limit {limit:.4f}; at percentile {percentile:g} {windows:.4g} windows bear the force, and their "
        f"friction scatters by {std[0]:.2g}. In the runs it scatters by {scatter:.2g}, and the range ends between "
        f"{low:.2%} and {high:.2%}"
    )
    return judged_inside((ours, (interval[0], interval[1])), note, low=SEEN_RANGE)


def _reattachment(oscillator: Arrays) -> Finding:
    distance, skewness, kurtosis = (
        number(oscillator, f"reattachment_{name}") for name in ("distance_to_normal", "skewness", "kurtosis")
    )
    moments_p, anderson_p = (float(oscillator[f"normality_{test}_p"]) for test in ("jarque_bera", "anderson_darling"))
    unseen = ", less than an eye sees in a histogram" if distance[1][1] < VISIBLE else ""
    note = (
        f"skewness; excess kurtosis {_shown(kurtosis)}; p of normality {max(moments_p, LEAST_P):.1g} by these two and "
        f"{anderson_p:.1g} by Anderson and Darling, of cycles as dependent as those of a run; Kolmogorov distance to "
        f"the normal {_shown(distance, 3)}{unseen}"
    )
    peaked = Finding(*kurtosis, "excess kurtosis", _beyond_normal, (-NON_NORMAL, NON_NORMAL))
    return Finding(*skewness, note, _beyond_normal, peaked.thresholds, peaked, max)


def _beyond_normal(moment: Interval) -> int:
    return max(inside(moment, low=NON_NORMAL), inside(moment, high=-NON_NORMAL))


ON_THE_SQUARE: dict[str, Rule] = {
    "fig2-mcs-lhs": lambda square: _coincide(square, _of_method(square, "distance_in_contact", "latin_hypercube")),
    "fig2-pc-lhs": _equation_8,
    "fig2-pc-tail": _tail,
    "fig2-variants-agree": lambda square: _coincide(square, number(square, "distance_between_variants")),
}
NOTES: dict[str, Callable[[Arrays, Finding], str]] = {
    "fig3-mean-decreases": partial(_on_decrease, key="mean", title="mean"),
    "fig3-std-decreases": partial(_on_decrease, key="std", title="standard deviation"),
    "fig3-cov-decreases": partial(_on_decrease, key="variation", title="coefficient of variation"),
    "mu-correlation-exponential": _on_exponential,
    "mu-correlation-250um": _on_length,
    "mu-correlation-any-depth": _on_length_at_any_depth,
    "mu-right-skewed": _on_skewness,
    "mu-leptokurtic": lambda _, __: f"excess kurtosis at median penetration; Beta(2.1, 5) has {BETA_KURTOSIS:.3f}",
    "mu-beta-2.1-5": _on_beta,
    "mu-beta-any-depth": _on_beta_at_any_depth,
}
ON_FRICTION: dict[str, Rule] = {name: _noted(name) for name in FRICTION_RULES}
ON_THE_OSCILLATOR: dict[str, Rule] = {
    "fig5-limit-cycle": _limit_cycle,
    "fig5-reattachment-nonnormal": _reattachment,
    "fig5-sharp-limit": _sharp_limit,
    "fig5-range-beyond-limit": _beyond_limit,
}
ON_LOAD: dict[str, Rule] = {"own-fig5-under-load": _under_load}
