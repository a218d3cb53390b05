"""The deterministic stick-slip cycle and the damping at which equilibrium and cycle change their nature.

All of it is for the free oscillator (Q = 0) with its mean friction (mu_S = 0).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.run import REATTACHMENT
from roughslip.oscillator.system import Oscillator

LOOP_PERIODS = 4.0  # the first loop of slip takes 1 / sqrt(1 - D^2) natural periods and a little
LARGEST_DAMPING = 1e3


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


def _free(oscillator: Oscillator) -> None:
    if oscillator.q > 0.0:
        raise ParameterError("limits of the cycle are for the free oscillator: set the excitation force to 0")


def equilibrium(oscillator: Oscillator, law: StribeckLaw) -> float:
    """X [m] of steady sliding: F mu_D(v0)."""
    _free(oscillator)
    return oscillator.F * max(float(law.mu(oscillator.belt_velocity_m_per_s)), 0.0)


def hopf_damping(oscillator: Oscillator, law: StribeckLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    """
    _free(oscillator)
    slope = float(law.slope(oscillator.belt_velocity_m_per_s))
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


def limit_cycle(oscillator: Oscillator, law: StribeckLaw, tolerance: float = 1e-11) -> LimitCycle:
    """The stick-slip cycle: one slip phase from the departure point, and the stick line back to it.

    Every departure is the same point (F static - 2 D V, V), so the first return is the cycle. Where the first loop of
    slip passes below X' = V it spirals inwards, because trajectories of the plane do not cross, and no cycle exists.

    Raises IllPosedError where the mass does not stick again; ParameterError with excitation.
    """
    _free(oscillator)
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


def _sticks_again(oscillator: Oscillator, law: StribeckLaw, damping_ratio: float, tolerance: float) -> bool:
    try:
        limit_cycle(replace(oscillator, damping_ratio=damping_ratio), law, tolerance)
    except IllPosedError:
        return False
    return True


def existence_limit(
    oscillator: Oscillator, law: StribeckLaw, accuracy: float = 1e-8, tolerance: float = 1e-12
) -> float:
    """The damping ratio above which the stick-slip cycle ceases to exist, whatever the oscillator's own.

    accuracy : [-] half width of the final bracket
    tolerance : [-] of the slip phases

    Bisection on whether the first loop of slip reaches X' = V again. Raises IllPosedError where there is no cycle
    without damping either, ConvergenceError where there is one at any damping.
    """
    if not (math.isfinite(accuracy) and 1e-12 <= accuracy < 1.0):
        raise ParameterError(f"the accuracy must lie in 1e-12 to 1, not {accuracy}")
    low, high = 0.0, max(hopf_damping(oscillator, law), 0.05)
    if not _sticks_again(oscillator, law, low, tolerance):
        raise IllPosedError("no stick-slip cycle even without damping: friction must fall with sliding speed")
    trials = 1
    while _sticks_again(oscillator, law, high, tolerance):
        trials += 1
        low, high = high, 2.0 * high
        if high > LARGEST_DAMPING:
            raise ConvergenceError("the cycle exists at every damping ratio tried", residual=high, work=trials)
    while high - low > 2.0 * accuracy:
        middle = 0.5 * (low + high)
        if _sticks_again(oscillator, law, middle, tolerance):
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
