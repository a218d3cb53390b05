"""Section `expansion` of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from roughslip.limits import FIELD_GROUPS, FIELD_NUMBERS, FIELD_SAMPLES, FUNCTIONALS
from roughslip.scene.fields import Section, choice, integer, number, section
from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused

AUTO = "auto"  # number of samples, or of nodes per correlation length
BEST = "best"  # number of variables, or target
SAMPLES, ERROR, DESIGN = "expansion.samples", "expansion.cdf_error", "expansion.design"
HARDNESS = "material.hardness_pa"

Rotation = Literal["local", "regression", "none"]
Target = Literal["trial_pressure", "squared_pressure", "censored", "best"]
Design = Literal["latin_hypercube", "sobol", "monte_carlo"]
EXTENDED = ("sobol", "monte_carlo")  # designs that can be extended


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
        "error of the distribution is at most cdf_error",
        at_least=10,
        at_most=1_000_000,
        or_word=AUTO,
    )
    cdf_error: float = number(
        "With samples auto: largest Kolmogorov error of the distribution of the pressure, contact or not. The "
        "estimate from the samples keeps it in 95 of 100 studies",
        at_least=0.0005,
        at_most=0.2,
        default=None,
    )
    design: Design | None = choice(
        "Design of the variables of these surfaces; where not given, sobol with samples auto and else latin_hypercube",
        Design,
        default=None,
    )
    draws: int = integer(
        "Draws from the fitted expansion, from which its distribution is read", at_least=1000, at_most=100_000_000
    )


REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"expansion": {"samples": ("cdf_error",)}}


def terms(variables: int | str, degree: int, best: int = FUNCTIONALS) -> int:
    """Terms of an expansion. best : number of variables to count where the scene leaves it open."""
    return math.comb((best if isinstance(variables, str) else variables) + degree, degree)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """What does not go together in an expansion."""
    yield from _sample_mistakes(scene)
    yield from _field_mistakes(scene)
    yield from _hardness_mistakes(scene)


def _sample_mistakes(scene: Values) -> Iterator[Mistake]:
    """The samples have a number or an error."""
    samples, error, design = (given(scene, key) for key in (SAMPLES, ERROR, DESIGN))
    if samples == AUTO:
        if error is None:
            yield missing(f"{SAMPLES} = {AUTO} needs it", ERROR, SAMPLES)
        if design is not None and design not in EXTENDED:
            allowed = f"{' or '.join(EXTENDED)} with {SAMPLES} = {AUTO}, to be extended"
            yield refused(design, allowed, DESIGN, SAMPLES)
    elif samples is not None and error is not None:
        yield not_together(ERROR, error, SAMPLES, samples, allowed=f"only {AUTO} takes it")


def _field_mistakes(scene: Values) -> Iterator[Mistake]:
    """The expansion at every node has a basis in all modes, and tables of all nodes."""
    samples, modes, nodes = (given(scene, key) for key in (SAMPLES, "square.modes", "square.nodes"))
    if "figure_field" not in (scene.get("targets") or ()) or not isinstance(samples, int):
        return
    if modes is not None and samples - math.ceil(samples / FIELD_GROUPS) <= modes + 1:
        allowed = f"without a {FIELD_GROUPS}th of them still more than the {modes + 1} terms of figure_field, "
        yield refused(samples, f"{allowed}square.modes and a constant", SAMPLES, "square.modes")
    elif samples < FIELD_SAMPLES:
        yield refused(samples, f"at least {FIELD_SAMPLES} for figure_field", SAMPLES)
    if nodes is not None and modes is not None and FIELD_GROUPS * modes * nodes**2 > FIELD_NUMBERS:
        allowed = (
            f"{FIELD_GROUPS} times the modes times the {nodes**2} nodes at most {FIELD_NUMBERS} (0.8 GB of memory)"
        )
        yield refused(modes, f"{allowed} for figure_field", "square.modes", "square.nodes")
    if nodes is not None and samples * nodes**2 > FIELD_NUMBERS:
        allowed = f"samples times the {nodes**2} nodes of the square at most {FIELD_NUMBERS} (1.5 GB of memory)"
        yield refused(samples, f"{allowed} for figure_field", SAMPLES, "square.nodes")


def _hardness_mistakes(scene: Values) -> Iterator[Mistake]:
    """A surface that yields has no gap to leave out of a regression, and equal pressures at many nodes."""
    hardness, targets = given(scene, HARDNESS), scene.get("targets") or ()
    if hardness is None:
        return
    if given(scene, "expansion.target") == "censored":
        allowed = f"trial_pressure, squared_pressure or best where the surface yields, at {HARDNESS} = {hardness} [Pa]"
        yield refused("censored", allowed, "expansion.target", HARDNESS)
    if "figure_field" in targets:
        allowed = f"figure_field ranks the pressures of a node, and those at {HARDNESS} are equal: leave it out"
        yield refused(targets, allowed, "targets", HARDNESS)
