"""Which initial states end in stick-slip, without scatter, and what share of a box of states does.

In the plane (X, X') motions do not cross. So the peaks of X' below the belt's velocity, of one motion, all rise or all
fall. A motion whose peaks fall never comes back to the belt: it ends in steady sliding, or in a cycle of slip alone. A
motion that sticks departs where all sticks end, and is in the stick-slip cycle if that exists (`slip_loop`). The basins
meet at an unstable cycle of slip. Near it peaks change slowly, and a motion is followed until they have changed.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.event_loop import DEPARTURE, REATTACHMENT
from roughslip.oscillator.laws import FrictionLaw
from roughslip.oscillator.limits import equilibrium, hopf_damping, slip_loop
from roughslip.oscillator.motion import MotionOptions, Trajectory, trajectory
from roughslip.oscillator.slip_flow import next_peak, slip_flow
from roughslip.oscillator.states import longest_slip
from roughslip.probability.estimate import wilson_interval
from roughslip.validation import gate

OPTIONS = MotionOptions(samples_per_period=100)  # a peak of theirs is up to 5e-4 below the true one, as X''' = -X'
FALLEN = 0.01  # relative, of the peaks; twenty times that
AT_REST = 1e-3  # distance from steady sliding, in units of V, where overdamped slip has no peaks
SMALL = 0.02  # peak of X' / V from which an unstable cycle is sought
DOUBLINGS = 12  # of the time of a run, which begins as the longest slip of a cycle


@dataclass(frozen=True)
class Basins:
    """Which states of a box end in stick-slip.

    states : (samples, 2) [m] X and X' = dX/dtau
    stick_slip : (samples,) whether the motion from there ends in stick-slip
    share, low, high : [-] of stick-slip, and the 95 % interval of Wilson
    """

    states: np.ndarray
    stick_slip: np.ndarray
    share: float
    low: float
    high: float


@gate
def ends_in_stick_slip(oscillator: Oscillator, law: FrictionLaw, states: np.ndarray) -> np.ndarray:
    """Whether the motion without scatter from each initial state ends in stick-slip : (samples,).

    states : (samples, 2) [m] X and X' = dX/dtau, which is V = v0 / omega on the belt

    Raises ParameterError with excitation or a belt at rest. Raises ConvergenceError where slip is too stiff, and for a
    motion that neither sticks nor falls, as on the unstable cycle, without damping, or on a cycle of slip alone.
    """
    if states.shape[1] != 2:
        raise ParameterError(f"a state is X and X', not {states.shape[1]} numbers")
    if slip_loop(oscillator, law).cycle is None:
        return np.zeros(len(states), dtype=bool)
    return np.array([_sticks(oscillator, law, (float(x), float(u))) for x, u in states], dtype=bool)


@gate
def basin_share(
    oscillator: Oscillator,
    law: FrictionLaw,
    box: tuple[tuple[float, float], tuple[float, float]],
    samples: int = 1000,
    seed: Sequence[int] = (0,),
) -> Basins:
    """The share of a box of initial states that ends in stick-slip, without scatter.

    box : [m] least and largest X, and least and largest X'
    samples : independent states, of equal density in the box

    Raises ParameterError for a box without an inside or no samples, and as `ends_in_stick_slip` does.
    """
    low, high = np.transpose(box)
    if not (np.all(np.isfinite(box)) and np.all(low < high)):
        raise ParameterError(f"a box has a least number below a largest one, of X and of X', not {box}")
    if samples < 1:
        raise ParameterError(f"a share needs at least one sample, not {samples}")
    states = np.random.default_rng([*seed]).uniform(low, high, (samples, 2))
    labels = ends_in_stick_slip(oscillator, law, states)
    count = int(np.count_nonzero(labels))
    interval = wilson_interval(count, samples)
    return Basins(states, labels, count / samples, float(interval[0]), float(interval[1]))


@gate
def unstable_cycle(oscillator: Oscillator, law: FrictionLaw) -> np.ndarray:
    """(samples, 2) [m] X and X' on the cycle of slip that parts the basins; none where one state alone attracts.

    Its peak is a fixed point of the map of the peaks of X' below the belt, between sliding and the grazing orbit.
    """
    flow = slip_flow(oscillator, law)

    def grows(w: float) -> float:
        return next_peak(flow, flow.at_peak(w), w)[0] - w

    if not (grows(SMALL) < 0.0 < grows(1.0)):
        return np.empty((0, 2))
    w = float(scipy.optimize.brentq(grows, SMALL, 1.0))
    periods = next_peak(flow, flow.at_peak(w), w)[1] / (2.0 * math.pi)
    start = flow.steady + oscillator.V * flow.at_peak(w), oscillator.V * w
    drawn = trajectory(oscillator, law, None, 0.0, periods, OPTIONS, start)
    return np.stack([drawn.position, drawn.velocity], axis=1)


def _sticks(oscillator: Oscillator, law: FrictionLaw, start: tuple[float, float]) -> bool:
    """Whether the motion from a state ever sticks; it is followed until that is known."""
    periods = longest_slip(oscillator, law)
    for _ in range(DOUBLINGS):
        drawn = trajectory(oscillator, law, None, 0.0, periods, OPTIONS, start)
        kinds = drawn.motion.kind
        if REATTACHMENT in kinds or kinds.size == 0 or (kinds[0] == DEPARTURE and drawn.motion.time[0] > 0.0):
            return True
        if _falls(oscillator, law, drawn):
            return False
        periods *= 2.0
    raise ConvergenceError(
        f"from X = {start[0]:.6g} m, X' = {start[1]:.6g} m the mass has neither stuck nor come closer to steady "
        f"sliding in {0.5 * periods:.3g} natural periods: try another state, or another damping ratio than "
        f"{oscillator.damping_ratio:.6g}; scene key: oscillator.damping_ratio",
        residual=1.0,
        work=DOUBLINGS,
    )


def _falls(oscillator: Oscillator, law: FrictionLaw, drawn: Trajectory) -> bool:
    """Whether the peaks of X' below the belt's velocity have fallen, or slip without peaks is at rest."""
    u = drawn.velocity
    inner = u[1:-1]
    peaks = inner[(inner > u[:-2]) & (inner >= u[2:]) & (inner > 0.0) & (inner < oscillator.V)]
    if peaks.size > 1 and peaks[-1] < (1.0 - FALLEN) * peaks[0]:
        return True
    distance = math.hypot(drawn.position[-1] - equilibrium(oscillator, law), u[-1])
    return distance < AT_REST * oscillator.V and oscillator.damping_ratio > hopf_damping(oscillator, law)
