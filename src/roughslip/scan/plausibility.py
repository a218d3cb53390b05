"""Warnings on a scan whose slopes are those of heights or distances in a wrong unit."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from roughslip.scan.topography import Topography
from roughslip.surface.plausibility import MOST_SLOPE

LEAST_SLOPE = 1e-3  # rms; machined surfaces have some 0.03 to 0.5, a wrong prefix changes them by 1000


def warnings(scan: Topography) -> Iterator[str]:
    """A line where the rms slope between neighbouring points is implausible: its number, what to check."""
    along, across = (np.mean(np.diff(scan.heights, axis=axis) ** 2) for axis in (0, 1))
    slope = math.sqrt(along / scan.dx**2 + across / scan.dy**2)
    if LEAST_SLOPE <= slope <= MOST_SLOPE:
        return
    why = (
        f"above {MOST_SLOPE:g}, too steep for a half-space"
        if slope > MOST_SLOPE
        else f"below {LEAST_SLOPE:g}, smoother than machined surfaces"
    )
    yield (
        f"rms slope {slope:.3g} between neighbouring points of the scan is {why}. Check the units of its heights, "
        f"which scatter by {np.std(scan.heights):.3g} m, and of their distance, {scan.dx:.3g} m: roughness.scan.file, "
        "and height_unit and spacing_m where the file gives none"
    )
