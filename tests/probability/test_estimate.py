"""Statistics with intervals; a probability on a lattice; crossings of a level by paths with known changes; variance by
source, against closed forms.
"""

import itertools
import math

import numpy as np
import pytest
from scipy import stats
from scipy.special import bdtr, ndtr, ndtri

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.probability import Estimate, Source
from roughslip.probability.estimate import columns_of, interval_margin, student_95, variance_split, wilson_interval
from roughslip.probability.search import ACCURACY, COARSE, START, LevelSearch, central_counts, first_change, lattice_map

ROWS = np.exp(0.3 * np.random.default_rng(4).standard_normal((41, 2)))  # a sample and 40 replicates of two numbers
LOW, HIGH = np.quantile(ROWS[1:], (0.025, 0.975), axis=0)


def test_a_percentile_interval_and_that_of_a_scale_with_a_margin():
    """That of a scale is as far above the value as the replicates lie below it, as a ratio."""
    wide, scale = Estimate.from_rows(ROWS, 1.5), Estimate.of_scale(ROWS, 1.5)
    np.testing.assert_allclose(wide.low, ROWS[0] + 1.5 * (LOW - ROWS[0]), rtol=1e-14)
    np.testing.assert_allclose(wide.high, ROWS[0] + 1.5 * (HIGH - ROWS[0]), rtol=1e-14)
    np.testing.assert_array_equal(wide.rows, ROWS)
    np.testing.assert_array_equal(columns_of([wide, wide])[2], [columns_of(wide)[2]] * 2)
    low, high = np.quantile(np.log(ROWS[1:]), (0.025, 0.975), axis=0)
    np.testing.assert_allclose(scale.low, ROWS[0] * np.exp(-1.5 * (high - np.log(ROWS[0]))), rtol=1e-13)
    np.testing.assert_allclose(scale.high, ROWS[0] * np.exp(1.5 * (np.log(ROWS[0]) - low)), rtol=1e-13)
    np.testing.assert_allclose(scale.rows, ROWS, rtol=1e-14)


def test_a_distance_lies_within_what_resampling_moves_the_curve():
    moved = np.linspace(0.0, 1.0, 101)
    for value, low in ((2.0, 1.05), (0.5, 0.0)):
        estimate = Estimate.of_distance(np.array([value, 3.0, 4.0]), moved)
        assert (estimate.value, estimate.low, estimate.high) == pytest.approx((value, low, value + 0.95))
        np.testing.assert_array_equal(estimate.rows, [value, 3.0, 4.0])


@pytest.mark.parametrize("samples", [3, 24, 1000])
def test_margins_for_few_samples(samples):
    """Student's quantile over the normal one; replicates of n numbers scatter by sqrt(1 - 1 / n) too little."""
    quantile = stats.t.ppf(0.975, samples - 1)
    assert student_95(samples) == pytest.approx(quantile, rel=1e-12)
    shown = stats.norm.ppf(0.975) * math.sqrt(1.0 - 1.0 / samples)
    assert interval_margin(samples) * shown == pytest.approx(quantile, rel=1e-12)
    fewer = stats.t.ppf(0.975, max((samples - 1) / 3, 1.0))
    assert interval_margin(samples, 1 / 3) * shown == pytest.approx(fewer, rel=1e-12)


def test_the_interval_of_a_share_is_that_of_wilson():
    successes, trials = np.array([0, 3, 17, 40]), np.array([40, 40, 20, 40])
    low, high = wilson_interval(successes, trials)
    for row, (k, n) in enumerate(zip(successes, trials, strict=True)):
        exact = stats.binomtest(k, n).proportion_ci(method="wilson")
        assert (low[row], high[row]) == pytest.approx((exact.low, exact.high), abs=1e-12)
    assert [float(end) for end in wilson_interval(0.0, 0.0)] == [0.0, 1.0]
    with pytest.raises(ParameterError, match="must be finite"):
        wilson_interval(successes, np.where(successes > 0, trials, np.inf))


POINTS = 33


def band(i, j):
    """A band of chance that widens along a curve, as that of stick-slip does."""
    x, y = i / (POINTS - 1), j / (POINTS - 1)
    return float(ndtr((1.1 - x - 0.7 * y**2) / (0.01 + 0.05 * y)))


EVERY = np.array([[band(i, j) for j in range(POINTS)] for i in range(POINTS)])


def bilinear(every, points):
    """The map of a full lattice of fewer points, by straight lines between them."""
    at = np.arange(0, POINTS, (POINTS - 1) // (points - 1))
    whole = np.arange(POINTS)
    columns = np.array([np.interp(whole, at, row) for row in every[np.ix_(at, at)].T]).T
    return np.array([np.interp(whole, at, row) for row in columns])


def test_a_seventh_of_the_nodes_errs_less_than_a_full_lattice():
    """17 x 17 nodes and straight lines between them, against a seventh and a fifth of so many. The error of the spline
    is that at the last third of the nodes added: of three the last two, each as the map without it has it."""
    full = np.abs(bilinear(EVERY, 17) - EVERY).mean()
    for computed, share in ((40, 0.7), (56, 0.5)):
        lattice = lattice_map(band, POINTS, computed)
        assert lattice.is_computed.sum() == computed
        np.testing.assert_array_equal(lattice.probability[lattice.is_computed], EVERY[lattice.is_computed])
        assert np.abs(lattice.probability - EVERY).mean() < share * full
    maps, errors = [lattice_map(band, POINTS, START**2 + added) for added in (1, 2, 3)], []
    for before, after in itertools.pairwise(maps):
        (node,) = np.argwhere(after.is_computed & ~before.is_computed)
        errors.append(abs(band(*node) - before.probability[tuple(node)]))
    assert maps[-1].prediction_error == pytest.approx(np.mean(errors), rel=1e-9)
    assert lattice_map(band, POINTS, START**2).prediction_error == 0.0


def test_each_node_is_asked_for_once_and_most_are_in_the_band():
    """Of the nodes added, three in five lie where the probability is neither 0 nor 1 to 2 %; of all, one in three."""
    asked = []
    lattice_map(lambda i, j: (asked.append((i, j)), band(i, j))[1], POINTS, 56)
    assert len(set(asked)) == len(asked) == 56
    inside = (EVERY > 0.02) & (EVERY < 0.98)
    assert inside.mean() < 0.33
    assert np.mean([inside[one] for one in asked[START**2 :]]) > 0.6
    for value in (0.0, 1.0, 0.3):  # a probability that does not change is found everywhere
        np.testing.assert_allclose(lattice_map(lambda i, j, value=value: value, 9, 20).probability, value, atol=1e-9)


PATHS = 100


def search_of(changes, start=0.1, low=1e-3, high=10.0, hints=()):
    """Paths that show the event up to a value of their own."""
    return LevelSearch(lambda x, paths: changes[paths.start : paths.stop] > x, start, low, high, changes > start, hints)


def test_intervals_cover_the_quantile_of_a_known_distribution_as_often_as_its_order_statistics():
    """Lognormal changes of 10 %. Of 200 ensembles 0.983 are expected to cover, with a standard error of 0.009. The
    value is that of the order statistic, as accurate as promised. No smaller central counts hold 95 %."""
    for level in (0.05, 0.95):
        least, largest = central_counts(PATHS, level)
        assert max(bdtr(least - 1, PATHS, level), 1 - bdtr(largest, PATHS, level)) <= 0.025
        assert min(bdtr(least, PATHS, level), 1 - bdtr(largest - 1, PATHS, level)) > 0.025
    generator = np.random.default_rng(1)
    covered = []
    for _ in range(200):
        changes = np.exp(generator.normal(0.3, 0.1, PATHS))
        search = search_of(changes)
        for level in (0.05, 0.95):
            crossing = search.crossing(level, upwards=True)
            covered.append(crossing.low <= math.exp(0.3 + 0.1 * ndtri(1 - level)) <= crossing.high)
            near = np.sort(changes)[::-1][round(level * PATHS) - 1 : round(level * PATHS) + 1]
            assert near[1] * (1 - COARSE) <= crossing.value <= near[0] * (1 + COARSE)
        assert search.crossing(0.05, upwards=False) is None
    assert np.mean(covered) >= 0.983 - 3 * 0.009


@pytest.mark.parametrize("level", [0.05, 0.4, 0.95])
def test_the_reciprocal_of_the_parameter_has_the_reciprocal_crossing(level):
    """A search downwards is one upwards of 1 / x."""
    changes = np.exp(np.random.default_rng(2).normal(0.3, 0.4, PATHS))
    one = search_of(changes).crossing(level, upwards=True)
    down = LevelSearch(lambda x, paths: changes[paths.start : paths.stop] * x > 1.0, 10.0, 0.1, 1e3, changes > 0.1)
    other = down.crossing(level, upwards=False)
    assert (1 / other.high, 1 / other.value, 1 / other.low) == pytest.approx((one.low, one.value, one.high), rel=1e-9)


@pytest.mark.parametrize(("off", "share"), [(0.0, 0.5), (2e-3, 0.7), (0.3, 1.3)])
def test_a_hint_saves_trials_where_the_crossing_is_near_it(off, share):
    """Changes that scatter by 0.01 % about 1.3: the same crossings, with less trials the nearer the hint is."""
    changes = 1.3 * np.exp(np.random.default_rng(3).normal(0.0, 1e-4, PATHS))
    plain, hinted = search_of(changes), search_of(changes, hints=[1.3 * math.exp(off)])
    for level in (0.05, 0.95):
        value = plain.crossing(level, upwards=True).value
        assert hinted.crossing(level, upwards=True).value == pytest.approx(value, rel=2 * ACCURACY)
    assert hinted.trials < share * plain.trials


def test_what_the_search_cannot_find():
    """An interval that reaches its end is open: the level 0.05 is crossed at 9.9, where six of the paths are left, and
    five stay to the end. A value that cannot be tried ends the search."""
    crossing = search_of(np.append(np.full(95, 9.9), np.full(5, np.inf))).crossing(0.05, upwards=True)
    assert (crossing.low, crossing.value) == pytest.approx((9.9, 9.9), rel=COARSE)
    assert crossing.high is None

    def occurs(x, paths):
        if x > 3:
            raise IllPosedError("no limit")
        return np.ones(len(paths), dtype=bool)

    search = LevelSearch(occurs, 1.0, 0.01, 100.0, np.ones(PATHS, dtype=bool))
    assert search.crossing(0.05, upwards=True) is None
    assert search.searched == pytest.approx((0.01, 100 ** (1 / 8)))

    def narrow(x, paths):
        if x != 1.0 and abs(x - 1.3) < 1e-3:
            raise ConvergenceError("too stiff at a hint", residual=1.0, work=1)
        return np.full(len(paths), x < 1.31)

    search = LevelSearch(narrow, 1.0, 0.01, 100.0, np.ones(PATHS, dtype=bool), hints=[1.3])
    assert search.crossing(0.05, upwards=True).value == pytest.approx(1.31, rel=COARSE)


# of an answer at 1: up to where it is the same, then unknown, then the same again; beyond it is another
ANSWERS = {"at once": (2.0, 2.0, 2.0), "unknown between": (1.5, 2.0, 3.0), "never": (99.0, 99.0, 99.0)}


@pytest.mark.parametrize("name", ANSWERS)
@pytest.mark.parametrize("power", [1, -1])
def test_an_answer_changes_between_two_neighbouring_values(name, power):
    """To the accuracy asked for, upwards to 10 and downwards to 1/10."""
    own, unknown, again = ANSWERS[name]

    def answer(value):
        value = value**power
        return "own" if value < own or unknown <= value < again else None if value < unknown else "other"

    last, first = first_change(answer, 1.0, 10.0**power)
    if again > 10.0:
        assert (last, first) == (10.0**power, None)
    else:
        assert (last**power, first**power) == pytest.approx((again, again), rel=2e-6)
        assert (answer(last), answer(first)) == ("own", "other")


A, B = Source.independent("a", {"x": (1.0, 0.2)}), Source.independent("b", {"y": (2.0, 0.3), "z": (1.0, 0.2)})


@pytest.fixture(scope="module")
def split():
    def function(v):
        return 3.0 * v["x"] + v["y"] - v["z"], v["x"] * v["y"], 1.0

    return variance_split(function, (A, B), 1024)


def near(indices, expected, widest=0.12):
    """Each interval of 95 %, doubled, holds the expected index, and is no wider than a test of it needs."""
    for (value, low, high), index in zip(indices, expected, strict=True):
        assert low - (high - low) / 2 <= index <= high + (high - low) / 2
        assert low <= value <= high
        assert high - low < 2 * widest


def test_of_a_sum_the_indices_are_the_shares_of_the_variances(split):
    """A lognormal input has the mean and the standard deviation that it is given with, so the sum is exact."""
    parts = np.array([9 * 0.04, 0.09 + 0.04])
    assert split.drawn.shape == (3, 2048)
    assert split.drawn[0].mean() == pytest.approx(4.0, abs=2e-3)
    assert split.drawn[0].var() == pytest.approx(parts.sum(), rel=0.02)
    near(split.first[0], parts / parts.sum())
    near(split.total[0], parts / parts.sum())
    near(variance_split(lambda v: (v["x"],), (A,), 1024).first[0], [1.0])  # one result of one source


def test_of_a_product_the_interaction_is_the_product_of_the_variances(split):
    """Var(xy) = V_x y^2 + V_y x^2 + V_x V_y, with relative variances 0.04 and 0.0225."""
    x, y = 0.04, 0.0225
    whole = x + y + x * y
    near(split.first[1], np.array([x, y]) / whole)
    near(split.total[1], np.array([x + x * y, y + x * y]) / whole)
    assert split.drawn[1].var() == pytest.approx(4.0 * whole, rel=0.02)
    assert not split.first[2].any()  # of a constant


def test_inputs_of_one_source_have_its_covariance():
    """A slope and a level that a fit gives together; so large uncertainties would be negative as normal ones."""
    covariance = np.array([[0.25, -0.12], [-0.12, 0.16]])
    source = Source("curve", {"level": 1.0, "slope": 0.5}, covariance)
    drawn = np.array(list(source.drawn(np.random.default_rng(1).standard_normal((2, 400_000))).values()))
    assert drawn.min() > 0.0
    assert drawn.mean(axis=1) == pytest.approx([1.0, 0.5], rel=5e-3)
    assert np.cov(drawn) == pytest.approx(covariance, rel=0.05)
    # forty points of a curve with two parameters, as a record gives it, are drawn along few axes
    speeds = np.linspace(0.0, 1.0, 40)
    factor = np.stack((0.02 * np.ones(40), 0.01 * speeds), axis=1)
    source = Source("curve", {f"{v:.3f}": 0.4 - 0.1 * v for v in speeds}, factor @ factor.T)
    assert source.axes <= 6
    drawn = np.array(list(source.drawn(np.random.default_rng(2).standard_normal((source.axes, 100_000))).values()))
    assert np.cov(drawn)[[0, -1], [0, -1]] == pytest.approx([4e-4, 5e-4], rel=0.02)
