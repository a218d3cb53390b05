"""Modes of the square by number or by share of the variance, and the designs in as many variables."""

import argparse

import numpy as np
import pytest

from roughslip import store
from roughslip.chaos.designs import latin_hypercube
from roughslip.errors import IllPosedError, InputError
from roughslip.scene.types import scene_of
from roughslip.stages import design, karhunen_loeve
from roughslip.stages.from_scene.geometry import STREAM_EXPANSION_DESIGN, STREAM_LATIN_HYPERCUBE
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.usage import Usage

RMS = 2e-7
RESOLVED = {"covariance": "gaussian", "rms_height_m": RMS, "correlation_length_m": 0.1035}
WHITE = RESOLVED | {"correlation_length_m": 1e-3}


@pytest.fixture
def run(tmp_path):
    """Runs a stage on a slice of the scene, and reads what it wrote."""

    def run_stage(stage, configuration, **files):
        path = tmp_path / "result.nc"
        arguments = argparse.Namespace(output=path, **({"scan": None} | files))
        stage.work(Job(store.Key(configuration, "code"), arguments, Usage(tmp_path / "usage.json", "stage")))
        return store.read(path)

    return run_stage


def modes_of(run, roughness, nodes, **truncation):
    return run(karhunen_loeve, {"roughness": roughness, "square": {"edge_m": 1.0, "nodes": nodes, **truncation}})


def test_a_share_takes_the_fewest_modes_that_carry_it(run):
    found = modes_of(run, RESOLVED, 32, variance_share=0.95)
    assert found["captured_variance"] >= 0.95
    assert found["captured_variance"] - found["eigenvalue"][-1] / (32**2 * RMS**2) < 0.95
    same = modes_of(run, RESOLVED, 32, modes=len(found["eigenvalue"]))
    for name in same:
        np.testing.assert_array_equal(found[name], same[name])


def test_what_the_modes_carry_is_told_in_the_mean_at_the_centre_and_at_the_corner(run):
    """The study's 101 modes on its 64 nodes; each share is also that of the variance stored beside it."""
    found = modes_of(run, RESOLVED, 64, modes=101)
    shares = [float(found[f"captured_{where}"]) for where in ("variance", "at_centre", "at_corner")]
    np.testing.assert_allclose(shares, [0.950, 0.957, 0.718], atol=0.002)
    variance = found["variance"] / RMS**2
    np.testing.assert_allclose(shares, [variance.mean(), variance[32, 32], variance[0, 0]], rtol=1e-12)
    stored = [found.variable(f"captured_{where}") for where in ("variance", "at_centre", "at_corner")]
    assert {variable.units for variable in stored} == {"1"}
    assert [variable.long_name.rpartition(", ")[2] for variable in stored] == [
        "in the mean over the mesh",
        "at the centre",
        "at the corner",
    ]


def test_a_share_of_independent_heights_is_refused_and_an_order_is_not(run):
    """All modes are alike: 95 of 100 for 0.95, and a quarter of them for 0.25, which is the limit."""
    with pytest.raises(IllPosedError) as told:
        modes_of(run, WHITE, 10, variance_share=0.95)
    assert "\n" not in str(told.value)
    for said in ("95 of 100 modes", "lower square.variance_share", "square.modes", "strips of Figure 3 are embedded"):
        assert said in str(told.value)
    assert len(modes_of(run, WHITE, 10, variance_share=0.25)["eigenvalue"]) == 25
    with pytest.raises(IllPosedError, match="26 of 100 modes"):
        modes_of(run, WHITE, 10, variance_share=0.26)
    whole = modes_of(run, WHITE, 10, modes=100)
    np.testing.assert_array_equal(whole["captured_at_corner"], 1.0)


def test_a_number_of_modes_predicted_too_low_is_told_in_the_same_way(run):
    """Of 34 x 34 nodes a quarter carries 0.8730 of this field (LAPACK on the matrix), and 0.8754 by its spectrum."""
    cusp = RESOLVED | {"covariance": "exponential", "correlation_length_m": 4 / 34}
    with pytest.raises(IllPosedError, match=r"more than a quarter of the 1156 modes.*lower square\.variance_share"):
        modes_of(run, cusp, 34, variance_share=0.8745)


DESIGNS = {"seed": 7, "square": {"latin_hypercube_samples": 4000}, "expansion": {"samples": 200}}


def test_designs_have_a_variable_a_mode(run, tmp_path):
    modes_of(run, RESOLVED, 8, modes=11)
    (tmp_path / "result.nc").rename(tmp_path / "modes.nc")
    found = run(design, DESIGNS, surface=tmp_path / "modes.nc")
    for name, samples, stream in (
        ("latin_hypercube", 4000, STREAM_LATIN_HYPERCUBE),
        ("expansion", 200, STREAM_EXPANSION_DESIGN),
    ):
        drawn = latin_hypercube(np.random.default_rng([7, stream]), samples, 11)
        np.testing.assert_array_equal(found[name], drawn)


def test_designs_too_large_for_memory_are_refused_with_a_line_each():
    """1e8 numbers are allowed."""
    assert design.samples_of(scene_of(DESIGNS), 25_000) == {"latin_hypercube": 4000, "expansion": 200}
    with pytest.raises(InputError) as told:
        design.samples_of(scene_of(DESIGNS), 25_001)
    assert [line.partition(";")[0] for line in told.value.lines] == [
        "square.latin_hypercube_samples: 4000 is not allowed"
    ]
    with pytest.raises(InputError) as told:
        design.samples_of(scene_of(DESIGNS), 500_001)
    assert [line.partition(":")[0] for line in told.value.lines] == [
        "square.latin_hypercube_samples",
        "expansion.samples",
    ]
    assert all("500001 modes" in line and "lower square.variance_share" in line for line in told.value.lines)
