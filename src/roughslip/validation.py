"""What arrays given to the package must be."""

from __future__ import annotations

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
