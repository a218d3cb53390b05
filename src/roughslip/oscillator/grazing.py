"""First-order effect of noise on the end of stick-slip: the shift of the peak of the slip orbit that grazes the belt.

Friction mu_D + mu_S(s) adds (F / V) mu_S(s) to the slip flow of `oscillator.limits`, s being the slipped distance.
Friction mu_D (1 + mu_S(s)) adds as much times mu_D at the speed of the orbit there. So, to first order, the damping
ratio at which a loop just reaches the belt again is normal about the existence limit. Its standard deviation is
proportional to that of mu_S. This scatter sets the width of the band of damping in which stick-slip survives or ends by
chance. A loop that misses the belt may still reach it at its next peak.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts when they are used

from roughslip.oscillator.base_law import FrictionLaw
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.limits import existence_limit
from roughslip.oscillator.slip_flow import TOLERANCE, next_peak, slip_flow
from roughslip.validation import gate, positive

SAMPLES = 2001  # of the kernel over a loop, 0.003 apart: the trapezoidal rule errs by some 1e-5 of it


@dataclass(frozen=True)
class GrazingResponse:
    """How noise and damping move the peak of the grazing orbit.

    limit : [-] damping ratio of the orbit, the existence limit
    slipped : (samples,) [m] slipped distance since departure, at equal times
    kernel : (samples,) [-] weight of mu_S there in the peak of X' / V: the sum over the samples is the integral
    damping : [-] change of the peak with the damping ratio, negative
    """

    limit: float
    slipped: np.ndarray
    kernel: np.ndarray
    damping: float

    @gate
    def scatter(self, correlation: float | Callable[[np.ndarray], np.ndarray]) -> float:
        """Standard deviation of the damping ratio at which a loop just grazes, for mu_S of unit variance.

        correlation : [m] length L of the autocorrelation exp(-s / L) of mu_S; or that of any lags [m], as
            `FrictionProcess.autocorrelation`
        """
        lag = np.abs(self.slipped[:, None] - self.slipped[None, :])
        of_lags = (
            correlation(lag) if callable(correlation) else np.exp(-lag / positive("correlation", correlation, "m"))
        )
        variance = float(np.einsum("i,ij,j->", self.kernel, of_lags, self.kernel))
        return math.sqrt(max(variance, 0.0)) / abs(self.damping)


@gate
def grazing_response(
    oscillator: Oscillator, law: FrictionLaw, stochastic_static_limit: bool = True, scatter: str = "additive"
) -> GrazingResponse:
    """The response of the orbit at the existence limit, independent of the oscillator's own damping ratio.

    stochastic_static_limit : whether the limit of stick, and so the departure point, moves with mu_S
    scatter : as of `MotionOptions`

    Raises as `existence_limit` does.

    Method: along the orbit from departure to the next peak at the belt, that peak moves by

        dw = (F / V) (psi_y(0) mu_S(0) + integral of psi_w(tau) mu_S(s(tau)) d tau),
        dw / dD = -2 (psi_y(0) + integral of psi_w w d tau),

    psi being the adjoint solution that ends as (0, 1) at the peak: the last row of the propagator from each sample to
    the peak, by variational equations. The first part is the departure point, which moves with the static limit. A
    constant mu_S that is added only moves the motion along X, so that the two parts cancel; one that multiplies changes
    the force. Where friction does not jump at the start of slip, as in eq. (13), the first part is zero: an earlier
    departure is on the same orbit.
    """
    limit = existence_limit(oscillator, law)
    flow = slip_flow(replace(oscillator, damping_ratio=limit), law)
    scale = oscillator.F / oscillator.V
    departure = scale * law.static - flow.steady / oscillator.V - 2.0 * limit
    _, duration = next_peak(flow, departure, 1.0)

    def velocity(_: float, state: np.ndarray) -> list[float]:
        y, w, yy, wy, yw, ww = state
        rate = flow.slope(float(w)) - 2.0 * limit
        return [w, flow.at_peak(float(w)) - y, wy, rate * wy - yy, ww, rate * ww - yw]

    times = np.linspace(0.0, duration, SAMPLES)
    start = [departure, 1.0, 1.0, 0.0, 0.0, 1.0]
    orbit = scipy.integrate.solve_ivp(
        velocity, (0.0, duration), start, "DOP853", times, rtol=TOLERANCE, atol=0.1 * TOLERANCE
    ).y
    y, w = orbit[:2]
    propagator = np.array([[orbit[2], orbit[4]], [orbit[3], orbit[5]]]).transpose(2, 0, 1)  # from 0 to each sample
    adjoint = np.linalg.solve(propagator.transpose(0, 2, 1), propagator[-1, 1][:, None])[..., 0]
    weight = np.full(SAMPLES, duration / (SAMPLES - 1))
    weight[[0, -1]] *= 0.5
    multiplies = scatter == "multiplicative"
    kernel = scale * weight * adjoint[:, 1]
    if multiplies:
        kernel *= law.mu(oscillator.belt_velocity_m_per_s * (1.0 - w))
    if stochastic_static_limit:
        kernel[0] += scale * adjoint[0, 0] * (law.static if multiplies else 1.0)
    return GrazingResponse(
        limit=limit,
        slipped=oscillator.V * (times - (y - departure)),
        kernel=kernel,
        damping=-2.0 * float(adjoint[0, 0] + np.sum(weight * adjoint[:, 1] * w)),
    )
