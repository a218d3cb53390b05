"""Where to sample the Gaussian variables xi: Monte Carlo and Latin hypercube designs."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import ParameterError


def monte_carlo(seed: list[int], variables: int) -> np.ndarray:
    """xi : (variables,) independent standard normals of one sample; `seed` ends with the number of the sample."""
    return np.random.default_rng(seed).standard_normal(variables)


def latin_hypercube(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """xi : (samples, variables) standard normals with exactly one sample in each of `samples` equally likely strata.

    McKay, Beckman and Conover 1979: a random permutation of the strata for every variable, a random place in each.
    """
    if samples < 1 or variables < 1:
        raise ParameterError(f"a design needs samples and variables, not {samples} and {variables}")
    strata = np.stack([generator.permutation(samples) for _ in range(variables)], axis=1)
    place = generator.random((samples, variables))
    smallest = np.finfo(float).tiny  # a place of exactly zero in the lowest stratum would be minus infinity
    return ndtri(np.maximum((strata + place) / samples, smallest))
