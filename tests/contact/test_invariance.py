"""Changes that must not change a solution: units, mirrors, transposition, translation, order of planes, method."""

import math
from dataclasses import dataclass

import numpy as np
import pytest

from roughslip.contact.influence import Influence
from roughslip.contact.solve import ContactSolution, solve, solve_load, sweep
from roughslip.grid import Grid

# Bound of |B^-1| |B| on the meshes below: how much larger than the residual the relative error of a pressure may be.
CONDITION = 100
TOLERANCE = 1e-12
ALLOWED = CONDITION * TOLERANCE


@dataclass(frozen=True)
class Case:
    """Heights of unit variance on cells 1 x 0.8 of modulus 1, with the pressure capped at a share of its elastic peak.

    The half-space is free with the plane at -0.5, or periodic under a load of 0.1.
    """

    shape: tuple[int, int]
    length: float
    periodic: bool
    cap: float

    def press(
        self, heights: np.ndarray, metre: float = 1.0, pascal: float = 1.0, turned: bool = False
    ) -> ContactSolution:
        dx, dy = (0.8 * metre, metre) if turned else (metre, 0.8 * metre)
        influence = Influence(Grid(*heights.shape, dx, dy), pascal, periodic=self.periodic)
        hardness = self.cap * pascal
        if self.periodic:
            return solve_load(influence, heights * metre, 0.1 * pascal, TOLERANCE, hardness_pa=hardness)
        return solve(influence, (heights + 0.5) * metre, TOLERANCE, hardness_pa=hardness)


# Few nodes and many, white and smooth, so that every method is used. Elastic peaks are 0.5 to 2: the cap is reached.
SURFACES = [((12, 10), 0.0), ((48, 40), 5.0)]
CASES = pytest.mark.parametrize(
    "case",
    [Case(*surface, periodic, cap) for surface in SURFACES for periodic in (False, True) for cap in (math.inf, 0.3)],
    ids=str,
)


def assert_same(solution: ContactSolution, pressure: np.ndarray, gap: np.ndarray, plastic: np.ndarray) -> None:
    """Pressures in units of E*, gaps and plastic displacements in those of the heights, to what the tolerance
    allows."""
    np.testing.assert_allclose(solution.pressure, pressure, rtol=0, atol=ALLOWED * pressure.max())
    np.testing.assert_allclose(solution.gap, gap, rtol=0, atol=ALLOWED)
    np.testing.assert_allclose(solution.plastic_displacement, plastic, rtol=0, atol=ALLOWED)


@CASES
@pytest.mark.parametrize(("metre", "pascal"), [(1.0, 1e12), (1e-9, 1.0), (1e9, 1e-12)])
def test_units(surface, case: Case, metre: float, pascal: float) -> None:
    """p / E*, p / H and gap / length depend on shapes alone; so does the work at a given plane."""
    heights = surface(case.shape, case.length, 2)
    reference = case.press(heights)
    assert np.any(reference.plastic_displacement) == math.isfinite(case.cap)
    scaled = case.press(heights, metre, pascal)
    assert scaled.residual <= TOLERANCE
    assert case.periodic or scaled.work == reference.work
    assert np.array_equal(scaled.contact, reference.contact)
    assert_same(reference, scaled.pressure / pascal, scaled.gap / metre, scaled.plastic_displacement / metre)
    if case.periodic:
        assert scaled.plane / metre == pytest.approx(reference.plane, abs=ALLOWED)


@CASES
def test_mirrored_and_transposed(surface, case: Case) -> None:
    heights = surface(case.shape, case.length, 3)
    reference = case.press(heights)
    for image in (np.s_[::-1], np.s_[:, ::-1], np.s_[::-1, ::-1]):
        mirrored = case.press(heights[image])
        assert_same(reference, mirrored.pressure[image], mirrored.gap[image], mirrored.plastic_displacement[image])
    turned = case.press(heights.T, turned=True)
    assert_same(reference, turned.pressure.T, turned.gap.T, turned.plastic_displacement.T)


@CASES
def test_moved_with_the_plane(surface, case: Case) -> None:
    """Under a load the datum of the heights does not matter, nor a shift around a periodic cell. On a free half-space
    added nodes far below the plane do not matter."""
    heights = surface(case.shape, case.length, 4)
    reference = case.press(heights)
    if case.periodic:
        moved = case.press(np.roll(heights, (5, -3), axis=(0, 1)) + 10.0)
        assert moved.plane == pytest.approx(reference.plane + 10.0, abs=ALLOWED)
        fields = [np.roll(f, (-5, 3), axis=(0, 1)) for f in (moved.pressure, moved.gap, moved.plastic_displacement)]
    else:
        moved = case.press(np.pad(heights, ((2, 0), (0, 7)), constant_values=-1e3))
        fields = [f[2:, :-7] for f in (moved.pressure, moved.gap, moved.plastic_displacement)]
    assert_same(reference, *fields)


@pytest.mark.parametrize("hardness", [math.inf, 0.3])
def test_order_of_planes(surface, hardness: float) -> None:
    """From no to full contact: equal bits in any order and repeated, and agreement with single solves."""
    influence = Influence(Grid(48, 40, 1.0, 0.8), 1.0)
    heights = surface((48, 40), 5.0, 5)
    planes = [0.0, 9.0, 1.6, -1.6, 0.0, -0.8, -0.8 - 1e-13, -20.0]
    swept = sweep(influence, heights, planes, TOLERANCE, hardness_pa=hardness)
    order = np.random.default_rng(6).permutation(len(planes))
    for k, shuffled in zip(
        order, sweep(influence, heights, [planes[k] for k in order], TOLERANCE, hardness), strict=True
    ):
        assert np.array_equal(shuffled.pressure, swept[k].pressure)
        assert np.array_equal(shuffled.gap, swept[k].gap)
        assert np.array_equal(shuffled.plastic_displacement, swept[k].plastic_displacement)
    for plane, solution in zip(planes, swept, strict=True):
        single = solve(influence, heights - plane, TOLERANCE, hardness_pa=hardness)
        assert np.array_equal(single.contact, solution.contact)
        allowed = ALLOWED * np.maximum(heights - plane, 0).max()  # of pressures and lengths, B_00 being of order one
        np.testing.assert_allclose(single.pressure, solution.pressure, rtol=0, atol=allowed)
        np.testing.assert_allclose(single.plastic_displacement, solution.plastic_displacement, rtol=0, atol=allowed)
    assert {s.method for s in swept} >= {"fft", "none"}
    assert sweep(influence, heights, []) == []
