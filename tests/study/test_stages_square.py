"""The stages of the square against closed forms: modes, designs, contact at the centre, as many solves as needed."""

import math

import numpy as np
import pytest
from scipy.special import ndtri

from roughslip.chaos.variables import latin_hypercube
from roughslip.scene.types import scene_of
from roughslip.study import contact_square, karhunen_loeve
from roughslip.study.from_scene import Stream
from roughslip.study.from_scene.geometry import latin_hypercubes, training_design, variables_of
from tests.study.scenes import CONTACT, changed

SQ = 2e-7
CONFIGURATION = changed(
    CONTACT,
    roughness={"correlation_length_m": 3e-5, "correlation_length_across_m": 1e-5},
    square={"latin_hypercube_samples": 40},
    expansion={"samples": 40},
)
CELL = 1e-5


def test_all_modes_together_are_the_covariance(run):
    """sum_k modes_k(r) modes_k(r') = Sq^2 exp(-(x/lx)^2 - (y/ly)^2), as no mode is left out."""
    result = run(karhunen_loeve, CONFIGURATION)
    modes = result["modes"]
    place = CELL * np.arange(6)
    squares = (place[:, None] - place) ** 2
    expected = SQ**2 * np.einsum("ik,jl->ijkl", np.exp(-squares / 3e-5**2), np.exp(-squares / 1e-5**2))
    np.testing.assert_allclose(np.einsum("mij,mkl->ijkl", modes, modes), expected, rtol=0, atol=1e-12 * SQ**2)
    assert result["captured_variance"] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(result["eigenvalues"], np.sum(modes**2, axis=(1, 2)), rtol=0, atol=1e-12 * 36 * SQ**2)
    assert np.all(np.diff(result["eigenvalues"]) <= 1e-12 * 36 * SQ**2)
    assert result["eigenvalues"].sum() == pytest.approx(36 * SQ**2)


# The four central nodes of 6 x 6, the centre first; each is lifted alone by a mode of its own, and nothing else is.
CENTRAL = [(3, 3), (3, 2), (2, 3), (2, 2)]
PLANE = SQ * float(ndtri(0.8))  # 20 % of the heights lie above
DIAGONAL = 4 * CELL * math.log(1 + math.sqrt(2)) / math.pi / (2.1e11 / (1 - 0.3**2))  # of a square under its own load


@pytest.fixture
def design_of(monkeypatch):
    """design_of(xi) makes xi the design of the paper's equations and of our expansion."""

    def give(xi):
        monkeypatch.setattr(contact_square, "training_design", lambda scene, modes: xi)
        monkeypatch.setattr(contact_square, "latin_hypercubes", lambda scene, modes: iter([xi]))

    return give


@pytest.fixture
def lifted(stored, monkeypatch):
    monkeypatch.setattr(contact_square, "PENETRATION", 20.0)
    modes = np.zeros((36, 6, 6))
    for mode, (i, j) in enumerate(CENTRAL):
        modes[mode, i, j] = SQ
    return stored("modes.nc", modes=(("mode", "x", "y"), modes))


def alone(result, row: int, height: float, node: int) -> None:
    """One cell bears what p = interference / B_00 says, and presses the others away from the plane, which is above."""
    there = np.arange(4) == node
    pressure = max(height - PLANE, 0.0) / DIAGONAL
    np.testing.assert_allclose(result["pressure"][row], pressure * there, rtol=1e-9)
    if pressure > 0:
        assert result["gap"][row, node] == pytest.approx(0.0, abs=1e-9 * SQ)
        assert np.all(result["gap"][row, ~there] > PLANE)
    else:
        np.testing.assert_allclose(result["gap"][row], PLANE - height * there, rtol=1e-12)


def test_a_node_alone_in_contact_bears_what_its_cell_bears(run, design_of, lifted):
    """Samples 1 to 5 of a design that lifts one central node each, at heights of 2, 3, 4 and 5 Sq, and one too low."""
    xi = np.zeros((7, 36))
    lifts = {1: (0, 2.0), 2: (1, 3.0), 3: (2, 4.0), 4: (3, 5.0), 5: (0, 0.5)}
    for sample, (mode, height) in lifts.items():
        xi[sample, mode] = height
    design_of(xi)
    arguments = {"surface": lifted, "design": "expansion", "first": 1, "last": 6}
    result = run(contact_square, CONFIGURATION, **arguments)
    assert result["pressure"].shape == (5, 4)
    for sample, (mode, height) in lifts.items():
        alone(result, sample - 1, height * SQ, mode)
    # a design of pressures alone is balanced at the centre, and gives what the solves give there
    centre = run(contact_square, CONFIGURATION, "centre", **arguments | {"design": "latin_hypercube"})
    np.testing.assert_array_equal(centre["pressure"], result["pressure"][:, :1])
    # where the cells yield above 3.5 Sq they bear H, and the gap is below zero by the plastic displacement
    hardness = (3.5 * SQ - PLANE) / DIAGONAL
    yields = run(contact_square, changed(CONFIGURATION, material={"hardness_pa": hardness}), "yields", **arguments)
    np.testing.assert_allclose(yields["pressure"], np.minimum(result["pressure"], hardness), rtol=1e-9)
    below = [yields["gap"][row, row] for row in range(4)]
    np.testing.assert_allclose(below, SQ * np.array([0.0, 0.0, -0.5, -1.5]), rtol=1e-9, atol=1e-9 * SQ)
    assert result.attributes["first"] == 1
    assert result.attributes["design"] == "expansion"


@pytest.mark.parametrize(("contact_area", "like"), [("corrected", "point_pressure"), ("nodes", "pressure")])
def test_pressures_of_samples_lack_the_mesh_error_where_the_scene_corrects_areas(run, design_of, contact_area, like):
    """As of training samples at the same variables, which have both; where several differ."""
    scene = changed(CONFIGURATION, numerics={"contact_area": contact_area})
    xi = np.random.default_rng(4).standard_normal((40, 36))
    design_of(xi)
    arguments = {"surface": run(karhunen_loeve, scene).path, "first": 0, "last": 40}
    trained = run(contact_square, scene, "trained", design="expansion", **arguments)
    sampled = run(contact_square, scene, "sampled", design="latin_hypercube", **arguments)["pressure"]
    np.testing.assert_allclose(sampled, trained[like][:, :1], rtol=1e-8)
    assert np.count_nonzero(trained["point_pressure"][:, 0] != trained["pressure"][:, 0]) >= 5


def test_a_sample_of_monte_carlo_is_drawn_by_its_number(run, lifted):
    """With one mode: its height is the first variable of the stream of that number."""
    arguments = {"surface": lifted, "design": "monte_carlo", "first": 100, "last": 130}
    result = run(contact_square, CONFIGURATION, **arguments)
    drawn = np.array([variables_of(7, number, 36)[:4] for number in range(100, 130)])
    single = np.flatnonzero(np.count_nonzero(SQ * drawn > PLANE, axis=1) == 1)
    assert len(single) >= 8  # 4 0.2 0.8^3 of 30 are 12
    for row in single:
        node = int(np.argmax(drawn[row]))
        pressure = (SQ * drawn[row, node] - PLANE) / DIAGONAL
        assert result["pressure"][row, node] == pytest.approx(pressure, rel=1e-9)


RESOLVED = {"covariance": "gaussian", "rms_height_m": SQ, "correlation_length_m": 0.1035}
WHITE = RESOLVED | {"correlation_length_m": 1e-3}


def modes_of(run, roughness, nodes, **truncation):
    return run(karhunen_loeve, {"roughness": roughness, "square": {"edge_m": 1.0, "nodes": nodes, **truncation}})


def test_what_the_modes_carry_in_the_mean_at_the_centre_and_at_the_corner(run):
    """The study's 101 modes on its 64 nodes; each share is also that of the stored variance."""
    modes = modes_of(run, RESOLVED, 64, modes=101)
    shares = [float(modes[f"captured_{where}"]) for where in ("variance", "at_centre", "at_corner")]
    np.testing.assert_allclose(shares, [0.950, 0.957, 0.718], atol=0.002)
    variance = np.sum(modes["modes"] ** 2, axis=0) / SQ**2
    np.testing.assert_allclose(shares, [variance.mean(), variance[32, 32], variance[0, 0]], rtol=1e-12)


def test_all_modes_of_independent_heights_carry_all(run):
    np.testing.assert_array_equal(modes_of(run, WHITE, 10, modes=100)["captured_at_corner"], 1.0)


DESIGNS = {"seed": 7, "square": {"latin_hypercube_samples": 4000}, "expansion": {"samples": 200}}


def test_designs_have_streams_of_their_own():
    """The first is the same if there are several."""
    scene = scene_of(changed(DESIGNS, square={"latin_hypercube_samples": 8000}))
    drawn = [training_design(scene, 11), *latin_hypercubes(scene, 11)]
    seeds = [7, Stream.EXPANSION_DESIGN], [7, Stream.LATIN_HYPERCUBE], [7, Stream.LATIN_HYPERCUBE, 1]
    for xi, seed, samples in zip(drawn, seeds, (200, 4000, 4000), strict=True):
        np.testing.assert_array_equal(xi, latin_hypercube(np.random.default_rng(seed), samples, 11))
