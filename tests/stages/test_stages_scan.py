"""Stage scan as a user runs it: a bad scan ends in one line that names the file, a rim without heights is cut off."""

import importlib.util
import json
import sys

import numpy as np
import pytest

from roughslip import store
from roughslip.grid import Grid
from roughslip.scan.instrument_file import write_x3p
from roughslip.scan.topography import Topography
from roughslip.stages import scan
from roughslip.stages.runtime import command
from roughslip.stages.runtime.command import execute
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

instruments = pytest.mark.skipif(
    importlib.util.find_spec("SurfaceTopography") is None, reason="needs SurfaceTopography (the extra `scans`)"
)

N, STEP = 96, 1e-6
STATED = {"spacing_x_m": STEP, "spacing_y_m": STEP, "height_unit": "nm"}
MODELS = {"form": "plane", "covariance": "exponential", "marginal": "gaussian"}


@pytest.fixture(scope="module")
def heights():
    field = embed(covariance_of("exponential", 1e-7, 4e-6), Grid(N, N, STEP, STEP)).sample(np.random.default_rng(41))
    return np.round(field, 12)


@pytest.fixture
def run(tmp_path, monkeypatch):
    monkeypatch.setattr(command, "die_with_parent", lambda: None)

    def run(file, **wanted):
        key = tmp_path / "key.json"
        configuration = {"roughness": {"scan": {**MODELS, **wanted}}}
        key.write_text(json.dumps({"configuration": configuration, "code": "abc"}), encoding="utf-8")
        output = tmp_path / "out.nc"
        files = ["--key", key, "--scan", file, "--output", output, "--usage", tmp_path / "usage.json"]
        monkeypatch.setattr(sys, "argv", ["scan", *map(str, files)])
        execute(scan.STAGE, scan.work)
        return store.read(output)

    return run


@pytest.fixture
def check_refused(run, capsys, tmp_path, recwarn):
    def check_refused(file, words, **wanted):
        with pytest.raises(SystemExit) as stop:
            run(file, **wanted)
        assert stop.value.code == 1
        (line,) = capsys.readouterr().err.splitlines()
        assert line.startswith("scan: ")
        assert words in line
        assert not (tmp_path / "out.nc").exists()
        assert [str(one.message) for one in recwarn if issubclass(one.category, UserWarning)] == []
        return line

    return check_refused


def matrix(path, heights):
    np.savetxt(path, 1e9 * heights.T, fmt="%.6g")
    return path


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda z: np.full_like(z, np.nan), "no point has a height"),
        (lambda z: z[:, :1], "96 x 1 points with heights; a scan needs at least 32 on each axis"),
        (lambda z: z[:1], "1 x 96 points with heights"),
        (lambda z: np.full_like(z, 3e-7), "all heights are equal"),
        (lambda z: np.where(np.random.default_rng(2).random(z.shape) < 0.3, np.nan, z), "may be missing"),
    ],
    ids=["all missing", "one row", "one column", "constant", "holes"],
)
def test_heights_that_are_no_scan(check_refused, tmp_path, heights, change, words):
    path = matrix(tmp_path / "bad.txt", change(heights))
    assert check_refused(path, words, **STATED).startswith(f"scan: {path}: ")


def test_a_rim_without_heights_is_cut_off(run, tmp_path, heights):
    """Five rows and three columns; the statistics are those of what is left, a hole in it filled."""
    ragged = heights.copy()
    ragged[:5], ragged[:, -3:] = np.nan, np.nan
    ragged[40:42, 50] = np.nan
    found = run(matrix(tmp_path / "rim.txt", ragged), **STATED)
    assert list(found["points"]) == [N - 5, N - 3]
    assert found["missing"] == pytest.approx(2 / (N - 5) / (N - 3))
    inside = heights[5:, :-3]
    assert found["rms_height"] == pytest.approx(np.std(inside), rel=0.05)  # a plane and two points less
    assert np.isfinite(found["map"]).all()


def test_files_that_are_no_text_of_heights(check_refused, tmp_path, heights):
    empty = tmp_path / "empty.txt"
    empty.write_bytes(b"")
    check_refused(empty, "empty; export it again", **STATED)
    empty.write_text("# no numbers\n\n")
    check_refused(empty, "empty; a matrix has a row of numbers", **STATED)
    cut = matrix(tmp_path / "cut.txt", heights)
    cut.write_bytes(cut.read_bytes()[:30001])
    check_refused(cut, "not a matrix of numbers", **STATED)
    check_refused(tmp_path / "absent.x3p", "no such file")
    check_refused(tmp_path, "no such file")
    check_refused(
        matrix(tmp_path / "volt.txt", heights), "'V', an unknown unit; known are m,", **{**STATED, "height_unit": "V"}
    )


@instruments
def test_files_of_instruments(check_refused, tmp_path, heights):
    foreign = tmp_path / "scan.foo"
    foreign.write_bytes(b"hello " * 99)
    check_refused(foreign, "unknown format, or damaged")
    bare = matrix(tmp_path / "bare.txt", heights)
    check_refused(bare, "does not give its unit of heights; state it")
    header = f"# Width: {N} um\n# Height: {N} um\n"
    volts = tmp_path / "volts.txt"
    volts.write_text(f"{header}# Value units: V\n{bare.read_text()}")
    check_refused(volts, "heights in m, mm, ")
    cut = tmp_path / "cut.txt"
    cut.write_text(f"{header}# Value units: nm\n{bare.read_text()[:30001]}")
    check_refused(cut, "no matrix of heights")
    whole = tmp_path / "scan.x3p"
    write_x3p(whole, Topography(heights, STEP, STEP, np.zeros(heights.shape, dtype=bool)))
    whole.write_bytes(whole.read_bytes()[:5000])
    check_refused(whole, "truncated or damaged archive")


def test_a_law_that_the_heights_do_not_have(check_refused, tmp_path, heights):
    """Cubed heights have long tails on both sides: excess kurtosis some 30, which no beta law of small skewness has."""
    path = matrix(tmp_path / "tails.txt", heights**3 / np.std(heights) ** 2)
    line = check_refused(path, "nearest", **{**STATED, "marginal": "beta"})
    assert "use an empirical distribution" in line


def test_a_model_that_cannot_be_fitted_is_told_once(check_refused, tmp_path):
    """Heights independent from point to point: no lag has a correlation above 0.3, for whatever kind."""
    noise = 1e-7 * np.random.default_rng(42).standard_normal((N, N))
    line = check_refused(
        matrix(tmp_path / "noise.txt", noise), "take the measured one", **{**STATED, "covariance": "best"}
    )
    assert line.count("give shorter lags") == 1
    assert "gaussian, exponential, separable_exponential, matern, self_affine: fewer than 3 lags" in line


def test_the_log_says_what_a_model_misses(run, capsys, tmp_path, heights):
    run(matrix(tmp_path / "scan.txt", heights), **STATED)
    assert "misses" not in capsys.readouterr().err
    x = np.arange(N) / N
    waves = heights + 8e-8 * np.sin(2 * np.pi * (5 * x[:, None] + 4 * x))  # no exponential falls as they do
    run(matrix(tmp_path / "waves.txt", waves), **STATED)
    said = capsys.readouterr().err
    assert "exponential misses the autocorrelation by" in said
    assert "exponential misses the 1/e length along x" in said
    long = embed(covariance_of("exponential", 1e-7, 1.6e-5), Grid(256, 256, STEP, STEP)).sample(
        np.random.default_rng(43)
    )
    run(matrix(tmp_path / "long.txt", long), **{**STATED, "covariance": "gaussian"})
    assert "gaussian misses the spectrum by" in capsys.readouterr().err  # it has no short waves
