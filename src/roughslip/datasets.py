"""Results of the package as xarray Datasets, for users; no stage imports this."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from roughslip import store
from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.probability import Estimate
from roughslip.store import Variable, dataset, with_interval
from roughslip.validation import gate

if TYPE_CHECKING:
    import xarray as xr


@gate
def read(path: Path | str) -> xr.Dataset:
    """A result of the study with named dimensions, units, titles and what made it.

    Raises StoreError where the file is missing, cut short or altered, with the command that makes it again.
    """
    return store.read(Path(path)).dataset()


@gate
def to_xarray(result: Any, grid: Grid | None = None) -> xr.Dataset:
    """Numbers and arrays of a result with named dimensions, units and titles.

    result : of this package, such as ContactSolution, Motion or WindowStatistics
    grid : the mesh of fields over (x, y), which then have coordinates x and y [m]; by default the result's own

    Statistics with an interval become three variables, `name`, `name_low` and `name_high`. Texts become attributes, and
    results within the result are left out. Raises ParameterError for what is no result of this package.
    """
    fields = dataclasses.fields(result) if dataclasses.is_dataclass(result) else ()
    described = [field for field in fields if field.metadata]
    if not described:
        raise ParameterError(f"to_xarray takes a result of this package, not {type(result).__name__}")
    variables: dict[str, Variable] = {}
    texts: dict[str, str] = {}
    for field in described:
        number, unit, title = getattr(result, field.name), field.metadata["unit"], field.metadata["title"]
        if isinstance(number, str):
            texts[field.name] = number
        elif isinstance(number, Estimate):
            columns = (number.value, number.low, number.high)
            variables |= with_interval(field.name, _dims(result, field, number.value), columns, unit, title)
        elif isinstance(number, Mapping):
            variables |= {name: Variable((name,), values, unit, title) for name, values in number.items()}
        elif isinstance(number, (bool, int, float, np.ndarray)):
            variables[field.name] = Variable(_dims(result, field, number), number, unit, title)
    grid = grid or getattr(result, "grid", None)
    if grid is not None:
        variables["x"] = Variable(("x",), grid.x(), "m", "position along the belt")
        variables["y"] = Variable(("y",), grid.y(), "m", "position across the belt")
    return dataset(variables, texts)


def _dims(result: Any, field: dataclasses.Field[Any], number: Any) -> tuple[str, ...]:
    """Names of the dimensions of a value; numbered where its field names another number of them.

    A dimension may be a field of the result that holds values of several parameters: it stands for all of these.
    """
    given = ((name, getattr(result, name, None)) for name in field.metadata["dims"])
    names = tuple(one for name, over in given for one in (over if isinstance(over, Mapping) else (name,)))
    count = np.ndim(number)
    return names if len(names) == count else tuple(f"{field.name}_{place}" for place in range(count))
