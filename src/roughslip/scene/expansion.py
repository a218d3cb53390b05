"""Section `expansion` of a scene."""

from __future__ import annotations

import math
from typing import Literal

from roughslip.limits import FUNCTIONALS
from roughslip.scene.auto import AUTO, Auto
from roughslip.scene.fields import Section, choice, integer, section

Target = Literal["trial_pressure", "squared_pressure"]
Design = Literal["latin_hypercube", "sobol", "monte_carlo"]


@section
class Expansion(Section):
    """Polynomial chaos expansion of the pressure, fitted to all samples."""

    variables: int = integer(
        "Gaussian variables of the expansion at the centre, the first of the eight local functionals of the heights. "
        "It has C(variables + degree, degree) terms. The strip takes all eight",
        at_least=1,
        at_most=FUNCTIONALS,
    )
    degree: int = integer("Total degree of the Hermite polynomials", at_least=1, at_most=10)
    target: Target = choice(
        "Expanded quantity. The trial_pressure is p - gap/B_ii, for meshes as coarse as the correlation length. The "
        "squared_pressure is p^2 continued outside contact, for meshes that resolve it; on coarse ones they agree",
        Target,
    )
    samples: Auto[int] = integer(
        "Surfaces that the expansion of the square is fitted to, more than it has terms; auto doubles them until the "
        "error of the distribution is as accuracy asks",
        at_least=10,
        at_most=1_000_000,
        or_auto=True,
        default=AUTO,
    )
    design: Design | None = choice(
        "Design of the variables of these surfaces; where not given, sobol with samples auto and else latin_hypercube",
        Design,
        default=None,
    )
    draws: int = integer(
        "Draws from the fitted expansion, from which its distribution is read", at_least=1000, at_most=10_000_000
    )


def terms(variables: int, degree: int) -> int:
    """Terms of an expansion."""
    return math.comb(variables + degree, degree)
