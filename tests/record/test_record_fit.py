"""Curves and scatter of synthetic records with noise, a low-pass, drift and the period of a revolution.

The likelihood of scatter seen through an instrument is compared with dense covariances.
"""

import functools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad
from scipy.signal import lfilter

from roughslip import IllPosedError
from roughslip.record.curve import FrictionCurve, SpeedBasis, _spline_curve, fitted_curve, stribeck_columns
from roughslip.record.disturbances import repetition, without_noise
from roughslip.record.fit import _moments, _tilted, fit_record
from roughslip.record.likelihood import SlidingSamples, scatter_path, through_instrument, whitened

LENGTH, DEVIATION, SECONDS = 1e-3, 0.02, 30.0
N = 1200


def stribeck(share):
    """Friction at a share of the fastest speed."""
    return 0.25 / (1.0 + 8.0 * share) + 0.2 + 0.02 * share**2


def hump(share):
    """Friction that Stribeck's law cannot have."""
    return 0.3 + 0.06 * np.sin(6.0 * np.sqrt(share)) - 0.05 * share


def record(
    seed, lengths=80.0, law=stribeck, multiplicative=False, drift=0.02, wobble=0.01, lag=0.0, noise=0.01, span=3.0, n=N,
    levels=0, low_pass=1.0, speed_noise=0.0, repeated=0.0,
):  # fmt: skip
    """Two ramps down and up, over so many e-foldings, or levels of speed in random order. lag : [s] of friction behind
    speed; low_pass : samples; repeated : share of the scatter that repeats each turn"""
    generator, dt = np.random.default_rng([seed, 3]), SECONDS / n
    time = (np.arange(n) + 1) * dt
    share = np.exp(span * (np.abs(time / SECONDS * 4.0 % 2.0 - 1.0) - 1.0))
    if levels:
        share = np.exp(-span * np.linspace(0.0, 1.0, levels))[generator.permutation(levels)].repeat(n // levels)
    speed = share * lengths * LENGTH / np.sum(share * dt)
    slipped = np.cumsum(speed * dt)
    mean = law(np.interp(time - lag, time, share))
    path = scatter_path(slipped, LENGTH, generator)
    if repeated:
        turn = np.interp(slipped % around(lengths), slipped, path)
        path = np.sqrt(repeated) * turn + np.sqrt(1.0 - repeated) * scatter_path(slipped, LENGTH, generator)
    friction = mean * (1.0 + path * DEVIATION / np.mean(mean)) if multiplicative else mean + DEVIATION * path
    friction += drift * (time / SECONDS - 0.5) + wobble * np.cos(2 * np.pi * slipped / around(lengths))
    keep = np.exp(-1.0 / low_pass)
    friction = lfilter([1.0 - keep], [1.0, -keep], friction - friction[0]) + friction[0]
    friction += noise * generator.standard_normal(n)
    speed *= 1.0 + speed_noise * generator.standard_normal(n)
    step = speed * dt
    step[0] = -1.0
    return SlidingSamples(friction, speed, step, np.full(n, dt), np.gradient(speed, dt))


def around(lengths):
    """[m] the period of a revolution: seven of them in a record."""
    return lengths * LENGTH / 7.3


@functools.cache
def fitted(seed, lengths=80.0, known=False, **others):
    """With its samples. known : whether the time constant of the instrument is, which takes a third of the time"""
    samples = record(seed, lengths, **others)
    return fit_record(samples, around(lengths), samples.seconds[0] if known else None), samples


def away(found, samples, law=stribeck):
    """The largest distance of the curve from the truth, in widths of its interval: four standard errors."""
    low, high = found.curve.interval()
    truth = law(found.curve.speeds_m_per_s / samples.speed.max())
    return np.max(np.abs(found.curve.friction - truth) / (high - low))


ROWS = {
    "ramps": {},
    "steps": {"levels": 8, "low_pass": 3.0, "drift": 0.0},
    "noise in the speed": {"speed_noise": 0.02},
    "proportional": {"multiplicative": True},
}


def covered(seeds, row, known=False, **others):
    """Of curve, deviation and length: shares of intervals that hold the truth, half widths over 1.96 spreads."""
    inside, errors, halves = [], [], []
    for seed in seeds:
        samples = record(seed, 120.0, noise=0.1 * DEVIATION, wobble=0.0, **ROWS[row], **others)
        found = fit_record(samples, None, known * ROWS[row].get("low_pass", 1.0) * samples.seconds[0] or None)
        low, high = found.curve.interval()
        truth = stribeck(found.curve.speeds_m_per_s / without_noise(samples)[0].speed.max())
        scatter, unit = found.scatter(found.kind), np.mean(found.mean) if found.kind == "multiplicative" else 1.0
        ends = np.log(scatter.interval() / np.array([DEVIATION / unit, LENGTH])[:, None])
        inside.append([np.mean((low < truth) & (truth < high)), *(ends[:, 0] * ends[:, 1] < 0.0)])
        errors.append([*(found.curve.friction - truth), *ends.mean(axis=1)])
        halves.append([*(high - low) / 2.0, *np.ptp(ends, axis=1) / 2.0])
    wide = np.median(halves, axis=0) / (1.96 * np.std(errors, axis=0))
    return np.mean(inside, axis=0), np.array([np.median(wide[:-2]), *wide[-2:]])


@pytest.mark.parametrize("row", ROWS)
def test_intervals_of_small_records_hold_the_truth(row):
    """Of five, three or more miss with a probability below 2 %, if each holds with 0.88."""
    (curve, deviation, length), _ = covered(range(300, 305), row, known=True, n=400)
    assert min(deviation, length) >= 0.6
    assert curve > 0.7


@pytest.mark.nightly
@pytest.mark.parametrize("row", ROWS)
def test_intervals_of_95_percent_hold_the_truth(row):
    """Of 200 records, and no interval is much wider than the estimates spread."""
    shares, wide = covered(range(200), row)
    print(f"{row}: coverage {shares.round(3)}, half widths over 1.96 spreads {wide.round(2)}")
    assert np.all(shares >= [0.88, 0.88, 0.85])
    assert np.all(wide <= 1.3)


def test_noise_of_the_speed_and_repeated_scatter_are_said():
    """Levels of speed stay through medians; where each has three samples, noise is too much for a curve."""
    calm, window, noise = without_noise(record(3, 120.0, levels=8, speed_noise=0.1))
    true = record(3, 120.0, levels=8)
    assert noise == pytest.approx(0.1, rel=0.05)
    of_median = 0.6745 * 0.1 * np.sqrt(np.pi / 2.0 / window)  # of normal values
    assert np.median(np.abs(calm.speed / true.speed - 1.0)) < 1.5 * of_median
    assert [without_noise(one)[1:] for one in (true, record(3, 120.0, n=400))] == [(1, 0.0)] * 2
    flat = fit_record(record(3, 120.0, noise=0.002, speed_noise=0.2, levels=400))
    assert "moves the curve" in flat.notes[-1]
    assert away(flat, true) < 0.5
    noted = [fit_record(record(3, 120.0, repeated=share), around(120.0)).notes for share in (0.6, 0.0)]
    assert ["repeats each turn" in " ".join(one) for one in noted] == [True, False]


def test_repetition_is_that_of_the_variance_of_turns():
    """A share of 0.6 within 0.1 on average of 20 records of 7 turns; without it p-values are uniform."""
    found = []
    for seed in range(60):
        rest = {"law": np.zeros_like, "drift": 0.0, "wobble": 0.0, "noise": 0.001}
        samples = record(seed, 160.0, repeated=0.6 * (seed < 20), **rest)
        found.append(repetition(samples, samples.friction, around(160.0), LENGTH, 3))
    shares, chances = np.transpose(found)
    assert np.mean(shares[:20]) == pytest.approx(0.6, abs=0.1)
    assert max(chances[:20]) < 1e-3
    assert stats.kstest(chances[20:], "uniform").pvalue > 0.01


@pytest.mark.parametrize("known", [False, True])
def test_what_a_record_holds_is_recognised(known):
    """A record of 400 lengths: the curve, additive scatter, drift and the revolution, and no difference of ramps."""
    found, samples = fitted(2, 400.0, known, wobble=0.02, drift=0.08)
    assert found.curve.form == "stribeck"
    assert away(found, samples) < 1.0
    assert found.curve.speeds_m_per_s[[0, -1]] == pytest.approx([samples.speed.min(), samples.speed.max()])
    assert max(found.period, found.drift) < 1e-3 < found.ramps
    assert (found.additive.identified, found.kind) == (True, "additive")
    drift = found.explained - found.mean
    assert np.ptp(drift) == pytest.approx(0.08 + 2 * 0.02, rel=0.25)  # and the wave of the revolution


@pytest.mark.parametrize("multiplicative", [False, True])
def test_the_kind_of_scatter_is_decided_rightly_or_not_at_all(multiplicative):
    """Friction that falls to two thirds scatters so much less: 400 lengths decide that in most records.

    Noise and low-pass hide each other; a search that stops at the wrong one of the two tops decides wrongly.
    """
    found = [fitted(2, 400.0, True, multiplicative=multiplicative, noise=0.002)[0]]
    found += [fitted(seed, 400.0, multiplicative=multiplicative, noise=0.002)[0] for seed in (1, 2)]
    right = "multiplicative" if multiplicative else "additive"
    assert {one.kind for one in found} <= {right, "cannot tell"}
    assert found[0].kind == right
    scatter = found[0].scatter(right)
    relative = DEVIATION / np.mean(found[0].mean) if multiplicative else DEVIATION
    assert abs(np.log(scatter.standard_deviation / relative)) < 4 * np.sqrt(scatter.log_covariance[0, 0])
    wrong = found[0].scatter("additive" if multiplicative else "multiplicative")
    assert wrong.log_covariance[1, 1] > np.log(wrong.correlation_length_m / scatter.correlation_length_m) ** 2


def test_what_a_record_cannot_hold_is_said():
    """Another law, 20 lengths, and friction that follows speed 1 s late, on ramps of 7.5 s."""
    other, samples = fitted(2, 400.0, True, law=hump)
    assert (other.curve.form, other.curve.misfit < 0.01) == ("spline", True)
    assert away(other, samples, hump) < 1.0
    short, _ = fitted(0, 20.0, True)
    assert (short.additive.identified, "cannot tell" in short.notes[-1]) == (False, True)
    late, _ = fitted(3, 400.0, True, lag=1.0)
    assert (late.ramps < 1e-3, "ramps up and down differ" in " ".join(late.notes)) == (True, True)
    strokes = replace(samples, step=np.where(np.arange(N) % 60 == 0, -1.0, samples.step))  # a phase in each of 20
    many = fit_record(strokes, around(400.0), samples.seconds[0])
    assert (np.isnan(many.period), "repeats each turn is not taken out" in many.notes[0]) == (True, True)
    few = SlidingSamples(*(getattr(samples, name)[:100] for name in ("friction", "speed", "step", "seconds", "change")))
    with pytest.raises(IllPosedError, match="100 samples of sliding"):
        fit_record(few)


def test_a_period_is_found_without_its_length():
    """A wave as large as the scatter; wavelengths are tried in steps of half a period in the record, of 7.3."""
    waved, without = (record(2, 400.0, wobble=wobble) for wobble in (0.02, 0.0))
    said = []
    found = fit_record(waved, None, SECONDS / N, progress=said.append)
    assert len(said) == 3
    assert f"{waved.friction.size} samples" in said[0]
    law = found.curve.law(static_friction=0.9)
    np.testing.assert_allclose(law.mu(found.curve.speeds_m_per_s), found.curve.friction, rtol=1e-6)
    assert (law.static, float(law.mu(0.0))) == (0.9, pytest.approx(found.curve.at_rest))
    assert law.slowest_known == found.curve.speeds_m_per_s[0]
    assert found.period < 1e-3
    assert found.period_m == pytest.approx(around(400.0), rel=0.5 / 7.3)
    assert np.isnan(fit_record(without, None, SECONDS / N).period_m)


def test_slips_tilt_the_curve_by_a_fifth_of_the_scatter():
    """0.2 of 0.02 at either end, with opposite signs, and at rest as at the slow end."""
    curve = FrictionCurve("spline", np.geomspace(0.1, 1.0, 3), np.full(3, 0.3), np.zeros((3, 1)), 0.5, 0.3, np.zeros(1))
    tilted = _tilted(curve, 0.02)
    assert tilted.factor[:, 1] == pytest.approx([0.004, 0.0, -0.004])
    assert tilted.factor_at_rest[1] == pytest.approx(0.004)


ERROR = 2e-3


def curve_of(law, speeds, seed=3):
    """The curve through friction with independent errors."""
    friction = law(speeds) + ERROR * np.random.default_rng(seed).standard_normal(speeds.size)
    return fitted_curve(speeds, friction / ERROR, np.empty((speeds.size, 0)), lambda columns: columns / ERROR), friction


def test_the_law_is_fitted_where_it_holds():
    """The truth within four standard errors, which are those of least squares of five columns; at rest, too."""
    speeds = np.geomspace(0.02, 1.0, 400)
    curve, _ = curve_of(stribeck, speeds)
    assert curve.form == "stribeck"
    assert curve.misfit > 0.01
    error = np.sqrt(np.sum(curve.factor**2, axis=1))
    assert np.all(np.abs(curve.friction - stribeck(curve.speeds_m_per_s)) < 4 * error)
    assert abs(curve.at_rest - stribeck(0.0)) < 4 * np.sqrt(np.sum(curve.factor_at_rest**2))
    decay = 8.0
    columns = stribeck_columns(speeds, decay)
    bend = 0.25 * decay * speeds / (1.0 + decay * speeds) ** 2
    covariance = ERROR**2 * np.linalg.inv(np.column_stack([columns, bend]).T @ np.column_stack([columns, bend]))
    at = np.column_stack([stribeck_columns(curve.speeds_m_per_s, decay), 0.25 * decay * curve.speeds_m_per_s])
    at[:, 3] /= (1.0 + decay * curve.speeds_m_per_s) ** 2
    assert error == pytest.approx(np.sqrt(np.sum(at @ covariance * at, axis=1)), rel=0.1)


@pytest.mark.parametrize("levels", [1, 2, 3])
def test_few_speeds_have_their_means(levels):
    """As many columns as levels pass through the mean friction of each, with its standard error."""
    means = np.array([0.2, 0.4, 0.8])[:levels]
    curve, friction = curve_of(stribeck, np.repeat(means, 50))
    at = [int(np.argmin(np.abs(curve.speeds_m_per_s - mean))) for mean in means[[0, -1]]]
    expected = friction.reshape(levels, 50).mean(axis=1)[[0, -1]]
    assert curve.friction[at] == pytest.approx(expected, rel=1e-6)
    assert np.sqrt(np.sum(curve.factor[at] ** 2, axis=1)) == pytest.approx(ERROR / np.sqrt(50), rel=1e-5)
    assert np.isnan(curve.misfit)


def test_a_penalty_smooths_what_errors_bend():
    """A line over the logarithm of speed, 80 points with errors of a sixth: a spline without penalty errs more."""
    speeds, knots = np.geomspace(0.02, 1.0, 80), np.geomspace(0.02, 1.0, 30)
    basis, errors = SpeedBasis(speeds), []
    white, nothing = basis.at(speeds) / 0.05, np.empty((80, 0))
    for seed in range(20):
        target = (0.3 + 0.02 * np.log(speeds)) / 0.05 + np.random.default_rng(seed).standard_normal(80)
        curve = _spline_curve(basis, knots, target, white, nothing, 0.0)
        plain = basis.at(knots) @ np.linalg.lstsq(white, target, rcond=None)[0]
        errors.append([np.std(one - 0.3 - 0.02 * np.log(knots)) for one in (curve.friction, plain)])
    smooth, rough = np.sqrt(np.mean(np.square(errors), axis=0))
    assert smooth < 0.8 * rough


def test_moments_of_the_scatter_are_those_of_the_residuals():
    """Over their weights; noise of half the variance adds to none but the variance; of n / 2 lengths n / 4 count."""
    generator, n, share = np.random.default_rng(2), 4000, 0.5
    residual, weight, mean = generator.gamma(4.0, size=n), *generator.uniform([[0.5], [1.0]], 2.0, (2, n))
    step = np.full(n, 0.5)
    samples = SlidingSamples(mean + weight * residual, step, step, step, step)
    fit = SimpleNamespace(weight=weight, deviation=np.sqrt(share * np.var(residual)), length=1.0)
    (skewness, s_error), (excess, e_error) = _moments(samples, mean, fit)
    assert (skewness, s_error) == pytest.approx((stats.skew(residual) / share**1.5, np.sqrt(6e-3) / share**1.5))
    assert (excess, e_error) == pytest.approx((stats.kurtosis(residual) / share**2, np.sqrt(24e-3) / share**2))


@pytest.mark.parametrize("digital", [True, False])
def test_whitening_is_that_of_the_dense_covariance(digital):
    """Uneven steps, an instrument with memory, a factor of the scatter, noise, and a second record that forgets."""
    generator, n, second, noise = np.random.default_rng(3), 200, 110, 0.1
    step, seconds = generator.uniform(0.01, 0.3, n), generator.uniform(0.4, 1.6, n)
    step[[0, second]], weight = -1.0, generator.uniform(0.5, 1.5, n)
    response = SlidingSamples(step, step, step, seconds, step).response(1.0, digital)
    covariance, columns = noise * np.eye(n), generator.standard_normal((n, 3))
    for first, last in ((0, second), (second, n)):
        place = np.cumsum(np.append(0.0, step[first + 1 : last]))
        shown = np.zeros((last - first, last - first))
        shown[0, 0] = weight[first]
        for t in range(1, last - first):
            keep, dt = np.exp(-seconds[first + t]), seconds[first + t]
            shown[t] = keep * shown[t - 1]
            # of a straight line from 0 to 1 over dt: the integral of exp(u - dt) u / dt
            here = 1.0 - keep if digital else quad(lambda u, dt: np.exp(u - dt) * u / dt, 0.0, dt, (dt,))[0]
            shown[t, t - 1 : t + 1] += np.array([1.0 - keep - here, here]) * weight[first + t - 1 : first + t + 1]
        within = np.exp(-np.abs(place[:, None] - place) / 1.3)
        covariance[first:last, first:last] += shown @ within @ shown.T
        mean = shown @ (columns[first:last] / weight[first:last, None])
        assert through_instrument(columns, response)[first:last] == pytest.approx(mean, abs=1e-12)
    root = np.linalg.cholesky(covariance)
    white, log_det = whitened(1.3, step, response, weight, noise, columns)
    assert white == pytest.approx(np.linalg.solve(root, columns), abs=1e-11)
    assert log_det == pytest.approx(2.0 * np.sum(np.log(np.diag(root))), abs=1e-10)
