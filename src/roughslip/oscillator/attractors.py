"""Where motion without scatter ends: in stick-slip, in a vibration without sticking, or in steady sliding.

Slip about steady sliding is a flow in a plane (`slip_orbit`), and a peak w of the velocity alone determines the motion
after it. So the next peak P(w) is a map of (0, 1) to itself or to the belt at 1. It rises with w, because orbits of a
plane do not cross. Its fixed points are cycles without sticking; those where P - w falls attract.

From rest the mass departs at w = 1, outside all these cycles. Its first loop reaches the belt again, in the stick-slip
cycle, or peaks fall to the largest fixed point below, or to 0, steady sliding. From sliding peaks stay at 0 where that
is stable. Else they rise to the smallest fixed point, or to the belt. On the way no fixed point can lie between w and
P(w), as P rises. So a search that steps as far as that, or MESH at least, sees every pair of fixed points that is
farther apart; where P - w comes near zero and turns, its extreme is searched (a fold of cycles).

Friction that rises from a minimum may let a nearly undamped mass overtake the belt and fall back behind it. Runs tell
then where it ends.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache

import numpy as np
import scipy  # its parts when they are used

from roughslip.compilation.cache import compiled
from roughslip.errors import ConvergenceError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import CROSSING
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import hopf_damping, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.oscillator.slip_orbit import (
    HALVINGS,
    TOLERANCE,
    SlipFlow,
    departure_point,
    next_step,
    rk_step,
    slip_flow,
    turn,
)
from roughslip.probability.search import RANGE_ACCURACY, first_change
from roughslip.validation import gate

LEAST = 1e-4  # of the belt's velocity: a vibration below it is steady sliding
MESH, NARROW = 1 / 32, 1 / 512  # step of peaks, of their distance from 0 and from the belt; the latter at least NARROW
NEUTRAL = 1e-9  # relative, of a change of peak that is none
LAST = 1.0 - 1e-9  # peak next to the belt
MOST_STEPS = 100_000  # to an extreme of the place
BEYOND, LEAST_DAMPING, REACH = 1e-6, 1e-3, 100.0  # the existence limit, of a search in damping for the vibration's end
LOOPS, MOST_LOOPS, SETTLED = 50.0, 12_800.0, 1e-7  # natural periods of runs beyond the belt; change of a loop then


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

    @property
    def least_vibration(self) -> Attractor | None:
        """The vibration without sticking of the smaller amplitude, if there is one."""
        found = [one for one in (self.from_rest, self.from_sliding) if one.state is State.VIBRATION]
        return min(found, key=lambda one: one.amplitude, default=None)


@gate
def attractors_of(oscillator: Oscillator, law: FrictionLaw) -> Attractors:
    """Where the motion without scatter ends, from rest and from sliding.

    Raises ConvergenceError where slip is too stiff to follow, or a run does not settle; ParameterError with excitation
    or a belt at rest.
    """
    return _found(oscillator, law)


@lru_cache(maxsize=256)
def _found(oscillator: Oscillator, law: FrictionLaw) -> Attractors:
    flow = slip_flow(oscillator, law)
    starts = peak_from_rest(oscillator, law), settled_peak(flow, LEAST, rises=True)
    from_rest, from_sliding = (_attractor(oscillator, law, flow, peak) for peak in starts)
    return Attractors(from_rest, from_sliding)


def state_from_rest(machine: Machine) -> State | None:
    """The state without scatter from rest on the belt; None where slip is too stiff to decide."""
    try:
        peak = peak_from_rest(machine.oscillator, machine.law)
        if peak < 1.0:
            return State.VIBRATION if peak > 0.0 else State.SLIDING
        return beyond_the_belt(machine.oscillator, machine.law).state
    except ConvergenceError:
        return None


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
    if slip_loop(oscillator, law).cycle is not None:
        return 1.0
    flow, limit = slip_flow(oscillator, law), oscillator.F * law.static
    low, trough, _ = turn(flow, flow.departure, 1.0)
    if trough == 0.0:
        return 0.0
    y, peak, _ = turn(flow, low, trough, to_belt=True)
    if peak > 1.0 and oscillator.V * (y - flow.departure) <= -2.0 * limit:
        return 1.0  # beyond the static limit: it passes the belt
    return settled_peak(flow, min(peak, LAST), rises=False)


def following_peak(flow: SlipFlow, y: float, w: float) -> tuple[float, float]:
    """The peak after a peak or departure, above 1 at the belt and 0 at rest, and the time until then [-]."""
    low, trough, down = turn(flow, y, w)
    if trough == 0.0:
        return 0.0, down
    _, peak, up = turn(flow, low, trough, to_belt=True)
    return peak, down + up


def settled_peak(flow: SlipFlow, start: float, rises: bool) -> float:
    """The fixed point of the map of peaks that is next to a start, upwards or downwards; 0 below LEAST, 1 at the belt.

    rises : whether peaks from the start are to be followed as they rise; where they fall at once, that is 0
    """

    def growth(w: float) -> float:
        return following_peak(flow, flow.at_peak(w), w)[0] / w - 1.0

    way, w, seen = 1.0 if rises else -1.0, start, list[tuple[float, float]]()
    while w >= LEAST:
        seen.append((w, growth(w)))
        if abs(seen[-1][1]) <= NEUTRAL:
            return w
        touched = _fold(seen[-3:], growth, way)
        if touched is not None or way * seen[-1][1] < 0.0:
            if len(seen) == 1:
                return 0.0 if rises else w
            before, beyond = (seen[-3][0], touched) if touched is not None else (seen[-2][0], w)
            return float(scipy.optimize.brentq(growth, before, beyond, xtol=1e-14 * w, rtol=1e-13))
        if w >= LAST and rises:
            return 1.0
        step = min(w, max(1.0 - w, NARROW)) * MESH
        w = min(max(w * (1.0 + seen[-1][1]), w + step), LAST) if rises else min(w * (1.0 + seen[-1][1]), w - step)
    return 0.0


def _fold(seen: list[tuple[float, float]], growth: Callable[[float], float], way: float) -> float | None:
    """A peak within three neighbouring ones at which growth has the other sign, where it turns next to zero."""
    if len(seen) < 3:
        return None
    (first, a), (_, b), (last, c) = [(w, way * g) for w, g in seen]
    if not (0.0 < b < min(a, c) and b < a + c - 2.0 * b):
        return None
    found = scipy.optimize.minimize_scalar(
        lambda w: way * growth(w), bounds=sorted((first, last)), method="bounded", options={"xatol": 1e-9 * first}
    )
    return float(found.x) if found.fun < 0.0 else None


def _attractor(oscillator: Oscillator, law: FrictionLaw, flow: SlipFlow, peak: float) -> Attractor:
    """The attractor on which peaks settle."""
    if peak == 0.0:
        return Attractor(State.SLIDING)
    if peak < 1.0:
        period = following_peak(flow, flow.at_peak(peak), peak)[1]
        return Attractor(State.VIBRATION, oscillator.V * _half_range(flow, flow.at_peak(peak), peak), period)
    cycle = slip_loop(oscillator, law).cycle
    if cycle is None:
        return beyond_the_belt(oscillator, law)
    return Attractor(State.STICK_SLIP, oscillator.V * _half_range(flow, flow.departure, 1.0), cycle.period)


def _half_range(flow: SlipFlow, y: float, w: float) -> float:
    """Half the distance of the extremes of y in the loop from a peak or departure."""
    low, trough, _ = turn(flow, y, w)
    farthest, nearest = np.array([y, w]), np.array([low, trough])
    if not (_to_standstill(farthest, flow) and _to_standstill(nearest, flow)):
        raise ConvergenceError(
            "the extremes of a cycle take too many steps: lower the normal force or give a stiffer spring; scene keys: "
            "oscillator.normal_force_n, oscillator.stiffness_n_per_m; velocity in units of V",
            residual=abs(float(farthest[1])),
            work=MOST_STEPS,
        )
    return 0.5 * float(farthest[0] - nearest[0])


@compiled(error_model="numpy")
def _to_standstill(z: np.ndarray, flow: SlipFlow) -> bool:
    """Move z : (2,) y and w to where w is 0 next, the last step halved to it; whether MOST_STEPS reach that."""
    h, k, end = 1e-2, np.zeros((6, 2)), z.copy()
    for _ in range(MOST_STEPS):
        error = rk_step(z, h, flow, k, end) / (TOLERANCE * max(abs(z[1]), abs(end[0]), abs(end[1])))
        if error <= 1.0 and end[1] * z[1] <= 0.0:
            low, high = 0.0, h
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                rk_step(z, middle, flow, k, end)
                if end[1] * z[1] <= 0.0:
                    high = middle
                else:
                    low = middle
            z[:] = end
            return True
        if error <= 1.0:
            z[:] = end
        h = next_step(h, error) if error < math.inf else 0.2 * h
    return False


@lru_cache(maxsize=256)
def beyond_the_belt(oscillator: Oscillator, law: FrictionLaw) -> Attractor:
    """The attractor of a motion that comes back to the belt: the stick-slip cycle, or what runs from departure show.

    Raises ConvergenceError where loops still change after MOST_LOOPS natural periods.
    """
    if slip_loop(oscillator, law).cycle is not None:
        return _attractor(oscillator, law, slip_flow(oscillator, law), 1.0)
    periods, change, departure = LOOPS, math.inf, departure_point(oscillator, law)
    while periods <= MOST_LOOPS:
        drawn = trajectory(oscillator, law, None, math.nan, periods, MotionOptions(1e-11), start_m=departure)
        motion = drawn.motion
        sticks = bool(motion.backwards.any())
        marks = motion.backwards if sticks else (motion.kind == CROSSING) & (motion.position > 0.0)
        times, places = motion.time[marks][-2:], motion.position[marks][-2:]
        if times.size == 2:
            last = (times[0] <= drawn.time) & (drawn.time <= times[1])
            change = abs(float(np.diff(places)[0]))
            if change <= SETTLED * oscillator.F:
                state = State.STICK_SLIP if sticks else State.VIBRATION
                return Attractor(state, 0.5 * float(np.ptp(drawn.position[last])), float(np.diff(times)[0]))
        periods *= 4.0
    raise ConvergenceError(
        f"loops that pass the belt still change after {MOST_LOOPS:g} natural periods: raise the damping; scene key: "
        "oscillator.damping_ratio",
        residual=change,
        work=int(periods),
    )
