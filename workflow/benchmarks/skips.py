"""Measure what skipped work saves: each problem as the code solves it, and with everything computed, in turns.

Each kind of skip that costs.json counts is a case. Its tolerance is 0 if the result must be the same to the bit. The
error of a row of `roughslip` is the difference of its result from that of `roughslip/plain`.

Expansions are not the same to the bit: a fit without terms that are zero by symmetry has less scatter, and fewer solves
have the error that was asked. Their tolerance is the error that the expansion estimates of itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np

from roughslip.chaos.distribution import kolmogorov_distance
from roughslip.chaos.enrichment import enrich
from roughslip.chaos.local import LocalExpansion, Samples, fit_local, jackknife_deviations
from roughslip.contact.solve import solve
from roughslip.friction.recursion import PIECE_NODES, recursion
from roughslip.oscillator.limits import counts_by_period
from roughslip.oscillator.motion import Motion, MotionOptions, ensemble_counts, simulate
from roughslip.oscillator.path import KeptPath
from roughslip.stages.from_scene import geometry, mass_on_belt
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks.chaos_problem import MEDIAN, Square
from workflow.benchmarks.oscillator import LAW, PROCESS, SEED, STUDY
from workflow.benchmarks.runner import OURS, is_met, make_row, race, report_rows, run_command, time_ratios
from workflow.benchmarks.skips_contact import Skip, contact_skips
from workflow.evidence.rows import Row, case, fields, power

PLAIN = f"{OURS}/plain"
SIGMAS = 3.0  # of the estimated error of the mean
DRAWS = 2**15
TOLERANCE = 1e-6  # of motions, as in the scenes
DAMPING = (0.05, 0.1, 0.17, 0.23, 0.27, 0.3, 0.32, 0.36)
# First passages are accurate to 1e-12 of tau (oscillator/stick.py), and all cycles depart at one point.
PASSAGE = 1e-9


def samples_of(square: Square, xi: np.ndarray) -> Samples:
    """Return the surfaces of xi (K, M), solved at the median."""
    pressure, gap = np.empty((2, len(xi), len(square.nodes.x)))
    for row, one in enumerate(xi):
        found = solve(square.influence, square.surface(one) - square.planes[MEDIAN], 1e-10)
        pressure[row], gap[row] = (field[square.nodes.x, square.nodes.y] for field in (found.pressure, found.gap))
    variables = np.einsum("km,nvm->knv", xi, square.directions)
    return Samples(variables, square.nodes.distance2, pressure, gap, square.odd)


def drawn(square: Square, expansion: LocalExpansion, left_out: bool = False) -> np.ndarray:
    """Return pressures of the same draws for every expansion."""
    generator = np.random.default_rng([square.seed, geometry.STREAM_DRAWS])
    return expansion.draw(generator, DRAWS, left_out=left_out)


def expansion_skips(surfaces: int, scene: str, asked: float, most: int) -> Iterator[Skip]:
    """Yield terms, of so many surfaces of the paper's square, and solves of a scene for a Kolmogorov error."""
    yield _symmetric_terms(Square.of("paper"), surfaces)
    yield _enough_solves(Square.of(scene), asked, most)


def _symmetric_terms(square: Square, surfaces: int) -> Skip:
    degree = square.scene.expansion.degree
    samples = samples_of(square, square.design("latin_hypercube", surfaces, 0))
    every = replace(samples, odd=np.zeros((0, 0), dtype=np.int64))
    members = drawn(square, fit_local(every, degree, square.target), left_out=True).mean(axis=1)
    estimated = float(np.linalg.norm(jackknife_deviations(members[1:]))) / members[0]

    def fit(of: Samples) -> tuple[np.ndarray, int]:
        found = fit_local(of, degree, square.target)
        return drawn(square, found), len(found.indices)

    return Skip(
        skip_reasons.SYMMETRIC,
        f"paper-{surfaces}-surfaces",
        SIGMAS * estimated,
        lambda: fit(samples),
        lambda: fit(every),
        lambda one, other: abs(float(one.mean() / other.mean()) - 1.0),
    )


def _enough_solves(square: Square, asked: float, most: int) -> Skip:
    degree = square.scene.expansion.degree

    def solved(first: int, last: int) -> Samples:
        return samples_of(square, square.design("sobol", last, 0)[first:])

    def fit(of: Samples) -> tuple[LocalExpansion, Samples]:
        return fit_local(of, degree, square.target), of

    def until_accurate() -> tuple[np.ndarray, int]:
        found = enrich(solved, fit, asked, least=128, most=most, seed=[square.seed, geometry.STREAM_ENRICHMENT])
        return drawn(square, found.expansion), len(found.samples.pressure)

    def all_of_them() -> tuple[np.ndarray, int]:
        return drawn(square, fit(solved(0, most))[0]), most

    name = f"{square.name}-to-{asked:g}"
    return Skip(skip_reasons.ENOUGH_SOLVES, name, asked, until_accurate, all_of_them, kolmogorov_distance)


def motion_skips(periods: float, nodes: int) -> Iterator[Skip]:
    """Yield every skip of the oscillator over so many natural periods.

    nodes : of a correlation length of the friction path
    """
    yield Skip(
        skip_reasons.BY_PERIOD,
        f"{len(DAMPING)}-dampings-{periods:g}-periods",
        0.0,
        lambda: _counted(counts_by_period(STUDY, LAW, periods, DAMPING, MotionOptions(TOLERANCE))),
        lambda: _counted(ensemble_counts(STUDY, LAW, None, 0.0, periods, DAMPING, MotionOptions(TOLERANCE))),
        _different_counts,
    )
    yield Skip(
        skip_reasons.STICK,
        f"slow-belt-{periods:g}-periods",
        PASSAGE,
        lambda: _events(_on_slow_belt("slip", periods)),
        lambda: _events(_on_slow_belt("belt", periods)),
        lambda one, other: float(np.max(np.abs(one - other)) / np.max(other)),
    )
    paths = recursion(PROCESS, PROCESS.correlation_length_m / nodes)

    def run(path: Any) -> tuple[np.ndarray, int]:
        return _counted(ensemble_counts(STUDY, LAW, path, paths.spacing, periods, DAMPING, MotionOptions(TOLERANCE)))

    def kept() -> tuple[np.ndarray, int]:
        return run(KeptPath(paths.realisation([SEED, 0])))

    def drawn_whole() -> tuple[np.ndarray, int]:
        whole = int(np.ceil(mass_on_belt.path_length(STUDY, periods) / paths.spacing)) + 2
        return run(np.concatenate(list(islice(paths.realisation([SEED, 0]), -(-whole // PIECE_NODES)))))

    name = f"{len(DAMPING)}-dampings-{periods:g}-periods-{nodes}-nodes"
    drawn_again = lambda: run(paths.realisation([SEED, 0]))  # noqa: E731
    yield Skip(skip_reasons.KEPT, name, 0.0, kept, drawn_again, _different_counts)
    yield Skip(skip_reasons.UNREAD, name, 0.0, kept, drawn_whole, _different_counts)


def _on_slow_belt(follows: str, periods: float) -> Motion:
    """Return the motion at a tenth of the velocity, where the mass sticks most of the time.

    With `belt` the end of stick is searched on the path, here a constant one; with `slip` it has a closed form.
    """
    slow = replace(STUDY, belt_velocity_m_per_s=0.1 * STUDY.belt_velocity_m_per_s)
    return simulate(slow, LAW, None, 0.0, periods, MotionOptions(TOLERANCE, friction_follows=follows))


def _counted(counts: Any) -> tuple[np.ndarray, int]:
    return np.array([counts.cycles, counts.micro_slips]), counts.steps


def _events(motion: Motion) -> tuple[np.ndarray, int]:
    return motion.time, motion.steps


def _different_counts(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.count_nonzero(one != other))


@dataclass(frozen=True)
class Sizes:
    """What is measured.

    nodes : on an edge of the squares
    strip : nodes on the length of a strip
    periods : natural periods of a motion
    path_nodes : nodes of a correlation length of its path
    surfaces : of the paper's square, solved for an expansion
    square : scene of the other square
    asked : its Kolmogorov error
    most : the most surfaces solved for it
    """

    nodes: int = 256
    strip: int = 960
    periods: float = 100.0
    path_nodes: int = 8
    surfaces: int = 1000
    square: str = "resolved"
    asked: float = 0.02
    most: int = 2048


QUICK = Sizes(128, 240, 10.0, 4, 300, "paper", 0.03, 512)


def all_skips(sizes: Sizes) -> Iterator[Skip]:
    """Yield every measured skip."""
    yield from contact_skips(sizes.nodes, sizes.strip)
    yield from expansion_skips(sizes.surfaces, sizes.square, sizes.asked, sizes.most)
    yield from motion_skips(sizes.periods, sizes.path_nodes)


def compare(skip: Skip, quick: bool) -> list[Row]:
    """Return the rows of a skip: as the code solves its problem, and with everything computed."""
    seconds, results = race({OURS: skip.skipping, PLAIN: skip.plain}, quick, least=3)
    errors = {OURS: skip.difference(results[OURS][0], results[PLAIN][0]), PLAIN: 0.0}
    tolerance = power(float(f"{skip.tolerance:.1e}"))
    name = case(skip=skip.reason.replace(" ", "-"), problem=skip.problem, tolerance=tolerance)
    rows = [make_row(name, method, errors[method], seconds[method], results[method][1]) for method in results]
    report_rows(rows)
    return rows


def measure(quick: bool, _: bool) -> dict[str, Any]:
    """Return the summary and the rows."""
    rows = [row for skip in all_skips(QUICK if quick else Sizes()) for row in compare(skip, quick)]
    ratios = time_ratios(rows).get(PLAIN, {})
    summary = {
        "times_as_fast": {fields(name)["skip"]: ratio for name, ratio in ratios.items()},
        "unchanged": all(is_met(row) for row in rows),
    }
    return {"summary": summary, "rows": rows}


if __name__ == "__main__":
    run_command(__doc__, measure)
