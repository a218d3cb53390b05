"""Where motion ends with a memory of the contact, its limits, and the answer of a machine that has one."""

import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.paths import Friction
from roughslip.oscillator.answers import answer
from roughslip.oscillator.attractors import State, attractors_of, state_from_rest, vibration_limit
from roughslip.oscillator.budget import uncertainty_budget
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import CoulombLaw
from roughslip.oscillator.limits import departure_point, existence_limit, growth_of_sliding, hopf_damping, limit_cycle
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.oscillator.slip_orbit import critical_stiffness, equilibrium
from roughslip.probability import Source
from roughslip.probability.search import first_change
from tests.oscillator.motions import LAW, STUDY

SOFT = MemoryLaw(CoulombLaw(0.3, 0.3), 0.01, 0.015, 2e-6, 1e-4, 1e-2, 1e-6)
BELT = Oscillator(0.2, 100.0, 0.05, 1e-4, 10.0)


def test_without_effects_the_limits_are_those_of_the_curve():
    """As a -> 0 and b -> 0, to first order in them; the last steps of slip are those of another method."""
    for a, b, accuracy in ((1e-9, 1e-9, 1e-5), (1e-6, 1e-9, 1e-4)):
        law = MemoryLaw(LAW, a, b, 1e-6, 1.0, 1e-3, 1e-4)
        assert hopf_damping(STUDY, law) == pytest.approx(hopf_damping(STUDY, LAW), rel=accuracy)
        assert existence_limit(STUDY, law) == pytest.approx(existence_limit(STUDY, LAW), rel=accuracy)
        for name, value in vars(limit_cycle(STUDY, LAW)).items():
            assert vars(limit_cycle(STUDY, law))[name] == pytest.approx(value, rel=accuracy), name
        one, other = (attractors_of(STUDY, either).from_sliding for either in (law, LAW))
        assert one.state is other.state is State.STICK_SLIP
        assert (one.amplitude, one.period) == pytest.approx((other.amplitude, other.period), rel=accuracy)
    assert departure_point(STUDY, law) == pytest.approx(departure_point(STUDY, LAW), rel=1e-4)


def machine(stiffness_ratio, law=SOFT, belt=BELT):
    k = stiffness_ratio * critical_stiffness(belt, law)[0]
    return Machine(belt, law, Friction(0.3, 0.003, 1e-3)).changed({"stiffness": k})


@pytest.mark.parametrize("ratio", [0.9, 0.4])
def test_the_ending_is_that_of_a_long_run(ratio):
    """Vibration and stick-slip: extremes and period of the last part of a finer motion, from either start."""
    one = machine(ratio)
    belt, found = one.oscillator, attractors_of(one.oscillator, SOFT)
    for start, end in ((0.0, found.from_rest), ((equilibrium(belt, SOFT), 0.05 * belt.V), found.from_sliding)):
        run = trajectory(belt, SOFT, None, 1.0, 1200.0, MotionOptions(1e-9, 100), start)
        last = run.position[-40_000:]
        tops = np.flatnonzero((last[1:-1] > last[:-2]) & (last[1:-1] >= last[2:]))
        assert end.state is (State.STICK_SLIP if run.motion.cycles > 3 else State.VIBRATION)
        assert end.amplitude == pytest.approx(0.5 * np.ptp(last), rel=1e-3)
        assert end.period == pytest.approx(2 * math.pi / 100 * np.mean(np.diff(tops)), rel=1e-3)
    assert found.from_rest.amplitude == pytest.approx(found.from_sliding.amplitude, rel=1e-4)


def test_limits_of_steady_sliding_are_those_of_small_motions():
    """Where the vibration grows from none motion from rest slides above k_c and above Hopf's damping, its inverse."""
    one, critical = machine(0.9), critical_stiffness(BELT, SOFT)[0]
    ends = first_change(lambda k: state_from_rest(one.changed({"stiffness": k})), 0.9 * critical, critical * 1.2, 1e-3)
    assert ends == pytest.approx((critical, critical), rel=1e-3)
    hopf = hopf_damping(one.oscillator, SOFT)
    at_limit = replace(one.oscillator, damping_ratio=hopf)
    assert critical_stiffness(at_limit, SOFT)[0] == pytest.approx(at_limit.stiffness_n_per_m, rel=1e-10)
    assert growth_of_sliding(at_limit, SOFT) == pytest.approx(0.0, abs=1e-10)
    assert vibration_limit(one, None) == pytest.approx(hopf, rel=1e-4)
    with pytest.raises(IllPosedError, match="with the age of the contacts"):
        existence_limit(one.oscillator, SOFT)


@pytest.fixture(scope="module")
def heavy():
    """A heavy mass, whose cycle takes eight natural periods."""
    law = replace(SOFT, reference_speed_m_per_s=3e-4)
    one = machine(0.05, law, Oscillator(2.0, 100.0, 0.05, 3e-4, 10.0))
    return replace(one, options=MotionOptions(1e-5))


def test_an_answer_with_memory(heavy):
    """Limits with little scatter are those without it, and what the memory decides is given."""
    belt, law = heavy.oscillator, heavy.law
    answered = answer(heavy, 72, 80.0, ("damping", "ageing_effect"))
    assert answered.probability.value == 1.0
    assert answered.durations_by_theory is None
    limit, decides = existence_limit(belt, law), answered.decides
    assert (decides["existence_limit"].value, decides["hopf_damping"].value) == (limit, hopf_damping(belt, law))
    assert answered.limits["damping"].above["0.05"].value == pytest.approx(limit, rel=0.05)
    low = answered.limits["ageing_effect"].below
    assert low["0.05"].value == pytest.approx(low["without_scatter"].value, rel=0.05)
    cycle, memory = limit_cycle(belt, law), answered.memory
    stick = memory["stick"].value
    assert stick == pytest.approx((cycle.period - cycle.slip_duration) / belt.natural_frequency_rad_per_s, rel=1e-12)
    assert law.static_friction(stick) < memory["break_away"].value < law.static_friction(stick, 0.1)
    assert memory["critical_stiffness"].value == critical_stiffness(belt, law)[0]


def test_a_budget_with_memory(heavy):
    """The limit in damping follows D_c as searches at other values have it."""
    near = heavy.changed({"damping": 0.4})
    sources = [Source.independent("memory", {"memory_length": (2e-6, 1e-8)})]
    found = uncertainty_budget(near.changed, sources, (0.41, 0.42), ("damping",), 16).limits["damping"]
    less, more = (near.changed({"memory_length": length}) for length in (1.99e-6, 2.01e-6))
    moved = existence_limit(more.oscillator, more.law) - existence_limit(less.oscillator, less.law)
    assert found.standard_uncertainty == pytest.approx(0.5 * abs(moved), rel=0.2)
