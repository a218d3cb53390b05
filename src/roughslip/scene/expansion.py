"""Section `expansion` of a scene."""

from __future__ import annotations

import math
import operator
from typing import Literal

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS
from roughslip.scene.fields import Section, choice, integer, section
from roughslip.scene.mistakes import MEMORY, Rule

Target = Literal["trial_pressure", "squared_pressure"]


@section
class Expansion(Section):
    """Polynomial chaos expansion of the pressure, fitted to all samples."""

    variables: int = integer(
        "Gaussian variables of the expansion at the centre, the first of the eight local functionals of the heights. "
        "It has C(variables + degree, degree) terms. The strip takes all eight",
        minimum=1,
        maximum=FUNCTIONALS,
    )
    degree: int = integer("Total degree of the Hermite polynomials", minimum=1, maximum=10)
    target: Target = choice(
        "Expanded quantity. The trial_pressure is p - gap/B_ii, for meshes as coarse as the correlation length. The "
        "squared_pressure is p^2 continued outside contact, for meshes that resolve it; on coarse ones they agree",
        Target,
    )
    samples: int = integer(
        "Surfaces that the expansion of the square is fitted to, more than it has terms", minimum=10, maximum=1_000_000
    )
    draws: int = integer(
        "Draws from the fitted expansion, from which its distribution is read", minimum=1000, maximum=10_000_000
    )


def terms(variables: int, degree: int) -> int:
    """Terms of an expansion."""
    return math.comb(variables + degree, degree)


_TERMS = ("expansion.variables", "expansion.degree")


def designs_fit(samples: str) -> Rule:
    """The rule that a design of so many samples of the modes fits into memory. samples : scene key of their number"""
    allowed = f"samples times square.modes = {{1}} at most {MEMORY}"
    return Rule((samples, "square.modes"), lambda n, modes: n * modes <= MOST_NUMBERS, allowed)


RULES = (
    Rule(("expansion.variables", "square.modes"), operator.le, "at most square.modes = {1}"),
    designs_fit("expansion.samples"),
    *(
        rule
        for samples in ("expansion.samples", "square.latin_hypercube_samples")
        for rule in (
            Rule(
                (samples, *_TERMS),
                lambda n, v, d: n > terms(v, d),
                "more than the terms of the expansion, C({1} + {2}, {2})",
            ),
            Rule(
                (samples, *_TERMS),
                lambda n, v, d: n <= terms(v, d) or n * terms(v, d) <= MOST_NUMBERS,
                f"samples times terms, C({{1}} + {{2}}, {{2}}), at most {MEMORY}",
            ),
        )
    ),
)
