"""The stages of a scan: known heights, and files of a user, where a bad one ends in one line that names it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.stats import skew

from roughslip.errors import IllPosedError
from roughslip.figures.figure_scan import figure_scan
from roughslip.figures.style import Shown
from roughslip.grid import Grid
from roughslip.scan.covariance_fit import CovarianceFit
from roughslip.scan.topography import topography
from roughslip.scene.types import scene_of
from roughslip.study import scan
from roughslip.study.from_scene import surface_model
from roughslip.study.from_scene.domain import check_slope
from roughslip.surface.embedding import embed
from roughslip.surface.model import gaussian_model
from roughslip.surface.models import covariance_of

STRIP = {"window_m": 1e-4, "width_m": 2.5e-5, "cell_m": 5e-6}
SQ, DX, DY = 2e-7, 1e-6, 2e-6
GRID = Grid(160, 120, DX, DY)
CONFIGURATION = {
    "seed": 7,
    "targets": ["figure_scan"],
    "roughness": {"scan": {"form": "plane", "covariance": "best", "marginal": "gaussian"}},
}


@pytest.fixture(scope="module")
def heights():
    """Exponential, 8 um along x and 5 um across, with its own mean plane taken off."""
    model = gaussian_model(covariance_of("exponential", SQ, 8e-6, 5e-6), (8e-6, 5e-6), None, correct_correlation=False)
    z = model.sampler(GRID)(np.random.default_rng(4))
    x, y = np.meshgrid(GRID.x(), GRID.y(), indexing="ij")
    plane = np.column_stack([np.ones(z.size), x.ravel(), y.ravel()])
    return z - (plane @ np.linalg.lstsq(plane, z.ravel(), rcond=None)[0]).reshape(z.shape)


@pytest.fixture(scope="module")
def scanned(run, heights):
    """What stage `scan` makes of them, tilted. Files have tests of their own."""
    x, y = np.meshgrid(GRID.x(), GRID.y(), indexing="ij")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(scan, "read_scan", lambda *_: topography(heights + 0.01 * x - 0.02 * y + 1e-5, DX, DY, "scan"))
        return run(scan, CONFIGURATION, scan=Path("scan.txt"))


def test_a_scan_is_described_by_its_own_moments(scanned, heights):
    result = scanned
    np.testing.assert_allclose(result["map"], heights, rtol=0, atol=1e-9 * SQ + 1e-12 * 1e-5)
    np.testing.assert_array_equal(result["points"], GRID.shape)
    np.testing.assert_array_equal(result["spacing"], [DX, DY])
    np.testing.assert_allclose(result["map_x"], GRID.x())
    z = heights - heights.mean()
    assert result["rms_height"] == pytest.approx(z.std(), rel=1e-6)
    assert result["skewness"] == pytest.approx(skew(z.ravel()), abs=1e-6)
    assert result["kurtosis"] == pytest.approx(np.mean(z**4) / z.std() ** 4, rel=1e-6)
    assert result["missing"] == 0.0
    assert result["sufficient"] == 1
    edges = result["density_edge"]
    assert edges[[0, -1]] == pytest.approx([z.min(), z.max()])
    bins = np.histogram(z, edges)[0] / z.size / np.diff(edges)  # a height within rounding of an edge may fall out
    np.testing.assert_allclose(result["density"], bins, atol=2 / z.size / np.diff(edges)[0])


def test_lags_and_lengths_of_a_scan_lie_along_their_axes(scanned):
    """1/e at 8 um along x and 5 um along y, known to some 10 %; the model is the best of all kinds."""
    result = scanned
    assert (result["length_x"], result["length_y"]) == (pytest.approx(8e-6, rel=0.25), pytest.approx(5e-6, rel=0.25))
    assert result["length_x_low"] < result["length_x"] < result["length_x_high"]
    i, j = (int(np.argmin(np.abs(result[name]))) for name in ("lag_x", "lag_y"))
    assert result["lag_x"][i + 3] == pytest.approx(3 * DX)
    assert result["correlation"][i, j] == 1.0
    assert np.all(result["power_low"] < result["power"])
    assert np.all(result["power"] < result["power_high"])
    model = surface_model.restored_model(scanned)
    assert model.covariance.kind == "exponential"
    assert result["model_correlation"][i + 4, j] == pytest.approx(model.covariance(4 * DX) / model.rms_height_m**2)
    q = result["wavenumber"]
    inner = (q > 0.4 / DX) & (q < 0.8 / DX)  # of rings that hold many waves, on which the spectrum bends little
    np.testing.assert_allclose(result["model_power"][inner], result["power"][inner], rtol=0.3)
    assert model.rms_height_m == pytest.approx(float(scanned["rms_height"]))
    assert model.lengths_m == pytest.approx((8e-6, 5e-6), rel=0.25)
    with pytest.raises(IllPosedError, match=r"^roughness.scan.covariance: exponential is not allowed with load"):
        check_slope(scanned.path)  # by a load alone: strips have none


N, STEP = 96, 1e-6
STATED = {"spacing_m": [STEP, STEP], "height_unit": "nm"}
MODELS = {"form": "plane", "covariance": "exponential", "marginal": "gaussian"}


@pytest.fixture(scope="module")
def field():
    field = embed(covariance_of("exponential", 1e-7, 4e-6), Grid(N, N, STEP, STEP)).sample(np.random.default_rng(41))
    return np.round(field, 12)


@pytest.fixture
def scan_of(run, tmp_path):
    """What the stage makes of these heights, which it reads from a file of text."""

    def work(heights, **wanted):
        path = tmp_path / "scan.txt"
        np.savetxt(path, 1e9 * heights.T, fmt="%.6g")
        return run(
            scan, {"targets": ["figure_scan"], "roughness": {"scan": {**MODELS, **STATED, **wanted}}}, "file", scan=path
        )

    return work


def test_a_rim_without_heights_is_cut_off(scan_of, run, field):
    """Five rows and three columns; the statistics are those of what is left, a hole in it filled. A wide rim, of a
    third of the points, is warned of."""
    ragged = field.copy()
    ragged[:5], ragged[:, -3:] = np.nan, np.nan
    ragged[40:42, 50] = np.nan
    result = scan_of(ragged, covariance="measured")
    assert list(result["points"]) == [N - 5, N - 3]
    assert result["missing"] == pytest.approx(2 / (N - 5) / (N - 3))
    assert str(result["read"]).startswith(f"matrix, heights in nm; {N - 5} x {N - 3} of {N} x {N} points used, 8.2%")
    assert "; 2 missing (" in str(result["read"])
    inside = field[5:, :-3]
    assert result["rms_height"] == pytest.approx(np.std(inside), rel=0.05)  # a plane and two points less
    assert np.isfinite(result["map"]).all()
    model = surface_model.restored_model(result)
    assert model.lengths_m == (result["length_x"], result["length_y"])
    assert model.rms_height_m == pytest.approx(float(result["rms_height"]))
    assert not any("rim" in text for text in run.warnings)
    bar = field.copy()
    bar[64:] = np.nan
    scan_of(bar, covariance="measured")
    (warning,) = (text for text in run.warnings if "rim" in text)
    assert warning.startswith("33% of the scan lies in an empty rim and is cut off: matrix, heights in nm; 64 x 96 of")


def test_a_distribution_that_the_heights_do_not_have_is_refused(scan_of, run, field):
    """Two plateaus, to which no Gaussian field is translated by a smooth function.

    The scan is described and drawn all the same, and who needs its model is told which keys help.
    """
    result = scan_of(1e-7 * np.sign(field), marginal="empirical")
    with pytest.raises(IllPosedError, match=r"cannot be sampled: the Hermite .*roughness\.scan\.marginal: ") as no:
        surface_model.restored_model(result)
    assert "covariance: measured" not in str(no.value)  # which does not change the heights
    assert "\n" not in str(no.value)
    (warning,) = run.warnings
    assert warning == str(no.value)
    assert (str(result["model"])) in warning.replace("the scan has no model", "none")
    assert "model_correlation" not in result
    figure_scan(Shown(result.dataset()))


def test_heights_that_no_covariance_fits_are_refused_with_every_kind_that_was_tried(scan_of):
    """Heights independent from point to point: no lag has a correlation above 0.3 for any kind."""
    kinds = "gaussian, exponential, matern, self_affine: fewer than 3 lags"
    result = scan_of(1e-7 * np.random.default_rng(42).standard_normal((N, N)), covariance="best")
    assert result["rms_height"] == pytest.approx(1e-7, rel=0.05)
    with pytest.raises(IllPosedError, match=r"take the measured one.*roughness\.scan\.covariance: measured") as caught:
        surface_model.restored_model(result)
    assert kinds in str(caught.value)


@pytest.mark.parametrize("treatment", ["keep", "missing"])
def test_outliers_are_counted_marked_and_drawn(scan_of, field, treatment):
    """Twelve pits of 30 Sq; heights with them have no translation, without them they have."""
    put = np.zeros((N, N), dtype=bool)
    put.flat[np.random.default_rng(3).choice(N * N, 12, replace=False)] = True
    result = scan_of(field - 3e-6 * put, outliers=treatment, marginal="empirical")
    assert result["outliers"] == 12
    np.testing.assert_array_equal(result["map_outlier"], put)
    assert result["rms_height"] == pytest.approx(np.std(field - 3e-6 * put * (treatment == "keep")), rel=0.02)
    assert str(result["read"]).startswith("matrix, heights in nm")
    assert ("12 outliers treated as missing" in str(result["read"])) == (treatment == "missing")
    if treatment == "missing":
        assert surface_model.restored_model(result).covariance.kind == "exponential"


def test_warnings_say_what_a_model_misses(scan_of, run, field):
    assert str(scan_of(field)["model"]).startswith("exponential covariance, misfit ")
    assert run.warnings == []
    x = np.arange(N) / N
    scan_of(field + 8e-8 * np.sin(2 * np.pi * (5 * x[:, None] + 4 * x)))  # no exponential falls as the waves do
    lags, along_x, *_ = run.warnings
    assert lags.startswith("exponential misses the autocorrelation by")
    assert along_x.startswith("exponential misses the 1/e length along x")
    long = embed(covariance_of("exponential", 1e-7, 1.6e-5), Grid(256, 256, STEP, STEP))
    scan_of(long.sample(np.random.default_rng(43)), covariance="gaussian")
    assert any(text.startswith("gaussian misses the spectrum by") for text in run.warnings)  # it has no short waves


def grooves(n=N):
    """Profiles of 3 cells a correlation length along y, equal along x, with a roughness of their own."""
    lines = embed(covariance_of("exponential", 1e-7, 3e-6), Grid(1, 8 * n, STEP, STEP)).sample(
        np.random.default_rng(45)
    )
    own = embed(covariance_of("gaussian", 2e-8, 2e-6), Grid(n, n, STEP, STEP)).sample(np.random.default_rng(46))
    return lines[0, :n] + own


def test_grooves_longer_than_the_scan_are_used_with_an_endless_lay(scan_of, run):
    """The refusal says that an endless lay helps, and with it surfaces are equal along x, with the lengths across."""
    with pytest.raises(IllPosedError, match=r"What helps: a lay .* roughness\.scan\.endless_lay: x\. Or measure"):
        scan_of(grooves())
    result = scan_of(grooves(), endless_lay="x")
    assert str(result["model"]).endswith("endless lay along x")
    model = surface_model.restored_model(result)
    assert result["length_y_low"] < model.lengths_m[1] < result["length_y_high"]
    field = model.sampler(Grid(50, 4000, STEP, STEP))(np.random.default_rng(1))
    np.testing.assert_allclose(field, np.broadcast_to(field[:1], field.shape), atol=1e-7 * SQ)  # root of rounding
    assert field[0].std() == pytest.approx(float(result["rms_height"]), rel=0.1)
    lag = round(float(result["length_y"]) / STEP)
    along_y = np.mean(field[0, lag:] * field[0, :-lag]) / field[0].var()
    assert along_y == pytest.approx(np.exp(-1), abs=0.12)


def test_a_wave_longer_than_half_the_scan_is_taken_off_by_the_cutoff_that_the_refusal_names(scan_of, field):
    x = np.arange(N) / N
    waved = field + 4e-7 * np.sin(np.pi * (x[:, None] + x))
    with pytest.raises(IllPosedError, match=r"a high-pass, roughness\.scan\.cutoff_m: ") as caught:
        scan_of(waved, form="mean")
    cutoff = float(str(caught.value).split("cutoff_m: ")[1].split(". Or")[0])
    result = scan_of(waved, form="mean", cutoff_m=cutoff)
    alone = scan_of(field, form="mean", cutoff_m=cutoff)
    for name in ("rms_height", "length_x", "length_y"):
        assert result[name] == pytest.approx(float(alone[name]), rel=0.1)
    assert "without waves above" in str(result["model"])


def fitted(covariance):
    return CovarianceFit(covariance, 1.0, 1.0, 1.0)


def test_the_best_fit_is_the_first_that_every_mesh_takes_and_says_what_it_left(monkeypatch):
    """Short waves of a lay across the mesh, long for it, which no torus of eight times the nodes holds."""
    monkeypatch.setattr("roughslip.surface.embedding.MOST_NODES", 2**15)
    better = fitted(covariance_of("matern", 2.8e-7, 3.6e-5, 3.2e-6, -1.26, smoothness=0.1))
    best = fitted(covariance_of("exponential", 2.8e-7, 1e-5))
    on = {"wide": Grid(16, 16, 4e-4, 4e-4), "strip": Grid(64, 64, 3.7e-6, 3.7e-6)}
    chosen, left = scan.best_sampled([better, best], None, False, on)
    assert chosen is best
    assert len(left) == 1
    assert left[0].startswith("matern cannot be sampled on the mesh of the strip, 64 x 64 (no torus up to ")
    assert scan.best_sampled([better, best], None, False, {"wide": on["wide"]}) == (better, [])
    with pytest.raises(IllPosedError, match=r"matern.*roughness\.scan\.covariance: best or measured"):
        scan.best_sampled([better], None, False, on)
    scene = {"targets": ["figure3"], "strip": STRIP, "roughness": CONFIGURATION["roughness"]}
    names = [list(scan.meshes(scene_of(scene | {"targets": [target]}))) for target in ("figure2", "figure3")]
    assert names == [[], ["strip", "expansion of a strip"]]
