"""Sections of a scene that have one of two forms: friction, and the end of the expansion of the square."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

SOLVED_FRICTION = ("mean_at_median", "least_contact_fraction")
GIVEN_FRICTION = "statistics"
ORDER, SHARE = "square.modes", "square.variance_share"

# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {
    "friction": {GIVEN_FRICTION: SOLVED_FRICTION, **dict.fromkeys(SOLVED_FRICTION, (GIVEN_FRICTION,))},
    "square": {"modes": ("variance_share",), "variance_share": ("modes",)},
}


def friction_mistakes(friction: dict[str, Any]) -> Iterator[Mistake]:
    """Friction has exactly one of its two forms."""
    solved = [key for key in SOLVED_FRICTION if key in friction]
    if GIVEN_FRICTION in friction:
        given = f"friction.{GIVEN_FRICTION}"
        for key in solved:
            yield Mistake((f"friction.{key}", given), f"{shown(friction[key])} is not allowed beside {given}; give one")
    elif not solved:
        yield Mistake(("friction",), f"empty; give {GIVEN_FRICTION}, or {' with '.join(SOLVED_FRICTION)}")
    elif len(solved) < len(SOLVED_FRICTION):
        (absent,) = set(SOLVED_FRICTION) - set(solved)
        yield Mistake((f"friction.{absent}", f"friction.{solved[0]}"), f"missing; goes with friction.{solved[0]}")


def square_mistakes(square: dict[str, Any]) -> Iterator[Mistake]:
    """The expansion of the square ends at an order or at a share of the variance, one of them."""
    has_order, has_share = "modes" in square, "variance_share" in square  # also where the schema refuses the value
    if not has_order and not has_share:
        yield Mistake((ORDER,), f"missing; give it, or {SHARE}")
    elif has_order and has_share:
        yield Mistake((SHARE, ORDER), f"{shown(square['variance_share'])} is not allowed beside {ORDER}; give one")
