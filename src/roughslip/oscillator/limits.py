"""Steady sliding, the deterministic stick-slip cycle, and the damping up to which it exists.

All of it is for the free oscillator (Q = 0) with its mean friction (mu_S = 0). Where steady sliding loses its stability
and what lies between is told in `oscillator.pure_slip`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.law import FrictionLaw
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.pure_slip import hopf_damping
from roughslip.oscillator.return_map import TOLERANCE, falling_root, free, slip_flow, turn_from
from roughslip.oscillator.system import Oscillator

LOOP_PERIODS = 4.0  # the first loop of slip takes 1 / sqrt(1 - D^2) natural periods and a little


@dataclass(frozen=True)
class LimitCycle:
    """The deterministic stick-slip cycle.

    departure, reattachment : [m] X at the end and at the start of stick
    slip_duration, period : [-] in tau = omega t
    slipped_distance : [m] a cycle
    local_error : [m] sum of the error estimates of a slip phase
    """

    departure: float
    reattachment: float
    slip_duration: float
    period: float
    slipped_distance: float
    local_error: float


def equilibrium(oscillator: Oscillator, law: FrictionLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0)."""
    return slip_flow(oscillator, law).steady


def limit_cycle(oscillator: Oscillator, law: FrictionLaw, tolerance: float = 1e-11) -> LimitCycle:
    """The stick-slip cycle: one slip phase from the departure point, and the stick line back to it.

    Every departure is the same point (F static - 2 D V, V), so the first return is the cycle. Where the first loop of
    slip passes below X' = V it spirals inwards, because trajectories of the plane do not cross, and no cycle exists.

    Raises IllPosedError where the mass does not stick again; ParameterError with excitation.
    """
    free(oscillator)
    departure = oscillator.F * law.static - 2.0 * oscillator.damping_ratio * oscillator.V
    motion = simulate(oscillator, law, None, 0.0, LOOP_PERIODS, tolerance, start_position_m=departure)
    ends = np.flatnonzero(motion.kind == REATTACHMENT)
    if ends.size == 0:
        raise IllPosedError(
            f"no stick-slip cycle at the damping ratio {oscillator.damping_ratio:.6g}: the mass does not stick again; "
            f"lower the damping (see existence_limit)"
        )
    first = ends[0]
    slip_duration = float(motion.time[first] - motion.time[0])
    reattachment = float(motion.position[first])
    return LimitCycle(
        departure=departure,
        reattachment=reattachment,
        slip_duration=slip_duration,
        period=slip_duration + (departure - reattachment) / oscillator.V,
        slipped_distance=float(motion.slipped_distance[first]),
        local_error=motion.local_error,
    )


def existence_limit(
    oscillator: Oscillator, law: FrictionLaw, accuracy: float = 1e-10, tolerance: float = TOLERANCE
) -> float:
    """The damping ratio above which the stick-slip cycle ceases to exist, whatever the oscillator's own.

    accuracy : [-] of the result, 1e-12 to 1
    tolerance : [-] of the slip phases

    There the first loop of slip from the departure point, y = (F / V) (static - mu_D(v0)) - 2 D and w = 1, comes back
    to the belt and only grazes it: its next peak, which falls with D, is 1. Where friction at vanishing speed is the
    limit of stick, departure is the grazing point itself, and the stick-slip cycle has shrunk to one of slip alone.

    Raises IllPosedError where there is no cycle without damping either, ConvergenceError where there is one at any
    damping or slip is too stiff.
    """
    if not (math.isfinite(accuracy) and 1e-12 <= accuracy < 1.0):
        raise ParameterError(f"the accuracy must lie in 1e-12 to 1, not {accuracy}")
    flow = slip_flow(oscillator, law)
    departure = (oscillator.F * law.static - flow.steady) / oscillator.V

    def excess(ratio: float) -> float:
        return turn_from(replace(flow, damping_ratio=ratio), departure - 2.0 * ratio, 1.0, tolerance).peak - 1.0

    limit = falling_root(excess, hopf_damping(oscillator, law), accuracy)
    if limit is None:
        raise IllPosedError("no stick-slip cycle even without damping: friction must fall with sliding speed")
    return limit
