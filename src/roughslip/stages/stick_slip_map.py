"""Stage stick_slip_map: the probability of stick-slip over two parameters, with the deterministic limits."""

import numpy as np

from roughslip import store
from roughslip.oscillator.limits import limits_or_nan
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.lattice_map import LatticeMap, lattice_map
from roughslip.scene.declarations import Stage
from roughslip.scene.ensemble import StickSlipMap
from roughslip.stages.from_scene import mass_on_belt, variation
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.streams import Stream
from roughslip.stages.from_scene.variation import PointRuns, box, spaced
from roughslip.stages.runtime import skip_reasons
from roughslip.stages.runtime.command import Job

STAGE = Stage(
    name="stick_slip_map",
    reads="seed oscillator map",
    reads_if_given="ensemble.marginal friction.statistics friction.scatter",
    optional={"friction": "friction record"},
    result="oscillator/map.nc",
    memory_mb=620,
)

# Points that are run: a tenth of the runs at 24 x 24 points, and the same error of the probability, 0.006; of a coarse
# map a quarter of its points.
MOST_COMPUTED, SHARE = 56, 1 / 4
POINT = ("x", "y")
LIMITS = {
    "hopf_damping": "damping ratio below which steady sliding is unstable",
    "existence_limit": "damping ratio above which the stick-slip cycle does not exist",
}


def work(job: Job) -> None:
    """Write the share of stick-slip in the second half of the runs, and the limits in damping along the other axis."""
    scene, asked = job.scene, job.scene.map
    numbers = mass_on_belt.friction_numbers(scene, job.arguments.friction)
    own, ranges = variation.system(scene, numbers), box(scene, numbers, asked)
    names = tuple(ranges)
    axes = [spaced(*ranges[name], asked.points) for name in names]
    runs = range(asked.realisations)
    at_points = PointRuns(scene, numbers, job.arguments.friction, asked.duration_periods, Stream.MAP)

    def probability(i: int, j: int) -> float:
        values = {name: float(axis[k]) for name, axis, k in zip(names, axes, (i, j), strict=True)}
        return float(np.mean(at_points.shares(values, runs)))

    with job.usage.core():
        shares = lattice_map(probability, asked.points, min(MOST_COMPUTED, int(SHARE * asked.points**2)))
        limits = limits_along(job, numbers, names[1], axes[1] if names[0] == "damping" else None)
    job.usage.count(runs=at_points.runs, steps=at_points.steps)
    spared = asked.points**2 * asked.realisations - at_points.runs
    skipped = {skip_reasons.STICK: at_points.sticks, skip_reasons.KEPT: at_points.runs - at_points.paths}
    job.usage.skip(skipped | {skip_reasons.BETWEEN: spared})
    variables = of_shares(shares, asked)
    for axis, name, values in zip(POINT, names, axes, strict=True):
        parameter = variation.PARAMETERS[name]
        variables[f"map_{axis}"] = store.Variable((axis,), values, parameter.unit, parameter.title)
        variables[f"map_{axis}_own"] = store.Variable((), parameter.value(own), parameter.unit, f"{name} of the scene")
    for (name, label), values in zip(LIMITS.items(), limits, strict=True):
        variables[name] = store.Variable(("y",), values, "1", label)
    variables["map_parameters"] = store.Variable(("axis",), np.array(names), "1", "parameters of the axes x and y")
    store.write(job.arguments.output, variables, job.key)


def limits_along(job: Job, numbers: FrictionNumbers, name: str, values: np.ndarray | None) -> np.ndarray:
    """(2, points) limits in damping over the values of a parameter; NaN where the other axis is not damping."""
    if values is None:
        return np.full((2, job.scene.map.points), np.nan)
    systems = (variation.changed(job.scene, numbers, {name: float(value)}) for value in values)
    limits = np.array([limits_or_nan(system.belt, system.law) for system in systems]).T
    if (without := values[np.isnan(limits[1])]).size:
        where = f"{without.size} values of {name}, {without[0]:.4g} to {without[-1]:.4g}"
        job.usage.warn(f"no stick-slip cycle at {where}; its limit is stored as NaN")
    return limits


def of_shares(shares: LatticeMap, asked: StickSlipMap) -> dict[str, store.Variable]:
    """The probability at every point with its interval, and how it was found."""
    interval = shares.probability, *wilson_interval(asked.realisations * shares.probability, asked.realisations)
    title = "probability of stick-slip, share of the second half of the runs"
    columns = {
        "is_computed": (POINT, shares.is_computed.astype(np.int8), "1 where runs were made, 0 where the spline says"),
        "prediction_error": ((), shares.prediction_error, "mean error of the spline at the last third of the points"),
        "map_periods": ((), asked.duration_periods, "natural periods of a run"),
        "map_runs": ((), asked.realisations, "runs at a point"),
    }
    variables = {name: store.Variable(dims, value, "1", label) for name, (dims, value, label) in columns.items()}
    return store.with_interval("probability", POINT, interval, "1", title) | variables
