"""Rules on Figure 5: the limit cycle, the reattachment point, the limits of damping; then on our own statement."""

from collections.abc import Callable

import numpy as np

from roughslip.verdicts.reading import LIKE_BETA, Arrays, Found, Rule, inside, lies, number, rule, shown, within

NON_NORMAL = 0.1  # skewness or excess kurtosis
CYCLING = 0.95  # share of the runs
CAN_CYCLE = 0.05  # share of the runs
SEEN_SHARE = 0.01  # of the time in stick-slip without scatter: more than a few single returns of all runs
SEEN_RANGE = 0.01  # of the limit of damping: a range beyond it that a reader of figure 5 sees
NO_LIMIT = "the oscillator has no limit of its own: it is excited, or has no cycle at any damping ratio"
NO_END = "the list of damping ratios does not reach surely beyond the range, or its runs are too few"
ONE_SIDE = "the list of damping ratios does not reach both sides of the limit {:.4f}"
OF_LOAD = "penetration and windows follow from the load, so the runs have its scatter already"
ABOVE = "at some damping of the list above the deterministic limit the interval of the"


def with_limit(text: str) -> Callable[[Callable[[Arrays, float], Found | str]], Rule]:
    """The rule, where the oscillator has a limit of damping."""

    def ruled(judge: Callable[[Arrays, float], Found | str]) -> Rule:
        def limited(oscillator: Arrays) -> Found | str:
            limit = float(oscillator["deterministic_existence_limit"])
            return judge(oscillator, limit) if np.isfinite(limit) else NO_LIMIT

        return Rule(text, limited)

    return ruled


@with_limit(
    "the damping of the paper lies below the deterministic limit, and there the interval of the share of runs with a "
    f"cycle in the last ten natural periods lies above {CYCLING}"
)
def cycling_at_the_end(oscillator: Arrays, limit: float) -> Found:
    """Runs with a cycle in the closing periods, at a damping below the limit."""
    nominal, share = float(oscillator["nominal_damping"]), number(oscillator, "cycling_share")
    note = (
        f"share of runs with a cycle in the closing periods at D = {nominal:g}; without scatter it ends at {limit:.4f}"
    )
    return Found(*share, min(inside(share[1], low=CYCLING), inside((nominal, nominal), high=limit)), note)


@with_limit(f"at the damping of the paper the interval of the share of the time in stick-slip lies above {CYCLING}")
def time_on_the_cycle(oscillator: Arrays, limit: float) -> Found | str:
    """The share of the time in stick-slip at the damping of the scene."""
    nominal, damping = float(oscillator["nominal_damping"]), oscillator["damping_ratio"]
    rows = np.flatnonzero((damping == nominal) & (damping < limit))
    if not rows.size:
        return f"the scene's own damping ratio, {nominal:g}, is not in the list below the limit {limit:.4f}"
    note = f"share of the time in stick-slip at D = {nominal:g}; without scatter it is 1"
    return lies(number(oscillator, "stick_slip_share", int(rows[0])), note, low=CYCLING)


@with_limit(
    "every damping of the list below the limit gives at least half the cycles of the least damping, and every one "
    "above it gives at most one. It is not tested if the list has only one side"
)
def sharp_limit(oscillator: Arrays, limit: float) -> Found | str:
    """Cycles without scatter on both sides of the limit."""
    damping, cycles = oscillator["damping_ratio"], oscillator["deterministic_cycles"]
    below, above = damping < limit, damping > limit
    if not (below.any() and above.any()):
        return ONE_SIDE.format(limit)
    is_sharp = bool(np.all(cycles[below] >= 0.5 * cycles[0]) and np.all(cycles[above] <= 1))
    note = "damping ratio, root of the return map of slip, to 1e-8"
    return Found(limit, (limit - 1e-8, limit + 1e-8), 1 if is_sharp else -1, note)


def share_beyond(text: str, name: str, what: str, least: float) -> Rule:
    """A share at the damping above the limit where it is surest, and M_diff there. Returns are over cycles below it."""

    @with_limit(text)
    def judge(oscillator: Arrays, limit: float) -> Found | str:
        damping = oscillator["damping_ratio"]
        if not (np.any(damping > limit) and np.any(damping < limit)):
            return ONE_SIDE.format(limit)
        whole = float(oscillator["deterministic_cycles"][damping < limit][-1]) if name == "returns" else 1.0
        if not whole > 0.0:
            return "no run without scatter has a cycle below the limit: raise ensemble.duration_periods"
        surely = np.nan_to_num(oscillator[f"{name}_low"] / whole, nan=-1.0)  # where no run reaches a state
        surely = np.where(damping > limit, surely, -np.inf)
        row, seen = int(np.argmax(surely)), damping[surely > least]
        lost = shown(number(oscillator, "difference", row))
        reach = f"; above {least:.0%} up to D = {seen[-1]:g}" if seen.size else ""
        note = f"share of the {what} at D = {damping[row]:g}, where M_diff = {lost}{reach}"
        value, (low, high) = number(oscillator, name, row)
        return lies((value / whole, (low / whole, high / whole)), note, low=least)

    return judge


TIME_BEYOND = share_beyond(
    f"{ABOVE} share of the time in stick-slip lies above {SEEN_SHARE:.0%}; that of the undisturbed cycle is 1. It is "
    "not tested if the list has none",
    "stick_slip_share",
    "time in stick-slip, which a run may leave and come back to,",
    SEEN_SHARE,
)
RUNS_BEYOND = share_beyond(
    f"{ABOVE} share of runs with a cycle in the last ten natural periods lies above {CAN_CYCLE}. It is not tested if "
    "the list has none",
    "still_cycling",
    "runs with a cycle in the closing periods",
    CAN_CYCLE,
)
RETURNS_BEYOND = share_beyond(
    f"every return to the belt is a cycle, without backward motion too: {ABOVE} mean returns, over the cycles at the "
    f"last damping below it, lies above {SEEN_SHARE:.0%}",
    "returns",
    "mean returns to the belt, of the cycles without scatter below the limit,",
    SEEN_SHARE,
)


@rule(f"the interval of the skewness or that of the excess kurtosis lies beyond {NON_NORMAL} on either side of zero")
def moments(oscillator: Arrays) -> Found:
    """Skewness or excess kurtosis of the reattachment point differs from zero."""
    skewness, kurtosis = (number(oscillator, f"reattachment_{name}") for name in ("skewness", "kurtosis"))
    sides = (NON_NORMAL, np.inf), (-np.inf, -NON_NORMAL)
    says = max(inside(moment, *side) for _, moment in (skewness, kurtosis) for side in sides)
    note = f"skewness; excess kurtosis {shown(kurtosis)}"
    return Found(*skewness, says, note)


FAR_FROM_NORMAL = within(
    f"the interval of the Kolmogorov distance to the normal of equal moments lies above {LIKE_BETA:.4f}, half of "
    "that of Beta(2.1, 5), which the paper calls non-normal too",
    "reattachment_distance_to_normal",
    lambda _: "Kolmogorov distance to the normal of equal moments",
    low=LIKE_BETA,
)


def under_load(kind: str, of: str = "") -> Rule:
    """The range of damping beyond the limit, scaled from the friction of the runs to that of the load's windows.

    kind : of scatter, additive or multiplicative; of : which scatter, before the words of the rule
    """

    @with_limit(
        f"{of}the range ends between the last damping of the list where the interval of the share of runs with a cycle "
        f"in the closing periods lies above {CAN_CYCLE} and the next where it lies below. To first order it is in "
        "proportion to the scatter of friction, times a response to its autocorrelation. Scaled to the windows that "
        f"bear the force, its interval lies above {SEEN_RANGE} of the limit"
    )
    def judge(both: Arrays, limit: float) -> Found | str:
        damping = both["damping_ratio"]
        still = damping[(damping > limit) & (both["still_cycling_low"] > CAN_CYCLE)]
        last = float(still.max(initial=limit))
        beyond = damping[(damping > last) & (both["still_cycling_high"] < CAN_CYCLE)]
        if not beyond.size:
            return NO_END
        percentile, scatter = float(both["friction_percentile"]), float(both["friction_scatter"])
        if percentile < both["percentile"][0]:
            return OF_LOAD
        names = ("load_windows", "load_std", "load_std_low", "load_std_high")
        at = int(np.flatnonzero(both["percentile"] == percentile)[0])
        windows, *std = (float(both[name][at]) for name in names)
        low, high = last / limit - 1.0, float(beyond[0]) / limit - 1.0
        response = float(both[f"load_response_{kind}"])
        ours, *ends = (np.array([(low + high) / 2.0, low, high]) * response * std / scatter).tolist()
        note = (
            f"share of the limit {limit:.4f}; at percentile {percentile:g} {windows:.4g} windows bear the force, and "
            f"their friction scatters by {std[0]:.2g}, over a length at which scatter moves the limit {response:.2g} "
            f"times as far. In the runs it scatters by {scatter:.2g}, and the range ends from {low:.2%} to {high:.2%}"
        )
        return lies((ours, (ends[0], ends[1])), note, low=SEEN_RANGE)

    return judge
