"""Families of distributions for the friction coefficient, compared with the four-parameter Beta by one distance.

Every family has a free location and scale, so only its shape is searched. Linear regression of the sample's quantiles
on those of the family gives location and scale. The residual is 1 - correlation^2, the squared 2-Wasserstein distance
over the variance (del Barrio, Cuesta-Albertos and Matran, Test 9 (2000) 1).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import special

from roughslip.friction.marginal import PROBABILITIES, standard_quantiles
from roughslip.probability import Estimate

# The shape of a member is named by its skewness: both families are the normal distribution at 0, the gamma is the
# exponential distribution at 2, and members of negative skewness are mirror images.
SKEWNESS = np.linspace(-2.0, 2.0, 401)
FAMILIES = ("normal", "gamma", "lognormal")


@dataclass(frozen=True)
class Candidate:
    """A family nearest to the sample.

    skewness : () of the nearest member, which names its shape
    distance : () 2-Wasserstein distance between sample and member, over the standard deviation of the sample
    """

    skewness: Estimate
    distance: Estimate


def fit_candidates(mu: np.ndarray, valid: np.ndarray, weights: np.ndarray) -> dict[str, Candidate]:
    """The nearest member of every family of FAMILIES.

    mu, valid : (S, W) friction coefficient and bool
    weights : (1 + R, S) counts from `strip_weights`

    Raises IllPosedError where mu has no scatter. Shapes are searched on a table, 0.01 apart in skewness.
    """
    standard, _, _ = standard_quantiles(mu, valid, weights)
    moved = np.sqrt(np.mean((standard[1:] - standard[0]) ** 2, axis=1))
    found = {}
    for family in FAMILIES:
        table = _table(family)
        correlation = standard @ table.T / len(PROBABILITIES)
        best = np.argmax(correlation, axis=1)
        largest = np.take_along_axis(correlation, best[:, None], axis=1)[:, 0]
        found[family] = Candidate(
            skewness=Estimate.from_rows((SKEWNESS if len(table) > 1 else np.zeros(1))[best]),
            distance=Estimate.of_distance(np.sqrt(np.maximum(0.0, 1.0 - largest**2)), moved),
        )
    return found


@lru_cache(maxsize=len(FAMILIES))
def _table(family: str) -> np.ndarray:
    """Quantiles (members, nodes) of a family at PROBABILITIES, each with mean 0 and mean square 1."""
    if family == "normal":
        table = special.ndtri(PROBABILITIES)[None]
    else:
        half = (_gamma if family == "gamma" else _lognormal)(SKEWNESS[SKEWNESS > 0][:, None])
        table = np.concatenate((-half[::-1, ::-1], special.ndtri(PROBABILITIES)[None], half))
    table = table - table.mean(axis=1, keepdims=True)
    table /= np.sqrt(np.mean(table**2, axis=1, keepdims=True))
    return np.ascontiguousarray(table)


def _gamma(skewness: np.ndarray) -> np.ndarray:
    """Quantiles of gamma distributions; a shape k has the skewness 2 / sqrt(k)."""
    return special.gammaincinv(4.0 / skewness**2, PROBABILITIES)


def _lognormal(skewness: np.ndarray) -> np.ndarray:
    """Quantiles of exp(s Z); its skewness is (w + 2) sqrt(w - 1) with w = exp(s^2), a cubic in w."""
    root = skewness * np.sqrt(1.0 + skewness**2 / 4.0)
    w = np.cbrt(1.0 + skewness**2 / 2.0 + root) + np.cbrt(1.0 + skewness**2 / 2.0 - root) - 1.0
    return np.exp(np.sqrt(np.log(w)) * special.ndtri(PROBABILITIES))
