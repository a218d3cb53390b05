"""Training solves of the square that are found while running: what is solved and written."""

import numpy as np
import pytest

from roughslip.chaos.designs import design
from roughslip.stages import adaptive_training, contact_square, karhunen_loeve
from roughslip.stages.from_scene.geometry import STREAM_EXPANSION_DESIGN
from tests.stages.scenes import CONTACT, changed

SCENE = changed(
    CONTACT,
    roughness={"rms_height_m": 5e-8, "correlation_length_m": 6e-7},
    square={"edge_m": 6e-4, "nodes": 8, "modes": 64, "penetration_percentile": 50.0},
    expansion={"variables": 2, "degree": 2, "target": "trial_pressure", "samples": "auto", "design": "sobol"},
)


@pytest.fixture(scope="module")
def modes(run):
    return run(karhunen_loeve, SCENE, "modes").path


@pytest.fixture
def train(run, modes):
    """Runs the stage with these changes of its expansion; the counts of its work are in run.did."""
    return lambda **expansion: run(adaptive_training, changed(SCENE, expansion=expansion), surface=modes)


@pytest.mark.slow
def test_solves_are_those_of_a_design_with_as_many_samples(run, train, modes, stored):
    """Bit for bit, with the design, in the variables that stage chaos_square reads."""
    found, did = train(cdf_error=0.008), run.did
    count = len(found["pressure"])
    assert count > adaptive_training.LEAST
    xi = design("sobol", [7, STREAM_EXPANSION_DESIGN], count, 64)
    np.testing.assert_array_equal(found["xi"], xi)
    given = stored("design.nc", expansion=(("sample", "mode"), xi))
    known = run(contact_square, SCENE, surface=modes, designs=given, design="expansion", first=0, last=count)
    for name in known:
        np.testing.assert_array_equal(found[name], known[name])
        assert found.variable(name).dimensions == known.variable(name).dimensions
    assert {name: found.attributes[name] for name in ("first", "design")} == {"first": 0, "design": "expansion"}
    assert did["solves"] == count
    assert did["cdf_error_asked"] == 0.008
    assert did["cdf_error"] == pytest.approx(found["cdf_error_scatter"] + found["cdf_error_bias"], abs=1e-6)
    assert did["cdf_error"] <= 0.008
    assert adaptive_training.LEAST * 2 ** (did["fits"] - 1) == count


def test_more_is_not_solved_than_what_is_asked_takes(run, train):
    found = train(cdf_error=0.2, design="monte_carlo")
    assert run.did["solves"] == len(found["pressure"]) == adaptive_training.LEAST
    np.testing.assert_array_equal(found["xi"], design("monte_carlo", [7, STREAM_EXPANSION_DESIGN], 128, 64))


def test_more_samples_than_terms_to_begin_with_and_none_that_memory_cannot_hold():
    """165 terms are the study's; 2^20 numbers of 1e8 are 95 modes or terms at a node."""
    assert adaptive_training.numbers(10, 10, 4, 64) == (128, 2**14)
    assert adaptive_training.numbers(165, 165, 16, 101) == (256, 2**14)
    assert adaptive_training.numbers(715, 715, 16, 101) == (1024, 2**13)  # 11 440 numbers a surface: 8741 surfaces
    assert adaptive_training.numbers(165, 165, 16, 50_000) == (256, 2**10)  # 2000
