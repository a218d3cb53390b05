"""Further variables of an expansion: directions in which what it leaves unexplained still varies.

Let r be the residual of an expansion in the variables u, and q other standard normal variables, independent of u. By
Stein's identity the terms of r that hold q at all, linear in q or of second degree in it,

    r ~ sum_a psi_a(u) g_a'q + q'Hq / 2,    g_a = E[r psi_a(u) q],    H = E[r (q q' - I)],

have the gradient sum_a psi_a(u) g_a + Hq, whose mean outer product is sum_a g_a g_a' + H^2: its leading eigenvectors
are the directions along which r varies most. With psi = 1 alone and the target for r, g is the regression direction (Li
and Duan, Ann. Stat. 17 (1989) 1009), and H gives the principal Hessian directions (Li, J. Am. Stat. Assoc. 87 (1992)
1025); the mean outer product is that of Constantine, Dow and Wang (SIAM J. Sci. Comput. 36 (2014) A1500).

Means over K surfaces err by 1 / sqrt(K), and so many entries have large singular values by chance. How large is seen
where surfaces count with random signs: directions that do not exceed that are not offered.
"""

from __future__ import annotations

import numpy as np

from roughslip.errors import IllPosedError, ParameterError

VARIANCE = 1e-3  # of the largest, that a direction of the frame has at least: weaker ones carry nothing but noise
ALIGNED = 0.1  # least part of it that each node sees: below, nodes do not share a frame
BLOCKS = 256  # of surfaces, each with one sign
LEAST_SURFACES = 40  # of which 2^40 signs tell more than 95 % apart
REPLICATES = 400  # of the signs: the quantile lies between the 93 and 97 % ones
QUANTILE = 0.95


def moving_frame(functionals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Variables that several nodes share, besides those in use, from functionals that move with the node.

    functionals : (nodes, n, M) of M independent standard normals, such as heights at the same offsets from every node
    directions : (nodes, v, M) orthonormal rows, the variables in use

    Returns frame : (nodes, m, M) orthonormal rows at every node and orthogonal to the directions there: principal
    components of what the functionals have left, in the mean over the nodes, turned at each node as little as makes
    them orthonormal. There are none where nothing is left. Raises ParameterError for arrays that do not match or are
    not finite; IllPosedError where a node hardly sees one of them.

    Method: the orthogonal factor of the polar decomposition is the nearest orthonormal frame (Fan and Hoffman, Proc.
    Am. Math. Soc. 6 (1955) 111).
    """
    shape = directions.shape[0], directions.shape[-1]
    if functionals.ndim != 3 or directions.ndim != 3 or (functionals.shape[0], functionals.shape[2]) != shape:
        raise ParameterError(f"functionals {functionals.shape} do not match directions {directions.shape}")
    if not (np.isfinite(functionals).all() and np.isfinite(directions).all()):
        raise ParameterError("functionals and directions must be finite")
    rest = functionals
    for _ in range(2):  # twice is enough, as in orthonormal_directions
        rest = rest - (rest @ directions.transpose(0, 2, 1)) @ directions
    variance, components = np.linalg.eigh(np.mean(rest @ rest.transpose(0, 2, 1), axis=0))
    whole = np.mean(np.einsum("knm,knm->kn", functionals, functionals))
    kept = np.flatnonzero(variance > VARIANCE * max(variance[-1], whole))[::-1]
    scaled = (components[:, kept] / np.sqrt(variance[kept])).T @ rest
    left, length, right = np.linalg.svd(scaled, full_matrices=False)
    if length.size and np.min(length) < ALIGNED:
        raise IllPosedError(
            "the surface around one training node has little in common with that around another: take no more "
            f"variables than the {directions.shape[1]} local functionals"
        )
    return left @ right


def residual_directions(
    residual: np.ndarray, variables: np.ndarray, frame: np.ndarray, generator: np.random.Generator
) -> tuple[np.ndarray, int]:
    """Directions along which a residual varies, the most important first, and along how many by more than chance.

    residual : (K, nodes) of an expansion in the variables, at K independent surfaces
    variables : (K, nodes, v) [-] in use
    frame : (K, nodes, n) [-] standard normal variables independent of them
    generator : of the signs

    Returns directions : (n, n) orthonormal rows, and the number of those before one of chance: the root mean square of
    the gradient along each is above the largest that random signs of the surfaces leave in 95 of 100 cases. Raises
    ParameterError for arrays that do not match or are not finite; IllPosedError for fewer than LEAST_SURFACES surfaces.

    Method: random signs as in the wild bootstrap (Mammen, Ann. Stat. 21 (1993) 255), less the mean.
    """
    if variables.shape[:2] != residual.shape or frame.shape[:2] != residual.shape or residual.ndim != 2:
        raise ParameterError(
            f"residuals {residual.shape}, variables {variables.shape} and a frame {frame.shape} do not match"
        )
    if not all(np.isfinite(part).all() for part in (residual, variables, frame)):
        raise ParameterError("residuals and variables must be finite")
    surfaces, nodes = residual.shape
    if surfaces < LEAST_SURFACES:
        raise IllPosedError(
            f"{surfaces} surfaces are too few to tell a direction from noise, for which {LEAST_SURFACES} are needed: "
            "take more samples, or no more variables than local functionals"
        )
    n = frame.shape[2]
    if n == 0:  # every variable is in use
        return np.empty((0, 0)), 0
    blocks = min(BLOCKS, surfaces)
    shares = np.stack(
        [_gradients(*(part[number::blocks] for part in (residual, variables, frame))) for number in range(blocks)]
    ) / (surfaces * nodes)
    _, strength, right = np.linalg.svd(shares.sum(axis=0), full_matrices=False)
    signs = generator.choice([-1.0, 1.0], (REPLICATES, blocks))
    chance = np.tensordot(signs, shares - shares.mean(axis=0), axes=1)
    largest = np.linalg.norm(chance, ord=2, axis=(1, 2))
    return right, int(np.sum(strength > np.quantile(largest, QUANTILE)))


def _gradients(residual: np.ndarray, variables: np.ndarray, frame: np.ndarray) -> np.ndarray:
    """g_a' for the constant and each of the variables, and H below : (1 + v + n, n), summed over the samples."""
    q = frame.reshape(-1, frame.shape[2])
    r = residual.reshape(-1, 1)
    terms = np.column_stack([np.ones(len(q)), variables.reshape(len(q), -1), q])
    found = (r * terms).T @ q
    found[-q.shape[1] :] -= np.sum(r) * np.eye(q.shape[1])
    return found
