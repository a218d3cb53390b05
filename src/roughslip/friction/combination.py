"""Statistics of the friction coefficient from solved strips, and from the expansion on more strips.

The expansion is a control variate, which reduces the error of few strips::

    theta = theta_solved - alpha (theta_same - theta_more)

theta_same and theta_more are of the expansion on the S solved strips, and on S2 more. Its bias cancels. The least
variance has alpha = cov / (var_same (1 + S / S2)) (Lavenberg and Welch, Management Science 27, 1981; with the mean of
the control itself estimated: Pasupathy et al., IIE Transactions 44, 2012).

It acts on every replicate of the bootstrap, so that the interval holds what remains of the error. Positive statistics
are combined by their logarithms and stay positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.bowden_tabor import Windows, friction_coefficient
from roughslip.friction.correlation import autocorrelation
from roughslip.friction.statistics import NO_SCATTER, estimate_of, strip_weights, window_statistics
from roughslip.probability import Estimate

POSITIVE = ("mean", "std")
PLAIN = ("skewness", "kurtosis", "autocorrelation")

Replicates = dict[str, np.ndarray]  # by statistic (1 + R, ...): the value of the sample, then of each replicate


@dataclass(frozen=True, eq=False)
class Levels:
    """Windows as mu and valid, each (S, W), or (penetrations, S, W).

    solved : windows of the contact solves
    expansion : of the solved strips, and then of more
    """

    solved: Windows
    expansion: Windows

    @property
    def strips(self) -> tuple[int, int]:
        """Number of solved strips, and of those that the expansion has alone."""
        solved, expanded = (windows[0].shape[-2] for windows in (self.solved, self.expansion))
        return solved, expanded - solved

    def at(self, penetration: int) -> Levels:
        """Windows (S, W) at one of the penetrations, by its number."""
        (mu, valid), (expanded, has_value) = self.solved, self.expansion
        return Levels((mu[penetration], valid[penetration]), (expanded[penetration], has_value[penetration]))

    def weights(self, replicates: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """(1 + replicates, strips) counts from `strip_weights`, of the solved strips and of the others."""
        solved, others = self.strips
        return strip_weights(solved, replicates, rng), strip_weights(others, replicates, rng)


def levels_of_sums(least_area_m2: float, solved: Windows, expansion: Windows) -> Levels:
    """The levels for a shear strength of 1 Pa, from area [m2] and force [N].

    least_area_m2 : below it a window has no friction coefficient
    """

    def friction(sums: Windows) -> Windows:
        return friction_coefficient(*sums, 1.0, least_area_m2)

    return Levels(friction(solved), friction(expansion))


def bootstrap(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Replicates:
    """The statistics that are combined, at all lags; logarithms of those in POSITIVE.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    """
    curve = {"autocorrelation": autocorrelation(mu, valid, mu.shape[1], weights)}
    statistics = vars(window_statistics(mu, valid, weights)) | curve
    logarithms = {name: np.log(statistics[name].rows) for name in POSITIVE}
    return logarithms | {name: statistics[name].rows for name in PLAIN}


def controlled(
    rows: Replicates, same: Replicates, many: Replicates, strips: float
) -> tuple[Replicates, dict[str, np.ndarray]]:
    """Rows with the control taken off, and the share of its variance that each statistic keeps.

    rows, same : of the solved strips and of the control on them, with the same weights
    many : of the control on other strips
    strips : number of solved strips over that of the others, and so var many / var same

    Raises IllPosedError where the control does not scatter between strips.
    """
    combination, shares = {}, {}
    for name, own in rows.items():
        deviation = own[1:] - own[1:].mean(axis=0), same[name][1:] - same[name][1:].mean(axis=0)
        shared, control = (np.mean(deviation[1] * of, axis=0) for of in deviation)
        variance = np.mean(deviation[0] ** 2, axis=0)
        if name == "mean" and not (control > NO_SCATTER**2 and variance > NO_SCATTER**2):
            raise IllPosedError("solved or control windows do not scatter between strips: use the solved strips alone")
        total = (1.0 + strips) * control
        alpha = np.divide(shared, total, out=np.zeros_like(shared), where=control > 0)
        combination[name] = own - alpha * (same[name] - many[name])
        shares[name] = 1.0 - np.divide(alpha * shared, variance, out=np.zeros_like(shared), where=variance > 0)
    return combination, shares


@dataclass(frozen=True)
class Combined:
    """Statistics of mu from all strips.

    rows : of each statistic, as from `bootstrap`
    variance_share : by statistic, variance over that of the solved strips alone
    control : rows of the expansion alone, on its own strips
    strips : number of solved strips, and of those that the expansion has alone
    """

    rows: Replicates
    variance_share: Replicates
    control: Replicates
    strips: tuple[int, int]

    def estimates(self) -> dict[str, Estimate]:
        """Each statistic of mu, with the coefficient of variation."""
        rows = {name: np.exp(values) if name in POSITIVE else values for name, values in self.rows.items()}
        rows["variation"] = rows["std"] / rows["mean"]
        return {name: estimate_of(name, values, self.strips[0]) for name, values in rows.items()}

    def calibrated(self, mean: float, reference: Combined) -> Combined:
        """Of mu in units in which the reference has a mean of `mean` exactly, in each replicate."""
        scale = math.log(mean) - reference.rows["mean"]
        rows = {name: values + scale if name in POSITIVE else values for name, values in self.rows.items()}
        return replace(self, rows=rows)


def combine(levels: Levels, weights: tuple[np.ndarray, np.ndarray]) -> Combined:
    """Statistics of the solved windows, with the expansion as control.

    levels : at one penetration, each (S, W)
    weights : of the solved strips and of the others, as from `Levels.weights`

    All replicates share one alpha, so that intervals lack its own error, a part 1 / S of the variance.
    """
    strips = levels.strips
    shapes = [np.shape(windows[0]) for windows in (levels.solved, levels.expansion)]
    if shapes[0][1:] != shapes[1][1:] or strips[1] < 1:
        raise ParameterError(f"levels need equal windows, and the expansion more strips than are solved, not {shapes}")
    if [group.shape[1] for group in weights] != list(strips) or len(weights[0]) != len(weights[1]):
        raise ParameterError(f"weights are needed for groups of {strips} strips: see Levels.weights")
    mu, valid = levels.expansion
    own = bootstrap(*levels.solved, weights[0])
    same = bootstrap(mu[: strips[0]], valid[: strips[0]], weights[0])
    control = bootstrap(mu[strips[0] :], valid[strips[0] :], weights[1])
    rows, shares = controlled(own, same, control, strips[0] / strips[1])
    return Combined(rows, shares, control, strips)
