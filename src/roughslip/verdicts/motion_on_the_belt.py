"""Figure 5: limit cycle, reattachment point, limits of damping; then our own statement. Text, readings, rules."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from roughslip.friction.penetration import between
from roughslip.verdicts.centre_pressure import shown
from roughslip.verdicts.finding import Arrays, Finding, Interval, inside, judged_inside, number
from roughslip.verdicts.reading import SHARE, VISIBLE, Reading, Statement

NON_NORMAL = 0.1  # skewness or excess kurtosis
CYCLING = 0.95  # share of the runs
CAN_CYCLE = 0.05  # share of the runs
SEEN_SHARE = 0.01  # of the time in stick-slip without scatter: more than a few single returns of all runs
SEEN_RANGE = 0.01  # of the limit of damping: a range beyond it that a reader of figure 5 sees
LEAST_P = 1e-16  # smallest p-value reported
LEAST_ANDERSON_P = 1 / 400  # of 399 Gaussian ensembles, see oscillator.cycles
NO_LIMIT = "the oscillator has no limit of its own: it is excited, or has no cycle at any damping ratio"
OF_LOAD = "penetration and windows follow from the load, so the runs have its scatter already"
NO_END = "the list of damping ratios does not reach surely beyond the range, or its runs are too few"
ONE_SIDE = "the list of damping ratios does not reach both sides of the limit {:.4f}"
MOVES = "section 5: “Figure 5 displays the limit cycle”"
SEEN = "section 5: “it can be clearly seen that also the reattachment point is nonnormally distributed”"
RANGE = "section 5: a range of damping “where the stochastic system can still move on the limit cycle”"


def _limit(oscillator: Arrays) -> float:
    return float(oscillator["deterministic_existence_limit"])


def _limit_cycle(oscillator: Arrays) -> Finding | str:
    nominal, limit = float(oscillator["nominal_damping"]), _limit(oscillator)
    if not np.isfinite(limit):
        return NO_LIMIT
    damping = judged_inside((nominal, (nominal, nominal)), "damping ratio", high=limit, centre=None)
    note = (
        f"share of the runs with a cycle in the closing periods at D = {nominal:g}; without scatter a cycle exists up "
        f"to {limit:.4f}"
    )
    return replace(judged_inside(number(oscillator, "cycling_share"), note, low=CYCLING, centre=1.0), other=damping)


def _time_on_the_cycle(oscillator: Arrays) -> Finding | str:
    nominal, limit, damping = float(oscillator["nominal_damping"]), _limit(oscillator), oscillator["damping_ratio"]
    if not np.isfinite(limit):
        return NO_LIMIT
    rows = np.flatnonzero((damping == nominal) & (damping < limit))
    if not rows.size:
        return f"the scene's own damping ratio, {nominal:g}, is not in the list below the limit {limit:.4f}"
    note = f"share of the time in stick-slip at D = {nominal:g}; without scatter it is 1"
    return judged_inside(number(oscillator, "stick_slip_share", int(rows[0])), note, low=CYCLING, centre=1.0)


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


def _lost_cycles(oscillator: Arrays) -> Finding | str:
    """Share of the time in stick-slip, and M_diff, at the damping above the limit where the share is surest."""
    limit, damping = _limit(oscillator), oscillator["damping_ratio"]
    if not np.isfinite(limit):
        return NO_LIMIT
    rows = np.flatnonzero(damping > limit)
    if not rows.size or len(rows) == len(damping):
        return ONE_SIDE.format(limit)
    low = np.nan_to_num(oscillator["stick_slip_share_low"][rows], nan=-1.0)  # where no run reaches a state
    row, seen = int(rows[np.argmax(low)]), damping[rows[low > SEEN_SHARE]]
    difference = [-float(oscillator[f"difference{end}"][row]) for end in ("", "_high", "_low")]
    reach = f"; above {SEEN_SHARE:.0%} up to D = {seen[-1]:g}" if seen.size else ""
    note = (
        f"share of the time in stick-slip at D = {damping[row]:g}, where M_diff = {-difference[0]:.2f} "
        f"({-difference[2]:.2f} to {-difference[1]:.2f}){reach}. A run may leave the cycle and come back to it"
    )
    return judged_inside(number(oscillator, "stick_slip_share", row), note, low=SEEN_SHARE)


def _every_return(oscillator: Arrays) -> Finding | str:
    """Returns to the belt beyond the limit, over the cycles without scatter at the last damping below it."""
    limit, damping = _limit(oscillator), oscillator["damping_ratio"]
    if not np.isfinite(limit):
        return NO_LIMIT
    if not (np.any(damping > limit) and np.any(damping < limit)):
        return ONE_SIDE.format(limit)
    cycles = float(oscillator["deterministic_cycles"][damping < limit][-1])
    row = int(np.argmax(np.where(damping > limit, oscillator["returns_low"], -np.inf)))
    value, (low, high) = number(oscillator, "returns", row)
    note = (
        f"mean returns to the belt at D = {damping[row]:g}, {value:.1f}, over the {cycles:.0f} cycles below the limit"
    )
    return judged_inside((value / cycles, (low / cycles, high / cycles)), note, low=SEEN_SHARE)


def _runs_at_the_end(oscillator: Arrays) -> Finding | str:
    """The share of runs with a cycle in the closing periods at the damping above the limit where it is largest."""
    limit, damping, cycles = _limit(oscillator), oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    if not np.isfinite(limit):
        return NO_LIMIT
    if not np.any(damping > limit):
        return ONE_SIDE.format(limit)
    low = np.where(damping > limit, oscillator["still_cycling_low"], -np.inf)
    surest, cycling = int(np.argmax(low)), damping[low > CAN_CYCLE]
    reach = f"; above {CAN_CYCLE:g} up to D = {cycling[-1]:g}" if cycling.size else ""
    note = (
        f"share of the runs with a cycle in the closing periods at D = {damping[surest]:g}, where M_d = "
        f"{int(cycles[surest])} and E[M_S] = {oscillator['mean_cycles'][surest]:.1f}{reach}"
    )
    return judged_inside(number(oscillator, "still_cycling", surest), note, low=CAN_CYCLE)


def _under_load(both: Arrays, kind: str) -> Finding | str:
    """The range of damping beyond the limit, scaled from the friction of the runs to that of the load's windows.

    kind : of scatter, additive or multiplicative
    """
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
    response = float(both[f"load_response_{kind}"])
    ends = np.array([(low + high) / 2.0, low, high]) * response
    ours, *interval = (ends * std / scatter).tolist()
    note = (
        f"share of the limit {limit:.4f}; at percentile {percentile:g} {windows:.4g} windows bear the force, and their "
        f"friction scatters by {std[0]:.2g}, over a length at which scatter moves the limit {response:.2g} times as "
        f"far. In the runs it scatters by {scatter:.2g}, and the range ends between {low:.2%} and {high:.2%}"
    )
    return judged_inside((ours, (interval[0], interval[1])), note, low=SEEN_RANGE)


def _moments(oscillator: Arrays, factor: float = 1.0) -> Finding:
    skewness, kurtosis = (number(oscillator, f"reattachment_{name}") for name in ("skewness", "kurtosis"))
    moments_p, anderson_p = (float(oscillator[f"normality_{test}_p"]) for test in ("jarque_bera", "anderson_darling"))
    bound = "at most " if anderson_p <= (1 + 1e-9) * LEAST_ANDERSON_P else ""
    _, (_, farthest) = number(oscillator, "reattachment_distance_to_normal")
    seen = "; the distance to the normal is less than an eye sees" if farthest < VISIBLE else ""
    note = (
        f"skewness; excess kurtosis {shown(kurtosis)}; p of normality {max(moments_p, LEAST_P):.1g} by these two and "
        f"{bound}{anderson_p:.2g} by Anderson and Darling, of cycles as dependent as those of a run{seen}"
    )
    size = factor * NON_NORMAL
    rule = partial(_beyond_normal, size=size)
    peaked = Finding(*kurtosis, "excess kurtosis", rule, (-size, size))
    return Finding(
        *skewness, note, rule, peaked.thresholds, peaked, max, at=lambda times: _moments(oscillator, times * factor)
    )


def _beyond_normal(moment: Interval, size: float) -> int:
    return max(inside(moment, low=size), inside(moment, high=-size))


def _visible(oscillator: Arrays) -> Finding:
    note = "Kolmogorov distance to the normal of the same mean and standard deviation"
    return judged_inside(number(oscillator, "reattachment_distance_to_normal"), note, low=VISIBLE)


ON_THE_CYCLE = (
    "the damping lies below the deterministic limit, and the interval of the share of runs with a cycle in the last "
    f"ten natural periods lies above {CYCLING}"
)
BEYOND_NORMAL = (
    f"the interval of the skewness or that of the excess kurtosis lies beyond {NON_NORMAL} on either side of zero"
)
SHARP = (
    "every damping of the list below the limit gives at least half the cycles of the least damping, and every one "
    "above it gives at most one. It is not tested if the list has only one side"
)
IN_STICK_SLIP = (
    "at some damping of the list above the deterministic limit the interval of the share of the time in stick-slip "
    f"lies above {SEEN_SHARE:.0%}; that of the undisturbed cycle is 1. It is not tested if the list has none"
)
STATEMENTS = (
    Statement(
        "fig5-limit-cycle",
        "The mass moves on a stick-slip limit cycle, with and without scatter",
        "limit cycle",
        (
            Reading(
                "runs-at-the-end",
                "share of the runs with a cycle in the closing periods, at the paper's damping",
                MOVES,
                ON_THE_CYCLE,
                _limit_cycle,
                natural="the figure shows the motion at this damping after its start",
                unit=SHARE,
            ),
            Reading(
                "time-in-stick-slip",
                "share of the time in stick-slip, at the paper's damping",
                "section 5: the numbers of cycles “in the same amount of time”",
                f"the interval of that share lies above {CYCLING}",
                _time_on_the_cycle,
                unit=SHARE,
            ),
        ),
    ),
    Statement(
        "fig5-reattachment-nonnormal",
        "The reattachment point is not normally distributed",
        "non-normal",
        (
            Reading(
                "moments",
                "skewness and excess kurtosis of the point",
                SEEN,
                BEYOND_NORMAL,
                _moments,
                natural="the statement is of the distribution; whether it is seen is another matter",
            ),
            Reading(
                "to-the-eye",
                "distance of its distribution from the normal one that a reader sees",
                SEEN,
                f"the interval of the Kolmogorov distance to the normal lies above {VISIBLE}",
                _visible,
            ),
        ),
    ),
    Statement(
        "fig5-sharp-limit",
        "Without scatter the cycle ceases at a sharp limit of damping",
        "sharp limit",
        (
            Reading(
                "existence",
                "damping at which the cycle ceases to exist",
                "section 5: a “sharp limit for the damping coefficient where the limit cycle ceases to exist”",
                SHARP,
                _sharp_limit,
                natural="the sentence names existence",
            ),
        ),
    ),
    Statement(
        "fig5-range-beyond-limit",
        "With scatter there is a range of damping where the mass can still move on the cycle",
        "a range",
        (
            Reading(
                "lost-cycles",
                "M_diff = M_d - E[M_S] below zero beyond the limit, by more than a few single returns",
                "section 5: “Figure 5 c) displays the difference M_diff”, and the range is read from it",
                IN_STICK_SLIP,
                _lost_cycles,
                natural="it is the quantity of the paper's own figure",
                unit=SHARE,
            ),
            Reading(
                "runs-at-the-end",
                "share of the runs with a cycle in the closing periods, beyond the limit",
                RANGE,
                "at some damping of the list above the deterministic limit the interval of the share of runs with a "
                f"cycle in the last ten natural periods lies above {CAN_CYCLE}. It is not tested if the list has none",
                _runs_at_the_end,
                unit=SHARE,
            ),
            Reading(
                "every-return",
                "every return to the belt as a cycle, without backward motion too",
                "section 5: “the mean number of limit cycles”; what counts as one is not said",
                "at some damping of the list above the deterministic limit the interval of the mean returns, over the "
                f"cycles at the last damping below it, lies above {SEEN_SHARE:.0%}",
                _every_return,
                unit=SHARE,
            ),
        ),
    ),
)

ON_THE_PAD = (
    f"the range ends between the last damping of the list where the interval of that share lies above {CAN_CYCLE} and "
    "the next where it lies below. To first order it is in proportion to the scatter of friction, times a response to "
    f"its autocorrelation. Scaled to the windows that bear the force, its interval lies above {SEEN_RANGE} of the limit"
)
OWN = (
    Statement(
        "own-fig5-under-load",
        f"Our own statement: on windows that bear the stated force this range exceeds {SEEN_RANGE:.0%} of the limit",
        "not stated",
        (
            Reading(
                "runs-at-the-end",
                "range by the share of runs with a cycle in the closing periods, scaled to the windows of the force",
                "section 5: a normal force of 2.5 kN, on windows of 25 µm x 600 µm",
                ON_THE_PAD,
                partial(_under_load, kind="additive"),
                natural="section 5 adds the stochastic part: μ = μ_D + μ_S",
                unit=SHARE,
            ),
            Reading(
                "multiplicative-scatter",
                "the same with scatter that multiplies the friction coefficient",
                "section 4: the friction coefficient is shear strength times area over force, and the area scatters",
                ON_THE_PAD,
                partial(_under_load, kind="multiplicative"),
                unit=SHARE,
            ),
        ),
    ),
)
