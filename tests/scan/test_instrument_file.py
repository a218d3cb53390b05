"""Files of scans, good and bad. What needs SurfaceTopography is skipped where it is not installed."""

import importlib.util
import sys
from pathlib import Path
from types import SimpleNamespace

import netCDF4
import numpy as np
import pytest
from scipy.io import savemat

from roughslip.errors import InputError
from roughslip.scan import instrument_file
from roughslip.scan.instrument_file import _channel, read_scan

instruments = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None, reason="needs SurfaceTopography (the extra `scans`)"
)

NX, NY, DX, DY = 36, 40, 0.5e-6, 0.75e-6
HEIGHTS = np.round(np.random.default_rng(61).standard_normal((NX, NY)), 4)  # [um]
STATED = ((DX, DY), "um")
PLACES = 1e3 * DX * np.arange(NX)  # [mm]


def refusal(path, *stated):
    """The line of the error, which names the file."""
    with pytest.raises(InputError) as caught:
        read_scan(path, *stated)
    (line,) = caught.value.lines
    assert line.startswith(f"{path}: ")
    assert "\n" not in line
    return line


def check_heights(scan, spacing=(DX, DY)):
    np.testing.assert_allclose(scan.heights[scan.measured], 1e-6 * HEIGHTS[scan.measured], rtol=1e-12)
    assert (scan.dx, scan.dy) == pytest.approx(spacing, rel=1e-12)


def write_netcdf(path, *, units="um", dims=("x", "y"), x=PLACES):
    with netCDF4.Dataset(path, "w") as file:
        for name, places in (("x", x), ("y", 1e3 * DY * np.arange(NY))):
            file.createDimension(name, len(places))
            axis = file.createVariable(name, "f8", (name,))
            axis[:], axis.units = places, "mm"
        heights = file.createVariable("heights", "f8", dims)
        heights[:] = HEIGHTS if dims == ("x", "y") else HEIGHTS.T
        if units is not None:
            heights.units = units


@pytest.mark.parametrize("dims", [("x", "y"), ("y", "x")])
def test_a_netcdf_map_carries_its_units(tmp_path, dims):
    path = tmp_path / "map.nc"
    write_netcdf(path, dims=dims)
    check_heights(read_scan(path))


def test_bad_netcdf_maps(tmp_path):
    path = tmp_path / "map.nc"
    write_netcdf(path, units=None)
    assert "does not give its unit of heights; set roughness.scan.height_unit" in refusal(path)
    check_heights(read_scan(path, unit="um"))
    write_netcdf(path, units="V")
    assert "'V', which is not a unit of length" in refusal(path)
    write_netcdf(path)
    twice = refusal(path, (DX, DY), "nm")
    assert (
        "the file gives its unit of heights, um; remove roughness.scan.height_unit = nm; the file gives its s" in twice
    )
    write_netcdf(path, x=np.arange(NX) ** 2 * 1e-3)
    assert "does not increase in equal steps" in refusal(path)
    path.write_bytes(path.read_bytes()[:2000])
    assert "truncated or damaged" in refusal(path)
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("x", 3)
    assert "no variable heights; it has none" in refusal(path)


def matrix(between=" ", decimal=".", rows=HEIGHTS.T, form="{:.4f}"):
    """A row for each y."""
    return "\n".join(between.join(form.format(z).replace(".", decimal) for z in row) for row in rows) + "\n"


def points(between=" ", decimal=".", header="", lateral=1.0):
    """In any order, with coordinates in um."""
    x, y = np.meshgrid(np.arange(NX) * 0.5, np.arange(NY) * 0.75, indexing="ij")
    rows = np.column_stack([lateral * x.ravel(), lateral * y.ravel(), HEIGHTS.ravel()])
    return header + matrix(between, decimal, np.random.default_rng(62).permutation(rows), "{:.6f}")


@pytest.mark.parametrize(
    ("text", "words", "encoding"),
    [
        (matrix(), "matrix, heights", "utf-8-sig"),
        (matrix("\t"), "matrix, heights", "utf-16"),
        (matrix("\t  "), "matrix, heights", "utf-8"),
        (matrix("\t", ","), "matrix, decimal commas, heights", "utf-8"),
        (matrix(", "), "matrix, commas, heights", "utf-8"),
        (matrix(";", ",").replace("\n", ";\r\n"), "matrix, semicolons, decimal commas, heights", "utf-8"),
        (matrix('","', ",").replace("\n", '"\n"')[:-1].join('"\n'), "matrix, commas, heights", "utf-8"),
        ("Höhe über Grund\n" + matrix(";"), "matrix, semicolons, after the line 'Höhe über Grund', heights", "latin-1"),
        (";".join(f"C{i}" for i in range(NX)) + "\n" + matrix(";"), "matrix, semicolons, after the line 'C0;", "utf-8"),
        ("# a comment\n\n" + matrix(), "matrix, heights", "utf-8"),
        ("sep=;\n" + matrix(";").replace("-", "\u2212"), "matrix, semicolons, heights", "utf-8"),
        (points(), "points x, y, z, heights", "utf-8"),
        (points(";", ",", "x;y;z\n"), "points x, y, z, semicolons, decimal commas, after the line 'x;y;z', h", "utf-8"),
    ],
)
def test_what_has_one_meaning_is_read(tmp_path, text, words, encoding):
    path = tmp_path / "export.csv"
    path.write_bytes(text.encode(encoding))
    scan = read_scan(path, *STATED)
    check_heights(scan)
    assert scan.read.startswith(words)
    assert "cut off" not in scan.read  # as an empty column after separators at the ends of lines would be


@pytest.mark.parametrize("word", ["BAD", "---", "#N/A", "", "inf", "No Data"])
def test_words_for_missing_points(tmp_path, word):
    path = tmp_path / "export.csv"
    rows = [line.split(";") for line in matrix(";", ",").splitlines()]
    rows[7][3] = rows[0][0] = word
    path.write_text("\n".join(";".join(row) for row in rows))
    scan = read_scan(path, *STATED)
    assert list(zip(*np.nonzero(scan.missing), strict=True)) == [(0, 0), (3, 7)]
    check_heights(scan)


def test_a_point_without_a_line_is_missing(tmp_path):
    path = tmp_path / "export.xyz"
    path.write_text("\n".join(points().splitlines()[1:]))
    scan = read_scan(path, *STATED)
    assert (scan.heights.shape, scan.missing.sum()) == ((NX, NY), 1)
    check_heights(scan)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty; export it again"),
        ("# no numbers\n\n", "empty; a matrix has a row of numbers"),
        ("1 2 3\n" * 3, "at least 32"),
        (matrix(",", ","), "commas that separate and are decimal, in line 1"),
        (matrix(" ", ",", 1.0 + np.abs(HEIGHTS.T), "{:.3f}"), "whose comma is decimal or one of thousands"),
        (matrix(";", ",") + matrix(";"), f"in line {NY + 1}, column 1"),
        (matrix(";") + "1;2\n", f"2 values in line {NY + 1}, {NX} in line 1"),
        (matrix().replace(" ", " 1.234,5 ", 1), "'1.234,5' in line 1, column 2"),
        (matrix().replace(" ", " 1_000 ", 1), "'1_000' in line 1, column 2"),
        (matrix(" ", ".", np.zeros((32**2, 4))), "1024 lines of 4 numbers; points have three, x, y and z"),
        (matrix(rows=np.where(HEIGHTS.T > 2.0, -9999.0, HEIGHTS.T)), "they go from -0.009999 to 1."),
        (matrix("\t", ".", np.vstack([np.arange(NX) * 0.5, HEIGHTS.T])), "the first row rises in equal steps"),
        (matrix(" ", ".", np.column_stack([np.arange(NY), HEIGHTS.T])), "the first column rises in equal steps"),
        (points() + points(), "several heights at one place"),
        (points().replace("0.500000 ", "0.600000 "), "x of the points does not increase in equal steps"),
        (points().replace("17.500000 ", "nan ", 1), "a point without x; each needs both coordinates, below 1e+12"),
        (points(lateral=0.0), "all points have one x"),
        (points().replace(" 0.750000", " 1.500000"), "several heights at one place"),
    ],
)
def test_what_has_several_meanings_or_none_is_named(tmp_path, text, words):
    path = tmp_path / "export.txt"
    path.write_text(text)
    assert words in refusal(path, *STATED)


def test_sizes_and_units_out_of_range(tmp_path, monkeypatch):
    path = tmp_path / "plain.txt"
    path.write_text(matrix())
    assert "check the units" in refusal(path, (DX, DY), "mm")  # 1 mm of roughness on a scan of 0.02 mm
    assert "an unknown unit; allowed are m, mm" in refusal(path, (DX, DY), "inch")
    monkeypatch.setattr(instrument_file, "MOST_POINTS", NX * NY)
    check_heights(read_scan(path, *STATED))
    monkeypatch.setattr(instrument_file, "MOST_POINTS", NX * NY - 1)
    assert f"{NX} x {NY} points; at most {NX * NY - 1} are read" in refusal(path, *STATED)
    assert "no such file" in refusal(tmp_path / "absent.al3d")


@pytest.mark.parametrize("text", [points(), matrix(";", ",")])
def test_all_that_is_missing_stands_in_one_line(tmp_path, text):
    path = tmp_path / "export.csv"
    path.write_text(text)
    line = refusal(path)
    if text == points():
        assert "has another ratio than the file (its points lie 0.5 x 0.75 apart" in refusal(path, (DX, DX), "um")
    keys = "set roughness.scan.height_unit and roughness.scan.spacing_m"
    assert f"does not give its unit of heights and spacing; {keys}" in line
    assert ("its points lie 0.5 x 0.75 apart" in line) == (text == points())
    assert "not give its spacing; set roughness.scan.spacing_m" in refusal(path, None, "um")


def test_units_in_a_line_of_headings(tmp_path):
    """Of x, y and z, or of the heights alone: they are the file's own, and a scene may not state others."""
    path = tmp_path / "export.csv"
    path.write_bytes(points(";", ",", "x [mm];y [mm];z (µm)\n", lateral=1e-3).encode("latin-1"))
    check_heights(read_scan(path))
    path.write_text("Height [um]\n" + matrix(";"))
    check_heights(read_scan(path, (DX, DY)))
    assert "gives its unit of heights, um; remove roughness.scan.height_unit" in refusal(path, *STATED)


@instruments
def test_a_header_of_sizes_is_read_by_its_reader_or_named(tmp_path):
    path = tmp_path / "export.txt"
    header = "# Channel: Topography\n# Width: 18 µm\n# Height: 30 µm\n# Value units: um\n"
    path.write_text(header + matrix(), encoding="utf-8")
    check_heights(read_scan(path))
    assert read_scan(path).read.startswith("channel 'Topography' in")
    path.write_text(header.replace("Value", "Other") + matrix(), encoding="utf-8")
    check_heights(read_scan(path, unit="um"))
    path.write_text(header.replace("18", "18,0") + matrix(" ", ","), encoding="utf-8")
    assert "not a matrix of numbers ('Width: 18,0 µm' in line 2)" in refusal(path)


@instruments
def test_instrument_files(tmp_path):
    """The library writes them; missing points stay missing."""
    from SurfaceTopography import Topography as Theirs

    heights = np.ma.masked_array(HEIGHTS, mask=np.zeros((NX, NY), dtype=bool))
    heights[5:7, 9] = np.ma.masked
    theirs = Theirs(heights, (NX * DX * 1e6, NY * DY * 1e6), unit="µm", info={"acquisition_time": "2020-01-01"})
    theirs.to_netcdf(str(tmp_path / "a.nc"))
    theirs.to_x3p(str(tmp_path / "a.x3p"))
    for path in (tmp_path / "a.nc", tmp_path / "a.x3p"):
        scan = read_scan(path)
        check_heights(scan)
        np.testing.assert_array_equal(scan.missing, heights.mask)
        assert "remove roughness.scan.height_unit = nm" in refusal(path, None, "nm")
    path.write_bytes(path.read_bytes()[:500])
    assert "unknown format, or damaged" in refusal(path)
    path.write_bytes(np.random.default_rng(52).bytes(2 * 64**2))  # 2 n^2 bytes: not taken for a radar map of the Earth
    assert "unknown format, or damaged" in refusal(path)
    path.write_bytes(b"AliconaImaging\x00\r\nVersion")
    assert "truncated or damaged (" in refusal(path)


@instruments
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # the library leaves .npy files open
def test_arrays_are_read_by_name_or_listed(tmp_path):
    """x is the first index; neither the first array of the file nor the first of the alphabet."""
    other = np.ones((NX, NY))
    for suffix, write in ((".npz", lambda path, **arrays: np.savez(path, **arrays)), (".mat", savemat_of)):
        path = tmp_path / f"arrays{suffix}"
        write(path, amplitude=other, Height=HEIGHTS, x=np.ones((1, NX)))
        check_heights(read_scan(path, *STATED))
        write(path, data=HEIGHTS, x=np.ones((1, NX)))  # the only map
        check_heights(read_scan(path, *STATED))
        write(path, a=other, b=HEIGHTS)
        assert "a, b can be the heights; export them alone, or call them heights" in refusal(path, *STATED)
    np.save(tmp_path / "a.npy", HEIGHTS)
    check_heights(read_scan(tmp_path / "a.npy", *STATED))


def savemat_of(path, **arrays):
    savemat(path, arrays)


@pytest.mark.parametrize(("names", "read"), [("ab", "a"), (["a", "Topography"], "Topography"), (["a", "z", "Z"], "a")])
def test_the_only_channel_with_a_name_of_heights_is_read_else_the_first(names, read):
    channels = [SimpleNamespace(name=name, is_height_channel=True, nb_grid_pts=(9, 9)) for name in names]
    assert _channel(Path("scan.opd"), channels, named=False)[0] is channels[list(names).index(read)]
    for channel in channels:
        channel.is_height_channel = False
    with pytest.raises(InputError, match=f"no channel of heights; it has {', '.join(names)}; export heights"):
        _channel(Path("scan.opd"), channels, named=False)


def test_without_the_library_the_line_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)  # as if it were not installed
    path = tmp_path / "scan.al3d"
    path.write_bytes(b"AliconaImaging\x00\r\n")
    assert "pip install 'roughslip[scans]'" in refusal(path)
