"""Autocorrelation of the friction coefficient along the strip, and the length of an exponential fitted to it.

Windows average: even white noise along the strip, averaged over windows of length T, has the triangular autocorrelation
1 - s/T. An exponential fitted to that alone has a length, `window_lengths`, that depends on how it is fitted; only what
a measured length has beyond it comes from the surface.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError, ParameterError, real, whole
from roughslip.friction.bowden_tabor import window_sums
from roughslip.friction.statistics import FEWEST_REPLICATES, check_windows, require_scatter, resampled
from roughslip.probability import Estimate
from roughslip.short_repr import short_repr
from roughslip.validation import gate, reals

LONGEST_WINDOWS = 3.0
"""The main fit takes lags up to this many windows."""
LOG_LINE_WINDOWS = (0.5, 0.9)
"""Largest lags, in windows, of the straight lines through the logarithm of the autocorrelation."""
_SHORTEST_PER_SPACING = 1.0 / 20.0
_LONGEST_PER_SPAN = 100.0
_BISECTIONS = 50


@dataclass(frozen=True)
class Lengths:
    """Lengths [m] of the exponential exp(-s/L) that stand for curves r(s), each (...).

    least_squares : least squares over all lags to three windows, unweighted: the main one
    half_window : least squares over lags to half a window
    one_over_e : first lag where r falls below 1/e, linear between lags; the longest lag if it does not
    integral : integral of r over all lags to three windows, trapezoidal
    log_line_50, log_line_90 : straight line through log r to lags of half a window and of 0.9 of it, see `log_line`
    """

    least_squares: np.ndarray
    half_window: np.ndarray
    one_over_e: np.ndarray
    integral: np.ndarray
    log_line_50: np.ndarray
    log_line_90: np.ndarray


@short_repr
@dataclass(frozen=True)
class CorrelationFit:
    """What exponential fits the measured autocorrelation, and is it one?

    least_squares, half_window, one_over_e, integral, log_line_50, log_line_90 : () [m] as in `Lengths`
    log_line_r2 : () share of the variance of log r that the line to 0.9 of the window explains
    window : the same of the triangle, the window's own part
    misfit_exponential, misfit_triangle : () rms distance over lags to three windows from exp(-s/least_squares), and
        from the triangle
    misfit_difference : () mean square distances, exponential - triangle: below 0 the exponential is nearer. Noise adds
        alike to both squares and cancels
    at_bound : the least-squares length lies at an end of its range, see `exponential_length`
    at_bound_share : share of replicates where it does
    """

    least_squares: Estimate
    half_window: Estimate
    one_over_e: Estimate
    integral: Estimate
    log_line_50: Estimate
    log_line_90: Estimate
    log_line_r2: Estimate
    window: Lengths
    misfit_exponential: Estimate
    misfit_triangle: Estimate
    misfit_difference: Estimate
    at_bound: bool
    at_bound_share: float


def triangular(lags: np.ndarray, window: float) -> np.ndarray:
    """Autocorrelation max(0, 1 - |s| / T) of white noise averaged over windows of length T."""
    return np.maximum(0.0, 1.0 - np.abs(lags) / window)


@gate
def autocorrelation(mu: np.ndarray, valid: np.ndarray, lags: int, weights: np.ndarray) -> Estimate:
    """Autocorrelation of mu at lags of 0 ... lags - 1 window spacings, with its pointwise 95 % band.

    mu, valid : (S, W) friction coefficient and bool, S independent strips of W windows at one spacing
    lags : number K of lags, 2 to W
    weights : (1 + R, S) counts from `strip_weights`

    Products of all pairs of valid windows of one strip, less the mean of all windows, averaged over pairs and divided
    by the variance; r(0) = 1 exactly. Subtracting the estimated mean lowers r by about (1 - r) / effective_windows.
    """
    mu, valid = check_windows(mu, valid, weights)
    windows = mu.shape[1]
    if not 2 <= lags <= windows:
        raise IllPosedError(f"{lags} lags of {windows} windows a strip: take 2 to {windows}, or longer strips")
    centre = float(np.mean(mu[valid]))
    sums = pair_sums(np.ascontiguousarray(np.where(valid, mu - centre, 0.0)), valid.astype(np.float64), lags)
    return Estimate.from_rows(curves_of([resampled(weights, part) for part in sums], centre))


@compiled()
def pair_sums(x: np.ndarray, valid: np.ndarray, lags: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three sums (S, lags) of each strip: pairs of valid windows, their products, and their ends.

    x, valid : (S, W) windows less their common mean, 0 where not valid; 1 where valid, else 0
    """
    strips, windows = x.shape
    pairs, products, ends = np.zeros((strips, lags)), np.zeros((strips, lags)), np.zeros((strips, lags))
    for s in range(strips):
        for i in range(windows):  # and within it the lags, whose sums are independent: several at once
            for k in range(min(lags, windows - i)):
                pairs[s, k] += valid[s, i] * valid[s, i + k]
                products[s, k] += x[s, i] * x[s, i + k]
                ends[s, k] += x[s, i] * valid[s, i + k] + x[s, i + k] * valid[s, i]
    return pairs, products, ends


def curves_of(totals: Sequence[np.ndarray], centre: float) -> np.ndarray:
    """Autocorrelations (n, K) of the totals of `pair_sums`, each (n, K), of windows that have lost `centre`.

    Raises IllPosedError where a lag has no pair or the windows do not scatter.
    """
    pairs, products, ends = totals
    if not pairs.all():
        raise IllPosedError("a lag has no pair of windows with mu in some replicate: take fewer lags or more strips")
    mean = 0.5 * ends[:, :1] / pairs[:, :1]
    covariance = (products - mean * ends) / pairs + mean**2
    require_scatter(covariance[:, 0], centre, mean[:, 0])
    return covariance / covariance[:, :1]


def exponential_length(lags: np.ndarray, curves: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Length L that minimises sum (exp(-s/L) - r)^2 over the lags.

    lags : (K,) [m] from 0, increasing; K >= 2
    curves : (n, K) autocorrelations

    Returns (L, at_bound). L : (n,) [m] has a relative error below 1e-12. at_bound : (n,) is true where L is at an end
    of the range. The range goes from 1/20 of the first lag (uncorrelated) to 100 times the last (never decays).
    """
    low, high = lags[1] * _SHORTEST_PER_SPACING, lags[-1] * _LONGEST_PER_SPAN
    trial = np.linspace(math.log(low), math.log(high), 160)
    models = np.exp(-lags / np.exp(trial)[:, None])
    loss = np.sum(models**2, axis=1) - 2.0 * np.einsum("nk,gk->ng", curves, models)
    best = np.argmin(loss, axis=1)
    at_bound = (best == 0) | (best == len(trial) - 1)
    left, right = trial[np.maximum(best - 1, 0)], trial[np.minimum(best + 1, len(trial) - 1)]
    for _ in range(_BISECTIONS):
        middle = 0.5 * (left + right)
        scaled = lags / np.exp(middle)[:, None]
        model = np.exp(-scaled)
        falls = np.sum((model - curves) * model * scaled, axis=1) < 0.0
        left, right = np.where(falls, middle, left), np.where(falls, right, middle)
    return np.exp(np.where(at_bound, trial[best], 0.5 * (left + right))), at_bound


def one_over_e_length(lags: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """First lag (n,) where curves (n, K) fall below 1/e, linear between lags; the longest lag if they do not."""
    below = curves < math.exp(-1.0)
    k = np.maximum(np.argmax(below, axis=1), 1)
    row = np.arange(len(curves))
    before, after = curves[row, k - 1], curves[row, k]
    falls = below.any(axis=1)
    share = np.divide(before - math.exp(-1.0), before - after, out=np.ones_like(before), where=falls)
    return np.where(falls, lags[k - 1] + share * (lags[k] - lags[k - 1]), lags[-1])


def log_line(lags: np.ndarray, curves: np.ndarray, largest: float) -> tuple[np.ndarray, np.ndarray]:
    """Length and R^2 of the straight line, with an intercept, through the logarithm of the autocorrelation.

    lags : (K,) [m] from 0, increasing
    curves : (n, K) autocorrelations
    largest : [m] lag up to which points are taken; the points of a curve end before it first falls to zero

    Returns (L, R^2), each (n,). L [m] is one over the negative slope, within the range of `exponential_length`. A line
    that does not fall has the largest length, a curve with one point the least, and an R^2 of 0.

    Of the triangle 1 - s/T the length depends on c = largest / T alone, see `triangle_log_line`.
    """
    low, high = lags[1] * _SHORTEST_PER_SPACING, lags[-1] * _LONGEST_PER_SPAN
    taken = lags <= largest * (1.0 + 1e-9)
    s, r = lags[taken], curves[:, taken]
    weight = np.cumprod(r > 0.0, axis=1).astype(float)
    y = np.log(np.where(weight > 0.0, r, 1.0))
    count = weight.sum(axis=1)
    about = weight * (s - ((weight @ s) / count)[:, None])
    rise = np.sum(about * y, axis=1)
    spread = np.sum(about**2, axis=1)
    square = np.sum(weight * (y - (np.sum(weight * y, axis=1) / count)[:, None]) ** 2, axis=1)
    slope = np.divide(rise, spread, out=np.full(len(r), -1.0 / low), where=count > 1)
    explained = np.divide(rise**2, spread * square, out=np.zeros(len(r)), where=(count > 1) & (square > 0.0))
    return 1.0 / np.clip(-slope, 1.0 / high, 1.0 / low), explained


def triangle_log_line(share: float) -> float:
    """Length of `log_line` of the triangle 1 - s/T on all lags to share T, over T; share below 1.

    With m0 and m1 the integrals of log(1 - x) and of x log(1 - x) from 0 to c, the slope is (m1 - c m0 / 2) / (c^3/12).
    """
    log = math.log1p(-share)
    mean, first = -(1.0 - share) * log - share, (share**2 - 1.0) / 2.0 * log - share**2 / 4.0 - share / 2.0
    return -(share**3) / 12.0 / (first - share * mean / 2.0)


def window_lengths(lags: np.ndarray, window: float) -> Lengths:
    """The lengths that the window alone produces: those of its triangle at the given lags (K,) [m]."""
    lags, _ = _lags_to_three_windows(lags, window)
    lengths, _ = _lengths(lags, triangular(lags, window)[None], window)
    return Lengths(*(length[0] for length in vars(lengths).values()))


@gate
def correlation_fit(lags: np.ndarray, estimate: Estimate, window: float) -> CorrelationFit:
    """Exponential lengths of a measured autocorrelation with their intervals; misfits of exponential and triangle.

    lags : (K,) [m] from 0, increasing; only lags to three windows are used
    estimate : (K,) autocorrelation at the lags
    window : [m] length of a window
    """
    lags = reals("lags", lags)
    if lags.shape != estimate.value.shape:
        raise ParameterError(f"lags {lags.shape} and autocorrelation {estimate.value.shape} must have one shape")
    lags, used = _lags_to_three_windows(lags, window)
    curves = np.ascontiguousarray(estimate.rows[:, :used])
    lengths, at_bound = _lengths(lags, curves, window)
    exponential = np.exp(-lags / lengths.least_squares[:, None])
    to_exponential = np.sqrt(np.mean((curves - exponential) ** 2, axis=1))
    to_triangle = np.sqrt(np.mean((curves - triangular(lags, window)) ** 2, axis=1))
    moved = np.sqrt(np.mean((curves[1:] - curves[0]) ** 2, axis=1))
    return CorrelationFit(
        least_squares=Estimate.from_rows(lengths.least_squares),
        half_window=Estimate.from_rows(lengths.half_window),
        one_over_e=Estimate.from_rows(lengths.one_over_e),
        integral=Estimate.from_rows(lengths.integral),
        log_line_50=Estimate.from_rows(lengths.log_line_50),
        log_line_90=Estimate.from_rows(lengths.log_line_90),
        log_line_r2=Estimate.from_rows(log_line(lags, curves, LOG_LINE_WINDOWS[-1] * window)[1]),
        window=window_lengths(lags, window),
        misfit_exponential=Estimate.of_distance(to_exponential, moved),
        misfit_triangle=Estimate.of_distance(to_triangle, moved),
        misfit_difference=Estimate.from_rows(to_exponential**2 - to_triangle**2),
        at_bound=bool(at_bound[0]),
        at_bound_share=float(np.mean(at_bound[1:])),
    )


def _lags_to_three_windows(lags: np.ndarray, window: float) -> tuple[np.ndarray, int]:
    lags = reals("lags", lags)
    finite = lags.ndim == 1 and lags.size > 0 and bool(np.isfinite(lags).all())
    if not (finite and lags[0] == 0.0 and (np.diff(lags) > 0.0).all()):
        raise ParameterError("lags must increase from 0")
    if not (math.isfinite(real("the window", window)) and window > 0.0):
        raise ParameterError(f"the window must be positive and finite, not {window} m")
    used = int(np.sum(lags <= LONGEST_WINDOWS * window * (1.0 + 1e-9)))
    if np.sum(lags <= 0.5 * window * (1.0 + 1e-9)) < 2:
        raise IllPosedError("no lag within half a window: space the windows more closely")
    return lags[:used], used


def _lengths(lags: np.ndarray, curves: np.ndarray, window: float) -> tuple[Lengths, np.ndarray]:
    near = int(np.sum(lags <= 0.5 * window * (1.0 + 1e-9)))
    least_squares, at_bound = exponential_length(lags, curves)
    half_window, _ = exponential_length(lags[:near], np.ascontiguousarray(curves[:, :near]))
    integral = np.trapezoid(curves, lags, axis=1)
    lines = (log_line(lags, curves, share * window)[0] for share in LOG_LINE_WINDOWS)
    return Lengths(least_squares, half_window, one_over_e_length(lags, curves), integral, *lines), at_bound


def white_autocorrelation(
    strips: int, columns: int, window: int, spacing: int, lags: int, replicates: int, rng: np.random.Generator
) -> Estimate:
    """Autocorrelation of windows of white pressure, measured as `correlation.autocorrelation` measures that of mu.

    strips : number of strips of one measurement
    columns : on which the windows of a strip lie
    window, spacing : length of a window and distance of two starts [columns]
    lags : number K of lags, in window spacings
    replicates : measurements, at least FEWEST_REPLICATES

    Returns (K,): the mean over the measurements, and between low and high 95 % of them. Raises ParameterError where the
    windows do not fit or the replicates are too few.

    Windows begin and end at multiples of the common divisor of length and spacing. The sums of the columns between are
    drawn directly, as sums of normal variables are normal.
    """
    if whole("the number of replicates", replicates) < FEWEST_REPLICATES:
        raise ParameterError(f"a range of 95 % needs at least {FEWEST_REPLICATES} replicates, not {replicates}")
    block = math.gcd(whole("a window", window), whole("the spacing of windows", spacing))
    curves = np.empty((1 + replicates, lags))
    for row in curves[1:]:
        sums = window_sums(rng.standard_normal((strips, columns // block)), window // block, spacing // block)
        parts = pair_sums(np.ascontiguousarray(sums), np.ones(sums.shape), lags)
        row[:] = curves_of([part.sum(axis=0, keepdims=True) for part in parts], 0.0)[0]
    curves[0] = curves[1:].mean(axis=0)
    return Estimate.from_rows(curves)
