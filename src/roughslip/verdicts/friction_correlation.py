"""The friction coefficient is “exponentially correlated with correlation length 250 µm”. Text, readings, rules."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

from roughslip.friction.correlation import LINE_WINDOWS
from roughslip.verdicts.finding import (
    MEDIAN,
    TREND,
    Arrays,
    Bound,
    Finding,
    at_median,
    judged,
    judged_at,
    judged_inside,
    median,
    number,
)
from roughslip.verdicts.reading import VISIBLE, Reading, Statement, Unit

PAPER_LENGTH = 250e-6  # m
SAME_LENGTH = 0.2  # relative difference of correlation lengths that would not be reported as a dependence
ONE_LEVEL = "the scene has one penetration only"
MICROMETRES = Unit("m", 1e6, " µm")
FOUND = "section 4: μ “was found to be exponentially correlated with correlation length 250 µm”; no fit is named"
PRACTICE = "common practice: a straight line through the logarithm of the autocorrelation"
SAME = f"within {SAME_LENGTH:.0%} of 250 µm"


def _as_the_paper(name: str) -> Bound:
    low, high = PAPER_LENGTH * (1 - SAME_LENGTH), PAPER_LENGTH * (1 + SAME_LENGTH)
    return Bound(f"combined_length_{name}", MEDIAN, low, high, PAPER_LENGTH)


def _steady(name: str) -> Bound:
    return Bound(
        f"trend_combined_length_{name}_line", TREND, -SAME_LENGTH, SAME_LENGTH, share_of=f"combined_length_{name}"
    )


BOUNDS = {
    "mu-correlation-exponential": (Bound("combined_misfit_difference", MEDIAN, high=0.0),),
    "mu-correlation-250um": (_as_the_paper("least_squares"),),
    "mu-correlation-any-depth": (_steady("least_squares"),),
}
"""Of the natural readings, for which strips are added."""


def window(friction: Arrays) -> float:
    """Length of a window [m], at which its own triangle ends."""
    return float(friction["lag"][1] / (1.0 - friction["triangle"][1]))


def _nearer_than_the_window(friction: Arrays) -> Finding:
    exponential, triangle = (friction[f"misfit_{name}"][median(friction)] for name in ("exponential", "triangle"))
    note = f"rms distance {exponential:.3f} from the exponential, {triangle:.3f} from the triangle of the window"
    return replace(judged_at(friction, BOUNDS["mu-correlation-exponential"], median(friction)), note=note)


def _close(friction: Arrays) -> Finding:
    distance = number(friction, "misfit_exponential", median(friction))
    return judged_inside(distance, "rms distance from the exponential to lags of three windows", high=VISIBLE)


def _length(friction: Arrays, name: str, by: str) -> Finding:
    own = 1e6 * float(friction["triangle_length"][[str(kind) for kind in friction["length_name"]].index(name)])
    stored = at_median(friction, f"length_{name}")
    shorter = 1e6 * window(friction) * PAPER_LENGTH / stored[0]
    lengths = 1e6 * friction[f"combined_length_{name}"]
    same = abs(1e-6 * own - PAPER_LENGTH) <= SAME_LENGTH * PAPER_LENGTH
    passes = ", which passes the rule too: then it says nothing of friction" if same else ""
    note = (
        f"metres, {by}; {lengths.min():.0f} to {lengths.max():.0f} µm over all levels. The triangle of the window "
        f"alone gives {own:.0f} µm{passes}. The length goes with the window, and one of {shorter:.0f} µm would give "
        "the paper's"
    )
    return replace(judged_at(friction, [_as_the_paper(name)], median(friction)), note=note)


def _at_any_depth(friction: Arrays, name: str) -> Finding | str:
    finding = judged(friction, [_steady(name)])
    if finding is None:
        return ONE_LEVEL
    lengths = friction[f"combined_length_{name}"]
    note = (
        f"metres, change along a straight line through all levels; {1e6 * finding.thresholds[1]:.0f} µm are allowed; "
        "the "
        f"levels have {1e6 * lengths.min():.0f} to {1e6 * lengths.max():.0f} µm"
    )
    return replace(finding, note=note)


KNOWN = (
    "the largest lag was chosen with its length known, so that it holds is no evidence and the headline leaves it out"
)
LEAST_SQUARES = "exponential by least squares to lags of three windows"
WITHIN = f"at median penetration the interval of the length lies {SAME}"
CHANGE = (
    "the interval of the change from the first to the last level, along a straight line through all, lies within "
    f"{SAME_LENGTH:.0%} of the mean length"
)
STATEMENTS = (
    Statement(
        "mu-correlation-exponential",
        "The friction coefficient is exponentially correlated",
        "exponential",
        (
            Reading(
                "nearer-than-the-window",
                "the fitted exponential against the triangle that the window alone would give",
                FOUND,
                "at median penetration the mean square distance to the fitted exponential is less than that to the "
                "triangle of the window itself: the interval of their difference lies below zero",
                _nearer_than_the_window,
                natural="a correlation that any average over the window has is no property of friction",
            ),
            Reading(
                "close-to-the-eye",
                "how far the curve is from its exponential",
                FOUND,
                f"at median penetration the interval of the rms distance to the exponential lies below {VISIBLE}",
                _close,
            ),
        ),
    ),
    Statement(
        "mu-correlation-250um",
        "Its correlation length is 250 µm",
        "250 µm",
        (
            Reading(
                "least-squares",
                LEAST_SQUARES,
                FOUND,
                WITHIN,
                partial(_length, name="least_squares", by="least squares to lags of three windows"),
                natural="it takes the whole curve, while a straight line needs a largest lag, which the text lacks",
                unit=MICROMETRES,
            ),
            Reading(
                "log-line-90",
                f"a straight line through the logarithm to lags of {LINE_WINDOWS:g} of the window",
                f"{PRACTICE}; the largest lag is ours and sets the length",
                WITHIN,
                partial(_length, name="log_line", by=f"{PRACTICE}, here to lags of {LINE_WINDOWS:g} of the window"),
                chosen=KNOWN,
                unit=MICROMETRES,
            ),
            Reading(
                "one-over-e",
                "first lag at which the autocorrelation falls to 1/e",
                "common practice: the correlation length of an exponential is where it falls to 1/e",
                WITHIN,
                partial(_length, name="one_over_e", by="first crossing of 1/e"),
                unit=MICROMETRES,
            ),
        ),
    ),
    Statement(
        "mu-correlation-any-depth",
        "The correlation length does not depend on the penetration",
        "independent",
        (
            Reading(
                "least-squares",
                LEAST_SQUARES,
                "section 4: “independent of the penetration depth”",
                CHANGE,
                partial(_at_any_depth, name="least_squares"),
                natural="the length is the same as in the statement before",
                unit=MICROMETRES,
            ),
        ),
    ),
)
