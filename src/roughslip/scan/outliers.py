"""Outliers of a scan, as dust and bad pixels: points far from the bulk of the heights and from their neighbours."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import rank_filter

from roughslip.scan.topography import Form, Topography, remove_form

MAD = 1.4826  # standard deviation of Gaussian heights over their median absolute deviation
TAIL = 1.645  # and the distance of their 5 % quantiles from the median, in standard deviations
FAR = 6.0  # deviations of the bulk from the median
ABOVE = 4.0  # deviations of the bulk beyond the neighbours
RINGS = (2, 4)  # nodes from a point to its neighbours: spots of up to four nodes are found


def outliers(scan: Topography) -> np.ndarray:
    """(nx, ny) bool, true at measured points that are outliers.

    The deviation of the bulk, a side, is the larger of those that the median absolute deviation and the 5 % quantile
    give: deep valleys of a plateau widen it. A point must lie FAR of them from the median, and ABOVE of them beyond all
    but one point of a square ring around it. A groove or scratch leaves the ring at its own depth twice, and is kept.
    """
    measured = scan.heights[scan.measured]
    z = scan.heights - np.median(measured)
    spread = MAD * float(np.median(np.abs(z[scan.measured])))
    found = np.zeros(z.shape, dtype=bool)
    for side in (z, -z):
        deviation = max(spread, float(np.quantile(side[scan.measured], 0.95)) / TAIL)
        far = side > FAR * deviation
        if deviation == 0.0 or not far.any():
            continue
        for reach in RINGS:
            ring = np.ones((2 * reach + 1, 2 * reach + 1), dtype=bool)
            ring[1:-1, 1:-1] = False
            found |= far & (side - rank_filter(side, -2, footprint=ring, mode="mirror") > ABOVE * deviation)
    return found & scan.measured


def without(scan: Topography, found: np.ndarray, form: Form) -> Topography:
    """The scan with its outliers `found` (nx, ny) missing, and its form removed anew."""
    read = f"{scan.read}; {found.sum()} outliers treated as missing"
    return remove_form(replace(scan, missing=scan.missing | found, read=read), form)


def warnings(scan: Topography, found: np.ndarray, treatment: str) -> Iterator[str]:
    """A line where there are outliers: how many, where the largest lies, and what is done with them."""
    if not found.any():
        return
    away = np.where(found, np.abs(scan.heights - np.median(scan.heights[scan.measured])), 0.0)
    i, j = np.unravel_index(np.argmax(away), away.shape)
    place = f"x {i * scan.dx * 1e6:.4g} µm, y {j * scan.dy * 1e6:.4g} µm"
    done = (
        "they are kept and change all statistics; roughness.scan.outliers: missing leaves them out"
        if treatment == "keep"
        else "they are treated as missing (roughness.scan.outliers)"
    )
    yield (
        f"{found.sum()} points of the scan are outliers, up to {away[i, j] * 1e6:.3g} µm from the median at {place}: "
        f"{done}"
    )
