"""Outliers of a scan, as dust, dirt and bad pixels: spots far from the bulk of heights and from their surroundings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation, find_objects, label

from roughslip.scan.topography import Form, Topography, remove_form

MAD = 1.4826  # standard deviation of Gaussian heights over their median absolute deviation
TAIL = 1.645  # and the distance of their 5 % quantiles from the median, in standard deviations
FAR = 6.0  # deviations of the bulk from the median
ABOVE = 4.0  # deviations of the bulk beyond the surroundings
SURROUNDINGS = (1, 3)  # nodes from a spot to them, its flanks left out
MOST_BELOW = 0.9  # share of the surroundings that must lie below: a groove that goes on takes more of them
LARGEST = 0.01  # share of the scan in a spot
LONGEST = 5.0  # square of the diagonal of its box over its area: 2.5 of a disc, larger for a scratch or groove
SQUARE = np.ones((3, 3), dtype=bool)


def outliers(scan: Topography) -> np.ndarray:
    """(nx, ny) bool, true at measured points that are outliers.

    On each side the deviation of the bulk is the larger of two: from the median absolute deviation, and from the 5 %
    quantile. Deep valleys of a plateau, or the dimples of a texture, widen it. A spot is a connected set of points that
    lie FAR of them from the median. It is one of outliers where it is small and compact, and its median lies ABOVE of
    them beyond its surroundings. Grooves and scratches are no such spots. A few deep pores are: they look alike.
    """
    measured = scan.heights[scan.measured]
    z = scan.heights - np.median(measured)
    spread = MAD * float(np.median(np.abs(z[scan.measured])))
    outliers = np.zeros(z.shape, dtype=bool)
    for side in (z, -z):
        deviation = max(spread, float(np.quantile(side[scan.measured], 0.95)) / TAIL)
        if deviation == 0.0:
            continue
        spots, _ = label(side > FAR * deviation, SQUARE)
        for number, box in enumerate(find_objects(spots), start=1):
            area = np.count_nonzero(spots[box] == number)
            diagonal = sum((part.stop - part.start) ** 2 for part in box)
            if area > LARGEST * z.size or diagonal > LONGEST * area:
                continue
            near, far = SURROUNDINGS
            around = tuple(slice(max(0, part.start - far), part.stop + far) for part in box)
            spot = spots[around] == number
            ring = binary_dilation(spot, SQUARE, far) & ~binary_dilation(spot, SQUARE, near) & (spots[around] == 0)
            heights = side[around]
            if ring.any() and np.median(heights[spot]) - np.quantile(heights[ring], MOST_BELOW) > ABOVE * deviation:
                outliers[around] |= spot
    return outliers & scan.measured


def without(scan: Topography, outliers: np.ndarray, form: Form) -> Topography:
    """The scan with its `outliers` (nx, ny) missing, and its form removed anew."""
    read = f"{scan.read}; {outliers.sum()} outliers treated as missing"
    return remove_form(replace(scan, missing=scan.missing | outliers, read=read), form)


def warnings(scan: Topography, outliers: np.ndarray, treatment: str) -> Iterator[str]:
    """A line where there are outliers: how many, where the largest lies, and what is done with them."""
    if not outliers.any():
        return
    away = np.where(outliers, np.abs(scan.heights - np.median(scan.heights[scan.measured])), 0.0)
    i, j = np.unravel_index(np.argmax(away), away.shape)
    place = f"x {i * scan.dx * 1e6:.4g} µm, y {j * scan.dy * 1e6:.4g} µm"
    done = (
        "they are kept and change all statistics; roughness.scan.outliers: missing leaves them out"
        if treatment == "keep"
        else "they are treated as missing (roughness.scan.outliers)"
    )
    yield (
        f"{outliers.sum()} points of the scan are outliers, up to {away[i, j] * 1e6:.3g} µm from the median at "
        f"{place}: "
        f"{done}"
    )
