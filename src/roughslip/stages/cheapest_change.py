"""Stage cheapest_change: the cheapest change of two or three parameters that keeps stick-slip rare."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from roughslip import store
from roughslip.chaos.sampling import wilson_interval
from roughslip.errors import IllPosedError, InputError
from roughslip.probability.cheapest import ACCURACY, cheapest_change, cost_at_end, root_on
from roughslip.probability.lattice_map import LatticeMap, lattice_map
from roughslip.scene.declarations import Stage
from roughslip.scene.ranges import KEYS
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, mass_on_belt, variation
from roughslip.stages.from_scene.point_runs import Box, PointRuns, box, spaced
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job, execute

STAGE = Stage(
    name="cheapest_change",
    reads="seed oscillator design numerics.oscillator_tolerance",
    reads_if_given="ensemble.marginal friction.statistics",
    optional={"friction": "friction"},
    result="oscillator/cheapest_change.nc",
    memory_mb=620,
)

POINTS, COMPUTED, MAP_RUNS = 25, 48, 24  # of each map that is drawn
CHUNK = 4  # runs between two looks at the count


class Acceptance:
    """Whether changes are acceptable, with as few runs as decide it.

    runs : at points, `values` of a change
    realisations : of friction at a point
    """

    def __init__(self, at: PointRuns, values: Callable[[np.ndarray], dict[str, float]], realisations: int) -> None:
        self._at, self._values, self._order = at, values, list(range(realisations))
        self.points = 0

    def within(self, most: float) -> Callable[[np.ndarray], bool]:
        """Whether the shares of stick-slip of all realisations sum to at most that much.

        Runs end when the sum exceeds it. Realisations that did so are first at the next point. The answer does not
        depend on their order.
        """

        def acceptable(change: np.ndarray) -> bool:
            self.points += 1
            total, values = 0.0, self._values(change)
            for first in range(0, len(self._order), CHUNK):
                chunk = self._order[first : first + CHUNK]
                shares = self._at.shares(values, chunk)
                total += float(shares.sum())
                if total > most:
                    slipping = [one for one, share in zip(chunk, shares, strict=True) if share > 0.0]
                    self._order = slipping + [one for one in self._order if one not in slipping]
                    return False
            return True

        return acceptable


def largest_sums(limit: float, runs: int) -> dict[str, float]:
    """Largest sums of shares at which the probability, and either end of its interval, is at most the limit."""
    ends = {
        end: brentq(lambda total, side=side: float(wilson_interval(total, runs)[side]) - limit, 0.0, runs)
        for end, side in (("low", 0), ("high", 1))
    }
    return {"high": ends["high"], "value": limit * runs, "low": ends["low"]}


def ranges_of_change(scene: Scene, ranges: Box, own: variation.System) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The scene's own values, and the logarithms of both ends of the ranges over them.

    Raises InputError for a range from zero or without the scene's own value.
    """
    values = np.array([variation.PARAMETERS[name].value(own) for name in ranges])
    for (name, (first, last)), value in zip(ranges.items(), values, strict=True):
        if not 0.0 < first <= value <= last:
            raise InputError(
                f"design.{KEYS[name]}: [{first:.6g}, {last:.6g}] must hold the scene's own value, {value:.6g}, and "
                "begin above zero, because the cost of a change is its logarithm"
            )
    low, high = np.log(np.array(list(ranges.values())) / values[:, None]).T
    return values, low, high


def work(job: Job) -> None:
    """Write the cheapest change with its cost and probability, and maps of the probability around it."""
    scene, asked = job.scene, job.scene.design
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    ranges = box(scene, numbers, asked)
    names, own = list(ranges), variation.system(scene, numbers)
    values, low, high = ranges_of_change(scene, ranges, own)
    weights = np.array([1.0 if asked.weights is None else getattr(asked.weights, name) for name in names])
    at = PointRuns(scene, numbers, job.arguments.friction, asked.duration_periods, geometry.STREAM_CHANGE)

    def of_change(change: np.ndarray) -> dict[str, float]:
        return dict(
            zip(names, np.clip(values * np.exp(change), *np.array(list(ranges.values())).T).tolist(), strict=True)
        )

    acceptance = Acceptance(at, of_change, asked.realisations)
    sums = largest_sums(asked.probability, asked.realisations)
    with job.usage.core():
        found = cheapest_change(acceptance.within(sums["high"]), weights, low, high)
        if found is None:
            raise IllPosedError(
                f"no change within the ranges of section design keeps the probability of stick-slip at or below "
                f"{asked.probability:g}: widen the ranges, add a parameter, or allow more"
            )
        direction, cost = found
        costs = [cost]
        for end in ("value", "low"):  # where the estimate, and the lower end of its interval, are at the limit
            accuracy = ACCURACY * cost_at_end(direction, low, high) if cost > 0.0 else 1.0
            root = root_on(acceptance.within(sums[end]), direction, costs[-1], accuracy) if cost > 0.0 else 0.0
            costs.append(costs[-1] if root is None else root)
        cheapest = of_change(cost * direction)
        share = float(np.mean(at.shares(cheapest, range(asked.realisations))))
        panels = sorted({*ranges[names[2]], cheapest[names[2]]}) if len(names) == 3 else [np.nan]
        drawn = [probability_map(at, ranges, value, min(MAP_RUNS, asked.realisations)) for value in panels]
    job.usage.count(runs=at.runs, steps=at.steps, points=acceptance.points)
    job.usage.skip({skip_reasons.STICK: at.sticks, skip_reasons.KEPT: at.runs - at.paths})
    interval = share, *wilson_interval(share * asked.realisations, asked.realisations)
    variables = store.with_interval(
        "design_probability", (), interval, "1", "probability of stick-slip at the cheapest point"
    )
    title = "cost at which the probability is the limit; the upper end is that of the cheapest point"
    variables |= store.with_interval("design_cost", (), (costs[1], costs[2], costs[0]), "1", title)
    axes = map_axes(ranges)
    of_parameter = {
        "design_own": (values, "value in the scene"),
        "design_cheapest": (np.array([cheapest[name] for name in names]), "value at the cheapest point"),
        "design_weight": (weights, "cost of a change by a factor of e"),
        "design_parameters": (
            np.array(names),
            "parameters; the first two are the axes x and y, the third that of panels",
        ),
    }
    variables |= {name: store.Variable(("parameter",), one, "1", label) for name, (one, label) in of_parameter.items()}
    point = ("panel", "x", "y")
    variables |= {
        "design_limit": store.Variable((), asked.probability, "1", "largest probability of stick-slip"),
        "design_map": store.Variable(
            point, np.array([one.probability for one in drawn]), "1", "probability of stick-slip"
        ),
        "design_panel": store.Variable(
            ("panel",), np.array(panels), "1", "value of the third parameter, NaN without one"
        ),
        "design_x": store.Variable(("x",), axes[0], "1", f"{names[0]}, in SI units"),
        "design_y": store.Variable(("y",), axes[1], "1", f"{names[1]}, in SI units"),
    }
    store.write(job.arguments.output, variables, job.key)


def map_axes(ranges: Box) -> list[np.ndarray]:
    """Values of the first two parameters on the maps."""
    return [spaced(*one, POINTS) for one in list(ranges.values())[:2]]


def probability_map(at: PointRuns, ranges: Box, third: float, runs: int) -> LatticeMap:
    """The probability over the first two parameters, at a value of the third."""
    (x, y), names = map_axes(ranges), list(ranges)

    def probability(i: int, j: int) -> float:
        values = dict(zip(names, (float(x[i]), float(y[j]), third), strict=False))
        return float(np.mean(at.shares(values, range(runs))))

    return lattice_map(probability, POINTS, COMPUTED)


if __name__ == "__main__":
    execute(STAGE, work)
