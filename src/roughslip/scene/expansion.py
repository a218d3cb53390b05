"""Section `expansion` of a scene."""

from __future__ import annotations

import math
from typing import Literal

from roughslip.limits import FUNCTIONALS
from roughslip.scene.fields import Section, choice, integer, section

AUTO = "auto"  # number of samples, or of nodes per correlation length
BEST = "best"  # number of variables, or target

Rotation = Literal["local", "regression", "none"]
Target = Literal["trial_pressure", "squared_pressure", "censored", "best"]
Design = Literal["latin_hypercube", "sobol", "monte_carlo"]


@section
class Expansion(Section):
    """Polynomial chaos expansion of the pressure, fitted to all samples."""

    variables: int | Literal["best"] = integer(
        "Gaussian variables of the expansion at the centre, which has C(variables + degree, degree) terms. The first "
        "eight are local functionals of the heights. Further ones are directions in which the residual still varies "
        "more than its noise. With best, it is the least of 2, 4, 6, 8, 9, 10 and 12 that predicts left-out surfaces "
        "as well as any. The strip takes all eight functionals",
        at_least=1,
        at_most=100,
        or_word=BEST,
    )
    rotation: Rotation = choice(
        "Origin of the variables. With local, they are local functionals of the heights. With regression, the "
        "direction of a linear regression on the heights around a node comes first. With none, they are the leading "
        "modes, as in the paper",
        Rotation,
        default="local",
    )
    degree: int = integer("Total degree of the Hermite polynomials", at_least=1, at_most=10)
    target: Target = choice(
        "Expanded quantity. The trial_pressure is p - gap/B_ii, for meshes as coarse as the correlation length. The "
        "squared_pressure is p^2 continued outside contact, for meshes that resolve it. With censored, the gap is not "
        "used, on the square alone. With best, it is the one that predicts left-out surfaces of the square best. "
        "The strip then takes squared_pressure, which equals trial_pressure on coarse meshes",
        Target,
    )
    samples: int | Literal["auto"] = integer(
        "Surfaces that the expansion of the square is fitted to, more than it has terms; auto doubles them until the "
        "error of the distribution is as accuracy asks",
        at_least=10,
        at_most=1_000_000,
        or_word=AUTO,
        default=AUTO,
    )
    design: Design | None = choice(
        "Design of the variables of these surfaces; where not given, sobol with samples auto and else latin_hypercube",
        Design,
        default=None,
    )
    draws: int = integer(
        "Draws from the fitted expansion, from which its distribution is read", at_least=1000, at_most=100_000_000
    )


def terms(variables: int | str, degree: int, best: int = FUNCTIONALS) -> int:
    """Terms of an expansion. best : number of variables to count where the scene leaves it open."""
    return math.comb((best if isinstance(variables, str) else variables) + degree, degree)
