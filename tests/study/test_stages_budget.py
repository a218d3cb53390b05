"""The budget of a scene: which numbers are uncertain, and the machine at other values of them."""

import json
import math
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import InputError
from roughslip.figures.stick_slip import figure_budget
from roughslip.figures.style import Shown
from roughslip.friction.scatter_law import scatter_of_friction
from roughslip.oscillator.table_law import TableLaw
from roughslip.report.words import next_to_measure, rates_in_words
from roughslip.scene.types import scene_of
from roughslip.study import budget
from roughslip.study.budget import (
    _of_surface,
    law_of_record,
    powers_of_scatter,
    sources_of_record,
    uncertain_inputs,
)
from roughslip.study.from_scene.surface_model import OPTIONS
from roughslip.study.graph import STAGES
from roughslip.surface import covariance_of
from tests.study.test_stages_motion import scattered

TABLE = ((0.0, 0.4), (0.5, 0.35), (1.0, 0.3))
UNCERTAIN = {
    "friction.statistics.standard_deviation": 0.003,
    "oscillator.damping_ratio": 0.06,
    "oscillator.mass_kg": 0.1,
    "oscillator.static_friction": 0.02,
}


def scene(uncertain=UNCERTAIN, **others):
    return scattered(0.03, **others) | {"standard_uncertainties": [[key, value] for key, value in uncertain.items()]}


def inputs_of(**others):
    return uncertain_inputs(scene_of(scene(**others), STAGES["budget"].keys), None)


def test_inputs_are_grouped_by_source():
    of_sources = {source.name: dict(source.values) for source in inputs_of().sources}
    assert of_sources == {
        "friction curve": {"oscillator.static_friction": 0.4},
        "friction process": {"friction.statistics.standard_deviation": 0.03},
        "damping": {"oscillator.damping_ratio": 0.17},
        "mass": {"oscillator.mass_kg": 1.0},
    }


def test_at_the_given_values_the_machine_is_that_of_the_scene():
    inputs = inputs_of()
    own = inputs.machine({})
    again = inputs.machine({name: value for source in inputs.sources for name, value in source.values.items()})
    assert (own.oscillator, own.law) == (again.oscillator, again.law)
    for one in (own.friction, again.friction):
        assert (one.pad_deviation, one.length_m) == (pytest.approx(0.03, rel=1e-12), 2.5e-4)


def test_what_follows_from_a_drawn_value():
    """The natural frequency follows the mass. Stick never holds less."""
    softer = inputs_of().machine({"oscillator.mass_kg": 2.0})
    assert softer.oscillator.natural_frequency_rad_per_s == pytest.approx(316.0 / math.sqrt(2.0), rel=1e-15)
    assert inputs_of().machine({"oscillator.static_friction": 0.25}).law.static == 0.3
    tabled = inputs_of(law="table", friction_table=TABLE)
    assert tabled.machine({"oscillator.friction_table.0.1": 0.45}).law.static == 0.45
    assert tabled.machine({"oscillator.static_friction": 0.38}).law.values == (0.38, 0.35, 0.3)
    assert tabled.machine({"oscillator.friction_table.1.1": 0.36}).law.values == (0.4, 0.36, 0.3)
    scatter = inputs_of().machine({"friction.statistics.standard_deviation": 0.06}).friction.path_deviation
    assert scatter == pytest.approx(0.06, rel=1e-12)


def test_a_record_gives_its_curve_and_scatter_with_their_covariance():
    speeds, values = (0.0, 0.4, 1.0), np.array([0.4, 0.36, 0.33])
    factor, log_covariance = (
        np.array([[0.02, 0.0], [0.02, 0.01], [0.02, 0.02]]),
        np.array([[0.01, 0.004], [0.004, 0.04]]),
    )
    friction = {"record_mean": 0.35, "curve": values[1:], "curve_factor": factor[1:]}
    friction |= {"curve_at_rest": values[0], "curve_factor_at_rest": factor[0]}
    friction["additive_log_covariance"] = log_covariance
    curve, scatter = sources_of_record(friction, "additive")
    normal = np.random.default_rng(4).standard_normal((curve.axes, 200_000))
    drawn = np.array(list(curve.drawn(normal).values()))
    assert np.cov(drawn) == pytest.approx(factor @ factor.T, rel=0.03)
    factors = np.array(list(scatter.drawn(normal[: scatter.axes]).values()))
    assert np.cov(np.log(factors)) == pytest.approx(log_covariance, rel=0.05)
    assert factors.mean(axis=1) == pytest.approx([1.0, 1.0], abs=2e-3)
    own = TableLaw(speeds, tuple(values), 0.41)
    assert law_of_record(own, curve.values) == own
    law = law_of_record(own, {"record.curve.0": 0.43, "record.curve.2": 0.3})
    assert (law.values, law.static) == ((0.41, 0.36, 0.3), 0.41)  # sliding at rest holds no more than stick
    assert law_of_record(own, {"record.curve.1": 0.43}).static == 0.43
    assert sources_of_record({"mean": 0.3}, "additive") == ()


def test_height_acts_on_the_scatter_as_pressure_does():
    """Stresses, so contact, depend on height over pressure alone: twice as high is half the pressure. At light loads
    the law has CV ~ length (p / (E* h'))^(b - 1/2), b = 0.117 fitted, of windows far larger than the length."""

    covariance = covariance_of("gaussian", rms_height_m=1e-6, correlation_length_m=1e-5)
    pad, of_pressure = (
        (2e-3, 1e-3),
        [math.log(scatter_of_friction(covariance, 1e9, 1e6 * math.exp(s), (2e-3, 1e-3))) for s in (-0.05, 0.05)],
    )
    powers = powers_of_scatter(covariance, 1e9, 1e6, pad)
    assert powers["scan.height"] == pytest.approx((of_pressure[0] - of_pressure[1]) / 0.1, rel=1e-6)
    assert powers["scan.height"] == pytest.approx(0.5 - 0.117, abs=0.03)
    assert powers["scan.length"] == pytest.approx(1.0 - powers["scan.height"], abs=0.02)


def test_a_surface_given_with_uncertainty_is_a_source():
    """Twice the height is half the pressure. The shape is held, and so is the correlation length of friction."""
    made = SimpleNamespace(
        standard_uncertainties=(("roughness.rms_height_m", 1e-7),),
        roughness=SimpleNamespace(
            rms_height_m=1e-6,
            correlation_length_m=1e-5,
            covariance="gaussian",
            beta_shapes=None,
            **dict.fromkeys(OPTIONS),
        ),
        strip=SimpleNamespace(window_m=1e-3, width_m=1e-3),
        oscillator=SimpleNamespace(windows_in_parallel=4),
        load=SimpleNamespace(nominal_pressure_pa=1e6, pad_length_m=None),
        material=SimpleNamespace(young_modulus_pa=1e9, poisson_ratio=0.3),
    )
    inputs, powers = _of_surface(made, None)
    assert inputs == {"scan.height": (1.0, pytest.approx(0.1))}
    assert powers["scan.height"] == pytest.approx(0.5 - 0.117, abs=0.05)
    made.roughness.covariance = "exponential"
    with pytest.raises(InputError, match="heights whose slope has no limit take no standard uncertainty"):
        _of_surface(made, None)


@pytest.mark.slow
def test_the_stage_says_what_to_measure(run, folder):
    """At the paper's 0.17 stick-slip is sure; its margin, D* - D, depends on the curve most."""
    level = {"value": 0.32, "change": "falls below"}, {"value": 0.26, "change": "falls below"}
    damping = {"above": {"0.05": level[0], "0.95": level[1]}, "below": {"0.05": None, "0.95": None}}
    store.write_json(
        folder / "answer.json", {"given": True, "limits": {"damping": damping}, "probability": {"value": 1.0}}
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(budget, "SAMPLES", 16)
        result = run(budget, scene(), answer=folder / "answer.json")
    text = json.loads((folder / "text.json").read_text())
    assert list(result["source_name"]) == list(text["probability"]["first"])
    assert list(result["result_name"]) == ["probability", *text["limits"], "death", "birth"]
    assert budget.band_of({"limits": {"damping": damping}}) == (0.26, 0.32)
    assert text["limits"]["damping"]["value"] == pytest.approx(0.324424, abs=1e-6)
    assert 0.0 <= text["scatter"] <= 1.0
    assert len(figure_budget(Shown(result.dataset())).axes) == 3 + len(text["limits"])
    assert text["summary"][3] == next_to_measure(text)
    assert np.isfinite(result["first"]).all()


def test_the_sentence_names_what_takes_away_most():
    first = {"damping": (0.2, 0.1, 0.3), "friction curve": (0.7, 0.6, 0.8)}
    made = {
        "outcome": {"damping": 0.5, "friction curve": 0.1},
        "scatter": 0.35,
        "limits": {"damping": {"first": first}},
    }
    sentence = "Measure the damping next: known exactly, it takes away 50 % of the variance of whether it stick-slips; "
    unsure = next_to_measure(made | {"probability": {"mean": 0.6}})
    assert unsure == f"{sentence}the scatter of friction keeps 35 %, and no measurement takes that away."
    sure = next_to_measure(made | {"probability": {"mean": 0.99}})
    assert sure.startswith("That is sure enough. Measure the friction curve next: known exactly, it takes away 70 % of")
    nothing = made | {"outcome": {}, "probability": {"mean": 0.6}}
    assert next_to_measure(nothing) == "No number that the scene gives with an uncertainty matters here."


def test_rates_are_put_in_words():
    rates = {"death": {"mean": 0.0, "interval": (0.0, 0.0)}, "birth": {"mean": 2.87, "interval": (2.1, 3.3)}}
    assert rates_in_words(rates).endswith(
        "stick-slip ends practically never and begins 2.9 times (2.1 to 3.3) a second of sliding."
    )
    assert "not computed" in rates_in_words({})
