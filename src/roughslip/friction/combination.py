"""Statistics of the friction coefficient from strips on two meshes and from a cheap model on many more strips.

Two errors are reduced, that of the mesh and that of few strips::

    theta = theta_h + f (theta_h - theta_2h) - alpha (theta_same - theta_many)

- theta_h, theta_2h: the solved strips on cells h and 2h. An error c h^p is taken off by f = 1 / (2^p - 1) (Richardson).
- theta_same, theta_many: a control on the S solved strips and on S2 others. Its bias cancels. The variance is least for
  alpha = cov / (var_same (1 + S / S2)) (Lavenberg and Welch, Management Science 27, 1981; with the mean of the control
  itself estimated: Pasupathy et al., IIE Transactions 44, 2012).

With other strips on cells 2h alone, these are the control: theta_same is then theta_2h, and theta_many that of the
other strips, itself combined with the cheap model on still more strips.

Both act on every replicate of the bootstrap, so that the interval holds what remains of both errors. Positive
statistics are combined by their logarithms and stay positive.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.correlation import autocorrelation
from roughslip.friction.statistics import NO_SCATTER, estimate_of, window_statistics
from roughslip.probability import Estimate

ORDERS = {"mean": (0.9, 2.2), "std": (1.25, 2.75), "autocorrelation": (1.0, 2.0)}
"""Least and largest order of the error of the mesh: 1 at the sides of a strip, 2 at the edges of contacts. Measured on
three scenes, docs/notebook/friction.md."""

POSITIVE = ("mean", "std", "quantiles")
PLAIN = ("skewness", "kurtosis", "autocorrelation")

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, each (S, W)
Rows = dict[str, np.ndarray]  # by statistic (1 + R, ...): the value of the sample, then of each replicate


def mesh_factors(replicates: int, rng: np.random.Generator) -> Rows:
    """f : (1 + replicates,) of each statistic, evenly spread over those of ORDERS; the first is their middle.

    Mean and quantiles share one, as the sides of the strip act on all of mu alike. Skewness and kurtosis have none:
    with eleven cells a correlation length halving the cells changes the skewness by 0.01, less than its interval, and
    extrapolation would add noise.
    """
    factors = {}
    for name, orders in ORDERS.items():
        high, low = (1.0 / (2.0**order - 1.0) for order in orders)
        factors[name] = np.concatenate(([(low + high) / 2], rng.uniform(low, high, replicates)))
    return factors | {"quantiles": factors["mean"]}


def rows_of(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> Rows:
    """The statistics that are combined, at all lags; logarithms of those in POSITIVE.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`
    """
    curve = {"autocorrelation": autocorrelation(mu, valid, mu.shape[1], weights)}
    found = vars(window_statistics(mu, valid, weights)) | curve
    return {name: np.log(found[name].rows) for name in POSITIVE} | {name: found[name].rows for name in PLAIN}


def extrapolated(rows: Rows, fine: Rows, coarse: Rows, factors: Rows) -> Rows:
    """Rows with the error of the mesh taken off, of each statistic that has a factor.

    rows : of strips on cells h, with or without a control
    fine, coarse : of the solved strips on cells h and 2h
    factors : f, from `mesh_factors`
    """
    shape = {name: (-1, *(1,) * (rows[name].ndim - 1)) for name in factors}
    return rows | {
        name: rows[name] + f.reshape(shape[name]) * (fine[name] - coarse[name]) for name, f in factors.items()
    }


def controlled(rows: Rows, same: Rows, many: Rows, strips: float | None = None) -> tuple[Rows, dict[str, np.ndarray]]:
    """Rows with the control taken off, and the share of its variance that each statistic keeps.

    rows, same : of the solved strips and of the control on them, with the same weights
    many : of the control on other strips
    strips : number of solved strips over that of the others, and so var many / var same; without it by the replicates

    Raises IllPosedError where the control does not scatter between strips.
    """
    found, kept = {}, {}
    for name, own in rows.items():
        deviation = own[1:] - own[1:].mean(axis=0), same[name][1:] - same[name][1:].mean(axis=0)
        shared, control = (np.mean(deviation[1] * one, axis=0) for one in deviation)
        variance = np.mean(deviation[0] ** 2, axis=0)
        if name == "mean" and not (control > NO_SCATTER**2 and variance > NO_SCATTER**2):
            raise IllPosedError("solved or control windows do not scatter between strips: use the solved strips alone")
        total = control + np.var(many[name][1:], axis=0) if strips is None else (1.0 + strips) * control
        alpha = np.divide(shared, total, out=np.zeros_like(shared), where=control > 0)
        found[name] = own - alpha * (same[name] - many[name])
        kept[name] = 1.0 - np.divide(alpha * shared, variance, out=np.zeros_like(shared), where=variance > 0)
    return found, kept


@dataclass(frozen=True)
class Combined:
    """Statistics of mu from all strips.

    rows : of each statistic, as from `rows_of`
    mesh : part of the rows of mean and std that the extrapolation to cells of no size added; zero without one
    kept : by statistic, variance over that of the solved strips alone
    control : rows of the control alone, on the other strips
    strips : number of solved strips, and of those of the control
    """

    rows: Rows
    mesh: Rows
    kept: Rows
    control: Rows
    strips: tuple[int, int]

    def estimates(self) -> dict[str, Estimate]:
        """Each statistic of mu, with the coefficient of variation."""
        rows = {name: np.exp(one) if name in POSITIVE else one for name, one in self.rows.items()}
        rows["variation"] = rows["std"] / rows["mean"]
        return {name: estimate_of(name, one, self.strips[0]) for name, one in rows.items()}

    def mesh_change(self, name: str) -> Estimate:
        """() relative change of the mean or std by the extrapolation to cells of no size."""
        return Estimate.from_rows(np.expm1(self.mesh[name]))

    def calibrated(self, mean: float, reference: Combined) -> Combined:
        """Of mu in units in which the reference has a mean of `mean` exactly, in each replicate."""
        scale, mesh = math.log(mean) - reference.rows["mean"], reference.mesh["mean"]
        powers = {"mean": scale, "std": scale, "quantiles": scale[:, None]}
        rows = {name: one + powers.get(name, 0.0) for name, one in self.rows.items()}
        return replace(self, rows=rows, mesh={name: one - mesh for name, one in self.mesh.items()})


@dataclass(frozen=True)
class Others:
    """Strips on cells 2h alone, other ones than those that are solved.

    coarse, control : (mu, valid), each (S1, W), on these strips
    weights : (1 + R, S1) counts from `strip_weights`
    """

    coarse: Windows
    control: Windows
    weights: np.ndarray


def combine(
    solved: Windows,
    control_same: Windows,
    control_many: Windows,
    weights: np.ndarray,
    weights_many: np.ndarray,
    coarse: Windows | None = None,
    factors: Rows | None = None,
    others: Others | None = None,
) -> Combined:
    """Statistics from solved strips, with the control on the same and on many other strips, and with a second mesh.

    solved, control_same, coarse : (mu, valid), each (S, W): solved windows, the control and cells of twice the edge
    control_many : (mu, valid), each (S2, W): the control on other strips, which are in none of the other groups
    weights, weights_many : (1 + R, S), (1 + R, S2) counts from `strip_weights`
    factors : from `mesh_factors`, with `coarse`
    others : strips on the cells of `coarse` alone

    All replicates share one alpha, so that intervals lack its own error, a part 1 / S of the variance.
    """
    shapes = [np.shape(mu) for mu, _ in (solved, control_same, *(() if coarse is None else (coarse,)))]
    if len(set(shapes)) > 1 or np.shape(control_many[0])[1:] != shapes[0][1:]:
        raise ParameterError(f"solved windows, those of the control and of the coarse mesh must match, not {shapes}")
    if np.ndim(weights) != 2 or np.ndim(weights_many) != 2 or len(weights) != len(weights_many):
        raise ParameterError("weights of the solved and of other strips need equally many rows: see strip_weights")
    fine, control = rows_of(*solved, weights), rows_of(*control_many, weights_many)
    half = None if coarse is None else rows_of(*coarse, weights)
    if half is not None and others is not None:
        own, same = (rows_of(*windows, others.weights) for windows in (others.coarse, others.control))
        of_others, _ = controlled(own, same, control, len(others.coarse[0]) / len(control_many[0]))
        rows, kept = controlled(fine, half, of_others)
    else:
        rows, kept = controlled(fine, rows_of(*control_same, weights), control, len(solved[0]) / len(control_many[0]))
    final = rows if half is None or factors is None else extrapolated(rows, fine, half, factors)
    mesh, strips = {name: final[name] - rows[name] for name in ("mean", "std")}, (len(solved[0]), len(control_many[0]))
    return Combined(final, mesh, kept, control, strips)
