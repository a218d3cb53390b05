"""Slip phases of the oscillator benchmark by diffrax, compiled for the CPU and vectorised over many slips.

A call solves LANES slips from one start in one thread, until an event at X' = V that its root finder locates. Steps do
not end at the nodes of a path, because diffrax has no input for them.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.system import Oscillator

SOLVERS = ("Tsit5", "Dopri8")
LANES = 256
OFF = 1e-3  # of tau: a Taylor step leaves the belt, where the event would occur at once
LONGEST, MOST_STEPS = 9.0, 100_000
SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


def taylor_start(start: float, V: float) -> tuple[float, float, float]:
    """Return X, X' and slipped distance at tau = OFF after a departure at X = start, where X'' = 0 and X''' = -V."""
    return start + V * OFF - V * OFF**3 / 6, V - V * OFF**2 / 2, V * OFF**3 / 6


@cache
def _modules() -> tuple[Any, Any, Any]:
    """Import jax in double precision and one thread, diffrax and optimistix; the first import reads the environment."""
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {SINGLE_THREAD}".strip()
    import diffrax
    import jax
    import optimistix

    jax.config.update("jax_enable_x64", True)
    return jax, diffrax, optimistix


def slips_by_diffrax(
    oscillator: Oscillator, law: StribeckLaw, path: np.ndarray | None, spacing: float, start: float, solver: str,
    lanes: int = LANES,
) -> Callable[[float], tuple[float, int, int]]:  # fmt: skip
    """Return a function of the tolerance: X at the reattachment, evaluations of all slips, and their number."""
    jax, diffrax, optimistix = _modules()
    F, V, D, omega = oscillator.F, oscillator.V, oscillator.damping_ratio, oscillator.natural_frequency_rad_per_s
    fit, decay, quadratic, rest = law.fit, law.decay_s_per_m, law.quadratic_s2_per_m2, law.static
    coefficients = None
    if path is not None:
        grid = spacing * np.arange(len(path))
        coefficients = jax.numpy.asarray(CubicHermiteSpline(grid, path, np.gradient(path, spacing)).c.T)

    def mu_s(s: Any) -> Any:
        if coefficients is None:
            return 0.0
        piece = jax.numpy.clip((s / spacing).astype(int), 0, len(coefficients) - 1)
        c, t = coefficients[piece], s - piece * spacing
        return c[3] + t * (c[2] + t * (c[1] + t * c[0]))

    def slope(t: Any, y: Any, args: Any) -> Any:
        x, u, s = y
        v = omega * (V - u)
        mu = fit / (1 + decay * v) + rest - fit + quadratic * v * v
        return u, F * jax.numpy.maximum(mu + mu_s(s), 0.0) - 2 * D * u - x, V - u

    def at_belt(t: Any, y: Any, args: Any, **_: Any) -> Any:
        return y[1] - V

    def slip(y: Any, tolerance: Any) -> Any:
        found = diffrax.diffeqsolve(
            diffrax.ODETerm(slope),
            getattr(diffrax, solver)(),
            OFF,
            LONGEST,
            OFF,
            y,
            stepsize_controller=diffrax.PIDController(rtol=tolerance, atol=tolerance * F),
            event=diffrax.Event(at_belt, optimistix.Newton(tolerance, tolerance * V)),
            max_steps=MOST_STEPS,
        )
        return found.ys[0][-1], found.stats["num_steps"]

    every = jax.jit(jax.vmap(slip, in_axes=(0, None)))
    y = tuple(jax.numpy.full(lanes, value) for value in taylor_start(start, V))
    stages = len(getattr(diffrax, solver).tableau.b_sol)

    def call(tolerance: float) -> tuple[float, int, int]:
        x, steps = jax.block_until_ready(every(y, tolerance))
        return float(x[0]), lanes * stages * int(steps[0]), lanes

    return call
