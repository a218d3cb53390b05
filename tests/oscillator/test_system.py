"""Parameters of the oscillator and their scaled form."""

import pytest

from roughslip.errors import ParameterError
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.system import Oscillator, coefficients

VALID = {
    "mass_kg": 1.0,
    "natural_frequency_rad_per_s": 316.0,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
}


def test_scales():
    oscillator = Oscillator(**VALID, excitation_force_n=100.0, excitation_frequency_rad_per_s=158.0)
    assert pytest.approx(0.003, rel=1e-14) == oscillator.V  # v0 / omega of the paper
    assert pytest.approx(2500.0 / 316.0**2, rel=1e-14) == oscillator.F
    assert oscillator.q == pytest.approx(100.0 / 316.0**2, rel=1e-14)
    assert oscillator.r == pytest.approx(0.5, rel=1e-14)
    p = coefficients(oscillator, StribeckLaw(0.3))
    assert (p.F, p.V, p.D, p.omega, p.q, p.r) == (
        oscillator.F, oscillator.V, 0.17, 316.0, oscillator.q, oscillator.r
    )  # fmt: skip


@pytest.mark.parametrize("name", [*VALID, "excitation_force_n", "excitation_frequency_rad_per_s"])
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf")])
def test_refuses(name, value):
    with pytest.raises(ParameterError, match=name):
        Oscillator(**(VALID | {name: value}))


@pytest.mark.parametrize("name", ["mass_kg", "natural_frequency_rad_per_s", "normal_force_n"])
def test_refuses_zero(name):
    with pytest.raises(ParameterError, match=name):
        Oscillator(**(VALID | {name: 0.0}))


def test_what_friction_follows_sets_the_advance_of_its_path():
    """Per unit of tau: nothing of its own, V of the belt, 1 / omega of time."""
    advances = {
        way: coefficients(Oscillator(**VALID), StribeckLaw(0.3), way).advance for way in ("slip", "belt", "time")
    }
    assert advances == {"slip": 0.0, "belt": pytest.approx(0.003), "time": pytest.approx(1.0 / 316.0)}
