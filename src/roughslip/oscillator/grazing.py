"""First-order effect of noise on the end of stick-slip: the shift of the peak of the slip orbit that grazes the belt.

Friction mu_D + mu_S(s) adds (F / V) mu_S(s) to the slip flow of `slip_orbit`, s being the slipped distance.
Friction mu_D (1 + mu_S(s)) adds as much times mu_D at the speed of the orbit there. So, to first order, the damping
ratio at which a loop just reaches the belt again is normal about the existence limit. Its standard deviation is
proportional to that of mu_S. This scatter sets the width of the band of damping in which stick-slip goes on or ends by
chance. A loop that misses the belt may still reach it at its next peak.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import IllPosedError
from roughslip.oscillator.limits import existence_limit
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.slip_orbit import TOLERANCE, SlipFlow, next_step, rk_step, slip_flow, too_stiff, turn
from roughslip.results import described, result
from roughslip.validation import gate, positive

SAMPLES = 2001  # of the kernel over a loop, 0.003 apart: the trapezoidal rule errs by some 1e-5 of it


@result
class GrazingResponse:
    """How noise and damping move the peak of the grazing orbit."""

    limit: float = described("damping ratio of the orbit, the existence limit")
    slipped: np.ndarray = described("slipped distance since departure, at equal times", "m", "samples")
    kernel: np.ndarray = described(
        "weight of mu_S there in the peak of X' / V: the sum over the samples is the integral", "1", "samples"
    )
    damping: float = described("change of the peak with the damping ratio, negative")

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
def grazing_response(machine: Machine) -> GrazingResponse:
    """The response of the orbit at the existence limit, independent of the oscillator's own damping ratio.

    Raises as `existence_limit` does, and IllPosedError with a memory of the contact.

    Method: along the orbit from departure to the next peak at the belt, that peak moves by

        dw = (F / V) (psi_y(0) mu_S(0) + integral of psi_w(tau) mu_S(s(tau)) d tau),
        dw / dD = -2 (psi_y(0) + integral of psi_w w d tau),

    psi being the adjoint solution that ends as (0, 1) at the peak: the last row of the propagator from each sample to
    the peak, by variational equations. The first part is the departure point, which moves with the static limit. A
    constant mu_S that is added only moves the motion along X, so that the two parts cancel; one that multiplies changes
    the force. Where friction does not jump at the start of slip, as in eq. (13), the first part is zero: an earlier
    departure is on the same orbit.
    """
    if isinstance(machine.law, MemoryLaw):
        raise IllPosedError("with a memory of the contact runs alone show what scatter does to the limit")
    free = replace(machine, oscillator=replace(machine.oscillator, damping_ratio=0.0), friction=None)
    return _of_limit(free)


@lru_cache(maxsize=64)
def _of_limit(machine: Machine) -> GrazingResponse:
    """The same, of machines that differ in damping or scatter once."""
    oscillator, law = machine.oscillator, machine.law
    limit = existence_limit(oscillator, law)
    flow = slip_flow(replace(oscillator, damping_ratio=limit), law)
    trough, w, down = turn(flow, flow.departure, 1.0)
    _, _, up = turn(flow, trough, w)
    start, duration = (flow.departure, 1.0), down + up
    scale, multiplies = oscillator.F / oscillator.V, machine.options.scatter == "multiplicative"
    orbit, adjoint, steps = _orbit(start, flow, duration, SAMPLES)
    if steps < 0:
        raise too_stiff(flow, float(np.hypot(*orbit[-1])), -steps)
    y, w = orbit.T
    weight = np.full(SAMPLES, duration / (SAMPLES - 1))  # of the trapezoidal rule
    weight[[0, -1]] *= 0.5
    kernel = scale * weight * adjoint[:, 1]
    if multiplies:
        kernel *= law.mu(oscillator.belt_velocity_m_per_s * (1.0 - w))
    if law.static > 0.0:
        kernel[0] += scale * adjoint[0, 0] * (law.static if multiplies else 1.0)
    return GrazingResponse(
        limit=limit,
        slipped=oscillator.V * (np.linspace(0.0, duration, SAMPLES) - (y - start[0])),
        kernel=kernel,
        damping=-2.0 * float(adjoint[0, 0] + np.sum(weight * adjoint[:, 1] * w)),
    )


@compiled(error_model="numpy")
def _orbit(
    start: tuple[float, float], flow: SlipFlow, duration: float, samples: int
) -> tuple[np.ndarray, np.ndarray, int]:
    """Orbit (samples, 2) y and w at equal times, its adjoint (samples, 2), and the steps, below 0 where too stiff.

    The adjoint ends as (0, 1): what a change of the state at each sample does to w at the end. It goes backwards by the
    transposed propagator of each interval, so that nothing is inverted where slip contracts.
    """
    rows, interval, k = np.zeros((samples, 6)), duration / (samples - 1), np.zeros((6, 6))
    z = rows[0].copy()
    z[0], z[1] = start
    rows[0], end, h, steps, adjoint = z, z.copy(), interval, 0, np.zeros((samples, 2))
    for sample in range(1, samples):
        z[2], z[3], z[4], z[5] = 1.0, 0.0, 0.0, 1.0
        left = interval
        while left > 0.0:
            tried, steps = min(h, left), steps + 1
            error = rk_step(z, tried, flow, k, end) / (TOLERANCE * max(1.0, abs(end[0]), abs(end[1])))
            if error <= 1.0:
                z[:] = end
                left = left - tried if tried < left else 0.0
            elif tried < 1e-12 * interval:
                rows[-1] = z
                return rows[:, :2], adjoint, -steps
            h = next_step(tried, error)
        rows[sample] = z
    adjoint[-1, 1] = 1.0
    for sample in range(samples - 1, 0, -1):
        of_y, of_w = adjoint[sample]
        adjoint[sample - 1, 0] = rows[sample, 2] * of_y + rows[sample, 3] * of_w
        adjoint[sample - 1, 1] = rows[sample, 4] * of_y + rows[sample, 5] * of_w
    return rows[:, :2], adjoint, steps
