"""Records of friction as text: a header of `name [unit]`, then numbers; a time that falls begins a new record."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roughslip.errors import InputError

# By column, what its units are in SI. rpm is of the track, whose radius the scene gives.
UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "position": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "rpm": np.pi / 30.0},
    "friction": {"1": 1.0, "-": 1.0, "%": 0.01},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "load": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
}
MOST_SAMPLES, FEWEST_ROWS, SHOWN = 5_000_000, 100, 5
UNEVEN = 0.2  # of a time step, by which steps of one record may differ
_HEADING = re.compile(r"\s*([A-Za-z_ ]+?)\s*\[\s*([^\]]*?)\s*\]\s*")


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


def read_record(path: Path | str, radius_m: float | None = None) -> list[Trace]:
    """The records of a text file. radius_m : [m] of the track, for a speed in rpm

    Raises InputError with a line for each mistake: file, column, what is allowed.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8-sig").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text; export a text file with a header of `name [unit]`") from error
    rows = [(number, line) for number, line in enumerate(lines, 1) if line.strip() and not line.startswith("#")]
    if not rows:
        raise InputError(f"{path}: empty; a record has a header of `name [unit]` and rows of numbers")
    separator = next((mark for mark in ";\t," if mark in rows[0][1]), ",")
    names, factors = _header(path, rows[0][1].split(separator), radius_m)
    values = _numbers(path, rows[1:], separator, list(names)) * factors
    columns = dict(zip(names, values.T, strict=True))
    if "friction" not in columns:
        if not (columns["load"] > 0.0).all():
            raise InputError(f"{path}: column load: not positive in each row; cut the rows without load")
        columns["friction"] = columns["force"] / columns["load"]
    starts = np.flatnonzero(np.diff(columns["time"]) < 0.0) + 1
    parts = np.split(np.arange(len(values)), starts)
    return [
        _trace(path, number, {name: column[part] for name, column in columns.items()})
        for number, part in enumerate(parts, 1)
    ]


def _header(path: Path, cells: list[str], radius_m: float | None) -> tuple[list[str], np.ndarray]:
    """Names of the columns and the factors to SI."""
    wrong, names, factors = [], [], []
    for cell in cells:
        match = _HEADING.fullmatch(cell)
        name, unit = (match[1].strip().lower(), match[2]) if match else (cell.strip()[:40], None)
        if name not in UNITS or name in names:
            wrong.append(
                f"{path}: column {name!r}: {'given twice' if name in names else 'not known'}; allowed are "
                f"{', '.join(UNITS)}, each as `name [unit]` in the first line"
            )
            continue
        if unit not in UNITS[name]:
            wrong.append(f"{path}: column {name}: unit {unit or ''!r} is not allowed; {', '.join(UNITS[name])}")
            unit = next(iter(UNITS[name]))
        if unit == "rpm" and radius_m is None:
            wrong.append(
                f"{path}: column {name}: rpm needs the radius of the track; scene key: friction.record.radius_m"
            )
        names.append(name)
        factors.append(UNITS[name][str(unit)] * ((radius_m or 1.0) if unit == "rpm" else 1.0))
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


def _numbers(path: Path, rows: list[tuple[int, str]], separator: str, names: list[str]) -> np.ndarray:
    """(n, columns) as written."""
    if not FEWEST_ROWS <= len(rows) <= MOST_SAMPLES:
        raise InputError(f"{path}: {len(rows)} rows of numbers; {FEWEST_ROWS} to {MOST_SAMPLES} are read")
    wrong, values = [], np.empty((len(rows), len(names)))
    for place, (number, line) in enumerate(rows):
        cells = line.split(separator)
        if separator == ";":
            cells = [cell.replace(",", ".") for cell in cells]
        if len(cells) != len(names):
            wrong.append(f"{path}: line {number}: {len(cells)} values for {len(names)} columns")
            continue
        for column, cell in enumerate(cells):
            try:
                values[place, column] = float(cell)
            except ValueError:
                values[place, column] = np.nan
            if not np.isfinite(values[place, column]):
                wrong.append(
                    f"{path}: line {number}, column {names[column]}: {cell.strip()[:30]!r} is no finite number"
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
    if step <= 0.0 or np.max(np.abs(steps - step)) > UNEVEN * step:
        raise InputError(
            f"{path}: column time: steps from {steps.min():.3g} to {steps.max():.3g} s in record {number}; "
            "even steps are read: resample, or let time fall where a new record begins"
        )
    return Trace(time, columns["speed"], columns["friction"], columns.get("load"), columns.get("position"))
