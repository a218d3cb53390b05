"""Bad values of every kind, and calls of a function that each have one bad argument."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

NAN, INFINITY = math.nan, math.inf
NOT_FINITE: dict[str, Any] = {"nan": NAN, "infinite": INFINITY, "text": "high"}
NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, **NOT_FINITE}
NEGATIVE = {"negative": -1.0, "nan": NAN, "infinite": INFINITY}
NOT_WHOLE: dict[str, Any] = {"half": 2.5, "nan": NAN, "text": "four"}
NOT_A_DEGREE = {"negative": -1, **NOT_WHOLE}
NOT_A_COUNT = {"zero": 0, **NOT_A_DEGREE}
NOT_A_SHARE: dict[str, Any] = {"zero": 0.0, "negative": -0.1, "above-one": 1.1, "nan": NAN, "text": "half"}
UNKNOWN = {"unknown": "unknown"}

Calls = dict[str, Callable[[], object]]


def with_value(good: np.ndarray, value: object) -> np.ndarray:
    """Return a copy of an array with one bad value."""
    bad = good.copy()
    bad.flat[max(good.size - 4, 0)] = value
    return bad


def not_an_array(good: np.ndarray) -> dict[str, Any]:
    """Return values that are no array of real numbers, by name."""
    return {
        "nan": with_value(good, NAN),
        "infinite": with_value(good, INFINITY),
        "text": np.full(good.shape, "high"),
        "a-word": "high",
        "none": None,
        "complex": good + 1e-9j,
        "objects": np.full(good.shape, None),
    }


def not_a_table(good: np.ndarray) -> dict[str, Any]:
    """Return values that are no array of real numbers with the dimensions of a good one, by name."""
    ragged = [[1.0, 2.0], [3.0]]
    return not_an_array(good) | {"a-number": 1.0, "of-one-dimension-more": good[..., None], "ragged": ragged}


def spoilt(function: Callable[..., object], **bad: Mapping[str, Any]) -> Calls:
    """Return calls of a function, each with one bad argument, by name.

    function : a partial that holds all arguments of a good call
    bad : by parameter, bad values by their names
    """
    name = getattr(getattr(function, "func", function), "__qualname__", "call")
    return {
        f"function={name} argument={parameter} value={kind}": partial(function, **{parameter: value})
        for parameter, values in bad.items()
        for kind, value in values.items()
    }


def joined(*parts: Calls) -> Calls:
    """Return all calls. Raises ValueError if two have the same name."""
    calls = {name: call for part in parts for name, call in part.items()}
    if len(calls) != sum(map(len, parts)):
        raise ValueError("two bad inputs have the same name")
    return calls
