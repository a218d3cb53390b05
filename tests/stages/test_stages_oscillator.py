"""From friction statistics to process and oscillator; runs without a cycle; ranges of mass and belt velocity."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import InputError
from roughslip.friction.table_variables import distribution
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import cycle_period
from roughslip.oscillator.motion import simulate
from roughslip.scene.types import scene_of
from roughslip.stages import deterministic
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers, friction_numbers, friction_paths, friction_process
from roughslip.stages.result_tables.ensemble_table import CLOSING_PERIODS, closing_periods, cycling_share
from roughslip.stages.runtime.usage import Usage
from tests.stages.scenes import OSCILLATOR

GIVEN = {"mean": 0.3, "standard_deviation": 0.05, "correlation_length_m": 2.5e-4, "beta_a": 2.1, "beta_b": 5.0}


def process_of(numbers, marginal=None, statistics=None):
    ensemble = {} if marginal is None else {"marginal": marginal}
    return friction_process(scene_of({"ensemble": ensemble, "oscillator": OSCILLATOR}), numbers, statistics)


@pytest.mark.parametrize(("a", "b"), [(2.1, 5.0), (0.5, 0.5), (90.0, 300.0)])
@pytest.mark.parametrize("std", [0.01, 0.2])
def test_the_process_has_the_mean_and_scatter_of_the_statistics(a, b, std):
    numbers = FrictionNumbers(**(GIVEN | {"standard_deviation": std, "beta_a": a, "beta_b": b}))
    process = process_of(numbers)
    marginal = process.marginal
    assert (marginal.mean, marginal.standard_deviation) == (pytest.approx(0.3), pytest.approx(std))
    assert (marginal.a, marginal.b, process.correlation_length_m) == (a, b, 2.5e-4)
    u = np.random.default_rng(0).beta(a, b, 200_000)
    mu = marginal.lower + (marginal.upper - marginal.lower) * u
    np.testing.assert_allclose([mu.mean(), mu.std()], [0.3, std], rtol=0.01)  # of draws: 1 / sqrt(2 n) and less
    paper = process_of(numbers, "paper").marginal
    assert (paper.a, paper.b, paper.mean, paper.standard_deviation) == pytest.approx((2.1, 5.0, 0.3, std))


def test_the_empirical_marginal_has_the_quantiles_of_the_windows_and_the_moments_of_the_numbers(tmp_path):
    """Exponentially distributed windows, whose skewness 2 a normal marginal would not have."""
    mu = np.random.default_rng(0).exponential(size=(40, 500))
    variables = distribution(mu, np.ones(mu.shape, dtype=bool))
    store.write(tmp_path / "statistics.nc", variables, store.Key({}, "abc"))
    process = process_of(FrictionNumbers(**GIVEN), "empirical", tmp_path / "statistics.nc")
    z = np.random.default_rng(1).standard_normal(100_000)
    values = process.marginal.scale * process.marginal.centred(z)
    assert values.std() == pytest.approx(0.05, rel=0.02)  # 2.8 / (2 sqrt(1e5)) is a standard error, times four
    assert np.mean((values / values.std()) ** 3) == pytest.approx(np.mean(((mu - mu.mean()) / mu.std()) ** 3), rel=0.1)
    with pytest.raises(InputError, match="--friction"):
        process_of(FrictionNumbers(**GIVEN), "empirical")


@pytest.mark.parametrize("method", ["recursion", "spectral"])
def test_paths_are_long_enough_for_every_run(method):
    """For the runs and for the trajectories drawn, whichever take longer; a path by recursion has no end."""
    ensemble = {"duration_periods": 2, "process": method}
    configuration = {"ensemble": ensemble, "oscillator": OSCILLATOR}
    paths = friction_paths(scene_of(configuration), process_of(FrictionNumbers(**GIVEN)), 4)
    assert paths.spacing == 2.5e-4 / 4
    belt = mass_on_belt.oscillator(scene_of(configuration))
    periods = mass_on_belt.DISCARDED_PERIODS + mass_on_belt.DRAWN_PERIODS
    needed = mass_on_belt.path_length(belt, periods)
    assert needed == pytest.approx(0.948 * periods * 2 * np.pi / 316 + 10 * belt.F)  # more than the belt travels
    nodes = 0
    for piece in paths.realisation([0]):
        nodes += piece.size
        if nodes * paths.spacing > needed:
            break
    assert nodes * paths.spacing > needed


def test_numbers_of_the_statistics_are_those_at_the_penetration_unless_the_scene_gives_them(tmp_path):
    """Mean and scatter with the expansion as control, length and shape of the solved windows."""
    two = np.arange(3.0)
    variables = {
        "percentile": store.Variable(("level",), np.array([10.0, 50.0, 90.0]), "percent", "p"),
        "combined_mean": store.Variable(("level",), np.array([0.4, 0.3, 0.2]), "1", "m"),
        "combined_std": store.Variable(("level",), np.array([0.04, 0.03, 0.02]), "1", "s"),
        "combined_length_least_squares": store.Variable(("level",), 1e-4 * (1 + two), "m", "l"),
        "beta_a": store.Variable(("level",), 2 + two, "1", "a"),
        "beta_b": store.Variable(("level",), 5 + two, "1", "b"),
    }
    store.write(tmp_path / "statistics.nc", variables, store.Key({}, "abc"))
    median = friction_numbers(scene_of({"oscillator": {}}), tmp_path / "statistics.nc")
    assert median == FrictionNumbers(0.3, 0.03, 2e-4, 3.0, 6.0)
    # straight lines over the penetration, on which the curves through three levels lie as well
    between = friction_numbers(scene_of({"oscillator": {"penetration_percentile": 30.0}}), tmp_path / "statistics.nc")
    assert between.mean == pytest.approx(0.35)
    assert between.standard_deviation == pytest.approx(0.035)
    assert between.correlation_length_m == pytest.approx(1.5e-4)
    assert (between.beta_a, between.beta_b) == (pytest.approx(2.5), pytest.approx(5.5))
    moments = {name: value for name, value in GIVEN.items() if not name.startswith("beta")}
    given = scene_of({"friction": {"statistics": moments | {"beta_shapes": [2.1, 5.0]}}})
    assert friction_numbers(given, tmp_path / "absent.nc") == FrictionNumbers(**GIVEN)
    with pytest.raises(InputError, match="--friction"):
        friction_numbers(scene_of({"friction": {"mean_at_median": 0.3}}), None)


LAG = np.linspace(0.0, 1.5, 7)
TRIANGLE, ZERO = np.maximum(1 - LAG, 0.0), np.zeros((3, 1, 1))


def load_statistics(path):
    """Statistics of two penetrations, of pads of 1, 4 and 16 windows that scatter by n^-0.45."""
    pads, both, of_level = np.array([1.0, 4.0, 16.0]), ("level", "pad"), ("level",)
    columns = {
        "percentile": (of_level, np.array([10.0, 50.0])),
        "combined_mean": (of_level, np.array([0.4, 0.3])),
        "combined_std": (of_level, np.array([0.08, 0.04])),
        "combined_length_least_squares": (of_level, np.full(2, 2e-4)),
        "beta_a": (of_level, np.full(2, 3.0)),
        "beta_b": (of_level, np.full(2, 6.0)),
        "pad_windows": (("pad",), pads),
        "pad_lag": (("pad", "lag"), 6e-4 * np.array([[1.0], [1.0], [2.0]]) * LAG),
        "pad_means": (
            ("pad", "lag", "part"),
            np.stack([TRIANGLE, np.minimum(2 * TRIANGLE, 1.0)], axis=-1)[None] + ZERO,
        ),
        "pad_parts": (("level", "part"), np.array([[0.0, 3.0], [2.0, 0.0]])),
        "pad_mean": (both, np.array([[0.4], [0.3]]) * pads**-0.01),
        "pad_std": (both, np.array([[0.08], [0.04]]) * pads**-0.45),
        **dict.fromkeys(
            ("load_windows", "load_windows_low", "load_windows_high"), (of_level, np.array([1200.0, 400.0]))
        ),
        "load_std": (of_level, np.full(2, 1e-3)),
    }
    variables = {name: store.Variable(dimensions, values, "1", name) for name, (dimensions, values) in columns.items()}
    store.write(path, variables, store.Key({}, "abc"))
    return path


def parallel(windows, percentile):
    return scene_of({"oscillator": OSCILLATOR | {"windows_in_parallel": windows, "penetration_percentile": percentile}})


def test_windows_of_a_pad_scatter_as_the_strips_say(tmp_path):
    """n windows count as n^0.9, at stored numbers, between them and beyond; the mean is that of the pad."""
    path = load_statistics(tmp_path / "statistics.nc")
    for windows in (1, 4, 10, 1000):
        found = friction_numbers(parallel(windows, 50.0), path)
        assert found.mean == pytest.approx(0.3 * windows**-0.01, rel=1e-12)
        assert found.standard_deviation == 0.04
        independent = mass_on_belt.independent_windows(parallel(windows, 50.0), path)
        assert independent == pytest.approx(windows**0.9, rel=1e-12)
        process = friction_process(parallel(windows, 50.0), found, path)
        assert process.marginal.standard_deviation == pytest.approx(0.04 * windows**-0.45, rel=1e-9)
        assert process.marginal.mean == pytest.approx(found.mean, rel=1e-12)
    assert mass_on_belt.independent_windows(parallel(100, 50.0), None) == 100.0  # of given statistics
    between = friction_numbers(parallel(1, 30.0), path)
    assert between.standard_deviation == pytest.approx(0.06)  # at 30 %, halfway
    assert between.mean == pytest.approx(0.35)


def test_friction_of_a_pad_is_correlated_over_its_length(tmp_path):
    """At the median the triangle of the pad: 0.6 mm long up to four windows, twice that of 16, four times that of 256.

    At 10 % the other part alone: 1 up to half the length, then falling to zero, with an integral of 3/4 of it. A window
    keeps the exponential, and a length that a map gives it stretches the pad's.
    """
    path = load_statistics(tmp_path / "statistics.nc")
    for windows, length in ((2, 6e-4), (4, 6e-4), (8, 6e-4 * 2**0.5), (16, 1.2e-3), (256, 4.8e-3)):
        scene = parallel(windows, 50.0)
        found = friction_process(scene, friction_numbers(scene, path), path)
        assert found.correlation_length_m == pytest.approx(length / 2, rel=1e-9)
        half = found.autocorrelation(found.correlation_length_m)
        assert half == pytest.approx(0.5, rel=1e-9)
    deep = parallel(4, 10.0)
    assert friction_process(deep, friction_numbers(deep, path), path).correlation_length_m == pytest.approx(4.5e-4)
    stretched = replace(friction_numbers(scene, path), correlation_length_m=4e-4)
    assert friction_process(parallel(4, 50.0), stretched, path).correlation_length_m == pytest.approx(6e-4)
    alone = friction_process(parallel(1, 50.0), friction_numbers(scene, path), path)
    assert (alone.shape, alone.correlation_length_m) == (None, 2e-4)


@pytest.mark.parametrize(("windows", "warns"), [(1, True), (199, True), (201, False), (799, False), (801, True)])
def test_windows_that_miss_the_load_by_a_factor_of_two_are_warned_of(tmp_path, windows, warns):
    """400 windows bear the force at the median."""
    usage = Usage(tmp_path / "usage.json", "deterministic")
    job = SimpleNamespace(scene=parallel(windows, 50.0), usage=usage)
    deterministic.warn_of_load(job, store.read(load_statistics(tmp_path / "statistics.nc")), 0.04)
    assert bool(usage.warnings) == warns
    if warns:
        (text,) = usage.warnings
        assert text.startswith(f"2500 N on oscillator.windows_in_parallel = {windows}: at percentile 50")
        assert "a window bears 6.25 N" in text
        assert "needs 400 windows (400 to 400)" in text


def test_share_of_runs_that_cycle_to_the_end():
    """Four of five cycle in the last ten periods; Wilson's interval, by hand: (4 + z^2/2) / (5 + z^2) +- ..."""
    last = np.array([0.0, 90.5, 95.0, 99.0, 99.9])
    share, low, high = cycling_share(last, 100.0, CLOSING_PERIODS)
    assert share == 0.8
    z = 1.959963984540054
    centre, half = (4 + z**2 / 2) / (5 + z**2), z * np.sqrt(4 / 5 + z**2 / 4) / (5 + z**2)
    assert (low, high) == (pytest.approx(centre - half), pytest.approx(centre + half))
    for duration in (CLOSING_PERIODS, 0.5 * CLOSING_PERIODS):  # the last cycle of a run without one is at 0
        assert cycling_share(np.array([0.0, 0.0, 3.0, 4.0]), duration, CLOSING_PERIODS)[0] == 0.5


BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(fit=0.3)


def test_a_long_cycle_shows_in_the_closing_periods():
    """On a belt a hundred times slower stick takes most of the time: the closing periods are two of its cycles."""
    slow = replace(BELT, belt_velocity_m_per_s=0.948e-2)
    period = cycle_period(slow, LAW)
    assert CLOSING_PERIODS < 2 * period < np.inf
    assert closing_periods(2 * np.pi * period) == pytest.approx(2 * period)
    assert closing_periods(np.nan) == closing_periods(1.0) == CLOSING_PERIODS
    last = simulate(slow, LAW, duration_periods=10 * period).last_cycle
    assert cycling_share(np.array([last]), 10 * period, closing_periods(2 * np.pi * period))[0] == 1.0


def test_scatter_that_multiplies_is_the_same_over_the_mean(tmp_path):
    """The process in units of the mean, so that mu_D (1 + mu_S) scatters as mu_D + mu_S does where mu_D is the mean.

    On a pad far longer than a loop slips, added scatter moves nothing. Multiplied scatter moves the limit as the force
    does, by 0.933 of its coefficient of variation.
    """
    path = load_statistics(tmp_path / "statistics.nc")
    scenes = {
        scatter: scene_of({"oscillator": OSCILLATOR | {"windows_in_parallel": 256}, "friction": {"scatter": scatter}})
        for scatter in ("additive", "multiplicative")
    }
    numbers = FrictionNumbers(0.3, 0.04, 2e-4, 3.0, 6.0)
    added, multiplied = (friction_process(scene, numbers, path) for scene in scenes.values())
    assert multiplied.marginal.standard_deviation == pytest.approx(added.marginal.standard_deviation / 0.3, rel=1e-12)
    assert multiplied.marginal.mean == pytest.approx(1.0)
    assert [mass_on_belt.motion_options(scene).scatter for scene in scenes.values()] == [*scenes]
    belt = mass_on_belt.oscillator(scenes["additive"])
    moved = {
        name: [mass_on_belt.response_of_limit(scene, belt, numbers, path, count)[1] for count in (256, 2.56e10)]
        for name, scene in scenes.items()
    }
    assert moved["additive"] == [pytest.approx(2.53, abs=0.01), pytest.approx(0.0, abs=0.2)]
    limit = mass_on_belt.response_of_limit(scenes["additive"], belt, numbers, path)[0].limit
    assert moved["multiplicative"] == [pytest.approx(2.43, abs=0.01), pytest.approx(0.933 * limit / 0.3, rel=0.01)]
