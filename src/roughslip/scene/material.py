"""Section `material` of a scene."""

from __future__ import annotations

from roughslip.scene.fields import Section, number, section


@section
class Material(Section):
    """Half-space, elastic, or elastic and plastic where a hardness is given."""

    young_modulus_pa: float = number("Young's modulus, from soft gels to diamond", "Pa", at_least=1000, at_most=1e13)
    poisson_ratio: float = number("Poisson's ratio", above=-1, at_most=0.5)
    hardness_pa: float | None = number(
        "Highest contact pressure, at which the surface yields; without it the contact is elastic",
        "Pa",
        above=0,
        at_most=1e13,
        default=None,
    )
