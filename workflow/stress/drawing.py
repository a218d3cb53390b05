"""What random problems are drawn with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

import numpy as np

T = TypeVar("T")


def power(generator: np.random.Generator, low: float, high: float) -> float:
    """Log-uniform between powers of ten."""
    return float(10 ** generator.uniform(low, high))


def one_of(
    generator: np.random.Generator, choices: Sequence[T], shares: Sequence[float] | np.ndarray | None = None
) -> T:
    """One of the choices, by their shares; each alike if not given."""
    return choices[int(generator.choice(len(choices), p=shares))]
