"""Files with wrong bytes: a result or a scan is read as it was written, or refused in one line."""

from __future__ import annotations

from pathlib import Path
from random import Random

import netCDF4
import numpy as np
import pytest

from roughslip import store
from roughslip.errors import InputError, StoreError
from roughslip.scan.instrument_file import read_scan, write_x3p
from roughslip.scan.topography import Topography, topography

DAMAGES = 100


def damaged(content: bytes, random: Random) -> bytes:
    """With flipped bits, cut short, or with a piece overwritten."""
    found = bytearray(content)
    for _ in range(random.choice([1, 1, 3, 30])):
        found[random.randrange(len(found))] ^= 1 << random.randrange(8)
    if random.random() < 0.2:
        del found[random.randrange(len(found)) :]
    if random.random() < 0.2 and found:
        start = random.randrange(len(found))
        found[start : start + 8] = random.choice([b"\xff" * 8, b"\x00" * 8, b"\x7f" + b"\xff" * 7])
    return bytes(found)


def test_a_damaged_result_is_never_taken_for_another(tmp_path):
    """Never with a traceback."""
    path = tmp_path / "a.nc"
    values = np.random.default_rng(1).normal(size=(30, 5))
    whole = {
        "pressure": store.Variable(("sample", "node"), values, "Pa", "pressure"),
        "label": store.Variable(("node",), np.array(list("abcde")), "1", "label"),
    }
    store.write(path, whole, store.Key({"seed": 1}, "code"), {"first": 0})
    content, was = path.read_bytes(), store.read(path)
    refused = 0
    for number in range(DAMAGES):
        path.write_bytes(damaged(content, Random(number)))
        try:
            found = store.read(path)
        except StoreError as error:
            said = str(error)
            refused += 1
        else:
            said = "one line"
            assert found.attributes == was.attributes, number
            assert {name: found[name].tobytes() for name in ("pressure",)} == {"pressure": values.tobytes()}, number
            assert list(found["label"]) == list("abcde"), number
        assert len(said.splitlines()) == 1, number
    assert refused > DAMAGES / 2  # the rest hit what the file does not use


def a_scan() -> Topography:
    heights = 1e-7 * np.random.default_rng(2).normal(size=(40, 36))
    return topography(heights, 1e-6, 1e-6, "made")


def as_netcdf(path: Path) -> None:
    with netCDF4.Dataset(path, "w") as file:
        for name, size in (("x", 40), ("y", 36)):
            file.createDimension(name, size)
            axis = file.createVariable(name, "f8", (name,))
            axis.units, axis[:] = "m", 1e-6 * np.arange(size)
        heights = file.createVariable("heights", "f8", ("x", "y"))
        heights.units, heights[:] = "m", a_scan().heights


def as_text(path: Path) -> None:
    np.savetxt(path, a_scan().heights.T)


@pytest.mark.parametrize(
    ("name", "write", "stated"),
    [
        ("a.nc", as_netcdf, {}),
        ("a.x3p", lambda path: write_x3p(path, a_scan()), {}),
        ("a.txt", as_text, {"spacing": (1e-6, 1e-6), "unit": "m"}),
    ],
)
def test_a_damaged_scan_is_read_or_refused_in_a_line(tmp_path, name, write, stated):
    path = tmp_path / name
    write(path)
    content = path.read_bytes()
    assert read_scan(path, **stated).grid.shape == (40, 36)
    for number in range(DAMAGES // 2):
        path.write_bytes(damaged(content, Random(number)))
        try:
            scan = read_scan(path, **stated)
            said = f"{path}: {scan.grid.shape}"
        except InputError as error:
            said = str(error)
        assert str(path) in said, number
        assert len(said.splitlines()) == 1, number


@pytest.mark.parametrize("name", ["mask", "x"])
def test_what_goes_beside_heights_may_not_be_larger(tmp_path, name):
    """A few bytes of a file can stand for any number of values; they are refused before they are read."""
    path = tmp_path / "a.nc"
    with netCDF4.Dataset(path, "w") as file:
        for axis, size in (("x", 40), ("y", 36), ("far", 10**7)):
            file.createDimension(axis, size)
        heights = file.createVariable("heights", "f8", ("x", "y"))
        heights.units, heights[:] = "m", a_scan().heights
        file.createVariable(name, "f8", ("far",), chunksizes=(1000,)).units = "m"
    with pytest.raises(InputError, match=f"{name} has the shape \\(10000000,\\)"):
        read_scan(path, spacing=None if name == "x" else (1e-6, 1e-6))
