"""Linear functionals of the heights around a node, the Gaussian variables in which the pressure there is expanded.

A Karhunen-Loeve expansion orders its modes by their share of the variance of the whole mesh, but the pressure at a node
depends on the surface around that node. Height, slopes, curvatures and two local means are linear in the heights and
therefore jointly Gaussian. These eight explain more of the pressure than the eight leading modes.

Designs of such variables: Latin hypercubes and Sobol sequences.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import scipy  # its parts when they are used

from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError
from roughslip.validation import gate, whole_at_least

NAMES = ("height", "slope x", "slope y", "curvature xx", "curvature yy", "curvature xy", "near mean", "far mean")

# Whether each functional changes sign (1) in a mirror image along x and along y, one row per functional.
MIRRORED = np.array([[0, 0], [1, 0], [0, 1], [0, 0], [0, 0], [1, 1], [0, 0], [0, 0]])
NO_SYMMETRY = MIRRORED[:, :0]  # without a known symmetry
HALF_TURN = (-1.0) ** MIRRORED.sum(axis=1)  # factor of each under half a turn, which is two mirror images

SOBOL_BITS = 30
INDEPENDENT = 1e-6  # least share of the standard deviation of a functional that is independent of those before it


@dataclass(frozen=True)
class Stencil:
    """Boxes of the near and the far mean of the heights.

    near, far : half widths along x and y [nodes]; a half width of 1 is a box of 3 nodes
    """

    near: tuple[int, int]
    far: tuple[int, int]


def local_functionals(heights: np.ndarray, stencil: Stencil) -> np.ndarray:
    """The functionals NAMES at every node, in units of height: derivatives are per node, not per metre.

    heights : (..., nx, ny) [m] or any other unit
    stencil : boxes of the local means

    Returns functionals : (8, ..., nx, ny) [m]. Differences are central, one-sided at the border, and zero along an axis
    with too few nodes (1 for slopes, 2 for curvatures). Boxes end at the border.
    """
    slope, second, *means = _across(heights.shape[-1], stencil)
    functionals = np.empty((len(NAMES), *heights.shape))
    functionals[0] = heights
    heights = functionals[0]  # in one piece
    functionals[1], functionals[3] = _differences(heights), _second_differences(heights)
    fields = heights, heights, functionals[1], *(_means(heights, half) for half, _ in (stencil.near, stencil.far))
    for number, field, matrix in zip((2, 4, 5, 6, 7), fields, (slope, second, slope, *means), strict=True):
        np.matmul(field, matrix, out=functionals[number])
    return functionals


@lru_cache
def _across(ny: int, stencil: Stencil) -> tuple[np.ndarray, ...]:
    """Matrices (ny, ny) of differences, second differences and both means across a strip, to multiply fields by."""
    rows, (_, near), (_, far) = np.eye(ny), stencil.near, stencil.far
    products = _differences(rows), _second_differences(rows), _means(rows, near), _means(rows, far)
    return tuple(np.ascontiguousarray(product.T) for product in products)


def _differences(fields: np.ndarray) -> np.ndarray:
    """Central differences along the last axis but one, one-sided at the border, zero for a single node."""
    return np.gradient(fields, axis=-2) if fields.shape[-2] > 1 else np.zeros_like(fields)


def _second_differences(fields: np.ndarray) -> np.ndarray:
    """Second differences along that axis; the border takes that of its neighbour, exact for quadratics."""
    seconds = np.zeros_like(fields)
    if fields.shape[-2] > 2:
        seconds[..., 1:-1, :] = fields[..., 2:, :] - 2 * fields[..., 1:-1, :] + fields[..., :-2, :]
        seconds[..., [0, -1], :] = seconds[..., [1, -2], :]
    return seconds


def _means(fields: np.ndarray, half: int) -> np.ndarray:
    """Means over boxes along that axis."""
    return _box_means(fields.reshape(-1, *fields.shape[-2:]), half).reshape(fields.shape)


@compiled()
def _box_means(fields: np.ndarray, half: int) -> np.ndarray:
    """Means over boxes along the middle axis, from differences of cumulative sums."""
    m, n, rest = fields.shape
    means, sums = np.empty(fields.shape), np.zeros((n + 1, rest))
    for k in range(m):
        for i in range(n):
            for j in range(rest):
                sums[i + 1, j] = sums[i, j] + fields[k, i, j]
        for i in range(n):
            low, high = max(i - half, 0), min(i + half + 1, n)
            for j in range(rest):
                means[k, i, j] = (sums[high, j] - sums[low, j]) / (high - low)
    return means


def orthonormal_directions(candidates: np.ndarray) -> np.ndarray:
    """Orthonormal rows that span the candidates one after another.

    candidates : (n, M) functionals of M independent standard normals, one per row

    Returns directions : (n, M); the variables directions @ xi are independent standard normals, of which the first k
    determine the first k candidates. Raises IllPosedError where a candidate depends on those before it.
    """
    columns, triangle = scipy.linalg.qr(candidates.T, mode="economic")
    own = np.zeros(len(candidates))
    own[: len(triangle)] = np.diag(triangle)
    if not np.all(np.abs(own) > INDEPENDENT * np.linalg.norm(candidates, axis=1)):
        raise IllPosedError(
            f"the {len(candidates)} variables of the expansion depend on each other: take more modes",
            scene_keys="square.modes",
        )
    return (columns * np.sign(own)).T


def whitening(samples: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """Matrix that transforms the functionals into variables of unit covariance.

    samples : (K, n) [m] functionals at K nodes, of mean zero by construction
    odd : (n, symmetries) 1 for a functional that changes sign under a symmetry of the surfaces, else 0. Functionals
        that differ in it are uncorrelated, and their sample correlation is ignored.

    Returns whiten : (n, n) [1/m], lower triangular. The columns of samples @ whiten.T have unit second moments and no
    mixed ones, except between functionals that differ in `odd`. Raises IllPosedError where a functional vanishes or
    depends on those before it.

    Method: inverse of the Cholesky factor of the correlation matrix; its diagonal is the independent part of each.
    """
    covariance = samples.T @ samples / len(samples) * np.all(odd[:, None] == odd, axis=2)
    scale = np.sqrt(np.diag(covariance))
    if not np.all(scale > 0):
        raise IllPosedError(
            f"the local functional {NAMES[np.argmin(scale)]} vanishes on {len(samples)} samples: take a wider strip",
            scene_keys="strip.width_m",
        )
    try:
        factor = scipy.linalg.cholesky(covariance / np.outer(scale, scale), lower=True)
    except np.linalg.LinAlgError:
        factor = np.zeros_like(covariance)
    if np.min(np.diag(factor)) <= INDEPENDENT:
        raise IllPosedError(
            f"the local functionals of {len(samples)} samples depend on each other: widen the strip or take more",
            scene_keys="strip.width_m, strip.training_samples",
        )
    return scipy.linalg.solve_triangular(factor, np.diag(1.0 / scale), lower=True)


@gate
def latin_hypercube(generator: np.random.Generator, samples: int, variables: int) -> np.ndarray:
    """Standard normals with exactly one sample in each of `samples` equally likely strata of every variable.

    samples, variables : both at least 1

    Returns xi : (samples, variables) [-]. Raises ParameterError.

    Method: McKay, Beckman and Conover, Technometrics 21 (1979) 239: the strata in random order, a random place in each.
    `scipy.stats.qmc.LatinHypercube` draws the places first, so its designs are others.
    """
    whole_at_least("samples", samples, 1)
    whole_at_least("variables", variables, 1)
    strata = np.stack([generator.permutation(samples) for _ in range(variables)], axis=1)
    return scipy.special.ndtri((strata + generator.random((samples, variables))) / samples)


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
