"""Friction of windows and pads from the blocks of strips, or of periodic cells that bear the same nominal pressure.

The first-order influence of the blocks gives the scatter of pads (`pad`), their own ratios that of single windows.
Whole strips or cells are resampled.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from roughslip.errors import ParameterError
from roughslip.friction.bowden_tabor import Windows, window_sums
from roughslip.friction.pad import (
    Surface,
    adjacent_variance,
    between_pads,
    influence_covariance,
    mehler_parts,
    pad_scatter,
)
from roughslip.friction.statistics import estimate_of, resampled
from roughslip.probability import Estimate

Estimates = dict[str, Estimate]


@dataclass(frozen=True, eq=False)
class Blocks:
    """Contact of blocks at one level.

    area, force : (S, X, Y) [m^2], [N] of the blocks of S strips or cells, X along and Y across the belt
    block_m, width_m, window_m : length of a block, its width and that of a window, length of a window
    periodic : whether the last block along the belt is followed by the first
    """

    area: np.ndarray
    force: np.ndarray
    block_m: float
    width_m: float
    window_m: float
    periodic: bool

    def __post_init__(self) -> None:
        if self.area.ndim != 3 or self.area.shape != self.force.shape:
            raise ParameterError(f"area {self.area.shape} and force {self.force.shape} must both be (samples, X, Y)")

    @property
    def samples(self) -> int:
        """Number of strips or cells."""
        return len(self.area)

    @property
    def window(self) -> int:
        """Blocks of a window."""
        return round(self.window_m / self.block_m)

    @property
    def rows(self) -> Windows:
        """Area and force (S Y, X) of the blocks one behind the other."""
        area, force = (part.transpose(0, 2, 1).reshape(-1, part.shape[1]) for part in (self.area, self.force))
        return area, force

    @property
    def windows(self) -> Windows:
        """Area and force (S Y, W) of the windows that begin at each block, across the period too where there is one."""
        around = self.window - 1 if self.periodic else 0
        area, force = (
            window_sums(np.concatenate((part, part[:, :around]), axis=1), self.window, 1) for part in self.rows
        )
        return area, force

    def of_rows(self, weights: np.ndarray) -> np.ndarray:
        """Counts (1 + R, S Y) of the rows from those (1 + R, S) of the samples."""
        return np.repeat(weights, self.area.shape[2], axis=1)


def pads(
    blocks: Blocks, surface: Surface, weights: np.ndarray, length_m: float | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Parts (1 + R, M) of the influence of blocks, as of `mehler_parts`, and the variance of pads, as of `pad_scatter`.

    weights : (1 + R, S) counts of strips or cells, from `strip_weights`
    length_m : of pads; None for squares

    Lags of cells reach half a period: beyond, a block is nearer on the other side. Raises IllPosedError as
    `pad_scatter`.
    """
    (area, force), counts = blocks.rows, blocks.of_rows(weights)
    lags = area.shape[1] // 2 if blocks.periodic else area.shape[1]
    covariance = influence_covariance(area, force, counts)[:, :lags]
    parts = mehler_parts(covariance, surface, blocks.block_m, blocks.width_m)
    adjacent = adjacent_variance(area, force, counts, blocks.window)
    return parts, pad_scatter(parts, adjacent, surface, blocks.block_m, blocks.width_m, blocks.window_m, length_m)


def pad_estimates(
    blocks: Blocks, surface: Surface, weights: np.ndarray, windows: float = 1.0, length_m: float | None = None
) -> Estimates:
    """What cells show of pads under their load, for a shear strength of 1 Pa, by name.

    weights, length_m : as of `pads`
    windows : of the pad that bears the load, at least 1

    ratio : () [1/Pa] area over force of all blocks
    pad_std : (WINDOWS,) [1/Pa] standard deviation of this ratio of pads
    load_std : () [1/Pa] that of the pad of the load
    pad_parts : of the powers of the correlation in the influence
    no_contact : () [-] share of the windows without contact
    """
    parts, variance = pads(blocks, surface, weights, length_m)
    totals = resampled(weights, np.stack((blocks.area.sum(axis=(1, 2)), blocks.force.sum(axis=(1, 2))), axis=1)).T
    counts, empty = blocks.of_rows(weights), (blocks.windows[1] <= 0.0).mean(axis=1, keepdims=True)
    rows = {
        "ratio": totals[0] / totals[1],
        "pad_std": np.sqrt(variance),
        "load_std": np.sqrt(between_pads(variance, np.full(len(weights), float(windows)))),
        "pad_parts": parts,
        "no_contact": (resampled(counts, empty) / counts.sum(axis=1)[:, None])[:, 0],
    }
    return _estimates(rows, blocks.samples)


def under_load(found: Estimates, mean: float, pressure_pa: float, cells: int) -> Estimates:
    """The same at the shear strength that gives the pad this mean, with that strength and the real area.

    found : from `pad_estimates` of so many cells under this nominal pressure
    """
    ratio = found["ratio"].rows
    shear = mean / ratio
    rows = {
        "shear_strength": shear,
        "real_area": ratio * pressure_pa,
        "load_mean": np.full(len(ratio), mean),
        "load_std": shear * found["load_std"].rows,
        "pad_std": shear[:, None] * found["pad_std"].rows,
    }
    return found | _estimates(rows, cells)


def _estimates(rows: dict[str, np.ndarray], cells: int) -> Estimates:
    kinds = {name: "std" if name.endswith("std") else "mean" for name in rows}
    found = {name: estimate_of(kinds[name], values, cells) for name, values in rows.items()}
    if share := found.get("no_contact"):  # the margin of few cells may leave [0, 1]
        found["no_contact"] = replace(share, low=np.maximum(share.low, 0.0), high=np.minimum(share.high, 1.0))
    return found
