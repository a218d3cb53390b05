"""Figure 2: the distribution of the pressure at the centre, sampled and by polynomial chaos. Text, readings, rules."""

from __future__ import annotations

from functools import partial

import numpy as np

from roughslip.verdicts.finding import Arrays, Finding, Interval, judged_inside, number
from roughslip.verdicts.reading import VISIBLE, Reading, Statement, Unit

FACTOR = 2.0  # between small probabilities that still match
WELL_CAPTURED = 0.9  # share of the variance below which the notes say what the modes carry
DECADES = Unit("decades", 1.0, " decades")

DEFINED = "section 3.2: p_x is “the pressure when contact occurs”, and the probability of contact stands apart"
FITTED = "section 3.3: eq. (11) keeps the K samples in contact, and K/K_t gives the probability of contact"
GAUSSIAN = "eqs. (8) and (9): the polynomials are functions of ξ, and section 2 has ξ standard Gaussian"
CAPTION = "caption of Figure 2: “cumulative distribution function for the contact pressure”"
LATIN = "section 3.3: “matches well with the results obtained from Latin Hypercube Sampling”"

COINCIDE = f"the interval of the Kolmogorov distance given contact lies below {VISIBLE}"
WITHIN = f"the interval of the largest |log10| of their ratio lies below {np.log10(FACTOR):.3f}, a factor of {FACTOR:g}"
IN_CONTACT = "variables are those of solved surfaces in contact that no fit has seen"
OVER_ALL = "variables are drawn over all surfaces, Gaussian; pressures above zero count"


def shown(stored: tuple[float, Interval], digits: int = 2) -> str:
    """`0.12 (0.10 to 0.14)`."""
    value, (low, high) = stored
    return f"{value:.{digits}f} ({low:.{digits}f} to {high:.{digits}f})"


def _of_method(square: Arrays, name: str, method: str) -> tuple[float, Interval]:
    return number(square, name, [str(kind) for kind in square["method"]].index(method))


def _of_variant(square: Arrays, name: str, variant: str) -> tuple[float, Interval]:
    return number(square, name, [str(kind) for kind in square["variant"]].index(variant))


def _distance_note(square: Arrays) -> str:
    captured = float(square["captured_variance"])
    truncated = f"the modes carry {captured:.0%} of the variance of the surface; " if captured < WELL_CAPTURED else ""
    return f"{truncated}Kolmogorov distance given contact"


def _latin_hypercube(square: Arrays) -> Finding:
    distance = _of_method(square, "distance_in_contact", "latin_hypercube")
    return judged_inside(distance, _distance_note(square), high=VISIBLE)


def _with_probability(square: Arrays) -> Finding:
    """The error of a probability of contact below one half is at least that of the distribution at any pressure."""
    value = float(square["distance"][[str(kind) for kind in square["method"]].index("latin_hypercube")])
    both = [_of_method(square, "contact_probability", method) for method in ("monte_carlo", "latin_hypercube")]
    half = float(np.linalg.norm([(high - low) / 2 for _, (low, high) in both]))
    first, second = (shown(stored, 4) for stored in both)
    note = f"Kolmogorov distance of the pressure with its zeros; probability of contact {first} and {second}"
    return judged_inside((value, (max(value - half, 0.0), value + half)), note, high=VISIBLE)


def _given_contact(square: Arrays, variant: str) -> Finding:
    row = [str(kind) for kind in square["variant"]].index(variant)
    note = (
        f"{_distance_note(square)} at {int(square['given_surfaces'])} surfaces; in "
        f"{square['given_positive_share'][row]:.1%} of them the expansion is positive"
    )
    return judged_inside(_of_variant(square, "given_distance", variant), note, high=VISIBLE)


def _over_all(square: Arrays) -> Finding:
    first, second, ours = (
        _of_method(square, "distance_in_contact", m) for m in ("equation_8", "equation_9", "roughslip")
    )
    fits = [str(name) for name in square["fit"]]
    row_8, row_all = fits.index("equation_8"), fits.index("roughslip")
    samples = square["fit_samples"]
    note = (
        f"{_distance_note(square)} of eq. (8), fitted to {samples[row_8]:.0f} samples in contact; that of eq. (9) "
        f"{shown(second)}, of the expansion of {samples[row_all]:.0f} samples, in contact or not, {shown(ours, 3)}. "
        f"At all samples eq. (8) is positive in {square['fit_positive_share'][row_8]:.0%}"
    )
    return judged_inside(first, note, high=VISIBLE)


def _tail_given_contact(square: Arrays, variant: str) -> Finding:
    note = f"largest |log10| of the ratio at probabilities from {float(square['given_tail_from']):.2g} to 0.1"
    return judged_inside(_of_variant(square, "given_tail_error_of_design", variant), note, high=float(np.log10(FACTOR)))


def _tail_over_all(square: Arrays) -> Finding:
    ours = shown(_of_method(square, "tail_error", "roughslip"))
    note = f"largest |log10| of the ratio to the solved samples; that of the expansion of all samples {ours}"
    return judged_inside(_of_method(square, "tail_error", "equation_8"), note, high=float(np.log10(FACTOR)))


def _variants(square: Arrays, name: str) -> Finding:
    return judged_inside(number(square, name), _distance_note(square), high=VISIBLE)


STATEMENTS = (
    Statement(
        "fig2-mcs-lhs",
        "Latin hypercube sampling gives the distribution of Monte Carlo sampling",
        "curves coincide",
        (
            Reading(
                "given-contact",
                "distributions of the samples in contact",
                CAPTION,
                COINCIDE,
                _latin_hypercube,
                natural="the paper defines the pressure by contact and gives the probability of contact apart",
            ),
            Reading(
                "contact-or-not",
                "distributions of all samples, zero out of contact",
                "section 3.2: p̃_x is the pressure, zero without contact",
                f"the interval of the Kolmogorov distance lies below {VISIBLE}",
                _with_probability,
            ),
        ),
    ),
    Statement(
        "fig2-pc-lhs",
        "The polynomial chaos of eq. (8) gives the sampled distribution",
        "curves coincide",
        (
            Reading(
                "given-contact",
                f"eq. (8); {IN_CONTACT}",
                DEFINED,
                COINCIDE,
                partial(_given_contact, variant="equation_8"),
                natural="eq. (8) stands for the pressure when contact occurs and is fitted to samples in contact, so "
                "its variables are those of such samples",
            ),
            Reading(
                "given-contact-equation-9",
                f"eq. (9) in place of eq. (8); {IN_CONTACT}",
                f"{DEFINED}; Figure 2 shows both variants",
                COINCIDE,
                partial(_given_contact, variant="equation_9"),
            ),
            Reading("all-surfaces", f"eq. (8); {OVER_ALL}", GAUSSIAN, COINCIDE, _over_all),
        ),
    ),
    Statement(
        "fig2-pc-tail",
        "Polynomial chaos matches even for low probabilities",
        "matches well",
        (
            Reading(
                "given-contact-design",
                f"eq. (8) against the Latin hypercube samples of the design that was fitted; {IN_CONTACT}",
                LATIN,
                f"where the samples of the design lie between the probability that five of them give and 0.1, {WITHIN}",
                partial(_tail_given_contact, variant="equation_8"),
                natural="the sentence compares with Latin hypercube sampling, and the paper has one such design",
                unit=DECADES,
            ),
            Reading(
                "given-contact-equation-9",
                f"eq. (9) against the samples of its design; {IN_CONTACT}",
                f"{LATIN}; Figure 2 shows both variants",
                f"as for eq. (8): {WITHIN}",
                partial(_tail_given_contact, variant="equation_9"),
                unit=DECADES,
            ),
            Reading(
                "all-surfaces",
                f"eq. (8) against all solved samples; {OVER_ALL}",
                GAUSSIAN,
                f"where the solved samples lie between 0.001, or the least that they resolve, and 0.1, {WITHIN}",
                _tail_over_all,
                unit=DECADES,
            ),
        ),
    ),
    Statement(
        "fig2-variants-agree",
        "The variants of eqs. (8) and (9) are nearly indistinguishable",
        "curves coincide",
        (
            Reading(
                "given-contact",
                f"both variants at the same surfaces; {IN_CONTACT}",
                f"{DEFINED}; {FITTED}",
                COINCIDE,
                partial(_variants, name="given_between"),
                natural="both variants stand for the pressure when contact occurs",
            ),
            Reading(
                "all-surfaces",
                f"both variants at the same draws; {OVER_ALL}",
                GAUSSIAN,
                COINCIDE,
                partial(_variants, name="distance_between_variants"),
            ),
        ),
    ),
)
