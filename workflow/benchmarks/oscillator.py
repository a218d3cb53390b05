"""The mass on the belt measured: cycles per second against the error of the reattachment point, beside scipy's solvers.

Cycles of the study's oscillator from its departure point, without scatter and on a friction path, by every method at
several tolerances, in one process and one thread, by turns; with peers also by diffrax. Errors are relative to X of the
reattachment by our pair of order 8 at 1e-13. Beside them nanoseconds of an evaluation of the right-hand side, and an
ensemble with the time that its paths take.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline

from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion
from roughslip.oscillator.equation import acceleration
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.integrators import PAIRS
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.system import Coefficients, Oscillator, coefficients
from roughslip.probability import BetaDistribution
from roughslip.stages.spacing import Thinned, error_bounds
from workflow.benchmarks import measure
from workflow.benchmarks.measure import Contender, Row, case, row
from workflow.benchmarks.oscillator_peers import LANES, LONGEST, OFF, SOLVERS, slips_by_diffrax, taylor_start

PACKAGES = ("numpy", "scipy", "numba", "diffrax", "jax")
STUDY, LAW = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
PROCESS = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.05), 2.5e-4)
SEED = 20110914
BETWEEN = 0.3  # of a tolerance: ours are measured there, too, so that there is one near the error of each of theirs
PERIODS = 1000.0, 20.0  # of our motions without scatter and on a path, so that what a call costs does not count; of
# scipy's solvers a call is a cycle
PEERS = ("RK45", "DOP853")
EVALUATIONS = 1_000_000  # of the right-hand side in a measurement
BLOCKS = 1000  # into which a long run is cut
PROMISED_RATIO, PROMISED_SECONDS, PROMISED_RUNS = 500.0, 40.0, 2000  # against scipy; of an ensemble of so many runs
PROMISED_COUNT, PROMISED_DRIFT = 0.01, 1e-9  # error of an ensemble's mean count; spread of mean periods


@dataclass(frozen=True)
class Campaign:
    """What is measured.

    tolerances : of every method
    nodes : of a correlation length of the friction path
    long_run : cycles over which the period is to stay
    runs, cycles : of the ensemble that is measured; its time is told for PROMISED_RUNS
    ensemble_nodes : of a correlation length of its paths
    quick : one turn each, to show that everything works
    """

    tolerances: tuple[float, ...] = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10)
    nodes: int = 8
    long_run: int = 1_000_000
    runs: int = 100
    cycles: int = 100
    ensemble_nodes: tuple[int, ...] = (4, 8)
    quick: bool = False


QUICK = Campaign((1e-4, 1e-7), 4, 2000, 4, 5, (4, 8), True)


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


def slips(nodes: int) -> tuple[Slip, Slip]:
    """Without scatter, and on the first path of the process whose friction falls as slip begins and that sticks again
    after a turn backwards, so that all methods see one slip of the ordinary kind."""
    paths = recursion(PROCESS, PROCESS.correlation_length_m / nodes)
    for number in range(1000):
        pieces = iter(paths.realisation([SEED, number]))
        path = np.concatenate([next(pieces) for _ in range(4)])
        found = Slip(f"path-of-{nodes}-nodes", path, paths.spacing, PERIODS[1])
        if path[1] < path[0] and run(found, "fehlberg45", 1e-6).backwards[1]:
            return Slip("deterministic", None, 0.0, PERIODS[0]), found
    raise AssertionError("no path of a thousand has an ordinary slip")


def run(slip: Slip, integrator: str, tolerance: float) -> Any:
    """Our motion over the slip and the cycles that follow."""
    return simulate(STUDY, LAW, slip.path, slip.spacing, slip.periods, tolerance, slip.start, integrator=integrator)


def ours(slip: Slip, integrator: str, tolerance: float) -> tuple[float, int, int]:
    """X of the first reattachment, evaluations and cycles of all."""
    motion = run(slip, integrator, tolerance)
    return float(motion.position[motion.kind == REATTACHMENT][0]), motion.evaluations, max(motion.cycles, 1)


def theirs(slip: Slip, method: str, tolerance: float) -> tuple[float, int, int]:
    """The same of one cycle by solve_ivp with an event at X' = V; a Taylor step leaves the belt, where the event would
    be met. Stick takes no time worth telling."""
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
    found = solve_ivp(
        slope, (OFF, LONGEST), taylor_start(slip.start, V), method, events=at_belt, rtol=tolerance, atol=tolerance * F
    )
    return float(found.y_events[0][0][0]), found.nfev, 1


def phases(campaign: Campaign, peers: Sequence[str] = ()) -> list[Row]:
    """Error of the first slip phase and time of a cycle by every method at every tolerance."""
    rows: list[Row] = []
    for slip in slips(campaign.nodes):
        exact, *_ = ours(slip, "dormand_prince853", 1e-13)
        calls: dict[tuple[str, float], Callable[[], tuple[float, int, int]]] = {}
        for tolerance in campaign.tolerances:
            for asked in (tolerance, BETWEEN * tolerance):
                calls |= {(f"roughslip/{pair}", asked): partial(ours, slip, pair, asked) for pair in PAIRS}
            calls |= {(f"scipy/{peer}", tolerance): partial(theirs, slip, peer, tolerance) for peer in PEERS}
        for peer in peers:
            lanes = 2 if campaign.quick else LANES
            compiled = slips_by_diffrax(STUDY, LAW, slip.path, slip.spacing, slip.start, peer, lanes)
            calls |= {(f"diffrax/{peer}", tolerance): partial(compiled, tolerance) for tolerance in campaign.tolerances}
        found = {name: call() for name, call in calls.items()}  # and compiled
        contenders = {}
        for name, call in calls.items():
            seconds, _ = measure.timed(call)
            contenders[name] = Contender(call, seconds, 1 if campaign.quick else measure.turns(seconds))
        for (method, tolerance), seconds in measure.race(contenders).items():
            place, evaluations, cycles = found[method, tolerance]
            error = abs(place / exact - 1)
            name = case(motion=slip.name, asked=measure.power(tolerance))
            rows.append(row(name, method, error, [one / cycles for one in seconds], evaluations // cycles))
            measure.say(f"{name} {method}: {1 / rows[-1]['seconds']:.3g} cycles/s, error {error:.1e}")
    return rows


@njit(cache=True)
def _evaluate(count: int, p: Coefficients) -> float:
    total = 0.0
    for k in range(count):
        total += acceleration(0.0, 0.01, p.V * (1.0 - 1e-6 * k), 1.0, 0.0, p)
    return total


def right_hand_side(campaign: Campaign) -> list[Row]:
    """Seconds of EVALUATIONS of X''."""
    p = coefficients(STUDY, LAW)
    call = partial(_evaluate, EVALUATIONS, p)
    call()
    seconds, _ = measure.timed(call)
    times = measure.race({"one": Contender(call, seconds, 1 if campaign.quick else 5)})["one"]
    measure.say(f"right-hand side: {1e9 * min(times) / EVALUATIONS:.2f} ns")
    return [row(case(motion="right-hand-side"), "roughslip", 0.0, times, EVALUATIONS)]


def drift(campaign: Campaign) -> list[Row]:
    """How far the mean periods of blocks of cycles lie from each other, relative, over very many cycles at 1e-9."""
    rows = []
    for pair in PAIRS:
        periods = (campaign.long_run + 1) * 6.8685 / (2 * math.pi)
        seconds, motion = measure.timed(lambda at=periods, by=pair: simulate(STUDY, LAW, None, 0.0, at, integrator=by))
        ends = motion.time[motion.kind == REATTACHMENT]
        marks = ends[: (len(ends) - 1) // BLOCKS * BLOCKS + 1 : (len(ends) - 1) // BLOCKS]
        error = float(np.ptp(np.diff(marks)) / np.mean(np.diff(marks)))
        rows.append(row(case(motion="long-run"), f"roughslip/{pair}", error, [seconds], len(ends)))
        measure.say(f"{len(ends)} cycles by {pair}: mean periods of {BLOCKS} blocks spread by {error:.1e}")
    return rows


def ensemble(campaign: Campaign) -> list[Row]:
    """Seconds of an ensemble, paths among them, at two spacings of the nodes; its error is a bound of what the mean
    count of cycles errs by for the spacing, from the same paths read at half of it (stage spacing)."""
    periods, rows = campaign.cycles * 6.8685 / (2 * math.pi), []

    def counts(nodes: int, step: int) -> np.ndarray:
        paths = recursion(PROCESS, PROCESS.correlation_length_m / (nodes * step))
        realisations = (Thinned(paths.realisation([SEED, number]), step) for number in range(campaign.runs))
        spacing = step * paths.spacing
        return np.array([simulate(STUDY, LAW, one, spacing, periods, 1e-6).cycles for one in realisations])

    for nodes in campaign.ensemble_nodes:
        counts(nodes, 1)
        seconds, cycles = measure.timed(partial(counts, nodes, 1))
        _, error = error_bounds(counts(nodes, 2)[:, None], counts(2 * nodes, 1)[:, None])
        name = case(motion=f"ensemble-of-{nodes}-nodes", runs=campaign.runs, periods=f"{periods:.4g}")
        whole = PROMISED_RUNS * seconds / campaign.runs
        measure.say(f"{name}: {whole:.3g} s for {PROMISED_RUNS} runs, mean count to {error:.2%}")
        rows.append(row(name, "roughslip/fehlberg45", error, [seconds], int(cycles.sum())))
    return rows


def at_error(rows: Sequence[Row], method: str, error: float) -> float | None:
    """The least seconds of a cycle by a method that is at least as accurate, None where it never is."""
    return min((row["seconds"] for row in rows if row["method"] == method and row["error"] <= error), default=None)


def summary(rows: Sequence[Row], campaign: Campaign) -> dict[str, Any]:
    """How many times as fast as each of scipy's, at the error of each of its rows; the promises beside."""
    ratios: dict[str, dict[str, float]] = {}
    for motion in sorted({one["case"].split(" ")[0] for one in rows if "asked=" in one["case"]}):
        here = [one for one in rows if one["case"].split(" ")[0] == motion]
        for entry in here:
            best = [at_error(here, f"roughslip/{pair}", entry["error"]) for pair in PAIRS]
            reached = [seconds for seconds in best if seconds is not None]
            if not entry["method"].startswith("roughslip") and reached:
                ratios.setdefault(entry["method"], {})[entry["case"]] = entry["seconds"] / min(reached)
    ensembles = [row for row in rows if row["case"].startswith("motion=ensemble") and row["error"] <= PROMISED_COUNT]
    least = min((row["seconds"] for row in ensembles), default=math.inf)
    seconds = least * PROMISED_RUNS / campaign.runs
    evaluation = next(row for row in rows if row["case"] == "motion=right-hand-side")
    beside_scipy = [ratio for method, one in ratios.items() if method.startswith("scipy") for ratio in one.values()]
    spread = {row["method"]: row["error"] for row in rows if row["case"] == "motion=long-run"}
    kept = max(spread.values(), default=math.inf) <= PROMISED_DRIFT
    return {
        "spread_of_periods": spread,
        "promised_spread": PROMISED_DRIFT,
        "times_as_fast": ratios,
        "promised_ratio": PROMISED_RATIO,
        "nanoseconds_of_an_evaluation": 1e9 * evaluation["seconds"] / evaluation["work"],
        "ensemble_seconds": seconds if seconds < math.inf else None,
        "promised_seconds": PROMISED_SECONDS,
        "met": kept and seconds <= PROMISED_SECONDS and min(beside_scipy, default=0.0) >= PROMISED_RATIO,
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="beside diffrax, which must be installed")
    parser.add_argument("--quick", action="store_true", help="few tolerances, one turn each")
    arguments = parser.parse_args()
    if arguments.peers and find_spec("diffrax") is None:
        parser.error("not installed: diffrax; `make benchmark PEERS=1` sets up an environment with it")
    campaign = QUICK if arguments.quick else Campaign()
    rows = (
        phases(campaign, SOLVERS if arguments.peers else ())
        + right_hand_side(campaign)
        + drift(campaign)
        + ensemble(campaign)
    )
    head = {"machine": measure.machine(), "versions": measure.versions(PACKAGES), "checks": {}}
    measure.write(arguments.output, {**head, "summary": summary(rows, campaign), "rows": rows})


if __name__ == "__main__":
    main()
