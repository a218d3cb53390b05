"""Measure the mass on the belt: time of a cycle against the error of the reattachment point, with scipy's solvers.

Cycles start at the departure point of the study's oscillator, without scatter and on a friction path. One process, one
thread, in turns; `--peers` adds diffrax. Errors are relative to X of the reattachment by our pair of order 8 at 1e-13.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.oscillator.runge_kutta import PAIRS
from roughslip.probability import BetaDistribution
from workflow.benchmarks.runner import make_row, race, report_rows, run_command
from workflow.evidence.rows import Row, case, power

PACKAGES = ("diffrax", "jax")
STUDY, LAW = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
PROCESS = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.05), 2.5e-4)
SEED = 20110914
BETWEEN = 0.3  # of a tolerance: a further tolerance of our methods, for an error near that of each peer
PERIODS = 1000.0, 20.0  # of our motions without scatter and on a path, which makes the cost of a call negligible
PEERS = ("RK45", "DOP853")

SOLVERS = ("Tsit5", "Dopri8")  # of diffrax
LANES = 256
OFF = 1e-3  # of tau: a Taylor step leaves the belt, where the event would occur at once
LONGEST, MOST_STEPS = 9.0, 100_000
SINGLE_THREAD = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    tolerances : of every method
    nodes : of a correlation length of the friction path
    lanes : slips that diffrax solves at a time
    quick : one turn each
    """

    tolerances: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    nodes: int = 8
    lanes: int = LANES
    quick: bool = False


QUICK = Sizes((1e-4, 1e-7), 4, 2, True)


@dataclass(frozen=True)
class Slip:
    """One slip phase from the departure point.

    name : as in the case
    path : (nodes,) mu_S over the slipped distance, or None
    spacing : [m]
    periods : of our motion
    """

    name: str
    path: np.ndarray | None
    spacing: float
    periods: float

    @property
    def start(self) -> float:
        """[m] X at departure."""
        static = LAW.static + (0.0 if self.path is None else float(self.path[0]))
        return STUDY.F * static - 2 * STUDY.damping_ratio * STUDY.V

    @property
    def scatter(self) -> CubicHermiteSpline | None:
        """mu_S as a function of the slipped distance, for the peers."""
        if self.path is None:
            return None
        grid = self.spacing * np.arange(len(self.path))
        return CubicHermiteSpline(grid, self.path, np.gradient(self.path, self.spacing))


def choose_slips(nodes: int) -> tuple[Slip, Slip]:
    """Return the slip without scatter, and the first ordinary slip on a path.

    Ordinary: friction falls as slip begins, and the mass sticks again after it has moved backwards.
    """
    paths = recursion(PROCESS, PROCESS.correlation_length_m / nodes)
    for number in range(1000):
        pieces = iter(paths.realisation([SEED, number]))
        path = np.concatenate([next(pieces) for _ in range(4)])
        found = Slip(f"path-of-{nodes}-nodes", path, paths.spacing, PERIODS[1])
        if path[1] < path[0] and simulate_slip(found, "fehlberg45", 1e-6).backwards[1]:
            return Slip("deterministic", None, 0.0, PERIODS[0]), found
    raise AssertionError("no path of a thousand has an ordinary slip")


def simulate_slip(slip: Slip, integrator: str, tolerance: float) -> Any:
    """Return our motion over the slip and the cycles that follow."""
    options = MotionOptions(tolerance, integrator=integrator)
    return simulate(STUDY, LAW, slip.path, slip.spacing, slip.periods, options, slip.start)


def slip_by_roughslip(slip: Slip, integrator: str, tolerance: float) -> tuple[float, int, int]:
    """Return X of the first reattachment, evaluations of all cycles, and the number of cycles."""
    motion = simulate_slip(slip, integrator, tolerance)
    return float(motion.position[motion.kind == REATTACHMENT][0]), motion.evaluations, max(motion.cycles, 1)


def taylor_start(start: float, V: float) -> tuple[float, float, float]:
    """Return X, X' and slipped distance at tau = OFF after a departure at X = start, where X'' = 0 and X''' = -V."""
    return start + V * OFF - V * OFF**3 / 6, V - V * OFF**2 / 2, V * OFF**3 / 6


def slip_by_scipy(slip: Slip, method: str, tolerance: float) -> tuple[float, int, int]:
    """Return the same of one cycle by solve_ivp with an event at X' = V.

    A Taylor step leaves the belt, where the event would occur at once.
    """
    F, V, D, omega = STUDY.F, STUDY.V, STUDY.damping_ratio, STUDY.natural_frequency_rad_per_s
    scatter = slip.scatter
    fit, decay, quadratic, rest = LAW.fit, LAW.decay_s_per_m, LAW.quadratic_s2_per_m2, LAW.static

    def slope(_: float, y: np.ndarray) -> list[float]:
        v = omega * (V - y[1])
        mu = fit / (1 + decay * v) + rest - fit + quadratic * v * v
        mu_s = 0.0 if scatter is None else float(scatter(y[2]))
        return [y[1], F * max(mu + mu_s, 0.0) - 2 * D * y[1] - y[0], V - y[1]]

    def at_belt(_: float, y: np.ndarray) -> float:
        return y[1] - V

    at_belt.terminal, at_belt.direction = True, 1.0  # type: ignore[attr-defined]
    start = taylor_start(slip.start, V)
    found = solve_ivp(slope, (OFF, LONGEST), start, method, events=at_belt, rtol=tolerance, atol=tolerance * F)
    return float(found.y_events[0][0][0]), found.nfev, 1


@cache
def _import_diffrax() -> tuple[Any, Any, Any]:
    """Import jax in double precision and one thread, diffrax and optimistix; the first import reads the environment."""
    os.environ["XLA_FLAGS"] = f"{os.environ.get('XLA_FLAGS', '')} {SINGLE_THREAD}".strip()
    import diffrax
    import jax
    import optimistix

    jax.config.update("jax_enable_x64", True)
    return jax, diffrax, optimistix


def slip_by_diffrax(slip: Slip, solver: str, lanes: int = LANES) -> Callable[[float], tuple[float, int, int]]:
    """Return a function of the tolerance: X at the reattachment, evaluations of all slips, and their number.

    A call solves so many slips from one start, compiled and vectorised in one thread, until an event at X' = V that the
    root finder of diffrax locates. Steps do not end at the nodes of a path, because diffrax has no input for them.
    """
    jax, diffrax, optimistix = _import_diffrax()
    F, V, D, omega = STUDY.F, STUDY.V, STUDY.damping_ratio, STUDY.natural_frequency_rad_per_s
    fit, decay, quadratic, rest = LAW.fit, LAW.decay_s_per_m, LAW.quadratic_s2_per_m2, LAW.static
    scatter, spacing = slip.scatter, slip.spacing
    coefficients = None if scatter is None else jax.numpy.asarray(scatter.c.T)

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

    def solve(y: Any, tolerance: Any) -> Any:
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

    every = jax.jit(jax.vmap(solve, in_axes=(0, None)))
    y = tuple(jax.numpy.full(lanes, value) for value in taylor_start(slip.start, V))
    stages = len(getattr(diffrax, solver).tableau.b_sol)

    def call(tolerance: float) -> tuple[float, int, int]:
        x, steps = jax.block_until_ready(every(y, tolerance))
        return float(x[0]), lanes * stages * int(steps[0]), lanes

    return call


def slip_phases(sizes: Sizes, peers: Sequence[str] = ()) -> list[Row]:
    """Return rows of the error of the first slip and the time of a cycle, by method and tolerance."""
    rows: list[Row] = []
    for slip in choose_slips(sizes.nodes):
        exact, *_ = slip_by_roughslip(slip, "dormand_prince853", 1e-13)
        calls: dict[tuple[str, float], Callable[[], tuple[float, int, int]]] = {}
        for tolerance in sizes.tolerances:
            for asked in (tolerance, BETWEEN * tolerance):
                calls |= {(f"roughslip/{pair}", asked): partial(slip_by_roughslip, slip, pair, asked) for pair in PAIRS}
            calls |= {(f"scipy/{peer}", tolerance): partial(slip_by_scipy, slip, peer, tolerance) for peer in PEERS}
        for peer in peers:
            compiled = slip_by_diffrax(slip, peer, sizes.lanes)
            compiled(sizes.tolerances[0])  # compiles
            calls |= {(f"diffrax/{peer}", tolerance): partial(compiled, tolerance) for tolerance in sizes.tolerances}
        seconds, results = race(calls, sizes.quick)
        for (method, tolerance), turns in seconds.items():
            place, evaluations, cycles = results[method, tolerance]
            name = case(motion=slip.name, asked=power(tolerance))
            error = abs(place / exact - 1)
            rows.append(make_row(name, method, error, [one / cycles for one in turns], evaluations // cycles))
            report_rows(rows[-1:])
    return rows


def least_seconds(rows: Sequence[Row], method: str, error: float) -> float:
    """Return the least time of a cycle by a method that is at least so accurate, infinity if it never is."""
    return min((r["seconds"] for r in rows if r["method"] == method and r["error"] <= error), default=math.inf)


def ratios_at_equal_error(rows: Sequence[Row]) -> dict[str, dict[str, float]]:
    """Return by peer and case its time over our least time at its error."""
    ratios: dict[str, dict[str, float]] = {}
    for entry in rows:
        if not entry["method"].startswith("roughslip"):
            motion = entry["case"].split(" ")[0]
            here = [row for row in rows if row["case"].startswith(f"{motion} ")]
            best = min(least_seconds(here, f"roughslip/{pair}", entry["error"]) for pair in PAIRS)
            if best < math.inf:
                ratios.setdefault(entry["method"], {})[entry["case"]] = entry["seconds"] / best
    return ratios


def measure(quick: bool, peers: bool) -> dict[str, object]:
    """Return the summary and the rows."""
    sizes = QUICK if quick else Sizes()
    rows = slip_phases(sizes, SOLVERS if peers else ())
    return {"summary": {"times_as_fast": ratios_at_equal_error(rows)}, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure, PACKAGES, ("diffrax",))
