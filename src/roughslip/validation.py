"""What arrays given to the package must be."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np

from roughslip.errors import ParameterError


def reals(name: str, values: object) -> np.ndarray:
    """The values as an array of floats; ParameterError where they are no real numbers."""
    try:
        array = np.asarray(values)
    except ValueError as error:  # rows of unequal length
        raise ParameterError(f"{name} must be an array: {error}") from None
    if array.dtype.kind not in "fiu":
        raise ParameterError(f"{name} must be real numbers, not {array.dtype}")
    return array.astype(float, copy=False)


def finite(name: str, values: Any, dimensions: int | None = None) -> np.ndarray:
    """The values as doubles.

    values : an array of real numbers
    dimensions : number of its dimensions; any if not given

    Raises ParameterError where it is no such array, or a value is not finite.
    """
    if not isinstance(values, np.ndarray) or values.dtype.kind not in "fiu":
        raise ParameterError(f"{name} must be an array of real numbers, not {type(values).__name__}")
    if dimensions is not None and values.ndim != dimensions:
        raise ParameterError(f"{name} {values.shape} must have {dimensions} dimensions")
    if not np.isfinite(values).all():
        raise ParameterError(f"{name} must be finite")
    return np.asarray(values, dtype=np.float64)


def whole_at_least(name: str, value: Any, least: int) -> int:
    """The value as a whole number; ParameterError where it is none, or below the least."""
    try:
        number = operator.index(value)
    except TypeError as error:
        raise ParameterError(f"{name} must be a whole number, not {value!r}") from error
    if number < least:
        raise ParameterError(f"{name} must be at least {least}, not {number}")
    return number
