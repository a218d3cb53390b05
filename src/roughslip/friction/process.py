"""Stationary random friction along the belt: a marginal distribution and an exponential autocorrelation.

mu_S is a Gaussian process translated to the marginal, less its mean (M. Grigoriu, J. Eng. Mech. 110 (1984) 610-620).
Paths are drawn by recursion.py, piece by piece, and by fft_paths.py, whole.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from roughslip.errors import ParameterError, real
from roughslip.probability import BetaDistribution, QuantileDistribution, Translation, tabulate

PAPER_SHAPES = (2.1, 5.0)  # of the Beta distribution in section 4 of the paper
TABLE_NODES, MOST_TERMS, NEGLIGIBLE_REMAINDER = 2**12 + 1, 200, 1e-9  # of the translation

Marginal = BetaDistribution | QuantileDistribution


@dataclass(frozen=True)
class FrictionProcess:
    """mu_S along the slipped distance s: mu of the marginal less its mean, with the autocorrelation exp(-s / L).

    marginal : distribution of mu
    correlation_length_m : [m] L > 0
    """

    marginal: Marginal
    correlation_length_m: float

    def __post_init__(self) -> None:
        length = self.correlation_length_m
        if not (math.isfinite(real("FrictionProcess.correlation_length_m", length)) and length > 0.0):
            raise ParameterError(f"FrictionProcess.correlation_length_m must be finite and positive, not {length}")

    def translation(self) -> Translation:
        """The translation of the Gaussian process to mu_S.

        Raises IllPosedError where 200 terms of the Hermite series leave out more than 1e-4 of the variance.
        """
        return tabulate(
            self.marginal.centred,
            scale=self.marginal.scale,
            nodes=TABLE_NODES,
            most_terms=MOST_TERMS,
            negligible_remainder=NEGLIGIBLE_REMAINDER,
        )
