"""Statistics of scans against direct sums, closed forms, and the covariance that samples were drawn from."""

import math

import numpy as np
import pytest
import scipy.fft
import scipy.special
import scipy.stats

from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scan.autocorrelation import _lag_sums as lag_sums
from roughslip.scan.autocorrelation import autocorrelation, sub_areas_for
from roughslip.scan.jackknife import ENOUGH_LENGTHS, SubAreas, leave_one_out, sub_areas, widening
from roughslip.scan.spectrum import LEAKAGE, rings, spectrum
from roughslip.scan.statistics import height_density, scan_statistics
from roughslip.scan.topography import Topography, remove_form, topography
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of


def complete(z, dx=1.0, dy=1.0):
    return topography(z, dx, dy, "sample")


def test_sums_over_lags_are_those_of_a_double_loop():
    rng = np.random.default_rng(63)
    missing = rng.random((9, 7)) < 0.15
    scan = Topography(rng.standard_normal((9, 7)) + 5.0, 1.0, 1.0, missing)
    parts = SubAreas(scan.grid, (2, 2), (1.0, 1.0))
    total = np.sum(lag_sums(scan, parts, (4, 3)), axis=0)
    z = np.where(missing, 0.0, scan.heights - scan.heights[~missing].mean())
    direct = np.zeros((3, 9, 7))
    for lx in range(-4, 5):
        for ly in range(-3, 4):
            for i in range(9):
                for j in range(7):
                    if 0 <= i + lx < 9 and 0 <= j + ly < 7 and not missing[i, j] and not missing[i + lx, j + ly]:
                        a, b = z[i, j], z[i + lx, j + ly]
                        direct[:, lx + 4, ly + 3] += 1.0, a * b, 0.5 * (a + b)
    np.testing.assert_allclose(total, direct, atol=1e-13)


def test_sub_areas_tile_the_mesh_and_leave_out_one_at_a_time():
    parts = SubAreas(Grid(50, 37, 1.0, 1.0), (4, 3), (2.0, 3.0))
    field = np.random.default_rng(64).standard_normal((50, 37))
    cover = np.zeros((50, 37))
    for part in parts.slices():
        cover[part] += 1
    assert (cover == 1).all()
    rows = leave_one_out(parts.sums(field), np.asarray)
    assert rows[0] == pytest.approx(field.sum(), abs=1e-12)
    assert rows[1] == pytest.approx(field[12:].sum() + field[:12, 12:].sum(), abs=1e-12)
    # for a mean of B equal independent numbers the jackknife is the textbook t interval
    values = np.random.default_rng(65).standard_normal(9)
    sums = np.stack([values, np.ones(9)], axis=1)
    interval = SubAreas(Grid(9, 9, 1.0, 1.0), (3, 3), (1.0, 1.0)).interval(leave_one_out(sums, lambda s: s[0] / s[1]))
    low, high = scipy.stats.t.interval(0.95, 8, values.mean(), scipy.stats.sem(values))
    assert (interval.low, interval.high) == pytest.approx((low, high), rel=1e-12)


@pytest.mark.parametrize(
    ("extent", "counts", "sufficient"),
    [
        ((2.0, 2.0), (8, 8), True),
        ((3.0, 40.0), (6, 1), True),
        ((8.0, 8.0), (2, 5), True),
        ((40.0, 30.0), (2, 3), False),
    ],
)
def test_sub_areas_follow_the_correlation(extent, counts, sufficient):
    """120 x 240: by 6 lengths an edge, at most 8 on an axis, at least 6 in all."""
    parts = sub_areas(Grid(120, 240, 1.0, 1.0), *extent)
    assert (parts.counts, parts.sufficient) == (counts, sufficient)


def test_neighbours_share_scatter_across_their_edge():
    """r^2 = exp(-2 |l_x| / a - 2 |l_y| / b): v = v(A, a) v(B, b), v(A, a) = a - a^2 / (2 A) (1 - exp(-2 A / a))."""
    parts = SubAreas(Grid(400, 300, 1.0, 1.0), (4, 5), (1.0, 1.0))
    x, y = np.arange(-400, 401), np.arange(-300, 301)
    a, b = 10.0, 8.0
    correlation = np.exp(-np.abs(x[:, None]) / a - np.abs(y[None, :]) / b)

    def v(edge, length):
        return length - length**2 / (2 * edge) * (1 - math.exp(-2 * edge / length))

    closed = math.sqrt(v(400, a) * v(300, b) / (v(100, a) * v(60, b)))
    squared = np.where(correlation > math.exp(-2.0), correlation**2, 0.0)
    parts_of = [
        np.maximum(1 - np.abs(x) / p, 0) @ squared @ np.maximum(1 - np.abs(y) / q, 0)
        for p, q in ((400, 300), (100, 60))
    ]
    assert widening(parts, correlation) == pytest.approx(math.sqrt(parts_of[0] / parts_of[1]), rel=1e-12)
    # lags where r < exp(-2) are left out, which only lowers the factor: by a fifth of its excess here
    assert 1.0 + 0.7 * (closed - 1.0) < widening(parts, correlation) < closed


def test_along_an_endless_lay_a_scan_is_long_enough():
    """A scan needs edges of ENOUGH_LENGTHS; across the lay its 1/e length is that of the Gaussian, 3."""
    noise = embed(covariance_of("gaussian", 1.0, 3.0), Grid(1, 400, 1.0, 1.0)).sample(np.random.default_rng(3))
    for endless, heights in ((0, np.tile(noise, (300, 1))), (1, np.tile(noise, (300, 1)).T)):
        parts = sub_areas_for(topography(heights, 1.0, 1.0, "grooves"), endless)
        assert parts.extent[endless] == pytest.approx(300 / ENOUGH_LENGTHS)
        assert parts.extent[1 - endless] == pytest.approx(3.0, abs=1.0)
        assert parts.sufficient
        along = autocorrelation(topography(heights, 1.0, 1.0, "grooves"), parts)
        length = along.length_y if endless else along.length_x  # still correlated at the last lag, give or take a cell
        last = (along.lag_y if endless else along.lag_x)[-1]
        assert (length.value, length.low, length.high) == (last, last - 1.0, last + 1.0)
        assert along.length_along.value == last


def test_moments_and_density_of_the_measured_heights():
    rng = np.random.default_rng(66)
    z = scipy.special.expm1(0.3 * embed(covariance_of("gaussian", 1.0, 3.0), Grid(96, 80, 1.0, 1.0)).sample(rng))
    z[rng.random(z.shape) < 0.03] = np.nan
    scan = complete(z)
    of_scan = scan_statistics(scan)
    measured = z[np.isfinite(z)]
    samples = [measured]  # then without each sub-area
    for part in of_scan.sub_areas.slices():
        rest = z.copy()
        rest[part] = np.nan
        samples.append(rest[np.isfinite(rest)])
    for ours, statistic, positive in (
        (of_scan.rms_height, np.std, True),
        (of_scan.skewness, scipy.stats.skew, False),
        (of_scan.kurtosis, lambda heights: scipy.stats.kurtosis(heights, fisher=False), False),
    ):
        expected = of_scan.sub_areas.interval(np.array([statistic(heights) for heights in samples]), positive=positive)
        for end in ("value", "low", "high"):
            assert getattr(ours, end) == pytest.approx(getattr(expected, end), rel=1e-10)
    density = height_density(scan, of_scan.sub_areas)
    width = np.diff(density.edges)
    assert np.sum(density.density.value * width) == pytest.approx(1.0, rel=1e-12)
    counts, _ = np.histogram(measured - measured.mean(), density.edges)
    # a height within rounding of an edge may fall to either side
    np.testing.assert_allclose(
        density.density.value, counts / (measured.size * width), atol=2 / measured.size / width[0]
    )
    assert (density.density.low >= 0.0).all()


ALONG, ACROSS = 4.5, 3.0


def anisotropic_scans(kind):
    """100 fields whose pixels are not square, longer along x."""
    embedding = embed(covariance_of(kind, 2.0, ALONG, ACROSS), Grid(128, 144, 1.0, 0.7))
    for i in range(100):
        yield remove_form(complete(embedding.sample(np.random.default_rng([67, i])), 1.0, 0.7), "mean")


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["gaussian", "exponential"])
def test_intervals_hold_the_truth(kind):
    truth = {"sq": 2.0, "skewness": 0.0, "kurtosis": 3.0, "x": ALONG, "y": ACROSS, "along": ALONG, "across": ACROSS}
    truth["lay"] = 0.0
    c = covariance_of(kind, 2.0, ALONG, ACROSS)
    laplacian = np.array([(0, 0, -2 * (1 + 0.7**-2)), (1, 0, 1), (-1, 0, 1), (0, 0.7, 0.7**-2), (0, -0.7, 0.7**-2)])
    places, weights = laplacian[:, :2], laplacian[:, 2]
    variance = weights @ c(*(places[:, None] - places).transpose(2, 0, 1)) @ weights
    truth["slope"] = math.sqrt(2 * (4.0 - c(np.array(1.0))) + 2 * (4.0 - c(np.array(0.0), 0.7)) / 0.7**2)
    truth["curvature"] = 0.5 * math.sqrt(variance)
    held = dict.fromkeys(truth, 0)
    for scan in anisotropic_scans(kind):
        statistics = scan_statistics(scan)
        assert statistics.sub_areas.sufficient
        a = statistics.autocorrelation
        estimates = [statistics.rms_height, statistics.skewness, statistics.kurtosis]
        estimates += [a.length_x, a.length_y, a.length_along, a.length_across, a.lay]
        estimates += [statistics.rms_slope, statistics.rms_curvature]
        for name, estimate in zip(truth, estimates, strict=True):
            held[name] += bool(estimate.low <= truth[name] <= estimate.high)
    # over 1000 fields each the nine intervals held in 0.91 to 0.96 (exponential) and 0.93 to 0.95; of 100 at 0.91 fewer
    # than 82 hold with probability 1.4e-3, which makes 1 % for nine
    assert min(held.values()) >= 82, held
    assert np.mean(list(held.values())) >= 91, held  # 0.935 and 0.94 over the 1000; the nine are correlated


@pytest.mark.parametrize("kind", ["gaussian", "exponential"])
def test_the_spectrum_is_that_of_the_covariance(kind):
    """A hundred scans, rings above the window's side lobes; the mean height that is removed touches the first ring.

    Sampled heights fold the spectrum at the highest wavenumber pi, which where it falls as q^-3 adds 3 % at a third of
    it. One of twelve standard normal deviates exceeds 4 with a probability of 8e-4.
    """
    truth = covariance_of(kind, 2.0, ALONG, ACROSS)
    scans = list(anisotropic_scans(kind))
    parts = SubAreas(scans[0].grid, (2, 2), (ALONG, ACROSS))
    power = np.stack([spectrum(scan, parts).power.value for scan in scans])
    over = rings(scans[0].grid, parts)
    mean_power, closed = power.mean(axis=0), over.expected(truth.spectrum)
    inside = (closed > LEAKAGE * closed.max()) & (over.wavenumber < math.pi / 3)
    inside[0] = False
    assert inside.sum() >= 6
    error = np.std(power, axis=0) / 10
    np.testing.assert_array_less(np.abs(mean_power / closed - 1)[inside], 0.03 + 4 * (error / closed)[inside])


def test_rings_hold_as_many_waves_in_every_direction():
    """Sub-areas of 40 x 15 points: a ring between multiples of 2 pi / 15 would hold no wave near the y axis."""
    grid = Grid(120, 120, 1.0, 1.0)
    over = rings(grid, SubAreas(grid, (3, 8), (5.0, 1.0)))
    assert over.ring.shape == (40, 15)
    angle = np.degrees(np.arctan2(np.abs(over.wave_y), np.abs(over.wave_x)))
    for number in range(len(over.modes)):
        steep = (angle > 45.0)[over.ring == number]
        assert 0.25 < steep.mean() < 0.75, number
    assert np.diff(over.wavenumber).min() > 0.0
    np.testing.assert_allclose(over.mean(np.ones(over.ring.shape)), 1.0)
    turned = rings(grid, SubAreas(grid, (8, 3), (1.0, 5.0)))
    np.testing.assert_array_equal(turned.ring, over.ring.T)


def test_the_lay_is_found_at_any_angle():
    """A torus many lengths wide: the covariance of wrapped lags is positive to 1e-12, so the sample is exact."""
    n, lay = 256, math.radians(35)
    k = np.fft.fftfreq(n, 1 / n)
    symbol = scipy.fft.rfft2(covariance_of("gaussian", 1.0, 9.0, 3.0, lay_rad=lay)(k[:, None], k[None, :])).real
    noise = scipy.fft.rfft2(np.random.default_rng(68).standard_normal((n, n)))
    scan = complete(scipy.fft.irfft2(np.sqrt(np.maximum(symbol, 0.0)) * noise, s=(n, n)))
    measured = autocorrelation(scan, sub_areas_for(scan))
    assert measured.lay.low < lay < measured.lay.high
    assert measured.lay.high - measured.lay.low < math.radians(10)
    assert measured.length_along.low < 9.0 < measured.length_along.high
    assert measured.length_across.low < 3.0 < measured.length_across.high
    middle = measured.correlation.value.shape[0] // 2, measured.correlation.value.shape[1] // 2
    assert measured.correlation.value[middle] == 1.0
    np.testing.assert_allclose(measured.correlation.value, measured.correlation.value[::-1, ::-1], rtol=1e-12)


def test_what_a_scan_cannot_tell_is_refused():
    x = np.linspace(0.0, 1.0, 64)[:, None]
    tilted = complete(x + 1e-3 * np.random.default_rng(70).standard_normal((64, 64)))
    with pytest.raises(IllPosedError, match=r"What helps: roughness\.scan\.form: quadratic, or"):
        sub_areas_for(tilted)
