"""Samples of the Gaussian variables xi: Monte Carlo, Latin hypercube and Sobol designs."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.errors import ParameterError
from roughslip.validation import whole_at_least

MOST_SOBOL_VARIABLES = 21_201  # direction numbers of Joe and Kuo, as scipy has them
_SOBOL_BITS = 30


def monte_carlo(seed: list[int], variables: int) -> np.ndarray:
    """xi : (variables,) [-] independent standard normals of one sample; `seed` ends with the number of the sample."""
    return np.random.default_rng(seed).standard_normal(variables)


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
            f"a Sobol sequence has at most {MOST_SOBOL_VARIABLES} variables, not {variables}: take another design"
        )
    if samples > 2**_SOBOL_BITS:
        raise ParameterError(f"a Sobol sequence has at most 2^{_SOBOL_BITS} samples, not {samples}")
    sequence = qmc.Sobol(variables, scramble=True, bits=_SOBOL_BITS, rng=generator)
    # In the middle of the finest cells, of side 2^-bits: never 0 or 1, where a normal is infinite.
    return sequence.random_base2((samples - 1).bit_length())[:samples] + 0.5 ** (_SOBOL_BITS + 1)


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


def design(kind: str, seed: list[int], samples: int, variables: int) -> np.ndarray:
    """xi : (samples, variables) [-] of a kind: "monte_carlo", "latin_hypercube" or "sobol".

    seed : with one seed, Monte Carlo and Sobol designs of any length begin with the same samples

    Raises ParameterError as these functions, and for another kind.
    """
    generator = np.random.default_rng(seed)
    match kind:
        case "monte_carlo":
            _check(samples, variables)
            return np.stack([monte_carlo([*seed, number], variables) for number in range(samples)])
        case "latin_hypercube":
            return latin_hypercube(generator, samples, variables)
        case "sobol":
            return sobol(generator, samples, variables)
    raise ParameterError(f"design {kind!r} is not known: monte_carlo, latin_hypercube or sobol")


def _check(samples: int, variables: int) -> None:
    whole_at_least("number of samples", samples, 1)
    whole_at_least("number of variables", variables, 1)
