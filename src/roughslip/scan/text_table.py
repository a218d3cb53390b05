"""Text as spreadsheets and instruments export it: a matrix of heights, or points x, y, z on a mesh.

Read is what has one meaning: a byte-order mark, semicolons, commas or tabs between values, decimal commas, words for
missing values, lines of headings. Else the error names what was met, and where. A header of sizes is not read here.
"""

from __future__ import annotations

import codecs
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roughslip.errors import InputError
from roughslip.scan.reading import METRES, MOST_POINTS, SMALLER, check_points
from roughslip.scan.topography import FEWEST_NODES

MISSING = frozenset(
    ["", "bad", "nan", "na", "n/a", "n.a.", "#n/a", "null", "none", "invalid", "nodata", "-", "--", "---", "*", "***"]
)
SAMPLE = 200  # lines that show how values are written
MOST_HEADINGS = 20  # lines
MOST_COORDINATE = 1e12  # a metre in the smallest unit
NEAR_NODE = 0.05  # of a step, by which coordinates of points may be rounded

_COMMENT = re.compile(r"(?:^|\s)#(?!N/A).*")
_UNIT = "|".join(METRES)
# Lines of comment that give a size or a unit of values.
_SIZE = re.compile(rf"[:=]\s*(?:[-+\d.,eE]+\s*)?(?:{_UNIT})\s*$")
STATED_UNIT = re.compile(r"(?:value units|z-unit|unit data)\s*[:=]\s*(\S+)", re.IGNORECASE)
_HEADING_UNIT = re.compile(rf"[\[(]\s*({_UNIT})\s*[\])]")
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
_STEM = re.compile(r"[-+]?0\d|-0(?!\d)")  # what no whole number is written as


class HasHeader(InputError):
    """Before the numbers stands no line of headings but a header, perhaps with sizes and units."""


@dataclass(frozen=True)
class Table:
    """Numbers of a text file.

    values : (nx, ny), nan where one is missing
    steps : of points x, y, z the distances of neighbours in the unit of the file; None of a matrix
    units : in the headings, of x, y and z or of z alone
    words : what it is and how it is written
    """

    values: np.ndarray
    steps: tuple[float, float] | None
    units: tuple[str, ...]
    words: str


def read_table(path: Path) -> Table:
    """The numbers of a text file: a matrix with a row for each y, or points in three columns."""
    try:
        rows, headings, written = _rows(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from error
    units = tuple(_HEADING_UNIT.findall(" ".join(headings)))
    if headings:
        written.append("after the line " + " and ".join(repr(line[:60]) for line in headings[:2]))
    how = "".join(f", {words}" for words in written)
    if rows.shape[1] == 3 and len(rows) >= FEWEST_NODES**2:
        values, steps = _on_mesh(path, rows)
        return Table(values, steps, units if len(units) == 3 else (), f"points x, y, z{how}")
    if min(rows.shape) < FEWEST_NODES and len(rows) >= FEWEST_NODES**2:
        raise _no_matrix(path, f"{len(rows)} lines of {rows.shape[1]} numbers; points have three, x, y and z")
    check_points(path, rows.shape)
    for lines, what in ((rows, "the first row"), (rows.T, "the first column")):
        if _rises_evenly(lines[0]) and not any(map(_rises_evenly, lines[1:2])):  # heights of a slope do so in every row
            raise InputError(f"{path}: {what} rises in equal steps: coordinates, no heights; export the heights alone")
    return Table(rows.T, None, units if len(units) == 1 else (), f"matrix{how}")


def _lines(path: Path, *, sizes: bool = True) -> Iterator[tuple[int, str]]:
    """Numbers and texts of the lines that are neither empty nor comments. sizes : whether comments may give none"""
    with path.open("rb") as file:
        start = file.read(2**16)
    if start.startswith((b"\xff\xfe\0\0", b"\0\0\xfe\xff")):
        encoding = "utf-32"
    elif start.startswith((b"\xff\xfe", b"\xfe\xff")):
        encoding = "utf-16"
    else:
        try:
            codecs.getincrementaldecoder("utf-8")().decode(start)  # a character that the end cuts is no error
            encoding = "utf-8-sig"
        except UnicodeDecodeError:
            encoding = "latin-1"
    with path.open(encoding=encoding, errors="replace") as file:
        for number, line in enumerate(file, start=1):
            if sizes and line.lstrip().startswith("#") and (_SIZE.search(line) or STATED_UNIT.search(line)):
                raise _header(path, line.strip(" #"), number)
            text = _COMMENT.sub("", line.rstrip("\r\n")) if "#" in line else line.rstrip("\r\n")
            if text.strip() and not re.fullmatch("sep=.", text.strip()):  # the separator, as Excel notes it
                yield number, _plain(text)


def _plain(line: str) -> str:
    """Without quotes, a comma inside them being a decimal one; the sign of minus and two words as one."""
    line = line.replace("\u2212", "-")
    if "data" in line.lower():
        line = re.sub("no data", "nodata", line, flags=re.IGNORECASE)
    return re.sub(r'"([^"]*)"', lambda quoted: quoted[1].replace(",", "."), line) if '"' in line else line


def _rows(path: Path) -> tuple[np.ndarray, list[str], list[str]]:
    """(lines, columns) numbers, lines of headings, and how the numbers are written."""
    separator, comma, written = _style(path)
    headings: list[tuple[str, int, int]] = []  # text, cells, number of the line
    rows: list[np.ndarray] = []
    trailing, first, last, step = False, 0, 0, 0
    for number, line in _lines(path):
        cells = line.split(separator) if separator else line.split()
        row = _numbers(cells, comma)
        if not rows:
            if isinstance(row, int):
                parts = line.split(separator) if separator == ";" else line.split()
                wrong = [place for place, part in enumerate(parts) if isinstance(_numbers([part], comma), int)]
                if wrong and 2 * len(wrong) < len(parts):  # mostly numbers: no line of headings
                    met = parts[wrong[0]].strip()[:30]
                    raise _no_matrix(path, f"{met!r} in line {number}, column {wrong[0] + 1}")
            if isinstance(row, int) or (len(cells) == 1 and not np.isfinite(row).all()):
                headings.append((line.strip(), len(cells), number))
                if re.search("[=:]", line):
                    raise _header(path, line, number)
                if len(headings) > MOST_HEADINGS:
                    raise _header(path, headings[0][0], headings[0][2])
                continue
            trailing, first = separator is not None and len(cells) > 1 and not cells[-1].strip(), number
            for text, count, place in headings:
                if re.search(r"\d", text) and count != len(cells):
                    raise _header(path, text, place)
        if isinstance(row, int):
            raise _no_matrix(path, f"{cells[row].strip()[:30]!r} in line {number}, column {row + 1}")
        if trailing and not cells[-1].strip():
            row = row[:-1]
        if rows and len(row) != len(rows[0]):
            raise _no_matrix(path, f"{len(row)} values in line {number}, {len(rows[0])} in line {first}")
        if rows and len(row) != 3 and number - last != (step := step or number - last):
            raise _no_matrix(path, f"a gap before line {number}, perhaps of two matrices")
        last = number
        rows.append(row)
        if len(rows) * len(row) > 3 * MOST_POINTS:  # points have three columns
            raise InputError(f"{path}: more than {MOST_POINTS} points; at most {MOST_POINTS} are read: {SMALLER}")
    if not rows and headings:
        raise _header(path, headings[0][0], headings[0][2])
    if not rows:
        raise InputError(f"{path}: empty; a matrix has a row of numbers for each y")
    return np.array(rows), [text for text, *_ in headings], written


def _style(path: Path) -> tuple[str | None, bool, list[str]]:
    """The separator (None for blanks), whether commas are decimal, and both in words."""
    sample = []
    for number, line in _lines(path):
        if re.search(r"\d", line):
            sample.append((number, line))
        if len(sample) == SAMPLE:
            break
    text = "\n".join(line for _, line in sample)
    separator = next((mark for mark in ";\t" if mark in text), None)
    if separator == "\t" and any(" " in line.strip() for _, line in sample):
        separator = None
    cells = [cell.strip() for _, line in sample for cell in (line.split(separator) if separator else line.split())]
    with_comma = [cell for cell in cells if "," in cell]
    comma = bool(with_comma) and any(_DECIMAL_COMMA.fullmatch(cell) for cell in with_comma)
    comma = comma and len(cells) > len(sample) and all(cell.count(",") == 1 for cell in with_comma if "." not in cell)
    if with_comma and not comma and separator is None:
        separator = ","
        if "." not in text:
            for number, line in sample:
                if any(_STEM.match(cell.strip()) for cell in line.split(",")):
                    raise _no_matrix(path, f"commas that separate and are decimal, in line {number}")
    if comma and all(_THOUSANDS.fullmatch(cell) for cell in with_comma):
        raise _no_matrix(path, f"{with_comma[0]!r}, whose comma is decimal or one of thousands")
    words = {";": ["semicolons"], ",": ["commas"], "\t": [], None: []}[separator]
    return separator, comma, words + (["decimal commas"] if comma else [])


def _numbers(cells: list[str], comma: bool) -> np.ndarray | int:
    """The numbers of a line, or the place of the first cell that holds none."""
    if comma:
        mixed = next(
            (place for place, cell in enumerate(cells) if "." in cell and cell.strip().lower() not in MISSING), -1
        )
        if mixed >= 0:
            return mixed
        cells = [cell.replace(",", ".") for cell in cells]
    marked = next((place for place, cell in enumerate(cells) if "_" in cell), -1)  # 1_000 is one of Python alone
    if marked >= 0:
        return marked
    try:
        return np.array(cells, dtype=np.float64)
    except ValueError:
        row = np.empty(len(cells))
    for place, cell in enumerate(cells):
        try:
            row[place] = math.nan if cell.strip().lower() in MISSING else float(cell)
        except ValueError:
            return place
    return row


def _no_matrix(path: Path, met: str) -> InputError:
    return InputError(
        f"{path}: not a matrix of numbers ({met}); export numbers with decimal points, set apart by blanks"
    )


def _header(path: Path, text: str, number: int) -> HasHeader:
    """Where decimal commas follow, the line names them too: SurfaceTopography, which reads headers, takes points."""
    commas = (
        n for n, line in _lines(path, sizes=False) if n > number and any(map(_DECIMAL_COMMA.fullmatch, line.split()))
    )
    comma_line = next(commas, None)
    met = f"{text.strip()[:60]!r} in line {number}" + (f", decimal commas in line {comma_line}" if comma_line else "")
    return HasHeader(
        f"{path}: not a matrix of numbers ({met}); remove the header or export numbers with decimal points, set apart "
        "by blanks"
    )


def _rises_evenly(line: np.ndarray) -> bool:
    """Whether values rise in equal steps, the corner of a table aside."""
    step = np.diff(line[1:])
    return bool(len(step) >= FEWEST_NODES - 2 and step[0] > 0.0 and np.allclose(step, step[0], rtol=1e-3, atol=0.0))


def _on_mesh(path: Path, rows: np.ndarray) -> tuple[np.ndarray, tuple[float, float]]:
    """(nx, ny) heights of points x, y, z in any order on a mesh, nan where there is none; the steps of the mesh."""
    places, steps, counts = [], [], []
    for name, values in (("x", rows[:, 0]), ("y", rows[:, 1])):
        if not np.all(np.abs(values) < MOST_COORDINATE):
            raise InputError(f"{path}: a point without {name}; each needs both coordinates, below {MOST_COORDINATE:g}")
        levels = np.unique(values)
        reach = levels[-1] - levels[0]
        apart = np.diff(levels)
        apart = apart[apart > 1e-3 * np.max(apart, initial=0.0)]  # levels that differ by rounding are one
        if not len(apart):
            raise InputError(f"{path}: all points have one {name}; a map has points along x and y")
        count = int(min(round(reach / np.median(apart)), MOST_POINTS)) + 1
        steps.append(float(reach / (count - 1)))
        place = (values - levels[0]) / steps[-1]
        if np.max(np.abs(place - np.round(place))) > NEAR_NODE:
            raise InputError(f"{path}: {name} of the points does not increase in equal steps; a scan lies on a mesh")
        places.append(np.round(place).astype(int))
        counts.append(count)
    check_points(path, tuple(counts))
    heights = np.full(counts, np.nan)
    taken = np.zeros(counts, dtype=bool)
    taken[places[0], places[1]] = True
    if taken.sum() != len(rows):
        raise InputError(f"{path}: several heights at one place; a scan has one at each point")
    heights[places[0], places[1]] = rows[:, 2]
    return heights, (steps[0], steps[1])
