"""A record as the friction of a scene, from file to machine; the budget of what is uncertain, and the machine at drawn
values of it."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import InputError
from roughslip.figures.figure_record import figure_record
from roughslip.figures.style import Shown
from roughslip.friction import scatter_of_friction
from roughslip.oscillator.answers import leaves_known_speeds
from roughslip.record.likelihood import scatter_path
from roughslip.record.memory import ContactMemory
from roughslip.scene.oscillator import Memory
from roughslip.scene.types import scene_of
from roughslip.study import budget, record
from roughslip.study.from_scene.machine import friction_of, machine_of
from roughslip.study.graph import STAGES
from roughslip.surface import covariance_of
from tests.study.conftest import OSCILLATOR, changed
from tests.study.test_stage_motion import EXISTENCE, scattered

SECONDS, N, LENGTH = 30.0, 500, 1e-3
SCENE = {
    "seed": 7,
    "friction": {"record": {"file": ["trace.csv"], "time_constant_s": 0.0}, "scatter": "additive"},
    "oscillator": OSCILLATOR | {"belt_velocity_m_per_s": 1e-3, "normal_force_n": 200.0, "windows_in_parallel": 2},
    "material": {"young_modulus_pa": 2e11, "poisson_ratio": 0.3},
    "roughness": {"covariance": "gaussian", "rms_height_m": 1e-6, "correlation_length_m": 2e-5},
    "strip": {"window_m": 1e-3, "width_m": 1e-3},
}


@pytest.fixture(scope="module")
def recorded(run, folder):
    """The result of a record of some 40 lengths, from 0.1 to 2 mm/s and back, next to a surface."""
    time = np.arange(N) * SECONDS / N
    speed = 2e-3 * np.exp(3.0 * (np.abs(time / SECONDS * 4.0 % 2.0 - 1.0) - 1.0))
    slipped = np.cumsum(speed) * SECONDS / N
    path = scatter_path(slipped, LENGTH / 2, np.random.default_rng(6))
    columns = np.c_[time, 1e3 * speed, 0.25 / (1.0 + 4e3 * speed) + 0.2 + 0.02 * path]
    header = "time [s],speed [mm/s],friction [1]"
    np.savetxt(folder / "trace.csv", columns, header=header, comments="", delimiter=",")
    return run("record", SCENE, record=[folder / "trace.csv"])


def test_law_and_process_of_the_oscillator_are_those_of_the_record(recorded):
    """A mean that is varied takes the curve with it. Multiplicative scatter is over the mean. The curve is known from a
    tenth of 1 mm/s to 2 mm/s; a light load lets no slip be much faster."""
    scene = scene_of(SCENE | {"ensemble": {}})
    own, friction = machine_of(scene, recorded.path), friction_of(scene, recorded.path)
    assert own.law.mu(recorded["curve_speed"]) == pytest.approx(recorded["curve"], rel=1e-12)
    assert (own.law.slowest_known, own.law.fastest_known) == pytest.approx((2e-3 * math.exp(-3.0), 2e-3), rel=0.02)
    assert own.law.static == max(OSCILLATOR["static_friction"], recorded["curve"][0])
    speeds = np.array([1e-4, 5e-4, 2e-3])
    more = own.changed({"mean_friction": 1.2 * own.friction.mean})
    assert more.law.mu(speeds) == pytest.approx(1.2 * own.law.mu(speeds), rel=1e-12)
    process = friction.process
    assert process.correlation_length_m == recorded["additive_length"]
    assert process.autocorrelation(np.array([process.correlation_length_m])) == pytest.approx([np.exp(-1)])
    assert process.marginal.standard_deviation == pytest.approx(recorded["additive_std"] / 2**0.5)  # of two windows
    relative = friction_of(scene_of(changed(SCENE, friction={"scatter": "multiplicative"})), recorded.path)
    for deviation in (relative.deviation / relative.mean, 2**0.5 * relative.path_deviation):
        assert deviation == pytest.approx(float(recorded["multiplicative_std"]))
    for velocity, outside in ((5e-4, True), (1e-3, False), (3e-3, True)):
        assert leaves_known_speeds(own.changed({"belt_velocity": velocity, "load": 0.1})) == outside


def test_the_figure_draws_what_is_stored_next_to_the_scatter_of_a_surface(recorded):
    """A window of 1 mm under its part of the force: the law's value times the mean friction, and its correlation:
    windows far longer than the roughness have nearly the triangle of half a window, and nothing beyond a window."""
    assert recorded["twin"].shape == (2, N)
    lags, length = recorded["lag"], float(recorded["additive_length"])
    assert lags[-1] == pytest.approx(5 * length * 59 / 60, rel=0.02)
    fit = recorded["additive_std"] ** 2 * np.exp(-lags / length)
    np.testing.assert_allclose(recorded["covariance_fit"], fit, rtol=1e-6)
    covariance = covariance_of("gaussian", rms_height_m=1e-6, correlation_length_m=2e-5)
    by_law = scatter_of_friction(covariance, 2e11 / (1.0 - 0.09), 1e8, (1e-3, 1e-3)) * recorded["record_mean"]
    assert recorded["surface_std"] == pytest.approx(by_law, rel=1e-6)
    scene = scene_of(SCENE, STAGES["record"].keys)
    of_surface = record.of_surface(scene, 0.3, np.array([0.0, 5e-4, 2e-3]))
    shares = of_surface["surface_covariance"].values / of_surface["surface_std"].values ** 2
    assert shares == pytest.approx([1.0, 0.5, 0.0], abs=0.05)
    figure = figure_record(Shown(recorded.dataset()))
    assert [axes.get_title(loc="left")[:3] for axes in figure.axes] == [f"({letter})" for letter in "abcdef"]
    assert "surface, law of scatter to 10 %" in figure.axes[3].get_legend_handles_labels()[1]
    assert not record.has_surface({key: SCENE[key] for key in ("friction", "oscillator")})


def test_a_memory_is_stored_with_its_intervals():
    numbers = [np.array([2.0, 1.0, 3.0]) * size for size in (0.01, 0.015, 1e-6, 0.015)]
    stored = record.of_memory(ContactMemory(*numbers, 1e-9, 1e-5, (), ()))
    assert (stored["memory_length"].values, stored["memory_length_high"].values) == (2e-6, 3e-6)
    assert stored["memory_direct_effect_low"].values == 0.01
    assert stored["memory_ageing_effect"].values == stored["memory_growth"].values == 0.03


def test_a_length_of_micrometres_questions_the_unit_of_speed():
    """4 um, or 1e5 lengths, as m/s labelled mm/s give."""
    given = [SimpleNamespace(correlation_length_m=a, lengths=b) for a, b in ((4e-3, 120), (4e-6, 120), (4e-3, 1e5))]
    assert [len(record.doubt_of_units(one)) for one in given] == [0, 1, 1]


def test_a_surface_explains_the_scatter_of_a_record_to_ten_percent():
    """0.011 to 0.013 in the record: roughness is (0.9 / 1.2)^2 of the variance, the cause, or that of another pad."""
    said = (0.009, "is 56% of"), (0.0101, "can be the cause"), (0.0144, "can be"), (0.0145, "are not those of")
    for by_law, words in said:
        assert words in record.is_roughness_the_cause(by_law, 0.011, 0.013)


def test_shapes_of_the_marginal_have_the_moments():
    """Beta(2, 5) has skewness 0.596 and excess -0.12, as in Johnson et al."""
    fit = SimpleNamespace(skewness=(0.5963, 0.01), excess=(-0.12, 0.01))
    assert record.beta_shapes(fit) == pytest.approx((2.0, 5.0), rel=0.01)
    assert record.beta_shapes(SimpleNamespace(skewness=(0.1, 0.1), excess=(0.1, 0.2))) == record.NORMAL


UNCERTAIN = {
    "friction.statistics.standard_deviation": 0.003,
    "oscillator.damping_ratio": 0.06,
    "oscillator.mass_kg": 0.1,
    "oscillator.static_friction": 0.02,
}


def uncertain(**others):
    return scattered(0.03, **others) | {"standard_uncertainties": [[key, value] for key, value in UNCERTAIN.items()]}


def inputs_of(**others):
    return budget.uncertain_inputs(scene_of(uncertain(**others), STAGES["budget"].keys), None)


def test_the_machine_follows_drawn_values_and_is_that_of_the_scene_at_its_own():
    """Inputs are grouped by source. The natural frequency follows the mass. Stick never holds less."""
    inputs = inputs_of()
    values = {source.name: dict(source.values) for source in inputs.sources}
    assert values == {
        "friction curve": {"oscillator.static_friction": 0.4},
        "friction process": {"friction.statistics.standard_deviation": 0.03},
        "damping": {"oscillator.damping_ratio": 0.17},
        "mass": {"oscillator.mass_kg": 1.0},
    }
    own, again = (inputs.machine(drawn) for drawn in ({}, {k: v for one in values.values() for k, v in one.items()}))
    assert (own.oscillator, own.law) == (again.oscillator, again.law)
    for one in (own.friction, again.friction):
        assert (one.pad_deviation, one.length_m) == (pytest.approx(0.03, rel=1e-12), 2.5e-4)
    softer = inputs.machine({"oscillator.mass_kg": 2.0})
    assert softer.oscillator.natural_frequency_rad_per_s == pytest.approx(316.0 / math.sqrt(2.0), rel=1e-15)
    assert inputs.machine({"oscillator.static_friction": 0.25}).law.static == 0.3
    scatter = inputs.machine({"friction.statistics.standard_deviation": 0.06}).friction.path_deviation
    assert scatter == pytest.approx(0.06, rel=1e-12)
    tabled = inputs_of(law="table", friction_table=((0.0, 0.4), (0.5, 0.35), (1.0, 0.3)))
    assert tabled.machine({"oscillator.friction_table.0.1": 0.45}).law.static == 0.45
    assert tabled.machine({"oscillator.static_friction": 0.38}).law.values == (0.38, 0.35, 0.3)
    numbers = dict(zip(Memory.model_fields, (0.01, 0.02, 1e-6, 0.1, 0.1, 1e-6), strict=True))
    remembering = inputs_of(law="coulomb", static_friction=0.3, memory=numbers)
    changed = remembering.machine({"oscillator.memory.memory_length_m": 2e-6, "friction.mean": 0.29}).memory
    assert (changed.memory_length_m, changed.ageing_effect, changed.curve.static) == (2e-6, 0.02, 0.29)
    assert tabled.machine({"oscillator.friction_table.1.1": 0.36}).law.values == (0.4, 0.36, 0.3)


def test_variance_of_a_mean_of_independent_of_equal_and_of_correlated_places():
    """sigma^2 / n, sigma^2, and half of 1 + rho for two."""
    found = [record.variance_of_mean(np.array(one)) for one in ([4.0, 0, 0, 0, 0], [4.0] * 5, [1.0, 0.4])]
    assert found == pytest.approx([0.8, 4.0, 0.7])


def test_a_record_gives_its_curve_and_scatter_with_their_covariance(recorded):
    """Sliding at rest holds no more than stick."""
    scene = scene_of(SCENE | {"ensemble": {}})
    curve, scatter = budget.sources_of_record(recorded, "additive")
    normal = np.random.default_rng(4).standard_normal((curve.axes, 200_000))
    factor = np.vstack([recorded["curve_factor_at_rest"], recorded["curve_factor"]])
    drawn = np.array(list(curve.drawn(normal).values()))
    np.testing.assert_allclose(np.cov(drawn), factor @ factor.T, rtol=0.05, atol=0.02 * np.max(factor @ factor.T))
    factors = np.array(list(scatter.drawn(normal[: scatter.axes]).values()))
    of_logs = recorded["additive_log_covariance"]
    np.testing.assert_allclose(np.cov(np.log(factors)), of_logs, rtol=0.05, atol=0.02 * of_logs.max())
    assert factors.mean(axis=1) == pytest.approx([1.0, 1.0], abs=4e-3)
    own = machine_of(scene, recorded.path).law
    assert budget.law_of_record(own, curve.values) == own
    last = len(own.values) - 1
    law = budget.law_of_record(own, {"record.curve.0": 0.99, f"record.curve.{last}": 0.1})
    assert (law.values[0], law.values[last], law.static) == (own.static, 0.1, own.static)
    assert budget.law_of_record(own, {"record.curve.1": 0.99}).static == 0.99
    assert budget.sources_of_record({"mean": 0.3}, "additive") == ()


def test_height_acts_on_the_scatter_as_pressure_does():
    """Stresses, so contact, depend on height over pressure alone: twice as high is half the pressure. At light loads
    the law has CV ~ length (p / (E* h'))^(b - 1/2), b = 0.117 fitted, of windows far larger than the length.

    A surface that is given with uncertainty is a source; its shape is held."""
    covariance = covariance_of("gaussian", rms_height_m=1e-6, correlation_length_m=1e-5)
    pad = 2e-3, 1e-3
    of_pressure = [math.log(scatter_of_friction(covariance, 1e9, 1e6 * math.exp(s), pad)) for s in (-0.05, 0.05)]
    powers = budget.powers_of_scatter(covariance, 1e9, 1e6, pad)
    assert powers["scan.height"] == pytest.approx((of_pressure[0] - of_pressure[1]) / 0.1, rel=1e-6)
    assert powers["scan.height"] == pytest.approx(0.5 - 0.117, abs=0.03)
    assert powers["scan.length"] == pytest.approx(1.0 - powers["scan.height"], abs=0.02)
    made = {
        "standard_uncertainties": [["roughness.rms_height_m", 1e-7]],
        "roughness": {"covariance": "gaussian", "rms_height_m": 1e-6, "correlation_length_m": 1e-5},
        "strip": {"window_m": 1e-3, "width_m": 1e-3},
        "oscillator": OSCILLATOR | {"windows_in_parallel": 2},
        "load": {"nominal_pressure_pa": 1e6},
        "material": {"young_modulus_pa": 1e9, "poisson_ratio": 0.0},
    }
    inputs, own = budget._of_surface(scene_of(made, STAGES["budget"].keys), None)
    assert inputs == {"scan.height": (1.0, pytest.approx(0.1))}
    assert own == pytest.approx(powers, rel=0.05)
    rough = scene_of(changed(made, roughness={"covariance": "exponential"}), STAGES["budget"].keys)
    with pytest.raises(InputError, match="heights whose slope has no limit take no standard uncertainty"):
        budget._of_surface(rough, None)


@pytest.mark.slow
def test_the_stage_says_what_to_measure(run, folder):
    """At the paper's 0.17 stick-slip is sure; its margin, D* - D, depends on the curve most."""
    level = [{"value": value, "change": "falls below"} for value in (0.32, 0.26)]
    damping = {"above": dict(zip(("0.05", "0.95"), level, strict=True)), "below": {"0.05": None, "0.95": None}}
    answer = {"given": True, "limits": {"damping": damping}, "probability": {"value": 1.0}}
    assert budget.band_of(answer) == (0.26, 0.32)
    store.write_json(folder / "answer.json", answer)
    result = run("budget", uncertain(), "budget", {"SAMPLES": 16}, answer=folder / "answer.json")
    text = json.loads((folder / "budget-text.json").read_text())
    assert list(result["source_name"]) == list(text["probability"]["first"])
    assert list(result["result_name"]) == ["probability", *text["limits"]]
    assert text["limits"]["damping"]["value"] == pytest.approx(EXISTENCE, abs=1e-6)
    assert 0.0 <= text["scatter"] <= 1.0
    assert np.isfinite(result["first"]).all()
