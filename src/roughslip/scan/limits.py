"""Limits of scan files, checked before heights are read: sizes and links.

Each check raises InputError with a line that names the file.
"""

from __future__ import annotations

import math
from pathlib import Path

import h5py

from roughslip.errors import InputError

MOST_POINTS = 2**23  # statistics of so many points take some 2 GB
MOST_BYTES = 2**29
# [bytes] The library of the instruments' formats takes some thirty times as much for text with a header.
MOST_TEXT = 2**26
SMALLER = "export a part of the scan, or every second point"


def check_size(path: Path) -> None:
    """Refuses a file of more than MOST_BYTES."""
    if path.stat().st_size > MOST_BYTES:
        raise InputError(
            f"{path}: {path.stat().st_size / 1e6:.0f} MB; at most {MOST_BYTES / 1e6:.0f} MB are read: {SMALLER}"
        )


def check_text(path: Path) -> None:
    """Refuses text, a file that begins without a zero byte, of more than MOST_TEXT."""
    with path.open("rb") as file:
        is_text = b"\0" not in file.read(4096)
    if is_text and path.stat().st_size > MOST_TEXT:
        raise InputError(
            f"{path}: {path.stat().st_size / 1e6:.0f} MB of text; at most {MOST_TEXT / 1e6:.0f} MB are read: {SMALLER}"
        )


def check_points(path: Path, shape: tuple[int, ...]) -> None:
    """Refuses heights of that shape that are no map, or one of more than MOST_POINTS."""
    if len(shape) != 2:
        raise InputError(f"{path}: holds {len(shape)}-dimensional heights; a map of heights has two dimensions")
    if math.prod(shape) > MOST_POINTS:
        raise InputError(f"{path}: {shape[0]} x {shape[1]} points; at most {MOST_POINTS} are read: {SMALLER}")


def check_hdf5(path: Path) -> None:
    """Refuses HDF5 and netCDF-4 files with links or external values."""
    if not h5py.is_hdf5(path):
        return
    refused: list[str] = []

    def look_at_link(name: str, link: object) -> None:
        if not isinstance(link, h5py.HardLink):
            refused.append(f"{name} is a link")

    def look_at(name: str, part: h5py.Group | h5py.Dataset) -> None:
        if isinstance(part, h5py.Dataset) and (part.is_virtual or part.external):
            refused.append(f"{name} has its values elsewhere")

    try:
        with h5py.File(path) as file:
            file.visititems_links(look_at_link)
            if not refused:
                file.visititems(look_at)
    except (OSError, RuntimeError, ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path}: truncated or damaged ({first_line(error)}); export it again") from error
    if refused:
        raise InputError(f"{path}: {refused[0]}; export the heights alone, into a file of their own")


def first_line(error: Exception) -> str:
    """The message of an error of a library, on one line."""
    return (str(error).strip().splitlines() or ["no reason given"])[0][:200]
