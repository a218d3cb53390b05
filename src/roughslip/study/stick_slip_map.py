"""Stage stick_slip_map: the probability of stick-slip over two parameters, with the deterministic limits."""

from collections.abc import Mapping, Sequence

import numpy as np

from roughslip import store
from roughslip.oscillator.limits import limits_or_nan
from roughslip.oscillator.machine import OF_FRICTION, PARAMETERS, Machine
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import run_until_known
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.search import LatticeMap, lattice_map
from roughslip.scene.oscillator import StickSlipMap
from roughslip.scene.types import Scene
from roughslip.study.from_scene import Stream
from roughslip.study.from_scene.machine import machine_of
from roughslip.study.job import Job

# Points that are run: a tenth of the runs at 24 x 24 points, and the same error of the probability, 0.006; of a coarse
# map a quarter of its points.
MOST_COMPUTED, SHARE = 56, 1 / 4
RUNS, PERIODS = 20, 40  # of a point: a probability to a tenth; settled after half of them
POINT = ("x", "y")
LIMITS = {
    "hopf_damping": "damping ratio below which steady sliding is unstable",
    "existence_limit": "damping ratio above which the stick-slip cycle does not exist",
}


def work(scene: Scene, job: Job) -> None:
    """Write the share of stick-slip in the second half of the runs, and the limits in damping along the other axis."""
    asked = scene.map
    own = machine_of(scene, job.optional("friction"))
    ranges = box(own, asked)
    names = tuple(ranges)
    axes = [spaced(*ranges[name], asked.points) for name in names]
    at_points = PointRuns(own, PERIODS, (scene.seed, Stream.MAP))

    def probability(i: int, j: int) -> float:
        values = {name: float(axis[k]) for name, axis, k in zip(names, axes, (i, j), strict=True)}
        return float(np.mean(at_points.shares(values, range(RUNS))))

    shares = lattice_map(probability, asked.points, min(MOST_COMPUTED, int(SHARE * asked.points**2)))
    limits = limits_along(job, own, names[1], axes[1] if names[0] == "damping" else None)
    job.count(runs=at_points.runs, steps=at_points.steps)
    variables = of_shares(shares)
    for axis, name, values in zip(POINT, names, axes, strict=True):
        parameter = PARAMETERS[name]
        variables[f"map_{axis}"] = store.Variable((axis,), values, parameter.unit, parameter.title)
        variables[f"map_{axis}_own"] = store.Variable((), own.value(name), parameter.unit, f"{name} of the scene")
    for (name, label), values in zip(LIMITS.items(), limits, strict=True):
        variables[name] = store.Variable(("y",), values, "1", label)
    variables["map_parameters"] = store.Variable(("axis",), np.array(names), "1", "parameters of the axes x and y")
    store.write(job.output, variables, job.key)


def limits_along(job: Job, own: Machine, name: str, values: np.ndarray | None) -> np.ndarray:
    """(2, points) limits in damping over the values of a parameter; NaN where the other axis is not damping."""
    if values is None:
        return np.full((2, job.scene.map.points), np.nan)
    machines = (own.changed({name: float(value)}) for value in values)
    limits = np.array([limits_or_nan(machine.oscillator, machine.law) for machine in machines]).T
    if (without := values[np.isnan(limits[1])]).size:
        where = f"{without.size} values of {name}, {without[0]:.4g} to {without[-1]:.4g}"
        job.warn(f"no stick-slip cycle at {where}; its limit is stored as NaN")
    return limits


def of_shares(shares: LatticeMap) -> dict[str, store.Variable]:
    """The probability at every point with its interval, and how it was found."""
    interval = shares.probability, *wilson_interval(RUNS * shares.probability, RUNS)
    title = "probability of stick-slip, share of the second half of the runs"
    columns = {
        "is_computed": (POINT, shares.is_computed.astype(np.int8), "1 where runs were made, 0 where the spline says"),
        "prediction_error": ((), shares.prediction_error, "mean error of the spline at the last third of the points"),
        "map_periods": ((), PERIODS, "natural periods of a run"),
        "map_runs": ((), RUNS, "runs at a point"),
    }
    variables = {name: store.Variable(dims, value, "1", label) for name, (dims, value, label) in columns.items()}
    return store.with_interval("probability", POINT, interval, "1", title) | variables


FACTOR = 4.0  # of a range around the scene's own value


def own_range(name: str, own: Machine) -> tuple[float, float]:
    """First and last value of a parameter: a factor of FACTOR around that of the machine.

    Damping ratios also reach half of the smaller limit of the machine and twice the larger one, where it has limits.
    """
    value = own.value(name)
    values = [value / FACTOR, value * FACTOR] if value > 0.0 else []
    if name == "damping":
        limits = [limit for limit in limits_or_nan(own.oscillator, own.law) if limit > 0.0]
        values += [factor * limit for limit in limits for factor in (0.5, 2.0)]
        values = values or [0.01, 1.0]
    return max(min(values), 1.0) if name == "windows" else min(values), max(values)


def box(own: Machine, asked: StickSlipMap) -> dict[str, tuple[float, float]]:
    """First and last value of the two parameters of a map, in the order of PARAMETERS.

    asked : section `map`; where it gives no ranges, those of `own_range` serve
    """
    if asked.ranges is None:
        ranges = {name: own_range(name, own) for name in asked.parameters}
    else:
        ranges = dict(zip(asked.parameters, asked.ranges, strict=True))
    return {name: (float(ranges[name][0]), float(ranges[name][1])) for name in PARAMETERS if name in ranges}


def spaced(first: float, last: float, points: int) -> np.ndarray:
    """Values from first to last, evenly in their logarithm, or evenly from zero."""
    return np.geomspace(first, last, points) if first > 0.0 else np.linspace(first, last, points)


class PointRuns:
    """Shares of stick-slip in the second half of runs from rest on the belt, counted from the first departure.

    One generator per realisation serves every point, so that neighbours err together. Results do not depend on the
    order of the points.

    own : the machine that changes from point to point
    periods : natural periods of a run after its first departure
    seed : of the random numbers; each realisation adds its own
    runs, steps : counts of what was done
    """

    def __init__(self, own: Machine, periods: float, seed: tuple[int, ...]) -> None:
        self._own, self._periods, self._seed = own, periods, seed
        self._of_friction: tuple[float, ...] | None = None
        self._kept: dict[int, KeptPath] = {}
        self.runs = self.steps = 0

    def shares(self, values: Mapping[str, float], realisations: Sequence[int]) -> np.ndarray:
        """(realisations,) [-] at a point, given by values of the parameters of the box."""
        point = self._own.changed(values)
        of_friction = tuple(values[name] for name in OF_FRICTION if name in values)
        if of_friction != self._of_friction:
            self._of_friction, self._drawn, self._kept = of_friction, point, {}
        shares = np.empty(len(realisations))
        for row, number in enumerate(realisations):
            if number not in self._kept:
                self._kept[number] = self._drawn.kept_path([*self._seed, number])
            motion, first, states = run_until_known(point, self._kept[number], self._drawn.paths.spacing, self._periods)
            share = states.share(first + 0.5 * self._periods, first + self._periods)
            shares[row] = np.nan_to_num(share)  # micro-slips alone are no stick-slip
            self.runs, self.steps = self.runs + 1, self.steps + motion.steps
        return shares
