"""A machine and what follows from a change; its answer as a user of the library asks for it, by closed forms."""

import dataclasses
import math

import numpy as np
import pytest

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.friction import Friction
from roughslip.oscillator import (
    Machine,
    Oscillator,
    StribeckLaw,
    TableLaw,
    answer,
    answer_runs,
    existence_limit,
    hopf_damping,
    limit_cycle,
)
from roughslip.oscillator.answer_parts import Limits, Quantity
from roughslip.oscillator.answer_runs import Runs
from roughslip.oscillator.answers import compared_starts, smallest_changes
from roughslip.oscillator.attractors import State
from roughslip.oscillator.laws import CoulombLaw
from roughslip.oscillator.machine import OF_MEMORY, PARAMETERS, FrictionOverLoad

BELT, LAW, LENGTH = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3, 0.4), 3e-4
OWN = Machine(BELT, LAW, Friction(0.3, 1e-9, LENGTH))


@pytest.fixture(scope="module")
def result():
    return answer(OWN, 72, 20.0, ("damping",))


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


def test_friction_follows_the_load_as_its_contacts():
    """At a load where the contacts have a fifth less friction the cycle is that of a law of a fifth less, at rest too;
    between the loads the friction force is a power of the load, beyond them in proportion."""
    over_load = FrictionOverLoad((250.0, 2500.0, 25000.0), (300.0, 2500.0, 20000.0))
    table = TableLaw((0.0, 0.5, 2.0), (0.4, 0.3, 0.25))
    machine = dataclasses.replace(OWN, law=table, over_load=over_load)
    assert machine.value("load") == pytest.approx(2500.0)
    for load, factor in ((25000.0, 0.8), (50000.0, 0.8), (250.0, 1.2), (100.0, 1.2), (2500 * 10**0.5, 0.8**0.5)):
        changed = machine.changed({"load": load})
        assert changed.value("load") == pytest.approx(load)
        assert changed.changed({"belt_velocity": 0.5}).value("load") == pytest.approx(load)
        there, law = dataclasses.replace(BELT, normal_force_n=load), table.times(factor)
        wanted = existence_limit(there, law), hopf_damping(there, law)
        found = existence_limit(changed.oscillator, table), hopf_damping(changed.oscillator, table)
        assert found == pytest.approx(wanted, rel=1e-8)


@pytest.mark.parametrize("name", [name for name in PARAMETERS if name not in OF_MEMORY])
def test_a_change_leaves_all_other_parts_of_the_machine_alone(name):
    """The damper among them, not the damping ratio. The mean takes scatter and law with it."""
    by, factor = (1.2, 1.2) if name == "mean_friction" else (2.0, 1.0)
    other = OWN.changed({name: by * OWN.value(name)})
    for part in PARAMETERS.keys() - {*OF_MEMORY, "damping"}:
        assert other.value(part) == pytest.approx((by if part == name else 1.0) * OWN.value(part), rel=1e-14)
    damper = (by if name == "damping" else 1.0) * BELT.damper_kg_per_s
    assert other.oscillator.damper_kg_per_s == pytest.approx(damper, rel=1e-14)
    assert other.friction.deviation == pytest.approx(factor * OWN.friction.deviation, rel=1e-14)
    assert (other.law.fit, other.law.static) == (pytest.approx(factor * LAW.fit), LAW.static)


def test_a_machine_knows_its_kind_of_scatter_and_its_paths():
    """Nodes of a path are a quarter of the length apart: E d^2 = 2 sigma^2 (1 - exp(-1 / 4)), sigma over the mean."""
    relative = Machine(BELT, LAW, Friction(0.3, 0.06, LENGTH, multiplies=True))
    assert (relative.options.scatter, relative.paths.spacing) == ("multiplicative", LENGTH / 4)
    steps = np.diff([next(iter(relative.kept_path([1, n]))) for n in range(40)], axis=1)
    assert np.mean(steps**2) == pytest.approx(2 * 0.2**2 * (1 - np.exp(-0.25)), rel=0.1)


def test_impossible_changes_are_refused():
    for values in ({"speed": 1.0}, {"mass": 0.0}, {"load": np.inf}):
        with pytest.raises(ParameterError, match=r"no speed to change|must be finite and positive"):
            OWN.changed(values)
    assert OWN.changed({"mean_friction": 0.5}).law.static == 0.5  # stick holds no less than slip
    with pytest.raises(ParameterError, match="no friction that scatters"):
        answer(Machine(BELT, LAW))


def test_a_question_without_an_answer_is_refused():
    for change in ({"excitation_force_n": 10.0}, {"belt_velocity_m_per_s": 0.0}):
        with pytest.raises(IllPosedError, match=r"the mass is excited|the belt is at rest"):
            answer(dataclasses.replace(OWN, oscillator=dataclasses.replace(BELT, **change)))


def test_the_smallest_change_ends_what_is_likely():
    """Stick-slip by its level of 5 %, vibration by that of either; else it begins stick-slip."""
    none = dict.fromkeys(("0.05", "0.95", "unsteady_0.05"))
    ends = none | {"0.05": Quantity(0.3, (0.28, 0.31), "1"), "unsteady_0.05": Quantity(0.31, None, "1")}
    limits = {"damping": Limits(0.2, None, "1", "D", none, ends, Quantity(None, None, "1"))}
    for shares, aim, state, change in (((0.9, 0.1), "end", "stick_slip", 0.5), ((0.2, 0.8), "end", "vibration", 0.55)):
        (found,) = smallest_changes(limits, *shares)
        assert (found.aim, found.state, found.value) == (aim, state, pytest.approx(change))
    assert smallest_changes(limits, 0.1, 0.3) == ()


def test_unstable_sliding_that_has_not_left_yet_is_not_decided():
    """Just below the Hopf damping it grows by e^20 in 20 / (2 pi (D_Hopf - D)) natural periods, here 400. Coulomb
    friction without damping is neutral: no time of runs decides."""
    slow = OWN.changed({"damping": hopf_damping(BELT, OWN.law) - 20 / (2 * math.pi * 400)})
    neutral = Machine(dataclasses.replace(BELT, damping_ratio=0.0), CoulombLaw(0.3, 0.3), OWN.friction)
    seen = {"from_rest": {State.STICK_SLIP: np.ones(72, bool)}, "from_sliding": {State.STICK_SLIP: np.zeros(72, bool)}}
    for machine, needed in ((slow, pytest.approx(400.0)), (neutral, None)):
        assert Runs(machine, 72, None, (0,)).periods(machine) == pytest.approx(400.0)
        found = compared_starts(Runs(machine, 72, 40.0, (0,)), 40.0, seen)
        assert (found["decided"], found["needs"].value) == (False, needed)
    number = np.arange(72)  # ten runs stick-slip from rest alone; from sliding alone as many, or none
    for last, differ in ((30, False), (20, True)):
        sliding = (number >= 10) & (number < last)
        seen = {"from_rest": {State.STICK_SLIP: number < 20}, "from_sliding": {State.STICK_SLIP: sliding}}
        assert compared_starts(Runs(slow, 72, 40.0, (0,)), 40.0, seen)["starts_differ"] is differ


def limits_at(**factors):
    """Limits of a likely stick-slip: for each parameter a factor of its own value 2 at which it ends."""
    none = {"0.05": None, "0.95": None, "unsteady_0.05": None}

    def one(factor):
        side = none | {"0.05": Quantity(2.0 * factor, None, "1")}
        sides = (none, side) if factor > 1.0 else (side, none)
        return Limits(2.0, None, "1", "", *sides, Quantity(None, None, "1"))

    return {name: one(factor) for name, factor in factors.items()}


@pytest.mark.parametrize(
    ("factors", "can_change", "named"),
    [
        ({"damping": 2.0, "mass": 1 / 2.5}, None, ["damping"]),  # -60 % is farther than +100 %
        ({"damping": 2.26, "load": 1 / 2.26, "mass": 3.0}, None, ["damping", "load"]),
        ({"damping": 2.26, "load": 1 / 1.2}, None, ["damping"]),  # the load is what the machine is for
        ({"load": 1 / 1.2}, None, ["load"]),
        ({"damping": 2.26, "load": 1 / 1.2}, {"load": (1.0, 2.0), "damping": (1.0, 9.0)}, ["load"]),
        ({"damping": 2.26, "mass": 3.0}, {"mass": (1.0, 6.5), "damping": (1.0, 4.0)}, ["mass"]),
        ({"damping": 2.26}, {}, []),
    ],
)
def test_changes_are_ranked_by_their_factor(factors, can_change, named):
    """Within the ranges of what can change; those of the same factor together."""
    changes = smallest_changes(limits_at(**factors), 1.0, 0.0, can_change)
    assert [change.parameter for change in changes] == named
    assert all(change.value == pytest.approx(factors[change.parameter] - 1.0) for change in changes)


@pytest.mark.parametrize(("most", "runs", "length"), [(10.0, 0, LENGTH), (6e4, 1, LENGTH), (4e5, 0, 3e-7)])
def test_an_answer_that_takes_too_many_steps_ends_with_what_to_change(monkeypatch, most, runs, length):
    """By the first run, or by all of them: later ones are longer. A given duration says that they are wanted. Where the
    path is fine, its nodes decide."""
    monkeypatch.setattr(answer_runs, "MOST_STEPS", most)
    own = Machine(BELT, LAW, Friction(0.3, 0.03, length))
    free, given = (Runs(own, 1, duration, (0,)) for duration in (None, 20.0))
    with pytest.raises(ConvergenceError, match="steps of slip or more") as caught:
        [free.one(own, 0, 20.0 * (1 + 19 * (run > 0)), False) for run in range(100)]
    assert (len(free.steps) > 1) == (runs > 0)
    assert caught.value.work == int(sum(free.steps))
    given.one(own, 0, 20.0, False)
