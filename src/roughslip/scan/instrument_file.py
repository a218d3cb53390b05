"""Files of scans: instruments' formats by SurfaceTopography, netCDF maps and text.

Each error is one InputError line that names the file. SurfaceTopography (Roettger et al., Surface Topography: Metrology
and Properties 10, 2022, 035032) is imported in this module alone, where a file needs it.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import netCDF4
import numpy as np

from roughslip.errors import InputError
from roughslip.scan.text_table import METRES, NoMatrix, Reading, read_table
from roughslip.scan.topography import Topography, topography
from roughslip.validation import gate

MOST_POINTS = 2**23  # statistics of so many points take some 2 GB
MOST_LISTED = 8
TEXT = (".txt", ".csv", ".tsv", ".dat", ".asc", ".prn", ".xyz")
ARRAYS = ("h5", "mat", "npz")  # formats of named arrays, which say nothing of what they hold
NAMES = ("heights", "height", "topography", "z")  # of the channel of heights among several, in any case of letters


@gate
def read_scan(path: Path | str, spacing: tuple[float, float] | None = None, unit: str | None = None) -> Topography:
    """Read a scan from a file.

    path : an instrument's file in any format that SurfaceTopography reads; a `.nc` map; text, such as `.txt` or `.csv`
    spacing : (dx, dy) [m] distances of neighbouring points, where the file does not give them
    unit : unit of the heights, a key of METRES, where the file does not give it

    Text without a header is a matrix, a row for each y. Values in the file cannot be replaced. Of several channels the
    one of heights is that whose name is one of NAMES, else the first of an instrument; named arrays are then refused.
    `read` of the scan says what was.

    Raises InputError where the file is no scan or gives too little, in a line that names the argument that helps.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{path}: no such file; a scan is a file of an instrument, a .nc map or a .txt matrix")
    found = _read(path)
    if found.values.size > MOST_POINTS:
        points = " x ".join(map(str, found.values.shape))
        smaller = "export a part of the scan, or every second point"
        raise InputError(f"{path}: {points} points; at most {MOST_POINTS} are read: {smaller}")
    unit, spacing = _settled(path, found, unit, spacing)
    scan = topography(found.values * _metres(path, unit), *spacing, str(path), f"{found.words} in {unit}")
    deviation, diagonal = float(np.std(scan.heights)), math.hypot(scan.grid.nx * scan.dx, scan.grid.ny * scan.dy)
    if not deviation < diagonal:
        raise InputError(
            f"{path}: heights scatter by {deviation:.3g} m over a scan of {diagonal:.3g} m; they must scatter by less "
            f"than its length; they go from {np.min(scan.heights):.4g} to {np.max(scan.heights):.4g} m: check the "
            "units, and that neither end stands for missing points"
        )
    return scan


def _read(path: Path) -> Reading:
    """What a file holds. A reader of instruments' files can fail in any way on a damaged one."""
    with path.open("rb") as file:
        start = file.read(4096)
    if not start:
        raise InputError(f"{path}: empty; export it again")
    suffix, header = path.suffix.lower(), None
    if suffix in TEXT and (start.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" not in start):
        try:
            return read_table(path)
        except NoMatrix as error:
            header = error
    try:
        return _read_netcdf(path) if suffix == ".nc" else _read_instrument(path, start, header)
    except InputError:
        raise
    except Exception as error:
        if "unit" in str(error).lower():
            raise InputError(f"{path}: no unit of length for heights or distances ({error}); export lengths") from error
        reason = (str(error).strip().splitlines() or ["no reason given"])[0][:200]
        raise InputError(f"{path}: truncated or damaged ({type(error).__name__}: {reason}); export it again") from error


def _settled(
    path: Path, found: Reading, unit: str | None, spacing: tuple[float, float] | None
) -> tuple[str, tuple[float, float]]:
    """Unit of heights and spacing [m]: each of the file or given, one of them alone.

    unit, spacing : given. Raises InputError with all that is missing or twice there.
    """
    rows = (
        ("unit of heights", "unit", found.unit, unit),
        ("spacing", "spacing", found.spacing, spacing),
    )
    wrong = [
        f"the file gives its {what}, {own}; remove {key} = {said}" for what, key, own, said in rows if own and said
    ]
    absent = [(what, key) for what, key, own, said in rows if not own and not said]
    if absent:
        what, keys = (" and ".join(names) for names in zip(*absent, strict=True))
        wrong.append(f"the file does not give its {what}; set {keys}")
    unit, spacing = found.unit or unit, found.spacing or spacing
    if wrong or unit is None or spacing is None:
        keys = "roughness.scan.height_unit, roughness.scan.spacing_m"
        raise InputError(f"{path}: {'; '.join(wrong)}", scene_keys=keys)
    return unit, spacing


def _metres(path: Path, unit: str) -> float:
    """One of that unit [m]."""
    if unit not in METRES:
        raise InputError(
            f"{path}: values in {unit!r}, which is not a unit of length: allowed are {', '.join(METRES)}; "
            "export heights as a length"
        )
    return METRES[unit]


def _read_netcdf(path: Path) -> Reading:
    """A variable `heights(x, y)` with attribute `units`, and coordinates x, y with theirs.

    `mask`, where there is one, is 1 at missing points. SurfaceTopography calls the attributes `unit`.
    """
    with netCDF4.Dataset(path) as file:
        if "heights" not in file.variables:
            raise InputError(f"{path}: no variable heights; it has {', '.join(file.variables) or 'none'}")
        heights = file["heights"]
        if sorted(heights.dimensions) != ["x", "y"]:
            raise InputError(f"{path}: heights over {', '.join(heights.dimensions)}; a map is over x and y")
        steps = [_step(path, file[axis]) for axis in "xy" if axis in file.variables]
        values = np.ma.filled(np.ma.asarray(heights[:], dtype=np.float64), np.nan)
        if "mask" in file.variables:
            values[np.ma.filled(file["mask"][:], 1) != 0] = np.nan
        spacing = (steps[0], steps[1]) if len(steps) == 2 else None
        values = values if heights.dimensions == ("x", "y") else values.T
        return Reading(values, _unit(heights), spacing, "variable 'heights'")


def _unit(variable: netCDF4.Variable) -> str | None:
    return next((str(getattr(variable, name)) for name in ("units", "unit") if name in variable.ncattrs()), None)


def _step(path: Path, axis: netCDF4.Variable) -> float:
    """[m] between neighbouring points of an axis."""
    unit = _unit(axis)
    if axis.ndim != 1 or len(axis) < 2 or unit is None:
        raise InputError(f"{path}: coordinate {axis.name} needs at least two points and an attribute 'units'")
    steps = np.diff(np.asarray(axis[:], dtype=np.float64)) * _metres(path, unit)
    if not (steps[0] > 0.0 and np.allclose(steps, steps[0], rtol=1e-3, atol=0.0)):
        raise InputError(
            f"{path}: coordinate {axis.name} does not increase in equal steps; a scan has one spacing an axis"
        )
    return float(np.mean(steps))


def _read_instrument(path: Path, start: bytes, header: NoMatrix | None) -> Reading:
    """Heights of an instrument's file.

    start : the first bytes. A reader that they prove reports the damage of a file; trying all readers hides it
    header : the error of text that is no matrix, raised where no reader knows the file
    """
    try:
        import SurfaceTopography as library  # for instrument files alone: its import takes two seconds
    except ImportError as error:
        install = "install it with: pip install 'roughslip[scans]'"
        raise InputError(f"{path}: files of instruments need SurfaceTopography; {install}") from error
    proven = [reader for reader in library.IO.readers if reader.can_read(start[:512]) is library.IO.MagicMatch.YES]
    try:
        reader = library.open_topography(path, format=proven[0].format() if len(proven) == 1 else None)
        if reader.format() == "hgt":  # radar maps of the Earth: the reader accepts any file of 2 n^2 bytes
            raise library.IO.CannotDetectFileFormat("no signature")
    except library.IO.CannotDetectFileFormat as error:
        known = "allowed are instrument files, .nc and text such as .txt and .csv"
        raise header or InputError(f"{path}: unknown format, or damaged; {known}") from error
    with reader:
        channel, words = _channel(path, reader.channels, named=reader.format() in ARRAYS)
        sizes = {} if channel.physical_sizes is not None else {"physical_sizes": (1.0, 1.0)}
        heights = np.ma.filled(np.ma.asarray(channel.topography(**sizes).heights(), dtype=np.float64), np.nan)
    # a text header may have a unit for x alone
    unit, spacing = channel.unit or channel.info.get("raw_metadata", {}).get("xunit"), None
    if channel.pixel_size is not None and unit in METRES:
        dx, dy = (float(step) * METRES[unit] for step in channel.pixel_size)
        spacing = dx, dy
    return Reading(heights.T if start.startswith(b"MATLAB 7.3") else heights, channel.unit, spacing, words)


def _channel(path: Path, channels: Sequence[Any], *, named: bool) -> tuple[Any, str]:
    """The channel of heights, and which it is in words. named : whether channels are arrays that may be anything"""
    maps = [channel for channel in channels if channel.is_height_channel and min(channel.nb_grid_pts) > 1]
    listed = ", ".join(channel.name for channel in (maps or channels)[:MOST_LISTED])
    if not maps:
        raise InputError(f"{path}: no channel of heights; it has {listed or 'no channel'}; export heights, as a length")
    chosen = [channel for channel in maps if channel.name.rpartition("/")[2].strip().lower() in NAMES]
    if named and len(maps) > 1 and len(chosen) != 1:
        raise InputError(f"{path}: {listed} can be the heights; export them alone, or call them heights")
    others = f" of {len(maps)} with heights ({listed})" if len(maps) > 1 else ""
    channel = chosen[0] if len(chosen) == 1 else maps[0]
    return channel, f"channel '{channel.name}'{others}"
