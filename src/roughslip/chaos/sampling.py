"""Designs of standard normal variables."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from roughslip.validation import gate, whole_at_least

SOBOL_BITS = 30


@gate
def latin_hypercube(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """Standard normals with exactly one sample in each of `samples` equally likely strata of every variable.

    samples, variables : both at least 1

    Returns xi : (samples, variables) [-]. Raises ParameterError.

    Method: McKay, Beckman and Conover, Technometrics 21 (1979) 239: the strata in random order, a random place in each.
    `scipy.stats.qmc.LatinHypercube` draws the places first, so its designs are others, and may round to the ends 0 and
    1 of all strata, where a normal is infinite.
    """
    whole_at_least("number of samples", samples, 1)
    whole_at_least("number of variables", variables, 1)
    strata = np.stack([generator.permutation(samples) for _ in range(variables)], axis=1)
    # Kept away from the ends of its stratum by a rounding error, or it could round into the next one or to infinity.
    margin = samples * np.finfo(np.float64).eps
    place = np.clip(generator.random((samples, variables)), margin, 1.0 - margin)
    return ndtri((strata + place) / samples)


def sobol_places(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """The first places of a scrambled Sobol sequence, in its order.

    generator : the same state gives the same sequence for every length
    samples : from 1 to 2^30; with a power of two every variable has one sample in each of as many strata
    variables : at least 1

    Returns places : (samples, variables) in (0, 1), each uniform.

    Method: I. M. Sobol', USSR Comput. Math. Math. Phys. 7 (1967) 86; Owen scrambling by random linear maps of the
    digits and a digital shift, Matousek, J. Complexity 14 (1998) 527.
    """
    from scipy.stats import qmc  # its import takes a second, and few stages draw

    sequence = qmc.Sobol(variables, scramble=True, bits=SOBOL_BITS, rng=generator)
    # In the middle of the finest cells, of side 2^-bits: never 0 or 1, where a normal is infinite.
    return sequence.random_base2((samples - 1).bit_length())[:samples] + 0.5 ** (SOBOL_BITS + 1)
