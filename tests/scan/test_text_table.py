"""Text as spreadsheets and instruments export it. No test here needs SurfaceTopography but those marked."""

import importlib.util

import numpy as np
import pytest

from roughslip.errors import InputError
from roughslip.scan.instrument_file import read_scan

instruments = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None, reason="needs SurfaceTopography (the extra `scans`)"
)

NX, NY = 36, 40
STATED = ((1e-6, 2e-6), "um")
KEYS = "set roughness.scan.height_unit and roughness.scan.spacing_m"
HEIGHTS = np.round(np.random.default_rng(61).standard_normal((NX, NY)), 4)  # [um]


def matrix(between=" ", decimal=".", rows=HEIGHTS.T, form="{:.4f}"):
    return "\n".join(between.join(form.format(z).replace(".", decimal) for z in row) for row in rows) + "\n"


def points(between=" ", decimal=".", header="", lateral=1.0):
    x, y = np.meshgrid(np.arange(NX) * 0.5, np.arange(NY) * 0.25, indexing="ij")
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
        (";".join(f"C{i}" for i in range(NX)) + "\n" + matrix(";"), "matrix, semicolons, after the line 'C0;", "utf-8"),
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
        (matrix(";", ",") + matrix(";"), f"in line {NY + 1}, column 1"),
        (matrix(" ").replace("\n", " x\n", 1), f"'x' in line 2, column {NX + 1}"),
        (matrix(";") + "1;2\n", f"2 values in line {NY + 1}, {NX} in line 1"),
        (matrix().replace(" ", " 1.234,5 ", 1), "'1.234,5' in line 1, column 2"),
        (matrix().replace(" ", " 1_000 ", 1), "'1_000' in line 1, column 2"),
        (matrix("|"), f"'{matrix('|')[:60]}' in line 1)"),
        (matrix() + "\n" + matrix(), f"a gap before line {NY + 2}, perhaps of two matrices"),
        (matrix(" ", ".", np.zeros((32**2, 4))), "1024 lines of 4 numbers; points have three, x, y and z"),
        (matrix(rows=np.where(HEIGHTS.T > 2.0, -9999.0, HEIGHTS.T)), "they go from -0.009999 to 1."),
        (matrix("\t", ".", np.vstack([np.arange(NX) * 0.5, HEIGHTS.T])), "the first row rises in equal steps"),
        (matrix(" ", ".", np.column_stack([np.arange(NY), HEIGHTS.T])), "the first column rises in equal steps"),
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
    assert (scan.heights.shape, scan.missing.sum()) == ((NX, NY), 1)


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
