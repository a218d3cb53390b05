"""The mass on the belt of a scene: oscillator, friction law, and the friction process with its realisations.

Curve and scatter of a friction record, as a stage has stored them. It depends on no code that fits.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.errors import InputError
from roughslip.friction.paths import Paths, path_sampler
from roughslip.friction.penetration import between
from roughslip.friction.process import (
    PAPER_SHAPES,
    CorrelationShape,
    FrictionProcess,
    Marginal,
    autocorrelation_at,
    average_beta,
)
from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.grazing import GrazingResponse, grazing_response
from roughslip.oscillator.laws import LAWS
from roughslip.oscillator.motion import MotionOptions
from roughslip.probability import BetaDistribution, QuantileDistribution
from roughslip.record.result import FrictionCurve, FrictionScatter
from roughslip.scene.types import Scene
from roughslip.store import Result

DRAWN_PERIODS = 10  # natural periods of a trajectory that are kept for drawing
# Natural periods that reattachment statistics leave out. Stick forgets what came before it, so that few are transient.
DISCARDED_PERIODS = 10.0
TRIANGLE = CorrelationShape(np.array([0.0, 2.0]), np.array([1.0, 0.0]))  # of an average over a window of two lengths
TOLERANCE = 1e-5  # of the motion; mean counts are the same within their error from 1e-4 to 1e-10


@dataclass(frozen=True)
class FrictionNumbers:
    """What the oscillator takes from the friction statistics at one penetration.

    mean, standard_deviation : of the friction coefficient
    correlation_length_m : [m] of its autocorrelation, which is exponential but for the shape of a record
    beta_a, beta_b : shapes of its marginal
    curve : the law that a record gives in place of the scene's, at this mean
    shape : the triangle of a record that is an average over a window
    """

    mean: float
    standard_deviation: float
    correlation_length_m: float
    beta_a: float
    beta_b: float
    curve: TableLaw | None = None
    shape: CorrelationShape | None = None


def friction_numbers(scene: Scene, statistics: Path | None) -> FrictionNumbers:
    """The numbers that the scene gives, or else those of the statistics file, at a penetration or under the load.

    They are those of one window, but for the mean of several windows in parallel: it is that of their areas over that
    of their forces. The mean is mu_fit(d). Mean, scatter and length come from the solved windows with the expansion as
    control, the shapes from the solved windows alone. Between two penetrations numbers are interpolated
    (`friction.penetration`). Shapes that the windows do not determine (`beta_at_bound`) are arbitrary there: prefer
    `ensemble.marginal: paper`. Under a load, windows without contact have no coefficient. Where there are such, the
    scatter is that of the first-order influence of all windows.
    """
    given = scene.friction.statistics
    if given is not None:
        return FrictionNumbers(given.mean, given.standard_deviation, given.correlation_length_m, *given.beta_shapes)
    if statistics is None:
        raise InputError("the oscillator needs --friction where the scene gives no friction statistics")
    result = store.read(statistics)
    if is_record(result):
        return of_record(scene, result)
    names = {"mean": "mean", "standard_deviation": "std", "correlation_length_m": "length_least_squares"}
    combined = "" if is_under_load(result) else "combined_"
    columns = {key: result[combined + name] for key, name in names.items()}
    columns |= {name: result[name] for name in ("beta_a", "beta_b")}
    numbers = {name: at_penetration(scene, result, values) for name, values in columns.items()}
    windows = scene.oscillator.windows_in_parallel
    if is_under_load(result):
        numbers |= {"mean": float(result["load_mean"]), "standard_deviation": float(window_scatter(result))}
    elif windows > 1:
        numbers["mean"] = at_penetration(scene, result, of_pad(result, "pad_mean", windows))
    return FrictionNumbers(**numbers, curve=None, shape=None)


def is_under_load(result: store.Result) -> bool:
    """Whether statistics of friction are those under the load of the scene, and not over penetration."""
    return "load_mean" in result


def at_penetration(scene: Scene, result: store.Result, values: np.ndarray) -> float:
    """Values : (levels,) of the friction statistics at the penetration of the windows, or () under the load."""
    if is_under_load(result):
        return float(values)
    return between(result["percentile"], values, penetration(scene))


def penetration(scene: Scene) -> float:
    """[%] of the windows of a scene without a load."""
    percentile = scene.oscillator.penetration_percentile
    assert percentile is not None
    return percentile


def of_pad(result: store.Result, name: str, windows: float) -> np.ndarray:
    """(levels,) or () a positive number of pads of so many windows : power laws between the stored ones, and beyond."""
    places, values = np.log(result["pad_windows"]), np.log(result[name])
    low = min(int(np.searchsorted(places, math.log(windows), side="right")), len(places) - 1) - 1
    share = (math.log(windows) - places[low]) / (places[low + 1] - places[low])
    return np.asarray(np.exp((1.0 - share) * values[..., low] + share * values[..., low + 1]))


def correlation(
    scene: Scene, numbers: FrictionNumbers, statistics: Path | None, windows: float | None = None
) -> tuple[float, CorrelationShape | None]:
    """Length [m] and shape of the autocorrelation of the friction of all windows in parallel.

    windows : in place of the scene's number

    That of a single window, or of windows of which the scene gives the statistics, is exp(-s / L); that of a record may
    be a triangle.
    """
    count, length = scene.oscillator.windows_in_parallel if windows is None else windows, numbers.correlation_length_m
    if count == 1 or (result := of_windows(statistics)) is None:
        return length, numbers.shape
    name = "length_least_squares" if is_under_load(result) else "combined_length_least_squares"
    own = at_penetration(scene, result, result[name])  # a map may have others
    of_pad, shape = pad_correlation(scene, result, count)
    return of_pad * length / own, shape


def pad_correlation(scene: Scene, result: store.Result, windows: float) -> tuple[float, CorrelationShape]:
    """Length [m] and shape of the autocorrelation of the friction of a pad of so many windows."""
    place, last = math.log(windows, result["pad_windows"][1]), len(result["pad_windows"]) - 1
    low = min(int(place), last - 1)
    share, near = place - low, min(place - low, 1.0)  # beyond the largest pad the curve stays and the lags grow
    curves = result["pad_means"][low : low + 2] @ result["pad_parts"].T
    curves /= curves[:, :1]
    curve = (1.0 - near) * curves[0] + near * curves[1]
    if not is_under_load(result):
        curve = np.array([np.interp(penetration(scene), result["percentile"], row) for row in curve])
    lags = result["pad_lag"][low] * (result["pad_lag"][low + 1, -1] / result["pad_lag"][low, -1]) ** share
    return CorrelationShape.of_lags(lags, curve)


def independent_windows(scene: Scene, statistics: Path | None, windows: int | None = None) -> float:
    """Independent windows, at least 1, whose mean coefficient scatters as that of all that bear the load in parallel.

    windows : in place of the scene's number

    From contacts it holds the correlation of windows along and across the belt (`friction.pad`). Windows of which the
    scene gives the statistics are independent.
    """
    count = scene.oscillator.windows_in_parallel if windows is None else windows
    if count == 1 or (result := of_windows(statistics)) is None:
        return float(count)
    own = window_scatter(result) if is_under_load(result) else result["combined_std"]
    return max(at_penetration(scene, result, own / of_pad(result, "pad_std", count)) ** 2, 1.0)


def pad_deviation(scene: Scene, numbers: FrictionNumbers, statistics: Path | None, windows: int | None = None) -> float:
    """Standard deviation of the friction coefficient of all windows that bear the load. Arguments as there."""
    return numbers.standard_deviation / math.sqrt(independent_windows(scene, statistics, windows))


def window_scatter(result: store.Result) -> np.ndarray:
    """() standard deviation of a window under the load: its own, or of first order where some have no contact."""
    return np.asarray(result["std"] if result["missing_share"] == 0.0 else result["pad_std"][0])


def oscillator(scene: Scene) -> Oscillator:
    """The mass on the belt."""
    return Oscillator(**{field.name: getattr(scene.oscillator, field.name) for field in fields(Oscillator)})


def of_record(scene: Scene, result: store.Result) -> FrictionNumbers:
    """The numbers of a record, for scatter as the scene says, and its curve as a table.

    Below the slowest speed measured friction is taken as there. The limit of stick is that of the scene, at least the
    first value of the curve.
    """
    curve, scatter = curve_of(result), scatter_of(result, scene.friction.scatter)
    static = max(scene.oscillator.static_friction, curve.friction[0])
    law = TableLaw(
        (0.0, *curve.speeds_m_per_s),
        (min(curve.at_rest, static), *curve.friction),
        static,
        measured_from_m_per_s=float(curve.speeds_m_per_s[0]),
    )
    mean, (a, b) = float(result["record_mean"]), result["beta_shapes"]
    deviation = scatter.standard_deviation * (mean if scene.friction.scatter == "multiplicative" else 1.0)
    shape = TRIANGLE if scatter.shape == "triangle" else None
    return FrictionNumbers(mean, deviation, scatter.correlation_length_m, float(a), float(b), law, shape)


def of_windows(statistics: Path | None) -> store.Result | None:
    """The friction of windows; None where the scene gives numbers or a record, which is that of the whole pad."""
    result = None if statistics is None else store.read(statistics)
    return None if result is None or is_record(result) else result


def law(scene: Scene, numbers: FrictionNumbers) -> FrictionLaw:
    """The friction law of the record, or that which the scene names, with the mean friction coefficient."""
    return numbers.curve or LAWS[scene.oscillator.law].from_scene(scene.oscillator, numbers.mean)


def unit_of_scatter(scene: Scene, numbers: FrictionNumbers, kind: str | None = None) -> float:
    """What mu_S is measured in: the mean friction coefficient where it multiplies, else 1. kind : not the scene's"""
    return numbers.mean if (kind or scene.friction.scatter) == "multiplicative" else 1.0


def response_of_limit(
    scene: Scene,
    belt: Oscillator,
    numbers: FrictionNumbers,
    statistics: Path | None,
    windows: float | None = None,
    kind: str | None = None,
) -> tuple[GrazingResponse, float]:
    """The response of the limit of existence, and the scatter of the limit over that of the friction coefficient.

    windows, kind : in place of the scene's number, and of its scatter, additive or multiplicative

    Raises as `grazing_response` does.
    """
    section, scatter_is = scene.oscillator, kind or scene.friction.scatter
    response = grazing_response(belt, law(scene, numbers), section.stochastic_static_limit, scatter_is)
    length, shape = correlation(scene, numbers, statistics, windows)
    scatter = response.scatter(partial(autocorrelation_at, length_m=length, shape=shape))
    return response, scatter / unit_of_scatter(scene, numbers, kind)


def motion_options(scene: Scene) -> MotionOptions:
    """How every run of the scene treats friction, and how it is integrated."""
    section = scene.oscillator
    return MotionOptions(
        tolerance=TOLERANCE,
        stochastic_static_limit=section.stochastic_static_limit,
        scatter=scene.friction.scatter,
    )


def path_length(belt: Oscillator, duration_periods: float) -> float:
    """[m] length of a friction path that is enough for a run: the travel of the belt.

    It has a margin of ten spans of the friction force, for slip that changes its sign. A run that needs more
    ends with an error.
    """
    return belt.V * 2 * np.pi * duration_periods + 10 * belt.F


def friction_process(
    scene: Scene, numbers: FrictionNumbers, statistics: Path | None, windows: int | None = None
) -> FrictionProcess:
    """The stochastic part mu_S, over the mean where it multiplies: the marginal that the scene names, at the numbers.

    The paper scales Beta(2.1, 5) by the least and the largest value of its sample, and these depend on its size. Here
    Beta(2.1, 5) has the mean and standard deviation of the windows. With several windows in parallel, the marginal is
    that of the mean of as many Beta variables as there are `independent_windows`, and the autocorrelation that of the
    pad (`friction.pad`). `windows` replaces the scene's number of windows.
    """
    unit = unit_of_scatter(scene, numbers)
    moments = numbers.mean / unit, numbers.standard_deviation / unit
    kind = scene.ensemble.marginal
    marginal: Marginal
    if kind == "empirical":
        if (result := of_windows(statistics)) is None:
            raise InputError("the quantiles of the windows need --friction")
        marginal = QuantileDistribution(result["quantile"], *moments)
    else:
        shapes = PAPER_SHAPES if kind == "paper" else (numbers.beta_a, numbers.beta_b)
        window = BetaDistribution.of_moments(*shapes, *moments)
        marginal = average_beta(window, independent_windows(scene, statistics, windows))
    return FrictionProcess(marginal, *correlation(scene, numbers, statistics, windows))


def friction_paths(scene: Scene, process: FrictionProcess, nodes_per_length: int) -> Paths:
    """Realisations of the process, long enough for every run of the ensemble."""
    ensemble = scene.ensemble
    periods = max(ensemble.duration_periods, DISCARDED_PERIODS + DRAWN_PERIODS)
    length = path_length(oscillator(scene), periods)
    spacing = process.correlation_length_m / nodes_per_length
    return path_sampler(process, spacing, length, ensemble.process)


def is_record(result: Result) -> bool:
    """Whether friction is that of a record, and not of windows."""
    return "record_mean" in result


def curve_of(result: Result) -> FrictionCurve:
    """The curve of a stored record."""
    form = str(result["curve_form"][0])
    at_rest = float(result["curve_at_rest"]), result["curve_factor_at_rest"]
    factor, misfit = result["curve_factor"], float(result["misfit"])
    return FrictionCurve(form, result["curve_speed"], result["curve"], factor, misfit, *at_rest)


def scatter_of(result: Result, kind: str) -> FrictionScatter:
    """The scatter of a stored record, additive or multiplicative."""
    return FrictionScatter(
        float(result[f"{kind}_std"]),
        float(result[f"{kind}_length"]),
        result[f"{kind}_log_covariance"],
        str(result[f"{kind}_shape"][0]),
        float(result[f"{kind}_lengths"]),
        bool(result[f"{kind}_identified"]),
    )
