"""Textbook methods for the stages of the chain, correct and public, without what this project adds.

Modes: LAPACK on the whole matrix. Contact: conjugate gradients of Polonsky and Keer in numpy, each solve from a cold
start. Motion: scipy's Runge-Kutta pair with an event at the velocity of the belt.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.surface.covariance import Covariance
from workflow.benchmarks.contact_peers import PolonskyKeer, tune
from workflow.benchmarks.contact_problem import MODULUS, Judge, Problem
from workflow.benchmarks.oscillator import choose_slips, slip_by_roughslip, slip_by_scipy

METHOD = "RK45"  # solve_ivp's own choice
DEPARTED = 1e-3  # of tau: a Taylor step leaves the belt, where the event would occur at once
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)


@dataclass(frozen=True)
class PlainContact:
    """Cold starts of conjugate gradients on one mesh, to a residual.

    setting : the loosest tolerance of the solver at which a first problem met the residual
    """

    solver: PolonskyKeer
    setting: float

    @classmethod
    def of(cls, grid: Grid, interference: np.ndarray, tolerance: float) -> PlainContact:
        """Tune the solver on a first problem. interference : (nx, ny) [m]"""
        solver = PolonskyKeer(grid)
        found = tune(solver, Problem(grid, interference, 0.0), 0.0, tolerance, 5 * tolerance, Judge(grid))
        return cls(solver, found.setting)

    def solve(self, grid: Grid, interference: np.ndarray, plane_strain_modulus_pa: float) -> tuple[np.ndarray, int]:
        """Return the pressure (nx, ny) [Pa] and the number of products with B."""
        pressure, products = self.solver.solve(Problem(grid, interference, 0.0), 0.0, self.setting)
        return pressure * (plane_strain_modulus_pa / MODULUS), products


class Plain(NamedTuple):
    """A motion by scipy: cycles, evaluations of the right-hand side, and X [m] where the mass stuck again last."""

    cycles: int
    evaluations: int
    stuck_m: float


def simulate(
    belt: Oscillator,
    law: StribeckLaw,
    path: np.ndarray,
    spacing: float,
    periods: float,
    tolerance: float,
    start_position_m: float = 0.0,
) -> Plain:
    """Simulate a motion by scipy from rest on the belt, without excitation.

    path : (nodes,) mu_S at the slipped distances 0, spacing, ...
    spacing : [m]

    Stick lasts until the force reaches the static limit; slip is integrated until X' = V.
    """
    F, V, D, omega = belt.F, belt.V, belt.damping_ratio, belt.natural_frequency_rad_per_s
    scatter = CubicHermiteSpline(spacing * np.arange(len(path)), path, np.gradient(path, spacing))
    fit, decay, quadratic, static = law.fit, law.decay_s_per_m, law.quadratic_s2_per_m2, law.static

    def slope(_: float, y: np.ndarray) -> list[float]:
        v = omega * (V - y[1])
        mu = fit / (1 + decay * abs(v)) + static - fit + quadratic * v * v
        return [y[1], F * max(mu + float(scatter(y[2])), 0.0) - 2 * D * y[1] - y[0], V - y[1]]

    def at_belt(_: float, y: np.ndarray) -> float:
        return float(y[1] - V)

    at_belt.terminal, at_belt.direction = True, 1.0  # type: ignore[attr-defined]
    end, h = 2 * np.pi * periods, DEPARTED
    tau, x, s, cycles, evaluations = 0.0, start_position_m, 0.0, 0, 0
    while True:
        stuck = x
        spare = max(F * max(static + float(scatter(s)), 0.0) - x - 2 * D * V, 0.0)
        tau, x = tau + spare / V, x + spare
        if tau + h >= end:
            return Plain(cycles, evaluations, stuck)
        y = [x + V * h - V * h**3 / 6, V - V * h**2 / 2, s + V * h**3 / 6]
        found = solve_ivp(slope, (tau + h, end), y, METHOD, events=at_belt, rtol=tolerance, atol=tolerance * F)
        evaluations += found.nfev
        if not len(found.t_events[0]):
            return Plain(cycles, evaluations, stuck)
        cycles += bool((found.y[1] < 0.0).any())
        tau, (x, _, s) = float(found.t_events[0][0]), found.y_events[0][0]


def find_equal_tolerance(tolerance: float, nodes: int) -> tuple[float, float, float]:
    """Return the loosest of TOLERANCES where scipy's error of a slip on a path is at most ours at our tolerance.

    Returns it, our error and scipy's, relative to X of the reattachment by our pair of order 8 at 1e-13.
    """
    slip = choose_slips(nodes)[1]
    exact, *_ = slip_by_roughslip(slip, "dormand_prince853", 1e-13)
    error = abs(slip_by_roughslip(slip, "fehlberg45", tolerance)[0] / exact - 1.0)
    for one in TOLERANCES:
        plain = abs(slip_by_scipy(slip, METHOD, one)[0] / exact - 1.0)
        if plain <= error:
            break
    return one, error, plain


def dense_modes(covariance: Covariance, grid: Grid, order: int) -> np.ndarray:
    """Return the largest eigenvalues (order,), descending, by LAPACK on the whole matrix; vectors are computed too."""
    x, y = (axis.ravel() for axis in np.meshgrid(grid.x(), grid.y(), indexing="ij"))
    matrix = covariance(np.subtract.outer(x, x), np.subtract.outer(y, y))
    values, _ = scipy.linalg.eigh(matrix, subset_by_index=[grid.size - order, grid.size - 1], overwrite_a=True)
    return values[::-1]
