"""The statements of the paper in its order, then our own: a row each, with its readings and their rules.

To judge another statement, add a row. Its judge is a function of stored results, or `within` for a single number.
"""

from __future__ import annotations

from functools import partial
from typing import Any

from roughslip.friction.correlation import LINE_WINDOWS
from roughslip.friction.marginal import SET_WINDOWS
from roughslip.verdicts import friction_rules as friction
from roughslip.verdicts import motion_rules as motion
from roughslip.verdicts import pressure_rules as pressure
from roughslip.verdicts.found import VISIBLE, Arrays, within
from roughslip.verdicts.friction_rules import MEDIAN
from roughslip.verdicts.reading import DECADES, MICROMETRES, SHARE, Reading, Statement

DEFINED = "section 3.2: p_x is “the pressure when contact occurs”, and the probability of contact stands apart"
CAPTION = "caption of Figure 2: “cumulative distribution function for the contact pressure”"
GAUSSIAN = "eqs. (8) and (9): the polynomials are functions of ξ, and section 2 has ξ standard Gaussian"
LATIN = "section 3.3: “matches well with the results obtained from Latin Hypercube Sampling”"
TRAP = "a trap: eqs. (8) and (9) stand for the pressure when contact occurs, and most draws have none"
NINE = "eq. (9) takes the place of eq. (8)"
FALL = "section 4: mean, standard deviation and coefficient of variation “decrease with increasing penetration depth”"
WEIGHTS = "section 4: “A_c and the normal force N are obtained by averaging the pressure field”, with no weights"
FOUND = "section 4: μ “was found to be exponentially correlated with correlation length 250 µm”; no fit is named"
SHAPE = "section 4: the distribution “is found to be right skewed and leptokurtic”"
SCALED = "section 4: “when scaled to the interval (0,1) the friction coefficient follows a Beta(2.1,5)-distribution”"
ANY_DEPTH = "section 4: “independent of the penetration depth”"
FIGURE_2 = "Figure 2 states the median penetration, and no other is stated"
HUNDRED = "a study of its time has some hundred windows"
OF_SETS = "the extremes of small sets scale it"
EVERY_LEVEL = "every penetration counts"
SEEN = "section 5: “it can be clearly seen that also the reattachment point is nonnormally distributed”"
RANGE = "section 5: a range of damping “where the stochastic system can still move on the limit cycle”"


def _falls(name: str, key: str, title: str, *more: Reading) -> Statement:
    """A statistic of friction falls with penetration."""
    over_all = Reading(
        "over-all-levels", friction.FALLS, FALL, friction.falls(key, title), natural="it is of the whole range"
    )
    every = friction.falls_at_every_step(key, title)
    every_step = Reading("every-step", friction.EVERY_STEP, FALL, every, when="every step has to fall")
    return Statement(
        name,
        f"The {title} decreases with penetration",
        "decreases",
        f"change of the {title}",
        (over_all, every_step, *more),
    )


ON_PRESSURE = (
    Statement(
        "fig2-mcs-lhs",
        "Latin hypercube sampling gives the distribution of Monte Carlo sampling",
        "curves coincide",
        "distance of the distributions",
        (
            Reading(
                "given-contact",
                pressure.COINCIDE,
                CAPTION,
                within("distance_in_contact", pressure.distance_note, ("method", "latin_hypercube"), high=VISIBLE),
                natural="the paper defines the pressure by contact and gives the probability of contact apart",
            ),
            Reading(
                "contact-or-not",
                pressure.WITH_ZEROS,
                "section 3.2: p̃_x is the pressure, zero without contact",
                pressure.latin_hypercube_with_zeros,
                when="pressures of zero count too",
            ),
        ),
    ),
    Statement(
        "fig2-pc-lhs",
        "The polynomial chaos of eq. (8) gives the sampled distribution",
        "curves coincide",
        "distance of the distributions",
        (
            Reading(
                "given-contact",
                f"eq. (8), {pressure.IN_CONTACT}: {pressure.COINCIDE}",
                DEFINED,
                partial(pressure.given_contact, equation="equation_8"),
                natural="eq. (8) is fitted to samples in contact, so its variables are those of such samples",
            ),
            Reading(
                "given-contact-equation-9",
                f"eq. (9), {pressure.IN_CONTACT}: {pressure.COINCIDE}",
                f"{DEFINED}; Figure 2 shows both variants",
                partial(pressure.given_contact, equation="equation_9"),
                when=NINE,
            ),
            Reading(
                "all-surfaces",
                f"eq. (8), {pressure.OVER_ALL}: {pressure.COINCIDE}",
                GAUSSIAN,
                pressure.over_all_surfaces,
                apart=TRAP,
            ),
        ),
    ),
    Statement(
        "fig2-pc-tail",
        "Polynomial chaos matches even for low probabilities",
        "matches well",
        "largest ratio of the probabilities",
        (
            Reading(
                "given-contact-design",
                f"eq. (8) against the design that was fitted, {pressure.IN_CONTACT}: {pressure.OF_DESIGN}",
                LATIN,
                pressure.tail("equation_8"),
                DECADES,
                natural="the sentence compares with Latin hypercube sampling, and the paper has one such design",
            ),
            Reading(
                "given-contact-equation-9",
                f"eq. (9) against the design that was fitted, {pressure.IN_CONTACT}: {pressure.OF_DESIGN}",
                f"{LATIN}; Figure 2 shows both variants",
                pressure.tail("equation_9"),
                DECADES,
                when=NINE,
            ),
            Reading(
                "all-surfaces",
                f"eq. (8) against all solved samples, {pressure.OVER_ALL}: {pressure.OF_SAMPLES}",
                GAUSSIAN,
                pressure.tail_over_all_surfaces,
                DECADES,
                apart=TRAP,
            ),
        ),
    ),
    Statement(
        "fig2-variants-agree",
        "The variants of eqs. (8) and (9) are nearly indistinguishable",
        "curves coincide",
        "distance of the distributions",
        (
            Reading(
                "given-contact",
                f"both variants at the same surfaces, {pressure.IN_CONTACT}: {pressure.COINCIDE}",
                f"{DEFINED}; section 3.3: eq. (11) keeps the K samples in contact",
                within("given_between", pressure.distance_note, high=VISIBLE),
                natural="both variants stand for the pressure when contact occurs",
            ),
            Reading(
                "all-surfaces",
                f"both variants at the same draws, {pressure.OVER_ALL}: {pressure.COINCIDE}",
                GAUSSIAN,
                within("distance_between_variants", pressure.distance_note, high=VISIBLE),
                apart=TRAP,
            ),
        ),
    ),
)
OVER_PENETRATION = (
    _falls(
        "fig3-mean-decreases",
        "mean",
        "mean friction coefficient",
        Reading("sums", friction.SUMS_FALL, WEIGHTS, friction.by_sums, when="windows weigh as their force"),
    ),
    _falls("fig3-std-decreases", "std", "standard deviation"),
    _falls("fig3-cov-decreases", "variation", "coefficient of variation"),
)
ON_FRICTION = (
    Statement(
        "mu-correlation-exponential",
        "The friction coefficient is exponentially correlated",
        "exponential",
        "mean square distance to the exponential, less that to the triangle",
        (
            Reading(
                "nearer-than-the-window",
                friction.NEARER,
                FOUND,
                within("combined_misfit_difference", friction.of_misfits, MEDIAN, high=0.0),
                natural="a correlation that any average over the window has is no property of friction",
            ),
            Reading(
                "close-to-the-eye",
                friction.CLOSE,
                FOUND,
                within("misfit_exponential", "rms distance to lags of three windows", MEDIAN, high=VISIBLE),
                when="the curve looks like its exponential",
            ),
        ),
    ),
    Statement(
        "mu-correlation-250um",
        "Its correlation length is 250 µm",
        "250 µm",
        "correlation length",
        (
            Reading(
                "least-squares",
                f"exponential by least squares to lags of three windows: {friction.AT_LENGTH}",
                FOUND,
                friction.length("least_squares", "least squares to lags of three windows"),
                MICROMETRES,
                natural="it takes the whole curve, while a straight line needs a largest lag, which the text lacks",
            ),
            Reading(
                "one-over-e",
                f"first lag at which the autocorrelation falls to 1/e: {friction.AT_LENGTH}",
                "common practice: the correlation length of an exponential is where it falls to 1/e",
                friction.length("one_over_e", "first crossing of 1/e"),
                MICROMETRES,
                when="the length is where the curve falls to 1/e",
            ),
            Reading(
                "straight-line",
                f"straight line through the logarithm to lags of {LINE_WINDOWS:g} of the window: {friction.AT_LENGTH}",
                "common practice: a straight line through the logarithm of the autocorrelation",
                friction.length("log_line", f"a straight line to lags of {LINE_WINDOWS:g} of the window"),
                MICROMETRES,
                apart="the largest lag is ours, sets the length, and was chosen with the length known",
            ),
        ),
    ),
    Statement(
        "mu-correlation-any-depth",
        "The correlation length does not depend on the penetration",
        "independent",
        "change of the length",
        (
            Reading(
                "least-squares",
                friction.STEADY,
                ANY_DEPTH,
                friction.length_at_any_depth,
                MICROMETRES,
                natural="the length is the same as in the statement before",
            ),
        ),
    ),
    Statement(
        "mu-right-skewed",
        "The friction coefficient is right skewed",
        "skewness > 0",
        "skewness",
        (
            Reading(
                "at-the-median",
                "the interval of the skewness at median penetration lies above zero",
                SHAPE,
                within("combined_skewness", friction.of_skewness, MEDIAN, low=0.0),
                natural=FIGURE_2,
            ),
            Reading(
                "at-every-level",
                "the interval of the skewness at every level lies above zero",
                f"{SHAPE}, after the figure for all depths",
                friction.positive_at_every_level("skewness", "skewness"),
                when=EVERY_LEVEL,
            ),
        ),
    ),
    Statement(
        "mu-leptokurtic",
        "The friction coefficient is leptokurtic",
        "excess kurtosis > 0",
        "excess kurtosis",
        (
            Reading(
                "own-kurtosis",
                "the interval of the excess kurtosis at median penetration lies above zero",
                SHAPE,
                within("combined_kurtosis", friction.OF_KURTOSIS, MEDIAN, low=0.0),
                natural="it is of the friction coefficient itself; a fitted Beta says nothing exact of a fourth moment",
            ),
            Reading(
                "at-every-level",
                "the interval of the excess kurtosis at every level lies above zero",
                f"{SHAPE}, after the figure for all depths",
                friction.positive_at_every_level("kurtosis", "excess kurtosis"),
                when=EVERY_LEVEL,
            ),
        ),
    ),
    Statement(
        "mu-beta-2.1-5",
        "Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)",
        "Beta(2.1, 5)",
        "distance of the distributions",
        (
            Reading(
                "at-the-median",
                f"with free ends of the scaling, at median penetration {friction.LIKE_BETA}",
                SCALED,
                friction.beta_at_the_median,
                natural=FIGURE_2,
            ),
            Reading(
                "scaled-by-sets",
                f"scaled by the extremes of sets of {SET_WINDOWS} windows, at median penetration: {friction.IN_SETS}",
                f"{SCALED}; {HUNDRED}",
                friction.sets_at_the_median,
                when=OF_SETS,
            ),
        ),
    ),
    Statement(
        "mu-beta-any-depth",
        "It follows Beta(2.1, 5) at every penetration",
        "independent",
        "largest distance of the distributions",
        (
            Reading(
                "at-every-level",
                f"with free ends of the scaling, at every level {friction.LIKE_BETA}",
                ANY_DEPTH,
                friction.beta_at_any_depth,
                natural="the sentence gives one distribution for all penetrations",
            ),
            Reading(
                "scaled-by-sets",
                f"scaled by the extremes of sets of {SET_WINDOWS} windows, at every level: {friction.IN_SETS}",
                f"{ANY_DEPTH}; {HUNDRED}",
                friction.sets_at_any_depth,
                when=OF_SETS,
            ),
        ),
    ),
)
ON_MOTION = (
    Statement(
        "fig5-limit-cycle",
        "The mass moves on a stick-slip limit cycle, with and without scatter",
        "limit cycle",
        "runs with a cycle in the closing periods",
        (
            Reading(
                "runs-at-the-end",
                motion.CYCLE_TO_THE_END,
                "section 5: “Figure 5 displays the limit cycle”",
                motion.cycling_at_the_end,
                SHARE,
                natural="the figure shows the motion at this damping after its start",
            ),
            Reading(
                "time-in-stick-slip",
                motion.STAY_ON_THE_CYCLE,
                "section 5: the numbers of cycles “in the same amount of time”",
                motion.time_on_the_cycle,
                SHARE,
                when="the time in stick-slip counts",
            ),
        ),
    ),
    Statement(
        "fig5-reattachment-nonnormal",
        "The reattachment point is not normally distributed",
        "non-normal",
        "skewness of the point",
        (
            Reading(
                "moments",
                motion.BEYOND_NORMAL,
                SEEN,
                motion.moments,
                natural="the statement is of the distribution; whether it is seen is another matter",
            ),
            Reading(
                "to-the-eye",
                f"the interval of the Kolmogorov distance to the normal of equal moments lies above {VISIBLE}",
                SEEN,
                within("reattachment_distance_to_normal", "Kolmogorov distance to the normal", low=VISIBLE),
                when="the eye has to see it",
            ),
        ),
    ),
    Statement(
        "fig5-sharp-limit",
        "Without scatter the cycle ceases at a sharp limit of damping",
        "sharp limit",
        "damping ratio of the limit",
        (
            Reading(
                "existence",
                motion.SHARP,
                "section 5: a “sharp limit for the damping coefficient where the limit cycle ceases to exist”",
                motion.sharp_limit,
                natural="the sentence names existence",
            ),
        ),
    ),
    Statement(
        "fig5-range-beyond-limit",
        "With scatter there is a range of damping where the mass can still move on the cycle",
        "a range",
        "time in stick-slip beyond the limit, of that of the undisturbed cycle,",
        (
            Reading(
                "lost-cycles",
                motion.TIME_BEYOND,
                "section 5: “Figure 5 c) displays the difference M_diff”, and the range is read from it",
                motion.time_beyond_the_limit,
                SHARE,
                natural="M_diff below zero beyond the limit, by more than single returns, is the paper's own figure",
            ),
            Reading(
                "runs-at-the-end",
                motion.RUNS_BEYOND,
                RANGE,
                motion.runs_beyond_the_limit,
                SHARE,
                when="runs have to cycle to their end",
            ),
            Reading(
                "every-return",
                motion.RETURNS_BEYOND,
                "section 5: “the mean number of limit cycles”; what counts as one is not said",
                motion.returns_beyond_the_limit,
                SHARE,
                when="every return counts as a cycle",
            ),
        ),
    ),
)
OUR_OWN = (
    Statement(
        "own-fig5-under-load",
        f"Our own statement: on windows that bear the stated force this range exceeds {motion.SEEN_RANGE:.0%} of the "
        "limit",
        "not stated",
        "range over limit",
        (
            Reading(
                "runs-at-the-end",
                motion.ON_THE_PAD,
                "section 5: a normal force of 2.5 kN, on windows of 25 µm x 600 µm",
                motion.under_load("additive"),
                SHARE,
                natural="section 5 adds the stochastic part: μ = μ_D + μ_S",
            ),
            Reading(
                "multiplicative-scatter",
                f"with scatter that multiplies the friction coefficient, {motion.ON_THE_PAD}",
                "section 4: the friction coefficient is shear strength times area over force, and the area scatters",
                motion.under_load("multiplicative"),
                SHARE,
                when="scatter multiplies the friction",
            ),
        ),
    ),
)
STATEMENTS = (*ON_PRESSURE, *OVER_PENETRATION, *ON_FRICTION, *ON_MOTION, *OUR_OWN)


def claims(square: Arrays | None, friction: Arrays | None, oscillator: Arrays | None) -> list[dict[str, Any]]:
    """Every statement as claims.json has it, from the results of the branches that the scene runs.

    square, friction, oscillator : contents of chaos/square.nc, friction/statistics.nc, oscillator/statistics.nc
    """
    both = None if friction is None or oscillator is None else {**friction, **oscillator}
    families = (
        ("figure2", square, ON_PRESSURE),
        ("figure3", friction, OVER_PENETRATION),
        ("figure3_law", friction, ON_FRICTION),
        ("figure5", oscillator, ON_MOTION),
        ("figure5", both, OUR_OWN),
    )
    return [one.claim(arrays) | {"figure": figure} for figure, arrays, rows in families for one in rows]
