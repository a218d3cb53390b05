"""Variance by source, against closed forms."""

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.probability.sensitivity import Source, variance_split

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
    assert split.drawn[0].mean() == pytest.approx(4.0, abs=2e-3)
    assert split.drawn[0].var() == pytest.approx(parts.sum(), rel=0.02)
    near(split.first[0], parts / parts.sum())
    near(split.total[0], parts / parts.sum())


def test_of_a_product_the_interaction_is_the_product_of_the_variances(split):
    """Var(xy) = V_x y^2 + V_y x^2 + V_x V_y, with relative variances 0.04 and 0.0225."""
    x, y = 0.04, 0.0225
    whole = x + y + x * y
    near(split.first[1], np.array([x, y]) / whole)
    near(split.total[1], np.array([x + x * y, y + x * y]) / whole)
    assert split.drawn[1].var() == pytest.approx(4.0 * whole, rel=0.02)


def test_a_constant_has_no_parts(split):
    assert not split.first[2].any()
    assert not split.total[2].any()


def test_inputs_of_one_source_have_its_covariance():
    """A slope and a level that a fit gives together; so large uncertainties would be negative as normal ones."""
    covariance = np.array([[0.25, -0.12], [-0.12, 0.16]])
    source = Source("curve", {"level": 1.0, "slope": 0.5}, covariance)
    drawn = np.array(list(source.drawn(np.random.default_rng(1).standard_normal((2, 400_000))).values()))
    assert drawn.min() > 0.0
    assert drawn.mean(axis=1) == pytest.approx([1.0, 0.5], rel=5e-3)
    assert np.cov(drawn) == pytest.approx(covariance, rel=0.05)


def test_a_curve_of_many_points_is_drawn_along_few_axes():
    """Forty points of a curve with two parameters, as a record gives it."""
    speeds = np.linspace(0.0, 1.0, 40)
    factor = np.stack((0.02 * np.ones(40), 0.01 * speeds), axis=1)
    source = Source("curve", {f"{v:.3f}": 0.4 - 0.1 * v for v in speeds}, factor @ factor.T)
    assert source.axes <= 6
    drawn = np.array(list(source.drawn(np.random.default_rng(2).standard_normal((source.axes, 100_000))).values()))
    assert np.cov(drawn)[0, 0] == pytest.approx(4e-4, rel=0.02)
    assert np.cov(drawn)[-1, -1] == pytest.approx(5e-4, rel=0.02)


def test_an_interval_of_a_limit_holds_the_truth_as_often_as_it_says():
    """Measured inputs of a limit v sqrt(k m) / mu, each with its standard uncertainty; 90 % of it in 85 to 95 %."""
    generator, cases = np.random.default_rng(7), 400
    relative = {"v": 0.05, "k": 0.3, "m": 0.1, "mu": 0.15}
    normal, inside = generator.standard_normal((4, 4000)), 0

    def limit(x):
        return x["v"] * np.sqrt(x["k"] * x["m"]) / x["mu"]

    for _ in range(cases):
        truth = {name: np.exp(generator.standard_normal()) for name in relative}
        measured = {name: truth[name] * np.exp(s * generator.standard_normal()) for name, s in relative.items()}
        inputs = {name: (measured[name], s * measured[name]) for name, s in relative.items()}
        low, high = np.quantile(limit(Source.independent("all", inputs).drawn(normal)), (0.05, 0.95))
        inside += low <= limit(truth) <= high
    assert 0.85 <= inside / cases <= 0.95


def test_without_sources_the_function_is_called_once():
    assert variance_split(lambda v: (2.0,), ()).drawn.tolist() == [[2.0]]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: variance_split(lambda v: (1.0,), (A, A)), "no input may stand in two sources"),
        (lambda: variance_split(lambda v: (1.0,), (A,), 100), "samples must be a power of two, not 100"),
        (lambda: Source("a", {"x": -1.0}, [[1.0]]), "must be finite and positive"),
        (lambda: Source("a", {"x": 1.0, "y": 1.0}, [[1.0, 0.0], [0.5, 1.0]]), "must be symmetric"),
        (lambda: Source("a", {"x": 1.0, "y": 1.0}, [[0.01, 0.04], [0.04, 0.01]]), "it has a negative variance"),
    ],
)
def test_what_is_no_source_is_refused(call, message):
    with pytest.raises(ParameterError, match=message):
        call()
