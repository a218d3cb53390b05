"""Responses as functions of one standard normal index, at many nodes at once.

A link is linear between knots and beyond them. Its values at the knots are its coefficients, fitted by least squares,
and as the law of the index is known, so are its mean and its Hermite coefficients, by quadrature, without draws.

As a control variate it gives expectations that cost no bias: with h the link fitted without sample k,

    E f = mean_k [ f_k - h_k(t_k) + E h_k ],

each term of which has the expectation of f whatever h is (Lavenberg and Welch, Manage. Sci. 27 (1981) 322, here with
each sample left out of its own control).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri

from roughslip.chaos.hermite import hermite_polynomials
from roughslip.chaos.regression import LEAST_FREEDOM, WORST_CONDITION
from roughslip.errors import IllPosedError, ParameterError
from roughslip.limits import FIELD_SAMPLES as LEAST_SAMPLES

# Share of Var p missed at left-out surfaces of the resolved square (percentile 50, 2000 samples): 0.137, 0.119, 0.119
# and 0.119 with 6, 10, 16 and 20 knots, of the contact 0.287, 0.258, 0.256 and 0.256.
KNOTS = 17  # at most, and no more than one for PER_KNOT samples
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
    """What a link gives as a control variate.

    mean : (responses, nodes)
    deviation : (responses, K, nodes) of each sample's contribution from the mean: mean square / K is the variance of it
    """

    mean: np.ndarray
    deviation: np.ndarray


def knots_for(samples: int) -> np.ndarray:
    """Places of the index, equally spaced, with TAIL of so many samples beyond the last on either side.

    Raises IllPosedError for fewer than LEAST_SAMPLES samples.
    """
    if samples < LEAST_SAMPLES:
        raise IllPosedError(f"{samples} samples are too few for a link; {LEAST_SAMPLES} are needed: take more samples")
    last = ndtri(1.0 - TAIL / samples)
    return np.linspace(-last, last, min(KNOTS, samples // PER_KNOT))


def cells(knots: np.ndarray, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The knot below each index, and how far it lies towards the next, beyond [0, 1] outside of the knots.

    knots : equally spaced
    """
    place = (index - knots[0]) / (knots[1] - knots[0])
    cell = np.clip(np.floor(place), 0, len(knots) - 2).astype(np.int64)
    return cell, place - cell


@cache
def hermite_moments(knots: tuple[float, ...], degree: int) -> np.ndarray:
    """E[hat_l(t) He_n(t)] / sqrt(n!) : (degree + 1, L) for the functions that are 1 at one knot and 0 at the others.

    Midpoint rule; between knots the error falls as the square of the step, 6e-6 of a hat's second difference.
    """
    t = (np.arange(STEPS) + 0.5) * (2 * REACH / STEPS) - REACH
    density = np.exp(-0.5 * t**2) / np.sqrt(2 * np.pi) * (2 * REACH / STEPS)
    cell, share = cells(np.array(knots), t)
    hats = np.zeros((STEPS, len(knots)))
    rows = np.arange(STEPS)
    hats[rows, cell], hats[rows, cell + 1] = 1.0 - share, share
    return np.asarray((hermite_polynomials(t, degree) * density) @ hats)


def fit_link(index: np.ndarray, responses: np.ndarray, knots: np.ndarray) -> tuple[Link, Control]:
    """Links of responses to an index, node by node, and the expectations of the responses with them as controls.

    index : (K, nodes) standard normal, of each sample as predicted without it
    responses : (R, K, nodes)
    knots : from `knots_for`

    Raises ParameterError for shapes that do not match or numbers that are not finite; IllPosedError where the samples
    do not determine a link, or one of them a value of it.
    """
    if index.ndim != 2 or responses.shape[1:] != index.shape:
        raise ParameterError(f"responses {responses.shape} do not match indices {index.shape}")
    if not (np.isfinite(index).all() and np.isfinite(responses).all()):
        raise ParameterError("indices and responses must be finite")
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
        raise IllPosedError("between two knots a link is undetermined: take more samples")
    inverse = np.linalg.inv(gram)
    sides = np.stack([hats(values) for values in responses])
    link = Link(knots, np.einsum("nij,rjn->rin", inverse, sides))
    moments = hermite_moments(tuple(knots), 0)[0]
    node = np.arange(nodes)
    low, corner, high = (inverse[node, cell + i, cell + j] for i, j in ((0, 0), (0, 1), (1, 1)))
    freedom = 1.0 - ((1.0 - share) ** 2 * low + 2 * share * (1.0 - share) * corner + share**2 * high)
    if np.min(freedom) < LEAST_FREEDOM:
        raise IllPosedError("a single sample determines a value of a link: take more samples")
    left_out = (responses - link(index)) / freedom
    towards = (inverse @ moments).T
    moved = (1.0 - share) * towards[cell, node] + share * towards[cell + 1, node]
    deviation = left_out * (1.0 - moved)  # E h_k = E h - moved * left_out
    shift = deviation.mean(axis=1)
    mean = np.einsum("l,rln->rn", moments, link.values) + shift
    return link, Control(mean, deviation - shift[:, None])
