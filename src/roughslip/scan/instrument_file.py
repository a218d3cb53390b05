"""Files of scans: read instrument files, text and netCDF maps, and write X3P.

Sizes and links are checked before heights are read, nothing is unpickled, and each error is one InputError line that
names the file. SurfaceTopography (Roettger et al., Surface Topography: Metrology and Properties 10, 2022,
035032) reads the formats of instruments. It is imported in this module alone, where a file needs it.
"""

from __future__ import annotations

import hashlib
import io
import math
import zipfile
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from roughslip.atomic_write import replacing
from roughslip.errors import InputError
from roughslip.scan.named_arrays import ARRAYS, read_arrays, read_netcdf
from roughslip.scan.reading import (
    ARRAY_KEY,
    METRES,
    MOST_LISTED,
    Reading,
    by_name,
    check_hdf5,
    check_points,
    check_size,
    check_text,
    first_line,
    metres,
    no_length,
    settled,
)
from roughslip.scan.text_table import STATED_UNIT, HasHeader, read_table
from roughslip.scan.topography import Topography, topography
from roughslip.validation import gate

SPACINGS = (1e-11, 1e-2)  # [m] what the distance of neighbouring points may be: from below an atom to a centimetre
MOST_HEIGHT = 1.0  # [m] from zero; far beyond any scan, and squares stay finite
TEXT = (".txt", ".csv", ".tsv", ".dat", ".asc", ".prn", ".xyz")

_INSTALL = "install it with: pip install 'roughslip[scans]'"
_EPOCH = datetime(1980, 1, 1, tzinfo=UTC)  # the earliest date of a ZIP archive


@gate
def read_scan(
    path: Path | str, spacing: tuple[float, float] | None = None, unit: str | None = None, array: str | None = None
) -> Topography:
    """Read a scan from a file.

    path : an instrument's file in any format that SurfaceTopography reads; a `.nc` map; text, such as `.txt` or `.csv`
    spacing : (dx, dy) [m] distances of neighbouring points, where the file does not give them
    unit : unit of the heights, a key of METRES, where the file does not give it
    array : name of the array or channel of heights, where several can be

    Text without a header is a matrix, a row for each y, or points x, y, z. Values in the file cannot be replaced. Of
    several arrays or channels the one of heights is `array`, or that whose name is one of NAMES. Without such a name
    the first channel of an instrument is taken, and arrays are refused. `read` of the scan says what was.

    Raises InputError where the file is no scan or gives too little, in a line that names the key of a scene that helps.
    """
    path = Path(path)
    reading = _read(path, spacing, unit, array)
    by_file = f"so its reader takes {path.suffix or path.name} files; if that cannot be, export it in another format"
    heights = reading.heights[np.isfinite(reading.heights)]
    ends = "from {:.4g} to {:.4g} m".format(*(np.min(heights), np.max(heights)) if heights.size else (0.0, 0.0))
    check = f"they go {ends}: " + (
        by_file if unit is None else "check the unit, and that neither end stands for missing points"
    )
    for step in reading.spacing:
        if not SPACINGS[0] <= step <= SPACINGS[1]:
            raise InputError(
                f"{path}: points {step:.3g} m apart; from {SPACINGS[0]:.0e} to {SPACINGS[1]:.0e} m are allowed: "
                f"{by_file if spacing is None else 'check the unit'}"
            )
    if not np.all(np.abs(heights) <= MOST_HEIGHT):
        raise InputError(f"{path}: heights beyond {MOST_HEIGHT:g} m; {check}")
    scan = topography(reading.heights, *reading.spacing, str(path), reading.words)
    deviation, diagonal = float(np.std(scan.heights)), math.hypot(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy)
    if not deviation < diagonal:
        raise InputError(
            f"{path}: heights scatter by {deviation:.3g} m over a scan of {diagonal:.3g} m; they must scatter by less "
            f"than its length; {check}"
        )
    return scan


def _read(path: Path, spacing: tuple[float, float] | None, unit: str | None, array: str | None) -> Reading:
    if unit is not None and unit not in METRES:
        raise InputError(f"{path}: heights stated in {unit!r}, an unknown unit; allowed are {', '.join(METRES)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; a scan is a file of an instrument, a .nc map or a .txt matrix")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: empty; export it again")
    check_size(path)
    check_hdf5(path)
    suffix = path.suffix.lower()
    if suffix == ".nc":
        return read_netcdf(path, spacing, unit, array)
    if suffix in ARRAYS:
        return read_arrays(path, spacing, unit, array)
    if suffix in TEXT and _is_text(path):
        return _read_text(path, spacing, unit, array)
    return _read_instrument(path, spacing, unit, array)


def _is_text(path: Path) -> bool:
    with path.open("rb") as file:
        start = file.read(4096)
    return start.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in start


def _read_text(path: Path, spacing: tuple[float, float] | None, unit: str | None, array: str | None) -> Reading:
    """A table without a header of sizes, else what SurfaceTopography makes of the header."""
    try:
        table = read_table(path)
    except HasHeader as header:
        return _read_instrument(path, spacing, unit, array, header)
    if array is not None:
        raise InputError(f"{path}: text has one matrix, without a name; remove {ARRAY_KEY} = {array}")
    own, hint = None, ""
    if table.steps is not None:
        hint = f" (its points lie {table.steps[0]:.4g} x {table.steps[1]:.4g} apart, in a unit that it does not give)"
        if len(table.units) == 3:
            own = table.steps[0] * METRES[table.units[0]], table.steps[1] * METRES[table.units[1]]
        elif spacing is not None and not math.isclose(
            spacing[0] * table.steps[1], spacing[1] * table.steps[0], rel_tol=0.01
        ):
            stated = f"{spacing[0]:.4g} x {spacing[1]:.4g} m"
            raise InputError(f"{path}: the stated spacing of {stated} has another ratio than the file{hint}")
    unit, spacing = settled(path, (table.units[-1] if table.units else None, own), (unit, spacing), hint)
    return Reading(table.values * METRES[unit], spacing, f"{table.words}, heights in {unit}")


@gate
def write_x3p(path: Path | str, scan: Topography) -> None:
    """Write a scan as X3P (ISO 25178-72), the instruments' exchange format; missing points stay missing.

    SurfaceTopography writes it. Its archive is packed again without dates, so that the same scan gives the same bytes,
    and with the checksum of main.xml, which the standard asks for. Raises InputError where the file cannot be written.
    """
    path = Path(path)
    library = _library(path)
    heights = np.ma.masked_array(scan.heights, mask=scan.missing)
    sizes = scan.grid.nx * scan.dx, scan.grid.ny * scan.dy
    written = library.Topography(heights, sizes, unit="m", info={"acquisition_time": _EPOCH})
    dated, packed = io.BytesIO(), io.BytesIO()
    written.to_x3p(dated, manufacturer="roughslip", model="simulated")
    with zipfile.ZipFile(dated) as source, zipfile.ZipFile(packed, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            if name == "md5checksum.hex":
                content = f"{hashlib.md5(source.read('main.xml')).hexdigest()} *main.xml\n".encode()
            target.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    try:
        with replacing(path) as temporary:
            temporary.write_bytes(packed.getvalue())
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error})") from error


def _library(path: Path) -> ModuleType:
    try:
        import SurfaceTopography  # for instrument files alone: its import takes two seconds
    except ImportError as error:
        raise InputError(
            f"{path}: instrument files need SurfaceTopography, which is not installed; {_INSTALL}"
        ) from error
    return SurfaceTopography


def _read_instrument(
    path: Path,
    spacing: tuple[float, float] | None,
    unit: str | None,
    array: str | None,
    header: HasHeader | None = None,
) -> Reading:
    """Heights of an instrument's file. A reader of such files can fail in any way on a damaged one.

    header : the error of text with a header, raised where no reader knows the header
    """
    check_text(path)
    library = _library(path)
    try:
        with library.open_topography(path, format=_format(library, path)) as reader:
            if reader.format() == "hgt":  # radar maps of the Earth: the reader accepts any file of 2 n^2 bytes
                raise library.IO.CannotDetectFileFormat("no signature")
            if f".{reader.format()}" in ARRAYS:
                raise InputError(f"{path}: a file of named arrays; give it the ending .{reader.format()}")
            channel, words = _channel(path, reader.channels, array)
            check_points(path, channel.nb_grid_pts)
            unit, spacing = settled(path, (channel.unit, _found_spacing(channel)), (unit, spacing))
            scale = metres(path, unit)
            stated = {} if channel.physical_sizes is not None else {"physical_sizes": (1.0, 1.0)}
            heights = channel.topography(**stated).heights()
    except InputError:
        raise
    except library.IO.CannotDetectFileFormat as error:
        raise _unknown(path, header) from error
    except Exception as error:
        reason = f"{type(error).__name__}: {first_line(error)}"
        if "unit" in reason.lower():
            raise InputError(
                f"{path}: no unit of length for heights or distances ({reason}); export lengths"
            ) from error
        raise InputError(f"{path}: truncated or damaged ({reason}); export it again") from error
    return Reading(
        np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan) * scale, spacing, f"{words} in {unit}"
    )


def _channel(path: Path, channels: Sequence[Any], wanted: str | None) -> tuple[Any, str]:
    """The channel of heights, and which it is in words."""
    heights = {channel.name: channel for channel in reversed(channels) if channel.is_height_channel}
    names = list(reversed(heights))
    if not names:
        kinds = ", ".join(f"'{c.name}' in {c.data_unit or 'no unit'}, {c.data_kind.value}" for c in channels)
        raise InputError(f"{path}: no height channel found ({kinds or 'no channel'}); export the heights, as a length")
    listed = ", ".join(names[:MOST_LISTED])
    if wanted is not None and wanted not in names:
        raise InputError(f"{path}: no channel of heights is named '{wanted}' ({ARRAY_KEY}); it has {listed}")
    name = wanted or (by_name(names) if len(by_name(names)) == 1 else names)[0]
    others = f" of {len(names)} with heights ({listed})" if len(names) > 1 else ""
    return heights[name], f"channel '{name}'{others}"


def _format(library: ModuleType, path: Path) -> str | None:
    """The format that the first bytes prove, else None, which tries all readers.

    A reader chosen by the first bytes reports the damage of a file; trying all readers hides it.
    """
    with path.open("rb") as file:
        start = file.read(512)
    proven = [r.format() for r in library.IO.readers if r.can_read(start) is library.IO.MagicMatch.YES]
    return proven[0] if len(proven) == 1 else None


def _unknown(path: Path, header: HasHeader | None) -> InputError:
    """The error for a file that no reader accepts."""
    if header is None:
        known = "allowed are instrument files, .nc and text such as .txt and .csv"
        return InputError(f"{path}: unknown format, or damaged; {known}")
    with path.open(encoding="utf-8", errors="replace") as file:
        units = [stated[1] for stated in map(STATED_UNIT.search, file) if stated and stated[1] not in METRES]
    return no_length(path, units[0]) if units else header


def _found_spacing(channel: Any) -> tuple[float, float] | None:
    """(dx, dy) [m] that the file gives; None without a unit. A text header may have one for x alone."""
    unit = channel.unit or channel.info.get("raw_metadata", {}).get("xunit")
    if channel.pixel_size is None or unit not in METRES:
        return None
    dx, dy = channel.pixel_size
    return float(dx) * METRES[unit], float(dy) * METRES[unit]
