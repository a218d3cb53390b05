"""A record as the friction of a scene: what is stored is read back, and gives law and process of the oscillator."""

from argparse import Namespace

import numpy as np
import pytest

from roughslip import store
from roughslip.figures.figure_record import figure_record
from roughslip.figures.style import Shown
from roughslip.friction import scatter_of_friction
from roughslip.oscillator.answers import leaves_known_speeds
from roughslip.record.likelihood import scatter_path
from roughslip.scene.types import scene_of
from roughslip.study import record
from roughslip.study.from_scene.machine import friction_of, machine_of
from roughslip.study.graph import STAGES
from roughslip.surface import covariance_of
from tests.study.conftest import job_of
from tests.study.scenes import OSCILLATOR

SECONDS, N, LENGTH = 30.0, 500, 1e-3


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """The scene and the result of a record of some 40 lengths, from 0.1 to 2 mm/s and back."""
    folder = tmp_path_factory.mktemp("record")
    time = np.arange(N) * SECONDS / N
    speed = 2e-3 * np.exp(3.0 * (np.abs(time / SECONDS * 4.0 % 2.0 - 1.0) - 1.0))
    slipped = np.cumsum(speed) * SECONDS / N
    generator = np.random.default_rng(6)
    friction = 0.25 / (1.0 + 4e3 * speed) + 0.2 + 0.02 * scatter_path(slipped, LENGTH / 2, generator)
    header = "time [s],speed [mm/s],friction [1]"
    np.savetxt(folder / "trace.csv", np.c_[time, 1e3 * speed, friction], header=header, comments="", delimiter=",")
    scene = {
        "seed": 7,
        "friction": {"record": {"file": ["trace.csv"], "time_constant_s": 0.0}, "scatter": "additive"},
        "oscillator": OSCILLATOR | {"belt_velocity_m_per_s": 1e-3},
    }
    output = folder / "record.nc"
    job = job_of("record", scene, output, record=[folder / "trace.csv"])
    record.work(job.scene, job)
    return scene, output


def test_the_law_of_the_oscillator_is_the_measured_curve(recorded):
    scene, output = scene_of(recorded[0]), recorded[1]
    result = store.read(output)
    law = machine_of(scene, output).law
    assert law.mu(result["curve_speed"]) == pytest.approx(result["curve"], rel=1e-12)
    assert law.fastest_known == pytest.approx(2e-3, rel=0.02)
    assert law.slowest_known == pytest.approx(2e-3 * np.exp(-3.0), rel=0.02)
    assert law.static == max(OSCILLATOR["static_friction"], result["curve"][0])


def test_a_mean_that_is_varied_takes_the_curve_with_it(recorded):
    scene, output = scene_of(recorded[0] | {"ensemble": {}}), recorded[1]
    own = machine_of(scene, output)
    more = own.changed({"mean_friction": 1.2 * own.friction.mean})
    speeds = np.array([1e-4, 5e-4, 2e-3])
    assert more.law.mu(speeds) == pytest.approx(1.2 * own.law.mu(speeds), rel=1e-12)


def test_the_process_of_the_oscillator_is_the_measured_scatter(recorded):
    scene, output = scene_of(recorded[0]), recorded[1]
    result, process = store.read(output), friction_of(scene, output).process
    assert process.correlation_length_m == result["additive_length"]
    assert process.autocorrelation(np.array([process.correlation_length_m])) == pytest.approx([np.exp(-1)])
    assert process.marginal.standard_deviation == pytest.approx(result["additive_std"])


def test_multiplicative_scatter_is_over_the_mean(recorded):
    values, output = recorded
    scene = scene_of(values | {"friction": values["friction"] | {"scatter": "multiplicative"}})
    friction, relative = friction_of(scene, output), store.read(output)["multiplicative_std"]
    assert friction.deviation / friction.mean == pytest.approx(float(relative)) == friction.path_deviation


@pytest.mark.parametrize(("velocity", "outside"), [(5e-4, True), (1e-3, False), (3e-3, True)])
def test_an_answer_outside_the_measured_speeds_is_not_identified(recorded, velocity, outside):
    """Known from 0.1 mm/s, more than a tenth of 0.5 mm/s, to 2 mm/s; a light load lets no slip be much faster."""
    scene, output = scene_of(recorded[0]), recorded[1]
    machine = machine_of(scene, output).changed({"belt_velocity": velocity, "load": 0.1})
    assert leaves_known_speeds(machine) == outside


def test_the_figure_draws_what_is_stored(recorded):
    result = store.read(recorded[1])
    figure = figure_record(Shown(result.dataset()))
    assert [axes.get_title(loc="left")[:3] for axes in figure.axes] == [f"({letter})" for letter in "abcdef"]
    assert result["twin"].shape == (2, N)
    assert result["covariance_fit"][0] == pytest.approx(result["additive_std"] ** 2)


def test_shapes_of_the_marginal_have_the_moments():
    """Beta(2, 5) has skewness 0.596 and excess -0.12, as in Johnson et al."""
    fit = Namespace(skewness=(0.5963, 0.01), excess=(-0.12, 0.01))
    assert record.beta_shapes(fit) == pytest.approx((2.0, 5.0), rel=0.01)
    assert record.beta_shapes(Namespace(skewness=(0.1, 0.1), excess=(0.1, 0.2))) == record.NORMAL


def test_the_scatter_of_a_surface_stands_next_to_that_of_the_record(recorded):
    """A window of 1 mm under its part of the force: the law's value times the mean friction, and its correlation."""
    values = recorded[0] | {
        "material": {"young_modulus_pa": 2e11, "poisson_ratio": 0.3},
        "roughness": {"covariance": "gaussian", "rms_height_m": 1e-6, "correlation_length_m": 2e-5},
        "strip": {"window_m": 1e-3, "width_m": 1e-3},
        "oscillator": recorded[0]["oscillator"] | {"normal_force_n": 200.0, "windows_in_parallel": 2},
    }
    scene, lags = scene_of(values, STAGES["record"].keys), np.array([0.0, 5e-4, 2e-3])
    assert record.has_surface(values)
    of_surface = {name: one.values for name, one in record.of_surface(scene, 0.3, lags).items()}

    covariance = covariance_of("gaussian", rms_height_m=1e-6, correlation_length_m=2e-5)
    wanted = 0.3 * scatter_of_friction(covariance, 2e11 / (1.0 - 0.09), 1e8, (1e-3, 1e-3))
    assert of_surface["surface_std"] == pytest.approx(wanted, rel=1e-6)
    # windows far longer than the roughness: nearly the triangle of half a window, and nothing beyond a window
    assert of_surface["surface_covariance"] / wanted**2 == pytest.approx([1.0, 0.5, 0.0], abs=0.05)
    assert not record.has_surface(recorded[0])
    result = store.read(recorded[1]).dataset()
    drawn = result.assign(surface_covariance=result["covariance_fit"])
    labels = figure_record(Shown(drawn)).axes[3].get_legend_handles_labels()[1]
    assert "the surface by the law of scatter, to 10 %" in labels


@pytest.mark.parametrize(
    ("by_law", "words"),
    [(0.01, "roughness is 25% of the variance"), (0.02, "roughness can be the cause"), (0.03, "are not those of")],
)
def test_a_sentence_says_whether_roughness_is_the_cause(by_law, words):
    assert words in record.is_roughness_the_cause(by_law, 0.018, 0.022)
