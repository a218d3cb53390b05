"""The free half-space against closed forms, with orders of convergence; areas of periodic surfaces under a load.

Loads p' = p / (E* h') are over the root mean square slope h'. E* = 1, and so are cells of rough surfaces.
"""

import math

import numpy as np
import pytest
from scipy.special import erf

from roughslip.contact import ContactSolution, Influence, cell_heights, solve, solve_load
from roughslip.grid import Grid
from tests.contact.closed_forms import HERTZ_FORCE, HERTZ_PEAK, SQUARE_CAPACITANCE, SineWave, hertz_pressure


def sphere_on(n: int, edge: float, shift: tuple[float, float]) -> tuple[Grid, np.ndarray, np.ndarray]:
    """n x n cells over an edge of some contact radii, the axis of the sphere a shift [cells] off the middle.

    Returns the mesh, heights and distances from the axis.
    """
    h = edge / n
    grid = Grid(n, n, h, h)
    r = np.hypot(grid.x()[:, None] - (n / 2 + shift[0]) * h, grid.y() - (n / 2 + shift[1]) * h)
    return grid, -(r**2) / 2, r


def press(n: int, edge: float, shift: tuple[float, float]) -> tuple[ContactSolution, Grid, np.ndarray]:
    grid, heights, r = sphere_on(n, edge, shift)
    return solve(Influence(grid, 1.0), 1.0 + heights), grid, r


def test_hertz_orders_of_convergence():
    """Means over shifts of the mesh, on the triangle that represents all. Force: order two. Pressure: its root at the
    edge leaves an error sqrt(h) on a share h of the area, order one in L2. Area: order one by count of nodes. Three
    doublings are taken together, because the mean over ten shifts scatters by about a tenth (measured 1.02, 0.87,
    1.20)."""
    quarters = (-0.375, -0.125, 0.125, 0.375)
    shifts = [(x, y) for x in quarters for y in quarters if y <= x]
    weights = [1 if x == y else 2 for x, y in shifts]
    means = []
    for n in (16, 32, 64, 128):
        errors = []
        for shift in shifts:
            solution, grid, r = press(n, 2.5, shift)
            force, exact = np.sum(solution.pressure) * grid.cell_area, hertz_pressure(r)
            force_error = force / HERTZ_FORCE - 1
            pressure_error = np.linalg.norm(solution.pressure - exact) / np.linalg.norm(exact)
            area_error = np.count_nonzero(solution.contact) * grid.cell_area / math.pi - 1
            errors.append((force_error, pressure_error, area_error))
        means.append(np.average(errors, axis=0, weights=weights))
    halvings = np.log2(means)
    np.testing.assert_allclose(-np.diff(halvings[:, 0]), 2.0, atol=0.15)
    np.testing.assert_allclose(-np.diff(halvings[:, 1]), 1.0, atol=0.15)
    assert (halvings[0, 2] - halvings[-1, 2]) / 3 == pytest.approx(1.0, abs=0.15)


def test_hertz_under_a_load():
    """The plane stands as deep below the summit as the penetration. F ~ d^(3/2): at a given load the error of d is
    two thirds of that of the force, 6e-5. The peak is between four nodes, lower by (h/a)^2 / 4 = 3.8e-4."""
    grid, heights, _ = sphere_on(64, 2.5, (0.0, 0.0))
    solution = solve_load(Influence(grid, 1.0), heights, HERTZ_FORCE / (grid.size * grid.cell_area))
    assert np.sum(solution.pressure) * grid.cell_area == pytest.approx(HERTZ_FORCE, rel=1e-8)
    assert solution.pressure.max() == pytest.approx(HERTZ_PEAK, rel=4e-4)
    assert -solution.plane == pytest.approx(1.0, rel=1e-4)
    again = solve(Influence(grid, 1.0), heights, penetration_m=heights.max() - solution.plane)
    np.testing.assert_allclose(again.pressure, solution.pressure, rtol=0, atol=1e-8 * HERTZ_PEAK)


def test_force_of_a_square_punch():
    """The pressure rises as 1 / sqrt(distance) to its edge, and the force converges with order one; extrapolated
    from the two finest meshes 1.4e-4 is left."""
    exact = math.pi * SQUARE_CAPACITANCE
    forces = [solve(Influence(Grid(n, n, 1 / n, 1 / n), 1.0), np.ones((n, n))).mean_pressure for n in (16, 32, 64)]
    errors = np.array(forces) - exact
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 1.0, atol=0.15)
    assert 2 * forces[2] - forces[1] == pytest.approx(exact, rel=3e-4)


def self_affine(waves: int, longest: float, n: int, hurst: float, seed: int) -> np.ndarray:
    """(n, n) heights on cells of edge 1, of the same waves for every n, whose root mean square slope is 1.

    waves, longest : shortest and longest waves in the cell; the spectrum falls as q^(-2 - 2 hurst) between them
    """
    generator, k = np.random.default_rng(seed), np.arange(-waves, waves + 1)
    q = np.hypot(k[:, None], k)
    noise = generator.standard_normal(q.shape) + 1j * generator.standard_normal(q.shape)
    amplitude = np.where((q >= longest) & (q <= waves), np.maximum(q, 1) ** (-1 - hurst), 0.0) * noise
    spectrum = np.zeros((n, n), complex)
    spectrum[np.ix_(k % n, k % n)] = amplitude
    spectrum = (spectrum + np.conj(spectrum[-np.arange(n)][:, -np.arange(n)])) / 2  # real heights
    wave_numbers = 2 * np.pi * np.hypot(np.fft.fftfreq(n)[:, None], np.fft.fftfreq(n))
    slope = math.sqrt(np.sum(np.abs(wave_numbers * spectrum) ** 2))
    return np.fft.ifft2(spectrum).real * n**2 / slope


def areas(heights: np.ndarray, loads: list[float]) -> np.ndarray:
    """(loads,) real over nominal area, of heights lowered for cells."""
    grid = Grid(*heights.shape, 1.0, 1.0)
    influence, heights = Influence(grid, 1.0, periodic=True), cell_heights(heights, grid)
    return np.array([solve_load(influence, heights, load, 1e-6).shares.mean() for load in loads])


def test_tilted_waves_have_the_area_of_westergaard() -> None:
    """At every load and on three meshes, over phases that pass all positions of an edge between nodes. Nodes give 0.08
    to 0.15 cells an edge too much at any mesh: order one. Shares leave 0.03."""
    for n in (32, 48, 64):
        grid, wavelength, phase = Grid(n, n, 1.0, 1.0), n / math.hypot(3, 1), 2 * np.pi * np.arange(n) / n
        influence = Influence(grid, 1.0, periodic=True)
        for load in (0.1, 0.4, 0.8):
            wave = SineWave(1.0, wavelength, load)
            errors = []
            for shift in 2 * np.pi * (np.arange(4) + 0.5) / (4 * n):
                heights = cell_heights(np.cos(3 * phase[:, None] + phase + shift), grid)
                found = solve_load(influence, heights, wave.mean_pressure, 1e-6)
                errors.append((found.area_fraction - wave.area_fraction, found.shares.mean() - wave.area_fraction))
            nodes, shares = np.mean(errors, axis=0) * wavelength / 2  # of the two edges of a wave
            assert 0.07 < nodes < 0.17
            assert abs(shares) < 0.04


@pytest.mark.nightly
def test_light_load_has_the_area_of_bush_gibson_and_thomas() -> None:
    """A / p' = sqrt(2 pi) as p' goes to 0: the highest summits are Hertz contacts on spheres. At p' = 1e-3 the summits
    of this surface (Nayak's parameter 1.77), taken alone, have 2.45; 3 % are allowed for that. The ratio falls with the
    load, but far less than Persson's sqrt(8 / pi) is below it."""
    loads = [1e-3, 1e-2, 1e-1]
    ratios = [areas(self_affine(24, 12, 384, 0.8, seed), loads) / loads for seed in range(12)]
    mean, error = np.mean(ratios, axis=0), np.std(ratios, axis=0, ddof=1) / math.sqrt(len(ratios))
    assert mean[0] == pytest.approx(math.sqrt(2 * math.pi), rel=0.03, abs=2 * error[0])
    assert error[0] < 0.1
    assert np.all(np.diff(mean) < 0)
    assert np.all(mean > math.sqrt(8 / math.pi))


def test_area_over_the_load_against_persson() -> None:
    """erf(sqrt(2) p') (Persson, J. Chem. Phys. 115 (2001) 3840) is below the area at every load, and meets it in nearly
    full contact, where the pressures of the surface are Gaussian. The area stays below sqrt(2 pi) p'."""
    loads = [0.02, 0.1, 0.3, 0.6, 1.0, 1.5]
    found = np.mean([areas(self_affine(12, 2, 96, 0.8, seed), loads) for seed in range(4)], axis=0)
    persson = erf(math.sqrt(2) * np.array(loads))
    excess = found / persson
    assert np.all(np.diff(excess) < 0)
    assert np.all(found < math.sqrt(2 * math.pi) * np.array(loads))
    assert excess[0] == pytest.approx(2.3 / math.sqrt(8 / math.pi), rel=0.07)  # between 2.15 and 2.45 at p' = 0.02
    assert excess[-1] == pytest.approx(1, abs=0.005)
