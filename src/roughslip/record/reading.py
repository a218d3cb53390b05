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
    "displacement": {"m": 1.0, "mm": 1e-3, "um": 1e-6, "µm": 1e-6},
    "speed": {"m/s": 1.0, "mm/s": 1e-3, "um/s": 1e-6, "µm/s": 1e-6, "m/min": 1 / 60, "rpm": np.pi / 30.0},
    "friction": {"1": 1.0, "-": 1.0, "%": 0.01, "": 1.0},
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
    "load": {"N": 1.0, "mN": 1e-3, "kN": 1e3},
}
MOST_SAMPLES, FEWEST_ROWS, FEWEST_IN_RECORD, SHOWN = 5_000_000, 100, 20, 5  # in one of several records
HEAD = 1000  # lines that are read before a run
UNEVEN = 0.2  # of a time step, by which steps of one record may differ
MOST_FRICTION = 10.0  # on average: more is a force
BOTH_SIGNS = 0.05, 0.5  # share of rows with negative friction, and its median size over that of the others
PATH = 0.5  # of the way of the belt: a position that goes so far is the path slid
COMMENTS, NUMBER = "#%", r"[-+.\d]"
_HEADING = re.compile(r"\s*([A-Za-z_ ]+?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")


@dataclass(frozen=True, eq=False)
class Trace:
    """One record as measured, at even steps of time.

    time : (n,) [s]; speed : (n,) [m/s] of the belt, of either sign
    friction : (n,) [-] as the support of the specimen feels it; load : (n,) [N] or None
    position : (n,) [m] of the specimen along the belt's motion, or None
    notes : what of the file is not used
    """

    time: np.ndarray
    speed: np.ndarray
    friction: np.ndarray
    load: np.ndarray | None
    position: np.ndarray | None
    notes: tuple[str, ...] = ()

    @property
    def interval(self) -> float:
        """[s] between samples."""
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))


def read_records(paths: Sequence[Path | str], radius_m: float | None = None) -> list[Trace]:
    """The records of text files. radius_m : [m] of the track, for a speed in rpm

    Columns are separated by commas, semicolons, tabs or blanks; all but the first allow decimal commas. Lines that
    begin with # or % are comments, but for a header among them. Lines before the header and other columns are not
    read, and a note of the trace says so.

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


def columns_of(path: Path, radius_m: float | None, most: int | None = None) -> tuple[dict[str, np.ndarray], list[str]]:
    """Columns in SI below the header, the line that names most, and notes; raises InputError. most : lines to read"""
    try:
        with path.open(encoding="utf-8-sig") as file:
            lines = "".join(islice(file, most)).replace('"', "").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not UTF-8 text; export a text file with a header of `name [unit]`") from error
    rows = [(number, line.strip(" ")) for number, line in enumerate(lines, 1) if line.strip()]
    known = [len({name for name, _ in _cells(line)[1]} & {*UNITS}) for _, line in rows[:HEAD]]
    if not any(known):
        raise InputError(f"{path}: no header of `name [unit]` above numbers; names are {', '.join(UNITS)}")
    best = max(range(len(known)), key=lambda place: (known[place], place))
    before, after = ([row for row in some if row[1][0] not in COMMENTS] for some in (rows[:best], rows[best + 1 :]))
    separator, cells = _cells(rows[best][1])
    if after and not any(unit for _, unit in cells) and not re.match(NUMBER, after[0][1]):  # a line of units
        units = [unit.strip(" []()").replace("μ", "µ") for unit in after.pop(0)[1].split(separator)]
        cells = [(name, unit) for (name, _), unit in zip(cells, [*units, *[""] * len(cells)], strict=False)]
    columns, others = _header(path, cells, radius_m)
    notes = [f"{path}: the {len(before)} lines before the header are not read"] * bool(before)
    notes += [f"{path}: columns {others}"] * bool(others)
    if most and len(after) < FEWEST_ROWS:
        return {}, notes
    places = {name: place for name, (place, _) in columns.items()}
    values = _numbers(path, after, separator, len(cells), places).T
    return {name: values[i] * factor for i, (name, (_, factor)) in enumerate(columns.items())}, notes


def _cells(line: str) -> tuple[str | None, list[tuple[str, str]]]:
    """The separator of a header, and the names in it with their units."""
    line = line.lstrip(COMMENTS + " ")
    separator = next((mark for mark in ";\t," if mark in line), None)
    cells = line.split(separator) if separator else re.findall(r"[^\[(]+(?:[\[(][^\])]*[\])]|$)", line)
    found = [_HEADING.fullmatch(cell) or cell.strip()[:40] for cell in cells[: -1 if not cells[-1].strip() else None]]
    return separator, [
        (one, "") if isinstance(one, str) else (one[1].lower(), (one[2] or "").replace("μ", "µ")) for one in found
    ]


def _read(path: Path, radius_m: float | None) -> list[Trace]:
    columns, notes = columns_of(path, radius_m)
    n = columns["time"].size
    if "friction" not in columns:
        if not (columns["load"] > 0.0).all():
            raise InputError(f"{path}: column load: not positive in each row; cut the rows without load")
        columns["friction"] = columns["force"] / columns["load"]
    _check_signs(path, columns)
    starts = np.flatnonzero(np.diff(columns["time"]) < 0.0) + 1
    if starts.size > 0.5 * n:
        raise InputError(f"{path}: column time: falls in {starts.size} of {n} rows; sort the rows by time")
    parts = np.split(np.arange(n), starts)
    long = [part for part in parts if part.size >= FEWEST_IN_RECORD]
    text = f"{path}: column time: {len(parts) - len(long)} of {len(parts)} records, where it falls, have fewer than"
    short = [f"{text} {FEWEST_IN_RECORD} rows and are not used"] * (len(long) < len(parts))
    if not long:
        raise InputError(short)
    each = [{name: column[part] for name, column in columns.items()} for part in long]
    return [_trace(path, number, one, (*notes, *short)) for number, one in enumerate(each, 1)]


def _check_signs(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Speed and friction have one direction, and friction opposes it; where both are negative, they are turned."""
    speed, friction = columns["speed"], columns["friction"]
    if not np.any(speed):
        raise InputError(f"{path}: column speed: zero in each row; friction is measured in sliding")
    if np.any(speed < 0.0) and np.any(speed > 0.0):
        raise InputError(f"{path}: column speed: of both signs; give each direction as a file of its own")
    word = "force" if "force" in columns else "friction"
    against, (least, ratio) = friction < 0.0, BOTH_SIGNS
    if least < np.mean(against) < 1.0 - least:
        sizes = np.median(-friction[against]), np.median(friction[~against])
        if min(sizes) > ratio * max(sizes):
            text = f"of both signs, negative in {np.mean(against):.0%} of the rows, at one sign of speed"
            raise InputError(f"{path}: column {word}: {text}: motion to and fro; give each direction as a file")
    if np.any(speed < 0.0) and np.mean(friction) < 0.0:  # else a drive turns backwards, with friction as a size
        columns["friction"] = friction = -friction
    mean = float(np.mean(friction))
    if not 0.0 < mean < MOST_FRICTION:
        text = f"friction is {mean:.3g} on average; above 0 and below {MOST_FRICTION:g} are read"
        raise InputError(f"{path}: column {word}: {text}: turn the sign, or see to the units of force and load")


def _header(
    path: Path, cells: list[tuple[str, str]], radius_m: float | None
) -> tuple[dict[str, tuple[int, float]], str]:
    """By column that is read its place and the factor to SI, and a text with all others."""
    wrong, columns = [], dict[str, tuple[int, float]]()
    for place, (name, unit) in enumerate(cells):
        if name not in UNITS:
            continue
        if name in columns:
            wrong.append(f"{path}: column {name}: given twice")
        elif unit not in UNITS[name]:
            wrong.append(f"{path}: column {name}: unit {unit!r} is not allowed; {', '.join(filter(None, UNITS[name]))}")
        elif unit == "rpm" and radius_m is None:
            wrong.append(f"{path}: column {name}: rpm needs the radius of the track, radius_m")
        columns[name] = place, UNITS[name].get(unit, 1.0) * ((radius_m or 1.0) if unit == "rpm" else 1.0)
    others = ", ".join(repr(name) for name, _ in cells if name not in UNITS)
    unknown = others and f"not known and not read: {others}"
    more = unknown and f"; {unknown}"
    for name in ("time", "speed"):
        if name not in columns:
            wrong.append(f"{path}: column {name}: missing; give {name} [{next(iter(UNITS[name]))}]{more}")
    if "friction" in columns and "force" in columns:
        wrong.append(f"{path}: column force: not together with friction; give friction, or force and load")
    elif "friction" not in columns and not {"force", "load"} <= {*columns}:
        wrong.append(f"{path}: column friction: missing; give friction [1], or force [N] and load [N]{more}")
    if wrong:
        raise InputError(wrong)
    return columns, unknown


def _numbers(
    path: Path, rows: list[tuple[int, str]], separator: str | None, count: int, places: dict[str, int]
) -> np.ndarray:
    """(n, columns at these places) as written. count : of columns"""
    if not FEWEST_ROWS <= len(rows) <= MOST_SAMPLES:
        raise InputError(f"{path}: {len(rows)} rows of numbers; {FEWEST_ROWS} to {MOST_SAMPLES} are read")
    table = [line.split(separator) for _, line in rows]
    table = [cells[:-1] if len(cells) == count + 1 and not cells[-1].strip() else cells for cells in table]
    commas = "; decimal commas take semicolons, tabs or blanks between columns" if separator == "," else ""
    numbered = [(f"{path}: line {number}", cells) for (number, _), cells in zip(rows, table, strict=True)]
    wrong = [f"{at}: {len(c)} values for {count} columns{commas}" for at, c in numbered if len(c) != count]
    values = np.empty((0, 0)) if wrong else np.array([[_number(c[p]) for p in places.values()] for c in table])
    for row, column in np.argwhere(~np.isfinite(values)):
        at, name = numbered[row][0], [*places][column]
        text = f"{table[row][places[name]].strip()[:30]!r} is no finite number; cut the row, or give what follows a gap"
        wrong.append(f"{at}, column {name}: {text} as a file of its own")
    if wrong:
        raise InputError(wrong[:SHOWN] + [f"{path}: and {len(wrong) - SHOWN} more such lines"] * (len(wrong) > SHOWN))
    return values


def _number(cell: str) -> float:
    try:
        return float(cell.replace(",", "."))
    except ValueError:
        return np.nan


def _trace(path: Path, number: int, columns: dict[str, np.ndarray], notes: tuple[str, ...]) -> Trace:
    time = columns["time"]
    steps = np.diff(time)
    step = float(np.median(steps))
    uneven = np.abs(steps - step) > UNEVEN * step
    if step <= 0.0 or uneven.any():
        at = f", first at {time[int(np.argmax(uneven))]:.6g} s" if step > 0.0 else ""
        text = f"steps from {steps.min():.3g} to {steps.max():.3g} s in record {number}{at}; even steps are read"
        more = "resample, write time with more digits, or give what follows a gap as a file of its own"
        raise InputError(f"{path}: column time: {text}: {more}")
    position, speed = columns.get("position"), columns["speed"]
    if position is not None and abs(position[-1] - position[0]) > PATH * abs(float(np.trapezoid(speed, time))):
        position, notes = None, (*notes, f"{path}: column position is the path slid, and is not used")
    place = columns.get("displacement", position)
    return Trace(time, speed, columns["friction"], columns.get("load"), place, notes)
