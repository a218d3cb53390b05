"""The answer as a user of the library asks for it: by the limit of eq. (13) without scatter, and what it shows."""

import dataclasses

import numpy as np
import pytest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction import FrictionProcess, path_sampler
from roughslip.oscillator import Oscillator, Sampling, ScatteringFriction, StribeckLaw, answer, limit_cycle
from roughslip.oscillator.changed import changed_oscillator, damper_kg_per_s
from roughslip.probability import BetaDistribution

BELT, LAW, LENGTH = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3, 0.4), 3e-4
PROCESS = FrictionProcess(BetaDistribution.of_moments(2.1, 5.0, 0.3, 1e-9), LENGTH)
FRICTION = ScatteringFriction(path_sampler(PROCESS, LENGTH / 4), LENGTH)


@pytest.fixture(scope="module")
def result():
    return answer(BELT, LAW, FRICTION, sampling=Sampling(72, 20.0), parameters=("damping",))


def test_the_motion_that_it_shows_is_the_limit_cycle(result):
    """Four periods, from one reattachment to another; in stick two samples are enough, and speed is the belt's.

    Reattachment is at the belt's velocity, and a sample every 2 pi / 100 misses the ends by less than that.
    """
    period = limit_cycle(BELT, LAW).period / BELT.natural_frequency_rad_per_s
    step = 2 * np.pi / 100 / BELT.natural_frequency_rad_per_s
    for curve in result.motion.values():
        time, x, speed = (np.array(column) for column in dataclasses.astuple(curve)[:3])
        assert curve.cycles == 4
        assert time[-1] == pytest.approx(4 * period, abs=2 * step)
        assert max(speed) == pytest.approx(BELT.belt_velocity_m_per_s, rel=1e-4)
        assert 0.5 * np.ptp(x) == pytest.approx(result.amplitude.value, rel=1e-3)
        slopes, slip = np.diff(x) / np.diff(time), speed[:-1] < 0.9 * BELT.belt_velocity_m_per_s
        between = 0.5 * (speed[1:] + speed[:-1])
        assert slopes[slip] == pytest.approx(between[slip], abs=2e-2 * BELT.belt_velocity_m_per_s)


@pytest.mark.parametrize("name", ["mass", "stiffness"])
def test_a_heavier_mass_or_a_stiffer_spring_keeps_the_damper(name):
    other = changed_oscillator(BELT, {name: 4.0 * {"mass": BELT.mass_kg, "stiffness": BELT.stiffness_n_per_m}[name]})
    assert damper_kg_per_s(other) == pytest.approx(damper_kg_per_s(BELT), rel=1e-15)
    assert other.damping_ratio == pytest.approx(0.5 * BELT.damping_ratio, rel=1e-15)


def test_a_question_without_an_answer_is_refused():
    for change in ({"excitation_force_n": 10.0}, {"belt_velocity_m_per_s": 0.0}):
        with pytest.raises(IllPosedError, match=r"the mass is excited|the belt is at rest"):
            answer(dataclasses.replace(BELT, **change), LAW, FRICTION)
    with pytest.raises(ParameterError, match="PathSampler"):
        ScatteringFriction(np.zeros(9), LENGTH)
