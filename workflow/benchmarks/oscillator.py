"""Measure the mass on the belt: time of a cycle against the error of the reattachment point, with scipy's solvers.

Cycles start at the departure point of the study's oscillator, without scatter and on a friction path. One process, one
thread, in turns; `--peers` adds diffrax. Errors are relative to X of the reattachment by our pair of order 8 at 1e-13.
Further rows: the period over many cycles, and ensembles with their paths.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.integrators import PAIRS
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.system import Oscillator
from roughslip.probability import BetaDistribution
from roughslip.stages.path_resolution import Thinned, error_bounds
from workflow.benchmarks.oscillator_peers import LANES, LONGEST, OFF, SOLVERS, slips_by_diffrax, taylor_start
from workflow.benchmarks.runner import make_row, race, report_rows, run_command, timed
from workflow.evidence.rows import Row, case, power

PACKAGES = ("diffrax", "jax")
STUDY, LAW = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
PROCESS = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.05), 2.5e-4)
SEED = 20110914
CYCLE = 6.8685 / (2 * math.pi)  # natural periods of a cycle without scatter
BETWEEN = 0.3  # of a tolerance: a further tolerance of our methods, for an error near that of each peer
PERIODS = 1000.0, 20.0  # of our motions without scatter and on a path, which makes the cost of a call negligible
PEERS = ("RK45", "DOP853")
BLOCKS = 1000  # into which a long run is divided
RUNS = 2000  # of the ensemble whose time the summary states
COUNT_ERROR = 0.01  # of the mean count of cycles in that ensemble


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    tolerances : of every method
    nodes : of a correlation length of the friction path
    long_run : cycles over which the period is compared
    runs, cycles : of the ensemble that is measured; its time is scaled to RUNS
    ensemble_nodes : of a correlation length of its paths
    """

    tolerances: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    nodes: int = 8
    long_run: int = 1_000_000
    runs: int = 100
    cycles: int = 100
    ensemble_nodes: tuple[int, ...] = (4, 8)
    lanes: int = LANES
    quick: bool = False


QUICK = Sizes((1e-4, 1e-7), 4, 2000, 4, 5, (4, 8), 2, True)


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
    return simulate(STUDY, LAW, slip.path, slip.spacing, slip.periods, tolerance, slip.start, integrator=integrator)


def slip_by_roughslip(slip: Slip, integrator: str, tolerance: float) -> tuple[float, int, int]:
    """Return X of the first reattachment, evaluations of all cycles, and the number of cycles."""
    motion = simulate_slip(slip, integrator, tolerance)
    return float(motion.position[motion.kind == REATTACHMENT][0]), motion.evaluations, max(motion.cycles, 1)


def slip_by_scipy(slip: Slip, method: str, tolerance: float) -> tuple[float, int, int]:
    """Return the same of one cycle by solve_ivp with an event at X' = V.

    A Taylor step leaves the belt, where the event would occur at once.
    """
    F, V, D, omega = STUDY.F, STUDY.V, STUDY.damping_ratio, STUDY.natural_frequency_rad_per_s
    grid = slip.spacing * np.arange(0 if slip.path is None else len(slip.path))
    scatter = None if slip.path is None else CubicHermiteSpline(grid, slip.path, np.gradient(slip.path, slip.spacing))
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
            compiled = slips_by_diffrax(STUDY, LAW, slip.path, slip.spacing, slip.start, peer, sizes.lanes)
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


def period_drift(sizes: Sizes) -> list[Row]:
    """Return rows of the relative spread of the mean periods of blocks over many cycles, at a tolerance of 1e-9."""
    rows = []
    for pair in PAIRS:
        run = partial(simulate, STUDY, LAW, None, 0.0, (sizes.long_run + 1) * CYCLE, integrator=pair)
        seconds, motion = timed(run)
        ends = motion.time[motion.kind == REATTACHMENT]
        marks = ends[: (len(ends) - 1) // BLOCKS * BLOCKS + 1 : (len(ends) - 1) // BLOCKS]
        error = float(np.ptp(np.diff(marks)) / np.mean(np.diff(marks)))
        rows.append(make_row(case(motion="long-run"), f"roughslip/{pair}", error, [seconds], len(ends)))
        report_rows(rows[-1:])
    return rows


def ensembles(sizes: Sizes) -> list[Row]:
    """Return rows of ensembles with their paths, at two spacings of nodes.

    The error bounds that of the mean count of cycles due to the spacing, from the same paths at half the spacing (stage
    spacing).
    """
    periods, rows = sizes.cycles * CYCLE, []

    def counts(nodes: int, step: int) -> np.ndarray:
        paths = recursion(PROCESS, PROCESS.correlation_length_m / (nodes * step))
        realisations = (Thinned(paths.realisation([SEED, number]), step) for number in range(sizes.runs))
        spacing = step * paths.spacing
        return np.array([simulate(STUDY, LAW, one, spacing, periods, 1e-6).cycles for one in realisations])

    for nodes in sizes.ensemble_nodes:
        counts(nodes, 1)
        seconds, cycles = timed(partial(counts, nodes, 1))
        _, error = error_bounds(counts(nodes, 2)[:, None], counts(2 * nodes, 1)[:, None])
        name = case(motion=f"ensemble-of-{nodes}-nodes", runs=sizes.runs, periods=f"{periods:.4g}")
        rows.append(make_row(name, "roughslip/fehlberg45", error, [seconds], int(cycles.sum())))
        report_rows(rows[-1:])
    return rows


def least_seconds(rows: Sequence[Row], method: str, error: float) -> float:
    """Return the least time of a cycle by a method that is at least so accurate, infinity if it never is."""
    return min((r["seconds"] for r in rows if r["method"] == method and r["error"] <= error), default=math.inf)


def summarise(rows: Sequence[Row], sizes: Sizes) -> dict[str, Any]:
    """Return time ratios to each peer at its error, the spread of periods, and the time of the ensemble."""
    ratios: dict[str, dict[str, float]] = {}
    for entry in rows:
        if "asked=" in entry["case"] and not entry["method"].startswith("roughslip"):
            motion = entry["case"].split(" ")[0]
            here = [row for row in rows if row["case"].startswith(f"{motion} ")]
            best = min(least_seconds(here, f"roughslip/{pair}", entry["error"]) for pair in PAIRS)
            if best < math.inf:
                ratios.setdefault(entry["method"], {})[entry["case"]] = entry["seconds"] / best
    exact_enough = [row for row in rows if row["case"].startswith("motion=ensemble") and row["error"] <= COUNT_ERROR]
    return {
        "times_as_fast": ratios,
        "spread_of_periods": {row["method"]: row["error"] for row in rows if row["case"] == "motion=long-run"},
        "ensemble_seconds": min((row["seconds"] * RUNS / sizes.runs for row in exact_enough), default=None),
    }


def measure(quick: bool, peers: bool) -> dict[str, object]:
    """Return the summary and the rows."""
    sizes = QUICK if quick else Sizes()
    rows = slip_phases(sizes, SOLVERS if peers else ()) + period_drift(sizes) + ensembles(sizes)
    return {"summary": summarise(rows, sizes), "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure, PACKAGES, ("diffrax",))
