"""Stage stick_slip_map: the probability of stick-slip over two parameters; vibration and limits without scatter."""

from typing import TYPE_CHECKING

import numpy as np

from roughslip import store
from roughslip.oscillator.attractors import State, state_from_rest, vibration_limit
from roughslip.oscillator.limits import limits_or_nan
from roughslip.oscillator.machine import OF_FRICTION, PARAMETERS, Machine
from roughslip.oscillator.path import KeptPath
from roughslip.oscillator.states import run_until_known
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.search import lattice_map
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream
from roughslip.study.from_scene.machine import machine_of
from roughslip.study.job import Job

if TYPE_CHECKING:
    from roughslip.scene.oscillator import StickSlipMap

# Points that are run: a tenth of the runs at 24 x 24 points, and the same error of the probability, 0.006; of a coarse
# map a quarter of its points.
MOST_COMPUTED, SHARE = 56, 1 / 4
RUNS, PERIODS = 20, 40  # of a point: a probability to a tenth; settled after half of them
FACTOR = 4.0  # of a range around the scene's own value
POINT = ("x", "y")
VIBRATES = "1 where the mass, from rest and without scatter, vibrates and does not stick"
LIMITS = {
    "hopf_damping": "damping ratio below which steady sliding is unstable",
    "existence_limit": "damping ratio above which the stick-slip cycle does not exist",
    "vibration_limit": "damping ratio up to which a mass that does not stick vibrates; NaN where none does",
}


def work(scene: Scene, job: Job) -> None:
    """Write the share of stick-slip in the second half of the runs, and the limits in damping along the other axis."""
    asked, own = scene.map, machine_of(scene, job.optional("friction"))
    ranges = box(own, asked)
    names = tuple(ranges)
    axes = [(np.geomspace if ends[0] > 0.0 else np.linspace)(*ends, asked.points) for ends in ranges.values()]
    kept: dict[tuple[float, ...], tuple[list[KeptPath], float]] = {}

    def probability(i: int, j: int) -> float:
        """At a point. One generator per run serves every point, so that neighbours err together."""
        values = {name: float(axis[k]) for name, axis, k in zip(names, axes, (i, j), strict=True)}
        point, of_friction = own.changed(values), tuple(values[name] for name in OF_FRICTION if name in values)
        if of_friction not in kept:
            kept.clear()
            paths = [point.kept_path([scene.seed, Stream.MAP, number]) for number in range(RUNS)]
            kept[of_friction] = paths, point.paths.spacing
        paths, spacing = kept[of_friction]
        job.count(runs=RUNS)
        return float(np.mean([share_of_stick_slip(point, path, spacing) for path in paths]))

    shares = lattice_map(probability, asked.points, min(MOST_COMPUTED, int(SHARE * asked.points**2)))
    limits = limits_along(job, own, names[1], axes[1] if names[0] == "damping" else None)
    interval = shares.probability, *wilson_interval(RUNS * shares.probability, RUNS)
    title = "probability of stick-slip, share of the second half of the runs"
    vibration = vibrating(own, dict(zip(names, axes, strict=True)), shares.is_computed, limits[-1])
    variables = store.with_interval("probability", POINT, interval, "1", title) | {
        "vibration": store.Variable(POINT, vibration, "1", VIBRATES),
        "is_computed": store.Variable(POINT, shares.is_computed, "1", "1 where runs were made, else of the spline"),
        "prediction_error": store.Variable(
            (), shares.prediction_error, "1", "mean error of the spline at the last third of the points"
        ),
        "map_runs": store.Variable((), RUNS, "1", f"runs at a point, of {PERIODS} natural periods"),
        "map_parameters": store.Variable(("axis",), np.array(names), "1", "parameters of the axes x and y"),
    }
    for axis, name, values in zip(POINT, names, axes, strict=True):
        parameter = PARAMETERS[name]
        variables[f"map_{axis}"] = store.Variable((axis,), values, parameter.unit, parameter.title)
        variables[f"map_{axis}_own"] = store.Variable((), own.value(name), parameter.unit, f"{name} of the scene")
    for (name, label), values in zip(LIMITS.items(), limits, strict=True):
        variables[name] = store.Variable(("y",), values, "1", label)
    store.write(job.output, variables, job.key)


def share_of_stick_slip(machine: Machine, path: KeptPath, spacing_m: float) -> float:
    """In the second half of a run from rest on the belt, counted from its first departure; micro-slips are none."""
    _, first, states = run_until_known(machine, path, spacing_m, PERIODS)
    return float(np.nan_to_num(states.share(first + 0.5 * PERIODS, first + PERIODS)))


def vibrating(own: Machine, axes: dict[str, np.ndarray], is_computed: np.ndarray, limit: np.ndarray) -> np.ndarray:
    """(points, points) 1 where the mass vibrates; searched where a computed point or a limit shows that it may."""
    (x, first), (y, second) = axes.items()

    def vibrates(i: int, j: int) -> bool:
        point = own.changed({x: float(first[i]), y: float(second[j])})
        return state_from_rest(point) is State.VIBRATION

    found = np.zeros(is_computed.shape)
    if np.isfinite(limit).any() or any(vibrates(i, j) for i, j in np.argwhere(is_computed).tolist()):
        found[:] = [[vibrates(i, j) for j in range(second.size)] for i in range(first.size)]
    return found


def limits_along(job: Job, own: Machine, name: str, values: np.ndarray | None) -> np.ndarray:
    """(3, points) limits in damping over the values of a parameter; NaN where the other axis is not damping."""
    if values is None:
        return np.full((len(LIMITS), job.scene.map.points), np.nan)
    rows = []
    for machine in (own.changed({name: float(value)}) for value in values):
        hopf, existence = limits_or_nan(machine.oscillator, machine.law)
        vibration = vibration_limit(machine, None if np.isnan(existence) else existence)
        rows.append((hopf, existence, np.nan if vibration is None else vibration))
    limits = np.transpose(rows)
    if (without := values[np.isnan(limits[1])]).size:
        where = f"{without.size} values of {name}, {without[0]:.4g} to {without[-1]:.4g}"
        job.warn(f"no stick-slip cycle at {where}; its limit is stored as NaN")
    return limits


def own_range(name: str, own: Machine) -> tuple[float, float]:
    """First and last value of a parameter: a factor of FACTOR around that of the machine.

    Damping ratios also reach half of the smaller limit of the machine and twice the larger one, where it has limits.
    They end at 1, as the key does.
    """
    value = own.value(name)
    values = [value / FACTOR, value * FACTOR] if value > 0.0 else []
    if name == "damping":
        limits = [limit for limit in limits_or_nan(own.oscillator, own.law) if limit > 0.0]
        values += [factor * limit for limit in limits for factor in (0.5, 2.0)]
        values = values or [0.01, 1.0]
        return min(*values, 1.0 / FACTOR), min(max(values), 1.0)
    return max(min(values), 1.0) if name == "windows" else min(values), max(values)


def box(own: Machine, asked: "StickSlipMap") -> dict[str, tuple[float, float]]:
    """First and last value of the two parameters of a map, in the order of PARAMETERS.

    asked : section `map`; where it gives no ranges, those of `own_range` serve
    """
    if asked.ranges is None:
        ranges = {name: own_range(name, own) for name in asked.parameters}
    else:
        ranges = dict(zip(asked.parameters, asked.ranges, strict=True))
    return {name: (float(ranges[name][0]), float(ranges[name][1])) for name in PARAMETERS if name in ranges}
