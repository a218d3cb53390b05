"""Periodic cells under a load: closed forms, several loads. Pressures limited to the hardness."""

import math

import numpy as np
import pytest

from roughslip.contact import conjugate_gradients, solve_loads
from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solve import ContactSolution, solve_load
from roughslip.errors import ParameterError
from roughslip.grid import Grid
from tests.contact.closed_forms import SineWave, light_area, open_area
from tests.contact.test_closed_forms import self_affine

MODULUS = 7e10


def sine_wave(load: float) -> SineWave:
    return SineWave(2e-7, 3e-5, load, MODULUS)


def press_wave(wave: SineWave, n: int, shift: float) -> tuple[ContactSolution, np.ndarray]:
    """n cells a wavelength along x, the crest a shift [cells] off the middle between two nodes; pressures on the
    nodes."""
    grid = Grid(n, 1, wave.wavelength / n, wave.wavelength / n)
    x = grid.x() - wave.wavelength / 2 - shift * grid.dx
    solution = solve_load(Influence(grid, MODULUS, periodic=True), wave.heights(x)[:, None], wave.mean_pressure)
    return solution, wave.pressure(x)


@pytest.mark.parametrize("load", [0.3, 0.5, 0.8])
def test_sine_wave_orders_of_convergence(load: float) -> None:
    """Over sixteen shifts of the mesh, which pass every position of the edge between two nodes. Root mean square error
    of the pressure: sqrt(h) on a share h of the wave, order one in L2. Three doublings are taken together, because the
    error triples where an edge meets a node. Mean error of the plane: order two, that of the symbol."""
    wave = sine_wave(load)
    errors = []
    for n in (32, 64, 128, 256):
        pressed = [press_wave(wave, n, (k + 0.5) / 16) for k in range(16)]
        squares = [np.sum((one.pressure[:, 0] - exact) ** 2) / np.sum(exact**2) for one, exact in pressed]
        planes = [solution.plane - wave.plane for solution, _ in pressed]
        errors.append((math.sqrt(np.mean(squares)), np.mean(planes)))
    halvings = np.log2(errors)
    assert (halvings[0, 0] - halvings[-1, 0]) / 3 == pytest.approx(1.0, abs=0.15)
    np.testing.assert_allclose(-np.diff(halvings[:, 1]), 2.0, atol=0.15)


@pytest.mark.parametrize("shape", [(24, 40), (15, 9), (32, 1)])
def test_smooth_heights_have_exact_pressures_in_full_contact(shape: tuple[int, int]) -> None:
    """p + E* |q| z_q / 2 for every wave up to four cells, to the residual of 1e-12 times the condition of B, 50."""
    grid = Grid(*shape, 1e-6, 0.7e-6)
    generator, waves, pressures = np.random.default_rng(4), np.zeros(shape), np.zeros(shape)
    phases = (2 * np.pi * np.arange(nodes) / nodes for nodes in shape)
    x, y = np.meshgrid(*phases, indexing="ij")
    for i, j in [(1, 0), (2, -1), (0, shape[1] // 4), (shape[0] // 4, 1)] if shape[1] > 1 else [(1, 0), (8, 0)]:
        wave = generator.normal() * np.cos(i * x + j * y + generator.random())
        q = 2 * np.pi * np.hypot(i / (shape[0] * grid.dx), j / (shape[1] * grid.dy))
        waves, pressures = waves + 1e-7 * wave, pressures + MODULUS * q / 2 * 1e-7 * wave
    mean = 2 * np.abs(pressures).max()
    heights = cell_heights(waves, grid)
    assert heights.mean() == pytest.approx(waves.mean(), abs=1e-20)
    solution = solve_load(Influence(grid, MODULUS, periodic=True), heights, mean, 1e-12)
    np.testing.assert_allclose(solution.pressure, mean + pressures, rtol=0, atol=1e-10 * mean)


def press_crossed_waves(n: int, load: float, shift: tuple[float, float]) -> float:
    """Share of the area in contact, on one cell of D/2 (cos x' + cos y'): the crossed waves turned by 45 degrees."""
    amplitude, full = 1e-6, math.pi * MODULUS * 1e-2  # sqrt(2) pi E* D / l with l = sqrt(2) 1e-4
    grid = Grid(n, n, 1e-4 / n, 1e-4 / n)
    x, y = ((np.arange(n) + offset) * 2 * np.pi / n for offset in shift)
    heights = amplitude / 2 * (np.cos(x)[:, None] + np.cos(y))
    influence = Influence(grid, MODULUS, periodic=True)
    return solve_load(influence, heights, load * full, 1e-8).shares.mean()


def mean_area(n: int, load: float) -> float:
    return float(np.mean([press_crossed_waves(n, load, shift) for shift in [(0.13, 0.37), (0.4, 0.2)]]))


@pytest.mark.parametrize("load", [1e-3, 1e-2])
def test_light_contact_of_crossed_waves(load: float) -> None:
    """A = A_0 (1 + 4 pi A_0 / 15 + O(p)) with A_0 the limit of Johnson, Greenwood and Higginson. The second term
    follows from the next order of the crest, -D k^4 r^4 / 64 on average over directions, with k = 2 pi / l'. A body c_2
    r^2 - c_4 r^4 carries 4/3 E* a^3 / R (1 - (k a)^2 / 10) (Sneddon). Neighbours act from order a^3, that is p, on. A
    circle of shares is right to 0.01 cells here, for which 0.03 are allowed; one of nodes is too large by 0.12."""
    n, limit = 256, light_area(load)
    radius_in_cells = n * math.sqrt(limit / math.pi)
    expected = limit * (1 + 4 * math.pi / 15 * limit)
    assert mean_area(n, load) == pytest.approx(expected, rel=2 * 0.03 / radius_in_cells + load)


@pytest.mark.parametrize("load", [0.9, 0.98])
def test_nearly_full_contact_of_crossed_waves(load: float) -> None:
    """1 - A = G_0 (1 + 4 pi G_0 / 20 + O((1 - p/p*)^3/2)) with G_0 the limit of Johnson, Greenwood and Higginson.
    The second term follows from the next order of the wave. A crack of radius b that closes under it has
    1 - p/p* = (k b)^2 / 6 - (k b)^4 / 120. Other cracks act from order b^3 on. 0.06 cells
    are allowed for the edge."""
    n, limit = 256, open_area(load)
    radius_in_cells = n * math.sqrt(limit / math.pi)
    expected = limit * (1 + 4 * math.pi / 20 * limit)
    tolerance = 2 * 0.06 / radius_in_cells + (1 - load) ** 1.5
    assert 1 - mean_area(n, load) == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("load", [0.01, 0.1, 0.5, 0.9])
def test_area_of_a_fully_plastic_contact_is_load_over_hardness(surface, load: float) -> None:
    """At E* h' / H = 3000. Shares count a cell by p / H at least, so that only edges with less than their share of H
    are counted in excess. These are few: 0.5 % of the area is allowed. Loads are shares of the hardness."""
    heights, hardness = surface((64, 48), 6.0, 3), 1e-4
    influence = Influence(Grid(64, 48, 1.0, 1.0), 1.0, periodic=True)
    found = solve_load(influence, heights, load * hardness, 1e-8, hardness_pa=hardness)
    assert 0 <= found.pressure.min() <= found.pressure.max() == hardness
    assert found.pressure.mean() == pytest.approx(load * hardness, rel=1e-11)
    assert found.area_fraction >= load * (1 - 1e-11)
    assert found.shares.mean() == pytest.approx(load, rel=5e-3)


@pytest.mark.parametrize(("shape", "hardness"), [((40, 36), math.inf), ((80, 72), 0.6)])
def test_several_loads(surface, shape: tuple[int, int], hardness: float) -> None:
    """In any order and repeated, with bits that do not depend on it, and equal to single solves to the tolerance.
    The smaller mesh always starts from the loads below, the larger one where they are close."""
    influence, heights = Influence(Grid(*shape, 1.0, 1.0), 1.0, periodic=True), surface(shape, 5.0, 1)
    loads = [0.05, 0.06, 0.02, 0.3, 0.06, 0.055]
    found = solve_loads(influence, heights, loads, 1e-9, hardness)
    for load, one in zip(loads, found, strict=True):
        alone = solve_load(influence, heights, load, 1e-9, hardness_pa=hardness)
        assert one.pressure.mean() == pytest.approx(load, rel=1e-11)
        assert one.residual <= 1e-9
        np.testing.assert_allclose(one.pressure, alone.pressure, rtol=0, atol=1e-6 * alone.pressure.max())
    areas = np.array([one.shares.mean() for one in found])
    assert (np.diff(areas[np.argsort(loads)]) >= 0).all()
    again = solve_loads(influence, heights, np.array(sorted(loads)), 1e-9, hardness)
    for one, other in zip(sorted(found, key=lambda s: s.mean_pressure), again, strict=True):
        np.testing.assert_array_equal(one.pressure, other.pressure)
    warm, cold = (
        sum(s.work for s in solve_loads(influence, heights, some, 1e-5)) for some in (np.linspace(0.1, 0.2, 9), [0.15])
    )
    assert warm < 0.9 * 9 * cold


def test_loads_that_nothing_bears_are_refused_before_a_solve(monkeypatch) -> None:
    """More than the hardness on the whole area; full contact; no contact. One of several refuses all."""
    influence, heights = Influence(Grid(8, 8, 1.0, 1.0), 1.0, periodic=True), np.arange(64.0).reshape(8, 8)
    monkeypatch.setattr(conjugate_gradients, "solve", lambda *_: pytest.fail("solved"))
    for load, line in ((1.01, "or of more"), (1.0, "load of full contact"), (0.0, "load of no contact")):
        with pytest.raises(ParameterError, match=line):
            solve_loads(influence, heights, [0.5, load], hardness_pa=1.0)


def rough(index: float, load: float) -> ContactSolution:
    """A periodic cell of ten waves under a load p / (E* h'), E* = 1, that yields at h' / index."""
    grid, hardness = Grid(80, 80, 1.0, 1.0), 1 / index if index else math.inf
    heights = cell_heights(self_affine(10, 4, 80, 0.8, 3), grid)
    return solve_load(Influence(grid, 1.0, periodic=True), heights, load, 1e-8, hardness)


def test_the_share_of_the_real_area_at_the_hardness() -> None:
    """None at an index of 0.3. At 1, Persson's exp(-2) of the elastic area is above H at most. What yields gives load
    to neighbours: more than that yields, up to twice as much."""
    assert rough(0.0, 0.02).yielded_share == rough(0.3, 0.02).yielded_share == 0.0
    elastic, yielding = rough(0.0, 0.02), rough(1.0, 0.02)
    above = np.count_nonzero(elastic.pressure > 1.0) / elastic.shares.sum()
    assert 0.01 < above < math.exp(-2.0)
    assert above < yielding.yielded_share < 2 * above
    assert yielding.shares.mean() > elastic.shares.mean()
