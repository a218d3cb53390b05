"""Where motion without scatter ends: in stick-slip, in a vibration without sticking, or in steady sliding.

Slip about steady sliding is a flow in a plane (`slip_orbit`), and a peak w of the velocity alone determines the motion
after it. So the next peak P(w) is a map of (0, 1) to itself or to the belt at 1. It rises with w, because orbits of a
plane do not cross. Its fixed points are cycles without sticking; those where P - w falls attract.

From rest the mass departs at w = 1, outside all these cycles. Its first loop reaches the belt again, in the stick-slip
cycle, or peaks fall to the largest fixed point below, or to 0, steady sliding. From sliding peaks stay at 0 where that
is stable. Else they rise to the smallest fixed point, or to the belt. On the way no fixed point can lie between w and
P(w), as P rises. So a search that steps as far as that, or MESH at least, sees every pair of fixed points that is
farther apart; where P - w comes near zero and turns, its extreme is searched (a fold of cycles).

Friction that rises from a minimum may let a nearly undamped mass overtake the belt. Where it falls back beyond the
departure point each loop is larger than the one before, up to that which falls back where it began.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import GRAZES, hopf_damping, loop_of_slip, meetings, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.memory_attractors import ending
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.slip_orbit import SlipFlow, slip_flow
from roughslip.probability.search import RANGE_ACCURACY, first_change
from roughslip.validation import gate

LEAST = 1e-4  # of the belt's velocity: a vibration below it is steady sliding
MESH, NARROW = 1 / 32, 1 / 512  # step of peaks, of their distance from 0 and from the belt; the latter at least NARROW
NEUTRAL = 1e-9  # relative, of a change of peak that is none
LAST = 1.0 - 1e-9  # peak next to the belt
BEYOND, LEAST_DAMPING, REACH = 1e-6, 1e-3, 100.0  # the existence limit, of a search in damping for the vibration's end
LARGEST = 1e6  # y beyond departure, in units of the belt, to which loops that pass it are followed


class State(StrEnum):
    """What a mass on a belt does in the long run."""

    STICK_SLIP = "stick_slip"
    VIBRATION = "vibration"
    SLIDING = "sliding"


@dataclass(frozen=True)
class Attractor:
    """Where a motion without scatter ends.

    amplitude : [m] half of peak to peak of the displacement; 0 in steady sliding
    period : [-] of the cycle in tau; NaN in steady sliding
    """

    state: State
    amplitude: float = 0.0
    period: float = math.nan


@dataclass(frozen=True)
class Attractors:
    """Where it ends from rest on the belt, and from steady sliding that is disturbed a little."""

    from_rest: Attractor
    from_sliding: Attractor


@gate
def attractors_of(oscillator: Oscillator, law: FrictionLaw) -> Attractors:
    """Where the motion without scatter ends, from rest and from sliding.

    Raises ConvergenceError where slip is too stiff to follow, or a run does not settle; ParameterError with excitation
    or a belt at rest.
    """
    if isinstance(law, MemoryLaw):
        return Attractors(_ended(oscillator, law, from_sliding=False), _ended(oscillator, law, from_sliding=True))
    peaks = peak_from_rest(oscillator, law), settled_peak(slip_flow(oscillator, law), LEAST, rises=True)
    from_rest, from_sliding = (_attractor(oscillator, law, peak) for peak in peaks)
    return Attractors(from_rest, from_sliding)


def state_from_rest(machine: Machine) -> State | None:
    """The state without scatter from rest on the belt; None where slip is too stiff to decide."""
    oscillator, law = machine.oscillator, machine.law
    try:
        if isinstance(law, MemoryLaw):
            return _ended(oscillator, law, from_sliding=False).state
        peak = peak_from_rest(oscillator, law)
        if peak == 1.0:
            return State.VIBRATION if slip_loop(oscillator, law).cycle is None else State.STICK_SLIP
    except ConvergenceError:
        return None
    return State.VIBRATION if peak > 0.0 else State.SLIDING


def _ended(oscillator: Oscillator, law: MemoryLaw, from_sliding: bool) -> Attractor:
    """The attractor with a memory."""
    found = ending(oscillator, law, from_sliding)
    moves = State.VIBRATION if found.cycle is None else State.STICK_SLIP
    return Attractor(moves if found.amplitude > 0.0 else State.SLIDING, found.amplitude, found.period)


def vibration_limit(machine: Machine, existence: float | None, accuracy: float = RANGE_ACCURACY) -> float | None:
    """The damping ratio beyond which no vibration without sticking follows from rest; None where there is none.

    existence : [-] existence limit of the stick-slip cycle, above which the search begins; None without one
    accuracy : relative

    Peaks fall with damping (`limits`), so there is one limit: the Hopf damping, or a fold of cycles beyond it.
    """

    def state(ratio: float) -> State | None:
        return state_from_rest(machine.changed({"damping": ratio}))

    start, hopf = (existence or LEAST_DAMPING) * (1.0 + BEYOND), hopf_damping(machine.oscillator, machine.law)
    if state(start) is not State.VIBRATION:
        return None
    if hopf > start:
        start = hopf * (1.0 + accuracy)
        if state(start) is State.SLIDING:
            return hopf
    return first_change(state, start, REACH * max(start, 1.0), accuracy)[1]


def peak_from_rest(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The peak of X' / V on which motion from rest settles; 0 in steady sliding, 1 where it comes back to the belt."""
    loop = slip_loop(oscillator, law)
    if loop.cycle is not None or loop.excess > GRAZES * (2.0 * math.pi * loop.periods) ** 2:
        return 1.0  # it sticks, or passes the belt beyond the static limit
    return settled_peak(slip_flow(oscillator, law), min(1.0 + loop.excess, LAST), rises=False)


def settled_peak(flow: SlipFlow, start: float, rises: bool) -> float:
    """The fixed point of the map of peaks that is next to a start, upwards or downwards; 0 below LEAST, 1 at the belt.

    rises : whether peaks from the start are to be followed as they rise; where they fall at once, that is 0
    """

    def onward(w: float) -> float:
        """Relative change of a peak in a loop, in the direction of the search."""
        return way * (loop_of_slip(flow, flow.at_peak(w), w)[2] / w - 1.0)

    way, w, seen = 1.0 if rises else -1.0, start, list[tuple[float, float]]()
    while w >= LEAST:
        seen = [*seen[-2:], (w, onward(w))]
        change = seen[-1][1]
        if abs(change) <= NEUTRAL:
            return w
        if change < 0.0 and len(seen) == 1:
            return 0.0 if rises else w
        beyond = w if change < 0.0 else _fold(seen, onward)
        if beyond is not None:
            before = seen[-2 if change < 0.0 else 0][0]
            return float(scipy.optimize.brentq(onward, before, beyond, xtol=1e-14 * w, rtol=1e-13))
        if w >= LAST and rises:
            return 1.0
        w += way * max(w * change, min(w, max(1.0 - w, NARROW)) * MESH)
        w = min(w, LAST)
    return 0.0


def _fold(seen: list[tuple[float, float]], onward: Callable[[float], float]) -> float | None:
    """A peak within three neighbouring ones at which the change has the other sign, where it turns next to zero."""
    if len(seen) < 3:
        return None
    (first, a), (_, b), (last, c) = seen
    if not (0.0 < b < min(a, c) and b < a + c - 2.0 * b):
        return None
    ends = sorted((first, last))
    found = scipy.optimize.minimize_scalar(onward, bounds=ends, method="bounded", options={"xatol": 1e-9 * first})
    return float(found.x) if found.fun < 0.0 else None


def _attractor(oscillator: Oscillator, law: FrictionLaw, peak: float) -> Attractor:
    """The attractor on which peaks settle; the extremes of its displacement are where w = 0, by LSODA."""
    flow, cycle = slip_flow(oscillator, law), slip_loop(oscillator, law).cycle
    if peak == 0.0:
        return Attractor(State.SLIDING)
    if peak < 1.0:
        period = loop_of_slip(flow, flow.at_peak(peak), peak)[3]
        state, start = State.VIBRATION, flow.at_peak(peak)
    elif cycle is not None:
        state, start, period = State.STICK_SLIP, flow.departure, cycle.period
    else:
        state, (start, period) = State.VIBRATION, beyond_the_belt(flow)
    _, extremes = meetings(flow, start, peak, 0.0, 2)
    return Attractor(state, 0.5 * oscillator.V * float(np.ptp(extremes)), period)


def beyond_the_belt(flow: SlipFlow) -> tuple[float, float]:
    """y at which a mass that passes the belt in each loop falls back to it, and the period [-] in tau.

    Raises ConvergenceError where loops grow beyond LARGEST.
    """

    def loop(y: float) -> tuple[float, float]:
        """How much farther the mass falls back after a loop, and the time that takes."""
        _, at_belt, _, below = loop_of_slip(flow, y, 1.0)
        (above,), (back,) = meetings(flow, at_belt, np.nextafter(1.0, 2.0), 1.0, 1)
        return float(back) - y, below + float(above)

    nearest, step = flow.departure, max(abs(flow.departure), 1.0)
    grows, period = loop(nearest)
    if not grows > 0.0:
        return nearest, period
    while loop(nearest + step)[0] > 0.0:
        step *= 2.0
        if step > LARGEST:
            lacking = "loops that pass the belt still grow: raise the damping"
            raise ConvergenceError(lacking, residual=step, work=0, scene_keys="oscillator.damping_ratio")
    y = float(scipy.optimize.brentq(lambda y: loop(y)[0], nearest, nearest + step, xtol=1e-12 * step, rtol=1e-13))
    return y, loop(y)[1]
