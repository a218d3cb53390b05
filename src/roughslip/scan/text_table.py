"""Text as spreadsheets and instruments export it: a matrix of heights.

Read is what has one meaning: a byte-order mark, semicolons, commas or tabs between values, decimal commas, words for
missing values, lines of headings. Else the error names what was met, and where. Headers of sizes and points x, y, z
are left to SurfaceTopography.
"""

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from roughslip.errors import InputError
from roughslip.scan.topography import FEWEST_NODES

METRES = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "μm": 1e-6, "um": 1e-6, "nm": 1e-9, "Å": 1e-10, "pm": 1e-12}
MISSING = frozenset(
    ["", "bad", "nan", "na", "n/a", "n.a.", "#n/a", "null", "none", "invalid", "nodata", "-", "--", "---", "*", "***"]
)
MOST_HEADINGS = 20  # lines

_UNIT = "|".join(METRES)
# Lines of comment that give a size or a unit of values.
_SIZE = re.compile(rf"[:=]\s*(?:[-+\d.,eE]+\s*)?(?:{_UNIT})\s*$|(?:value units|z-unit|unit data)\s*[:=]", re.IGNORECASE)
_HEADING_UNIT = re.compile(rf"[\[(]\s*({_UNIT})\s*[\])]")
_DECIMAL_COMMA = re.compile(r"[-+]?\d*,\d+(?:[eE][-+]?\d+)?")
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(?:,\d{3})+")
_STEM = re.compile(r"[-+]?0\d|-0(?!\d)")  # what no whole number is written as
Line = tuple[int, str]


class NoMatrix(InputError):
    """Before the numbers stands a header, perhaps with sizes and units, or they are points: for another reader."""


@dataclass(frozen=True)
class Reading:
    """What a file of a scan holds.

    values : (nx, ny) heights in their unit, nan where there is none
    unit : of the heights, None where the file does not give it
    spacing : (dx, dy) [m] of neighbouring points, None where the file does not give it
    words : what it is and how it is written
    """

    values: np.ndarray
    unit: str | None
    spacing: tuple[float, float] | None
    words: str


def read_table(path: Path) -> Reading:
    """The matrix of a text file, a row for each y. Raises NoMatrix where another reader may know the file."""
    lines = _lines(path)
    separator, comma, written = _style(path, lines)
    headings, lines = _headings(path, lines, separator, comma)
    rows = _rows(path, lines, separator, comma)
    units = _HEADING_UNIT.findall(" ".join(headings))
    if headings:
        written.append("after the line " + " and ".join(repr(line[:60]) for line in headings[:2]))
    if rows.shape[1] == 3 and len(rows) >= FEWEST_NODES**2:
        raise _no_matrix(path, "three columns, as of points x, y, z", NoMatrix)
    for across, what in ((rows, "the first row"), (rows.T, "the first column")):
        if _rises_evenly(across[0]) and not any(map(_rises_evenly, across[1:2])):  # a slope does so in every row
            raise InputError(f"{path}: {what} rises in equal steps: coordinates, no heights; export the heights alone")
    words = ", ".join(["matrix", *written, "heights"])
    return Reading(rows.T, units[0] if len(units) == 1 else None, None, words)


def _lines(path: Path) -> list[Line]:
    """Numbers and texts of the lines that are neither empty nor comments, without quotes.

    A comma inside quotes is a decimal one. Raises NoMatrix where a comment gives a size or a unit.
    """
    content = path.read_bytes()
    try:
        text = content.decode("utf-16" if content.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    text = re.sub("no data", "nodata", text.replace("\u2212", "-"), flags=re.IGNORECASE)
    text = re.sub(r'"([^"\n]*)"', lambda quoted: quoted[1].replace(",", "."), text)
    lines = []
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("#") and not line.upper().startswith("#N/A"):
            if _SIZE.search(line):
                raise _header(path, line.strip(" #"), number)
        elif line.strip() and not re.fullmatch("sep=.", line.strip()):  # the separator, as Excel notes it
            lines.append((number, line))
    return lines


def _style(path: Path, lines: list[Line]) -> tuple[str | None, bool, list[str]]:
    """The separator (None for blanks), whether commas are decimal, and both in words, from some 200 lines."""
    sample = [(number, line) for number, line in lines[: 200 + MOST_HEADINGS] if re.search(r"\d", line)]
    text = "\n".join(line for _, line in sample)
    separator = next((mark for mark in ";\t" if mark in text), None)
    if separator == "\t" and any(" " in line.strip() for _, line in sample):
        separator = None
    cells = [cell.strip() for _, line in sample for cell in line.split(separator)]
    with_comma = [cell for cell in cells if "," in cell]
    comma = any(_DECIMAL_COMMA.fullmatch(cell) for cell in with_comma) and len(cells) > len(sample)
    comma = comma and all(cell.count(",") == 1 for cell in with_comma if "." not in cell)
    if with_comma and not comma and separator is None:
        separator = ","
        joined = [n for n, line in sample if any(_STEM.match(cell.strip()) for cell in line.split(","))]
        if joined and "." not in text:
            raise _no_matrix(path, f"commas that separate and are decimal, in line {joined[0]}")
    if comma and all(_THOUSANDS.fullmatch(cell) for cell in with_comma):
        raise _no_matrix(path, f"{with_comma[0]!r}, whose comma is decimal or one of thousands")
    words = {";": ["semicolons"], ",": ["commas"]}.get(separator or "", [])
    return separator, comma, words + (["decimal commas"] if comma else [])


def _headings(path: Path, lines: list[Line], separator: str | None, comma: bool) -> tuple[list[str], list[Line]]:
    """Lines before the first row of numbers, and the lines from it on."""
    for first, (number, line) in enumerate(lines):
        cells = line.split(separator)
        row = _numbers(cells, comma)
        if not isinstance(row, int) and (len(cells) > 1 or np.isfinite(row).all()):
            for place, text in lines[:first]:
                if re.search(r"\d", text) and len(text.split(separator)) != len(cells):
                    raise _header(path, text, place)
            return [text.strip() for _, text in lines[:first]], lines[first:]
        parts = line.split(";" if separator == ";" else None)
        wrong = [place for place, part in enumerate(parts) if isinstance(_numbers([part], comma), int)]
        if wrong and 2 * len(wrong) < len(parts):  # mostly numbers: no line of headings
            raise _no_matrix(path, f"{parts[wrong[0]].strip()[:30]!r} in line {number}, column {wrong[0] + 1}")
        if re.search("[=:]", line) or first == MOST_HEADINGS:
            raise _header(path, line, number)
    if lines:
        raise _header(path, lines[0][1], lines[0][0])
    raise InputError(f"{path}: empty; a matrix has a row of numbers for each y")


def _rows(path: Path, lines: list[Line], separator: str | None, comma: bool) -> np.ndarray:
    """(lines, columns) numbers."""
    first, cells = lines[0][0], lines[0][1].split(separator)
    trailing = separator is not None and len(cells) > 1 and not cells[-1].strip()
    columns, rows = len(cells) - trailing, []
    for number, line in lines:
        cells = line.split(separator)
        row = _numbers(cells[:-1] if trailing and not cells[-1].strip() else cells, comma)
        if isinstance(row, int):
            raise _no_matrix(path, f"{cells[row].strip()[:30]!r} in line {number}, column {row + 1}")
        if len(row) != columns:
            raise _no_matrix(path, f"{len(row)} values in line {number}, {columns} in line {first}")
        rows.append(row)
    return np.array(rows)


def _numbers(cells: list[str], comma: bool) -> np.ndarray | int:
    """The numbers of a line, or the place of the first cell that holds none."""
    row = np.empty(len(cells))
    for place, cell in enumerate(cells):
        word = cell.strip().lower()
        if word in MISSING:
            row[place] = math.nan
            continue
        if "_" in word or (comma and "." in word):  # 1_000 is a number of Python alone
            return place
        try:
            row[place] = float(word.replace(",", ".") if comma else word)
        except ValueError:
            return place
    return row


def _no_matrix(path: Path, met: str, kind: type[InputError] = InputError) -> InputError:
    advice = "export numbers alone, with decimal points, set apart by blanks"
    return kind(f"{path}: not a matrix of numbers ({met}); {advice}")


def _header(path: Path, text: str, number: int) -> InputError:
    return _no_matrix(path, f"{text.strip()[:60]!r} in line {number}", NoMatrix)


def _rises_evenly(line: np.ndarray) -> bool:
    """Whether values rise in equal steps, the corner of a table aside."""
    step = np.diff(line[1:])
    return bool(len(step) >= FEWEST_NODES - 2 and step[0] > 0.0 and np.allclose(step, step[0], rtol=1e-3, atol=0.0))
