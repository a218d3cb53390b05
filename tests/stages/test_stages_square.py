"""The stages of the square, their numbers against closed forms: modes, designs, contact at the centre."""

import math

import numpy as np
import pytest
from scipy.special import ndtr, ndtri

from roughslip.chaos.designs import monte_carlo
from roughslip.stages import contact_square, design, karhunen_loeve
from roughslip.stages.from_scene import geometry

SQ = 2e-7
CONFIGURATION = {
    "seed": 7,
    "roughness": {
        "covariance": "gaussian",
        "rms_height_m": SQ,
        "correlation_length_m": 3e-5,
        "correlation_length_across_m": 1e-5,
    },
    "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    "square": {
        "edge_m": 6e-5,
        "nodes": 6,
        "modes": 36,
        "latin_hypercube_samples": 40,
        "penetration_percentile": 20.0,
    },
    "expansion": {"samples": 40},
    "numerics": {"contact_tolerance": 1e-10},
}
CELL = 1e-5


def test_all_modes_together_are_the_covariance(run):
    """sum_k modes_k(r) modes_k(r') = Sq^2 exp(-(x/lx)^2 - (y/ly)^2), as no mode is left out."""
    found = run(karhunen_loeve, CONFIGURATION)
    modes = found["modes"]
    place = CELL * np.arange(6)
    squares = (place[:, None] - place) ** 2
    expected = SQ**2 * np.einsum("ik,jl->ijkl", np.exp(-squares / 3e-5**2), np.exp(-squares / 1e-5**2))
    np.testing.assert_allclose(np.einsum("mij,mkl->ijkl", modes, modes), expected, rtol=0, atol=1e-12 * SQ**2)
    assert found["captured_variance"] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(found["variance"], SQ**2, rtol=1e-12)
    np.testing.assert_allclose(found["eigenvalue"], np.sum(modes**2, axis=(1, 2)), rtol=0, atol=1e-12 * 36 * SQ**2)
    assert np.all(np.diff(found["eigenvalue"]) <= 1e-12 * 36 * SQ**2)
    assert found["eigenvalue"].sum() == pytest.approx(36 * SQ**2)


def test_fewer_modes_carry_their_share(run):
    fewer = CONFIGURATION | {"square": CONFIGURATION["square"] | {"modes": 5}}
    all_of_them, found = run(karhunen_loeve, CONFIGURATION, "all"), run(karhunen_loeve, fewer)
    assert found["modes"].shape == (5, 6, 6)
    np.testing.assert_allclose(found["eigenvalue"], all_of_them["eigenvalue"][:5], rtol=1e-10)
    assert found["captured_variance"] == pytest.approx(all_of_them["eigenvalue"][:5].sum() / (36 * SQ**2))


def test_designs_have_one_sample_a_stratum_and_nothing_in_common(run):
    scene = CONFIGURATION | {"square": CONFIGURATION["square"] | {"latin_hypercube_samples": 60}}
    modes = run(karhunen_loeve, CONFIGURATION, "modes").path
    found = run(design, scene, surface=modes)
    for name, count in (("latin_hypercube", 60), ("expansion", 40)):
        assert found[name].shape == (count, 36)
        strata = np.floor(count * ndtr(found[name])).astype(int)
        np.testing.assert_array_equal(np.sort(strata, axis=0), np.arange(count)[:, None] * np.ones(36, int))
    same = run(design, CONFIGURATION, "same", surface=modes)  # of equal size: the streams alone tell them apart
    assert not np.any(same["latin_hypercube"] == same["expansion"])
    np.testing.assert_array_equal(same["expansion"], found["expansion"])


# The four central nodes of 6 x 6, the centre first; each is lifted alone by a mode of its own, and nothing else is.
CENTRAL = [(3, 3), (3, 2), (2, 3), (2, 2)]
PLANE = SQ * float(ndtri(0.8))  # 20 % of the heights lie above
DIAGONAL = 4 * CELL * math.log(1 + math.sqrt(2)) / math.pi / (2.1e11 / (1 - 0.3**2))  # of a square under its own load


@pytest.fixture
def lifted(stored):
    modes = np.zeros((36, 6, 6))
    for mode, (i, j) in enumerate(CENTRAL):
        modes[mode, i, j] = SQ
    return stored("modes.nc", modes=(("mode", "x", "y"), modes))


def alone(found, row: int, height: float, node: int) -> None:
    """One cell bears what p = interference / B_00 says, and presses the others away from the plane, which is above."""
    there = np.arange(4) == node
    pressure = max(height - PLANE, 0.0) / DIAGONAL
    np.testing.assert_allclose(found["pressure"][row], pressure * there, rtol=1e-9)
    assert found["area_fraction"][row] == pytest.approx((pressure > 0) / 36)
    assert found["mean_pressure"][row] == pytest.approx(pressure / 36, rel=1e-9)
    if pressure > 0:
        assert found["gap"][row, node] == pytest.approx(0.0, abs=1e-9 * SQ)
        assert np.all(found["gap"][row, ~there] > PLANE)
    else:
        np.testing.assert_allclose(found["gap"][row], PLANE - height * there, rtol=1e-12)


def test_a_node_alone_in_contact_bears_what_its_cell_bears(run, stored, lifted):
    """Samples 1 to 5 of a design that lifts one central node each, at heights of 2, 3, 4 and 5 Sq, and one too low."""
    xi = np.zeros((7, 36))
    lifts = {1: (0, 2.0), 2: (1, 3.0), 3: (2, 4.0), 4: (3, 5.0), 5: (0, 0.5)}
    for sample, (mode, height) in lifts.items():
        xi[sample, mode] = height
    designs = stored("design.nc", latin_hypercube=(("sample", "mode"), xi), expansion=(("sample", "mode"), -xi))
    arguments = {"surface": lifted, "designs": designs, "design": "latin_hypercube", "first": 1, "last": 6}
    found = run(contact_square, CONFIGURATION, **arguments)
    assert found["pressure"].shape == (5, 4)
    for sample, (mode, height) in lifts.items():
        alone(found, sample - 1, height * SQ, mode)
    assert np.all(found["residual"] <= 1e-10)
    assert found.attributes["first"] == 1
    assert found.attributes["design"] == "latin_hypercube"


def test_a_sample_of_monte_carlo_is_drawn_by_its_number(run, lifted):
    """With one mode: its height is the first variable of the stream of that number."""
    arguments = {"surface": lifted, "designs": None, "design": "monte_carlo", "first": 100, "last": 130}
    found = run(contact_square, CONFIGURATION, **arguments)
    drawn = np.array([monte_carlo([7, geometry.STREAM_MONTE_CARLO, number], 36)[:4] for number in range(100, 130)])
    single = np.flatnonzero(np.count_nonzero(SQ * drawn > PLANE, axis=1) == 1)
    assert len(single) >= 8  # 4 0.2 0.8^3 of 30 are 12
    for row in single:
        node = int(np.argmax(drawn[row]))
        pressure = (SQ * drawn[row, node] - PLANE) / DIAGONAL
        assert found["pressure"][row, node] == pytest.approx(pressure, rel=1e-9)
        assert found["area_fraction"][row] == pytest.approx(1 / 36)
