"""Files of scans, good and bad. What needs SurfaceTopography is skipped where it is not installed.

Text as spreadsheets and instruments export it. No test here needs SurfaceTopography but those marked.
"""

import hashlib
import importlib.util
import struct
import sys
import zipfile
from pathlib import Path
from types import SimpleNamespace

import h5py
import netCDF4
import numpy as np
import pytest
from scipy.io import savemat

from roughslip.errors import InputError
from roughslip.scan import reading
from roughslip.scan.instrument_file import _channel, read_scan, write_x3p
from roughslip.scan.topography import Topography

instruments = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None, reason="needs SurfaceTopography (the extra `scans`)"
)

NX, NY, DX, DY = 40, 34, 0.5e-6, 0.75e-6


@pytest.fixture(scope="module")
def heights():
    return np.random.default_rng(51).standard_normal((NX, NY)) * 1e-7


@pytest.fixture
def scan(heights):
    missing = np.zeros((NX, NY), dtype=bool)
    missing[5:7, 9] = True
    return Topography(heights, DX, DY, missing)


def write_netcdf(path, heights, *, units="um", dims=("x", "y"), **changes):
    with netCDF4.Dataset(path, "w") as file:
        for name, n, step in (("x", NX, DX), ("y", NY, DY)):
            file.createDimension(name, n)
            axis = file.createVariable(name, "f8", (name,))
            axis[:] = changes.get(name, np.arange(n) * step * 1e3)
            axis.units = "mm"
        z = file.createVariable("heights", "f4", dims)
        z[:] = (heights if dims == ("x", "y") else heights.T) * 1e6
        if units is not None:
            z.units = units


def check_refused(path, words, *, spacing=None, unit=None):
    with pytest.raises(InputError) as caught:
        read_scan(path, spacing, unit)
    assert len(caught.value.lines) == 1
    assert "\n" not in caught.value.lines[0]
    assert caught.value.lines[0].startswith(f"{path}: ")
    assert words in caught.value.lines[0]


def test_a_plain_matrix_has_a_row_for_each_y(tmp_path, heights):
    path = tmp_path / "plain.txt"
    np.savetxt(path, heights.T * 1e9, header="nanometres")
    scan = read_scan(path, (DX, DY), "nm")
    np.testing.assert_allclose(scan.heights, heights, rtol=1e-13)
    assert (scan.dx, scan.dy) == (DX, DY)


@pytest.mark.parametrize("dims", [("x", "y"), ("y", "x")])
def test_a_netcdf_map_carries_its_units(tmp_path, heights, dims):
    path = tmp_path / "map.nc"
    write_netcdf(path, heights, dims=dims)
    scan = read_scan(path)
    np.testing.assert_allclose(scan.heights, heights, rtol=1e-7)  # stored in single precision
    assert (scan.dx, scan.dy) == pytest.approx((DX, DY), rel=1e-12)


def test_bad_netcdf_maps(tmp_path, heights):
    path = tmp_path / "map.nc"
    write_netcdf(path, heights, units=None)
    check_refused(path, "does not give its unit of heights; set roughness.scan.height_unit")
    assert read_scan(path, unit="um").heights == pytest.approx(heights, rel=1e-6)
    write_netcdf(path, heights, units="V")
    check_refused(path, "'V', which is not a unit of length")
    write_netcdf(path, heights)
    check_refused(path, "remove roughness.scan.height_unit = nm", unit="nm")
    check_refused(path, "gives its spacing", spacing=(DX, DY))
    write_netcdf(path, heights, x=np.arange(NX) ** 2 * 1e-3)
    check_refused(path, "does not increase in equal steps")
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 2])
    check_refused(path, "truncated or damaged")
    with netCDF4.Dataset(path, "w") as file:
        file.createDimension("x", 3)
    check_refused(path, "holds no array of numbers with two dimensions; it has no array")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "empty; export it again"),
        ("# no numbers\n\n", "empty; a matrix has a row of numbers"),
        ("1 2\n3 four\n", "not a matrix of numbers"),
        ("1 2\n3\n", "not a matrix"),
        ("1 2 3\n" * 3, "at least 32"),
        ("1 2 3\n", "3 x 1 points"),
        ("1\n2\n3\n", "1 x 3 points"),
    ],
)
def test_bad_matrices(tmp_path, text, words):
    path = tmp_path / "bad.txt"
    path.write_text(text)
    check_refused(path, words, spacing=(DX, DY), unit="um")


def test_sizes_and_units_out_of_range(tmp_path, heights, monkeypatch):
    path = tmp_path / "plain.txt"
    np.savetxt(path, heights.T * 1e9)
    check_refused(path, "check the unit", spacing=(DX, DY), unit="m")  # 100 m of roughness on a scan of 0.02 mm
    check_refused(path, "m apart", spacing=(0.5, 0.75), unit="nm")
    check_refused(path, "an unknown unit; allowed are m, mm", spacing=(DX, DY), unit="inch")
    monkeypatch.setattr(reading, "MOST_POINTS", 1000)
    check_refused(path, "at most 1000 are read", spacing=(DX, DY), unit="nm")
    monkeypatch.setattr(reading, "MOST_BYTES", 1000)
    check_refused(path, "MB are read", spacing=(DX, DY), unit="nm")
    check_refused(tmp_path / "absent.al3d", "no such file")
    check_refused(tmp_path, "no such file")


def test_text_is_read_up_to_a_size_of_its_own(tmp_path, monkeypatch):
    path = tmp_path / "long.asc"
    path.write_text("# Width: 20 um\n" + "1.0 2.0\n" * 1000)
    monkeypatch.setattr(reading, "MOST_TEXT", path.stat().st_size)
    reading.check_text(path)
    monkeypatch.setattr(reading, "MOST_TEXT", 8000)
    check_refused(path, "0 MB of text; at most 0 MB are read")


def elsewhere(file, kind, other):
    """Heights that are not in the file: in another as bytes, as a data set, or behind a link."""
    if kind == "external":
        file.create_dataset("heights", (NX, NY), "u1", external=[(other, 0, NX * NY)])
    elif kind == "virtual":
        layout = h5py.VirtualLayout(shape=(NX, NY), dtype="f8")
        layout[:] = h5py.VirtualSource(other, "heights", shape=(NX, NY))
        file.create_virtual_dataset("heights", layout)
    else:
        file["heights"] = h5py.ExternalLink(other, "heights") if kind == "link" else h5py.SoftLink("/x")


@pytest.mark.parametrize("suffix", [".nc", ".h5"])
@pytest.mark.parametrize("kind", ["external", "virtual", "link", "soft link"])
def test_a_file_that_takes_its_values_from_another_is_refused(tmp_path, kind, suffix):
    """Results of an untrusted scan would publish the file that it points at."""
    path, other = tmp_path / f"scan{suffix}", str(tmp_path / "other.h5")
    with h5py.File(other, "w") as file:
        file["heights"] = np.zeros((NX, NY))
    with h5py.File(path, "w") as file:
        elsewhere(file, kind, other)
    words = "is a link" if "link" in kind else "has its values elsewhere"
    check_refused(path, f"heights {words}; export the heights alone, into a file of their own")


def test_what_lies_at_a_limit_is_not_refused(tmp_path, monkeypatch):
    """As many points, or bytes of the file, as the limit says."""
    whole = tmp_path / "whole.nc"
    with h5py.File(whole, "w") as file:
        file.create_dataset("heights", data=np.zeros((8, 4)), chunks=(8, 4))
    monkeypatch.setattr(reading, "MOST_POINTS", 8 * 4)
    reading.check_points(whole, (8, 4))
    reading.check_hdf5(whole)
    monkeypatch.setattr(reading, "MOST_BYTES", whole.stat().st_size)
    reading.check_size(whole)


def test_without_the_library_the_line_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)  # as if it were not installed
    path = tmp_path / "scan.al3d"
    path.write_bytes(b"AliconaImaging\x00\r\n")
    check_refused(path, "pip install 'roughslip[scans]'")


@instruments
def test_an_x3p_file_comes_back_as_it_was(tmp_path, scan):
    first, second = tmp_path / "a.x3p", tmp_path / "b.x3p"
    write_x3p(first, scan)
    write_x3p(second, scan)
    assert first.read_bytes() == second.read_bytes()
    again = read_scan(first)
    np.testing.assert_array_equal(again.missing, scan.missing)
    np.testing.assert_array_equal(again.heights[again.measured], scan.heights[again.measured])
    assert (again.dx, again.dy) == pytest.approx((DX, DY), rel=1e-14)
    with zipfile.ZipFile(first) as archive:
        assert {member.date_time for member in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}
        assert b"<Date>1980-01-01" in archive.read("main.xml")
        assert hashlib.md5(archive.read("main.xml")).hexdigest() in archive.read("md5checksum.hex").decode()


@instruments
def test_bad_instrument_files(tmp_path, scan):
    path = tmp_path / "scan.x3p"
    write_x3p(path, scan)
    whole = path.read_bytes()
    check_refused(path, "remove roughness.scan.height_unit = nm", unit="nm")
    path.write_bytes(whole[: len(whole) // 2])
    check_refused(path, "unknown format, or damaged")
    path.write_bytes(np.random.default_rng(52).bytes(2 * 64**2))  # 2 n^2 bytes: not taken for a radar map of the Earth
    check_refused(path, "unknown format, or damaged")
    path.write_bytes(b"AliconaImaging\x00\r\nVersion")
    check_refused(path, "truncated or damaged (")


@instruments
@pytest.mark.parametrize(
    ("header", "words"),
    [
        (
            "",
            "does not give its unit of heights and its spacing; set roughness.scan.height_unit and "
            "roughness.scan.spacing_m",
        ),
        ("# Width: 20 um\n# Height: 25.5 um\n", "does not give its unit of heights"),
        ("# Width: 20 um\n# Height: 25.5 um\n# Value units: a.u.\n", "values in 'a.u.', which is not a unit of length"),
        ("# Value units: V\n", "values in 'V', which is not a unit of length"),
        ("# Value units: nm\n", "does not give its spacing; set roughness.scan.spacing_m"),
    ],
)
def test_text_with_heights_in_unknown_units(tmp_path, heights, header, words):
    path = tmp_path / "export.asc"
    path.write_text(header + "\n".join(" ".join(f"{z:.9e}" for z in row) for row in heights.T * 1e9))
    check_refused(path, words)
    if header.endswith("25.5 um\n"):  # the size in the header, the unit of heights stated
        scan = read_scan(path, unit="nm")
        np.testing.assert_allclose(scan.heights, heights, rtol=1e-8)
        assert (scan.dx, scan.dy) == pytest.approx((DX, DY), rel=1e-12)


@instruments
def test_a_netcdf_map_of_the_library_is_read(tmp_path, scan):
    from SurfaceTopography import Topography as Theirs

    path = tmp_path / "theirs.nc"
    heights = np.ma.masked_array(scan.heights * 1e6, mask=scan.missing)
    Theirs(heights, (NX * DX * 1e6, NY * DY * 1e6), unit="µm").to_netcdf(str(path))
    again = read_scan(path)
    np.testing.assert_array_equal(again.missing, scan.missing)
    np.testing.assert_allclose(again.heights[again.measured], scan.heights[again.measured], rtol=1e-12)
    assert (again.dx, again.dy) == pytest.approx((DX, DY), rel=1e-12)


def as_h5(path, arrays):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values


def as_mat(path, arrays):
    savemat(path, {name.rpartition("/")[2]: values for name, values in arrays.items()})


def as_npz(path, arrays):
    np.savez(path, **{name.rpartition("/")[2]: values for name, values in arrays.items()})


@pytest.mark.parametrize(("suffix", "write"), [(".h5", as_h5), (".mat", as_mat), (".npz", as_npz)])
def test_of_several_arrays_the_heights_are_taken_by_name_or_all_are_listed(tmp_path, heights, suffix, write):
    """Neither the first of the file nor the first of the alphabet; the scene may name one."""
    path = tmp_path / f"arrays{suffix}"
    other = 50.0 * heights
    for name in ("height", "z", "Topography", "scan/Heights"):
        write(path, {"amplitude": other, name: 1e6 * heights, "x": np.ones((1, NX))})
        scan = read_scan(path, (DX, DY), "um")
        np.testing.assert_allclose(scan.heights, heights, rtol=1e-12)
        last = name if suffix == ".h5" else name.rpartition("/")[2]
        assert scan.read.startswith(f"array '{last}' in um; {NX} x {NY} points")
    write(path, {"data": 1e6 * heights, "x": np.ones((1, NX))})  # the only map
    np.testing.assert_allclose(read_scan(path, (DX, DY), "um").heights, heights, rtol=1e-12)
    for names in (("a", "b"), ("height", "z")):
        write(path, dict.fromkeys(names, heights) | ({"c": other} if "z" in names else {}))
        listed = ", ".join(f"'{name}' ({NX} x {NY})" for name in names)
        check_refused(
            path, f"{listed} can be the heights; name one of them in roughness.scan.array", spacing=(DX, DY), unit="um"
        )
    np.testing.assert_allclose(read_scan(path, (DX, DY), "um", "c").heights, 1e-6 * other, rtol=1e-12)
    with pytest.raises(InputError, match=r"no map of heights is named 'd' \(roughness\.scan\.array\); it has "):
        read_scan(path, (DX, DY), "um", "d")
    write(path, {"line": np.ones((1, NX)), "volume": np.ones((3, 3, 3))})
    check_refused(path, "it has 'line' (1 x 40), 'volume' (3 x 3 x 3)", spacing=(DX, DY), unit="um")


@pytest.mark.parametrize(("suffix", "write"), [(".h5", as_h5), (".mat", as_mat), (".npz", as_npz)])
def test_arrays_of_other_kinds_are_read_rightly_or_named(tmp_path, heights, suffix, write):
    """Whole numbers, other orders of bytes and a mask are heights; complex numbers and truth values are none."""
    path, whole = tmp_path / f"arrays{suffix}", np.round(1e9 * heights)
    for kind in ("<i2", ">i4", ">f8", "<f4"):
        write(path, {"z": whole.astype(kind)})
        np.testing.assert_allclose(read_scan(path, (DX, DY), "nm").heights, 1e-9 * whole, rtol=1e-12)
    write(path, {"z": whole, "mask": whole > 150.0})
    scan = read_scan(path, (DX, DY), "nm")
    np.testing.assert_array_equal(scan.missing, whole > 150.0)
    assert scan.read.startswith("array 'z' less its mask in nm;")
    write(path, {"z": whole > 0.0})
    check_refused(path, "it has 'z' (truth values)", spacing=(DX, DY), unit="nm")
    write(path, {"z": whole + 1j})
    check_refused(path, "complex numbers", spacing=(DX, DY), unit="nm")


def test_fill_values_and_a_single_array(tmp_path, heights):
    """The attribute _FillValue of HDF5 marks missing points; a `.npy` file has one array, without a name."""
    whole = np.round(1e9 * heights).astype("i2")
    whole[3, 4] = -32768
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file.create_dataset("z", data=whole).attrs["_FillValue"] = np.int16(-32768)
    assert list(zip(*np.nonzero(read_scan(tmp_path / "a.h5", (DX, DY), "nm").missing), strict=True)) == [(3, 4)]
    np.save(tmp_path / "a.npy", heights)
    np.testing.assert_array_equal(read_scan(tmp_path / "a.npy", (DX, DY), "m").heights, heights)


def test_a_netcdf_map_may_have_another_name(tmp_path, heights):
    path = tmp_path / "map.nc"
    write_netcdf(path, heights)
    with netCDF4.Dataset(path, "a") as file:
        file.renameVariable("heights", "z")
        file.createVariable("amplitude", "f4", ("x", "y"))[:] = 1.0
    assert read_scan(path).read.startswith("variable 'z' in um")
    with netCDF4.Dataset(path, "a") as file:
        file.renameVariable("z", "phase")
    check_refused(path, f"'phase' ({NX} x {NY}), 'amplitude' ({NX} x {NY}) can be the heights")
    assert read_scan(path, array="phase").read.startswith("variable 'phase' in um")


@instruments
def test_nonsense_of_a_file_is_not_laid_to_the_scene(tmp_path):
    """An .nms file whose points lie 300 mm apart: nothing that the scene states can be checked."""
    path = tmp_path / "scan.nms"
    header = bytearray(3468)
    struct.pack_into("<dd", header, 16, 0.0, 1.0)
    struct.pack_into("<IIdd", header, 1368, 40, 40, 300.0, 300.0)
    path.write_bytes(bytes(header) + np.arange(1600, dtype="<u2").tobytes())
    check_refused(path, "points 0.3 m apart; from 1e-11 to 1e-02 m are allowed: so its reader takes .nms files")


@pytest.mark.parametrize(("names", "read"), [("ab", "a"), (["a", "Topography"], "Topography"), (["a", "z", "Z"], "a")])
def test_the_only_channel_with_a_name_of_heights_is_read_else_the_first(names, read):
    channels = [SimpleNamespace(name=name, is_height_channel=True) for name in names]
    assert _channel(Path("scan.opd"), channels, None)[0] is channels[list(names).index(read)]


@pytest.mark.parametrize("packed", [False, True])
def test_a_matlab_file_that_is_cut_short_is_refused(tmp_path, heights, packed):
    path = tmp_path / "z.mat"
    arrays = {"z": 1e6 * heights, "other": np.ones(3), "text": "um", "s": {"a": 1.0}, "empty": np.zeros((0, 3))}
    savemat(path, arrays, do_compression=packed)
    whole = path.read_bytes()
    np.testing.assert_allclose(read_scan(path, (DX, DY), "um").heights, heights, rtol=1e-12)
    for cut in (140, 300, len(whole) // 2):
        path.write_bytes(whole[:cut])
        check_refused(path, "", spacing=(DX, DY), unit="um")


MX, MY = 36, 40
STATED = ((1e-6, 2e-6), "um")
KEYS = "set roughness.scan.height_unit and roughness.scan.spacing_m"
HEIGHTS = np.round(np.random.default_rng(61).standard_normal((MX, MY)), 4)  # [um]


def matrix(between=" ", decimal=".", rows=HEIGHTS.T, form="{:.4f}"):
    return "\n".join(between.join(form.format(z).replace(".", decimal) for z in row) for row in rows) + "\n"


def points(between=" ", decimal=".", header="", lateral=1.0):
    x, y = np.meshgrid(np.arange(MX) * 0.5, np.arange(MY) * 0.25, indexing="ij")
    rows = np.column_stack([lateral * x.ravel(), lateral * y.ravel(), HEIGHTS.ravel()])
    return header + matrix(between, decimal, np.random.default_rng(62).permutation(rows), "{:.6f}")


@pytest.mark.parametrize(
    ("text", "words", "encoding"),
    [
        (matrix(), "matrix, heights", "utf-8-sig"),
        (matrix("\t"), "matrix, heights", "utf-16"),
        (matrix("\t  "), "matrix, heights", "utf-8"),
        (matrix(" ", ","), "matrix, decimal commas, heights", "utf-8"),
        (matrix("\t", ","), "matrix, decimal commas, heights", "utf-8"),
        (matrix(","), "matrix, commas, heights", "utf-8"),
        (matrix(", "), "matrix, commas, heights", "utf-8"),
        (matrix(";"), "matrix, semicolons, heights", "utf-8"),
        (matrix(";", ",").replace("\n", ";\r\n"), "matrix, semicolons, decimal commas, heights", "utf-8"),
        (matrix('","', ",").replace("\n", '"\n"')[:-1].join('"\n'), "matrix, commas, heights", "utf-8"),
        ("Höhe über Grund\n" + matrix(";"), "matrix, semicolons, after the line 'Höhe über Grund', heights", "latin-1"),
        (
            ";".join(f"C{i}" for i in range(MX)) + "\n" + matrix(";"),
            "matrix, semicolons, after the line 'C0;",
            "utf-8",
        ),
        ("# a comment\n\n" + matrix(), "matrix, heights", "utf-8"),
        ("sep=;\n" + matrix(";"), "matrix, semicolons, heights", "utf-8"),
        (matrix().replace("-", "\u2212"), "matrix, heights", "utf-32"),
        (matrix().replace("-", "\u2212") + "# \u00b5ab\n", "matrix, heights", "utf-8"),  # 2 bytes of µ
        (matrix().replace("\n", "\n\n"), "matrix, heights", "utf-8"),
        (points(), "points x, y, z, heights", "utf-8"),
        (points(";", ",", "x;y;z\n"), "points x, y, z, semicolons, decimal commas, after the line 'x;y;z', h", "utf-8"),
    ],
)
def test_what_has_one_meaning_is_read(tmp_path, text, words, encoding):
    path = tmp_path / "export.csv"
    path.write_bytes(text.encode(encoding))
    spacing = (1e-6, 0.5e-6) if "points" in words else STATED[0]
    scan = read_scan(path, spacing, "um")
    np.testing.assert_allclose(scan.heights, 1e-6 * HEIGHTS, rtol=1e-12)
    assert (scan.dx, scan.dy) == spacing
    assert scan.read.startswith(words)
    assert "cut off" not in scan.read  # as an empty column after separators at the ends of lines would be


def test_the_fewest_points_make_a_map(tmp_path):
    """32 x 32, whose three columns are no matrix."""
    path, (x, y) = tmp_path / "export.xyz", np.indices((32, 32))
    path.write_text(matrix(rows=np.column_stack([x.ravel(), y.ravel(), HEIGHTS[:32, :32].ravel()])))
    np.testing.assert_allclose(read_scan(path, (1e-6, 1e-6), "um").heights, 1e-6 * HEIGHTS[:32, :32], rtol=1e-12)


@pytest.mark.parametrize("word", ["BAD", "---", "NaN", "n/a", "#N/A", "--", "", "inf", "No Data"])
def test_words_for_missing_points(tmp_path, word):
    path = tmp_path / "export.csv"
    rows = [line.split(";") for line in matrix(";", ",").splitlines()]
    rows[7][3] = rows[0][0] = word
    path.write_text("\n".join(";".join(row) for row in rows))
    scan = read_scan(path, *STATED)
    assert list(zip(*np.nonzero(scan.missing), strict=True)) == [(0, 0), (3, 7)]
    np.testing.assert_allclose(scan.heights[scan.measured], 1e-6 * HEIGHTS[scan.measured], rtol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (matrix(",", ","), "commas that separate and are decimal, in line 1"),
        (matrix(" ", ",", 1.0 + np.abs(HEIGHTS.T), "{:.3f}"), "whose comma is decimal or one of thousands"),
        (matrix(";", ",") + matrix(";"), f"in line {MY + 1}, column 1"),
        (matrix(" ").replace("\n", " x\n", 1), f"'x' in line 2, column {MX + 1}"),
        (matrix(";") + "1;2\n", f"2 values in line {MY + 1}, {MX} in line 1"),
        (matrix().replace(" ", " 1.234,5 ", 1), "'1.234,5' in line 1, column 2"),
        (matrix().replace(" ", " 1_000 ", 1), "'1_000' in line 1, column 2"),
        (matrix("|"), f"'{matrix('|')[:60]}' in line 1)"),
        (matrix() + "\n" + matrix(), f"a gap before line {MY + 2}, perhaps of two matrices"),
        (matrix(" ", ".", np.zeros((32**2, 4))), "1024 lines of 4 numbers; points have three, x, y and z"),
        (matrix(rows=np.where(HEIGHTS.T > 2.0, -9999.0, HEIGHTS.T)), "they go from -0.009999 to 1."),
        (matrix("\t", ".", np.vstack([np.arange(MX) * 0.5, HEIGHTS.T])), "the first row rises in equal steps"),
        (matrix(" ", ".", np.column_stack([np.arange(MY), HEIGHTS.T])), "the first column rises in equal steps"),
        (points() + points(), "several heights at one place"),
        (points().replace("0.500000 ", "0.600000 "), "x of the points does not increase in equal steps"),
        (points().replace("17.500000 ", "nan ", 1), "a point without x; each needs both coordinates, below 1e+12"),
        (points(lateral=1e12), "a point without x"),
        (points(lateral=0.0), "all points have one x"),
        (points(), "has another ratio than the file (its points lie 0.5 x 0.25 apart"),
    ],
)
def test_what_has_several_meanings_or_none_is_named(tmp_path, text, words):
    path = tmp_path / "export.txt"
    path.write_text("a matrix\n" + text if "line 2" in words else text)
    with pytest.raises(InputError) as caught:
        read_scan(path, (1e-6, 1e-6), "um")
    (line,) = caught.value.lines
    assert line.startswith(f"{path}: ")
    assert words in line


@pytest.mark.parametrize("suffix", [".txt", ".csv", ".dat", ".asc", ".xyz"])
def test_all_that_is_missing_stands_in_one_line(tmp_path, suffix):
    path = tmp_path / f"export{suffix}"
    path.write_text(points() if suffix == ".xyz" else matrix(";", ","))
    with pytest.raises(InputError, match=f"its unit of heights and its spacing; {KEYS}") as caught:
        read_scan(path)
    assert ("its points lie 0.5 x 0.25 apart" in str(caught.value)) == (suffix == ".xyz")
    with pytest.raises(InputError, match=r"not give its spacing; set roughness.scan.spacing_m"):
        read_scan(path, unit="um")


def test_units_in_a_line_of_headings(tmp_path):
    """Of x, y and z, or of the heights alone: they are the file's own, and a scene may not state others."""
    path = tmp_path / "export.csv"
    path.write_bytes(points(";", ",", "x [mm];y [mm];z (µm)\n", lateral=1e-3).encode("latin-1"))
    scan = read_scan(path)
    np.testing.assert_allclose(scan.heights, 1e-6 * HEIGHTS, rtol=1e-12)
    assert (scan.dx, scan.dy) == pytest.approx((0.5e-6, 0.25e-6), rel=1e-9)
    path.write_text("Height [nm]\n" + matrix(";"))
    np.testing.assert_allclose(read_scan(path, STATED[0]).heights, 1e-9 * HEIGHTS, rtol=1e-12)
    with pytest.raises(InputError, match=r"the file gives its unit of heights, nm; remove roughness.scan.height_unit"):
        read_scan(path, *STATED)


def test_a_point_without_a_line_is_missing(tmp_path):
    path = tmp_path / "export.xyz"
    path.write_text("\n".join(points().splitlines()[1:]))
    scan = read_scan(path, (1e-6, 0.5e-6), "um")
    assert (scan.heights.shape, scan.missing.sum()) == ((MX, MY), 1)


@instruments
def test_a_header_of_sizes_is_read_by_its_reader_or_named(tmp_path):
    """What the header gives may not be stated; where a reader takes none of the numbers, commas are named with it."""
    path = tmp_path / "export.txt"
    header = "# Channel: Topography\n# Width: 36 µm\n# Height: 80 µm\n# Value units: um\n"
    path.write_text(header + matrix(), encoding="utf-8")
    scan = read_scan(path)
    np.testing.assert_allclose(scan.heights, 1e-6 * HEIGHTS, rtol=1e-12)
    assert scan.read.startswith("channel 'Topography' in")
    with pytest.raises(InputError, match=r"gives its unit of heights.*; the file gives its spacing.*; remove"):
        read_scan(path, *STATED)
    path.write_text(header.replace("36", "36,0") + matrix(" ", ","), encoding="utf-8")
    with pytest.raises(InputError, match=r"'Width: 36,0 µm' in line 2, decimal commas in line 5"):
        read_scan(path)
