"""What a record says: its mean curve, the scatter about it, and what else was in it that is neither.

Drift, the period of a revolution and the difference of ramps up and down are regressors of the mean. The process is
fitted about a flexible curve, so that a law which does not fit leaves nothing to the scatter.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
import scipy

from roughslip.errors import IllPosedError
from roughslip.probability.estimate import NORMAL_95
from roughslip.record.curve import FrictionCurve, SpeedBasis, f_test, fitted_curve, left
from roughslip.record.disturbances import repetition, with_noise, without_noise
from roughslip.record.likelihood import ProcessFit, SlidingSamples, fitted_process
from roughslip.results import described, result

LOGGER = logging.getLogger("roughslip")
FEWEST_LENGTHS = 50.0  # correlation lengths, below which a record cannot tell the scatter
FEWEST_SAMPLES = 200
CLEAR_RATIO = 3.0  # of log likelihoods: one kind of scatter is twenty times as likely as the other
SIGNIFICANT = 1e-3  # p-value of drift, of a period and of ramps that differ
SEPARATE = 0.9  # share of drift that the curve may explain: above it, the two cannot be separated
LEAST_RAMP = 0.05  # of the range of speeds in the time of the record: slower changes are no ramp
HARMONICS = 2  # of a revolution
MOST_PERIODS = 300  # wavelengths that are searched
MOST_PHASES = 12  # records or strokes, each with a phase of its own, in which a period is known or searched
LEAST_SHARE = 0.05  # of the mean friction, below which the factor of multiplicative scatter does not fall
OF_MEAN = np.array([2.0, 1.0])  # powers of deviation and length in the variance of a mean
SLIP_TILT = 0.2  # of the deviation of the scatter
TELLABLE = 0.03  # [-] coefficient of variation of the curve, from which additive and multiplicative differ at all


@result
class FrictionScatter:
    """The stationary scatter about the curve, along the slipped distance."""

    standard_deviation: float = described("additive: of the friction; multiplicative: of the friction over its mean")
    correlation_length_m: float = described("integral of the autocorrelation from zero on", "m")
    log_covariance: np.ndarray = described("covariance of the logarithms of these two", "1", "error other_error")
    lengths: float = described("correlation lengths that the record holds")
    identified: bool = described('false, "cannot tell", where these are too few; the numbers are then a guess')

    def interval(self) -> np.ndarray:
        """(2, 2) ends of the 95 % intervals of standard deviation and correlation length, a row each."""
        values = np.log([self.standard_deviation, self.correlation_length_m])
        half = NORMAL_95 * np.sqrt(np.diag(self.log_covariance))
        return np.exp(np.stack([values - half, values + half], axis=1))


@result
class RecordFit:
    """All that a record says."""

    curve: FrictionCurve = described("mean friction over speed")
    additive: FrictionScatter = described("the scatter about it, if it is additive")
    multiplicative: FrictionScatter = described("the scatter about it, if it is multiplicative")
    kind: str = described("additive, multiplicative or cannot tell")
    ratio: float = described("log likelihood of multiplicative scatter over that of additive")
    skewness: tuple[float, float] = described("skewness of the scatter, with its standard error")
    excess: tuple[float, float] = described("excess kurtosis of the scatter, with its standard error")
    drift: float = described("p-value that there is no drift; NaN where the record cannot tell")
    period: float = described("p-value that there is no period; NaN where the record cannot tell")
    period_m: float = described("period of a revolution, or of what repeats; NaN without one", "m")
    ramps: float = described("p-value that ramps do not differ; NaN where the record cannot tell")
    fits: dict[str, ProcessFit] = described("of the process if it is additive, and if it is multiplicative")
    mean: np.ndarray = described("friction of the samples by the curve", "1", "sample")
    explained: np.ndarray = described("the same with drift and period", "1", "sample")
    notes: tuple[str, ...] = described("what the record leaves open")

    def scatter(self, kind: str) -> FrictionScatter:
        """The scatter if it is additive or multiplicative."""
        return self.multiplicative if kind == "multiplicative" else self.additive


def check_count(samples: SlidingSamples) -> int:
    """The number of samples. Raises IllPosedError where they are too few for a fit."""
    if (n := samples.friction.size) < FEWEST_SAMPLES:
        raise IllPosedError(
            f"{n} samples of sliding cannot tell curve and scatter; a fit takes at least {FEWEST_SAMPLES}: record "
            "longer or with more samples a second"
        )
    return n


def fit_record(
    samples: SlidingSamples,
    circumference_m: float | None = None,
    time_constant_s: float | None = None,
    from_slips: bool = False,
    progress: Callable[[str], None] = LOGGER.info,
) -> RecordFit:
    """Fit curve and scatter of all records together.

    circumference_m : [m] of the track; not given, a period is searched. Neither in more than MOST_PHASES records
    time_constant_s : [s] of the instrument; not given, it is fitted
    from_slips : whether samples are of slips between sticks, whose speed follows from the friction that they met
    progress : called with what begins, such as `print`; parts take up to a minute each at MOST_SAMPLES

    Raises IllPosedError where the samples are too few, or no process is the most likely one.
    """
    n, notes = check_count(samples), []
    samples, window, noise = (replace(samples, lag=False), 1, 0.0) if from_slips else without_noise(samples)
    spline = SpeedBasis(samples.speed).at(samples.speed)
    drift, separate = _drift_columns(samples, spline)
    if not separate:
        notes.append("drift is not distinct from the curve: record ramps up and down, or speeds in random order")
    known = {"drift": drift, "ramps": _ramp_columns(samples)}
    if circumference_m is not None and len(samples.records) > MOST_PHASES:
        notes.append(f"more than {MOST_PHASES} records or strokes: what repeats each turn is not taken out")
        circumference_m = None
    if circumference_m is not None:
        known["period"] = np.hstack([_waves(samples, circumference_m / k) for k in range(1, HARMONICS + 1)])
    progress(f"scatter about the mean curve, {n} samples")
    columns = np.column_stack([spline, *known.values()])
    fit = fitted_process(samples, columns, time_constant_s, np.ones(n))
    period_m = np.nan if circumference_m is None else circumference_m
    progress("period of a revolution, drift and ramps")
    if circumference_m is None and (found := _searched_period(samples, columns, fit)) is not None:
        period_m, known["period"] = found, _waves(samples, found)
    p_values = {name: _p_value(samples, spline, known, name, fit) for name in known}
    if p_values["ramps"] < SIGNIFICANT:
        notes.append("ramps up and down differ: they are too fast to be steady, and the curve is the mean of both")
    else:
        known["ramps"] = np.empty((n, 0))
    columns = np.column_stack([spline, *known.values()])
    mean, _ = _explained(samples, spline, columns, fit)
    progress("additive or multiplicative scatter")
    fits, kind, ratio = _additive_or_multiplicative(samples, columns, time_constant_s, mean, fit)
    chosen = fits["multiplicative" if kind == "multiplicative" else "additive"]
    mean, explained = _explained(samples, spline, columns, chosen)
    curve_of = partial(_curve, others=columns[:, spline.shape[1] :], fit=chosen, from_slips=from_slips)
    curve, more = with_noise(curve_of, samples, window, noise)
    total = float(samples.slipped[-1])
    more += _of_scatter(samples, samples.friction - explained, circumference_m, chosen.length)
    return RecordFit(
        curve,
        _scatter(fits["additive"], fits["multiplicative"], total, 1.0),
        _scatter(fits["multiplicative"], fits["additive"], total, 1.0 / float(np.mean(mean))),
        kind,
        ratio,
        *_moments(samples, explained, chosen),
        p_values.get("drift", np.nan) if separate else np.nan,
        p_values.get("period", np.nan),
        period_m,
        p_values["ramps"],
        fits,
        mean,
        explained,
        (*notes, *more),
    )


def _of_scatter(
    samples: SlidingSamples, residual: np.ndarray, circumference_m: float | None, length_m: float
) -> list[str]:
    """Notes on scatter that the record is too short for, or that repeats."""
    notes = []
    if (lengths := float(samples.slipped[-1]) / length_m) < FEWEST_LENGTHS:
        notes.append(f"{lengths:.0f} correlation lengths cannot tell the scatter; {FEWEST_LENGTHS:.0f} can")
    if circumference_m is not None:
        share, chance = repetition(samples, residual, circumference_m, length_m, HARMONICS + 1)
        if chance < SIGNIFICANT:
            notes.append(
                f"{share:.0%} of the scatter repeats each turn: intervals are too narrow; let the track wander"
            )
    return notes


def _additive_or_multiplicative(
    samples: SlidingSamples, columns: np.ndarray, time_constant_s: float | None, mean: np.ndarray, start: ProcessFit
) -> tuple[dict[str, ProcessFit], str, float]:
    """Fits of both, which of them is likelier, and the logarithm of its ratio. mean : of friction"""
    relative = np.maximum(mean, LEAST_SHARE * np.mean(mean)) / np.mean(mean)
    fits = {
        name: fitted_process(samples, columns, time_constant_s, weight, start)
        for name, weight in (("additive", np.ones(mean.size)), ("multiplicative", relative))
    }
    ratio = fits["multiplicative"].log_likelihood - fits["additive"].log_likelihood
    told = abs(ratio) > CLEAR_RATIO and np.std(relative) > TELLABLE
    return fits, "cannot tell" if not told else "multiplicative" if ratio > 0.0 else "additive", ratio


def _curve(samples: SlidingSamples, others: np.ndarray, fit: ProcessFit, from_slips: bool) -> FrictionCurve:
    """The curve about which the fitted scatter is, with variances that are averaged over the errors of the scatter."""
    target, _ = fit.whiten(samples, others)
    curve = fitted_curve(samples.speed, target, others, lambda columns: fit.whiten(samples, columns)[1])
    wider = float(np.exp(0.25 * OF_MEAN @ fit.log_covariance @ OF_MEAN))
    curve = replace(curve, factor=wider * curve.factor, factor_at_rest=wider * curve.factor_at_rest)
    return _tilted(curve, fit.deviation) if from_slips else curve


def _tilted(curve: FrictionCurve, deviation: float) -> FrictionCurve:
    """The curve with the error of friction in slips: SLIP_TILT of the scatter up at the slow end, and down at the fast.

    Least squares takes speeds for given, and in slips they follow from friction. Synthetic records gave its size.
    """
    places = np.log(curve.speeds_m_per_s)
    tilt = SLIP_TILT * deviation * (1.0 - 2.0 * (places - places[0]) / np.ptp(places))
    factor = np.column_stack([curve.factor, tilt])
    return replace(curve, factor=factor, factor_at_rest=np.append(curve.factor_at_rest, tilt[0]))


def _drift_columns(samples: SlidingSamples, spline: np.ndarray) -> tuple[np.ndarray, bool]:
    """(n, 2) a slow trend over time, and whether it differs from the curve."""
    u = 2.0 * samples.elapsed / samples.elapsed[-1] - 1.0
    trend = np.column_stack([u, 1.5 * u**2 - 0.5])
    left = trend - spline @ np.linalg.lstsq(spline, trend, rcond=None)[0]
    share = 1.0 - np.sum(left**2, axis=0) / np.sum((trend - trend.mean(axis=0)) ** 2, axis=0)
    separate = bool(np.all(share < SEPARATE))
    return trend if separate else np.empty((u.size, 0)), separate


def _ramp_columns(samples: SlidingSamples) -> np.ndarray:
    """(n, 2) whether speed rises or falls, and that times the logarithm of speed; none without ramps of both kinds."""
    least = LEAST_RAMP * np.ptp(samples.speed) / samples.elapsed[-1]
    sign = np.where(np.abs(samples.change) < least, 0.0, np.sign(samples.change))
    if min(np.count_nonzero(sign > 0), np.count_nonzero(sign < 0)) < 0.1 * sign.size:
        return np.empty((sign.size, 0))
    log_speed = np.log(samples.speed)
    return np.column_stack([sign, sign * (log_speed - log_speed.mean()) / max(float(np.std(log_speed)), 1e-9)])


def _waves(samples: SlidingSamples, wavelength_m: float) -> np.ndarray:
    """(n, 2 records) a wave over the slipped distance, with a phase of its own in each record."""
    phase = 2.0 * np.pi * samples.slipped / wavelength_m
    record = np.cumsum(samples.step < 0.0)[:, None] == np.arange(1, len(samples.records) + 1)
    return np.hstack([np.cos(phase)[:, None] * record, np.sin(phase)[:, None] * record])


def _p_value(
    samples: SlidingSamples, spline: np.ndarray, known: dict[str, np.ndarray], name: str, fit: ProcessFit
) -> float:
    """That the regressors of this name explain nothing: an F test of whitened columns. NaN where there are none."""
    tested = known[name].shape[1]
    if tested == 0:
        return np.nan
    others = np.column_stack([spline, *(part for other, part in known.items() if other != name)])
    target, white = fit.whiten(samples, np.column_stack([others, known[name]]))
    simple, more = np.split(white, [others.shape[1]], axis=1)
    return f_test(target, simple, more, tested)


def _searched_period(samples: SlidingSamples, columns: np.ndarray, fit: ProcessFit) -> float | None:
    """The wavelength [m] of the wave that explains most, where it is no chance among all that are tried."""
    if len(samples.records) > MOST_PHASES:
        return None
    total = float(samples.slipped[-1])
    tried = total / np.arange(3.0, MOST_PERIODS, 0.5)
    tried = tried[tried > 4.0 * np.median(samples.step)]
    target, white = fit.whiten(samples, columns)
    residual = left(white, target)
    waves = np.hstack([_waves(samples, wavelength) for wavelength in tried])
    waves = left(white, fit.whiten(samples, waves)[1])
    freedom = waves.shape[1] // tried.size
    pairs = np.linalg.qr(waves.reshape(len(waves), -1, freedom).transpose(1, 0, 2))[0]
    gains = np.sum((residual @ pairs) ** 2, axis=1) / float(np.mean(residual**2))
    best = int(np.argmax(gains))
    return float(tried[best]) if scipy.stats.chi2.sf(gains[best], freedom) * len(tried) < SIGNIFICANT else None


def _explained(
    samples: SlidingSamples, spline: np.ndarray, columns: np.ndarray, fit: ProcessFit
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) of the curve alone, and of all regressors as the instrument shows them, by generalised least squares."""
    target, white = fit.whiten(samples, columns)
    coefficients = np.linalg.lstsq(white, target, rcond=None)[0]
    shown = samples.shown(columns @ coefficients, samples.response(fit.time_constant, fit.digital))
    return spline @ coefficients[: spline.shape[1]], shown


def _moments(
    samples: SlidingSamples, explained: np.ndarray, fit: ProcessFit
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Skewness and excess kurtosis of the scatter with their standard errors, of as many values as are independent.

    Normal noise adds to the variance alone, so moments of residuals are divided by powers of the share of the scatter.
    """
    residual = (samples.friction - explained) / fit.weight
    variance = float(np.var(residual))
    share = min(fit.deviation**2 / variance, 1.0)
    standard = (residual - residual.mean()) / np.sqrt(variance)
    count = max(float(samples.slipped[-1]) / (2.0 * fit.length), 8.0)
    skewness = float(np.mean(standard**3)) / share**1.5
    excess = (float(np.mean(standard**4)) - 3.0) / share**2
    return (skewness, np.sqrt(6.0 / count) / share**1.5), (excess, np.sqrt(24.0 / count) / share**2)


def _scatter(fit: ProcessFit, other: ProcessFit, total: float, unit: float) -> FrictionScatter:
    """The scatter of a fit. Its errors cover that of the other kind, as likely as it is. unit : of its deviation"""
    lengths = total / fit.length
    doubt = scipy.special.expit(other.log_likelihood - fit.log_likelihood)
    away = np.log([other.deviation / fit.deviation, other.length / fit.length])
    covariance = fit.log_covariance + doubt * np.outer(away, away)
    return FrictionScatter(fit.deviation * unit, fit.length, covariance, lengths, lengths >= FEWEST_LENGTHS)
