"""The cheapest change of a few parameters that is acceptable, on rays of equal shares of the cost.

The change of parameter i is u_i = log(value / own), and its cost w_i |u_i|. A ray has fixed shares of the cost, so that
the cost grows along it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from roughslip.errors import ParameterError

DIVISIONS = {1: 1, 2: 8, 3: 4}  # of the cost at the first rays, by the number of parameters
HALVINGS = 4  # of the division, around the best ray
MOVES = 8  # from a ray to a cheaper neighbour, at most, at one division
ACCURACY = 1e-3  # of the cost along a ray, relative to the cost at the end of its range

Acceptable = Callable[[np.ndarray], bool]


def cheapest_change(
    acceptable: Acceptable, weights: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, float] | None:
    """The cheapest acceptable change of one to three parameters.

    acceptable : of a change u : (parameters,) [-]
    weights : (parameters,) w > 0
    low, high : (parameters,) [-] range of u, with low <= 0 <= high

    Returns the direction : (parameters,) [-], whose cost is 1, and the cost; the change is their product. None where
    no ray reaches an acceptable change. Raises ParameterError for other numbers or ranges.

    Method: the first rays have costs in multiples of 1 / DIVISIONS. A ray is bisected if its end, or its point at the
    least cost so far, is acceptable. Then rays around the best one halve the division. So a ray that is acceptable only
    between two points that are not may be missed.
    """
    if weights.size not in DIVISIONS or np.any(weights <= 0.0) or np.any(low > 0.0) or np.any(high < 0.0):
        raise ParameterError("one to three parameters, positive weights, and ranges that hold the present values")
    if acceptable(np.zeros(weights.size)):
        return np.zeros(weights.size), 0.0
    best: tuple[tuple[int, ...], float] | None = None
    divisions = DIVISIONS[weights.size]

    def cost_on(ray: tuple[int, ...]) -> float | None:
        """The least acceptable cost on a ray, None where it is not below that of the best one."""
        direction = np.array(ray) / (divisions * weights)
        end = cost_at_end(direction, low, high)
        reach = min(end, math.inf if best is None else best[1] - ACCURACY * end)
        return None if reach <= 0.0 else root_on(acceptable, direction, reach, ACCURACY * end)

    for ray in rays(weights.size, divisions):
        cost = cost_on(ray)
        best = best if cost is None else (ray, cost)
    if best is None:
        return None
    for _ in range(HALVINGS if weights.size > 1 else 0):
        divisions *= 2
        best = tuple(2 * part for part in best[0]), best[1]
        for _ in range(MOVES):
            before = best
            for ray in neighbours(before[0]):
                cost = cost_on(ray)
                best = best if cost is None else (ray, cost)
            if best is before:
                break
    return np.array(best[0]) / (divisions * weights), best[1]


def cost_at_end(direction: np.ndarray, low: np.ndarray, high: np.ndarray) -> float:
    """The cost at which a ray leaves the ranges."""
    moved = direction != 0.0
    ends = np.where(direction > 0.0, high, low)[moved] / direction[moved]
    return float(np.min(ends))


def root_on(acceptable: Acceptable, direction: np.ndarray, reach: float, accuracy: float) -> float | None:
    """The least acceptable cost on a ray, from above, by bisection below `reach`; None where that is not acceptable."""
    if not acceptable(reach * direction):
        return None
    refused, accepted = 0.0, reach
    while accepted - refused > accuracy:
        middle = 0.5 * (refused + accepted)
        refused, accepted = (refused, middle) if acceptable(middle * direction) else (middle, accepted)
    return accepted


def rays(parameters: int, divisions: int) -> list[tuple[int, ...]]:
    """Whole numbers whose absolute values sum to the division, those that change the fewest parameters first."""
    every = itertools.product(range(-divisions, divisions + 1), repeat=parameters)
    found = (ray for ray in every if sum(map(abs, ray)) == divisions)
    return sorted(found, key=lambda ray: (sum(part != 0 for part in ray), ray))


def neighbours(ray: tuple[int, ...]) -> Iterator[tuple[int, ...]]:
    """Rays to which one unit of cost goes from one parameter to another."""
    for source, target in itertools.permutations(range(len(ray)), 2):
        if ray[source] == 0:
            continue
        for sign in (-1, 1) if ray[target] == 0 else (int(math.copysign(1, ray[target])),):
            moved = list(ray)
            moved[source] -= int(math.copysign(1, ray[source]))
            moved[target] += sign
            yield tuple(moved)
