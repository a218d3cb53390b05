"""Responses as functions of one standard normal index, at many nodes at once.

A link is linear between knots and outside them. Its values at the knots are its coefficients, fitted by least squares.
The distribution of the index is known, so the mean and the Hermite coefficients of a link follow by quadrature.

A link is also a control variate. With h the link fitted without sample k,

    E f = mean_k [ f_k - h_k(t_k) + E h_k ],

each term of which has the expectation of f for any h (Lavenberg and Welch, Manage. Sci. 27 (1981) 322; here each sample
is left out of its own control).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from roughslip.chaos.hermite import hermite_polynomials
from roughslip.chaos.regression import LEAST_FREEDOM, WORST_CONDITION
from roughslip.chaos.remedies import MORE_SURFACES
from roughslip.errors import IllPosedError, ParameterError
from roughslip.limits import FIELD_SAMPLES as LEAST_SAMPLES
from roughslip.validation import finite

# With 6, 10, 16 and 20 knots, left-out surfaces of the resolved square (percentile 50, 2000 samples) miss 0.137, 0.119,
# 0.119 and 0.119 of Var p, and 0.287, 0.258, 0.256 and 0.256 of the variance of contact.
KNOTS = 17  # at most, and at most one per PER_KNOT samples
PER_KNOT = 25
TAIL = 20  # samples beyond the last knot on either side
REACH, STEPS = 10.0, 8000  # of the quadrature: the normal density is 1e-23 at its ends


@dataclass(frozen=True)
class Link:
    """Functions of a standard normal index.

    knots : (L,) ascending
    values : (responses, L, nodes) of each function at the knots
    """

    knots: np.ndarray
    values: np.ndarray

    def __call__(self, index: np.ndarray) -> np.ndarray:
        """The functions : (responses, ..., nodes) at the index : (..., nodes)."""
        cell, share = cells(self.knots, index)
        node = np.arange(index.shape[-1])
        return (1.0 - share) * self.values[:, cell, node] + share * self.values[:, cell + 1, node]

    def hermite(self, degree: int) -> np.ndarray:
        """Coefficients : (responses, degree + 1, nodes) in He_n / sqrt(n!), n = 0 the means."""
        return np.einsum("dl,rln->rdn", hermite_moments(tuple(self.knots), degree), self.values)


class Control(NamedTuple):
    """Expectations with a link as control variate.

    mean : (responses, nodes)
    deviation : (responses, K, nodes) deviation of each sample's contribution from the mean, whose variance is the mean
        square of these over K
    """

    mean: np.ndarray
    deviation: np.ndarray


def knots_for(samples: int) -> np.ndarray:
    """Equally spaced knots, with TAIL of the samples expected outside the last knot on either side.

    Raises IllPosedError for fewer than LEAST_SAMPLES samples.
    """
    if samples < LEAST_SAMPLES:
        raise IllPosedError(f"{samples} samples are too few for a link, which takes {LEAST_SAMPLES}: {MORE_SURFACES}")
    last = ndtri(1.0 - TAIL / samples)
    return np.linspace(-last, last, min(KNOTS, samples // PER_KNOT))


def cells(knots: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The knot below each index, and its relative distance to the next, outside [0, 1] beyond the knots.

    knots : equally spaced
    """
    place = (index - knots[0]) / (knots[1] - knots[0])
    cell = np.clip(np.floor(place), 0, len(knots) - 2).astype(np.int64)
    return cell, place - cell


@cache
def hermite_moments(knots: tuple[float, ...], degree: int) -> np.ndarray:
    """E[hat_l(t) He_n(t)] / sqrt(n!) : (degree + 1, L) for hat functions, which are 1 at one knot and 0 at the others.

    Midpoint rule. The error falls as the square of the step; it is 6e-6 of the second difference of a hat.
    """
    t = (np.arange(STEPS) + 0.5) * (2 * REACH / STEPS) - REACH
    density = np.exp(-0.5 * t**2) / np.sqrt(2 * np.pi) * (2 * REACH / STEPS)
    cell, share = cells(np.array(knots), t)
    hats = np.zeros((STEPS, len(knots)))
    rows = np.arange(STEPS)
    hats[rows, cell], hats[rows, cell + 1] = 1.0 - share, share
    return np.asarray((hermite_polynomials(t, degree) * density) @ hats)


def fit_link(index: np.ndarray, responses: np.ndarray, knots: np.ndarray) -> tuple[Link, Control]:
    """Links of responses to an index, node by node, and expectations of the responses with the links as controls.

    index : (K, nodes) standard normal, predicted for each sample from the others
    responses : (R, K, nodes)
    knots : from `knots_for`

    Raises ParameterError for shapes that do not match or numbers that are not finite. Raises IllPosedError where the
    samples do not determine a link, or a single sample determines one of its values.
    """
    if index.ndim != 2 or responses.shape[1:] != index.shape:
        raise ParameterError(f"responses {responses.shape} do not match indices {index.shape}")
    index, responses = finite("index", index), finite("responses", responses)
    nodes, size = index.shape[1], len(knots)
    cell, share = cells(knots, index)
    here = cell * nodes + np.arange(nodes)

    def total(weights: np.ndarray) -> np.ndarray:
        """Sums : (L, nodes) over samples, each at the knot below it."""
        return np.bincount(here.ravel(), weights.ravel(), size * nodes).reshape(size, nodes)

    def hats(values: np.ndarray) -> np.ndarray:
        return total((1.0 - share) * values) + np.roll(total(share * values), 1, axis=0)

    gram = np.zeros((nodes, size, size))
    every, after = np.arange(size), np.arange(1, size)
    gram[:, every, every] = (total((1.0 - share) ** 2) + np.roll(total(share**2), 1, axis=0)).T
    gram[:, every[:-1], after] = gram[:, after, every[:-1]] = total(share * (1.0 - share))[:-1].T
    extreme = np.linalg.eigvalsh(gram)
    if not np.all(extreme[:, 0] * WORST_CONDITION > extreme[:, -1]):
        raise IllPosedError(f"between two of {size} knots a link is undetermined: {MORE_SURFACES}")
    inverse = np.linalg.inv(gram)
    sides = np.stack([hats(values) for values in responses])
    link = Link(knots, np.einsum("nij,rjn->rin", inverse, sides))
    moments = hermite_moments(tuple(knots), 0)[0]
    node = np.arange(nodes)
    low, corner, high = (inverse[node, cell + i, cell + j] for i, j in ((0, 0), (0, 1), (1, 1)))
    freedom = 1.0 - ((1.0 - share) ** 2 * low + 2 * share * (1.0 - share) * corner + share**2 * high)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError(f"a single one of {len(index)} samples determines a value of a link: {MORE_SURFACES}")
    left_out = (responses - link(index)) / freedom
    towards = (inverse @ moments).T
    moved = (1.0 - share) * towards[cell, node] + share * towards[cell + 1, node]
    deviation = left_out * (1.0 - moved)  # E h_k = E h - moved * left_out
    shift = deviation.mean(axis=1)
    mean = np.einsum("l,rln->rn", moments, link.values) + shift
    return link, Control(mean, deviation - shift[:, None])


def sensitivity_along(direction: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sobol' indices of the normal variables xi for functions sum_n h_n He_n(d xi) / sqrt(n!), one per node.

    direction : (M, nodes) d, unit vectors
    coefficients : (degree + 1, nodes) h

    Returns first, total : (M, nodes) [-]. Raises ParameterError for shapes that do not match or directions that are not
    of unit length, IllPosedError for a constant.

    Method: as `hermite.sobol_indices` with one variable. The share d_j^(2n) of h_n^2 is due to xi_j alone, and the
    share (1 - d_j^2)^n does not contain xi_j. For a set of modes, d_j^2 is the sum over the set.
    """
    if coefficients.ndim != 2 or direction.shape[1:] != coefficients.shape[1:]:
        raise ParameterError(f"directions {direction.shape} do not match coefficients {coefficients.shape}")
    squares = direction**2
    if not np.allclose(squares.sum(axis=0), 1.0, atol=1e-9):
        raise ParameterError("directions must be of unit length")
    return _shares(squares, coefficients)


def share_of_modes(direction: np.ndarray, coefficients: np.ndarray, modes: int) -> np.ndarray:
    """Share : (nodes,) [-] of the variance that the leading modes explain; arguments as `sensitivity_along`."""
    return _shares(np.sum(direction[:modes] ** 2, axis=0, keepdims=True), coefficients)[0][0]


def _shares(squares: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    variance = np.sum(coefficients[1:] ** 2, axis=0)
    if not np.all(variance > 0):
        raise IllPosedError("the expansion is constant, without a variance to share: take one that varies")
    first, without = np.zeros(squares.shape), np.zeros(squares.shape)
    for h in coefficients[:0:-1]:  # Horner
        first, without = squares * (h**2 + first), (1.0 - squares) * (h**2 + without)
    return first / variance, 1.0 - without / variance
