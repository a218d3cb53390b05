"""As many contact solves as the distribution asked for takes: samples are added until its estimated error is small.

The error is that of the whole distribution, sup |F_expansion(p) - F(p)| over p >= 0, the probability of contact
included at p = 0. Two parts are estimated from the training surfaces alone, each at its 95 % quantile over the scatter
of these surfaces:

    scatter   sup |sum_g v_g d_g(p)| with v_g normal and d_g what leaving out group g of the surfaces does to F
    bias      how far sup |C(p)| exceeds the same quantile of its noise,
              C(p) = mean over surfaces of [indicator(pressure <= p) - P(pressure <= p)],

the probability predicted from the other surfaces. C estimates F - F_expansion at the same surfaces, so that what their
heights explain cancels; it sees a target or variables that do not serve, which the scatter does not.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from roughslip.chaos.designs import sobol
from roughslip.chaos.hermite import hermite_basis
from roughslip.chaos.local import GROUPS, LocalExpansion, Samples, jackknife_deviations
from roughslip.errors import ConvergenceError, IllPosedError, ParameterError, real
from roughslip.validation import whole_at_least

QUANTILE = 0.95  # of the error over the scatter of the training surfaces: what is asked holds in as many studies
DRAWS = 2**13  # of the variables; the same for every group, and each with the whole law of its scatter
LEVELS = 100  # pressures, quantiles given contact
REPLICATES = 1000


@dataclass(frozen=True)
class DistributionError:
    """Estimated Kolmogorov error of an expansion's distribution.

    scatter : [-] of its training surfaces
    bias : [-] beyond the noise with which it is seen
    """

    scatter: float
    bias: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.scatter + self.bias


@dataclass(frozen=True)
class Enriched:
    """An expansion whose distribution is as good as asked.

    expansion, samples : the last fit, and all that it was fitted to
    error : its estimate
    history : number of surfaces and estimated error at every step; NaN where no expansion could be fitted
    """

    expansion: LocalExpansion
    samples: Samples
    error: DistributionError
    history: tuple[tuple[int, float], ...]


def cdf_error(expansion: LocalExpansion, samples: Samples, generator: np.random.Generator) -> DistributionError:
    """Estimate sup |F_expansion - F| from the surfaces that the expansion was fitted to.

    expansion : as fit_local gives it for these samples
    samples : the surfaces; the bias is read off at their central nodes, whose distance2 is zero

    Method: delete-a-group jackknife (Kott, J. Off. Stat. 17 (2001) 521) with normal multipliers for the supremum
    (Kline and Santos, J. Econom. Methods 1 (2012) 23).
    """
    basis = hermite_basis(sobol(generator, DRAWS, expansion.indices.shape[1]), expansion.indices)
    contact = samples.pressure[samples.pressure > 0]
    levels = np.concatenate([[0.0], np.quantile(contact, (np.arange(LEVELS) + 0.5) / LEVELS)])
    curves = [cumulative(expansion, 1 + group, basis, levels) for group in range(GROUPS)]
    multipliers = generator.standard_normal((REPLICATES, GROUPS))
    scatter = _largest(multipliers, jackknife_deviations(np.stack(curves)))
    seen = miscalibration(expansion, samples, levels)
    mean = seen.mean(axis=0)
    noise = _largest(multipliers, (seen - mean) / np.sqrt(GROUPS * (GROUPS - 1)))
    return DistributionError(scatter, max(0.0, float(np.max(np.abs(mean))) - noise))


def cumulative(expansion: LocalExpansion, member: int, basis: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Distribution of the pressure in the mean over given variables.

    member : 0 for the fit, 1 + group for that without a group
    basis : (n, P) terms at the variables
    levels : (m,) [Pa] not negative

    Returns F : (m,) [-].
    """
    predicted = basis @ expansion.coefficients[member]
    near = predicted[predicted > expansion.lowest]
    targets = expansion.target.values(levels / expansion.balance[member], np.zeros_like(levels))
    below = expansion.scatters[member].cumulative(near, targets).sum(axis=0)
    return (below + len(predicted) - len(near)) / len(predicted)


def miscalibration(expansion: LocalExpansion, samples: Samples, levels: np.ndarray) -> np.ndarray:
    """Seen less predicted share of pressures up to each level, of each group of surfaces from the others.

    levels : (n,) [Pa] not negative, ascending

    Returns C : (GROUPS, n) [-]. The groups are those of fit_local.
    """
    central = np.abs(samples.distance2) < 1e-9
    group = samples.group
    found = np.empty((GROUPS, len(levels)))
    for number in range(GROUPS):
        pressure = np.sort(samples.pressure[group == number][:, central], axis=None)
        variables = samples.variables[group == number][:, central].reshape(-1, expansion.indices.shape[1])
        predicted = cumulative(expansion, 1 + number, hermite_basis(variables, expansion.indices), levels)
        found[number] = np.searchsorted(pressure, levels, side="right") / len(pressure) - predicted
    return found


def enrich(
    solve: Callable[[int, int], Samples],
    fit: Callable[[Samples], tuple[LocalExpansion, Samples]],
    asked: float,
    *,
    least: int,
    most: int,
    seed: list[int],
) -> Enriched:
    """Double the number of solved surfaces until the estimated error of the distribution is at most the one asked for.

    solve : the surfaces [first, last) of a design that can be extended
    fit : an expansion of surfaces, and these in its variables; where it is ill-posed, they are too few
    asked : [-] Kolmogorov error, in (0, 1)
    least, most : numbers of surfaces to begin with, and never to exceed

    No surface is solved twice, and none beyond the first number that serves. Raises ParameterError for numbers out of
    range, ConvergenceError where `most` surfaces do not serve.
    """
    if not 0 < real("error asked for", asked) < 1:
        raise ParameterError(f"the error asked for must lie between 0 and 1, not {asked}")
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
            reason = str(ill_posed)
        else:
            history.append((count, error.total))
            if error.total <= asked:
                return Enriched(expansion, fitted, error, tuple(history))
            reason = f"its error is {error.scatter:.2g} from their scatter and {error.bias:.2g} from bias"
        if 2 * count > most:
            raise ConvergenceError(
                f"{count} surfaces do not give the distribution to within {asked:g}: {reason}. More than {most} are "
                "not solved: ask for less, or take fewer variables or a lower degree against scatter, more variables, "
                "a higher degree or the other target against bias",
                residual=history[-1][1],
                work=count,
            )
        samples = _joined(samples, solve(count, 2 * count))


def _joined(first: Samples, second: Samples) -> Samples:
    pairs = ((getattr(first, name), getattr(second, name)) for name in ("variables", "pressure", "gap"))
    variables, pressure, gap = (np.concatenate(pair) for pair in pairs)
    return replace(first, variables=variables, pressure=pressure, gap=gap)


def _largest(multipliers: np.ndarray, deviations: np.ndarray) -> float:
    """Quantile of sup |sum_g v_g d_g| over the multipliers v : (replicates, groups)."""
    return float(np.quantile(np.max(np.abs(multipliers @ deviations), axis=1), QUANTILE))
