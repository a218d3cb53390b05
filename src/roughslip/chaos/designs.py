"""Where to sample the Gaussian variables xi: Monte Carlo and Latin hypercube designs."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import ParameterError


def monte_carlo(seed: list[int], variables: int) -> np.ndarray:
    """xi : (variables,) [-] independent standard normals of one sample; `seed` ends with the number of the sample."""
    return np.random.default_rng(seed).standard_normal(variables)


def latin_hypercube(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """Standard normals with exactly one sample in each of `samples` equally likely strata of every variable.

    samples, variables : both at least 1

    Returns xi : (samples, variables) [-]. Raises ParameterError.

    Method: McKay, Beckman and Conover, Technometrics 21 (1979) 239: the strata in random order, a random place in each.
    """
    if samples < 1 or variables < 1:
        raise ParameterError(f"a design needs samples and variables, not {samples} and {variables}")
    strata = np.stack([generator.permutation(samples) for _ in range(variables)], axis=1)
    # Held off the ends of its stratum by a rounding error, or it could round into the next one, the last to infinity.
    margin = samples * np.finfo(np.float64).eps
    place = np.clip(generator.random((samples, variables)), margin, 1.0 - margin)
    return ndtri((strata + place) / samples)
