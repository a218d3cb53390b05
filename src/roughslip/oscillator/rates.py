"""How long stick-slip and steady sliding last, by masses that move freely.

The rates follow from the equation of motion itself, whatever the scatter: added or multiplied, of any marginal and
correlation. Masses move on and on (`totals_of`), each on a path of its own. With the states of `states` and sums over
all masses,

    mean stick-slip = time in stick-slip / its ends,    mean sliding = time in sliding / its ends,
    birth = beginnings of stick-slip / time in sliding,    share = birth / (birth + 1 / mean stick-slip).

A path has nodes as those of runs. Its normal scores z follow from the LAGS ones before, z = w . z_before + e. Weights w
solve the Yule-Walker equations R w = r, R and r being correlations of the scores. That is exact for a normal
marginal and exp(-s / L), where one score before is enough. Other correlations are right up to LAGS nodes, 3 L.

Scaling: the mean of n durations d has the relative variance sum(d^2) / (sum d)^2 - 1 / n. That is 1 / n where one rate
holds at all ages. It is more where sliding that has just begun ends sooner than old sliding. Masses take WORK steps in
all, and LONG ones where these show ends of both states, but too few. A loop of slip takes STEPS_PER_LOOP at least, and
one a node. So long states, and short lengths, have few ends.

Limits: a mean is given with FEWEST_ENDS at least, a relative error up to ERROR, and up to 1 / TIMES of the time of a
mass. So means beyond some 3e4 natural periods are unknown. Unknown are also those of a mass that overtakes the belt,
where friction has the other sign.

Of 24 machines 21 have both means, and there the 95 % interval of runs meets 2/3 to 3/2 of theory. Scatter is of both
kinds, nearly normal and Beta, with lengths of 0.1 to 30 loops. D goes from the Hopf damping to beyond existence. The
method was set with some of them in view. On 57 others, with three seeds, all 255 means hold, up to 4e3 natural periods
of sliding and 1e4 of stick-slip.

Source: G. U. Yule, Phil. Trans. R. Soc. A 226 (1927) 267, for the path.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.oscillator.attractors import State, attractors_of
from roughslip.oscillator.equation import coefficients
from roughslip.oscillator.free_masses import ENDS, SLIPS, Scatter, totals_of
from roughslip.oscillator.grazing import grazing_response
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.states import Durations, longest_slip
from roughslip.validation import gate

TURN = 2.0 * math.pi
WORK, LONG, MASSES = 3_000_000, 40_000_000, 4  # steps of slip in all; where these show too little
STEPS_PER_LOOP, STIFFEST = 40, 0.5  # of slip; of a step times the rate of friction
LAGS, NUGGET = 12, 1e-12  # scores that decide the next one; variance that makes their covariance definite
FEWEST_ENDS, TIMES, ERROR = 30, 3.0, 0.25  # of a mean that is given; time of a mass over it; its relative error
FEW_CROSS = 0.01  # passages of the belt under friction of the other sign, over changes of state
FAR = 12.0  # standard deviations of the existence limit, beyond which a loop neither fails nor sticks by chance
LONG_MEMORY = 0.5  # correlation length over a loop of slip, above which loops are not by themselves


def scores_of(machine: Machine, count: int, generator: np.random.Generator) -> tuple[np.ndarray, Scatter]:
    """(count, LAGS) stationary scores, and what makes friction paths of them."""
    paths, table = machine.paths, machine.paths.translation
    wanted = machine.scattering.autocorrelation(np.arange(LAGS + 1) * paths.spacing)
    of_scores = table.gaussian_correlation(wanted)
    weights = scipy.linalg.solve_toeplitz(of_scores[:-1], of_scores[1:])
    noise = math.sqrt(max(1.0 - float(weights @ of_scores[1:]), 0.0))
    per_score = (table.normal.size - 1) / float(table.normal[-1] - table.normal[0])
    start = np.linalg.cholesky(scipy.linalg.toeplitz(of_scores[:-1]) + NUGGET * np.eye(LAGS))
    scatter = Scatter(paths.spacing, weights, noise, float(table.normal[0]), per_score, table.values)
    return generator.standard_normal((count, LAGS)) @ start.T, scatter


def longest_step(machine: Machine) -> float:
    """tau of a step that follows slip at all speeds up to three times the belt's."""
    oscillator, speeds = machine.oscillator, machine.oscillator.belt_velocity_m_per_s * np.linspace(0.0, 3.0, 61)
    steepest = float(np.max(np.abs(machine.law.slope(speeds))))
    rate = 2.0 * oscillator.damping_ratio + oscillator.F * oscillator.natural_frequency_rad_per_s * steepest
    return min(TURN / STEPS_PER_LOOP, STIFFEST / max(rate, STIFFEST))


def of_free_masses(machine: Machine, seed: Sequence[int], work: int = WORK) -> np.ndarray:
    """(9,) totals of MASSES that take so many steps in all."""
    generator = np.random.default_rng(seed)
    scores, scatter = scores_of(machine, MASSES, generator)
    p = coefficients(machine.oscillator, machine.law, machine.options.scatter)
    longest = longest_step(machine), TURN * longest_slip(machine.oscillator, machine.law)
    return np.asarray(totals_of(scores, scatter, p, longest, work // MASSES, generator))


def durations_of(totals: np.ndarray) -> Durations:
    """The means of totals, as far as they are given."""
    spell, slid, ends, slips, births, crossed, time, spell_squares, slid_squares = map(float, totals)
    stuck, slides, birth = math.nan, math.nan, math.nan
    if crossed <= FEW_CROSS * (slips + births):
        if _is_known(spell, spell_squares, ends, time):
            stuck = spell / ends / TURN
        if births >= FEWEST_ENDS and _is_known(slid, slid_squares, slips, time):
            slides, birth = slid / slips / TURN, births / slid * TURN
    return _exactly(stuck, slides, birth, birth / (birth + 1.0 / stuck))


def _is_known(total: float, squares: float, ends: float, time: float) -> bool:
    """Whether there are enough ends, masses move much longer than a state lasts, and few long ones do not decide."""
    if ends < FEWEST_ENDS or TIMES * MASSES * total > time * ends:
        return False
    return squares / total**2 - 1.0 / ends <= ERROR**2


def _exactly(*values: float) -> Durations:
    return Durations(*(np.full(3, value) for value in values))


@gate
def durations_by_theory(machine: Machine, seed: Sequence[int] = (0,)) -> Durations:
    """How long both states last by free masses; NaN is unknown.

    seed : numbers, of the masses

    Where memory is short, further than FAR standard deviations from the existence limit no mass has to move: either
    state lasts for ever. Raises IllPosedError where the mass may vibrate without sticking (`attractors_of`), as
    sliding is two states there.
    """
    unknown = _exactly(*[math.nan] * 4)
    try:
        found = attractors_of(machine.oscillator, machine.law)
    except (ConvergenceError, ParameterError):
        return unknown
    if State.VIBRATION in (found.from_rest.state, found.from_sliding.state):
        raise IllPosedError(
            "slip without sticking is steady or vibrates here, and rates by theory are of two states: take those of "
            "runs, or change the damping",
            scene_keys="oscillator.damping_ratio",
        )
    try:
        friction, grazing = machine.scattering, grazing_response(machine)
        scatter = friction.path_deviation * grazing.scatter(friction.autocorrelation)
        apart = grazing.limit - machine.oscillator.damping_ratio
        is_short = friction.correlation_length_m <= LONG_MEMORY * TURN * machine.oscillator.V
        if is_short and abs(apart) > FAR * scatter:
            return _exactly(*((math.inf, *[math.nan] * 3) if apart > 0.0 else (math.nan, math.inf, 0.0, 0.0)))
        durations = durations_of(totals := of_free_masses(machine, seed))
        if math.isnan(durations.share[0]) and min(totals[ENDS], totals[SLIPS]) > 0.0:
            return durations_of(of_free_masses(machine, seed, LONG))
        return durations
    except (ConvergenceError, IllPosedError, ParameterError):
        return unknown
