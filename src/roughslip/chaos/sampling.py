"""Samples of the Gaussian variables, and empirical distributions of the pressure with their sampling error.

An infinite pressure, which the exponential of a poor fit of eq. (9) can give, is larger than every level. NaN is
refused.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import gate, whole_at_least

MOST_SOBOL_VARIABLES = 21_201  # direction numbers of Joe and Kuo, as scipy has them
_SOBOL_BITS = 30


@gate
def monte_carlo(seed: list[int], variables: int) -> np.ndarray:
    """xi : (variables,) [-] independent standard normals of one sample; `seed` ends with the number of the sample."""
    return np.random.default_rng(seed).standard_normal(variables)


@gate
def latin_hypercube(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """Standard normals with exactly one sample in each of `samples` equally likely strata of every variable.

    samples, variables : both at least 1

    Returns xi : (samples, variables) [-]. Raises ParameterError.

    Method: McKay, Beckman and Conover, Technometrics 21 (1979) 239: the strata in random order, a random place in each.
    """
    _check(samples, variables)
    strata = np.stack([generator.permutation(samples) for _ in range(variables)], axis=1)
    # Kept away from the ends of its stratum by a rounding error, or it could round into the next one or to infinity.
    margin = samples * np.finfo(np.float64).eps
    place = np.clip(generator.random((samples, variables)), margin, 1.0 - margin)
    return ndtri((strata + place) / samples)


def sobol_places(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """The first places of a scrambled Sobol sequence, in its order.

    generator : the same state gives the same sequence for every length
    samples : from 1 to 2^30; with a power of two every variable has one sample in each of as many strata
    variables : from 1 to MOST_SOBOL_VARIABLES

    Returns places : (samples, variables) in (0, 1), each uniform. Raises ParameterError.

    Method: I. M. Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86; Owen scrambling by random linear maps of the
    digits and a digital shift, Matousek, J. Complexity 14 (1998) 527.
    """
    from scipy.stats import qmc  # its import takes a second, and few stages draw

    _check(samples, variables)
    if variables > MOST_SOBOL_VARIABLES:
        raise ParameterError(
            f"a Sobol sequence has at most {MOST_SOBOL_VARIABLES} variables, not {variables}: take fewer modes; "
            "scene key: square.modes"
        )
    if samples > 2**_SOBOL_BITS:
        raise ParameterError(f"a Sobol sequence has at most 2^{_SOBOL_BITS} samples, not {samples}: take fewer")
    sequence = qmc.Sobol(variables, scramble=True, bits=_SOBOL_BITS, rng=generator)
    # In the middle of the finest cells, of side 2^-bits: never 0 or 1, where a normal is infinite.
    return sequence.random_base2((samples - 1).bit_length())[:samples] + 0.5 ** (_SOBOL_BITS + 1)


@gate
def sobol(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """Standard normals at a scrambled Sobol sequence, which can be extended.

    generator, samples, variables : as of `sobol_places`

    Returns xi : (samples, variables) [-]. The first 2^m rows are those of the design with 2^m samples. Within each
    doubling the rows are in random order. In the order of the sequence every n-th row would lie in one corner, but
    groups of every n-th row must be alike. Raises ParameterError.
    """
    doublings = (whole_at_least("number of samples", samples, 1) - 1).bit_length()
    places = sobol_places(generator, 2**doublings, variables)
    rows = [np.arange(1)]
    rows += [2**m + generator.permutation(2**m) for m in range(doublings)]
    return ndtri(places[np.concatenate(rows)[:samples]])


def _check(samples: int, variables: int) -> None:
    whole_at_least("number of samples", samples, 1)
    whole_at_least("number of variables", variables, 1)


def cumulative_given_contact(pressure: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Distribution of the pressure given contact.

    pressure : (...) [Pa] samples, zero out of contact
    levels : (n,) [Pa]

    Returns F : (n,) [-] share of the positive pressures up to each level. Raises ParameterError for NaN, IllPosedError
    where no sample is in contact.
    """
    positive = _ascending(pressure[pressure > 0], of=pressure)
    return np.searchsorted(positive, levels, side="right") / len(positive)


def quantile_levels(pressure: np.ndarray, lowest: float = 1e-4, count: int = 120) -> np.ndarray:
    """Levels for the plot of a distribution, dense in both tails.

    pressure : (...) [Pa] samples, zero out of contact
    lowest : [-] smallest probability, below 1/2; the largest is 1 - lowest
    count : number of probabilities from `lowest` to 1/2

    Returns levels : (2 count - 1,) [Pa] ascending quantiles of the positive pressures, fewer where some are equal.
    Raises as cumulative_given_contact, and ParameterError for infinite pressures.
    """
    if np.isinf(pressure).any():
        raise ParameterError("pressures must be finite for quantiles: leave out infinite ones")
    tail = np.geomspace(lowest, 0.5, count)
    probabilities = np.concatenate([tail, 1.0 - tail[::-1]])
    return np.unique(np.quantile(_ascending(pressure[pressure > 0], of=pressure), probabilities))


@gate
def kolmogorov_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Kolmogorov distance sup |F1 - F2| of two samples; equal values, such as zero pressures, form one step.

    first : (n1,)
    second : (n2,)

    Raises ParameterError for NaN, IllPosedError for an empty sample.
    """
    a, b = _ascending(first, of=first), _ascending(second, of=second)
    both = np.concatenate([a, b])
    share_a, share_b = (np.searchsorted(x, both, side="right") / len(x) for x in (a, b))
    return float(np.max(np.abs(share_a - share_b)))


def _ascending(values: np.ndarray, of: np.ndarray) -> np.ndarray:
    """The values in ascending order, after a check of all samples `of` which they were selected."""
    if np.isnan(of).any():
        raise ParameterError("pressures must not be NaN")
    if values.size == 0:
        raise IllPosedError(
            "no sample is in contact, so there is no distribution given contact: take more samples or a deeper "
            "penetration; scene keys: square.monte_carlo_samples, square.penetration_percentile"
        )
    return np.sort(values, axis=None)
