"""Measure the mass on the belt: time of a cycle against the error of the reattachment point, with public solvers.

Cycles start at the departure point of the study's oscillator, without scatter and on a friction path. One process, one
thread, in turns; `--peers` adds diffrax. Errors are relative to X of our reattachment at a tolerance of 1e-13.
"""

import os
from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from roughslip.friction.endless import recursion
from roughslip.friction.process import FrictionProcess
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.laws import StribeckLaw
from roughslip.oscillator.motion import Motion, MotionOptions, simulate
from roughslip.oscillator.runge_kutta import NODES as STAGES
from roughslip.probability import BetaDistribution
from workflow.benchmarks.rows import OURS, Row, case, make_row, power, race, write

STUDY, LAW = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
F, V, D = STUDY.F, STUDY.V, STUDY.damping_ratio
PROCESS = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.05), 2.5e-4)
SEED = 20110914
NODES = 8  # of a correlation length of the friction path
BETWEEN = 0.3  # of a tolerance: a further tolerance of our methods, for an error near that of each peer
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)

PEERS = ("RK45", "DOP853")  # of scipy
SOLVERS = ("Tsit5", "Dopri8")  # of diffrax
LANES = 256  # slips that diffrax solves at a time
OFF = 1e-3  # of tau: a Taylor step leaves the belt, where the event would occur at once
LONGEST, MOST_STEPS = 9.0, 100_000
SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"

Found = tuple[float, int, int]  # X of the first reattachment, evaluations of all cycles, and the number of cycles


class Slip(NamedTuple):
    """One slip phase from the departure point, and natural periods of our motion, so many that a call costs nothing.

    path : (nodes,) mu_S over the slipped distance at this spacing [m], zero without scatter
    """

    name: str
    path: np.ndarray
    spacing: float
    periods: float

    @property
    def start(self) -> float:
        """[m] X at departure."""
        return STUDY.F * (LAW.static + float(self.path[0])) - 2 * STUDY.damping_ratio * STUDY.V

    @property
    def scatter(self) -> CubicHermiteSpline | None:
        """mu_S over the slipped distance, as our code interpolates its nodes; None without scatter."""
        x = self.spacing * np.arange(len(self.path))
        return CubicHermiteSpline(x, self.path, np.gradient(self.path, self.spacing)) if self.path.any() else None


def choose_slips() -> tuple[Slip, Slip]:
    """Return the slip without scatter, and the first ordinary slip on a path.

    Ordinary: friction falls as slip begins, and the mass sticks again after it has moved backwards.
    """
    paths = recursion(PROCESS, PROCESS.correlation_length_m / NODES)
    for number in range(1000):
        pieces = iter(paths.realisation([SEED, number]))
        path = np.concatenate([next(pieces) for _ in range(4)])
        slip = Slip(f"path-of-{NODES}-nodes", path, paths.spacing, 20.0)
        if path[1] < path[0] and simulate_slip(slip, 1e-6).backwards[1]:
            return Slip("deterministic", np.zeros(2), 0.0, 1000.0), slip
    raise AssertionError("no path of a thousand has an ordinary slip")


def simulate_slip(slip: Slip, tolerance: float) -> Motion:
    """Return our motion over the slip and the cycles that follow."""
    path = slip.path if slip.path.any() else None
    return simulate(STUDY, LAW, path, slip.spacing, slip.periods, MotionOptions(tolerance), slip.start)


def slip_by_roughslip(slip: Slip, tolerance: float) -> Found:
    """Return X, evaluations and cycles of our motion."""
    motion = simulate_slip(slip, tolerance)
    return float(motion.position[motion.kind == REATTACHMENT][0]), len(STAGES) * motion.steps, max(motion.cycles, 1)


def mean_friction(u: Any) -> Any:
    """Return the mean friction coefficient at X' = u, eq. (13)."""
    v = abs(STUDY.natural_frequency_rad_per_s * (V - u))
    return LAW.fit / (1 + LAW.decay_s_per_m * v) + LAW.static - LAW.fit + LAW.quadratic_s2_per_m2 * v * v


def leave_belt(x: float, s: float) -> tuple[float, float, float]:
    """Return X, X' and slipped distance at OFF of tau after a departure, where X'' = 0 and X''' = -V."""
    return x + V * OFF - V * OFF**3 / 6, V - V * OFF**2 / 2, s + V * OFF**3 / 6


def slip_by_scipy(slip: Slip, method: str, tolerance: float) -> Found:
    """Return the same of one cycle by solve_ivp, with an event at X' = V."""
    scatter = slip.scatter

    def slope(_: float, y: np.ndarray) -> list[float]:
        mu_s = 0.0 if scatter is None else float(scatter(y[2]))
        return [y[1], F * max(mean_friction(y[1]) + mu_s, 0.0) - 2 * D * y[1] - y[0], V - y[1]]

    def at_belt(_: float, y: np.ndarray) -> float:
        return float(y[1] - V)

    at_belt.terminal, at_belt.direction = True, 1.0  # type: ignore[attr-defined]
    start = leave_belt(slip.start, 0.0)
    solution = solve_ivp(slope, (OFF, LONGEST), start, method, events=at_belt, rtol=tolerance, atol=tolerance * F)
    return float(solution.y_events[0][0][0]), solution.nfev, 1


def slip_by_diffrax(slip: Slip, solver: str, lanes: int = LANES) -> Callable[[float], Found]:
    """Return a function of the tolerance: X at the reattachment, evaluations of all slips, and their number.

    A call solves so many slips from one start, compiled and vectorised in one thread, until an event at X' = V that the
    root finder of diffrax locates. Steps do not end at the nodes of a path, because diffrax has no input for them.
    """
    os.environ["XLA_FLAGS"] = SINGLE_THREAD  # before the first import
    import diffrax
    import jax
    import optimistix

    jax.config.update("jax_enable_x64", True)
    scatter, method = slip.scatter, getattr(diffrax, solver)()
    coefficients = None if scatter is None else jax.numpy.asarray(scatter.c.T)

    def mu_s(s: Any) -> Any:
        if coefficients is None:
            return 0.0
        piece = jax.numpy.clip((s / slip.spacing).astype(int), 0, len(coefficients) - 1)
        c, t = coefficients[piece], s - piece * slip.spacing
        return c[3] + t * (c[2] + t * (c[1] + t * c[0]))

    def slope(t: Any, y: Any, args: Any) -> Any:
        x, u, s = y
        return u, F * jax.numpy.maximum(mean_friction(u) + mu_s(s), 0.0) - 2 * D * u - x, V - u

    def at_belt(t: Any, y: Any, args: Any, **_: Any) -> Any:
        return y[1] - V

    def solve(y: Any, tolerance: Any) -> Any:
        control = diffrax.PIDController(rtol=tolerance, atol=tolerance * F)
        event = diffrax.Event(at_belt, optimistix.Newton(tolerance, tolerance * V))
        options = {"stepsize_controller": control, "event": event, "max_steps": MOST_STEPS}
        solution = diffrax.diffeqsolve(diffrax.ODETerm(slope), method, OFF, LONGEST, OFF, y, **options)
        return solution.ys[0][-1], solution.stats["num_steps"]

    every = jax.jit(jax.vmap(solve, in_axes=(0, None)))
    y = tuple(jax.numpy.full(lanes, value) for value in leave_belt(slip.start, 0.0))

    def call(tolerance: float) -> Found:
        x, steps = jax.block_until_ready(every(y, tolerance))
        return float(x[0]), lanes * len(method.tableau.b_sol) * int(steps[0]), lanes

    return call


def measure(peers: bool) -> dict[str, object]:
    """Return the error of the first slip and the time of a cycle, by method and tolerance.

    The summary has by peer and case its time over our least time at its error.
    """
    rows: list[Row] = []
    ratios: dict[str, dict[str, float]] = {}
    for slip in choose_slips():
        exact = slip_by_roughslip(slip, 1e-13)[0]
        calls: dict[tuple[str, float], Callable[[], Found]] = {}
        by_diffrax = {solver: slip_by_diffrax(slip, solver) for solver in SOLVERS if peers}
        for tolerance in TOLERANCES:
            calls |= {(OURS, t): partial(slip_by_roughslip, slip, t) for t in (tolerance, BETWEEN * tolerance)}
            calls |= {(f"scipy/{peer}", tolerance): partial(slip_by_scipy, slip, peer, tolerance) for peer in PEERS}
            calls |= {(f"diffrax/{peer}", tolerance): partial(call, tolerance) for peer, call in by_diffrax.items()}
        seconds, results = race(calls)
        of_slip = []
        for (method, tolerance), turns in seconds.items():
            place, evaluations, cycles = results[method, tolerance]
            name, error = case(motion=slip.name, asked=power(tolerance)), abs(place / exact - 1)
            of_slip.append(make_row(name, method, error, [turn / cycles for turn in turns], evaluations // cycles))
        ours = [row for row in of_slip if row["method"] == OURS]
        for peer in (row for row in of_slip if row not in ours):
            if times := [row["seconds"] for row in ours if row["error"] <= peer["error"]]:
                ratios.setdefault(peer["method"], {})[peer["case"]] = peer["seconds"] / min(times)
        rows += of_slip
    return {"summary": {"times_as_fast": ratios}, "rows": rows}


if __name__ == "__main__":
    write("oscillator", measure)
