"""Cycles without stick, which begin at the Hopf point and end where they graze the belt.

The branch is told by the peak a of X' / V: to each 0 < a <= 1 belongs one damping ratio D(a) at most
(`oscillator.return_map`). It begins at D(0) = D_Hopf with

    D(a) = D_Hopf + (g3 / 16) a^2 + O(a^4),    g3 = G'''(0) = -N v0^2 mu_D'''(v0) / (m omega),

which is averaging of y'' + y = g2 w^2 / 2 + g3 w^3 / 6: the square has a first integral and adds nothing
(J. Guckenheimer & P. Holmes, Nonlinear Oscillations, 1983, eq. 3.4.11; of friction oscillators H. Hetzler, D. Schwarzer
& W. Seemann, Commun. Nonlinear Sci. Numer. Simul. 12 (2007) 83). As the next peak falls with D, a cycle repels where
D(a) rises, and attracts where it falls. So a law with mu_D''' < 0, such as eq. (13), loses its equilibrium by a
subcritical bifurcation: a repelling cycle parts it from stick-slip, and grows until it grazes the belt at D(1). Where
friction is the same at rest and at vanishing speed that is where the stick-slip cycle, which departs there, ends too.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import brentq

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.law import FrictionLaw
from roughslip.oscillator.return_map import SlipFlow, falling_root, free, growth, slip_flow, turn
from roughslip.oscillator.system import Oscillator

SMALLEST_PEAK = 1e-3
SCANNED = np.geomspace(SMALLEST_PEAK, 1.0, 25)
DIFFERENCE = 0.01  # of the velocity of the belt: step of the second difference of the law's slope


@dataclass(frozen=True)
class PureSlipCycle:
    """A cycle of slip alone.

    peak : [-] largest X' / V, 1 where it grazes the belt
    position : [m] X there
    period : [-] in tau = omega t
    multiplier : [-] by which a turn multiplies a small distance from the cycle; below 1 it attracts
    """

    peak: float
    position: float
    period: float
    multiplier: float


def hopf_damping(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The damping ratio below which steady sliding is unstable: -mu_D'(v0) N / (2 m omega).

    From X'' + (2 D + F omega mu_D'(v0)) X' + X = 0 about the equilibrium; negative where friction rises with speed.
    """
    free(oscillator)
    slope = float(law.slope(oscillator.belt_velocity_m_per_s))
    return -0.5 * oscillator.F * oscillator.natural_frequency_rad_per_s * slope


def lyapunov_coefficient(oscillator: Oscillator, law: FrictionLaw) -> float:
    """g3 / 16, the curvature of the branch at its beginning: D(a) = D_Hopf + (g3 / 16) a^2 + O(a^4).

    Positive where the bifurcation is subcritical. mu_D''' is the second difference of the law's slope over five
    points, which errs by some 1e-7 of it for eq. (13); a table of straight lines has none.
    """
    v0 = oscillator.belt_velocity_m_per_s
    h = DIFFERENCE * v0
    slopes = np.array([float(law.slope(v0 + k * h)) for k in range(-2, 3)])
    third = float(np.dot([-1.0, 16.0, -30.0, 16.0, -1.0], slopes)) / (12.0 * h * h)
    return -oscillator.F * oscillator.natural_frequency_rad_per_s * v0**2 * third / 16.0


def _gain(flow: SlipFlow, peak: float) -> float:
    """The next peak over this one, less one; -1 where the motion comes to rest."""
    return turn(flow, peak).peak / peak - 1.0


def cycle_damping(oscillator: Oscillator, law: FrictionLaw, peak: float, accuracy: float = 1e-10) -> float:
    """D(a): the damping ratio of the cycle without stick whose X' peaks at a V, whatever the oscillator's own.

    peak : [-] a, in SMALLEST_PEAK to 1; at 1 the cycle grazes the belt
    accuracy : [-] of the result, at least 1e-12

    Raises ParameterError for a peak out of range or with excitation, IllPosedError where no damping ratio of zero or
    more has such a cycle, ConvergenceError as `return_map` does.
    """
    if not SMALLEST_PEAK <= peak <= 1.0:
        raise ParameterError(f"the peak of a cycle without stick must lie in {SMALLEST_PEAK} to 1, not {peak}")
    flow = slip_flow(oscillator, law)
    damping = falling_root(
        lambda ratio: _gain(replace(flow, damping_ratio=ratio), peak), hopf_damping(oscillator, law), accuracy
    )
    if damping is None:
        raise IllPosedError(f"no cycle without stick peaks at {peak:.4g} V: its damping ratio would be negative")
    return damping


def pure_slip_cycles(oscillator: Oscillator, law: FrictionLaw) -> list[PureSlipCycle]:
    """The cycles without stick at the oscillator's own damping ratio, from the smallest on; none is an empty list.

    Peaks below SMALLEST_PEAK are left out. Two cycles with peaks closer than a third may hide from the scan: a fold
    of D(a), which laws with one Stribeck dip do not have.
    """
    flow = slip_flow(oscillator, law)
    gains = [_gain(flow, float(peak)) for peak in SCANNED]
    cycles = []
    for left, right, before, after in zip(SCANNED[:-1], SCANNED[1:], gains[:-1], gains[1:], strict=True):
        if (before > 0.0) != (after > 0.0):
            peak = float(brentq(lambda a: _gain(flow, a), left, right, xtol=1e-12, rtol=8.9e-16))
            period, position = turn(flow, peak).duration, flow.position(flow.at_peak(peak))
            cycles.append(PureSlipCycle(peak, position, period, math.exp(growth(flow, peak, period))))
    return cycles


def separating_peak(oscillator: Oscillator, law: FrictionLaw) -> float:
    """The peak of X' / V below which slip stays slip, and above which the mass sticks again.

    Returns the peak of the outermost repelling cycle; 1 where what parts the two is the orbit that just grazes the
    belt; 0 where every motion grows until it sticks. Raises as `return_map` does.
    """
    flow = slip_flow(oscillator, law)
    if _gain(flow, 1.0) <= 0.0:
        return 1.0
    repelling = [cycle.peak for cycle in pure_slip_cycles(oscillator, law) if cycle.multiplier > 1.0]
    return max(repelling, default=0.0)
