"""An oscillator in other units of length and time moves alike; by powers of two, so rounding is the same too."""

from dataclasses import replace

import numpy as np
import pytest

from roughslip.oscillator.counts import ensemble
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.grazing import grazing_response
from roughslip.oscillator.limits import existence_limit, hopf_damping, limit_cycle
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.oscillator.states import time_scales
from tests.oscillator.motions import STUDY

METRE, SECOND = 2.0**9, 2.0**-6  # of the other units, in each of the first
BELT = replace(STUDY, damping_ratio=0.25, excitation_force_n=60.0, excitation_frequency_rad_per_s=500.0)
NODES = 0.05 * np.random.default_rng(3).standard_normal(400)


def other_units(belt):
    """The mass stays, so that a newton is METRE / SECOND^2 of the others."""
    force = METRE / SECOND**2
    return replace(
        belt,
        natural_frequency_rad_per_s=belt.natural_frequency_rad_per_s / SECOND,
        belt_velocity_m_per_s=belt.belt_velocity_m_per_s * METRE / SECOND,
        normal_force_n=belt.normal_force_n * force,
        excitation_force_n=belt.excitation_force_n * force,
        excitation_frequency_rad_per_s=belt.excitation_frequency_rad_per_s / SECOND,
    )


def laws(name):
    """A law, and the same of speeds in the other units."""
    unit = METRE / SECOND
    if name == "stribeck":
        return StribeckLaw(0.3), StribeckLaw(0.3, 0.4, 1.42 / unit, 0.01 / unit**2)
    speeds, values = np.array([0.0, 0.4, 1.0, 3.0]), (0.4, 0.3, 0.2, 0.25)
    return tuple(TableLaw(tuple(scale * speeds), values) for scale in (1.0, unit))


@pytest.mark.parametrize("law", ["stribeck", "table"])
@pytest.mark.parametrize(("follows", "spacing"), [("slip", METRE), ("belt", METRE), ("time", SECOND)])
def test_motions(law, follows, spacing):
    first, second = laws(law)
    options = MotionOptions(friction_follows=follows, samples_per_period=40)
    a = 1.0 if follows != "time" else 1.0 / BELT.belt_velocity_m_per_s
    one = trajectory(BELT, first, NODES, 6e-4 * a, 10.0, options)
    two = trajectory(other_units(BELT), second, NODES, 6e-4 * a * spacing, 10.0, options)
    assert one.motion.kind.size >= 6
    np.testing.assert_array_equal(two.motion.kind, one.motion.kind)
    np.testing.assert_array_equal(two.motion.backwards, one.motion.backwards)
    np.testing.assert_allclose(two.motion.time, one.motion.time, rtol=1e-12)
    np.testing.assert_allclose(two.motion.position, METRE * one.motion.position, rtol=1e-12)
    np.testing.assert_allclose(two.motion.slipped_distance, METRE * one.motion.slipped_distance, rtol=1e-12)
    np.testing.assert_allclose(two.position, METRE * one.position, rtol=1e-9, atol=1e-12 * METRE)
    np.testing.assert_allclose(two.velocity, METRE * one.velocity, rtol=1e-9, atol=1e-12 * METRE)
    assert two.motion.local_error == pytest.approx(METRE * one.motion.local_error, rel=1e-9)
    assert (two.motion.steps, two.motion.cuts) == (one.motion.steps, one.motion.cuts)


def test_limits_cycles_and_counts():
    free = replace(BELT, excitation_force_n=0.0)
    other, (first, second) = other_units(free), laws("stribeck")
    assert hopf_damping(other, second) == pytest.approx(hopf_damping(free, first), rel=1e-12)
    assert existence_limit(other, second) == pytest.approx(existence_limit(free, first), abs=1e-9)
    cycles = limit_cycle(free, first), limit_cycle(other, second)
    for name in ("departure", "reattachment", "slipped_distance", "local_error"):
        assert getattr(cycles[1], name) == pytest.approx(METRE * getattr(cycles[0], name), rel=1e-9)
    for name in ("slip_duration", "period"):
        assert getattr(cycles[1], name) == pytest.approx(getattr(cycles[0], name), rel=1e-12)
    responses = grazing_response(free, first), grazing_response(other, second)
    assert responses[1].scatter(METRE * 3e-4) == pytest.approx(responses[0].scatter(3e-4), rel=1e-6)
    np.testing.assert_allclose(responses[1].slipped, METRE * responses[0].slipped, atol=1e-8 * METRE)
    assert time_scales(other, second, METRE * 3e-4) == pytest.approx(time_scales(free, first, 3e-4), rel=1e-9)
    dampings, path = {"damping": [0.1, 0.3, 0.4]}, 0.2 * NODES
    for one, two in (
        (
            ensemble(free, first, [None], 0.0, 30.0, over=dampings),
            ensemble(other, second, [None], 0.0, 30.0, over=dampings),
        ),
        (
            ensemble(free, first, [path], 1e-3, 10.0, over=dampings),
            ensemble(other, second, [path], 1e-3 * METRE, 10.0, over=dampings),
        ),
    ):
        np.testing.assert_array_equal(two.cycles, one.cycles)
        np.testing.assert_allclose(two.last_cycle, one.last_cycle, rtol=1e-9)
        np.testing.assert_allclose(two.stick_slip, one.stick_slip, rtol=1e-9)
        assert two.steps == one.steps
