"""The statements of the paper in its order, then our own: a row each, with its readings and their rules.

To judge another statement, add a row. Its judge is a function of stored results, or `within` for a single number.
"""

from typing import Any

from roughslip.verdicts import friction_rules as friction
from roughslip.verdicts import motion_rules as motion
from roughslip.verdicts import pressure_rules as pressure
from roughslip.verdicts.reading import DECADES, MICROMETRES, SHARE, UNITLESS, Arrays, Reading, Statement, statement

DEFINED = "section 3.2: p_x is “the pressure when contact occurs”, and the probability of contact stands apart"
CAPTION = "caption of Figure 2: “cumulative distribution function for the contact pressure”"
GAUSSIAN = "eqs. (8) and (9): the polynomials are functions of ξ, and section 2 has ξ standard Gaussian"
LATIN = "section 3.3: “matches well with the results obtained from Latin Hypercube Sampling”"
TRAP = "a trap: eqs. (8) and (9) stand for the pressure when contact occurs, and most draws have none"
BOTH = "Figure 2 shows both variants"
NINE = "eq. (9) takes the place of eq. (8)"
FALL = "section 4: mean, standard deviation and coefficient of variation “decrease with increasing penetration depth”"
WEIGHTS = "section 4: “A_c and the normal force N are obtained by averaging the pressure field”, with no weights"
ONE = "section 4: “comparing the results for two test surfaces centered at different coordinates of the pressure field”"
A_STRIP = "the text has one pressure field, and no length of it; it is a strip of four windows here"
TOGETHER = "all strips together make the curve"
FOUND = "section 4: μ “was found to be exponentially correlated with correlation length 250 µm”; no fit is named"
SHAPE = "section 4: the distribution “is found to be right skewed and leptokurtic”"
SCALED = "section 4: “when scaled to the interval (0,1) the friction coefficient follows a Beta(2.1,5)-distribution”"
ANY_DEPTH = "section 4: “independent of the penetration depth”"
FIGURE_2 = "Figure 2 states the median penetration, and no other is stated"
HUNDRED = "a study of its time has some hundred windows"
FREE = "with free ends of the scaling, at"
BY_SETS = f"scaled by the extremes of sets of {friction.STUDY_WINDOWS} windows, at"
OF_SETS = "the extremes of small sets scale it"
SEEN = "section 5: “By comparison with the normal probability density function, it can be clearly seen”"
RANGE = "section 5: a range of damping “where the stochastic system can still move on the limit cycle”"


def _falls(name: str, key: str, title: str, *more: Reading) -> Statement:
    """A statistic of friction falls with penetration."""
    over_all = Reading("over-all-levels", friction.falls(key, title), FALL, natural="it is of the whole range")
    every = friction.falls_at_every_step(key, title)
    every_step = Reading("every-step", every, FALL, when="every step has to fall")
    text, change = f"The {title} decreases with penetration", f"change of the {title}"
    return statement(name, text, "decreases", change, UNITLESS, over_all, every_step, *more)


def _positive(name: str, word: str, moment: str, paper: float, natural: str, id: str = "at-the-median") -> Statement:
    """A moment of the friction coefficient is positive. paper : of its Beta; natural, id : of the reading"""
    judge = friction.positive(moment.split()[-1], moment, paper)
    median = friction.at_the_median(f"the interval of the {moment} at median penetration lies above zero", judge)
    every = friction.at_every_level(f"the interval of the {moment} at every level lies above zero", judge)
    of_depths, counts = f"{SHAPE}, after the figure for all depths", "every penetration counts"
    readings = Reading(id, median, SHAPE, natural), Reading("at-every-level", every, of_depths, when=counts)
    return statement(name, f"The friction coefficient is {word}", f"{moment} > 0", moment, UNITLESS, *readings)


ON_PRESSURE = (
    statement(
        "fig2-mcs-lhs",
        "Latin hypercube sampling gives the distribution of Monte Carlo sampling",
        "curves coincide",
        "distance of the distributions",
        UNITLESS,
        Reading(
            "given-contact",
            pressure.coincide("distance_in_contact", place=("method", "latin_hypercube")),
            CAPTION,
            natural="the paper defines the pressure by contact and gives the probability of contact apart",
        ),
        Reading(
            "contact-or-not",
            pressure.latin_hypercube_with_zeros,
            "section 3.2: p̃_x is the pressure, zero without contact",
            when="pressures of zero count too",
        ),
    ),
    statement(
        "fig2-pc-lhs",
        "The polynomial chaos of eq. (8) gives the sampled distribution",
        "curves coincide",
        "distance of the distributions",
        UNITLESS,
        Reading(
            "given-contact",
            pressure.given_contact("8"),
            DEFINED,
            natural="eq. (8) is fitted to samples in contact, so its variables are those of such samples",
        ),
        Reading("given-contact-equation-9", pressure.given_contact("9"), f"{DEFINED}; {BOTH}", when=NINE),
        Reading("all-surfaces", pressure.over_all_surfaces, GAUSSIAN, apart=TRAP),
    ),
    statement(
        "fig2-pc-tail",
        "Polynomial chaos matches even for low probabilities",
        "matches well",
        "largest ratio of the probabilities",
        DECADES,
        Reading(
            "given-contact-design",
            pressure.tail("8"),
            LATIN,
            natural="the sentence compares with Latin hypercube sampling, and the paper has one such design",
        ),
        Reading("given-contact-equation-9", pressure.tail("9"), f"{LATIN}; {BOTH}", when=NINE),
        Reading("all-surfaces", pressure.tail_over_all_surfaces, GAUSSIAN, apart=TRAP),
    ),
    statement(
        "fig2-variants-agree",
        "The variants of eqs. (8) and (9) are nearly indistinguishable",
        "curves coincide",
        "distance of the distributions",
        UNITLESS,
        Reading(
            "given-contact",
            pressure.coincide("given_between", f"both variants at the same surfaces, {pressure.IN_CONTACT}: "),
            f"{DEFINED}; section 3.3: eq. (11) keeps the K samples in contact",
            natural="both variants stand for the pressure when contact occurs",
        ),
        Reading(
            "all-surfaces",
            pressure.coincide("distance_between_variants", f"both variants at the same draws, {pressure.OVER_ALL}: "),
            GAUSSIAN,
            apart=TRAP,
        ),
    ),
)
OVER_PENETRATION = (
    _falls(
        "fig3-mean-decreases",
        "mean",
        "mean friction coefficient",
        Reading("sums", friction.sums_fall, WEIGHTS, when="windows weigh as their force"),
    ),
    _falls("fig3-std-decreases", "std", "standard deviation"),
    _falls("fig3-cov-decreases", "variation", "coefficient of variation"),
)
ON_FRICTION = (
    statement(
        "mu-correlation-exponential",
        "The friction coefficient is exponentially correlated",
        "exponential",
        "share of single fields to which the exponential is nearer than the triangle",
        UNITLESS,
        Reading("one-field", friction.exponential_in_one_field, ONE, natural=A_STRIP),
        Reading("nearer-than-the-window", friction.NEARER_THAN_THE_WINDOW, FOUND, when=TOGETHER),
    ),
    statement(
        "mu-correlation-250um",
        "Its correlation length is 250 µm",
        "250 µm",
        "correlation length of one field",
        MICROMETRES,
        Reading("one-field", friction.length_of_one_field, ONE, natural=A_STRIP),
        Reading(
            "least-squares",
            friction.length("least_squares", "all strips together, by least squares to lags of three windows"),
            FOUND,
            when=TOGETHER,
        ),
        Reading(
            "one-over-e",
            friction.length("one_over_e", "all strips together, first lag at which the autocorrelation falls to 1/e"),
            "common practice: the correlation length of an exponential is where it falls to 1/e",
            when="the curve of all has to fall to 1/e there",
        ),
    ),
    statement(
        "mu-correlation-any-depth",
        "The correlation length does not depend on the penetration",
        "independent",
        "change of the length",
        MICROMETRES,
        Reading(
            "least-squares",
            friction.length_at_any_depth,
            ANY_DEPTH,
            natural="a change with depth shows in all strips together, as each field scatters by more",
        ),
    ),
    _positive("mu-right-skewed", "right skewed", "skewness", friction.BETA_SKEWNESS, FIGURE_2),
    _positive(
        "mu-leptokurtic",
        "leptokurtic",
        "excess kurtosis",
        friction.BETA_KURTOSIS,
        "it is of the friction coefficient itself; a fitted Beta says nothing exact of a fourth moment",
        "own-kurtosis",
    ),
    statement(
        "mu-beta-2.1-5",
        "Scaled to (0, 1) the friction coefficient follows Beta(2.1, 5)",
        "Beta(2.1, 5)",
        "distance of the distributions",
        UNITLESS,
        Reading(
            "at-the-median",
            friction.at_the_median(f"{FREE} median penetration {friction.NEAR_BETA}", friction.like_beta),
            SCALED,
            natural=FIGURE_2,
        ),
        Reading(
            "scaled-by-sets",
            friction.at_the_median(f"{BY_SETS} median penetration: {friction.IN_SETS}", friction.shapes_of_sets),
            f"{SCALED}; {HUNDRED}",
            when=OF_SETS,
        ),
    ),
    statement(
        "mu-beta-any-depth",
        "It follows Beta(2.1, 5) at every penetration",
        "independent",
        "largest distance of the distributions",
        UNITLESS,
        Reading(
            "at-every-level",
            friction.at_every_level(f"{FREE} every level {friction.NEAR_BETA}", friction.like_beta),
            ANY_DEPTH,
            natural="the sentence gives one distribution for all penetrations",
        ),
        Reading(
            "scaled-by-sets",
            friction.at_every_level(f"{BY_SETS} every level: {friction.IN_SETS}", friction.shapes_of_sets),
            f"{ANY_DEPTH}; {HUNDRED}",
            when=OF_SETS,
        ),
    ),
)
ON_MOTION = (
    statement(
        "fig5-limit-cycle",
        "The mass moves on a stick-slip limit cycle, with and without scatter",
        "limit cycle",
        "runs with a cycle in the closing periods",
        SHARE,
        Reading(
            "runs-at-the-end",
            motion.cycling_at_the_end,
            "section 5: “Figure 5 displays the limit cycle”",
            natural="the figure shows the motion at this damping after its start",
        ),
        Reading(
            "time-in-stick-slip",
            motion.time_on_the_cycle,
            "section 5: the numbers of cycles “in the same amount of time”",
            when="the time in stick-slip counts",
        ),
    ),
    statement(
        "fig5-reattachment-nonnormal",
        "The reattachment point is not normally distributed",
        "non-normal",
        "distance of the distributions",
        UNITLESS,
        Reading("to-the-eye", motion.FAR_FROM_NORMAL, SEEN, natural="the sentence names what is seen in the figure"),
        Reading("moments", motion.moments, "section 5: “nonnormally distributed”", when="its moments decide"),
    ),
    statement(
        "fig5-sharp-limit",
        "Without scatter the cycle ceases at a sharp limit of damping",
        "sharp limit",
        "damping ratio of the limit",
        UNITLESS,
        Reading(
            "existence",
            motion.sharp_limit,
            "section 5: a “sharp limit for the damping coefficient where the limit cycle ceases to exist”",
            natural="the sentence names existence",
        ),
    ),
    statement(
        "fig5-range-beyond-limit",
        "With scatter there is a range of damping where the mass can still move on the cycle",
        "a range",
        "time in stick-slip beyond the limit, of that of the undisturbed cycle,",
        SHARE,
        Reading(
            "lost-cycles",
            motion.TIME_BEYOND,
            "section 5: “Figure 5 c) displays the difference M_diff”, and the range is read from it",
            natural="M_diff below zero beyond the limit, by more than single returns, is the paper's own figure",
        ),
        Reading("runs-at-the-end", motion.RUNS_BEYOND, RANGE, when="runs have to cycle to their end"),
        Reading(
            "every-return",
            motion.RETURNS_BEYOND,
            "section 5: “the mean number of limit cycles”; what counts as one is not said",
            when="every return counts as a cycle",
        ),
    ),
)
OUR_OWN = (
    statement(
        "own-fig5-under-load",
        "Our own statement: with as many windows as bear the stated force, this range exceeds "
        f"{motion.SEEN_RANGE:.0%} of the limit",
        "not stated",
        "range over limit",
        SHARE,
        Reading(
            "runs-at-the-end",
            motion.under_load("additive"),
            "section 5: a normal force of 2.5 kN, on windows of 25 µm x 600 µm",
            natural="section 5 adds the stochastic part: μ = μ_D + μ_S",
        ),
        Reading(
            "multiplicative-scatter",
            motion.under_load("multiplicative", "with scatter that multiplies the friction coefficient, "),
            "section 4: the friction coefficient is shear strength times area over force, and the area scatters",
            when="scatter multiplies the friction",
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
