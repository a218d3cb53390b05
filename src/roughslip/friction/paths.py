"""One interface to the three ways of drawing friction paths."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Protocol

import numpy as np

from roughslip.errors import ParameterError
from roughslip.friction.fft_paths import circulant_embedding, spectral_representation
from roughslip.friction.process import FrictionProcess
from roughslip.friction.recursion import recursion

METHODS = ("recursion", "embedding", "spectral")


class Paths(Protocol):
    """Paths of one process at one spacing [m], with the largest error of their autocorrelation [-]."""

    @property
    def spacing(self) -> float:
        """[m] between two nodes."""
        ...

    @property
    def correlation_error(self) -> float:
        """[-] the largest error of the autocorrelation."""
        ...

    def realisation(self, seed: Sequence[int]) -> Iterable[np.ndarray]:
        """mu_S of a seed at the slipped distances 0, spacing, ..., in pieces one after another, again at every turn."""


def prepare(process: FrictionProcess, spacing_m: float, length_m: float, method: str = "recursion") -> Paths:
    """Paths with nodes at 0, spacing_m, ... that reach to length_m or further.

    method : recursion has no end and keeps a piece at a time; embedding and spectral draw the whole path at once, the
        latter as the paper does. All three have the same marginal and autocorrelation.

    Raises ParameterError and IllPosedError as they do.
    """
    if method == "recursion":
        return recursion(process, spacing_m)
    if method == "embedding":
        return circulant_embedding(process, spacing_m, length_m)
    if method == "spectral":
        return spectral_representation(process, spacing_m, length_m)
    raise ParameterError(f"friction paths are drawn by one of {', '.join(METHODS)}, not {method!r}")
