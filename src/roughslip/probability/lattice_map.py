"""A probability at all nodes of a plane lattice, from its values at few nodes: those are added where it changes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.special import ndtr, ndtri

from roughslip.errors import ParameterError

START = 4  # nodes along either axis of the coarse lattice at the beginning
LEAST = 0.01  # probabilities p enter the spline as LEAST + (1 - 2 LEAST) p, whose quantiles are finite
FLAT = 1e-3  # variance of an outcome that nodes have where the probability is 0 or 1, so that none is never added


@dataclass(frozen=True)
class LatticeMap:
    """The probability at the nodes of a lattice.

    probability : (points, points) [-] computed, or of the spline
    is_computed : (points, points)
    prediction_error : [-] mean error of the spline at the last third of the added nodes, before they were computed
    """

    probability: np.ndarray
    is_computed: np.ndarray
    prediction_error: float


def lattice_map(probability: Callable[[int, int], float], points: int, computed: int) -> LatticeMap:
    """The probability at points x points nodes, computed at as many as asked.

    probability : at a node, by its two indices [-], 0 to 1; the same random numbers should serve all nodes
    points : nodes along either axis
    computed : nodes at which it is computed, at least START^2 and at most all

    Raises ParameterError for numbers out of range.

    Method: a thin-plate spline through the quantiles of the normal distribution at the values. The next node is where
    its distance to the nearest computed one times the standard deviation of one outcome, sqrt(p (1 - p)), is largest.
    """
    if points < START or not START**2 <= computed <= points**2:
        raise ParameterError(
            f"a map of {points} x {points} nodes, at least {START} x {START}, is computed at {START**2} to {points**2} "
            f"of them, not at {computed}; scene key: map.points"
        )
    nodes = np.stack(np.divmod(np.arange(points**2), points), axis=1)
    place = nodes / (points - 1)
    lines = np.round(np.linspace(0, points - 1, START)).astype(int)
    known = [int(i * points + j) for i in lines for j in lines]
    values = [probability(*nodes[node].tolist()) for node in known]
    distance = np.min(np.linalg.norm(place[:, None] - place[known], axis=-1), axis=1)
    errors: list[float] = []
    spline = _spline(place, known, values)
    while len(known) < computed:
        node = int(np.argmax(distance * np.sqrt(spline * (1.0 - spline) + FLAT)))
        value = probability(*nodes[node].tolist())
        errors.append(abs(value - float(spline[node])))
        known.append(node)
        values.append(value)
        distance = np.minimum(distance, np.linalg.norm(place - place[node], axis=1))
        spline = _spline(place, known, values)
    spline[known] = values
    is_computed = np.zeros(points**2, dtype=bool)
    is_computed[known] = True
    last = errors[-(len(errors) // 3 + 1) :]
    shape = points, points
    return LatticeMap(spline.reshape(shape), is_computed.reshape(shape), float(np.mean(last)) if last else 0.0)


def _spline(place: np.ndarray, known: list[int], values: list[float]) -> np.ndarray:
    """(nodes,) the spline at all nodes through the values at the known ones."""
    quantiles = ndtri(LEAST + (1.0 - 2.0 * LEAST) * np.array(values))
    spline = RBFInterpolator(place[known], quantiles, kernel="thin_plate_spline")
    return np.clip((ndtr(spline(place)) - LEAST) / (1.0 - 2.0 * LEAST), 0.0, 1.0)
