"""How many strips to solve, and how many to give to the cheap control, for an accuracy asked of friction.

The variance of a combined statistic (`combination.py`) from n solved strips and N of the control, the solved ones among
them, is to first order in 1 / n::

    var = A / n + D / N,   A = var(g - z),   D = 2 cov(g, z) - var(z) = (2 beta - 1) var(z)

- g, z: influences of a strip on the extrapolated statistic and on alpha times the control, with alpha of large N.
- beta: regression coefficient of g on z. Without extrapolation it is 1, and D is the variance that z explains.

With k other strips on cells 2h alone for each solved one, these are the control, and the cheap control serves them::

    A = var(g - alpha z) + alpha^2 var(z - beta e) / k,   D = alpha^2 beta^2 var(e)

- z, e: influences of a strip on the statistic of cells 2h and on that of the cheap control
- alpha, beta: coefficients of the two controls, of large N

The order of the mesh error adds an even spread over those of ORDERS, the same for any number of strips. A table over
all n gives n and N of the least cost c_n n + c_N N. For one statistic n / N = sqrt(A c_N / (D c_n)), as in Neyman,
J. Roy. Stat. Soc. 97 (1934) 558. With more levels see Giles, Acta Numerica 24 (2015) 259.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from roughslip.errors import IllPosedError
from roughslip.friction.combination import ORDERS
from roughslip.friction.level import Level
from roughslip.friction.statistics import margin_of, require_scatter
from roughslip.probability.estimate import variance_margin
from roughslip.probability.pilot import Accuracy, Pilot

PERCENTILES = (20.0, 95.0)
"""Penetrations at which the accuracy holds. Below, a few windows that hardly touch decide."""

STATISTICS = ("friction_mean", "friction_std")
COARSE_MUST_SAVE = 1 / 3  # of the cost with other strips
POINTS = 24
_SPREAD = (np.arange(610) * np.array([[1], [377]]) % 610 + 0.5) / 305 - 1  # Fibonacci lattice on the square of side 2


@dataclass(frozen=True)
class ErrorSources:
    """Errors of one statistic at one penetration, relative to it.

    percentile, statistic : which one
    solved, control : A and D per strip, at the pilot's 90 % bound
    mesh : half widths of the uniform distributions that the order of the mesh error leaves
    safety : factors that `solved` and `control` hold for few pilot strips
    """

    percentile: float
    statistic: str
    solved: float
    control: float
    mesh: tuple[float, float] = (0.0, 0.0)
    safety: tuple[float, float] = (1.0, 1.0)

    def half_width(self, strips: int, many: int, *, safe: bool = True) -> float:
        """Half width of the 95 % interval. safe : with the factors for few pilot strips, else as expected"""
        by = (1.0, 1.0) if safe else self.safety
        normal = half_width(math.sqrt(self.solved / by[0] / strips + self.control / by[1] / many), self.mesh)
        return float(self.margin(strips)) * normal

    def margin(self, strips: int | np.ndarray) -> np.ndarray:
        """Factor by which so many strips widen the interval of a normal variable."""
        return margin_of(self.statistic.removeprefix("friction_"), strips)


@dataclass(frozen=True)
class Allocation:
    """strips to solve, many of the control (the solved ones among them), and the cost [s] of both."""

    strips: int
    many: int
    cost: float


@dataclass(frozen=True)
class SampleLimits:
    """Numbers of strips that may be chosen, and what they may cost.

    strips, many : minimum and maximum number of strips to solve and of strips of the control; equal where given by hand
    costs : [s] of a strip that is solved, with its others, and of one of the control
    limit : [s] maximum cost
    minimum : strips of the control for each one that is solved
    """

    strips: tuple[int, int]
    many: tuple[int, int]
    costs: tuple[float, float]
    limit: float
    minimum: int = 2


def half_width(sigma: float, mesh: tuple[float, float]) -> float:
    """Of the 95 % interval of a normal variable of deviation sigma and two uniform ones of half widths `mesh`."""
    most = sum(mesh) + 3.0 * sigma
    if most == 0.0:
        return 0.0
    return float(brentq(lambda width: _outside(width, sigma, mesh), 0.0, most, xtol=1e-9 * most + 1e-15))


def mesh_alone(source: ErrorSources) -> float:
    """Half width that remains with any number of strips."""
    return half_width(0.0, source.mesh)


def _outside(width: float, sigma: float, mesh: tuple[float, float]) -> float:
    """Probability of such a sum outside +- width, less 5 %."""
    offsets = mesh @ _SPREAD
    scale = max(sigma, 1e-3 * sum(mesh), 1e-300)
    return float(np.mean(ndtr((offsets - width) / scale) + ndtr((-offsets - width) / scale))) - 0.05


def influences(mu: np.ndarray, valid: np.ndarray) -> np.ndarray:
    """(S, 2) influence of each strip on the logarithms of mean and standard deviation; their mean over strips is zero.

    mu, valid : (S, W) friction coefficient and bool
    """
    if valid.any(axis=1).sum() < 2:
        raise IllPosedError(f"fewer than 2 of {len(mu)} pilot strips touch: raise strip.training_samples")
    mean = float(mu[valid].mean())
    deviation = np.where(valid, mu - mean, 0.0)
    variance = np.sum(deviation**2) / valid.sum()
    require_scatter(np.array([variance]), mean)
    of_std = np.where(valid, deviation**2 - variance, 0.0).sum(axis=1) / (2.0 * variance)
    return np.stack((deviation.sum(axis=1) / mean, of_std), axis=1) * (len(mu) / valid.sum())


def error_sources(
    percentiles: np.ndarray,
    levels: Sequence[Level],
    others: int = 0,
) -> list[ErrorSources]:
    """Sources of error from a pilot, of mean and standard deviation in units in which the mean at the median is exact.

    percentiles : (levels,) [%], 50 among them
    levels : each (levels, strips, W): the pilot on cells h, perhaps on cells 2h, and the expansion on more strips
    others : strips on cells 2h alone for each solved strip
    """
    solved, control = levels[0], levels[-1]
    coarse = levels[1] if len(levels) > 2 else None
    strips, many = solved.strips, control.strips
    safety = variance_margin(strips), variance_margin(many)
    ends = 1.0 / (2.0 ** np.array([ORDERS["mean"], ORDERS["std"]]) - 1.0)
    middle, open_part = ends.mean(axis=1), (ends[:, 0] - ends[:, 1]) / 2
    parts, changes = {}, {}  # by penetration: influences (strips, 2) each, and (2,)
    for number, percentile in enumerate(percentiles):
        if not PERCENTILES[0] <= percentile <= PERCENTILES[1]:
            continue
        fine, cheap = (influences(level.mu[number], level.valid[number]) for level in (solved, control))
        own, change, same = fine, np.zeros(2), cheap[:strips]
        if coarse is not None:
            half = influences(coarse.mu[number], coarse.valid[number])
            own = fine + middle * (fine - half)
            change = _logarithms(solved, number) - _logarithms(coarse, number)
        if others == 0:
            shown = _slope(fine, same) * cheap
            parts[percentile] = own - shown[:strips], np.zeros_like(own), shown
        else:
            beta = _slope(half, same)
            left = half - beta * same
            alpha = _slope(fine, half) / (1.0 + np.var(left, axis=0) / np.var(half, axis=0) / others)
            parts[percentile] = own - alpha * half, alpha * left, alpha * beta * cheap
        changes[percentile] = open_part * change
    errors = []
    for percentile, of_both in changes.items():
        for which, statistic in enumerate(STATISTICS):
            if percentile == 50.0 and which == 0:
                continue
            on_solved, on_others, on_control = (
                influence[:, which] - of_mean[:, 0]
                for influence, of_mean in zip(parts[percentile], parts[50.0], strict=True)
            )
            left, explained = np.var(on_solved, ddof=1), np.var(on_control, ddof=1)
            if others:
                left += np.var(on_others, ddof=1) / others
            else:  # the control on the solved strips is part of that on all
                explained *= max(0.0, 1.0 + 2.0 * _slope(on_solved, on_control[:strips]))
            of_mean = changes[50.0][0]
            mesh = (abs(of_both[0] - of_mean), 0.0) if which == 0 else (abs(of_both[1]), abs(of_mean))
            bounds = float(safety[0] * left), float(safety[1] * explained)
            errors.append(ErrorSources(float(percentile), statistic, *bounds, mesh, safety))
    return errors


def _slope(values: np.ndarray, of: np.ndarray) -> np.ndarray:
    """Regression coefficients of columns on the same columns of another array."""
    deviation = of - of.mean(axis=0)
    spread = (deviation**2).sum(axis=0)
    if not np.all(spread):
        raise IllPosedError("the control does not scatter between pilot strips: give the numbers of strips")
    return (deviation * values).sum(axis=0) / spread


def allocate(errors: Sequence[ErrorSources], asked: Accuracy, limits: SampleLimits) -> Allocation | None:
    """The cheapest numbers of strips with half widths of at most `asked`; None where there are none within the limit.

    errors : from `error_sources`; asked : largest half width by statistic
    """
    strips = np.arange(limits.strips[0], limits.strips[1] + 1)
    if not strips.size:
        return None
    many = np.maximum(float(limits.minimum) * strips, limits.many[0])
    for source in errors:
        left = _variances_within(asked[source.statistic], source, strips) - source.solved / strips
        needed = np.divide(source.control, left, out=np.full(len(strips), np.inf), where=left > 0)
        many = np.maximum(many, np.ceil(needed))
    cost = limits.costs[0] * strips + limits.costs[1] * many
    cost[many > limits.many[1]] = np.inf
    best = int(np.argmin(cost))
    if not np.isfinite(cost[best]) or cost[best] > limits.limit:
        return None
    return Allocation(int(strips[best]), int(many[best]), float(cost[best]))


@dataclass(frozen=True)
class Option:
    """A number of other strips on cells 2h for each solved one, with the errors and limits that go with it."""

    others: int
    errors: Sequence[ErrorSources]
    limits: SampleLimits


def cheapest(options: Sequence[Option], asked: Accuracy) -> tuple[Option, Allocation] | None:
    """The option of the least cost that reaches what is asked, if one does.

    Other strips serve the asked numbers alone, and solved ones all that is shown of friction. So solved ones alone are
    taken where they cost at most COARSE_MUST_SAVE more.
    """
    reached = [(option, chosen) for option in options if (chosen := allocate(option.errors, asked, option.limits))]
    return min(
        reached, key=lambda pair: pair[1].cost / (1.0 if pair[0].others else 1.0 + COARSE_MUST_SAVE), default=None
    )


def strip_pilot(options: Sequence[Option], asked: Accuracy, cell_m: float) -> Pilot[tuple[Option, Allocation]]:
    """The option and the numbers of strips that an accuracy of friction takes. cell_m : [m] edge of a cell"""

    def advice() -> str:
        worst = max(options[0].errors, key=lambda source: mesh_alone(source) / asked[source.statistic])
        alone = mesh_alone(worst)
        if alone >= asked[worst.statistic]:
            which = f"{worst.statistic} at {worst.percentile:g} %"
            return f"take strip.cell_m = {cell_m / 2:g} or less, as the mesh alone leaves {alone:.2g} of {which}"
        unlimited = [replace(option, limits=replace(option.limits, limit=math.inf)) for option in options]
        if (at_any_cost := cheapest(unlimited, asked)) is not None:
            return f"raise accuracy.cost_limit_cpu_s to {math.ceil(at_any_cost[1].cost)}"
        return "widen strip.window_spacing_m, or leave the number of strips that you gave to auto"

    return Pilot(asked, lambda accuracy: cheapest(options, accuracy), advice)


def _variances_within(asked: float, source: ErrorSources, strips: np.ndarray) -> np.ndarray:
    """The largest variance for each number of strips; not above it between the POINTS where it is solved for.

    With the margin c, c sigma is concave in c: sqrt(asked^2 - (c mesh)^2) / 1.96 but for the shape of the mesh's part.
    """
    margin = source.margin(strips)
    points = np.linspace(margin.min(), margin.max(), POINTS if len(strips) > 1 else 1)
    scaled = [c * math.sqrt(max(0.0, _variance_within(asked / c, source.mesh))) for c in points]
    return np.asarray((np.interp(margin, points, scaled) / margin) ** 2)


def _variance_within(asked: float, mesh: tuple[float, float]) -> float:
    """The largest variance of a normal variable with which the half width is as asked; -1 if the mesh alone exceeds."""
    if _outside(asked, 0.0, mesh) >= 0.0:
        return -1.0
    return float(brentq(lambda sigma: _outside(asked, sigma, mesh), 0.0, asked, xtol=1e-6 * asked)) ** 2


def _logarithms(level: Level, penetration: int) -> np.ndarray:
    """(2,) logarithms of mean and standard deviation at a penetration, by its number."""
    windows = level.mu[penetration][level.valid[penetration]]
    return np.log([windows.mean(), windows.std()])
