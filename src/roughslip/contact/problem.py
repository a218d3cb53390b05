"""The contact problem of a mesh, and pressures that are allowed in it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from roughslip.contact import kernels
from roughslip.contact.influence import Influence


@dataclass(frozen=True)
class Problem:
    """Find 0 <= p <= cap of least energy p'Bp/2 - p'u_bar; with a sum of pressures, among those of that sum.

    influence : B of the mesh
    interference : (nx, ny) [m] u_bar; finite, and positive somewhere unless a sum is given
    cap : highest pressure [Pa], or infinity
    pressure_sum : sum of p over the nodes [Pa], which is the force over the area of a cell; None for a fixed plane
    """

    influence: Influence
    interference: np.ndarray
    cap: float = math.inf
    pressure_sum: float | None = None

    @cached_property
    def scale(self) -> float:
        """The scale of residuals [m] at a given plane, ||max(u_bar, 0)||."""
        return math.sqrt(kernels.positive_square(self.interference, 0.0))


def plane_at_bounds(pressure: np.ndarray, gap: np.ndarray) -> float:
    """Height [m] of a plane that reaches the pressed nodes, all at the cap, and no others.

    NaN where none is pressed, as the load is lost in the rounding of the heights.
    """
    pressed = pressure > 0
    if not pressed.any():
        return math.nan
    return -float(gap[pressed].max() if pressed.all() else (gap[pressed].max() + gap[~pressed].min()) / 2)


def shifted(pressure: np.ndarray, nodes: np.ndarray, cap: float, pressure_sum: float) -> np.ndarray | None:
    """Pressures shifted at the nodes, where they are positive, until the sum is as wanted; None where it cannot be.

    Elsewhere pressures are zero or the cap.
    """
    trial = np.where(nodes | (pressure == 0), pressure, np.inf)
    shift, met = kernels.shift_to_sum(trial, cap, pressure_sum, False)
    return np.where(nodes, np.minimum(np.maximum(pressure + shift, 0.0), cap), pressure) if met else None


def with_sum(problem: Problem, pressure: np.ndarray, nodes: np.ndarray) -> np.ndarray:
    """Pressures of the given sum: shifted at the nodes, or the allowed ones nearest, where these cannot carry it."""
    if problem.pressure_sum is None:
        return pressure
    moved = shifted(pressure, nodes, problem.cap, problem.pressure_sum)
    return nearest(problem, pressure) if moved is None else moved


def nearest(problem: Problem, trial: np.ndarray) -> np.ndarray:
    """The allowed pressures nearest to a trial."""
    shift = 0.0
    if problem.pressure_sum is not None:
        shift, _ = kernels.shift_to_sum(trial, problem.cap, problem.pressure_sum, True)
    return np.minimum(np.maximum(trial + shift, 0.0), problem.cap)
