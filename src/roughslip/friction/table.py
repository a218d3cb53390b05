"""The friction table: every statistic over penetration, with its interval, from solved strips and the expansion.

Three estimates of a statistic stand side by side. Solved windows alone have all of them. The expansion alone has mean
and scatter. The smallest error has the combination, in which the expansion is a control variate::

    theta = theta_solved - alpha (theta_same - theta_more)

theta_same and theta_more are of the expansion on the S solved strips, and on S2 more. Its bias cancels. The least
variance has alpha = cov / (var_same (1 + S / S2)) (Lavenberg and Welch, Management Science 27, 1981; with the mean of
the control itself estimated: Pasupathy et al., IIE Transactions 44, 2012). Positive statistics are combined by their
logarithms and stay positive.

Whole strips are resampled, with the same draws at every penetration, so that differences between penetrations have
intervals too. The friction coefficient is in units in which the combined mean at the median is as given, in each
resampled set. Between the solved levels mu_fit(d) is a cubic that is monotone from one to the next, so it shows no
trend that the statistics do not show (Fritsch and Carlson, SIAM J. Numer. Anal. 17 (1980) 238; Fritsch and Butland,
SIAM J. Sci. Stat. Comput. 5 (1984) 300).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import IllPosedError
from roughslip.friction.correlation import LENGTHS, CorrelationFit, autocorrelation, correlation_fit
from roughslip.friction.marginal import BetaFit, distance_to_beta, fit_beta, set_beta
from roughslip.friction.windows import (
    NO_SCATTER,
    Windows,
    estimate_of,
    friction_coefficient,
    ratio_of_sums,
    strip_weights,
    window_statistics,
)
from roughslip.probability import Estimate

POSITIVE = ("mean", "std")
PLAIN = ("skewness", "kurtosis", "autocorrelation")
BY_SOURCE = ("mean", "std")  # also given of the expansion alone

LevelSums = Sequence[Windows]
Replicates = dict[str, np.ndarray]  # by statistic (1 + R, ...): the value of the sample, then of each replicate


def describe(windows: Windows, weights: np.ndarray, lags: np.ndarray, window: float) -> dict[str, Estimate]:
    """Moments, autocorrelation with its lengths, and distances to the paper's Beta of the windows of a penetration.

    windows : mu and valid, each (S, W), friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    lags : (W,) [m] distances of two windows; window : [m] length of one

    Raises IllPosedError where too few windows have a friction coefficient, or all have the same.
    """
    curve = autocorrelation(*windows, len(lags), weights)
    return {
        **vars(window_statistics(*windows, weights)),
        "autocorrelation": curve,
        **of_correlation(correlation_fit(lags, curve, window)),
        "beta_distance_standardised": distance_to_beta(*windows, weights),
    }


def of_correlation(fit: CorrelationFit) -> dict[str, Estimate]:
    """Lengths of the autocorrelation and its misfits, by name."""
    return {f"length_{name}" if name in LENGTHS else name: estimate for name, estimate in vars(fit).items()}


def bootstrap(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Replicates:
    """The statistics that are combined, at all lags; logarithms of those in POSITIVE.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    """
    curve = {"autocorrelation": autocorrelation(mu, valid, mu.shape[1], weights)}
    return of_estimates(vars(window_statistics(mu, valid, weights)) | curve)


def of_estimates(found: dict[str, Estimate]) -> Replicates:
    """The same of estimates by name."""
    return {name: np.log(found[name].rows) for name in POSITIVE} | {name: found[name].rows for name in PLAIN}


def controlled(rows: Replicates, same: Replicates, many: Replicates, strips: float) -> Replicates:
    """Rows with the control taken off, as far as that scatters between strips.

    rows, same : of the solved strips and of the control on them, with the same weights
    many : of the control on other strips
    strips : number of solved strips over that of the others, and so var many / var same
    """
    combination = {}
    for name, own in rows.items():
        deviation = own[1:] - own[1:].mean(axis=0), same[name][1:] - same[name][1:].mean(axis=0)
        shared, control = (np.mean(deviation[1] * of, axis=0) for of in deviation)
        total = (1.0 + strips) * control
        alpha = np.divide(shared, total, out=np.zeros_like(shared), where=control > NO_SCATTER**2)
        combination[name] = own - alpha * (same[name] - many[name])
    return combination


def combine(
    solved: Replicates, expansion: Windows | None, weights: tuple[np.ndarray, np.ndarray]
) -> tuple[Replicates, Replicates]:
    """Statistics of one penetration from all strips, and of the expansion alone on its own strips, as of `bootstrap`.

    Without an expansion, or where too few of its windows touch, they are of the solved strips, and NaN.

    solved : `bootstrap` of the solved strips
    expansion : mu and valid, each (strips, W), of the solved strips first, and then of more
    weights : counts from `strip_weights` of the solved strips, and of those that the expansion has alone

    All replicates share one alpha, so that intervals lack its own error, a part 1 / S of the variance.
    """
    none = {name: np.full_like(solved[name], np.nan) for name in BY_SOURCE}
    if expansion is None:
        return solved, none
    (mu, valid), strips = expansion, weights[0].shape[1]
    others = len(mu) - strips
    try:
        same = bootstrap(mu[:strips], valid[:strips], weights[0])
        alone = bootstrap(mu[strips:], valid[strips:], weights[1])
    except IllPosedError:
        return solved, none
    return controlled(solved, same, alone, strips / others), alone


@dataclass(frozen=True, eq=False)
class WindowLayout:
    """Penetrations, and how windows lie on a strip.

    percentiles : (levels,) [%] share of heights above the plane, increasing, 50 among them
    window_m, spacing_m : [m] length of a window and distance between the starts of two neighbours
    count : windows of a strip
    """

    percentiles: np.ndarray
    window_m: float
    spacing_m: float
    count: int

    @property
    def lags(self) -> np.ndarray:
        """(count,) [m] distances of two windows."""
        return self.spacing_m * np.arange(self.count)

    @property
    def median(self) -> int:
        """Number of the level at median penetration."""
        return int(np.flatnonzero(self.percentiles == 50.0)[0])


@dataclass(frozen=True, eq=False)
class FrictionTable:
    """Statistics at every penetration.

    layout : penetrations and windows
    missing : why other penetrations have no statistics, by percentile
    mu : by level (S, W) friction coefficient of the solved windows, and whether they have one
    weights : (1 + R, S) how often each solved strip counts, in the sample and in each resampled set
    shear : () [Pa] shear strength, with what few strips leave open of it
    solved : by name the estimates of the solved windows at each level; for those of BY_SOURCE then of the expansion
    combined : by name those from all strips at each level
    beta : distribution of the solved windows at each level
    """

    layout: WindowLayout
    missing: dict[float, str]
    mu: list[Windows]
    weights: np.ndarray
    shear: Estimate
    solved: dict[str, list[Estimate]]
    combined: dict[str, list[Estimate]]
    beta: list[BetaFit]


def friction_table(
    solved: LevelSums,
    expansion: LevelSums | None,
    least_area_m2: float,
    layout: WindowLayout,
    mean: float,
    replicates: int,
    seed: Sequence[int],
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> FrictionTable:
    """Calibrate the shear strength at the median, and estimate every statistic.

    solved, expansion : by level area [m2] and force [N] of the windows, each (strips, W), as of `combine`; no expansion
        where there is none
    least_area_m2 : below it a window has no friction coefficient
    mean : friction coefficient at median penetration
    replicates : resampled sets; seed : of their draws
    progress : receives the number of levels that are done, and of all

    A penetration at which windows are too few or do not scatter has no statistics. Raises IllPosedError at the median.
    """
    rng, strips, missing = np.random.default_rng(seed), len(solved[0][0]), dict[float, str]()
    others = len(expansion[0][0]) - strips if expansion else 2
    weights = strip_weights(strips, replicates, rng), strip_weights(others, replicates, rng)
    own, mu, both = [], [], {}
    for k, (percentile, sums) in enumerate(zip(layout.percentiles, solved, strict=True)):
        windows = friction_coefficient(*sums, 1.0, least_area_m2)
        control = friction_coefficient(*expansion[k], 1.0, least_area_m2) if expansion else None
        try:
            found = describe(windows, weights[0], layout.lags, layout.window_m)
            found |= set_beta(*windows, seed)
            both[k] = combine(of_estimates(found), control, weights)
        except IllPosedError as error:
            if k == layout.median:
                raise IllPosedError(f"percentile {percentile:g}: {error}", error.scene_keys) from error
            missing[float(percentile)] = str(error)
            continue
        own.append(found | {"ratio_of_sums": ratio_of_sums(*sums, 1.0, weights[0])})
        mu.append(windows)
        progress(k + 1, len(solved))
    reference = both[layout.median][0]["mean"]
    shear = estimate_of("mean", mean / np.exp(reference), strips)
    of_solved = {name: [found[name] for found in own] for name in own[0]}
    for name, kind in {"mean": "mean", "std": "std", "ratio_of_sums": "mean"}.items():
        of_solved[name] = [estimate_of(kind, shear.value * found.rows, strips) for found in of_solved[name]]
    for name in BY_SOURCE:
        of_solved[name] += [estimate_of(name, shear.value * np.exp(one[name]), others) for _, one in both.values()]
    calibrated = [_calibrated(rows, math.log(mean) - reference, layout, strips) for rows, _ in both.values()]
    combined = {name: [one[name] for one in calibrated] for name in calibrated[0]}
    mu = [(float(shear.value) * values, valid) for values, valid in mu]
    beta = [fit_beta(values[valid]) for values, valid in mu]
    layout = replace(layout, percentiles=layout.percentiles[list(both)])
    return FrictionTable(layout, missing, mu, weights[0], shear, of_solved, combined, beta)


def _calibrated(rows: Replicates, scale: np.ndarray, layout: WindowLayout, strips: int) -> dict[str, Estimate]:
    """Estimates of combined rows, with the lengths of the autocorrelation. scale : (1 + R,) logarithm of that of mu"""
    rows = {name: np.exp(values + scale) if name in POSITIVE else values for name, values in rows.items()}
    rows["variation"] = rows["std"] / rows["mean"]
    found = {name: estimate_of(name, values, strips) for name, values in rows.items()}
    return found | of_correlation(correlation_fit(layout.lags, found["autocorrelation"], layout.window_m))


def curve_over_penetration(percentiles: np.ndarray, estimates: Sequence[Estimate], points: np.ndarray) -> Estimate:
    """A statistic at penetrations : (n,) [%] between the first and the last level, with its band.

    percentiles : (L,) [%] of the levels, increasing, at least two
    estimates : L of (), which share their replicates
    """
    rows = np.stack([each.rows for each in estimates], axis=1)
    return Estimate.from_rows(scipy.interpolate.PchipInterpolator(percentiles, rows, axis=1)(points))


def trend(percentiles: np.ndarray, estimates: Sequence[Estimate]) -> tuple[Estimate, Estimate]:
    """Change of a statistic from the first to the last level: along the straight line through all, and last - first.

    percentiles : (L,) [%] of the levels, increasing, at least two
    estimates : L of (), all levels resampled with the same weights

    The line is that of least squares.
    """
    q, rows = percentiles, np.stack([estimate.rows for estimate in estimates])
    about = q - q.mean()
    line = np.einsum("l,lr->r", (q[-1] - q[0]) * about / np.sum(about**2), rows)
    return Estimate.from_rows(line), Estimate.from_rows(rows[-1] - rows[0])
