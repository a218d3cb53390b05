"""Multivariate probabilists' Hermite polynomials, normalised: orthonormal under independent standard normals."""

from __future__ import annotations

import numpy as np

from roughslip.chaos.basis import Basis


def hermite_basis(xi: np.ndarray, indices: np.ndarray) -> np.ndarray:
    """Every term of the basis at every sample: the matrix Gamma of eq. (11).

    xi : (K, variables) [-] samples of the standard normal variables
    indices : (P, variables) exponents, from `multi_indices`

    Returns basis : (K, P). Raises ParameterError where the variables do not match or a sample is not finite.
    """
    return Basis(indices, ("hermite",) * indices.shape[-1])(xi)
