"""The stage of a scan: known heights, what its keys take off, and its model, on disk and back; surfaces of a scene."""

import numpy as np
import pytest
from scipy.stats import skew

from roughslip.errors import IllPosedError
from roughslip.figures.figure_scan import figure_scan
from roughslip.figures.style import Shown
from roughslip.friction.pad import pad_means
from roughslip.grid import Grid
from roughslip.probability import BetaDistribution
from roughslip.scan.covariance_fit import CovarianceFit
from roughslip.scene.types import scene_of
from roughslip.study import scan
from roughslip.study.friction_under_load import correlated
from roughslip.study.from_scene import surface_model
from roughslip.study.from_scene.domain import check_slope
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of

N, STEP, DY = 96, 1e-6, 2e-6
SQUARE, GRID = Grid(N, N, STEP, STEP), Grid(160, 120, STEP, DY)


def field_of(kind: str, length: float, across: float | None = None, grid: Grid = SQUARE, seed: int = 41):
    """Heights of Sq = 0.1 um with this covariance."""
    return embed(covariance_of(kind, 1e-7, length, across), grid).sample(np.random.default_rng(seed))


@pytest.fixture(scope="module")
def field():
    return field_of("exponential", 4e-6)


@pytest.fixture(scope="module")
def scan_of(run, folder):
    """What the stage makes of these heights, which it reads from a file of text."""

    def work(heights, dy=STEP, **wanted):
        np.savetxt(folder / "scan.txt", 1e9 * heights.T, fmt="%.9g")
        keys = {"form": "plane", "covariance": "exponential", "marginal": "gaussian", "spacing_m": [STEP, dy]}
        scene = {"targets": ["figure_scan"], "roughness": {"scan": keys | {"height_unit": "nm"} | wanted}}
        return run("scan", scene, scan=folder / "scan.txt")

    return work


def test_a_scan_is_described_by_its_own_moments_along_its_axes(scan_of):
    """1/e at 8 um along x and 5 um along y, known to some 10 %; the model is the best of all kinds. A plane is off."""
    z = field_of("exponential", 8e-6, 5e-6, GRID, 4)
    x, y = np.meshgrid(GRID.x(), GRID.y(), indexing="ij")
    plane = np.column_stack([np.ones(z.size), x.ravel(), y.ravel()])
    z -= (plane @ np.linalg.lstsq(plane, z.ravel(), rcond=None)[0]).reshape(z.shape)
    result = scan_of(z + 0.01 * x - 0.02 * y + 1e-5, DY, covariance="best")
    np.testing.assert_allclose(result["map"], z, rtol=0, atol=1e-13)
    np.testing.assert_array_equal(result["points"], GRID.shape)
    np.testing.assert_array_equal(result["spacing"], [STEP, DY])
    np.testing.assert_allclose(result["map_x"], GRID.x())
    moments = z.std(), skew(z.ravel()), np.mean(z**4) / z.std() ** 4
    stored = [float(result[name]) for name in ("rms_height", "skewness", "kurtosis")]
    assert stored == pytest.approx(moments, rel=1e-5, abs=1e-5 * 1e-7)
    assert (result["missing"], result["outliers"]) == (0.0, 0)
    edges = result["density_edge"]
    bins = np.histogram(z, edges)[0] / z.size / np.diff(edges)  # a height within rounding of an edge may fall out
    np.testing.assert_allclose(result["density"], bins, atol=2 / z.size / np.diff(edges)[0])
    assert (result["length_x"], result["length_y"]) == (pytest.approx(8e-6, rel=0.25), pytest.approx(5e-6, rel=0.25))
    assert result["length_x_low"] < result["length_x"] < result["length_x_high"]
    i, j = (int(np.argmin(np.abs(result[name]))) for name in ("lag_x", "lag_y"))
    assert (result["lag_x"][i + 3], result["lag_y"][j + 2]) == pytest.approx((3 * STEP, 2 * DY))
    assert result["correlation"][i, j] == 1.0
    assert np.all((result["power_low"] < result["power"]) & (result["power"] < result["power_high"]))
    model = surface_model.restored_model(result)
    assert model.covariance.kind == "exponential"
    assert result["model_correlation"][i + 4, j] == pytest.approx(model.covariance(4 * STEP) / model.rms_height_m**2)
    q = result["wavenumber"]
    inner = (q > 0.4 / STEP) & (q < 0.8 / STEP)  # of rings that hold many waves, on which the spectrum bends little
    np.testing.assert_allclose(result["model_power"][inner], result["power"][inner], rtol=0.3)
    assert model.rms_height_m == pytest.approx(float(result["rms_height"]))
    assert model.lengths_m == pytest.approx((8e-6, 5e-6), rel=0.25)
    with pytest.raises(IllPosedError, match=r"^roughness.scan.covariance: exponential is not allowed with load"):
        check_slope(result.path)  # by a load alone: strips have none
    figure_scan(Shown(result.dataset()))


@pytest.mark.parametrize("covariance", ["measured", "exponential"])
@pytest.mark.parametrize("marginal", ["gaussian", "empirical"])
def test_the_model_of_a_scan_comes_back_from_disk(scan_of, field, covariance, marginal):
    """With the height and the measured lengths and correlation, or the fitted covariance; heights at scores."""
    skewed = BetaDistribution.of_moments(2.1, 5.0, 0.0, 1e-7).from_gaussian(field / 1e-7)
    result = scan_of(skewed, covariance=covariance, marginal=marginal)
    model = surface_model.restored_model(result)
    assert model.rms_height_m == pytest.approx(float(result["rms_height"]), rel=1e-12)
    if covariance == "measured":
        assert model.lengths_m == (result["length_x"], result["length_y"])
        near = np.abs(result["lag_x"]) < 5e-6
        table = result["correlation"][:, len(result["lag_y"]) // 2]
        shares = model.covariance(result["lag_x"], 0.0) / model.rms_height_m**2
        np.testing.assert_allclose(shares[near], table[near], atol=0.05)
    else:
        assert model.covariance == surface_model.fitted_covariance(result)
        assert model.covariance.kind == "exponential"
    if marginal == "gaussian":
        assert model.marginal is None
    else:
        scores = np.linspace(-2, 2, 9)
        stored = np.interp(scores, result["marginal_score"], result["marginal_height"])
        np.testing.assert_allclose(model.marginal.from_gaussian(scores), stored, atol=2e-3 * 1e-7)
        standing = np.quantile(result["map"], [0.1, 0.5, 0.9])
        np.testing.assert_allclose(model.marginal.from_gaussian(np.array([-1.2816, 0, 1.2816])), standing, atol=2e-9)


def test_what_a_key_takes_off_does_not_count(scan_of, run, field):
    """A rim with a hole next to it; twelve pits of 30 Sq, with which heights have no translation; and a wave longer
    than half the scan, which the refusal says how to take off. Statistics are those of what is left."""
    ragged, put, x = field.copy(), np.zeros((N, N), dtype=bool), np.arange(N) / N
    ragged[:5], ragged[:, -3:], ragged[40:42, 50] = np.nan, np.nan, np.nan
    result = scan_of(ragged)
    assert list(result["points"]) == [N - 5, N - 3]
    assert result["missing"] == pytest.approx(2 / (N - 5) / (N - 3))
    assert result["rms_height"] == pytest.approx(np.std(field[5:, :-3]), rel=0.05)  # a plane and two points less
    assert np.isfinite(result["map"]).all()
    assert run.warnings == []
    put.flat[np.random.default_rng(3).choice(N * N, 12, replace=False)] = True
    for treatment, kept in (("keep", 1), ("missing", 0)):
        result = scan_of(field - 3e-6 * put, outliers=treatment, marginal="empirical")
        np.testing.assert_array_equal(result["map_outlier"], put)
        assert result["outliers"] == 12
        assert result["rms_height"] == pytest.approx(np.std(field - 3e-6 * put * kept), rel=0.02)
        assert ("marginal_score" in result) != kept
    waved = field + 4e-7 * np.sin(np.pi * (x[:, None] + x))
    with pytest.raises(IllPosedError, match=r"a high-pass, cutoff_m: ") as caught:
        scan_of(waved, form="mean")
    cutoff = float(str(caught.value).split("cutoff_m: ")[1].split(". Or")[0])
    result, alone = (scan_of(heights, form="mean", cutoff_m=cutoff) for heights in (waved, field))
    for name in ("rms_height", "length_x", "length_y"):
        assert result[name] == pytest.approx(float(alone[name]), rel=0.1)


def test_a_scan_without_a_model_is_drawn_and_says_which_keys_help(scan_of, run, field):
    """Two plateaus, to which no Gaussian field is translated by a smooth function; heights independent from point to
    point, whose correlation no kind has. A model that misses something is warned of."""
    plateaus = scan_of(1e-7 * np.sign(field), marginal="empirical")
    with pytest.raises(IllPosedError, match=r"cannot be sampled: the Hermite .*roughness\.scan\.marginal: ") as no:
        surface_model.restored_model(plateaus)
    assert run.warnings == [str(no.value)]
    figure_scan(Shown(plateaus.dataset()))
    white = scan_of(1e-7 * np.random.default_rng(42).standard_normal((N, N)), covariance="best")
    with pytest.raises(IllPosedError, match=r"gaussian, exponential, matern, .*roughness\.scan\.covariance: measured"):
        surface_model.restored_model(white)
    scan_of(field)
    assert run.warnings == []
    x = np.arange(N) / N
    scan_of(field + 8e-8 * np.sin(2 * np.pi * (5 * x[:, None] + 4 * x)))  # no exponential falls as the waves do
    assert run.warnings[0].startswith("exponential misses the autocorrelation by")
    scan_of(field_of("exponential", 1.6e-5, grid=Grid(256, 256, STEP, STEP), seed=43), covariance="gaussian")
    assert any(text.startswith("gaussian misses the spectrum by") for text in run.warnings)  # it has no short waves


def test_grooves_longer_than_the_scan_are_used_with_an_endless_lay(scan_of):
    """The refusal says that an endless lay helps, and with it surfaces are equal along x, with the lengths across.

    Profiles of 3 cells a correlation length along y, equal along x, with a roughness of their own.
    """
    lines = field_of("exponential", 3e-6, grid=Grid(1, 8 * N, STEP, STEP), seed=45)[0, :N]
    grooves = lines + 0.2 * field_of("gaussian", 2e-6, seed=46)
    with pytest.raises(IllPosedError, match=r"What helps: a lay .* endless_lay: x\. Or measure"):
        scan_of(grooves)
    result = scan_of(grooves, endless_lay="x")
    model = surface_model.restored_model(result)
    assert result["length_y_low"] < model.lengths_m[1] < result["length_y_high"]
    assert model.lengths_m[0] == pytest.approx(N * STEP)  # as long as the scan
    field = model.sampler(Grid(50, 4000, STEP, STEP))(np.random.default_rng(1))
    np.testing.assert_allclose(field, np.broadcast_to(field[:1], field.shape), atol=2e-14)  # root of rounding
    assert field[0].std() == pytest.approx(float(result["rms_height"]), rel=0.1)
    lag = round(float(result["length_y"]) / STEP)
    along_y = np.mean(field[0, lag:] * field[0, :-lag]) / field[0].var()
    assert along_y == pytest.approx(np.exp(-1), abs=0.12)


def test_the_best_fit_is_the_first_that_every_mesh_takes(monkeypatch):
    """Short waves of a lay across the mesh, long for it, which no torus of eight times the nodes holds."""
    monkeypatch.setattr("roughslip.surface.embedding.MOST_NODES", 2**15)
    matern = covariance_of("matern", 2.8e-7, 3.6e-5, 3.2e-6, -1.26, smoothness=0.1)
    better, best = (CovarianceFit(one, 1.0, 1.0, 1.0) for one in (matern, covariance_of("exponential", 2.8e-7, 1e-5)))
    on = {"wide": Grid(16, 16, 4e-4, 4e-4), "strip": Grid(64, 64, 3.7e-6, 3.7e-6)}
    chosen, (left,) = scan.best_sampled([better, best], None, False, on)
    assert chosen is best
    assert left.startswith("matern cannot be sampled on the mesh of the strip, 64 x 64 (no torus up to ")
    assert scan.best_sampled([better, best], None, False, {"wide": on["wide"]}) == (better, [])
    with pytest.raises(IllPosedError, match=r"matern.*roughness\.scan\.covariance: best or measured"):
        scan.best_sampled([better], None, False, on)


def test_the_surface_of_a_scene_has_every_key():
    """The correction reaches the covariance that is asked, where a Gaussian field has one for it."""
    roughness, law = {"covariance": "exponential", "rms_height_m": 2e-7, "correlation_length_m": 5e-6}, [5.0, 2.1]

    def model_of(**others):
        return surface_model.surface_model(scene_of({"roughness": roughness | others}))

    model = model_of(covariance="matern", smoothness=1.5, correlation_length_across_m=2e-6, lay_rad=0.3)
    assert model.covariance == covariance_of("matern", 2e-7, 5e-6, 2e-6, 0.3, smoothness=1.5)
    assert (model.lengths_m, model.marginal) == (model.covariance.axis_lengths_m, None)
    model, corrected = model_of(beta_shapes=law), model_of(beta_shapes=law, correct_correlation=True)
    assert model.marginal == BetaDistribution.of_moments(5.0, 2.1, 0.0, 2e-7)
    assert model.covariance == covariance_of("exponential", 2e-7, 5e-6)
    lag = np.array(5e-6)
    assert model.covariance(lag) < corrected.covariance(lag)
    with pytest.raises(IllPosedError, match="no Gaussian field"):
        model_of(covariance="gaussian", beta_shapes=law, correct_correlation=True)
    fractal = {"rms_height_m": 2e-7, "hurst": 0.8, "wavelengths_m": [8e-6, 6e-5]}
    waves = surface_model.surface_model(scene_of({"roughness": fractal}))
    assert (waves.hurst, waves.longest_wavelength_m, waves.shortest_wavelength_m) == (0.8, 6e-5, 8e-6)


def test_the_friction_of_a_pad_on_fractal_waves_forgets():
    """Plane waves nearly repeat themselves; a pad of a thousand windows must not. Without long waves its friction has
    the triangle of its own length."""
    given = {"roughness": {"rms_height_m": 2e-7, "hurst": 0.8, "wavelengths_m": [5.2e-6, 6e-5]}}
    surface = correlated(scene_of(given))
    length, width = 4.8e-3, 3.1e-3
    lags = length * np.linspace(0.0, 1.0, 9)
    means = pad_means(surface, 3e-5, 2.5e-5, (length, width), lags)
    assert surface.correlation(np.zeros(1), np.zeros(1)) == pytest.approx(1.0)
    assert np.all(np.abs(means[:, 0]) < 1e-4)  # of rho itself: the waves cancel
    np.testing.assert_allclose(means[:, 1:] / means[0, 1:], np.tile(1.0 - lags / length, (4, 1)).T, atol=0.02)
