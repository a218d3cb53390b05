"""Files of scans, good and bad. What needs SurfaceTopography is skipped where it is not installed."""

import importlib.util

import netCDF4
import numpy as np
import pytest
from scipy.io import savemat

from roughslip.errors import InputError
from roughslip.scan.instrument_file import read_scan

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


def check_heights(scan):
    np.testing.assert_allclose(scan.heights[scan.measured], 1e-6 * HEIGHTS[scan.measured], rtol=1e-12)
    assert (scan.dx, scan.dy) == pytest.approx((DX, DY), rel=1e-12)


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


def test_a_netcdf_map_carries_its_units(tmp_path):
    """Of either order; what is wrong with one is said in a line."""
    path = tmp_path / "map.nc"
    for dims in (("x", "y"), ("y", "x")):
        write_netcdf(path, dims=dims)
        check_heights(read_scan(path))
    twice = refusal(path, (DX, DY), "nm")
    assert "file gives its unit of heights, um; remove unit = nm; the file gives its s" in twice
    write_netcdf(path, units=None)
    assert "does not give its unit of heights; set unit" in refusal(path)
    check_heights(read_scan(path, unit="um"))


def matrix(between=" ", decimal=".", rows=HEIGHTS.T, form="{:.4f}"):
    """A row for each y."""
    return "\n".join(between.join(form.format(z).replace(".", decimal) for z in row) for row in rows) + "\n"


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


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty; export it again"),
        (matrix(",", ","), "commas that separate and are decimal, in line 1"),
        (matrix(" ", ",", 1.0 + np.abs(HEIGHTS.T), "{:.3f}"), "whose comma is decimal or one of thousands"),
        (matrix(";", ",") + matrix(";"), f"in line {NY + 1}, column 1"),
        (matrix().replace(" ", " 1.234,5 ", 1), "'1.234,5' in line 1, column 2"),
        (matrix(rows=np.where(HEIGHTS.T > 2.0, -9999.0, HEIGHTS.T)), "they go from -0.009999 to 1."),
        (matrix(" ", ".", np.column_stack([np.arange(NY), HEIGHTS.T])), "the first column rises in equal steps"),
    ],
)
def test_what_has_several_meanings_or_none_is_named(tmp_path, text, words):
    path = tmp_path / "export.txt"
    path.write_text(text)
    assert words in refusal(path, *STATED)


def test_sizes_and_units_out_of_range(tmp_path):
    """All that is missing stands in one line; a unit in a line of headings is the file's own."""
    path = tmp_path / "plain.txt"
    path.write_text(matrix())
    keys = "set unit and spacing"
    assert f"does not give its unit of heights and spacing; {keys}" in refusal(path)
    assert "check the units" in refusal(path, (DX, DY), "mm")  # 1 mm of roughness on a scan of 0.02 mm
    path.write_text("Height [um]\n" + matrix(";"))
    check_heights(read_scan(path, (DX, DY)))
    assert "gives its unit of heights, um; remove unit = " in refusal(path, *STATED)


@instruments
def test_text_that_is_no_matrix_is_left_to_the_library(tmp_path):
    """Headers of sizes, and points x, y, z in any order; what it does not read is named."""
    path = tmp_path / "export.txt"
    header = "# Channel: Topography\n# Width: 18 µm\n# Height: 30 µm\n# Value units: um\n"
    path.write_text(header + matrix(), encoding="utf-8")
    check_heights(read_scan(path))
    assert read_scan(path).read.startswith("channel 'Topography' in")
    path.write_text(header.replace("Value", "Other") + matrix(), encoding="utf-8")
    check_heights(read_scan(path, unit="um"))
    path.write_text(header.replace("18", "18,0") + matrix(" ", ","), encoding="utf-8")
    assert "not a matrix of numbers ('Width: 18,0 µm' in line 2)" in refusal(path)
    x, y = np.meshgrid(np.arange(NX) * 0.5, np.arange(NY) * 0.75, indexing="ij")
    points = np.random.default_rng(62).permutation(np.column_stack([x.ravel(), y.ravel(), HEIGHTS.ravel()]))
    np.savetxt(path, points, "%.6f", delimiter=";")
    check_heights(read_scan(path, *STATED))


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
        assert "remove unit = nm" in refusal(path, None, "nm")
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
    cases = ({"amplitude": other, "Height": HEIGHTS, "x": np.ones((1, NX))}, {"data": HEIGHTS})
    for suffix, write in ((".npz", lambda path, arrays: np.savez(path, **arrays)), (".mat", savemat)):
        path = tmp_path / f"arrays{suffix}"
        for arrays in cases:
            write(path, arrays)
            check_heights(read_scan(path, *STATED))
        write(path, {"a": other, "b": HEIGHTS})
        assert "a, b can be the heights; export them alone, or call them heights" in refusal(path, *STATED)
    np.save(tmp_path / "a.npy", HEIGHTS)
    check_heights(read_scan(tmp_path / "a.npy", *STATED))
