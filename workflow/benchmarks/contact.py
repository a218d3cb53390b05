"""The contact solver measured: beside public solvers at equal residual, in sweeps, and on growing meshes.

All in one process and one thread, by turns. Every method is judged by the same residual (contact_problem.Judge). The
tolerance of a peer is tuned first, case by case, to the loosest that meets the case's. Not timed: operators and plans.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, sweep
from roughslip.grid import Grid
from roughslip.stages.runtime.usage import die_with_parent
from workflow.benchmarks import measure
from workflow.benchmarks.contact_peers import PEERS, Peer
from workflow.benchmarks.contact_problem import (
    LEVELS,
    MODULUS,
    STRIP,
    Convolution,
    Judge,
    Problem,
    plane_height,
    square,
    surface,
)
from workflow.benchmarks.contact_summary import summary
from workflow.benchmarks.measure import OURS, Contender, Row, case, power, row
from workflow.benchmarks.tuning import tune

PACKAGES = ("numpy", "scipy", "numba", "ducc0", "tamaas", "ContactMechanics", "NuMPI", "muGrid", "SurfaceTopography")

# Up to which mesh a peer takes part, at the median and at other planes: what its time allows.
EXTENT = {
    "tamaas/load": (512, 512),
    "contactmechanics/bugnicourt": (512, 128),
    "polonsky-keer": (512, 128),
    "contactmechanics/polonsky-keer": (128, 10),
    "tamaas/penetration": (128, 10),
}

# A tuning solve that took longer than this [s] is the peer's first turn.
LONG = 1.5

REFERENCE_TOLERANCE = 1e-12
SETTINGS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
SWEPT = tuple(f"{level}" for level in range(10, 100, 10))


@dataclass(frozen=True)
class Campaign:
    """What is measured, and on which meshes.

    nodes : beside the peers, every surface, level and tolerance
    growing : ours alone, with the largest of `nodes` for the growth of time and memory
    precise : pressure error against time
    swept : sweeps
    quick : one turn each, to show that everything works
    """

    nodes: tuple[int, ...] = (64, 128, 256, 512)
    growing: tuple[int, ...] = (1024, 2048)
    precise: tuple[int, ...] = (128, 256)
    swept: tuple[int, ...] = (64, 128, 256)
    tolerances: tuple[float, ...] = (1e-6, 1e-10)
    levels: tuple[str, ...] = LEVELS
    quick: bool = False

    def turns(self, seconds: float, least: int = 1) -> int:
        return 1 if self.quick else max(least, measure.turns(seconds))


QUICK = Campaign((32,), (48,), (32,), (32,), levels=("50", "contact90"), quick=True)


@dataclass(frozen=True)
class Mesh:
    """What is set up once for a mesh: our operator, the judge, the peers."""

    influence: Influence
    judge: Judge
    peers: dict[str, Peer]

    @classmethod
    def of(cls, grid: Grid, peers: Sequence[str] = ()) -> Mesh:
        return cls(Influence(grid, MODULUS), Judge(grid), {name: PEERS[name](grid) for name in peers})

    def problem(self, kind: str, level: str) -> Problem:
        heights = surface(kind, self.influence.grid)
        return Problem(self.influence.grid, heights, plane_height(level, heights, self.influence))

    def ours(self, problem: Problem, tolerance: float) -> ContactSolution:
        return solve(self.influence, problem.interference, tolerance)


def comparisons(campaign: Campaign, peers: Sequence[str]) -> list[Row]:
    """10 x 10 nodes of white heights, then both surfaces on every mesh, at every plane and tolerance."""
    rows: list[Row] = []
    found: dict[tuple[str, str, str], float] = {}
    for n in (10, *campaign.nodes):
        mesh = Mesh.of(square(n), peers)
        for kind in ("white",) if n == 10 else ("gauss", "exp"):
            for level in campaign.levels:
                problem = mesh.problem(kind, level)
                taking = [name for name in peers if n <= EXTENT[name][level != "50"]]
                for tolerance in campaign.tolerances:
                    name = case(n=n, surface=kind, level=level, tolerance=power(tolerance))
                    first = {peer: tolerance * found.get((peer, kind, level), 30.0) for peer in taking}
                    least = 3 if level == "50" else 1
                    met = compare(mesh, problem, name, tolerance, first, lambda s, k=least: campaign.turns(s, k))
                    found |= {(r["method"], kind, level): r["setting"] / tolerance for r in met if "setting" in r}
                    rows += met
                    _tell(met)
    return rows


def compare(
    mesh: Mesh, problem: Problem, name: str, tolerance: float, first: dict[str, float], turns: measure.Turns
) -> list[Row]:
    """Ours and the peers on one case. `first` names the peers that take part, each with a setting to tune from."""
    load = mesh.ours(problem, REFERENCE_TOLERANCE).mean_pressure
    seconds, ours = measure.timed(lambda: mesh.ours(problem, tolerance))
    contenders = {OURS: Contender(lambda: mesh.ours(problem, tolerance), seconds, turns(seconds))}
    tuned = {}
    for peer_name, setting in first.items():
        peer = mesh.peers[peer_name]
        found = tuned[peer_name] = tune(peer, problem, load, tolerance, setting, mesh.judge)
        contenders[peer_name] = Contender(
            lambda peer=peer, setting=found.setting: peer.solve(problem, load, setting),
            found.seconds,
            turns(found.seconds),
            keep=found.seconds > LONG,
        )
    seconds_of = measure.race(contenders)
    error = mesh.judge.residual(problem, ours.pressure)
    return [
        row(name, OURS, error, seconds_of[OURS], ours.work, solver=ours.method),
        *(row(name, p, t.residual, seconds_of[p], t.work, setting=t.setting) for p, t in tuned.items()),
    ]


def sweeps(campaign: Campaign) -> list[Row]:
    """Nine penetrations in one sweep and one by one, on squares and on a strip."""
    rows: list[Row] = []
    meshes = [(case(n=n, surface="gauss"), square(n), "gauss") for n in campaign.swept]
    meshes.append((case(nx=STRIP.nx, ny=STRIP.ny, surface="white"), STRIP, "white"))
    for start, grid, kind in meshes:
        mesh = Mesh.of(grid)
        problems = [mesh.problem(kind, level) for level in SWEPT]
        heights, planes = problems[0].heights, [problem.plane for problem in problems]
        calls = {
            "roughslip/sweep": lambda m=mesh, z=heights, h=planes: sweep(m.influence, z, h, 1e-10),
            "roughslip/cold": lambda m=mesh, all_=problems: [m.ours(problem, 1e-10) for problem in all_],
        }
        name, contenders, solutions = f"{start} levels={SWEPT[0]}-{SWEPT[-1]} tolerance=1e-10", {}, {}
        for method, call in calls.items():
            seconds, solutions[method] = measure.timed(call)
            contenders[method] = Contender(call, seconds, campaign.turns(seconds, 3))
        for method, seconds in measure.race(contenders).items():
            pairs = list(zip(problems, solutions[method], strict=True))
            error = max(mesh.judge.residual(problem, solution.pressure) for problem, solution in pairs)
            rows.append(row(name, method, error, seconds, sum(solution.work for _, solution in pairs)))
        _tell(rows[-2:])
    return rows


def growth(campaign: Campaign) -> list[Row]:
    """Ours alone on meshes too large for the peers."""
    rows = []
    for n in campaign.growing:
        mesh = Mesh.of(square(n))
        problem = mesh.problem("gauss", "50")
        seconds, ours = measure.timed(lambda m=mesh, p=problem: m.ours(p, 1e-10))
        contender = Contender(lambda m=mesh, p=problem: m.ours(p, 1e-10), seconds, campaign.turns(seconds, 3))
        times = measure.race({OURS: contender})[OURS]
        error = mesh.judge.residual(problem, ours.pressure)
        name = case(n=n, surface="gauss", level="50", tolerance="1e-10")
        rows.append(row(name, OURS, error, times, ours.work, solver=ours.method))
        _tell(rows[-1:])
    return rows


def memory(campaign: Campaign) -> dict[str, dict[str, float | None]]:
    """Peak memory of setting up the operator and of one solve, in arrays of the padded size, 8 (2n)^2 bytes, by n.

    traced : what Python and numpy allocate
    resident : what the process takes
    """
    found = {}
    for n in (campaign.nodes[-1], *campaign.growing):
        with ProcessPoolExecutor(1, get_context("spawn"), die_with_parent) as pool:
            peaks = pool.submit(peak_of_a_solve, surface("gauss", square(n))).result()
        array = 8 * (2 * n) ** 2
        found[f"{n}"] = {k: peak and peak / array for k, peak in zip(("traced", "resident"), peaks, strict=True)}
        measure.say(f"memory at n={n}, in padded arrays: {found[f'{n}']}")
    return found


def peak_of_a_solve(heights: np.ndarray) -> tuple[int, int | None]:
    """In a process of its own, after solves on a small mesh have loaded what is compiled."""
    small = Mesh.of(square(64))
    for level in ("5", "50"):
        small.ours(small.problem("gauss", level), 1e-10)
    interference = heights - np.median(heights)
    return measure.peak_memory(lambda: solve(Influence(square(len(heights)), MODULUS), interference, 1e-10))


def precision(campaign: Campaign, peers: Sequence[str]) -> tuple[list[Row], dict[str, float]]:
    """Pressure error against time at the methods' own settings, and the error of the reference by case."""
    rows, reference_errors = [], {}
    for n in campaign.precise:
        mesh = Mesh.of(square(n), [name for name in peers if n <= EXTENT[name][0]])
        problem = mesh.problem("gauss", "50")
        name = case(n=n, surface="gauss", level="50", quantity="pressure")
        reference, coarser = (mesh.ours(problem, tolerance).pressure for tolerance in (1e-13, 1e-12))
        norm = np.linalg.norm(reference)
        reference_errors[name] = float(np.linalg.norm(coarser - reference) / norm)
        load = float(reference.mean())
        contenders, answers = {}, {}
        for setting in SETTINGS:
            calls = {OURS: lambda counting=False, s=setting, m=mesh, p=problem: _answer(m.ours(p, s))}
            for peer_name, peer in mesh.peers.items():
                calls[peer_name] = lambda counting=False, q=peer, p=problem, w=load, s=setting: q.solve(
                    p, w, s, counting
                )
            for method, call in calls.items():
                seconds, answers[method, setting] = measure.timed(lambda call=call: call(counting=True))
                turns, kept = min(3, campaign.turns(seconds)), seconds > LONG
                contenders[method, setting] = Contender(call, seconds, turns, kept)
        for (method, setting), times in measure.race(contenders).items():
            pressure, work = answers[method, setting]
            error = float(np.linalg.norm(pressure - reference) / norm)
            rows.append(row(name, method, error, times, work, setting=setting))
        measure.say(f"{name}: error of the reference {reference_errors[name]:.1e}")
    return rows, reference_errors


def _answer(solution: ContactSolution) -> tuple[np.ndarray, int]:
    return solution.pressure, solution.work


def checks(peers: Sequence[str]) -> dict[str, float]:
    """Relative differences of displacements: the judge's from a direct sum, ours and the peers' from the judge's."""
    coarse, grid = Grid(12, 9, 1e-6, 1.5e-6), square(64)
    generator = np.random.default_rng(1)
    small, large = generator.random(coarse.shape), generator.random(grid.shape)
    judge, mesh = Convolution(coarse, MODULUS), Mesh.of(grid, peers)

    def difference(u: np.ndarray, expected: np.ndarray) -> float:
        return float(np.linalg.norm(u - expected) / np.linalg.norm(expected))

    expected = mesh.judge.convolution(large)
    return {
        "judge": difference(judge(small), judge.direct_sum(small)),
        OURS: difference(mesh.influence.apply(large), expected),
        **{name: difference(peer.displacement(large), expected) for name, peer in mesh.peers.items()},
    }


def run(campaign: Campaign, peers: Sequence[str]) -> dict[str, object]:
    """The whole benchmark as it stands in the file."""
    checked = checks(peers)
    rows = comparisons(campaign, peers) + growth(campaign) + sweeps(campaign)
    precise, reference_errors = precision(campaign, peers)
    return {
        "machine": measure.machine(),
        "versions": measure.versions(PACKAGES),
        "checks": {"displacement": checked, "reference_pressure": reference_errors},
        "summary": summary(rows, memory(campaign)),
        "rows": rows + precise,
    }


def _tell(rows: Sequence[Row]) -> None:
    times = ", ".join(f"{entry['method']} {1e3 * entry['seconds']:.3g} ms" for entry in rows)
    measure.say(f"{rows[0]['case']}: {times}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, required=True, help="the JSON file")
    parser.add_argument("--peers", action="store_true", help="beside the public solvers, which must be installed")
    parser.add_argument("--quick", action="store_true", help="tiny meshes, one turn each")
    parser.add_argument("--nodes", type=int, nargs="+", help="these meshes alone")
    arguments = parser.parse_args()
    missing = [name for name in ("tamaas", "ContactMechanics") if arguments.peers and find_spec(name) is None]
    if missing:
        parser.error(f"not installed: {', '.join(missing)}; `make benchmark PEERS=1` sets up an environment with them")
    campaign = QUICK if arguments.quick else Campaign()
    if arguments.nodes:
        nodes = tuple(arguments.nodes)
        campaign = Campaign(nodes, (), tuple(n for n in nodes if n in campaign.precise), nodes[:1])
    measure.write(arguments.output, run(campaign, tuple(PEERS) if arguments.peers else ()))


if __name__ == "__main__":
    main()
