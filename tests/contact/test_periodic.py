"""Periodic cells under load control against closed forms: sine wave, crossed waves, a rigid flat."""

import math

import numpy as np
import pytest

from roughslip.contact.closed_forms import CrossedWaves, SineWave
from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from roughslip.errors import ParameterError
from roughslip.grid import Grid

MODULUS = 7e10


def sine_wave(load: float) -> SineWave:
    return SineWave(2e-7, 3e-5, MODULUS, load * math.pi * MODULUS * 2e-7 / 3e-5)


def press_wave(wave: SineWave, n: int, shift: float) -> tuple[ContactSolution, np.ndarray]:
    """n cells a wavelength along x, the crest a shift [cells] off the middle between two nodes; pressures on the
    nodes."""
    grid = Grid(n, 1, wave.wavelength_m / n, wave.wavelength_m / n)
    x = grid.x() - wave.wavelength_m / 2 - shift * grid.dx
    heights = wave.amplitude_m * np.cos(2 * np.pi * x / wave.wavelength_m)
    solution = solve_load(Influence(grid, MODULUS, periodic=True), heights[:, None], wave.mean_pressure_pa)
    return solution, wave.pressure_pa(x)


def relative_l2(field: np.ndarray, exact: np.ndarray) -> float:
    return float(np.linalg.norm(field - exact) / np.linalg.norm(exact))


def test_sine_wave() -> None:
    """256 cells, mean pressure half of p*, the crest between two nodes, so that the edges of contact, a quarter of
    the wavelength from it, fall between nodes as well. Pressure: order one in h as its root at the edge is not
    resolved, see below; measured 1.18e-3 (1.32e-3 on average over shifts of the mesh, 3.1e-3 at most, with the edge on
    a node, where the exact pressure is zero). Plane and energy: order two, measured 1e-5."""
    wave = sine_wave(0.5)
    solution, exact = press_wave(wave, 256, 0.0)
    assert relative_l2(solution.pressure[:, 0], exact) < 1.2e-3
    assert solution.area_fraction == pytest.approx(wave.area_fraction, rel=1e-14)
    assert solution.pressure.mean() == pytest.approx(wave.mean_pressure_pa, rel=1e-9)
    assert solution.plane == pytest.approx(wave.plane_m, abs=2e-5 * wave.amplitude_m)
    influence = Influence(Grid(256, 1, wave.wavelength_m / 256, wave.wavelength_m / 256), MODULUS, periodic=True)
    energy = 0.5 * np.mean(solution.pressure * influence.apply(solution.pressure))
    assert energy == pytest.approx(wave.elastic_energy_j_m2, rel=1e-4)


@pytest.mark.parametrize("load", [0.3, 0.5, 0.8])
def test_sine_wave_orders_of_convergence(load: float) -> None:
    """Over sixteen shifts of the mesh, which pass every position of the edge between two nodes. Root mean square
    error of the pressure: sqrt(h) on a share h of the wave, order one in L2; three doublings together, as it triples
    where an edge meets a node, which sixteen shifts catch unevenly. Mean error of the plane: order two, that of the
    symbol."""
    wave = sine_wave(load)
    errors = []
    for n in (32, 64, 128, 256):
        pressed = [press_wave(wave, n, (k + 0.5) / 16) for k in range(16)]
        squares = [relative_l2(solution.pressure[:, 0], exact) ** 2 for solution, exact in pressed]
        planes = [solution.plane - wave.plane_m for solution, _ in pressed]
        errors.append((math.sqrt(np.mean(squares)), np.mean(planes)))
    halvings = np.log2(errors)
    assert (halvings[0, 0] - halvings[-1, 0]) / 3 == pytest.approx(1.0, abs=0.15)
    np.testing.assert_allclose(-np.diff(halvings[:, 1]), 2.0, atol=0.15)


def test_full_contact() -> None:
    """Beyond p* the pressure is p + p* cos(q x) but for the symbol's (q h)^2 / 24 = 2.5e-5 at 256 cells."""
    wave = sine_wave(1.0)
    grid = Grid(256, 1, wave.wavelength_m / 256, 1e-6)
    phase = 2 * np.pi * grid.x()[:, None] / wave.wavelength_m
    mean = 1.5 * wave.full_contact_pressure_pa
    solution = solve_load(Influence(grid, MODULUS, periodic=True), wave.amplitude_m * np.cos(phase), mean)
    exact = mean + wave.full_contact_pressure_pa * np.cos(phase)
    assert solution.area_fraction == 1
    np.testing.assert_allclose(solution.pressure, exact, rtol=0, atol=3e-5 * wave.full_contact_pressure_pa)
    assert abs(solution.plane) < 1e-9 * wave.amplitude_m


def test_wave_along_either_axis_on_any_cells() -> None:
    """A wave that does not vary across is the same problem on every mesh across, and along y as along x."""
    wave = sine_wave(0.4)
    along, _ = press_wave(wave, 32, 0.25)
    dx = wave.wavelength_m / 32
    x = (np.arange(32) + 0.5 - 16 - 0.25) * dx
    heights = wave.amplitude_m * np.cos(2 * np.pi * x / wave.wavelength_m)
    for ny, dy in [(3, dx), (4, 20 * dx), (5, 0.05 * dx)]:
        square = np.repeat(heights[:, None], ny, axis=1)
        for grid, surface in [(Grid(32, ny, dx, dy), square), (Grid(ny, 32, dy, dx), square.T)]:
            solution = solve_load(Influence(grid, MODULUS, periodic=True), surface, wave.mean_pressure_pa)
            pressure = solution.pressure if grid.nx == 32 else solution.pressure.T
            np.testing.assert_allclose(
                pressure, np.repeat(along.pressure, ny, axis=1), rtol=0, atol=1e-8 * along.pressure.max()
            )
            assert solution.plane == pytest.approx(along.plane, abs=1e-8 * wave.amplitude_m)


def press_crossed_waves(n: int, load: float, shift: tuple[float, float]) -> float:
    """Share of nodes in contact, on one cell of D/2 (cos x' + cos y'): the crossed waves turned by 45 degrees."""
    waves = CrossedWaves(1e-6, math.sqrt(2) * 1e-4, MODULUS)
    grid = Grid(n, n, 1e-4 / n, 1e-4 / n)
    x, y = ((np.arange(n) + offset) * 2 * np.pi / n for offset in shift)
    heights = waves.amplitude_m / 2 * (np.cos(x)[:, None] + np.cos(y))
    influence = Influence(grid, MODULUS, periodic=True)
    return solve_load(influence, heights, load * waves.full_contact_pressure_pa, 1e-8).area_fraction


def mean_area(n: int, load: float) -> float:
    return float(np.mean([press_crossed_waves(n, load, shift) for shift in [(0.13, 0.37), (0.4, 0.2)]]))


@pytest.mark.parametrize("load", [1e-3, 1e-2])
def test_light_contact_of_crossed_waves(load: float) -> None:
    """A = A_0 (1 + 4 pi A_0 / 15 + O(p)) with A_0 the limit of Johnson, Greenwood and Higginson. The second term
    follows from the crest's next order, -D k^4 r^4 / 64 on average over directions, k = 2 pi / l': a body c_2 r^2 -
    c_4 r^4 bears 4/3 E* a^3 / R (1 - (k a)^2 / 10) (Sneddon). Neighbours act from order a^3, that is p, on. A
    counted circle is too large by 0.12 cells (as in Hertz's contact; 0.15 and 0.12 here), for which 0.2 are allowed."""
    n, waves = 256, CrossedWaves(1.0, 1.0, 1.0)
    limit = waves.light_area_fraction(load * waves.full_contact_pressure_pa)
    radius_in_cells = n * math.sqrt(limit / math.pi)
    expected = limit * (1 + 4 * math.pi / 15 * limit)
    assert mean_area(n, load) == pytest.approx(expected, rel=2 * 0.2 / radius_in_cells + load)


@pytest.mark.parametrize("load", [0.9, 0.98])
def test_nearly_full_contact_of_crossed_waves(load: float) -> None:
    """1 - A = G_0 (1 + 4 pi G_0 / 20 + O((1 - p/p*)^3/2)) with G_0 the limit of Johnson, Greenwood and Higginson.
    The second term follows again from the next order of the wave: a crack of radius b that closes under it has 1 -
    p/p* = (k b)^2 / 6 - (k b)^4 / 120. Other cracks act from order b^3 on. The counted opening is too small at its
    edge (0.05 cells here), for which 0.2 are allowed as above."""
    n, waves = 256, CrossedWaves(1.0, 1.0, 1.0)
    limit = waves.open_fraction(load * waves.full_contact_pressure_pa)
    radius_in_cells = n * math.sqrt(limit / math.pi)
    expected = limit * (1 + 4 * math.pi / 20 * limit)
    tolerance = 2 * 0.2 / radius_in_cells + (1 - load) ** 1.5
    assert 1 - mean_area(n, load) == pytest.approx(expected, rel=tolerance)


def test_rigid_flat() -> None:
    """Equal heights share the load equally, and the plane rests at them, as displacements count from their mean."""
    influence = Influence(Grid(12, 7, 1e-6, 3e-6), MODULUS, periodic=True)
    solution = solve_load(influence, np.full((12, 7), 5e-7), 3e6)
    np.testing.assert_allclose(solution.pressure, 3e6, rtol=1e-9)
    assert solution.plane == pytest.approx(5e-7, rel=1e-9)


def test_energy_grows_by_the_work_of_the_load(surface) -> None:
    """dW = -p d(plane) per area, W = 1/2 mean(p B p): by the trapezoidal rule up to the square of the step of 1 %."""
    influence = Influence(Grid(32, 24, 1.0, 0.7), 1.0, periodic=True)
    heights = surface((32, 24), 4.0, 1)
    less, more = (solve_load(influence, heights, load, 1e-12) for load in (0.2, 0.202))
    energies = [0.5 * np.mean(s.pressure * influence.apply(s.pressure)) for s in (less, more)]
    assert energies[1] - energies[0] == pytest.approx(0.201 * (less.plane - more.plane), rel=1e-4)


def test_large_cells_tend_to_the_free_half_space() -> None:
    """One paraboloid, R = 1000, in a cell of n = 32 and 64 nodes, the same force F = 0.1. Its images add the
    displacement F / (pi E*) r^2 / 4 sum 1/rho^3, the sum being 9.03 / n^3: they take 4.5e-3 of the curvature 1 / R
    at n = 32 (measured 5.1e-3 of the peak pressure), and an eighth at n = 64."""
    r2 = (np.arange(32) - 15.5) ** 2
    heights = -(r2[:, None] + r2) / 2e3
    free = solve_load(Influence(Grid(32, 32, 1.0, 1.0), 1.0), heights, 1e-4, 1e-12).pressure
    misfits = []
    for n in (32, 64):
        around = np.full((n, n), -1e3)
        middle = np.s_[n // 2 - 16 : n // 2 + 16, n // 2 - 16 : n // 2 + 16]
        around[middle] = heights
        influence = Influence(Grid(n, n, 1.0, 1.0), 1.0, periodic=True)
        pressure = solve_load(influence, around, 1e-4 * (32 / n) ** 2, 1e-12).pressure[middle]
        misfits.append(np.abs(pressure - free).max() / free.max())
    assert misfits[0] < 6e-3
    assert math.log2(misfits[0] / misfits[1]) == pytest.approx(3, abs=0.05)


def test_takes_load_control_only() -> None:
    """At a fixed plane the energy has no minimum once the mean interference is positive."""
    influence = Influence(Grid(4, 3, 1.0, 1.0), 1.0, periodic=True)
    for wrong in (lambda: solve(influence, np.ones((4, 3))), lambda: sweep(influence, np.ones((4, 3)), [0.0])):
        with pytest.raises(ParameterError, match="solve_load"):
            wrong()


@pytest.mark.parametrize("pressure", [-1.0, math.nan, math.inf])
def test_refuses_mean_pressure(pressure: float) -> None:
    influence = Influence(Grid(4, 3, 1.0, 1.0), 1.0, periodic=True)
    with pytest.raises(ParameterError, match="mean pressure"):
        solve_load(influence, np.ones((4, 3)), pressure)
