"""Results on disk: netCDF files that carry what made them, written atomically, checked when read.

The only module that uses netCDF and xarray. Arrays are written and read as numpy arrays; for further work a result is
also available as an xarray Dataset. Stages do not use that, because importing xarray takes half of their start.
"""

import csv
import dataclasses
import hashlib
import json
import platform
import shlex
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import netCDF4
import numpy as np

from roughslip.atomic_write import replacing
from roughslip.errors import StoreError
from roughslip.probability.estimate import Estimate, columns_of

if TYPE_CHECKING:
    import xarray as xr

# By dimension, the variable that holds its coordinates: they are also stored under the name of the dimension, so that
# xarray selects by them: `sel(damping=0.1)`.
COORDINATES = {
    "damping": "damping_ratio",
    "level": "percentile",
    "penetration": "fit_percentile",
}
PACKAGES = ("numpy", "scipy", "numba", "xarray", "netCDF4")


class Variable(NamedTuple):
    """One array of a result: the names of its dimensions, values, units ("1" where none) and what it is."""

    dimensions: tuple[str, ...]
    values: Any
    units: str
    long_name: str


def with_interval(
    name: str, dimensions: tuple[str, ...], columns: Iterable[Any], units: str, title: str
) -> dict[str, Variable]:
    """Three variables, `name`, `name_low` and `name_high`, from columns : value and ends of its 95 % interval."""
    ends = {
        "": title,
        "_low": f"{title}, lower end of its 95 % interval",
        "_high": f"{title}, upper end of its 95 % interval",
    }
    return {
        name + suffix: Variable(dimensions, values, units, label)
        for (suffix, label), values in zip(ends.items(), columns, strict=True)
    }


def variables_of(result: Any, prefix: str = "", leave_out: Collection[str] = ()) -> dict[str, Variable]:
    """The numbers, arrays and texts of a result of the library, as its fields describe them.

    prefix : of the names of the variables; leave_out : names of fields

    An estimate becomes three variables, as by `with_interval`. Results within the result are left out.
    """
    variables: dict[str, Variable] = {}
    for field in dataclasses.fields(result):
        value, name = getattr(result, field.name), prefix + field.name
        if not field.metadata or field.name in leave_out:
            continue
        unit, title = field.metadata["unit"], field.metadata["title"]
        if isinstance(value, Estimate):
            dimensions = _dimensions(result, field, value.value)
            variables |= with_interval(name, dimensions, columns_of(value), unit, title)
        elif isinstance(value, Mapping):
            arrays = {key: values for key, values in value.items() if isinstance(values, np.ndarray)}
            variables |= {key: Variable((key,), values, unit, title) for key, values in arrays.items()}
        elif isinstance(value, (bool, int, float, str, np.ndarray, np.generic)):
            variables[name] = Variable(_dimensions(result, field, value), value, unit, title)
    return variables


def _dimensions(result: Any, field: dataclasses.Field[Any], value: Any) -> tuple[str, ...]:
    """Names of the dimensions of a value; numbered where its field names another number of them.

    A dimension may be a field of the result that holds values of several parameters: it stands for all of these.
    """
    given = ((name, getattr(result, name, None)) for name in field.metadata["dims"])
    names = tuple(one for name, over in given for one in (over if isinstance(over, Mapping) else (name,)))
    count = np.ndim(value)
    return names if len(names) == count else tuple(f"{field.name}_{place}" for place in range(count))


@dataclass(frozen=True)
class Key:
    """What a stage is made from.

    configuration : its slice of the scene
    code : hash of its code and of the lock file
    """

    configuration: dict[str, Any]
    code: str


@dataclass(frozen=True)
class Result(Mapping[str, np.ndarray]):
    """The arrays of a result file by name, and its attributes."""

    path: Path
    variables: dict[str, Variable]
    attributes: dict[str, Any]

    def __getitem__(self, name: str) -> np.ndarray:
        return self.variable(name).values

    def variable(self, name: str) -> Variable:
        """An array with its dimensions, units and title. Raises StoreError where the file does not hold it."""
        if name not in self.variables:
            raise StoreError(f"{self.path}: holds no variable {name!r}; {rebuild(self.path)}")
        return self.variables[name]

    def dataset(self) -> "xr.Dataset":
        """The result with named dimensions, for work of one's own."""
        return dataset(self.variables, self.attributes)

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)


def dataset(variables: Mapping[str, Variable], attributes: Mapping[str, Any]) -> "xr.Dataset":
    """Variables and attributes as an xarray Dataset."""
    import xarray as xr

    described = {
        name: xr.Variable(v.dimensions, v.values, {"units": v.units, "long_name": v.long_name})
        for name, v in variables.items()
    }
    return xr.Dataset(described, attrs=attributes)


def read_key(path: Path) -> Key:
    """The key file of a stage. Raises StoreError where it is missing or damaged."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        return Key(content["configuration"], content["code"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise StoreError(f"{path}: no readable key file ({error}); run snakemake again") from error


def write(
    path: Path, variables: Mapping[str, Variable], key: Key, attributes: Mapping[str, str | int] | None = None
) -> None:
    """Write arrays with units, the configuration, code hash, package versions, seed and a checksum of all of it.

    Dimensions that COORDINATES names get their coordinates.

    The same arrays and key give the same bytes. Raises StoreError where a floating-point array holds an infinity, or
    where the file cannot be written. NaN marks a value that does not exist and is allowed.
    """
    dimensions = {dimension for variable in variables.values() for dimension in variable.dimensions}
    of = {one: variables[name] for one, name in COORDINATES.items() if one in dimensions and name in variables}
    whole = {**of, **variables}
    stored = {name: _storable(path, name, variable) for name, variable in sorted(whole.items())}
    described = {
        **dict(attributes or {}),
        "configuration": json.dumps(key.configuration, sort_keys=True),
        "code_hash": key.code,
        "seed": str(key.configuration.get("seed", "none used")),
        "versions": json.dumps(versions(), sort_keys=True),
    }
    described["checksum"] = _checksum(stored, described)
    try:
        with replacing(path) as temporary, netCDF4.Dataset(temporary, "w") as file:
            file.setncatts(described)
            _fill(file, stored)
    except (OSError, RuntimeError) as error:  # netCDF says of a full disk no more than that HDF failed
        raise StoreError(f"{path}: cannot be written ({error})") from error


def read(path: Path | str) -> Result:
    """Read a result whole. Raises StoreError where it is missing, truncated or altered, with the command to rebuild."""
    path = Path(path)
    if not path.is_file():
        raise StoreError(f"{path}: missing; {rebuild(path)}")
    try:
        with netCDF4.Dataset(path) as file:
            file.set_auto_maskandscale(False)
            variables = {
                name: Variable(one.dimensions, _shortest(np.asarray(one[...])), one.units, one.long_name)
                for name, one in file.variables.items()
            }
            attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    except (OSError, ValueError, RuntimeError, AttributeError, KeyError, MemoryError) as error:
        raise StoreError(f"{path}: truncated or not a result ({error}); {rebuild(path)}") from error
    if attributes.pop("checksum", None) != _checksum(variables, attributes):
        raise StoreError(f"{path}: its contents differ from its checksum; {rebuild(path)}")
    return Result(path, variables, attributes)


def read_all(paths: list[Path]) -> list[Result]:
    """Batches in the order of their first sample."""
    return sorted((read(path) for path in paths), key=lambda result: int(result.attributes["first"]))


def join(batches: list[Result], name: str) -> np.ndarray:
    """One array of all batches along their first axis."""
    return batches[0][name] if len(batches) == 1 else np.concatenate([batch[name] for batch in batches])


def write_text(path: Path, text: str) -> None:
    """Write a text file atomically."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def write_json(path: Path, content: Any) -> None:
    """Write JSON atomically, in a form that people and version control can read. NaN is refused."""
    write_text(path, json.dumps(content, indent=1, allow_nan=False) + "\n")


def read_json(path: Path) -> Any:
    """Read JSON. Raises StoreError where it is missing or damaged."""
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StoreError(f"{path}: missing or not JSON ({error}); {rebuild(path)}") from error


def table_text(head: Sequence[str], columns: Mapping[str, Variable]) -> str:
    """Comma-separated columns (rows,), by heading, below lines of comment.

    head : first lines of comment; then come unit and meaning of each column, but for the ends of intervals
    """
    plain = (name for name in columns if not name.removesuffix("_m").endswith(("_low", "_high")))
    lines = [*head, *(f"{name} [{columns[name].units}]: {columns[name].long_name}" for name in plain)]
    rows = zip(*(variable.values for variable in columns.values()), strict=True)
    table = [columns, *([f"{value:.6g}" for value in row] for row in rows)]
    return "\n".join([*(f"# {line}" for line in lines), *(",".join(row) for row in table)]) + "\n"


def table_rows(text: str) -> list[dict[str, str]]:
    """Rows of a table with commas, whose lines of comment begin with #."""
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a number can depend on."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def _storable(path: Path, name: str, variable: Variable) -> Variable:
    values = np.asarray(variable.values)
    if values.dtype.kind == "f" and np.any(np.isinf(values)):
        raise StoreError(f"{path}: {name} holds an infinity; results must be finite")
    return variable._replace(values=values.astype(np.int8) if values.dtype.kind == "b" else _shortest(values))


def _shortest(values: np.ndarray) -> np.ndarray:
    """Text in the shortest type that holds it, numbers unchanged."""
    return values.astype(object).astype(str) if values.dtype.kind in "UO" else values


def _fill(file: netCDF4.Dataset, variables: Mapping[str, Variable]) -> None:
    """Dimensions come first: netCDF fails if one is added after an array with its name."""
    for name, variable in variables.items():
        for dimension, size in zip(variable.dimensions, variable.values.shape, strict=True):
            if dimension not in file.dimensions:
                file.createDimension(dimension, size)
            there = file.dimensions[dimension].size
            if there != size:
                raise ValueError(f"{name}: dimension {dimension} has {there} places, not {size}")
    for name, (dimensions, values, units, long_name) in variables.items():
        text = values.dtype.kind == "U"
        target = file.createVariable(
            name, str if text else values.dtype, dimensions, fill_value=None if text else False
        )
        target.setncatts({"units": units, "long_name": long_name})
        target[...] = values.astype(object) if text else values


def _checksum(variables: Mapping[str, Variable], attributes: Mapping[Any, Any]) -> str:
    """Of everything that `read` returns: attributes, and arrays with their labels."""
    digest = hashlib.sha256()
    for name in sorted(attributes):
        digest.update(f"{name}\0{attributes[name]}\0".encode())
    for name in sorted(variables):
        variable = variables[name]
        values = np.ascontiguousarray(variable.values)
        labels = name, values.dtype.str, str(values.shape), *variable.dimensions, variable.units, variable.long_name
        digest.update("\0".join(labels).encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def rebuild(path: Path) -> str:
    """What to do about a result that is missing or damaged."""
    name = shlex.quote(str(path))
    return f"rebuild it with: rm -f {name} && snakemake -j2 {name}"
