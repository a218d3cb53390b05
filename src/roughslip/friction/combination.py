"""Statistics of the friction coefficient from solved strips on one mesh or two, and from the expansion on more strips.

Two errors are reduced, that of the mesh and that of few strips::

    theta = theta_h + f (theta_h - theta_2h) - alpha (theta_same - theta_more)

- theta_h, theta_2h: the solved strips on cells h and 2h. An error c h^p is taken off by f = 1 / (2^p - 1) (Richardson).
- theta_same, theta_more: the expansion on the S solved strips, and on S2 more. Its bias cancels. The least
  variance has alpha = cov / (var_same (1 + S / S2)) (Lavenberg and Welch, Management Science 27, 1981; with the mean of
  the control itself estimated: Pasupathy et al., IIE Transactions 44, 2012).

Both act on every replicate of the bootstrap, so that the interval holds what remains of both errors. Positive
statistics are combined by their logarithms and stay positive.
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

ORDERS = {"mean": (0.9, 2.2), "std": (1.25, 2.75), "autocorrelation": (1.0, 2.0)}
"""Minimum and maximum order of the error of the mesh: 1 at the sides of a strip, 2 at the edges of contacts.
Measured on three scenes, docs/notebook/friction.md."""

POSITIVE = ("mean", "std")
PLAIN = ("skewness", "kurtosis", "autocorrelation")

Replicates = dict[str, np.ndarray]  # by statistic (1 + R, ...): the value of the sample, then of each replicate


@dataclass(frozen=True, eq=False)
class Levels:
    """Windows as mu and valid, each (S, W), or (penetrations, S, W).

    solved : on cells h
    expansion : of the solved strips, and then of more
    coarse : of the solved strips on cells 2h
    """

    solved: Windows
    expansion: Windows
    coarse: Windows | None = None

    @property
    def strips(self) -> tuple[int, int]:
        """Number of solved strips, and of those that the expansion has alone."""
        solved, expanded = (windows[0].shape[-2] for windows in (self.solved, self.expansion))
        return solved, expanded - solved

    def at(self, penetration: int) -> Levels:
        """Windows (S, W) at one of the penetrations, by its number."""
        (mu, valid), (expanded, has_value) = self.solved, self.expansion
        coarse = None if self.coarse is None else (self.coarse[0][penetration], self.coarse[1][penetration])
        return Levels((mu[penetration], valid[penetration]), (expanded[penetration], has_value[penetration]), coarse)

    def weights(self, replicates: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """(1 + replicates, strips) counts from `strip_weights`, of the solved strips and of the others."""
        solved, others = self.strips
        return strip_weights(solved, replicates, rng), strip_weights(others, replicates, rng)


def levels_of_sums(least_area_m2: float, solved: Windows, expansion: Windows, coarse: Windows | None) -> Levels:
    """The levels for a shear strength of 1 Pa, from area [m2] and force [N].

    least_area_m2 : below it a window has no friction coefficient
    """

    def friction(sums: Windows) -> Windows:
        return friction_coefficient(*sums, 1.0, least_area_m2)

    return Levels(friction(solved), friction(expansion), None if coarse is None else friction(coarse))


def mesh_factors(replicates: int, rng: np.random.Generator) -> Replicates:
    """f : (1 + replicates,) of each statistic, evenly spread over those of ORDERS; the first is their middle.

    Skewness and kurtosis have none: with eleven cells a correlation length halving the cells changes the skewness by
    0.01, less than its interval, and extrapolation would add noise.
    """
    factors = {}
    for name, orders in ORDERS.items():
        high, low = (1.0 / (2.0**order - 1.0) for order in orders)
        factors[name] = np.concatenate(([(low + high) / 2], rng.uniform(low, high, replicates)))
    return factors


def bootstrap(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Replicates:
    """The statistics that are combined, at all lags; logarithms of those in POSITIVE.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    """
    curve = {"autocorrelation": autocorrelation(mu, valid, mu.shape[1], weights)}
    statistics = vars(window_statistics(mu, valid, weights)) | curve
    logarithms = {name: np.log(statistics[name].rows) for name in POSITIVE}
    return logarithms | {name: statistics[name].rows for name in PLAIN}


def extrapolated(rows: Replicates, fine: Replicates, coarse: Replicates, factors: Replicates) -> Replicates:
    """Rows with the error of the mesh taken off, of each statistic that has a factor.

    rows : of strips on cells h, with or without a control
    fine, coarse : of the solved strips on cells h and 2h
    factors : f, from `mesh_factors`
    """
    shape = {name: (-1, *(1,) * (rows[name].ndim - 1)) for name in factors}
    return rows | {
        name: rows[name] + f.reshape(shape[name]) * (fine[name] - coarse[name]) for name, f in factors.items()
    }


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
    mesh : part of the rows of mean and std that the extrapolation to cells of no size added; zero without one
    variance_share : by statistic, variance over that of the solved strips alone
    control : rows of the expansion alone, on its own strips
    strips : number of solved strips, and of those that the expansion has alone
    """

    rows: Replicates
    mesh: Replicates
    variance_share: Replicates
    control: Replicates
    strips: tuple[int, int]

    def estimates(self) -> dict[str, Estimate]:
        """Each statistic of mu, with the coefficient of variation."""
        rows = {name: np.exp(values) if name in POSITIVE else values for name, values in self.rows.items()}
        rows["variation"] = rows["std"] / rows["mean"]
        return {name: estimate_of(name, values, self.strips[0]) for name, values in rows.items()}

    def mesh_change(self, name: str) -> Estimate:
        """() relative change of the mean or std by the extrapolation to cells of no size."""
        return Estimate.from_rows(np.expm1(self.mesh[name]))

    def calibrated(self, mean: float, reference: Combined) -> Combined:
        """Of mu in units in which the reference has a mean of `mean` exactly, in each replicate."""
        scale, mesh = math.log(mean) - reference.rows["mean"], reference.mesh["mean"]
        rows = {name: values + scale if name in POSITIVE else values for name, values in self.rows.items()}
        return replace(self, rows=rows, mesh={name: change - mesh for name, change in self.mesh.items()})


def combine(levels: Levels, weights: tuple[np.ndarray, np.ndarray], factors: Replicates | None = None) -> Combined:
    """Statistics of the solved windows, with the expansion as control and cells 2h for the extrapolation.

    levels : at one penetration, each (S, W)
    weights : of the solved strips and of the others, as from `Levels.weights`
    factors : from `mesh_factors`; without them nothing is extrapolated

    All replicates share one alpha, so that intervals lack its own error, a part 1 / S of the variance.
    """
    strips = levels.strips
    shapes = [np.shape(windows[0]) for windows in (levels.solved, levels.coarse or levels.solved, levels.expansion)]
    if shapes[0] != shapes[1] or shapes[0][1:] != shapes[2][1:] or strips[1] < 1:
        raise ParameterError(f"levels need equal windows, and the expansion more strips than are solved, not {shapes}")
    if [group.shape[1] for group in weights] != list(strips) or len(weights[0]) != len(weights[1]):
        raise ParameterError(f"weights are needed for groups of {strips} strips: see Levels.weights")
    mu, valid = levels.expansion
    own = bootstrap(*levels.solved, weights[0])
    same = bootstrap(mu[: strips[0]], valid[: strips[0]], weights[0])
    control = bootstrap(mu[strips[0] :], valid[strips[0] :], weights[1])
    rows, shares = controlled(own, same, control, strips[0] / strips[1])
    final = rows
    if levels.coarse is not None and factors is not None:
        final = extrapolated(rows, own, bootstrap(*levels.coarse, weights[0]), factors)
    mesh = {name: final[name] - rows[name] for name in ("mean", "std")}
    return Combined(final, mesh, shares, control, strips)
