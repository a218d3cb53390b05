"""Section `expansion` of a scene."""

from __future__ import annotations

import math
import operator
from typing import Literal

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS, TRAINING_NODES
from roughslip.scene.fields import AUTO, Auto, Section, choice, integer, section
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
    samples: Auto[int] = integer(
        "Surfaces that the expansion of the square is fitted to, more than it has terms; auto doubles them until the "
        "error of the distribution is as accuracy asks",
        minimum=10,
        maximum=1_000_000,
        or_auto=True,
        default=AUTO,
    )
    draws: int = integer(
        "Draws from the fitted expansion, from which its distribution is read", minimum=1000, maximum=10_000_000
    )


def terms(variables: int, degree: int) -> int:
    """Terms of an expansion."""
    return math.comb(variables + degree, degree)


_TERMS = ("expansion.variables", "expansion.degree")
_DRAWS = 40  # over the square of accuracy.pressure: draws then add 1.36 / sqrt(10) of its half, with 95 %


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
    Rule(
        ("expansion.samples", *_TERMS),
        lambda _, v, d: TRAINING_NODES * terms(v, d) * 2 ** terms(v, d).bit_length() <= MOST_NUMBERS,
        f"a lower expansion.degree, because more samples than C({{1}} + {{2}}, {{2}}), at {TRAINING_NODES} nodes each, "
        f"give tables above {MEMORY}",
        of_auto=("expansion.samples",),
    ),
    Rule(
        ("expansion.draws", "accuracy.pressure", "expansion.samples", "targets"),
        lambda draws, error, _, targets: "figure2" not in targets or draws * error**2 >= _DRAWS,
        f"at least {_DRAWS} / accuracy.pressure^2, or the draws alone err by half of {{1}}",
        of_auto=("expansion.samples",),
    ),
)
