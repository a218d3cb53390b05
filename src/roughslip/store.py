"""Results on disk: netCDF files that carry what made them, written atomically, checked when read.

The only module that knows xarray and netCDF. Arrays go in and come out as numpy arrays.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
import shlex
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from roughslip.errors import StoreError

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


@dataclass(frozen=True)
class Key:
    """What a stage is made from: its slice of the scene, and the hash of its code and of the lock file."""

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
            raise StoreError(f"{self.path}: holds no variable {name!r}; {_rebuild(self.path)}")
        return self.variables[name]

    def __contains__(self, name: object) -> bool:
        return name in self.variables

    def __iter__(self) -> Iterator[str]:
        return iter(self.variables)

    def __len__(self) -> int:
        return len(self.variables)


def read_key(path: Path) -> Key:
    """The key file of a stage. Raises StoreError where it is missing or damaged."""
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
        return Key(content["configuration"], content["code"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        scene = Path(path).parents[1].name
        raise StoreError(f"{path}: no readable key file ({error}); make it with: snakemake -n {scene}") from error


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`, which takes its place when the block ends well; else nothing changes."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def write(
    path: Path, variables: Mapping[str, Variable], key: Key, attributes: Mapping[str, str | int] | None = None
) -> None:
    """Write arrays with units, the configuration, code hash, package versions, seed and a checksum of all of it.

    The same arrays and key give the same bytes. Raises StoreError where a floating-point array holds an infinity, or
    where the file cannot be written. NaN marks a value that does not exist and is allowed.
    """
    data = {}
    for name, variable in sorted(variables.items()):
        values = np.asarray(variable.values)
        if values.dtype.kind == "f" and np.any(np.isinf(values)):
            raise StoreError(f"{path}: {name} holds an infinity; results must be finite")
        labels = {"units": variable.units, "long_name": variable.long_name}
        data[name] = xr.Variable(variable.dimensions, values, labels)
    dataset = xr.Dataset(data)
    dataset.attrs = {
        **dict(attributes or {}),
        "configuration": json.dumps(key.configuration, sort_keys=True),
        "code_hash": key.code,
        "seed": str(key.configuration.get("seed", "none used")),
        "versions": json.dumps(versions(), sort_keys=True),
    }
    stored = {name: _variable(variable) for name, variable in data.items()}
    dataset.attrs["checksum"] = _checksum(stored, dataset.attrs)
    encoding = {name: {"_FillValue": None} for name in data}
    try:
        with replacing(path) as temporary:
            dataset.to_netcdf(temporary, engine="netcdf4", encoding=encoding)
    except OSError as error:
        raise StoreError(f"{path}: cannot be written ({error})") from error


def read(path: Path) -> Result:
    """Read a result whole. Raises StoreError where it is missing, truncated or altered, with the command to rebuild."""
    path = Path(path)
    if not path.is_file():
        raise StoreError(f"{path}: missing; {_rebuild(path)}")
    try:
        with xr.open_dataset(path, engine="netcdf4", decode_cf=False) as dataset:
            variables = {str(name): _variable(variable) for name, variable in dataset.variables.items()}
            attributes = {str(name): value for name, value in dataset.attrs.items()}
    except (OSError, ValueError, RuntimeError, KeyError) as error:
        raise StoreError(f"{path}: truncated or not a result ({error}); {_rebuild(path)}") from error
    if attributes.pop("checksum", None) != _checksum(variables, attributes):
        raise StoreError(f"{path}: its contents differ from its checksum; {_rebuild(path)}")
    return Result(path, variables, attributes)


def read_all(paths: list[Path], *, sort_by: str = "first") -> list[Result]:
    """Batches in the order of their first sample, whatever the order of their names."""
    return sorted((read(path) for path in paths), key=lambda result: int(result.attributes[sort_by]))


def join(batches: list[Result], name: str) -> np.ndarray:
    """One array of all batches along their first axis."""
    return np.concatenate([batch[name] for batch in batches])


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
        raise StoreError(f"{path}: missing or not JSON ({error}); {_rebuild(path)}") from error


def versions() -> dict[str, str]:
    """Versions of Python and of the packages that a number can depend on."""
    return {"python": platform.python_version(), **{name: version(name) for name in PACKAGES}}


def _variable(stored: xr.Variable) -> Variable:
    dimensions = tuple(str(name) for name in stored.dims)
    return Variable(dimensions, np.asarray(stored.values), stored.attrs["units"], stored.attrs["long_name"])


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
        digest.update(values.tobytes() if values.dtype.kind != "O" else "\0".join(map(str, values.ravel())).encode())
    return digest.hexdigest()


def _rebuild(path: Path) -> str:
    name = shlex.quote(str(path))
    return f"rebuild it with: rm -f {name} && snakemake -j2 {name}"
