"""Records of friction as text: a header of `name [unit]`, then numbers; a time that falls begins a new record."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

import numpy as np

from roughslip.errors import InputError

# By column, what its units are in SI. rpm is of the track, whose radius the scene gives.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "position": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "m/min": 1 / 60, "rpm": np.pi / 30.0},
    "friction": {"1": 1.0, "-": 1.0, "%": 0.01, "": 1.0},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "load": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
}
MOST_SAMPLES, FEWEST_ROWS, SHOWN = 5_000_000, 100, 5
HEAD = 1000  # lines that are read before a run
UNEVEN = 0.2  # of a time step, by which steps of one record may differ
MOST_FRICTION = 10.0  # on average: more is a force
COMMENTS = "#%"
_HEADING = re.compile(r"\s*([A-Za-z_ ]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")


@dataclass(frozen=True, eq=False)
class Trace:
    """One record as measured, at even steps of time.

    time : (n,) [s]; speed : (n,) [m/s] of the belt, of either sign
    friction : (n,) [-] as the support of the specimen feels it; load : (n,) [N] or None
    position : (n,) [m] of the specimen along the belt's motion, or None
    """

    time: np.ndarray
    speed: np.ndarray
    friction: np.ndarray
    load: np.ndarray | None
    position: np.ndarray | None

    @property
    def interval(self) -> float:
        """[s] between samples."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))


def read_records(paths: Sequence[Path | str], radius_m: float | None = None) -> list[Trace]:
    """The records of text files. radius_m : [m] of the track, for a speed in rpm

    Columns are separated by commas, semicolons, tabs or blanks; all but the first allow decimal commas. Lines that
    begin with # or % are comments, but for a header among them.

    Raises InputError with a line for each mistake of all files: file, column, what is allowed.
    """
    traces: list[Trace] = []
    wrong: list[str] = []
    for path in paths:
        try:
            traces += _read(Path(path), radius_m)
        except InputError as error:
            wrong += error.lines
    if wrong:
        raise InputError(wrong)
    return traces


def check_head(path: Path, radius_m: float | None = None) -> None:
    """Raise InputError where the first lines of a record show a mistake: in its header, or in rows of numbers."""
    names, _, separator, rows = _headed(path, radius_m, HEAD)
    if len(rows) >= FEWEST_ROWS:
        _numbers(path, rows, separator, names)


def _headed(
    path: Path, radius_m: float | None, most: int | None = None
) -> tuple[list[str], np.ndarray, str | None, list[tuple[int, str]]]:
    """Names of the columns, factors to SI, separator, and the rows of numbers with their lines. most : lines to read"""
    try:
        with path.open(encoding="utf-8-sig") as file:
            lines = "".join(islice(file, most)).replace('"', "").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text; export a text file with a header of `name [unit]`") from error
    rows = [(number, line.strip(" ")) for number, line in enumerate(lines, 1) if line.strip()]
    of_numbers = [row for row in rows if row[1][0] not in COMMENTS]
    if not of_numbers:
        raise InputError(f"{path}: empty; a record has a header of `name [unit]` and rows of numbers")
    header = of_numbers[0][1]
    if re.match(r"[-+.\d]", header):  # the header is a comment
        before = [line for number, line in rows if number < of_numbers[0][0] and "[" in line]
        if not before:
            raise InputError(f"{path}: line {of_numbers[0][0]}: numbers without a header; write one of `name [unit]`")
        header = before[-1].lstrip(COMMENTS + " ")
    else:
        of_numbers = of_numbers[1:]
    separator = next((mark for mark in ";\t," if mark in header), None)
    cells = header.split(separator) if separator else re.findall(r"[^\[(]+(?:[\[(][^\])]*[\])]|$)", header)
    names, factors = _header(path, cells[:-1] if len(cells) > 1 and not cells[-1].strip() else cells, radius_m)
    return names, factors, separator, of_numbers


def _read(path: Path, radius_m: float | None) -> list[Trace]:
    names, factors, separator, rows = _headed(path, radius_m)
    values = _numbers(path, rows, separator, names) * factors
    columns = dict(zip(names, values.T, strict=True))
    if "friction" not in columns:
        if not (columns["load"] > 0.0).all():
            raise InputError(f"{path}: column load: not positive in each row; cut the rows without load")
        columns["friction"] = columns["force"] / columns["load"]
    _check_signs(path, columns)
    starts = np.flatnonzero(np.diff(columns["time"]) < 0.0) + 1
    if starts.size > 0.5 * len(values):
        raise InputError(f"{path}: column time: falls in {starts.size} of {len(values)} rows; sort the rows by time")
    parts = np.split(np.arange(len(values)), starts)
    return [
        _trace(path, number, {name: column[part] for name, column in columns.items()})
        for number, part in enumerate(parts, 1)
    ]


def _check_signs(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Speed and friction have one direction, and friction opposes it; where both are negative, they are turned."""
    speed, friction = columns["speed"], columns["friction"]
    if not np.any(speed):
        raise InputError(f"{path}: column speed: zero in each row; friction is measured in sliding")
    if np.any(speed < 0.0) and np.any(speed > 0.0):
        raise InputError(f"{path}: column speed: of both signs; give each direction as a file of its own")
    mean = float(np.mean(friction)) * (-1.0 if np.any(speed < 0.0) else 1.0)
    if mean < 0.0 and float(np.mean(friction)) > 0.0:  # of a drive that turns backwards, with friction as a size
        mean = -mean
    elif np.any(speed < 0.0):
        columns["friction"] = -friction
    if not 0.0 < mean < MOST_FRICTION:
        word = "force" if "force" in columns else "friction"
        raise InputError(
            f"{path}: column {word}: friction is {mean:.3g} on average; above 0 and below {MOST_FRICTION:g} are read: "
            "turn the sign, or see to the units of force and load"
        )


def _header(path: Path, cells: list[str], radius_m: float | None) -> tuple[list[str], np.ndarray]:
    """Names of the columns and the factors to SI."""
    wrong, names, factors = [], [], []
    for cell in cells:
        match = _HEADING.fullmatch(cell)
        name, unit = (match[1].lower(), (match[2] or "").replace("μ", "µ")) if match else (cell.strip()[:40], "")
        if name not in UNITS or name in names:
            wrong.append(
                f"{path}: column {name!r}: {'given twice' if name in names else 'not known'}; allowed are "
                f"{', '.join(UNITS)}, each as `name [unit]` in the first line"
            )
            continue
        if unit not in UNITS[name]:
            wrong.append(f"{path}: column {name}: unit {unit!r} is not allowed; {', '.join(filter(None, UNITS[name]))}")
            unit = next(iter(UNITS[name]))
        if unit == "rpm" and radius_m is None:
            wrong.append(f"{path}: column {name}: rpm needs the radius of the track, radius_m")
        names.append(name)
        factors.append(UNITS[name][unit] * ((radius_m or 1.0) if unit == "rpm" else 1.0))
    for name in ("time", "speed"):
        if name not in names and not any(line.startswith(f"{path}: column {name!r}") for line in wrong):
            wrong.append(f"{path}: column {name}: missing; give {name} [{next(iter(UNITS[name]))}]")
    if "friction" in names and "force" in names:
        wrong.append(f"{path}: column force: not together with friction; give friction, or force and load")
    elif "friction" not in names and not {"force", "load"} <= {*names}:
        wrong.append(f"{path}: column friction: missing; give friction [1], or force [N] and load [N]")
    if wrong:
        raise InputError(wrong)
    return names, np.array(factors)


def _numbers(path: Path, rows: list[tuple[int, str]], separator: str | None, names: list[str]) -> np.ndarray:
    """(n, columns) as written."""
    if not FEWEST_ROWS <= len(rows) <= MOST_SAMPLES:
        raise InputError(f"{path}: {len(rows)} rows of numbers; {FEWEST_ROWS} to {MOST_SAMPLES} are read")
    wrong, values = [], np.empty((len(rows), len(names)))
    for place, (number, line) in enumerate(rows):
        cells = line.split(separator)
        if separator != ",":
            cells = [cell.replace(",", ".") for cell in cells]
        if len(cells) == len(names) + 1 and not cells[-1].strip():
            cells.pop()
        if len(cells) != len(names):
            commas = "; decimal commas take semicolons, tabs or blanks between columns" if separator == "," else ""
            wrong.append(f"{path}: line {number}: {len(cells)} values for {len(names)} columns{commas}")
            continue
        for column, cell in enumerate(cells):
            try:
                values[place, column] = float(cell)
            except ValueError:
                values[place, column] = np.nan
            if not np.isfinite(values[place, column]):
                wrong.append(
                    f"{path}: line {number}, column {names[column]}: {cell.strip()[:30]!r} is no finite number; cut "
                    "the row, or give what follows a gap as a file of its own"
                )
    if wrong:
        more = [f"{path}: and {len(wrong) - SHOWN} more such lines"] if len(wrong) > SHOWN else []
        raise InputError(wrong[:SHOWN] + more)
    return values


def _trace(path: Path, number: int, columns: dict[str, np.ndarray]) -> Trace:
    time = columns["time"]
    steps = np.diff(time)
    if time.size < FEWEST_ROWS:
        raise InputError(
            f"{path}: column time: record {number}, where time falls, has {time.size} rows; at least {FEWEST_ROWS}"
        )
    step = float(np.median(steps))
    uneven = np.abs(steps - step) > UNEVEN * step
    if step <= 0.0 or uneven.any():
        at = f", first at {time[int(np.argmax(uneven))]:.6g} s" if step > 0.0 else ""
        raise InputError(
            f"{path}: column time: steps from {steps.min():.3g} to {steps.max():.3g} s in record {number}{at}; even "
            "steps are read: resample, write time with more digits, or give what follows a gap as a file of its own"
        )
    return Trace(time, columns["speed"], columns["friction"], columns.get("load"), columns.get("position"))
