"""Levels: the same windows from meshes and models of falling cost, each on more strips than the one before.

Strips are numbered once for all levels, and each level has the first ones. So the strips fall into groups, one for each
level that has more strips than the one before: those of all levels, then those that only cheaper levels have.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.statistics import strip_weights

Windows = tuple[np.ndarray, np.ndarray]  # mu and valid, or area and force, each (..., S, W)


@dataclass(frozen=True, eq=False)
class Level:
    """Windows of the first strips on one mesh and from one model.

    mesh : edge of a cell, 1 (cells h) or 2 (cells 2h)
    model : "solved" or "expansion"
    mu, valid : (S, W), or (penetrations, S, W), friction coefficient and bool
    """

    mesh: int
    model: str
    mu: np.ndarray
    valid: np.ndarray

    @property
    def strips(self) -> int:
        """Number of strips."""
        return self.mu.shape[-2]

    def at(self, penetration: int) -> Level:
        """(S, W) at one of the penetrations, by its number."""
        return Level(self.mesh, self.model, self.mu[penetration], self.valid[penetration])


def levels_of(solved: Windows, expansion: Windows, coarse: Windows | None = None) -> tuple[Level, ...]:
    """The levels of friction, from (mu, valid) on cells h, of the expansion, and on cells 2h."""
    middle = () if coarse is None else (Level(2, "solved", *coarse),)
    return Level(1, "solved", *solved), *middle, Level(1, "expansion", *expansion)


def levels_of_sums(least_area_m2: float, *sums: Windows | None) -> tuple[Level, ...]:
    """The levels for a shear strength of 1 Pa, from area [m2] and force [N] in the order of `levels_of`.

    least_area_m2 : below it a window has no friction coefficient
    """
    return levels_of(*(friction_coefficient(*pair, 1.0, least_area_m2) for pair in sums if pair is not None))


def controls(levels: Sequence[Level]) -> list[Level]:
    """The first level and those with more strips than all before: each is the control of the one before."""
    chain = [levels[0]]
    for level in levels[1:]:
        if level.strips > chain[-1].strips:
            chain.append(level)
    return chain


def group_sizes(levels: Sequence[Level]) -> list[int]:
    """Number of strips in each group, of which there is one for each of `controls`."""
    ends = [level.strips for level in controls(levels)]
    return [end - start for start, end in zip([0, *ends], ends, strict=False)]


def group_weights(levels: Sequence[Level], replicates: int, rng: np.random.Generator) -> list[np.ndarray]:
    """(1 + replicates, strips) counts from `strip_weights` of each group. Groups are resampled one by one.

    The first and the last group are drawn first, so that their numbers do not depend on what stands between them.
    """
    sizes = group_sizes(levels)
    order = [0, len(sizes) - 1, *range(1, len(sizes) - 1)]
    weights = {group: strip_weights(sizes[group], replicates, rng) for group in order}
    return [weights[group] for group in sorted(weights)]
