"""The same windows from solved strips, on one mesh or two, and from the expansion on more strips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.statistics import strip_weights

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, or area and force, each (..., S, W)


@dataclass(frozen=True, eq=False)
class Levels:
    """Windows as mu and valid, each (S, W), or (penetrations, S, W).

    solved : on cells h
    expansion : of the solved strips, and then of more
    coarse : of the solved strips on cells 2h
    """

    solved: Windows
    expansion: Windows
    coarse: Windows | None = None

    @property
    def strips(self) -> tuple[int, int]:
        """Number of solved strips, and of those that the expansion has alone."""
        solved, expanded = (windows[0].shape[-2] for windows in (self.solved, self.expansion))
        return solved, expanded - solved

    def at(self, penetration: int) -> Levels:
        """Windows (S, W) at one of the penetrations, by its number."""
        (mu, valid), (expanded, has_value) = self.solved, self.expansion
        coarse = None if self.coarse is None else (self.coarse[0][penetration], self.coarse[1][penetration])
        return Levels((mu[penetration], valid[penetration]), (expanded[penetration], has_value[penetration]), coarse)

    def weights(self, replicates: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
        """(1 + replicates, strips) counts from `strip_weights`, of the solved strips and of the others."""
        solved, others = self.strips
        return strip_weights(solved, replicates, rng), strip_weights(others, replicates, rng)


def levels_of_sums(least_area_m2: float, solved: Windows, expansion: Windows, coarse: Windows | None) -> Levels:
    """The levels for a shear strength of 1 Pa, from area [m2] and force [N].

    least_area_m2 : below it a window has no friction coefficient
    """

    def friction(sums: Windows) -> Windows:
        return friction_coefficient(*sums, 1.0, least_area_m2)

    return Levels(friction(solved), friction(expansion), None if coarse is None else friction(coarse))
