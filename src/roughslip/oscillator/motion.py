"""Motion of the mass: stick and slip in turn, their events, and the counts of cycles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit

from roughslip.errors import ConvergenceError, ParameterError
from roughslip.oscillator.fehlberg import State, draw
from roughslip.oscillator.law import StribeckLaw
from roughslip.oscillator.path import offset, piece_at
from roughslip.oscillator.slip import AT_BELT, NO_SLIP, PATH_OVER, SHORTEST_SLIP, STEPS_OVER, TIME_OVER, slip
from roughslip.oscillator.stick import HELD, LOWER, UPPER, departure, static_limit, stick_force
from roughslip.oscillator.system import Coefficients, Oscillator, coefficients

DEPARTURE, REATTACHMENT, CROSSING = 0, 1, 2
STEPS_PER_PERIOD = 20_000  # and four a node of the path: far above any need, so that a run ends
TOLERANCES = (1e-13, 1e-3)


@dataclass(frozen=True)
class Motion:
    """What happened, event by event.

    kind : (events,) DEPARTURE from stick, REATTACHMENT, or CROSSING from one sign of v_rel to the other
    time : (events,) [-] tau = omega t
    position : (events,) [m] X
    slipped_distance : (events,) [m] s
    backwards : (events,) true at a reattachment before which, since the departure, the mass moved against the belt
        (X' < 0): it ends a cycle; a reattachment without that ends a micro-slip
    duration : [-] tau at the end
    total_slip : [m] s at the end
    local_error : [m] sum of the error estimates of all steps, in X and X'
    steps : steps tried
    """

    kind: np.ndarray
    time: np.ndarray
    position: np.ndarray
    slipped_distance: np.ndarray
    backwards: np.ndarray
    duration: float
    total_slip: float
    local_error: float
    steps: int

    @property
    def cycles(self) -> int:
        """Number of reattachments that end a cycle."""
        return int(np.count_nonzero(self.backwards))

    @property
    def micro_slips(self) -> int:
        """Number of reattachments that end a micro-slip."""
        return int(np.count_nonzero(self.kind == REATTACHMENT)) - self.cycles

    def reattachments(self, after_periods: float = 0.0) -> np.ndarray:
        """X [m] at the ends of the cycles later than so many natural periods."""
        return self.position[self.backwards & (self.time >= 2.0 * math.pi * after_periods)]


@dataclass(frozen=True)
class Trajectory:
    """A motion and its samples for drawing.

    motion : the events
    time : (samples,) [-] tau
    position : (samples,) [m] X
    velocity : (samples,) [m] X' = dX/dtau
    """

    motion: Motion
    time: np.ndarray
    position: np.ndarray
    velocity: np.ndarray


@njit(cache=True)
def _record(
    kinds: np.ndarray, rows: np.ndarray, count: int, kind: int, tau: float, x: float, s: float, backwards: bool
) -> tuple[np.ndarray, np.ndarray, int]:
    """Append an event; the arrays double when they are full."""
    if count == kinds.size:
        kinds = np.concatenate((kinds, np.empty_like(kinds)))
        rows = np.concatenate((rows, np.empty_like(rows)))
    kinds[count] = kind
    rows[count, 0], rows[count, 1], rows[count, 2], rows[count, 3] = tau, x, s, backwards
    return kinds, rows, count + 1


@njit(cache=True)
def _side(tau: float, x: float, limit: float, p: Coefficients) -> int:
    """What follows at X' = V: stick where friction balances the force, else slip to the side that the force pulls."""
    force = stick_force(tau, x, p)
    if abs(force) <= limit:
        return HELD
    return UPPER if force > 0.0 else LOWER


@njit(cache=True)
def _run(
    x: float, tau_end: float, nodes: np.ndarray, spacing: float, p: Coefficients, tolerance: float, stochastic: bool,
    step_limit: int, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> tuple[int, np.ndarray, np.ndarray, float, float, float, int]:  # fmt: skip
    """Stick and slip in turn from X' = V: status, kinds, rows (tau, X, s, backwards), tau, s, local error, steps."""
    kinds, rows, count = np.empty(64, np.int64), np.empty((64, 4)), 0
    status, steps, error, backwards = TIME_OVER, 0, 0.0, False
    tau, s = 0.0, 0.0
    limit = static_limit(offset(piece_at(nodes, spacing, s), s), stochastic, p)
    sigma = _side(tau, x, limit, p)
    if sigma != HELD:
        kinds, rows, count = _record(kinds, rows, count, DEPARTURE, tau, x, s, False)
    while tau_end - tau > SHORTEST_SLIP:
        if sigma == HELD:
            held = State(tau, x, p.V, s, 0.0)
            sigma, tau, x = departure(tau, x, limit, tau_end, p)
            if x_drawn.size > 0 and tau > held.tau:
                draw(held, State(tau, x, p.V, s, 0.0), interval, x_drawn, u_drawn)
            if sigma == HELD:
                break
            kinds, rows, count = _record(kinds, rows, count, DEPARTURE, tau, x, s, False)
            backwards = False
            continue
        phase = slip(
            State(tau, x, p.V, s, 0.0), float(sigma), tau_end, nodes, spacing, p, tolerance, step_limit - steps,
            interval, x_drawn, u_drawn,
        )  # fmt: skip
        tau, x, s = phase.y.tau, phase.y.x, phase.y.s
        steps += phase.steps
        error += phase.error
        backwards = backwards or phase.backwards
        if phase.status != AT_BELT and phase.status != NO_SLIP:
            status = phase.status
            break
        limit = static_limit(offset(piece_at(nodes, spacing, s), s), stochastic, p)
        side = HELD if phase.status == NO_SLIP else _side(tau, x, limit, p)
        if side == HELD:
            kinds, rows, count = _record(kinds, rows, count, REATTACHMENT, tau, x, s, backwards)
        elif side != sigma:
            kinds, rows, count = _record(kinds, rows, count, CROSSING, tau, x, s, False)
        sigma = side
    return status, kinds[:count], rows[:count], tau, s, error, steps


def _check(path: np.ndarray | None, spacing_m: float, periods: float, tolerance: float, start_m: float) -> np.ndarray:
    """The nodes of the path as the compiled functions read them (none for a deterministic law)."""
    nodes = np.zeros(0) if path is None else np.ascontiguousarray(path, dtype=np.float64)
    if nodes.ndim != 1 or nodes.size == 1 or not np.isfinite(nodes).all():
        raise ParameterError("a friction path is one row of at least two finite nodes, or None")
    if nodes.size and not (math.isfinite(spacing_m) and spacing_m > 0.0):
        raise ParameterError(f"the spacing of the path must be finite and positive, not {spacing_m} m")
    if not (math.isfinite(periods) and periods > 0.0):
        raise ParameterError(f"the duration must be finite and positive, not {periods} natural periods")
    if not TOLERANCES[0] <= tolerance <= TOLERANCES[1]:
        raise ParameterError(f"the tolerance must lie in {TOLERANCES[0]} to {TOLERANCES[1]}, not {tolerance}")
    if not math.isfinite(start_m):
        raise ParameterError(f"the start position must be finite, not {start_m} m")
    return nodes


def _simulate(
    oscillator: Oscillator, law: StribeckLaw, path: np.ndarray | None, spacing_m: float, periods: float,
    tolerance: float, start_m: float, stochastic: bool, interval: float, x_drawn: np.ndarray, u_drawn: np.ndarray,
) -> Motion:  # fmt: skip
    nodes = _check(path, spacing_m, periods, tolerance, start_m)
    spacing = float(spacing_m) if nodes.size else 1.0
    step_limit = math.ceil(STEPS_PER_PERIOD * (1.0 + periods)) + 4 * nodes.size
    status, kinds, rows, tau, s, error, steps = _run(
        float(start_m), 2.0 * math.pi * periods, nodes, spacing, coefficients(oscillator, law), float(tolerance),
        bool(stochastic), step_limit, interval, x_drawn, u_drawn,
    )  # fmt: skip
    reached = tau / (2.0 * math.pi)
    if status == PATH_OVER:
        need = s * periods / reached if reached > 0.0 else math.inf
        raise ParameterError(
            f"the friction path of {(nodes.size - 1) * spacing:.4g} m ends after {reached:.4g} of {periods:.4g} "
            f"natural periods; give a longer one, about {1.1 * need:.3g} m"
        )
    if status == STEPS_OVER:
        raise ConvergenceError(
            f"the motion reached {reached:.4g} of {periods:.4g} natural periods within the step limit; try a larger "
            f"tolerance or a coarser path; local errors in m",
            residual=error,
            work=steps,
        )
    return Motion(
        kind=kinds,
        time=rows[:, 0].copy(),
        position=rows[:, 1].copy(),
        slipped_distance=rows[:, 2].copy(),
        backwards=rows[:, 3] > 0.0,
        duration=2.0 * math.pi * periods,
        total_slip=s,
        local_error=error,
        steps=steps,
    )


def simulate(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: np.ndarray | None,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
) -> Motion:
    """The motion from X' = V at the start position: stick and departure exact, slip by Runge-Kutta-Fehlberg 4(5).

    oscillator, law : the system and its mean friction mu_D
    path : (nodes,) [-] stochastic part mu_S at the slipped distances 0, spacing, 2 spacing, ...; None for mu_S = 0
    spacing_m : [m] distance of the nodes (not used without a path)
    duration_periods : [-] time in natural periods 2 pi / omega
    tolerance : [-] local error of a step in X and in X', relative to N / c + max(|X|, |X'|); 1e-13 to 1e-3
    start_position_m : [m] X at tau = 0, where the mass sticks if friction holds it
    stochastic_static_limit : the limit of stick is static + mu_S(s); if False static alone, raised to static + mu_S(s)
        where that is larger, because stick cannot give way to a slip friction that holds

    Between nodes mu_S is a C1 cubic (Catmull-Rom); it stands still in stick, as s does. Friction below zero is cut.

    Returns the events with the local error. Raises ParameterError for input out of range and when the mass runs off
    the end of the path, ConvergenceError at the step limit.

    Method: E. Fehlberg, NASA TR R-315 (1969); events by Newton's method on re-taken steps.
    """
    none = np.zeros(0)
    return _simulate(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        1.0, none, none,
    )  # fmt: skip


def trajectory(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: np.ndarray | None,
    spacing_m: float,
    duration_periods: float,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
    samples_per_period: int = 400,
) -> Trajectory:
    """The same motion as `simulate`, with X and X' at equal times from tau = 0 up to the duration, which is left out.

    Stick lines are exact, slip is cubic between the integrator's steps. Arguments and errors as in `simulate`.
    """
    if samples_per_period < 1:
        raise ParameterError(f"a trajectory needs at least one sample a period, not {samples_per_period}")
    _check(path, spacing_m, duration_periods, tolerance, start_position_m)
    interval = 2.0 * math.pi / samples_per_period
    samples = max(math.ceil(duration_periods * samples_per_period - 1e-9), 1)
    x_drawn, u_drawn = np.full(samples, np.nan), np.full(samples, np.nan)
    x_drawn[0], u_drawn[0] = start_position_m, oscillator.V
    motion = _simulate(
        oscillator, law, path, spacing_m, duration_periods, tolerance, start_position_m, stochastic_static_limit,
        interval, x_drawn, u_drawn,
    )  # fmt: skip
    return Trajectory(motion, interval * np.arange(samples), x_drawn, u_drawn)


@dataclass(frozen=True)
class Counts:
    """Cycles and micro-slips of one friction path at several damping ratios.

    damping_ratios : (dampings,) [-]
    cycles, micro_slips : (dampings,)
    """

    damping_ratios: np.ndarray
    cycles: np.ndarray
    micro_slips: np.ndarray


def ensemble_counts(
    oscillator: Oscillator,
    law: StribeckLaw,
    path: np.ndarray | None,
    spacing_m: float,
    duration_periods: float,
    damping_ratios: Sequence[float] | np.ndarray,
    tolerance: float = 1e-9,
    start_position_m: float = 0.0,
    stochastic_static_limit: bool = True,
) -> Counts:
    """Counts of one realisation of the friction at each damping ratio in place of the oscillator's own.

    damping_ratios : (dampings,) [-] each >= 0; the other arguments and the errors as in `simulate`
    """
    ratios = np.atleast_1d(np.asarray(damping_ratios, dtype=np.float64))
    motions = [
        simulate(
            replace(oscillator, damping_ratio=float(ratio)), law, path, spacing_m, duration_periods, tolerance,
            start_position_m, stochastic_static_limit,
        )
        for ratio in ratios
    ]  # fmt: skip
    return Counts(ratios, np.array([m.cycles for m in motions]), np.array([m.micro_slips for m in motions]))
