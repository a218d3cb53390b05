"""The stage of the whole field: maps against another Monte Carlo, mirror images, what is written and refused."""

import numpy as np
import pytest
from scipy.interpolate import make_interp_spline
from scipy.special import ndtri

from roughslip.contact.edge import contact_shares
from roughslip.contact.influence import Influence, Material
from roughslip.contact.solve import solve
from roughslip.errors import InputError
from roughslip.grid import Grid
from roughslip.scene.types import scene_of
from roughslip.stages import field_square, karhunen_loeve
from roughslip.stages.from_scene import geometry
from tests.stages.scenes import CONTACT, changed

NODES, MODES, SAMPLES = 6, 36, 600
SCENE = changed(CONTACT, square={"penetration_percentile": 50.0}, expansion={"samples": SAMPLES, "variables": 8})


@pytest.fixture(scope="module")
def modes(run):
    return run(karhunen_loeve, SCENE, "modes")


@pytest.fixture(scope="module")
def found(run, modes):
    return run(field_square, SCENE, surface=modes.path)


def limit(comparisons):
    return float(ndtri(1 - 0.001 / (2 * comparisons)))  # family-wise 0.1 %


def test_maps_are_those_of_monte_carlo(found, modes):
    """6000 surfaces of another generator: ten times the stage's, as the expansion makes up for that many."""
    grid = Grid(NODES, NODES, 1e-5, 1e-5)
    influence = Influence(grid, Material(2.1e11, 0.3).plane_strain_modulus_pa)
    xi = np.random.default_rng(99).standard_normal((6000, MODES))
    pressure = np.stack([solve(influence, np.einsum("m,mxy->xy", one, modes["modes"])).pressure for one in xi])
    contact = np.stack([contact_shares(one) for one in pressure])
    variance = pressure.var(axis=0)
    fourth = np.mean((pressure - pressure.mean(axis=0)) ** 4, axis=0)
    truths = {
        "contact": (contact.mean(axis=0), contact.var(axis=0)),
        "mean": (pressure.mean(axis=0), variance),
        "deviation": (np.sqrt(variance), (fourth - variance**2) / (4 * variance)),
    }
    for name, (value, spread) in truths.items():
        error = np.sqrt(spread / len(xi) + found[f"{name}_error"] ** 2)
        assert np.max(np.abs(found[name] - value) / error) < limit(3 * NODES**2)
        own = found[f"{name}_error"] ** 2 * found[f"{name}_gain"] * SAMPLES  # variance of a sample by itself
        assert np.median(own / spread) == pytest.approx(1.0, abs=0.2)  # fourth moments of 600 among them
    assert np.median(found["mean_gain"]) > 4
    assert np.all(found["missed"] < 0.4)


def test_mirror_images_are_alike(found):
    """All eight of a square; on a node and its image errors are of the same surfaces, at worst opposite."""
    for name in ("contact", "mean", "deviation"):
        value, error = found[name], found[f"{name}_error"]
        for image in (np.flipud, np.fliplr, np.transpose):
            worst = np.abs(value - image(value)) / (error + image(error))
            assert worst.max() < limit(3 * 3 * NODES**2)


def test_what_is_written_makes_the_fields(found, modes):
    """The expected fields follow from the coefficients, to within what leaving their own surface out moves."""
    assert found.attributes["surfaces"] == SAMPLES
    assert found["direction"].shape == (MODES, NODES, NODES)
    np.testing.assert_allclose(np.sum(found["direction"] ** 2, axis=0), 1.0, rtol=1e-12)
    assert found["solved_pressure"].shape == found["drawn_pressure"].shape == (field_square.DRAWN, NODES, NODES)
    assert np.all(found["solved_pressure"] >= 0)
    assert np.all(found["drawn_pressure"] >= 0)
    xi = np.stack(
        [np.random.default_rng([7, geometry.STREAM_FIELD, number]).standard_normal(MODES) for number in range(3)]
    )
    index = np.einsum("km,mxy->kxy", xi, found["direction"])
    expected = np.empty(index.shape)
    for place in np.ndindex(NODES, NODES):  # linear between the knots, and beyond them
        link = make_interp_spline(found["knot"], found["link_pressure"][:, *place], k=1)
        expected[:, *place] = link(index[:, *place])
    deviation = found["deviation"].mean()
    assert np.sqrt(np.mean((expected - found["expected_pressure"]) ** 2)) < 0.1 * deviation
    assert np.sqrt(np.mean((expected - found["solved_pressure"]) ** 2)) < 0.6 * deviation
    for name in ("first", "total"):
        assert np.all((found[f"sobol_{name}"] >= 0) & (found[f"sobol_{name}_error"] >= 0))
    assert found["sobol_first"].sum() < 1 < found["sobol_total"].sum()
    assert np.all((found["leading_share"] > 0) & (found["leading_share"] < 1))


def test_as_many_surfaces_as_asked_and_no_more_than_memory_holds():
    def surfaces(samples, nodes, modes):
        return field_square.surfaces_of(
            scene_of({"expansion": {"samples": samples}, "square": {"nodes": nodes}}), modes
        )

    assert surfaces("auto", 64, 101) == 2048
    assert surfaces("auto", 10, 600) == 2400
    assert surfaces(900, 298, 101) == 900  # 10 x 101 modes x 298^2 are 89.7 million numbers
    with pytest.raises(InputError, match=r"expansion\.samples: 902 surfaces.* times 99856 nodes .* 1\.5 GB of memory"):
        surfaces(902, 316, 101)
    with pytest.raises(InputError, match="37 surfaces are too few for 36 modes"):
        surfaces(37, 6, 36)
