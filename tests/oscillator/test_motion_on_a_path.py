"""Stick and slip in turn along a friction path: micro-slips, paths in pieces, faults."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.friction import Friction
from roughslip.oscillator.cycles import ensemble
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.oscillator.states import longest_slip, run_until_known, states_of
from tests.oscillator.motions import LAW, STUDY, F, V


def wave(spacing=1e-4, length=0.25, amplitude=0.05, wavelength=4e-3):
    """A smooth friction path."""
    return amplitude * np.sin(2.0 * math.pi * spacing * np.arange(round(length / spacing) + 1) / wavelength), spacing


def test_micro_slip_and_cycle_are_distinguished():
    """Friction that climbs by 0.3 over the first 0.3 mm of slip stops the mass before it turns; beyond it is level.

    Stick holds again at the higher limit; on the level part the slip is the deterministic one and ends a cycle.
    """
    spacing = 2e-5
    path = np.minimum(np.arange(8000) * spacing / 3e-4, 1.0) * 0.3
    drawn = trajectory(STUDY, LAW, path, spacing, 4.0, MotionOptions(samples_per_period=4000))
    motion = drawn.motion
    reattached = np.flatnonzero(motion.kind == REATTACHMENT)
    assert motion.cycles + motion.micro_slips == reattached.size
    assert motion.micro_slips >= 1
    assert motion.cycles >= 1
    for k in reattached:
        inside = (drawn.time > motion.time[k - 1]) & (drawn.time < motion.time[k])
        if inside.sum() > 2:
            assert bool(motion.backwards[k]) == bool(drawn.velocity[inside].min() < 0.0)
        if not motion.backwards[k]:
            assert motion.slipped_distance[k] < 3.1e-4  # micro-slips happen on the climb alone
    level = motion.position[(motion.kind == DEPARTURE) & (motion.slipped_distance > 4e-4)]
    assert level == pytest.approx(np.full(level.size, 0.7 * F - 2 * 0.17 * V), rel=1e-9)


def test_turning_point_between_steps():
    """A climb of friction lifts the least X' of a slip through zero: the flag turns where the drawn minimum is zero.

    Nodes 1 mm apart and a tolerance of 1e-7 make steps so long (0.1) that none ends near the minimum.
    """

    def draw(height):
        climb = np.full(60, 0.6)
        climb[:2] = 0.0, height
        drawn = trajectory(STUDY, LAW, climb, 1e-3, 3.0, MotionOptions(1e-7, samples_per_period=4000))
        k = np.flatnonzero(drawn.motion.kind == REATTACHMENT)[0]
        return bool(drawn.motion.backwards[k]), drawn.velocity[drawn.time < drawn.motion.time[k]].min()

    low, high = 0.0, 0.2
    assert draw(low)[0]
    assert not draw(high)[0]
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if draw(middle)[0] else (low, middle)
    # the nearest sample is at most 0.0008 away, and misses by the rate of X'' (below F) times 0.0008^2 / 2
    assert draw(high)[1] == pytest.approx(0.0, abs=1e-5 * V)


def test_negative_friction_is_cut_and_counted():
    """mu_D is 0.24 to 0.4: a path of +- 0.35 cuts it at times, one of +- 0.2 never does."""
    wide, narrow = (size * np.sin(np.arange(4000) / 20.0) for size in (0.35, 0.2))
    assert simulate(STUDY, LAW, narrow, 5e-5, 8.0).cuts == 0
    clipped = simulate(STUDY, LAW, wide, 5e-5, 8.0)
    assert 0 < clipped.cuts < clipped.steps


def test_counts_of_an_ensemble_are_those_of_single_runs():
    """Of each path and without one, at all combinations of two parameters. A change of the stiffness alone changes
    omega and D."""
    path, spacing = wave(length=1.0)
    paths, values = [path, itertools.repeat(path[:50]), None], {"belt_velocity": [0.5, 0.9], "load": [2e3, 3e3, 4e3]}
    counts = ensemble(Machine(STUDY, LAW), paths, spacing, 30.0, over=values)
    for place in np.ndindex(3, 2, 3):
        velocity, load = values["belt_velocity"][place[1]], values["load"][place[2]]
        belt = replace(STUDY, belt_velocity_m_per_s=velocity, normal_force_n=load)
        motion = simulate(belt, LAW, paths[place[0]], spacing, 30.0)
        single = motion.cycles, motion.micro_slips, motion.last_cycle, motion.cuts
        assert tuple(getattr(counts, name)[place] for name in ("cycles", "micro_slips", "last_cycle", "cuts")) == single
    stiffer = replace(STUDY, natural_frequency_rad_per_s=2 * 316.0, damping_ratio=STUDY.damping_ratio / 2)
    runs = ensemble(
        Machine(STUDY, LAW), [None], duration_periods=30.0, over={"stiffness": [4 * STUDY.stiffness_n_per_m]}
    )
    assert runs.cycles.tolist() == [[simulate(stiffer, LAW, duration_periods=30.0).cycles]]


@pytest.mark.parametrize("size", [1, 3, 1000])
def test_a_path_in_pieces_gives_the_same_motion(size):
    """Bit by bit, for any length of the pieces, which end in the middle of a slip."""
    path = 0.1 * np.random.default_rng(5).uniform(-1.0, 1.0, 4000)
    pieces = [path[k : k + size] for k in range(0, 4000, size)]
    whole, piecewise = (trajectory(STUDY, LAW, nodes, 5e-5, 6.0) for nodes in (path, pieces))
    assert np.count_nonzero(whole.motion.kind == DEPARTURE) > 3
    for name in ("kind", "time", "position", "slipped_distance", "backwards", "steps"):
        assert np.array_equal(getattr(piecewise.motion, name), getattr(whole.motion, name))
    assert np.array_equal(piecewise.position, whole.position)
    assert piecewise.motion.local_error == pytest.approx(whole.motion.local_error, rel=1e-12)  # summed in another order


@pytest.mark.parametrize("damping", [0.05, 0.17, 0.25])
def test_a_run_ends_where_no_later_motion_changes_its_state(damping):
    """States up to the time asked for are those of a run that goes on. It ends with a cycle, or a slip as long."""
    machine = Machine(replace(STUDY, damping_ratio=damping), LAW, Friction(0.3, 0.02, 3e-4), MotionOptions(1e-5))
    longest, spacing = longest_slip(machine.oscillator, machine.law), machine.paths.spacing
    for number in range(8):
        path = machine.kept_path([number])
        motion, first, states = run_until_known(machine, path, spacing, 12.0)
        end, on = first + 12.0, simulate(machine.oscillator, machine.law, path, spacing, 40.0, machine.options)
        whole = states_of(on, longest)
        for name in ("stick_slip", "sliding"):
            early, late = (np.minimum(getattr(one, name), end) for one in (states, whole))
            assert early[early[:, 0] < end] == pytest.approx(late[late[:, 0] < end], rel=1e-6)
        assert end < motion.duration / (2 * math.pi) < end + 2 * longest
