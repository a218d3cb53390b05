"""Number of contact solves: surfaces are added until the estimated error of the distribution is small enough.

The error is sup |F_expansion(p) - F(p)| over p >= 0. Its two parts are estimated from the training surfaces, each as a
95 % quantile over their scatter. One is sup |sum_g v_g d_g(p)|, with d_g the change of F without group g and v_g
normal. The other is the bias, sup |C(p)| beyond the noise of C. With P predicted from the other surfaces, C is the
mean over surfaces of [indicator(pressure <= p) - P(pressure <= p)]. It detects an unsuitable target or unsuitable
variables.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.local import GROUPS, LocalExpansion, Member, Samples, jackknife_deviations
from roughslip.chaos.sampling import sobol
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, real
from roughslip.probability.pilot import refusal, widened
from roughslip.validation import whole_at_least

QUANTILE = 0.95  # of the error over the scatter of the training surfaces
DRAWS = 2**13  # of the variables, the same for every group; the scatter is integrated
LEVELS = 100  # pressures, quantiles given contact
REPLICATES = 1000


@dataclass(frozen=True)
class DistributionError:
    """Estimated Kolmogorov error of an expansion's distribution.

    scatter : [-] due to the scatter of its training surfaces
    bias : [-] systematic part, above the noise of its estimate
    """

    scatter: float
    bias: float

    @property
    def total(self) -> float:
        """Sum of both parts [-]."""
        return self.scatter + self.bias


@dataclass(frozen=True)
class Enriched:
    """What the surfaces reach.

    error : estimated, of the last expansion
    history : number of surfaces and estimated error at every step; NaN where no expansion could be fitted
    """

    error: DistributionError
    history: tuple[tuple[int, float], ...]


def cdf_error(expansion: LocalExpansion, samples: Samples, generator: np.random.Generator) -> DistributionError:
    """Estimate sup |F_expansion - F| from the surfaces that the expansion was fitted to.

    expansion : result of fit_local for these samples
    samples : the surfaces; the bias is estimated at their central nodes, whose distance2 is zero

    Method: delete-a-group jackknife (Kott, J. Off. Stat. 17 (2001) 521) with normal multipliers for the supremum
    (Kline and Santos, J. Econom. Methods 1 (2012) 23).
    """
    basis = hermite_basis(sobol(generator, DRAWS, expansion.indices.shape[1]), expansion.indices)
    contact = samples.pressure[samples.pressure > 0]
    levels = np.concatenate([[0.0], np.quantile(contact, (np.arange(LEVELS) + 0.5) / LEVELS)])
    curves = [cumulative(expansion, member, basis, levels) for member in expansion.without]
    multipliers = generator.standard_normal((REPLICATES, GROUPS))
    scatter = _largest(multipliers, jackknife_deviations(np.stack(curves)))
    seen = miscalibration(expansion, samples, levels)
    mean = seen.mean(axis=0)
    noise = _largest(multipliers, (seen - mean) / np.sqrt(GROUPS * (GROUPS - 1)))
    return DistributionError(scatter, max(0.0, float(np.max(np.abs(mean))) - noise))


def cumulative(expansion: LocalExpansion, member: Member, basis: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Distribution of the pressure, as a mean over given variables.

    member : a fit of the expansion, to all surfaces or without a group
    basis : (n, P) terms at the variables
    levels : (m,) [Pa] not negative

    Returns F : (m,) [-].
    """
    predicted = basis @ member.coefficients
    near = predicted[predicted > expansion.lowest]
    targets = expansion.target.values(levels / member.balance, np.zeros_like(levels))
    below = member.scatter.cumulative(near, targets).sum(axis=0)
    return (below + len(predicted) - len(near)) / len(predicted)


def miscalibration(expansion: LocalExpansion, samples: Samples, levels: np.ndarray) -> np.ndarray:
    """Observed minus predicted share of pressures up to each level, for each group of surfaces.

    levels : (n,) [Pa] not negative, ascending

    Returns C : (GROUPS, n) [-]. The groups are those of fit_local; each is predicted from the others.
    """
    central = np.abs(samples.distance2) < 1e-9
    group = samples.group
    differences = np.empty((GROUPS, len(levels)))
    for number, member in enumerate(expansion.without):
        pressure = np.sort(samples.pressure[group == number][:, central], axis=None)
        variables = samples.variables[group == number][:, central].reshape(-1, expansion.indices.shape[1])
        predicted = cumulative(expansion, member, hermite_basis(variables, expansion.indices), levels)
        differences[number] = np.searchsorted(pressure, levels, side="right") / len(pressure) - predicted
    return differences


def enrich(
    solve: Callable[[int, int], Samples],
    fit: Callable[[Samples], tuple[LocalExpansion, Samples]],
    accuracy: float,
    share: float = 1.0,
    *,
    least: int,
    most: int,
    seed: list[int],
) -> Enriched:
    """Double the number of solved surfaces until the estimated error of the distribution is small enough.

    solve : returns the surfaces [first, last) of a design that can be extended
    fit : returns the expansion of given surfaces, and these in its variables; IllPosedError asks for more surfaces
    accuracy : [-] largest Kolmogorov error of the pressure, in (0, 1)
    share : of it, for the expansion
    least, most : first and largest number of surfaces
    seed : of the draws that estimate the error

    No surface is solved twice. Raises ParameterError for numbers out of range, ConvergenceError where `most` surfaces
    do not reach the error.
    """
    if not 0 < real("error asked for", accuracy) < 1:
        raise ParameterError(f"the error asked for must lie between 0 and 1, not {accuracy}")
    if not 0 < real("share for the expansion", share) <= 1:
        raise ParameterError(f"the share for the expansion must lie above 0 and not above 1, but is {share}")
    if not GROUPS <= whole_at_least("least number of surfaces", least, 0) <= whole_at_least("most surfaces", most, 0):
        raise ParameterError(f"between {GROUPS} and {most} surfaces are needed to begin with, not {least}")
    samples = solve(0, least)
    history: list[tuple[int, float]] = []
    while True:
        count, reason = len(samples.pressure), "the expansion cannot be fitted"
        try:
            expansion, fitted = fit(samples)
            error = cdf_error(expansion, fitted, np.random.default_rng(seed))
        except IllPosedError as ill_posed:
            history.append((count, float("nan")))
            reason = str(ill_posed).partition(": ")[0]  # without its advice, such as more samples
        else:
            history.append((count, error.total))
            if error.total <= share * accuracy:
                return Enriched(error, tuple(history))
            reason = f"its error is {error.scatter:.2g} from their scatter and {error.bias:.2g} from bias"
        if 2 * count > most:
            errors = [error for _, error in history if np.isfinite(error)]
            nearest = widened({"pressure": min(errors) / share}, 1.005) if errors else None
            advice = (
                "against scatter take fewer variables or a lower degree, against bias more variables, a higher degree "
                "or the other target, without contact a deeper penetration: of "
                f"{most} surfaces at most, {count} do not give the distribution, as {reason}; scene keys: "
                "expansion.variables, expansion.degree, expansion.target, square.penetration_percentile"
            )
            raise ConvergenceError(
                refusal({"pressure": accuracy}, nearest, advice), residual=history[-1][1], work=count
            )
        samples = _joined(samples, solve(count, 2 * count))


def _joined(first: Samples, second: Samples) -> Samples:
    pairs = ((getattr(first, name), getattr(second, name)) for name in ("variables", "pressure", "gap"))
    variables, pressure, gap = (np.concatenate(pair) for pair in pairs)
    return replace(first, variables=variables, pressure=pressure, gap=gap)


def _largest(multipliers: np.ndarray, deviations: np.ndarray) -> float:
    """Quantile of sup |sum_g v_g d_g| over the multipliers v : (replicates, groups)."""
    return float(np.quantile(np.max(np.abs(multipliers @ deviations), axis=1), QUANTILE))
