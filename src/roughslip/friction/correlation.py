"""Autocorrelation of the friction coefficient along the strip, and lengths of an exponential that stand for it.

Windows average: even white noise along the strip, averaged over windows of length T, has the triangular autocorrelation
1 - s/T. An exponential fitted to that alone has a length, `window_lengths`, that depends on how it is fitted; only what
a measured length has beyond it comes from the surface.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.windows import NO_SCATTER, check_windows, require_scatter, resampled
from roughslip.probability import Estimate, wilson_interval
from roughslip.results import described, result
from roughslip.validation import finite, gate, positive

LONGEST_WINDOWS = 3.0
"""The main fit takes lags up to this many windows."""
LENGTHS = ("least_squares", "one_over_e")
"""Lengths [m] of the exponential exp(-s/L) that stand for a curve r(s).

least_squares : least squares over all lags to three windows, unweighted: the main one
one_over_e : first lag where r falls below 1/e, linear between lags; the longest lag if it does not
"""
_SHORTEST_PER_SPACING = 1.0 / 20.0
_LONGEST_PER_SPAN = 100.0
_NEWTON_STEPS = 40  # five are enough; bisection, where one leaves its bracket, takes the rest


@result
class CorrelationFit:
    """What exponential fits the measured autocorrelation, and is it one?"""

    least_squares: Estimate = described("length L of exp(-s/L) by least squares over lags to three windows", "m")
    one_over_e: Estimate = described("first lag at which the autocorrelation falls to 1/e", "m")
    misfit_exponential: Estimate = described("rms distance over lags to three windows from exp(-s/least_squares)")
    misfit_triangle: Estimate = described("the same distance from the triangle of the window")
    misfit_difference: Estimate = described(
        "mean square distances, exponential - triangle: below 0 the exponential is nearer. Noise adds "
        "alike to both squares and cancels",
    )


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
    are_all = bool(valid.all())
    one_or_each = (valid[:1] if are_all else valid).astype(np.float64)
    pairs, products, ends = pair_sums(np.where(valid, mu - centre, 0.0), one_or_each, lags)
    counted = resampled(weights.sum(axis=1, keepdims=True) if are_all else weights, pairs)
    totals = np.split(resampled(weights, np.hstack((products, ends))), 2, axis=1)
    return Estimate.from_rows(curves_of((counted, *totals), centre))


def lags_with_pairs(valid: np.ndarray, weights: np.ndarray, most: int) -> int:
    """Number of lags from 0 on, `most` at most, that have a pair of valid windows in each resampled set of strips."""
    pairs, _, _ = pair_sums(np.zeros(valid.shape), valid.astype(np.float64), most)
    have = resampled(weights, pairs).all(axis=0)
    return most if have.all() else int(np.argmin(have))


def pair_sums(x: np.ndarray, valid: np.ndarray, lags: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Three sums (S, lags) of each strip: pairs of valid windows, their products, and their ends.

    x : (S, W) windows less their common mean, 0 where not valid
    valid : (S, W) 1 where valid, else 0; or (1, W) of all strips, and then pairs are of one

    By transforms, padded so that nothing wraps round. Counts of pairs are whole numbers, and exact.
    """
    size = 2 ** math.ceil(math.log2(x.shape[1] + lags - 1))
    of_x, of_valid = (np.fft.rfft(each, size, axis=1) for each in (x, valid))
    powers = np.abs(of_valid) ** 2, np.abs(of_x) ** 2, 2.0 * (of_x * of_valid.conj()).real
    pairs, products, ends = (np.fft.irfft(each, size, axis=1)[:, :lags] for each in powers)
    return np.rint(pairs), products, ends


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


def exponential_length(lags: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """Length L : (n,) [m] that minimises sum (exp(-s/L) - r)^2 over the lags, with a relative error below 1e-12.

    lags : (K,) [m] from 0, increasing; K >= 2
    curves : (n, K) autocorrelations

    L lies between 1/20 of the first lag (uncorrelated) and 100 times the last (never decays).
    """
    low, high = lags[1] * _SHORTEST_PER_SPACING, lags[-1] * _LONGEST_PER_SPAN
    trial = np.linspace(math.log(low), math.log(high), 160)
    models = np.exp(-lags / np.exp(trial)[:, None])
    loss = np.sum(models**2, axis=1) - 2.0 * curves @ models.T
    best = np.argmin(loss, axis=1)
    at_end = (best == 0) | (best == len(trial) - 1)
    left, right = trial[np.maximum(best - 1, 0)], trial[np.minimum(best + 1, len(trial) - 1)]
    point = 0.5 * (left + right)
    for _ in range(_NEWTON_STEPS):
        scaled = lags / np.exp(point)[:, None]
        model = np.exp(-scaled)
        rise = model * scaled
        slope = np.einsum("nk,nk->n", model - curves, rise)
        bend = np.einsum("nk,nk->n", rise + (model - curves) * (scaled - 1.0), rise)
        left, right = np.where(slope < 0.0, point, left), np.where(slope < 0.0, right, point)
        last, point = point, point - np.divide(slope, bend, out=np.full_like(slope, np.inf), where=bend > 0.0)
        point = np.where((left <= point) & (point <= right), point, 0.5 * (left + right))
        if np.max(np.abs(point - last), where=~at_end, initial=0.0) < 1e-13:
            break
    return np.exp(np.where(at_end, trial[best], point))


def one_over_e_length(lags: np.ndarray, curves: np.ndarray) -> np.ndarray:
    """First lag (n,) where curves (n, K) fall below 1/e, linear between lags; the longest lag if they do not."""
    below = curves < math.exp(-1.0)
    k = np.maximum(np.argmax(below, axis=1), 1)
    row = np.arange(len(curves))
    before, after = curves[row, k - 1], curves[row, k]
    falls = below.any(axis=1)
    share = np.divide(before - math.exp(-1.0), before - after, out=np.ones_like(before), where=falls)
    return np.where(falls, lags[k - 1] + share * (lags[k] - lags[k - 1]), lags[-1])


def lengths_of(lags: np.ndarray, curves: np.ndarray) -> dict[str, np.ndarray]:
    """LENGTHS (n,) [m] of curves (n, K) at lags to three windows."""
    return {"least_squares": exponential_length(lags, curves), "one_over_e": one_over_e_length(lags, curves)}


def window_lengths(lags: np.ndarray, window: float) -> dict[str, float]:
    """The lengths that the window alone produces: those of its triangle at the given lags (K,) [m]."""
    lags = _lags_to_three_windows(lags, window)
    return {name: float(each[0]) for name, each in lengths_of(lags, triangular(lags, window)[None]).items()}


@gate
def correlation_fit(lags: np.ndarray, estimate: Estimate, window: float) -> CorrelationFit:
    """Exponential lengths of a measured autocorrelation with their intervals; misfits of exponential and triangle.

    lags : (K,) [m] from 0, increasing; only lags to three windows are used
    estimate : (K,) autocorrelation at the lags
    window : [m] length of a window
    """
    lags = finite("lags", lags, 1)
    if lags.shape != estimate.value.shape:
        raise ParameterError(f"lags {lags.shape} and autocorrelation {estimate.value.shape} must have one shape")
    lags = _lags_to_three_windows(lags, window)
    curves = np.ascontiguousarray(estimate.rows[:, : lags.size])
    lengths = lengths_of(lags, curves)
    exponential = np.exp(-lags / lengths["least_squares"][:, None])
    to_exponential = np.sqrt(np.mean((curves - exponential) ** 2, axis=1))
    to_triangle = np.sqrt(np.mean((curves - triangular(lags, window)) ** 2, axis=1))
    moved = np.sqrt(np.mean((curves[1:] - curves[0]) ** 2, axis=1))
    return CorrelationFit(
        **{name: Estimate.from_rows(rows) for name, rows in lengths.items()},
        misfit_exponential=Estimate.of_distance(to_exponential, moved),
        misfit_triangle=Estimate.of_distance(to_triangle, moved),
        misfit_difference=Estimate.from_rows(to_exponential**2 - to_triangle**2),
    )


def one_field(mu: np.ndarray, valid: np.ndarray, lags: np.ndarray, window: float) -> dict[str, Estimate]:
    """What an author with one field sees, each strip being a field with a mean of its own.

    mu, valid : (S, W) friction coefficient and bool
    lags : (W,) [m] distances of the windows from the first; those to half of the last are used, three windows at most
    window : [m] length of a window

    Returns length_one_field, the median and the 2.5 to 97.5 % [m] of the lengths by least squares, and
    exponential_share, of the fields to which this exponential is nearer than the triangle of the window. Fields in
    which a window has no coefficient, or all have the same, are left out; where none is left both are NaN.
    """
    fields = mu[valid.all(axis=1)]
    fields = fields[fields.std(axis=1) > NO_SCATTER * fields.mean(axis=1)]
    if not len(fields):
        return dict.fromkeys(("length_one_field", "exponential_share"), Estimate(*np.full(3, np.nan)))
    lags = _lags_to_three_windows(lags[: (lags.size + 1) // 2], window)
    centred = fields - fields.mean(axis=1, keepdims=True)
    curves = curves_of(pair_sums(centred, np.ones((1, mu.shape[1])), lags.size), 0.0)
    lengths = exponential_length(lags, curves)
    models = np.exp(-lags / lengths[:, None]), triangular(lags, window)
    nearer = int(np.less(*(np.sum((curves - model) ** 2, axis=1) for model in models)).sum())
    middle, low, high = np.quantile(lengths, (0.5, 0.025, 0.975))
    share = Estimate(np.array(nearer / len(fields)), *wilson_interval(nearer, len(fields)))
    return {"length_one_field": Estimate(middle, low, high), "exponential_share": share}


def _lags_to_three_windows(lags: np.ndarray, window: float) -> np.ndarray:
    lags, _ = finite("lags", lags, 1), positive("the window", window, "m")
    if not (lags.size and lags[0] == 0.0 and (np.diff(lags) > 0.0).all()):
        raise ParameterError("lags must increase from 0")
    if np.sum(lags <= 0.5 * window * (1.0 + 1e-9)) < 2:
        raise IllPosedError("no lag within half a window: space the windows more closely")
    return lags[lags <= LONGEST_WINDOWS * window * (1.0 + 1e-9)]
