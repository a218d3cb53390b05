"""What follows from a change of one parameter of the oscillator: the other parts of the machine stay as they are."""

import pytest

from roughslip.errors import InputError, ParameterError
from roughslip.oscillator.changed import damper_kg_per_s
from roughslip.probability import beta_moments
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import variation
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.variation import PARAMETERS, changeable, changed, system
from tests.stages.scenes import OSCILLATOR

NUMBERS = FrictionNumbers(0.3, 0.05, 2.5e-4, 2.1, 5.0)
SCENE = scene_of({"oscillator": OSCILLATOR})
KEPT = {"mass_kg": 1, "k": 1, "d": 1, "v0": 1, "N": 1, "n": 1, "mean": 1, "std": 1, "L": 1, "static": 1}
CHANGES = {
    "damping": {"d": 2},
    "belt_velocity": {"v0": 2},
    "mass": {"mass_kg": 2},
    "stiffness": {"k": 2},
    "load": {"N": 2},
    "windows": {"n": 2},
    "correlation_length": {"L": 2},
    "mean_friction": {"mean": 1.2, "std": 1.2},
}


def parts(one):
    return {
        "mass_kg": one.belt.mass_kg,
        "k": one.belt.stiffness_n_per_m,
        "d": damper_kg_per_s(one.belt),
        "v0": one.belt.belt_velocity_m_per_s,
        "N": one.belt.normal_force_n,
        "n": one.windows,
        "mean": one.law.fit,
        "std": one.numbers.standard_deviation,
        "L": one.numbers.correlation_length_m,
        "static": one.law.static,
    }


@pytest.mark.parametrize("name", PARAMETERS)
def test_a_change_leaves_all_other_parts_of_the_machine_alone(name):
    own = system(SCENE, NUMBERS)
    factor = max(CHANGES[name].values())
    other = changed(SCENE, NUMBERS, {name: factor * PARAMETERS[name].value(own)})
    assert PARAMETERS[name].value(other) == pytest.approx(factor * PARAMETERS[name].value(own), rel=1e-14)
    expected = {part: value * (KEPT | CHANGES[name])[part] for part, value in parts(own).items()}
    assert parts(other) == pytest.approx(expected, rel=1e-14)


def test_mass_and_stiffness_in_proportion_scale_the_damping_ratio_alone():
    """omega stays and D falls as 1 / m, for d stays; a damping ratio given with them holds as it is."""
    both = {"mass": 4.0, "stiffness": 4 * 316.0**2}
    scaled = changed(SCENE, NUMBERS, both).belt
    assert scaled.natural_frequency_rad_per_s == pytest.approx(316, rel=1e-14)
    assert scaled.damping_ratio == pytest.approx(0.17 / 4, rel=1e-14)
    assert changed(SCENE, NUMBERS, both | {"damping": 0.2}).belt.damping_ratio == 0.2


def test_windows_make_the_process_scatter_less_by_their_root():
    for n, deviation in ((1, 0.05), (16.2, 0.05 / 4)):
        of_mean = variation.process(SCENE, changed(SCENE, NUMBERS, {"windows": n}), None).marginal
        _, std, _, _ = beta_moments(of_mean.a, of_mean.b)
        assert (of_mean.upper - of_mean.lower) * std == pytest.approx(deviation, rel=1e-9)


def test_parameters_without_effect_and_impossible_values_are_refused():
    fixed = scene_of({"oscillator": OSCILLATOR | {"law": "table"}, "ensemble": {"marginal": "empirical"}})
    assert set(PARAMETERS) - set(changeable(fixed)) == {"mean_friction", "windows"}
    with pytest.raises(ParameterError, match=r"^windows has no effect in this scene; choose of: damping, "):
        changed(fixed, NUMBERS, {"windows": 2})
    with pytest.raises(ParameterError, match=r"mass must be finite and positive, not 0"):
        changed(SCENE, NUMBERS, {"mass": 0})
    with pytest.raises(InputError, match=r"static_friction: 0.4 is less than the mean friction coefficient 0.5"):
        changed(SCENE, NUMBERS, {"mean_friction": 0.5})
