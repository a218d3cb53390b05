"""Files of scans: read instrument files, plain matrices and netCDF maps, and write X3P.

Files are not trusted. Sizes are checked before heights are read, nothing is unpickled, and each error is one InputError
line that names the file. SurfaceTopography (Roettger et al., Surface Topography: Metrology and Properties 10, 2022,
035032) reads the formats of instruments. It is imported in this module alone, where a file needs it.
"""

from __future__ import annotations

import hashlib
import io
import math
import zipfile
from datetime import UTC, datetime
from pathlib import Path
from types import ModuleType
from typing import Any

import netCDF4
import numpy as np

from roughslip.atomic_write import replacing
from roughslip.errors import InputError
from roughslip.scan.limits import check_archive, check_hdf5, check_points, check_size, check_text, first_line
from roughslip.scan.topography import Topography, topography
from roughslip.validation import gate

METRES = {"m": 1.0, "mm": 1e-3, "µm": 1e-6, "μm": 1e-6, "um": 1e-6, "nm": 1e-9, "Å": 1e-10, "pm": 1e-12}

SPACINGS = (1e-11, 1e-2)  # [m] what the distance of neighbouring points may be: from below an atom to a centimetre
MOST_HEIGHT = 1.0  # [m] from zero; far beyond any scan, and squares stay finite
KEYS = {
    "unit of heights": "roughness.scan.height_unit",
    "spacing": "roughness.scan.spacing_x_m and roughness.scan.spacing_y_m",
}
"""What a scene states where the file does not give it."""

_INSTALL = "install it with: pip install 'roughslip[scans]'"
_EPOCH = datetime(1980, 1, 1, tzinfo=UTC)  # the earliest date of a ZIP archive


@gate
def read_scan(path: Path, spacing: tuple[float, float] | None = None, unit: str | None = None) -> Topography:
    """Read a scan from a file.

    path : an instrument's file in any format that SurfaceTopography reads; a `.nc` map; a `.txt` matrix
    spacing : (dx, dy) [m] distances of neighbouring points, where the file does not give them
    unit : unit of the heights, a key of METRES, where the file does not give it

    A `.txt` matrix with both arguments is read as bare numbers, a row for each y; without them it needs a header.
    Values in the file cannot be replaced. The first channel of heights is taken. Raises InputError.
    """
    heights, dx, dy = _read(path, spacing, unit)
    if not np.all(np.abs(heights[np.isfinite(heights)]) <= MOST_HEIGHT):
        raise InputError(f"{path}: heights beyond {MOST_HEIGHT:g} m: check the unit")
    scan = topography(heights, dx, dy, str(path))
    deviation, diagonal = float(np.std(scan.heights)), math.hypot(scan.grid.nx * dx, scan.grid.ny * dy)
    if not deviation < diagonal:
        raise InputError(
            f"{path}: heights scatter by {deviation:.3g} m over a scan of {diagonal:.3g} m; they must scatter by less "
            "than its length: check the unit"
        )
    return scan


def _read(path: Path, spacing: tuple[float, float] | None, unit: str | None) -> tuple[np.ndarray, float, float]:
    """Heights [m] and the distances of points [m]."""
    path = Path(path)
    if unit is not None and unit not in METRES:
        raise InputError(f"{path}: heights stated in {unit!r}, an unknown unit; allowed are {', '.join(METRES)}")
    if not path.is_file():
        raise InputError(f"{path}: no such file; a scan is a file of an instrument, a .nc map or a .txt matrix")
    if path.stat().st_size == 0:
        raise InputError(f"{path}: empty; export it again")
    check_size(path)
    check_hdf5(path)
    if path.suffix == ".nc":
        heights, dx, dy = _read_netcdf(path, spacing, unit)
    elif path.suffix == ".txt" and spacing is not None and unit is not None:
        heights, (dx, dy) = _read_matrix(path) * METRES[unit], spacing
    else:
        heights, dx, dy = _read_instrument(path, spacing, unit)
    for step in (dx, dy):
        if not SPACINGS[0] <= step <= SPACINGS[1]:
            raise InputError(
                f"{path}: points {step:.3g} m apart; from {SPACINGS[0]:.0e} to {SPACINGS[1]:.0e} m are allowed: check "
                "the unit"
            )
    return heights, dx, dy


@gate
def write_x3p(path: Path, scan: Topography) -> None:
    """Write a scan as X3P (ISO 25178-72), the instruments' exchange format; missing points stay missing.

    SurfaceTopography writes it. Its archive is packed again without dates, so that the same scan gives the same bytes,
    and with the checksum of main.xml, which the standard asks for. Raises InputError where the file cannot be written.
    """
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


def _choose(path: Path, what: str, found: Any, stated: Any) -> Any:
    """The value in the file, or the stated one where the file has none."""
    if found is not None and stated is not None:
        raise InputError(f"{path}: the file gives its {what}, {found}; remove {KEYS[what]} = {stated}")
    if found is None and stated is None:
        raise InputError(f"{path}: the file does not give its {what}; set {KEYS[what]}")
    return stated if found is None else found


def _metres(path: Path, unit: str) -> float:
    if unit not in METRES:
        raise InputError(f"{path}: values in {unit!r}, which is not a unit of length: allowed are {', '.join(METRES)}")
    return METRES[unit]


def _read_matrix(path: Path) -> np.ndarray:
    """(nx, ny) numbers of a text file, a row for each y, nan for missing ones."""
    try:
        with path.open(encoding="utf-8") as file:
            if not any(line.partition("#")[0].strip() for line in file):
                raise InputError(f"{path}: empty; a matrix has a row of numbers for each y")
        rows = np.loadtxt(path, ndmin=2, encoding="utf-8")
    except (ValueError, OSError) as error:
        raise InputError(
            f"{path}: not a matrix of numbers ({first_line(error)}); where a header gives the spacing and the unit, "
            "state neither"
        ) from error
    check_points(path, rows.shape)
    return rows.T


def _read_netcdf(path: Path, spacing: tuple[float, float] | None, unit: str | None) -> tuple[np.ndarray, float, float]:
    """A netCDF map: variable `heights(x, y)` with attribute `units` and coordinates x, y with theirs."""
    try:
        with netCDF4.Dataset(path) as file:
            if "heights" not in file.variables:
                raise InputError(f"{path}: holds no variable 'heights'; a map has heights(x, y), x(x) and y(y)")
            heights = file.variables["heights"]
            check_points(path, heights.shape)
            if sorted(heights.dimensions) != ["x", "y"]:
                raise InputError(f"{path}: heights over {', '.join(heights.dimensions)}; a map is over x and y")
            scale = _metres(path, _choose(path, "unit of heights", _units(heights), unit))
            axes = [file.variables[name] for name in "xy" if name in file.variables]
            for other in (*axes, *(file.variables[name] for name in ("mask",) if name in file.variables)):
                _check_shape(path, other, heights)
            steps = [_spacing(path, axis) for axis in axes]
            dx, dy = _choose(path, "spacing", (steps[0], steps[1]) if len(steps) == 2 else None, spacing)
            values = np.ma.filled(np.ma.asarray(heights[:], dtype=np.float64), np.nan)
            if "mask" in file.variables:  # of missing points, as SurfaceTopography writes it
                values[np.ma.filled(file.variables["mask"][:], 1) != 0] = np.nan
            values = values if heights.dimensions == ("x", "y") else values.T
    except (OSError, RuntimeError, ValueError, TypeError, IndexError) as error:
        raise InputError(f"{path}: truncated or not netCDF ({first_line(error)})") from error
    return values * scale, dx, dy


def _check_shape(path: Path, other: netCDF4.Variable, heights: netCDF4.Variable) -> None:
    """Refuse coordinates and masks of another shape than the heights, before they are read."""
    points = {axis: heights.shape[heights.dimensions.index(axis)] for axis in "xy"}
    wanted = heights.shape if other.name == "mask" else (points[other.name],)
    if other.shape != wanted:
        raise InputError(
            f"{path}: {other.name} has the shape {other.shape}; heights of {heights.shape} go with {wanted}"
        )


def _units(variable: netCDF4.Variable) -> str | None:
    """Attribute `units`, or `unit` as SurfaceTopography writes it."""
    found = next((getattr(variable, name) for name in ("units", "unit") if hasattr(variable, name)), None)
    return None if found is None else str(found)


def _spacing(path: Path, axis: netCDF4.Variable) -> float:
    if axis.ndim != 1 or len(axis) < 2 or _units(axis) is None:
        raise InputError(f"{path}: coordinate {axis.name} needs at least two points and an attribute 'units'")
    steps = np.diff(np.asarray(axis[:], dtype=np.float64)) * _metres(path, str(_units(axis)))
    if not (steps[0] > 0.0 and np.allclose(steps, steps[0], rtol=1e-3, atol=0.0)):
        raise InputError(
            f"{path}: coordinate {axis.name} does not increase in equal steps; a scan has one spacing an axis"
        )
    return float(np.mean(steps))


def _library(path: Path) -> ModuleType:
    try:
        import SurfaceTopography  # for instrument files alone: its import takes two seconds
    except ImportError as error:
        raise InputError(
            f"{path}: instrument files need SurfaceTopography, which is not installed; {_INSTALL}"
        ) from error
    return SurfaceTopography


def _read_instrument(
    path: Path, spacing: tuple[float, float] | None, unit: str | None
) -> tuple[np.ndarray, float, float]:
    """Heights of an instrument's file. A reader of such files can fail in any way on a damaged one."""
    check_archive(path)
    check_text(path)
    library = _library(path)
    try:
        with library.open_topography(path, format=_format(library, path)) as reader:
            if reader.format() == "hgt":  # radar maps of the Earth: the reader accepts any file of 2 n^2 bytes
                raise library.IO.CannotDetectFileFormat("no signature")
            channel = next((c for c in reader.channels if c.is_height_channel), None)
            if channel is None:
                kinds = ", ".join(dict.fromkeys(channel.data_kind.value for channel in reader.channels))
                raise InputError(f"{path}: no height channel found (only {kinds}); export the heights")
            check_points(path, channel.nb_grid_pts)
            scale = _metres(path, _choose(path, "unit of heights", channel.unit, unit))
            dx, dy = _choose(path, "spacing", _found_spacing(channel), spacing)
            stated = {} if channel.physical_sizes is not None else {"physical_sizes": (1.0, 1.0)}
            heights = channel.topography(**stated).heights()
    except InputError:
        raise
    except library.IO.CannotDetectFileFormat as error:
        raise InputError(_unknown(library, path)) from error
    except Exception as error:
        reason = f"{type(error).__name__}: {first_line(error)}"
        raise InputError(f"{path}: truncated or damaged ({reason}); export it again") from error
    return np.ma.filled(np.ma.asarray(heights, dtype=np.float64), np.nan) * scale, dx, dy


def _format(library: ModuleType, path: Path) -> str | None:
    """The format that the first bytes prove, else None, which tries all readers.

    A reader chosen by the first bytes reports the damage of a file; trying all readers hides it.
    """
    with path.open("rb") as file:
        start = file.read(512)
    proven = [r.format() for r in library.IO.readers if r.can_read(start) is library.IO.MagicMatch.YES]
    return proven[0] if len(proven) == 1 else None


def _unknown(library: ModuleType, path: Path) -> str:
    """The message for a file that no reader accepts; for text with the reason of the reader of text."""
    if path.suffix in (".txt", ".asc"):
        try:
            library.open_topography(path, format="asc").close()
        except Exception as error:
            return (
                f"{path}: no matrix of heights ({type(error).__name__}: {first_line(error)}); "
                f"a header may give sizes, and heights in {', '.join(METRES)}"
            )
    return f"{path}: unknown format, or damaged; allowed are instrument files, .nc and .txt"


def _found_spacing(channel: Any) -> tuple[float, float] | None:
    """(dx, dy) [m] that the file gives; None without a unit. A text header may have one for x alone."""
    unit = channel.unit or channel.info.get("raw_metadata", {}).get("xunit")
    if channel.pixel_size is None or unit not in METRES:
        return None
    dx, dy = channel.pixel_size
    return float(dx) * METRES[unit], float(dy) * METRES[unit]
