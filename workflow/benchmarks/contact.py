"""Measure the contact solver against public solvers at equal residual, and on larger meshes alone.

One process, one thread, in turns. One judge computes the residual of every method (contact_problem.Judge). The
tolerance of a peer is first tuned for each case to the loosest one that meets that of the case. Setting up operators
and transforms is not timed.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve
from workflow.benchmarks.contact_peers import PEERS, tune
from workflow.benchmarks.contact_problem import LEVELS, MODULUS, Judge, Problem, plane_height, square, surface
from workflow.benchmarks.runner import OURS, make_row, race, report_progress, report_rows, run_command, summarise_speed
from workflow.evidence.rows import Row, case, fields, power

PACKAGES = ("ducc0", "tamaas", "ContactMechanics", "NuMPI", "muGrid", "SurfaceTopography")

# The largest mesh on which a peer takes part, at the median and at other planes: what its time allows.
EXTENT = {"tamaas/load": (512, 256), "contactmechanics/bugnicourt": (512, 128), "polonsky-keer": (512, 128)}

REFERENCE_TOLERANCE = 1e-12
SETTINGS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)


class Sizes(NamedTuple):
    """What is measured, and on which meshes.

    nodes : with the peers, every surface, level and tolerance
    growing : ours alone, at the median of the smooth surface
    precise : pressure error against time
    quick : one turn each
    """

    nodes: tuple[int, ...] = (64, 128, 256, 512)
    growing: tuple[int, ...] = (1024, 2048)
    precise: tuple[int, ...] = (128, 256)
    tolerances: tuple[float, ...] = (1e-6, 1e-10)
    levels: tuple[str, ...] = LEVELS
    quick: bool = False


QUICK = Sizes((32,), (48,), (32,), levels=("50", "contact90"), quick=True)


class Mesh:
    """What is set up once for a mesh: our operator, the judge, the peers."""

    def __init__(self, n: int, peers: Iterable[str]) -> None:
        grid = square(n)
        self.influence, self.judge = Influence(grid, MODULUS), Judge(grid)
        self.peers = {name: PEERS[name](grid) for name in peers if n <= EXTENT[name][0]}

    def problem(self, kind: str, level: str) -> Problem:
        heights = surface(kind, self.influence.grid)
        return Problem(self.influence.grid, heights, plane_height(level, heights, self.influence))

    def solve(self, problem: Problem, tolerance: float) -> ContactSolution:
        return solve(self.influence, problem.interference, tolerance)


def cases(sizes: Sizes) -> list[tuple[int, str, str, float]]:
    """Return nodes on an edge, surface, level and tolerance of every case: 10 x 10 nodes of white heights first."""
    kinds = [(10, "white")] + [(n, kind) for n in sizes.nodes for kind in ("gauss", "exp")]
    found = [(*kind, level, one) for kind in kinds for level in sizes.levels for one in sizes.tolerances]
    return found + [(n, "gauss", "50", sizes.tolerances[-1]) for n in sizes.growing]


def compare_solvers(sizes: Sizes, peers: Sequence[str]) -> list[Row]:
    """Return the rows of every case."""
    rows: list[Row] = []
    tuned: dict[tuple[str, str, str], float] = {}  # peer, surface, level: the setting last found, over the tolerance
    for n, of_mesh in itertools.groupby(cases(sizes), key=lambda entry: entry[0]):
        mesh = Mesh(n, () if n in sizes.growing else peers)
        for _, kind, level, tolerance in of_mesh:
            takes_part = [peer for peer in mesh.peers if n <= EXTENT[peer][level != "50"]]
            first = {peer: tolerance * tuned.get((peer, kind, level), 30.0) for peer in takes_part}
            name = case(n=n, surface=kind, level=level, tolerance=power(tolerance))
            found = compare_on_case(mesh, mesh.problem(kind, level), name, tolerance, first, sizes.quick)
            tuned |= {(r["method"], kind, level): r["setting"] / tolerance for r in found if "setting" in r}
            rows += found
            report_rows(found)
    return rows


def compare_on_case(
    mesh: Mesh, problem: Problem, name: str, tolerance: float, first: dict[str, float], quick: bool
) -> list[Row]:
    """Return the rows of one case. `first` maps each peer that takes part to the setting where its tuning starts."""
    load = mesh.solve(problem, REFERENCE_TOLERANCE).mean_pressure
    calls, trials = {OURS: partial(mesh.solve, problem, tolerance)}, {}
    for peer, start in first.items():
        trials[peer] = tune(mesh.peers[peer], problem, load, tolerance, start, mesh.judge)
        calls[peer] = partial(mesh.peers[peer].solve, problem, load, trials[peer].setting)
    seconds, results = race(calls, quick, least=3 if fields(name)["level"] == "50" else 1)
    ours = results[OURS]
    error = mesh.judge.residual(problem, ours.pressure)
    return [
        make_row(name, OURS, error, seconds[OURS], ours.work, solver=ours.method),
        *(make_row(name, p, t.residual, seconds[p], t.work, setting=t.setting) for p, t in trials.items()),
    ]


def pressure_errors(sizes: Sizes, peers: Sequence[str]) -> list[Row]:
    """Return rows of the relative error of the pressure at each method's own settings."""
    rows = []
    for n in sizes.precise:
        mesh = Mesh(n, peers)
        problem = mesh.problem("gauss", "50")
        name = case(n=n, surface="gauss", level="50", quantity="pressure")
        reference = mesh.solve(problem, 1e-13).pressure
        load = float(reference.mean())
        calls, answers = {}, {}
        for setting in SETTINGS:
            ours = mesh.solve(problem, setting)
            calls[OURS, setting] = partial(mesh.solve, problem, setting)
            answers[OURS, setting] = ours.pressure, ours.work
            for peer, solver in mesh.peers.items():
                calls[peer, setting] = partial(solver.solve, problem, load, setting)
                answers[peer, setting] = solver.solve(problem, load, setting, counting=True)
        for (method, setting), turns in race(calls, sizes.quick)[0].items():
            pressure, work = answers[method, setting]
            error = float(np.linalg.norm(pressure - reference) / np.linalg.norm(reference))
            rows.append(make_row(name, method, error, turns, work, setting=setting))
        report_progress(name)
    return rows


def measure_sizes(sizes: Sizes, peers: Sequence[str]) -> dict[str, object]:
    """Return the summary and the rows of these sizes. The summary lists 10 x 10 nodes, a direct solve, separately."""
    rows = compare_solvers(sizes, peers)
    small = [row for row in rows if fields(row["case"])["n"] == "10"]
    summary = {
        "times_faster_than": summarise_speed([row for row in rows if row not in small]),
        "times_faster_than_on_10_x_10": summarise_speed(small),
    }
    return {"summary": summary, "rows": rows + pressure_errors(sizes, peers)}


def measure(quick: bool, peers: bool) -> dict[str, object]:
    """Return the summary and the rows."""
    return measure_sizes(QUICK if quick else Sizes(), tuple(PEERS) if peers else ())


if __name__ == "__main__":
    run_command(__doc__, measure, PACKAGES, ("tamaas", "ContactMechanics"))
