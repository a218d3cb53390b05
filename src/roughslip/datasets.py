"""Results of the package as xarray Datasets, for users; no stage imports this."""

from __future__ import annotations

import re
from dataclasses import fields
from typing import TYPE_CHECKING, Any

import numpy as np

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.probability import Estimate
from roughslip.store import Variable, dataset, with_interval
from roughslip.validation import gate

if TYPE_CHECKING:
    import xarray as xr

# A field in the docstring of a dataclass: its names, its shape if it is an array, its unit if it has one, what it is.
_FIELD = re.compile(r"^ +(\w+(?:, \w+)*) : (?:\(([^)]*)\) ?)?(?:\[([^\]]*)\] ?)?(.*)$", re.MULTILINE)


@gate
def to_xarray(result: Any, grid: Grid | None = None) -> xr.Dataset:
    """Numbers and arrays of a result with named dimensions, units and titles, all from the docstring of its class.

    result : a dataclass of this package, such as ContactSolution, Motion or WindowStatistics
    grid : the mesh of fields over (nx, ny), which then have coordinates x and y [m]; by default the result's own

    Statistics with an interval become three variables, `name`, `name_low` and `name_high`. Texts become attributes, and
    results within the result are left out. Raises ParameterError for what is no dataclass with described fields.
    """
    described = {
        name: (shape, "1" if unit in ("", "-") else unit, title)
        for names, shape, unit, title in _FIELD.findall(type(result).__doc__ or "")
        for name in names.split(", ")
    }
    if not (hasattr(result, "__dataclass_fields__") and described):
        raise ParameterError(f"to_xarray takes a result of this package, not {type(result).__name__}")
    variables: dict[str, Variable] = {}
    texts: dict[str, str] = {}
    for name, value in ((field.name, getattr(result, field.name)) for field in fields(result)):
        shape, unit, title = described.get(name, ("", "1", name))
        if isinstance(value, str):
            texts[name] = value
        elif isinstance(value, Estimate):
            names = _dimensions(name, shape, value.value)
            variables |= with_interval(name, names, (value.value, value.low, value.high), unit, title)
        elif isinstance(value, (bool, int, float, np.ndarray)):
            variables[name] = Variable(_dimensions(name, shape, value), value, unit, title)
    grid = grid or getattr(result, "grid", None)
    if grid is not None:
        variables["x"] = Variable(("x",), grid.x(), "m", "position along the belt")
        variables["y"] = Variable(("y",), grid.y(), "m", "position across the belt")
    return dataset(variables, texts)


def _dimensions(name: str, shape: str, value: Any) -> tuple[str, ...]:
    """Names of the dimensions of a value, from a shape such as `nx, ny`; numbered where that does not name them."""
    names = tuple({"nx": "x", "ny": "y"}.get(part, part) for part in shape.replace(" ", "").split(",") if part)
    if len(names) == len(set(names)) == np.ndim(value) and all(part.isidentifier() for part in names):
        return names
    return tuple(f"{name}_{number}" for number in range(np.ndim(value)))
