"""Rules on Figure 2: the distribution of the pressure at the centre, sampled and by polynomial chaos."""

import numpy as np

from roughslip.verdicts.reading import Arrays, Found, Place, Rule, Stored, lies, number, row_of, rule, shown, within

FACTOR = 2.0  # between small probabilities that still match
DECADES = float(np.log10(FACTOR))
WELL_CAPTURED = 0.9  # share of the variance below which the notes say what the modes carry
IN_CONTACT = "at variables of solved surfaces in contact that no fit has seen"
OVER_ALL = "at Gaussian variables, drawn over all surfaces; pressures above zero count"
NEARER = "half of that of the nearer of normal and uniform, of equal mean and deviation, from the solved samples"
COINCIDE = f"the interval of the Kolmogorov distance given contact lies below {NEARER}"
RATIO = f"the interval of the largest |log10| of their ratio lies below {DECADES:.3f}, a factor of {FACTOR:g}"
OF_DESIGN = f"where the samples of the design lie between the probability that five of them give and 0.1, {RATIO}"
OF_SAMPLES = f"where the solved samples lie between 0.001, or the least that they resolve, and 0.1, {RATIO}"


def distance_note(square: Arrays) -> str:
    """What the distance is, and what the modes carry if that is little."""
    captured = float(square["captured_variance"])
    truncated = f"the modes carry {captured:.0%} of the variance of the surface; " if captured < WELL_CAPTURED else ""
    return f"{truncated}Kolmogorov distance given contact"


def alike(square: Arrays, stored: Stored, note: str, share: float = 1.0) -> Found:
    """Two distributions are alike. share : in contact, where zeros count; normal and uniform have the same zeros"""
    most = share * min(float(square[f"distance_to_{name}"]) for name in ("normal", "uniform")) / 2.0
    return lies(stored, f"{note}; the threshold is {most:.4f}", high=most)


def coincide(name: str, of: str = "", place: Place | None = None) -> Rule:
    """Two distributions given contact are alike. of : which, before the words of the rule"""
    return Rule(of + COINCIDE, lambda square: alike(square, number(square, name, place), distance_note(square)))


@rule(f"zeros count: the interval of the Kolmogorov distance lies below the probability of contact times {NEARER}")
def latin_hypercube_with_zeros(square: Arrays) -> Found:
    """The error of a probability of contact below one half is at least that of the distribution at any pressure."""
    methods = [("method", name) for name in ("monte_carlo", "latin_hypercube")]
    both = [number(square, "contact_probability", method) for method in methods]
    half = float(np.linalg.norm([(high - low) / 2 for _, (low, high) in both]))
    first, second = (shown(stored, 4) for stored in both)
    note = f"Kolmogorov distance of the pressure with its zeros; probability of contact {first} and {second}"
    value = float(square["distance"][row_of(square, methods[1])])
    return alike(square, (value, (max(value - half, 0.0), value + half)), note, both[0][0])


def given_contact(equation: str) -> Rule:
    """An expansion at surfaces in contact that no fit has seen, against the samples. equation : 8 or 9"""
    variant = ("variant", f"equation_{equation}")

    @rule(f"eq. ({equation}), {IN_CONTACT}: {COINCIDE}")
    def judge(square: Arrays) -> Found:
        count, positive = int(square["given_surfaces"]), square["given_positive_share"][row_of(square, variant)]
        note = f"{distance_note(square)} at {count} surfaces; in {positive:.1%} of them the expansion is positive"
        return alike(square, number(square, "given_distance", variant), note)

    return judge


@rule(f"eq. (8), {OVER_ALL}: {COINCIDE}")
def over_all_surfaces(square: Arrays) -> Found:
    """Eq. (8) at variables drawn over all surfaces."""
    names = "equation_8", "equation_9", "roughslip"
    first, second, ours = (number(square, "distance_in_contact", ("method", name)) for name in names)
    row_8, row_all = (row_of(square, ("fit", name)) for name in ("equation_8", "roughslip"))
    samples = square["fit_samples"]
    note = (
        f"{distance_note(square)} of eq. (8), fitted to {samples[row_8]:.0f} samples in contact; that of eq. (9) "
        f"{shown(second)}, of the expansion of {samples[row_all]:.0f} samples, in contact or not, {shown(ours, 3)}. "
        f"At all samples eq. (8) is positive in {square['fit_positive_share'][row_8]:.0%}"
    )
    return alike(square, first, note)


def tail(equation: str) -> Rule:
    """The largest ratio of small probabilities given contact. equation : 8 or 9"""
    return within(
        f"eq. ({equation}) against the design that was fitted, {IN_CONTACT}: {OF_DESIGN}",
        "given_tail_error_of_design",
        lambda square: f"largest |log10| of the ratio at probabilities from {square['given_tail_from']:.2g} to 0.1",
        ("variant", f"equation_{equation}"),
        high=DECADES,
    )


@rule(f"eq. (8) against all solved samples, {OVER_ALL}: {OF_SAMPLES}")
def tail_over_all_surfaces(square: Arrays) -> Found:
    """The same of eq. (8) at variables drawn over all surfaces."""
    ours = shown(number(square, "tail_error", ("method", "roughslip")))
    note = f"largest |log10| of the ratio to the solved samples; that of the expansion of all samples {ours}"
    return lies(number(square, "tail_error", ("method", "equation_8")), note, high=DECADES)
