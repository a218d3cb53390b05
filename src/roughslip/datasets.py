"""Results of the package as xarray Datasets, for users; no stage imports this."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roughslip import store
from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.store import Variable, dataset
from roughslip.validation import gate

if TYPE_CHECKING:
    import xarray as xr


@gate
def read(path: Path | str) -> "xr.Dataset":
    """A result of the study with named dimensions, units, titles and what made it.

    Raises StoreError where the file is missing, cut short or altered, with the command that makes it again.
    """
    return store.read(Path(path)).dataset()


@gate
def to_xarray(result: Any, grid: Grid | None = None) -> "xr.Dataset":
    """Numbers and arrays of a result with named dimensions, units and titles.

    result : of this package, such as ContactSolution, Motion or WindowStatistics
    grid : the mesh of fields over (x, y), which then have coordinates x and y [m]; by default the result's own

    Statistics with an interval become three variables, `name`, `name_low` and `name_high`. Texts become attributes, and
    results within the result are left out. Raises ParameterError for what is no result of this package.
    """
    if not dataclasses.is_dataclass(result) or not any(field.metadata for field in dataclasses.fields(result)):
        raise ParameterError(f"to_xarray takes a result of this package, not {type(result).__name__}")
    variables = store.variables_of(result)
    texts = {name: variable.values for name, variable in variables.items() if isinstance(variable.values, str)}
    variables = {name: variable for name, variable in variables.items() if name not in texts}
    grid = grid or getattr(result, "grid", None)
    if grid is not None:
        variables["x"] = Variable(("x",), grid.x(), "m", "position along the belt")
        variables["y"] = Variable(("y",), grid.y(), "m", "position across the belt")
    return dataset(variables, texts)
