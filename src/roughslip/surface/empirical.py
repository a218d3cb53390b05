"""The marginal distribution of measured heights, as a monotone table of heights against normal scores."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy
from scipy.special import ndtr, ndtri

from roughslip.errors import IllPosedError, ParameterError
from roughslip.surface.marginal import checked_heights, normal_score

EDGE = 8.5  # normal score beyond which lies a probability of 2e-17
FINE = 1.0 / 256.0
LEAST_BEYOND = 10  # heights beyond the outermost node on either side
MOST_SHARED = 0.05  # of the heights at the lowest or at the highest value


@dataclass(frozen=True, eq=False)
class EmpiricalMarginal:
    """Heights of zero mean whose quantile function z(g), g the standard normal score, is linear between the nodes.

    normal : (n,) [-] ascending nodes
    heights : (n,) [m] ascending heights there; beyond the last nodes they stay
    tail_share : [-] share of the ensemble in each extrapolated tail
    """

    normal: np.ndarray
    heights: np.ndarray
    tail_share: float

    def __post_init__(self) -> None:
        if self.normal.ndim != 1 or self.normal.shape != self.heights.shape or self.normal.size < 2:
            raise ParameterError("an empirical marginal needs two rows of equal length")
        for row in (self.normal, self.heights):
            if not (np.isfinite(row).all() and (np.diff(row) > 0.0).all()):
                raise ParameterError("scores and heights of an empirical marginal must be finite and ascend")

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""
        return math.sqrt(_moment(self.normal, self.heights, 2))

    @property
    def skewness(self) -> float:
        """Third standardised moment [-]."""
        return _moment(self.normal, self.heights, 3) / self.rms_height_m**3

    @property
    def excess_kurtosis(self) -> float:
        """Fourth standardised moment less 3 [-]."""
        return _moment(self.normal, self.heights, 4) / self.rms_height_m**4 - 3.0

    def from_gaussian(self, normal: np.ndarray) -> np.ndarray:
        """z : (as normal) [m] of standard normal g."""
        return np.interp(normal, self.normal, self.heights)

    def quantile(self, probability: float | np.ndarray) -> np.ndarray:
        """z : (as probability) [m] height below which that share of the ensemble lies."""
        return self.from_gaussian(normal_score(probability))

    def cdf(self, height: float | np.ndarray) -> np.ndarray:
        """F : (as height) [-] probability of lying below `height` [m], the exact inverse of the quantile."""
        z = np.asarray(height, dtype=float)
        if np.isnan(z).any():
            raise ParameterError("heights must be numbers")
        return ndtr(np.interp(z, self.heights, self.normal, left=-math.inf, right=math.inf))


def empirical_marginal(heights: np.ndarray, rms_height_m: float | None = None) -> EmpiricalMarginal:
    """The marginal of measured heights.

    heights : (any shape) [m] finite heights, form removed
    rms_height_m : [m] Sq of the marginal; that of the heights where not given

    Each height has the normal score of its middle rank, equal ones share theirs, so that the steps of a digitised
    instrument are bridged. Nodes n^(-1/5) apart in the score, as a kernel's width in a density estimate, and as far out
    as ten heights and the middle of the extreme values lie beyond, are joined by a monotone cubic (Fritsch and Carlson,
    SIAM J. Numer. Anal. 17 (1980) 238). Tails: z linear in the score with the slope of the last interval, a normal
    tail of that local spread. Raises IllPosedError for constant heights, fewer than 100, or more than 5 % at one end.
    """
    z = checked_heights(heights)
    rms = float(np.std(z)) if rms_height_m is None else rms_height_m
    if not (math.isfinite(rms) and rms > 0.0):
        raise ParameterError(f"the rms height must be positive and finite, not {rms}")
    if z.size < 10 * LEAST_BEYOND:
        raise IllPosedError(f"{z.size} heights make no distribution; use {10 * LEAST_BEYOND} or a parametric law")
    values, counts = np.unique(z, return_counts=True)
    shared = max(counts[0], counts[-1]) / z.size
    if shared > MOST_SHARED:
        raise IllPosedError(
            f"{100.0 * shared:.2g} % of the heights share the lowest or highest value: a clipped or coarsely digitised "
            f"scan; leave those points out or use a parametric law"
        )
    score = ndtri((np.cumsum(counts) - 0.5 * counts) / z.size)
    spacing = z.size**-0.2
    reach = min(-float(score[0]), float(score[-1]), -float(ndtri(LEAST_BEYOND / z.size)))
    half = math.floor(reach / spacing)
    inner = spacing * np.arange(-half, half + 1)
    known = np.interp(inner, score, values)
    slope_low, slope_high = (known[1] - known[0]) / spacing, (known[-1] - known[-2]) / spacing
    ends = known[0] - slope_low * (EDGE + inner[0]), known[-1] + slope_high * (EDGE - inner[-1])
    curve = scipy.interpolate.PchipInterpolator(
        np.concatenate(([-EDGE], inner, [EDGE])), np.concatenate((ends[:1], known, ends[1:]))
    )
    normal = np.linspace(-EDGE, EDGE, round(2.0 * EDGE / FINE) + 1)
    table = curve(normal)
    table -= _moment(normal, table, 1)
    table *= rms / math.sqrt(_moment(normal, table, 2))
    return EmpiricalMarginal(normal, table, float(ndtr(inner[0])))


def _moment(normal: np.ndarray, heights: np.ndarray, order: int) -> float:
    """E z^order of z linear in g between the nodes, by the trapezoidal rule on a normal weight."""
    density = np.exp(-0.5 * normal**2) / math.sqrt(2.0 * math.pi)
    return float(np.trapezoid(density * heights**order, normal))
