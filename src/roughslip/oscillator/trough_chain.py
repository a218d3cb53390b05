"""How long stick-slip and steady sliding last near the limit of existence, by the chain of the troughs of slip.

Between sticks slip is a sequence of loops (`slip_orbit`). Let u be the depth of a trough of X' / V, M(u) the next one
without scatter, and U the trough after a departure. From u* on the next peak reaches the belt, and the mass sticks.
Friction of unit variance moves a depth by s(u), to first order: the response along the loop (`grazing`), taken at
the trough, where friction changes least with speed. The loop after a departure has the response of the grazing orbit,
made a depth by (U - u*) / (D* - D). For one that misses the belt comes slowly to it, and friction acts there for long.
So the depths are a Markov chain,

    u' = |M(u) + sigma s(u) (xi_1 + i xi_2)|,    xi standard normal,

with the density of S. O. Rice (Bell Syst. Tech. J. 24 (1945) 46). The second component is the phase, which matters
about steady sliding alone. Where two loops meet, slip is slow, and both see the friction g there: rho being the
correlation of their scatters, xi_1 = sqrt(rho) (g + g') + sqrt(1 - 2 rho) xi. Let A, Q, R be the transitions from a
departure to troughs below u*, between these, and from these to the belt. After LOOPS loops slip is steady sliding, so

    f = A Q^(LOOPS - 1) 1                         chance that a slip of stick-slip fails, given the friction g,
    mean stick-slip = time of the slips that stick in LOOPS loops, with their sticks, over the times it begins,
    mean sliding = LOOPS t + A Q^(LOOPS - 1) (1 - Q)^-1 t / f,    t the duration of a loop,
    birth = beginnings of stick-slip over the time of sliding.

Limits: for Gaussian friction and small sigma both logarithms grow as 1 / sigma^2 (M. I. Freidlin & A. D. Wentzell,
Random Perturbations of Dynamical Systems, 1984, ch. 6).

Slip that friction has quickened meets the friction ahead sooner, so that the mean force about a path of mu_S is not 0.
To second order the mean of -V mu_S' times the displacement by mu_S itself is, at the relative speed V (1 - w),

    (F sigma)^2 / (V L) / (1 + (V (1 - w) / L)^2),

L being the correlation length. It acts against damping, and is part of the map but for the loop after a departure,
where nothing has displaced the mass yet. Skewness of friction and correlation over more than two loops are left out.
On the study's belt with nearly Gaussian friction the mean sliding agrees with long runs within a tenth where it is
short, and within a factor of two where it is hundreds of natural periods. The mean stick-slip agrees with them within a
factor of 1.5, and with splitting within one of 3 from 1e4 to 1e6 natural periods.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.grazing import GrazingResponse, grazing_response, orbit_response
from roughslip.oscillator.limits import slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.slip_orbit import SlipFlow, slip_flow, turn
from roughslip.oscillator.states import LOOPS, Durations
from roughslip.validation import gate

KNOTS = 10  # depths at which the map is computed
PER_LENGTH, FEWEST_SAMPLES, MOST_SAMPLES = 3.0, 401, 2001  # samples of a loop, by correlation lengths
PER_DEVIATION, FEWEST_NODES, MOST_NODES = 4, 60, 200  # nodes of the chain: as many in the least scatter
JUNCTIONS = 5  # values of the friction where loops meet
TAIL, WIDEST = 8.0, 8.0  # standard deviations that the chain reaches beyond its means, and depths u* at most
NEGLIGIBLE = 1e-90  # probability of a transition
APART = 0.01  # relative distance from the existence limit at which depths are compared with damping ratios
FAR = 12.0  # standard deviations of the existence limit, beyond which a loop neither fails nor sticks by chance
LONGEST = 1e12  # natural periods, beyond which rounding hides the rate
LEAST_DEPTH, DEEPEST = 1e-3, 30.0  # of the search for u*, in units of the trough after a departure
ACCURACY = 1e-9  # relative, of a step of slip


@dataclass(frozen=True)
class TroughMap:
    """The map of the troughs of slip without scatter, and its scatter by friction.

    Loops begin with the departure, then with the troughs `start`.

    belt : [-] u*, depth of the trough whose next peak only reaches the belt; 0 where slip reaches it from any trough
    start : (knots,) [-] depths u, up to u*
    following : (1 + knots,) [-] U, then M(u)
    deviation : (1 + knots,) [-] sigma s
    correlation : (1 + knots,) [-] rho of the scatter of a loop and of an equal one after it
    duration : (1 + knots,) [natural periods] of the loops
    stick : [natural periods] that the cycle without scatter sticks
    """

    belt: float
    start: np.ndarray
    following: np.ndarray
    deviation: np.ndarray
    correlation: np.ndarray
    duration: np.ndarray
    stick: float


def _turn(flow: SlipFlow, y: float, w: float) -> tuple[float, float]:
    """The next extreme of w, as `turn` has it up to the belt, and the time until then [tau]."""
    _, extreme, time = turn(flow, y, w, ACCURACY, to_belt=True)
    if extreme == 0.0:
        raise IllPosedError(
            f"slip at the damping ratio {flow.damping_ratio:.4g} does not swing: lower the damping",
            scene_keys="oscillator.damping_ratio",
        )
    return extreme, time


def _drifting(flow: SlipFlow, machine: Machine) -> SlipFlow:
    """The flow with the mean force of friction met sooner."""
    oscillator, friction = machine.oscillator, machine.scattering
    gain = float(machine.law.mu(oscillator.belt_velocity_m_per_s)) if friction.multiplies else 1.0
    ratio = oscillator.V / friction.correlation_length_m
    most = (oscillator.F * (gain * friction.path_deviation) / oscillator.V) ** 2 * ratio
    return flow._replace(drift=most, drift_ratio=ratio)


def _after(flow: SlipFlow, depth: float) -> tuple[float, float]:
    """The peak after a trough, and the time until then."""
    return _turn(flow, flow.at_peak(-depth), -depth)


def _reaching(flow: SlipFlow, first: float) -> float:
    """u*, the trough whose next peak only reaches the belt; 0 where any does. first : a trough to begin the search"""
    deepest, least = first, LEAST_DEPTH * first
    if _after(flow, least)[0] >= 1.0:
        return 0.0
    while _after(flow, deepest)[0] <= 1.0:
        deepest *= 1.5
        if deepest > DEEPEST * first:
            raise IllPosedError(
                "slip reaches the belt from no trough: lower the damping", scene_keys="oscillator.damping_ratio"
            )
    return float(scipy.optimize.brentq(lambda depth: _after(flow, depth)[0] - 1.0, least, deepest, rtol=1e-8))


def _grazing(machine: Machine) -> GrazingResponse:
    """The response of the grazing orbit, its kernel in depths of the trough after a departure.

    At the limit D* that trough is u*, and U - u* over D* - D makes depths of damping ratios.
    """
    response, ratio = grazing_response(machine), machine.oscillator.damping_ratio
    if abs(ratio - response.limit) < APART * response.limit:
        ratio = (1.0 - APART) * response.limit
    damped = replace(machine.oscillator, damping_ratio=ratio)
    flow = slip_flow(damped, machine.law)
    depth = -_turn(flow, flow.departure, 1.0)[0]
    scale = (depth - _reaching(flow, depth)) / ((response.limit - ratio) * abs(response.damping))
    return replace(response, kernel=scale * response.kernel)


def trough_map(machine: Machine) -> TroughMap:
    """The map of the troughs at the oscillator's own damping ratio.

    Raises ParameterError with excitation or a belt at rest; IllPosedError where slip does not swing or reaches the belt
    from no trough; both and ConvergenceError as `existence_limit`.
    """
    oscillator, law, friction = machine.oscillator, machine.law, machine.scattering
    length_m = friction.correlation_length_m
    flow, cycle = slip_flow(oscillator, law), slip_loop(oscillator, law).cycle
    start = flow.departure, 1.0
    samples = int(np.clip(PER_LENGTH * 2.0 * math.pi * oscillator.V / length_m, FEWEST_SAMPLES, MOST_SAMPLES))

    def loop(state: tuple[float, float]) -> tuple[float, float, float]:
        """The trough after a state, the times until it and until the next peak."""
        trough, down = _turn(flow, *state)
        return -trough, down, down + _after(flow, -trough)[1]

    def response(state: tuple[float, float]) -> tuple[float, float, GrazingResponse]:
        """The trough after a state, the time of the loop, and its response."""
        trough, down, time = loop(state)
        return trough, time, orbit_response(machine, flow, state, time, 0.0, samples, down)

    first = *loop(start)[::2], _grazing(machine)
    flow = _drifting(flow, machine)
    belt = _reaching(flow, first[0])
    if belt == 0.0:
        none = np.empty(0)
        return TroughMap(0.0, none, none, none, none, none, 0.0)
    depths = belt * (1.0 - np.linspace(1.0, 0.0, KNOTS + 1)[1:] ** 2)  # dense at u*, where M is steep
    peaks = [min(_after(flow, float(depth))[0], 1.0) for depth in depths]
    loops = [first, *(response((flow.at_peak(peak), peak)) for peak in peaks)]
    variance = np.array([loop.covariance(friction.autocorrelation) for _, _, loop in loops])
    beside = np.array([loop.covariance(friction.autocorrelation, float(loop.slipped[-1])) for _, _, loop in loops])
    return TroughMap(
        belt=belt,
        start=depths,
        following=np.array([depth for depth, _, _ in loops]),
        deviation=friction.path_deviation * np.sqrt(np.maximum(variance, 0.0)),
        correlation=np.clip(beside / variance, 0.0, 0.45),
        duration=np.array([time for _, time, _ in loops]) / (2.0 * math.pi),
        stick=0.0 if cycle is None else (cycle.period - cycle.slip_duration) / (2.0 * math.pi),
    )


def _chain(troughs: TroughMap) -> tuple[np.ndarray, np.ndarray]:
    """Transitions (1 + nodes, J, J, nodes + 1) from departure and nodes, by frictions where loops meet, and loop times.

    The last column is the belt; rows of each friction g sum to 1 over g' and columns.
    """
    knots = np.append(0.0, troughs.start)

    def at_nodes(values: np.ndarray, at_rest: float) -> np.ndarray:
        curve = scipy.interpolate.PchipInterpolator(knots, np.append(at_rest, values[1:]))
        return np.append(values[0], curve(depth))

    least = float(np.min(troughs.deviation))
    nodes = int(np.clip(PER_DEVIATION * troughs.belt / least, FEWEST_NODES, MOST_NODES))
    step = troughs.belt / nodes
    depth = (np.arange(nodes) + 0.5) * step
    mean, rho = at_nodes(troughs.following, 0.0), at_nodes(troughs.correlation, 0.0)
    sigma = at_nodes(troughs.deviation, float(troughs.deviation[1]))
    g, weight = np.polynomial.hermite_e.hermegauss(JUNCTIONS)
    weight /= weight.sum()
    own = np.maximum(sigma * np.sqrt(1.0 - 2.0 * rho), 0.5 * step)  # narrower ones fall between the nodes
    shifted = mean[:, None, None] + (sigma * np.sqrt(rho))[:, None, None] * (g[:, None] + g)
    reach = mean + TAIL * sigma
    columns = math.ceil(min(max(float(np.max(reach)) / step, nodes + 1), WIDEST * nodes))
    x = ((np.arange(columns) + 0.5) * step) / own[:, None, None, None]
    centre = np.abs(shifted / own[:, None, None])[..., None]
    density = x * np.exp(-0.5 * (x - centre) ** 2) * scipy.special.ive(0, x * centre)
    total = np.maximum(density.sum(axis=-1, keepdims=True), np.finfo(float).tiny)
    inside, outside = density[..., :nodes], density[..., nodes:].sum(axis=-1, keepdims=True)
    is_wider = (reach > columns * step)[:, None, None, None]  # its integral is known, its sum ends with the columns
    total = np.where(is_wider, np.maximum(total, own[:, None, None, None] / step), total)
    outside = np.where(is_wider, total - inside.sum(axis=-1, keepdims=True), outside)
    transitions = np.concatenate([inside, outside], axis=-1) * (weight[:, None] / total)
    transitions[transitions < NEGLIGIBLE] = 0.0  # else products are subnormal, and take a thousand times as long
    return transitions, at_nodes(troughs.duration, float(troughs.duration[1]))


def durations_of(troughs: TroughMap) -> Durations:
    """How long both states last by the chain of troughs; NaN is unknown."""
    if troughs.belt == 0.0:  # friction that is met sooner drives all slip to the belt: none fails
        return _exactly(math.inf, math.nan, math.nan, math.nan)
    transitions, times = _chain(troughs)
    nodes, j = len(times) - 1, JUNCTIONS
    inner = transitions[1:, ..., :nodes].transpose(1, 0, 2, 3).reshape(j * nodes, j * nodes)
    returns = transitions[1:, ..., nodes].transpose(1, 0, 2).reshape(j * nodes, j)
    reached = transitions[0, ..., :nodes].reshape(j, j * nodes)
    sticks, loop = transitions[0, ..., nodes], np.tile(times[1:], j)
    spent, short = reached * times[0], sticks.sum(axis=1) * (times[0] + troughs.stick)
    for _ in range(int(LOOPS) - 1):
        back = reached @ returns
        spent = spent + reached * loop
        short = short + (spent @ returns).sum(axis=1) + troughs.stick * back.sum(axis=1)
        sticks, reached, spent = sticks + back, reached @ inner, spent @ inner
    fails = reached.sum(axis=1)
    if not np.any(fails > 0.0):
        return _exactly(math.inf, math.nan, math.nan, math.nan)  # sliding may last for ever too
    solved = np.linalg.solve(np.eye(j * nodes) - inner, np.column_stack([loop, returns]))
    until = reached @ solved[:, 0]
    if not 0.0 <= float(until.max()) < LONGEST * float(fails.max()):
        until, again = np.full(j, math.inf), fails[:, None] * np.full(j, 1.0 / j)
    else:
        again = reached @ solved[:, 1:]
    kernel = sticks + again
    share = np.linalg.lstsq(np.vstack([kernel.T - np.eye(j), np.ones(j)]), np.append(np.zeros(j), 1.0), rcond=None)[0]
    beginnings = float(share @ again @ sticks.sum(axis=1))
    if not beginnings > 0.0:  # no slip sticks again
        return _exactly(math.nan, math.inf, 0.0, 0.0)
    stuck, slid = float(share @ short), float(share @ (spent.sum(axis=1) + until))
    failures = float(share @ fails)
    birth = beginnings / slid
    return _exactly(stuck / beginnings, slid / failures, birth, stuck / (stuck + slid))


def _exactly(*values: float) -> Durations:
    return Durations(*(np.full(3, value) for value in values))


@gate
def durations_by_theory(machine: Machine) -> Durations:
    """How long both states last by the chain of troughs; NaN is unknown, as where slip makes no chain.

    Further than FAR standard deviations from the existence limit no chain is needed: either state lasts for ever.
    The chain has no vibration: where an attractor vibrates (`attractors_of`), its durations do not hold.
    """
    try:
        grazing, friction = grazing_response(machine), machine.scattering
        scatter = friction.path_deviation * grazing.scatter(friction.autocorrelation)
        if (apart := (grazing.limit - machine.oscillator.damping_ratio) / scatter) > FAR:
            return _exactly(math.inf, math.nan, math.nan, math.nan)
        if apart < -FAR:
            return _exactly(math.nan, math.inf, 0.0, 0.0)
        return durations_of(trough_map(machine))
    except (ConvergenceError, IllPosedError, ParameterError):
        return _exactly(*[math.nan] * 4)
