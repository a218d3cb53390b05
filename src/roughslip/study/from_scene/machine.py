"""The machine of a scene: its oscillator and law, with friction from given numbers, a record, or solved contacts.

`damping_ratio` and `correlation_length_m` go through here: from the scene to `Oscillator` and to `Friction`, both parts
of the `Machine` that every stage of the motion runs.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import ConvergenceError, IllPosedError, InputError
from roughslip.friction.paths import Friction, Pad, Paths
from roughslip.friction.process import PAPER_SHAPES, CorrelationShape
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.grazing import GrazingResponse, grazing_response
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import hopf_damping, limits_or_nan
from roughslip.oscillator.machine import FrictionOverLoad, Machine
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.motion import MotionOptions
from roughslip.oscillator.table_law import TableLaw, law_from_scene
from roughslip.scene.part import Scene

DRAWN_PERIODS = 10  # natural periods of a trajectory that are kept for drawing
# Natural periods that reattachment statistics leave out. Stick forgets what came before it, so that few are transient.
DISCARDED_PERIODS = 10.0
MEDIAN = 50.0  # [%] penetration of the windows of a scene without a load
TOLERANCE = 1e-5  # of the motion; at 1e-4 the limits of a machine that hardly scatters move by 0.2 %,
WITH_MEMORY = 1e-4  # and with a memory by 0.04 %


def machine_of(scene: Scene, statistics: Path | None) -> Machine:
    """The machine of a scene. statistics : the file of its friction, if any"""
    friction, belt = friction_of(scene, statistics), oscillator_of(scene.oscillator)
    law, over_load = law_of(scene, statistics, friction.mean), over_load_of(scene, statistics)
    options = MotionOptions(WITH_MEMORY if isinstance(law, MemoryLaw) else TOLERANCE)
    return Machine(belt, law, friction, options, over_load)


def over_load_of(scene: Scene, statistics: Path | None) -> FrictionOverLoad | None:
    """How friction follows the load: the force is shear strength times contact area; None where no loads were solved.

    Areas rise with the load. A load at which their errors hide that is left out.
    """
    result = statistics_of(scene, statistics)
    if result is None or not is_under_load(result) or len(result["over_loads_nominal_pressure"]) < 2:
        return None
    own, pressures = scene.oscillator.normal_force_n, result["over_loads_nominal_pressure"]
    loads = own * pressures / result["nominal_pressure"]
    forces = loads * result["over_loads_mean"] / result["load_mean"]
    kept = [(own, own)]
    for load, force in zip(loads.tolist(), forces.tolist(), strict=True):
        if load > kept[-1][0] and force > kept[-1][1]:
            kept.append((load, force))
    for load, force in zip(loads[::-1].tolist(), forces[::-1].tolist(), strict=True):
        if load < kept[0][0] and force < kept[0][1]:
            kept.insert(0, (load, force))
    return FrictionOverLoad(*(tuple(column) for column in zip(*kept, strict=True)))


def oscillator_of(section: Any) -> Oscillator:
    """The mass on the belt of a section `oscillator`."""
    return Oscillator(
        mass_kg=section.mass_kg,
        natural_frequency_rad_per_s=math.sqrt(section.stiffness_n_per_m / section.mass_kg),
        damping_ratio=section.damping_ratio,
        belt_velocity_m_per_s=section.belt_velocity_m_per_s,
        normal_force_n=section.normal_force_n,
        excitation_force_n=section.excitation_force_n,
        excitation_frequency_rad_per_s=section.excitation_frequency_rad_per_s,
    )


def law_of(scene: Scene, statistics: Path | None, mean: float) -> FrictionLaw:
    """The friction law of a record, or that which the scene names, with the mean friction coefficient.

    Below the slowest speed of a record friction is taken as there. The limit of stick is the first value of the curve,
    or that of the scene where it is larger.
    """
    result = statistics_of(scene, statistics)
    if result is None or not is_record(result):
        return law_from_scene(scene.oscillator, mean)
    speeds, values = result["curve_speed"], result["curve"]
    static = max(scene.oscillator.static_friction or 0.0, values[0])
    at_rest = min(float(result["curve_at_rest"]), static)
    return TableLaw((0.0, *speeds), (at_rest, *values), static, measured_from_m_per_s=float(speeds[0]))


def friction_of(scene: Scene, statistics: Path | None) -> Friction:
    """The friction of the pad: as the scene gives it, or as a record or the windows of a file have it.

    The mean of several windows in parallel is that of their areas over that of their forces. Mean, scatter and length
    come from the solved windows with the expansion as control, the shapes from the solved windows alone. Shapes that
    the windows do not determine (`beta_at_bound`) are arbitrary: prefer `ensemble.marginal: paper`. Under a load,
    windows without contact have no coefficient. Where there are such, the scatter is that of the first-order influence
    of all windows.
    """
    given, result = scene.friction.statistics, statistics_of(scene, statistics)
    multiplies, windows = scene.friction.scatter == "multiplicative", scene.oscillator.windows_in_parallel
    pad: Callable[[float, float], Pad] | None = None
    if given is not None:
        mean, deviation, length = scene.friction.mean, given.standard_deviation, given.correlation_length_m
        a, b = PAPER_SHAPES
    elif result is None:
        raise InputError("the oscillator needs --friction where the scene gives no friction statistics")
    elif is_record(result):
        kind, mean = scene.friction.scatter, float(result["record_mean"])
        deviation = float(result[f"{kind}_std"]) * (mean if multiplies else 1.0)
        length, (a, b) = float(result[f"{kind}_length"]), map(float, result["beta_shapes"])
    else:
        own = own_windows(result)
        mean, deviation, length, a, b = (
            float(own[name]) for name in ("mean", "std", "length_least_squares", "beta_a", "beta_b")
        )
        if is_under_load(result):
            mean = float(own["load_mean"])
            deviation = deviation if own["missing_share"] == 0.0 else float(own["pad_std"][0])
        elif windows > 1:
            mean = of_pad(own, "pad_mean", windows)
        pad = pad_of_windows(own, deviation)
    marginal = PAPER_SHAPES if scene.ensemble.marginal == "paper" else (a, b)
    return Friction(mean, deviation, length, marginal, windows, pad, multiplies)


def statistics_of(scene: Scene, statistics: Path | None) -> store.Result | None:
    """The file of the friction; None where the scene gives numbers or there is none."""
    return None if statistics is None or scene.friction.statistics is not None else store.read(statistics)


def is_record(result: store.Result) -> bool:
    """Whether friction is that of a record, which is that of the whole pad, and not of windows."""
    return "record_mean" in result


def is_under_load(result: store.Result) -> bool:
    """Whether statistics of friction are those under the load of the scene, and not over penetration."""
    return "load_mean" in result


def own_windows(result: store.Result) -> dict[str, np.ndarray]:
    """What friction statistics say under the load, or else at the median, with the expansion as control, by name."""
    if is_under_load(result):
        return dict(result)
    median = int(np.flatnonzero(result["percentile"] == MEDIAN)[0])
    own = {
        name: variable.values[median] if variable.dimensions[:1] == ("level",) else variable.values
        for name, variable in result.variables.items()
    }
    return own | {name.removeprefix("combined_"): own[name] for name in own if name.startswith("combined_")}


def pad_of_windows(own: Mapping[str, np.ndarray], deviation: float) -> Callable[[float, float], Pad]:
    """Pads of the windows of a file, with the correlation of windows along and across the belt (`friction.pad`).

    own : from `own_windows`; deviation : standard deviation of a window

    The autocorrelation of a single window is exp(-s / L); that of a pad is stored at some numbers of windows.
    """

    def pad(windows: float, length_m: float) -> Pad:
        if windows == 1:
            return 1.0, length_m, None
        independent = (deviation / of_pad(own, "pad_std", windows)) ** 2
        length, shape = pad_correlation(own, windows)
        length *= length_m / float(own["length_least_squares"])  # a map may have others
        return max(independent, 1.0), length, shape

    return pad


def of_pad(own: Mapping[str, np.ndarray], name: str, windows: float) -> float:
    """A positive number of pads of so many windows : power laws between the stored ones, and beyond."""
    places, values = np.log(own["pad_windows"]), np.log(own[name])
    low = min(int(np.searchsorted(places, math.log(windows), side="right")), len(places) - 1) - 1
    share = (math.log(windows) - places[low]) / (places[low + 1] - places[low])
    return float(np.exp((1.0 - share) * values[low] + share * values[low + 1]))


def pad_correlation(own: Mapping[str, np.ndarray], windows: float) -> tuple[float, CorrelationShape]:
    """Length [m] and shape of the autocorrelation of the friction of a pad of so many windows."""
    place, last = math.log(windows, own["pad_windows"][1]), len(own["pad_windows"]) - 1
    low = min(int(place), last - 1)
    share, near = place - low, min(place - low, 1.0)  # beyond the largest pad the curve stays and the lags grow
    curves = own["pad_means"][low : low + 2] @ own["pad_parts"]
    curves /= curves[:, :1]
    curve = (1.0 - near) * curves[0] + near * curves[1]
    lags = own["pad_lag"][low] * (own["pad_lag"][low + 1, -1] / own["pad_lag"][low, -1]) ** share
    return CorrelationShape.of_lags(lags, curve)


def response_of_limit(machine: Machine, friction: Friction) -> tuple[GrazingResponse, float]:
    """The response of the limit of existence, and the scatter of the limit over that of the friction coefficient.

    friction : in place of the machine's own

    Raises as `grazing_response` does.
    """
    response = grazing_response(replace(machine, friction=friction))
    return response, response.scatter(friction.autocorrelation) / friction.unit


def friction_paths(scene: Scene, friction: Friction) -> Paths:
    """Realisations of the friction process, as long as the travel of the belt in any run of the ensemble.

    A margin of ten spans of the friction force is for slip that changes its sign. A run that needs more takes the path
    again.
    """
    ensemble, belt = scene.ensemble, oscillator_of(scene.oscillator)
    periods = max(ensemble.duration_periods, DISCARDED_PERIODS + DRAWN_PERIODS)
    length = belt.V * 2 * np.pi * periods + 10 * belt.F
    return friction.paths(ensemble.nodes_per_correlation_length, length, ensemble.process)


BELOW, NEAR, ABOVE = 5, 12, 3
REACH = 3.0  # standard deviations of the limit
LEAST = 0.05  # damping ratio that a list surrounds where there is neither a limit nor damping


def damping_ratios(scene: Scene, machine: Machine, friction: Friction) -> tuple[float, ...]:
    """The damping ratios of figure5: as given, or around the limits of the machine without excitation.

    They go from a fifth of the smaller limit to 1.25 of the larger one, or as far as the scatter of friction moves the
    existence limit: NEAR of them where it moves it, BELOW and ABOVE of them on either side. Without an existence limit
    they surround the machine's own damping ratio.
    """
    if scene.ensemble.damping_ratios is not None:
        return scene.ensemble.damping_ratios
    free = replace(machine, oscillator=replace(machine.oscillator, excitation_force_n=0.0))
    try:
        response, scatter = response_of_limit(free, friction)
        limit, moved = response.limit, REACH * scatter * friction.pad_deviation
    except (IllPosedError, ConvergenceError):
        _, existence = limits_or_nan(free.oscillator, free.law)  # as with a memory, without a response
        limit, moved = existence if existence > 0.0 else max(machine.oscillator.damping_ratio, LEAST), 0.0
    hopf = max(hopf_damping(free.oscillator, free.law), 0.0)
    first = 0.2 * (min(limit, hopf) or limit)
    last = max(1.25 * max(limit, hopf), limit + moved)
    near = np.linspace(max(limit - moved, first), limit + moved, NEAR)
    below, above = np.linspace(first, near[0], BELOW + 1)[:-1], np.linspace(near[-1], last, ABOVE + 1)[1:]
    return tuple(np.unique(np.concatenate([below, near, above])).tolist())
