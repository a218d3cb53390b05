"""Measure the contact solver against public solvers at equal residual, and on larger meshes alone.

One process, one thread, in turns. One judge computes the residual of every method. It shares no code with any solver
except Love's coefficients. The tolerance of a peer is first tuned for each case to the loosest one that meets that of
the case. Setting up operators and transforms is not timed. Sq, E* and the edge only set units.

Peers are used as documented, with their tolerance as the only setting. A peer is set up once for a mesh, and is then a
function of the problem, the mean pressure [Pa] at the solution, which some take as their input, and the setting. It
solves from a cold start and returns the pressure (nx, ny) [Pa], zero if the method failed.
"""

import contextlib
import io
import itertools
import statistics
from collections import defaultdict
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy import fft
from scipy.optimize import bisect

from roughslip.contact.influence import Influence, love_coefficients
from roughslip.contact.solve import solve
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of
from workflow.benchmarks.rows import OURS, Row, case, fields, make_row, power, race, write

MOST_ITERATIONS = 2000
STEP, MOST_TRIALS = 4.0, 10  # from one setting to the next: one or two iterations
TOLERANCES = (1e-6, 1e-10)

# Squares of the free half-space: m, m, and Pa, E* of steel against a rigid plane.
EDGE, RMS_HEIGHT, MODULUS = 100e-6, 0.5e-6, 2.3e11
SEED = 20260
SURFACES = {
    "gauss": covariance_of(kind="gaussian", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 16),
    "exp": covariance_of(kind="exponential", rms_height_m=RMS_HEIGHT, correlation_length_m=EDGE / 64),
}
LEVELS = ("5", "25", "50", "75", "95", "contact90")  # per cent of the heights above the plane, or of nodes in contact
# Nodes on an edge with the peers, of ours alone, and of the error of the pressure against time.
NODES, GROWING, PRECISE = (64, 128, 256, 512), (1024, 2048), (128, 256)
# The largest mesh on which a peer takes part, at the median and at other planes: what its time allows.
EXTENT = {"tamaas/load": (512, 256), "contactmechanics/bugnicourt": (512, 128), "polonsky-keer": (512, 128)}
SETTINGS = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-12)

Peer = Callable[["Problem", float, float], np.ndarray]


class Problem(NamedTuple):
    """A surface (nx, ny) [m] and the height of the plane [m]."""

    heights: np.ndarray
    plane: float

    @property
    def interference(self) -> np.ndarray:
        """(nx, ny) [m] u_bar, height of the surface over the plane."""
        return self.heights - self.plane


class Response:
    """u = B p of the free half-space from Love's coefficients, on a mesh of twice the size (Hockney's method).

    modulus, diagonal : E* [Pa], B_00 [m/Pa]
    """

    def __init__(self, grid: Grid, modulus: float) -> None:
        self.grid, self.modulus, self.size = grid, modulus, (2 * grid.nx, 2 * grid.ny)
        i, j = (np.abs(fft.fftfreq(n, 1 / n)).astype(int) % (n // 2) for n in self.size)  # offset n / 2 is never used
        self.symbol = fft.rfft2(love_coefficients(grid, modulus)[i[:, None], j])
        self.diagonal = float(fft.irfft2(self.symbol, self.size)[0, 0])

    def __call__(self, pressure: np.ndarray) -> np.ndarray:
        """Return displacements (nx, ny) [m] under pressures (nx, ny) [Pa]."""
        return fft.irfft2(fft.rfft2(pressure, self.size) * self.symbol, self.size)[: self.grid.nx, : self.grid.ny]

    def residual(self, problem: Problem, pressure: np.ndarray) -> float:
        """Return ||min(gap, B_00 p)|| / ||max(u_bar, 0)||: 1 without pressure, 0 at the solution."""
        unmet = np.minimum(self(pressure) - problem.interference, self.diagonal * pressure)
        return float(np.linalg.norm(unmet) / np.linalg.norm(np.maximum(problem.interference, 0.0)))


def polonsky_keer(_: Grid, displacement: Response) -> Peer:
    """Conjugate gradients in plain numpy, restarted at every node that comes into contact.

    Polonsky and Keer, Wear 231 (1999) 206, at fixed penetration: the gap is not shifted and the load is not scaled. As
    in the paper it ends when the pressures change by less than the setting times their sum.
    """

    def solve(problem: Problem, load: float, setting: float) -> np.ndarray:
        interference = problem.interference
        pressure = np.maximum(interference, 0.0) / displacement.diagonal
        direction, conjugate, before = np.zeros_like(pressure), False, 1.0
        for _ in range(MOST_ITERATIONS):
            gap = displacement(pressure) - interference
            contact = pressure > 0
            square = float((gap[contact] ** 2).sum())
            direction = np.where(contact, gap + conjugate * square / before * direction, 0.0)
            product = displacement(direction)
            length = float((gap * direction).sum() / (direction * product).sum())
            last, pressure = pressure, np.maximum(pressure - length * direction, 0.0)
            overlap = (pressure == 0) & (gap < 0)
            conjugate, before = not overlap.any(), square
            pressure[overlap] -= length * gap[overlap]
            if np.abs(pressure - last).sum() <= setting * pressure.sum():
                break
        return pressure

    return solve


def tamaas_load(grid: Grid, displacement: Response) -> Peer:
    """Tamaas' PolonskyKeerRey at the exact load, its best case, on the free half-space."""
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    sizes = [grid.nx * grid.dx, grid.ny * grid.dy]
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, sizes, list(grid.shape))
    model.E, model.nu = displacement.modulus, 0.0
    heights = np.zeros(grid.shape)  # each problem overwrites it
    solver = tamaas.PolonskyKeerRey(model, heights, 1e-10)
    tamaas.ModelFactory.registerNonPeriodic(model, "free")
    solver.setIntegralOperator("free")
    solver.max_iter = MOST_ITERATIONS

    def solve(problem: Problem, load: float, setting: float) -> np.ndarray:
        solver.tolerance = setting
        heights[...] = problem.heights
        model.traction[...] = 0.0
        try:
            solver.solve(load)
        except (ArithmeticError, RuntimeError):  # for example, a contact area of a single node
            model.traction[...] = 0.0
        return np.nan_to_num(np.array(model.traction))

    return solve


def contact_mechanics(grid: Grid, displacement: Response) -> Peer:
    """ContactMechanics: the dual problem at a given plane, by Bugnicourt's conjugate gradients without restart.

    The setting bounds the gap in contact over the largest interference.
    """
    import ContactMechanics
    from SurfaceTopography import Topography

    sizes = (grid.nx * grid.dx, grid.ny * grid.dy)
    substrate = ContactMechanics.FreeFFTElasticHalfSpace(grid.shape, displacement.modulus, sizes, fft="serial")

    def solve(problem: Problem, load: float, setting: float) -> np.ndarray:
        gap = setting * float(problem.interference.max())
        options = {"solver": "ccg-without-restart", "gtol": gap, "maxiter": MOST_ITERATIONS}
        with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            system = ContactMechanics.make_system(Topography(problem.heights, sizes), substrate)
            solution = system.dual_minimize_proxy(-problem.plane, np.zeros(grid.shape), **options)
        return np.nan_to_num(np.asarray(solution.x).reshape(grid.shape)) / grid.cell_area

    return solve


PEERS: dict[str, Callable[[Grid, Response], Peer]] = {
    "tamaas/load": tamaas_load,
    "contactmechanics/bugnicourt": contact_mechanics,
    "polonsky-keer": polonsky_keer,
}


def tune(
    peer: Peer, problem: Problem, load: float, tolerance: float, first: float, judge: Response
) -> tuple[float, float]:
    """Return the loosest setting of a peer that meets the tolerance, to STEP, and its residual.

    If no setting does, it is that of least residual. The search starts at `first`, which is loosened while it meets the
    tolerance, or else tightened until it does.
    """
    trials = [(first, judge.residual(problem, peer(problem, load, first)))]
    is_met = trials[0][1] <= tolerance
    while len(trials) < MOST_TRIALS and (trials[-1][1] <= tolerance) == is_met:
        setting = trials[-1][0] * (STEP if is_met else 1 / STEP)
        trials.append((setting, judge.residual(problem, peer(problem, load, setting))))
    return max((trial for trial in trials if trial[1] <= tolerance), default=min(trials, key=lambda trial: trial[1]))


def problem_of(influence: Influence, kind: str, level: str) -> Problem:
    """Return a surface, the same at every call, and its plane."""
    grid = influence.grid
    rng = np.random.default_rng([SEED, list(SURFACES).index(kind), *grid.shape])
    z = embed(SURFACES[kind], grid).sample(rng)
    if level != "contact90":
        return Problem(z, float(np.percentile(z, 100 - float(level))))

    def excess(plane: float) -> float:
        return solve(influence, z - plane, 1e-5).area_fraction - 0.9

    high, depth = float(z.min()), 8 * float(z.std())
    while excess(high - depth) < 0:
        high, depth = high - depth, 2 * depth
    return Problem(z, float(bisect(excess, high - depth, high, xtol=1e-3 * float(z.std()))))


def set_up(n: int, peers: Iterable[str]) -> tuple[Influence, Response, dict[str, Peer]]:
    """Return our operator, the judge's, and the peers of a square mesh of n x n nodes."""
    grid = Grid(n, n, EDGE / n, EDGE / n)
    displacement = Response(grid, MODULUS)
    return Influence(grid, MODULUS), displacement, {name: PEERS[name](grid, displacement) for name in peers}


def compare_solvers(n: int, cases: Iterable[tuple[str, str, float]], peers: Iterable[str]) -> list[Row]:
    """Return rows of cases (surface, level, tolerance) on a square mesh."""
    rows: list[Row] = []
    tuned: dict[tuple[str, str, str], float] = {}  # peer, surface, level: the setting last found, over the tolerance
    influence, displacement, solvers = set_up(n, [name for name in peers if n <= EXTENT[name][0]])
    for kind, level, tolerance in cases:
        name = case(n=n, surface=kind, level=level, tolerance=power(tolerance))
        problem = problem_of(influence, kind, level)
        load = solve(influence, problem.interference, 1e-12).mean_pressure
        calls, trials = {OURS: partial(solve, influence, problem.interference, tolerance)}, {}
        for peer, solver in solvers.items():
            if n <= EXTENT[peer][level != "50"]:
                first = tolerance * tuned.get((peer, kind, level), 30.0)
                trials[peer] = tune(solver, problem, load, tolerance, first, displacement)
                tuned[peer, kind, level] = trials[peer][0] / tolerance
                calls[peer] = partial(solver, problem, load, trials[peer][0])
        seconds, results = race(calls, least=3 if level == "50" else 1)
        ours, error = results[OURS], displacement.residual(problem, results[OURS].pressure)
        rows.append(make_row(name, OURS, error, seconds[OURS], ours.work, solver=ours.method))
        for peer, (setting, residual) in trials.items():
            rows.append(make_row(name, peer, residual, seconds[peer], setting=setting))
    return rows


def pressure_errors(n: int, peers: Iterable[str]) -> list[Row]:
    """Return rows of the relative error of the pressure at each method's own settings."""
    influence, _, solvers = set_up(n, peers)
    problem, name = problem_of(influence, "gauss", "50"), case(n=n, surface="gauss", level="50", quantity="pressure")
    reference = solve(influence, problem.interference, 1e-13).pressure
    load, calls = float(reference.mean()), {}
    for setting in SETTINGS:
        calls[OURS, setting] = partial(solve, influence, problem.interference, setting)
        calls |= {(peer, setting): partial(solver, problem, load, setting) for peer, solver in solvers.items()}
    seconds, results = race(calls)
    rows = []
    for (method, setting), solution in results.items():
        pressure, work = (solution.pressure, solution.work) if method == OURS else (solution, None)
        error = float(np.linalg.norm(pressure - reference) / np.linalg.norm(reference))
        rows.append(make_row(name, method, error, seconds[method, setting], work, setting=setting))
    return rows


def summarise_speed(rows: Iterable[Row]) -> dict[str, Any]:
    """Return by peer the geometric mean at each tolerance of its time over ours, and the least ratio.

    A ratio is the median over turns; methods that miss the tolerance of a case do not count.
    """
    met = [row for row in rows if row["error"] <= float(fields(row["case"])["tolerance"])]
    ours, summary = {row["case"]: row["turns"] for row in met if row["method"] == OURS}, {}
    for method in sorted({row["method"] for row in met} - {OURS}):
        ratios, groups = {}, defaultdict(list)
        for row in (row for row in met if row["method"] == method and row["case"] in ours):
            pairs = zip(row["turns"], ours[row["case"]], strict=False)
            ratios[row["case"]] = statistics.median(theirs / our for theirs, our in pairs)
            groups[fields(row["case"])["tolerance"]].append(ratios[row["case"]])
        worst = min(ratios, key=lambda name: ratios[name])
        means = {tolerance: statistics.geometric_mean(some) for tolerance, some in groups.items()}
        summary[method] = {"geometric_mean": means, "worst": {"case": worst, "ratio": ratios[worst]}}
    return summary


def measure(with_peers: bool) -> dict[str, object]:
    """Return summary and rows."""
    peers = tuple(PEERS) if with_peers else ()
    cases = list(itertools.product(SURFACES, LEVELS, TOLERANCES))
    rows = [row for n in NODES for row in compare_solvers(n, cases, peers)]
    more = [row for n in GROWING for row in compare_solvers(n, [("gauss", "50", TOLERANCES[-1])], ())]
    more += [row for n in PRECISE for row in pressure_errors(n, peers)]
    return {"summary": {"times_faster_than": summarise_speed(rows)}, "rows": rows + more}


if __name__ == "__main__":
    write("contact", measure)
