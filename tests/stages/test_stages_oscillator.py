"""From friction statistics to process and oscillator; runs without a cycle; ranges of mass and belt velocity.

The answer on stick-slip: the deterministic limits without scatter, identities of the equation of motion.

The stages of the stick-slip map: without scatter the deterministic limits decide, with it durations agree.
"""

import functools
import json
from argparse import Namespace
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import IllPosedError, InputError
from roughslip.friction.table_variables import windows_variables
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import cycle_period, limit_cycle
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.probability.level_search import ACCURACY
from roughslip.report.words import change_rows
from roughslip.scene.types import scene_of
from roughslip.stages import answer, deterministic, stick_slip_map
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers, friction_numbers, friction_paths, friction_process
from roughslip.stages.from_scene.variation import damping_ratios
from roughslip.stages.result_tables.ensemble_table import CLOSING_PERIODS, closing_periods, cycling_share
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.usage import Usage
from tests.stages.scenes import OSCILLATOR
from tests.stages.test_stages_motion import scattered

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
    mu = np.random.default_rng(0).exponential(size=(1, 40, 500))
    variables = windows_variables((mu, np.ones(mu.shape, dtype=bool)), 0)
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
        numbers = friction_numbers(parallel(windows, 50.0), path)
        assert numbers.mean == pytest.approx(0.3 * windows**-0.01, rel=1e-12)
        assert numbers.standard_deviation == 0.04
        independent = mass_on_belt.independent_windows(parallel(windows, 50.0), path)
        assert independent == pytest.approx(windows**0.9, rel=1e-12)
        process = friction_process(parallel(windows, 50.0), numbers, path)
        assert process.marginal.standard_deviation == pytest.approx(0.04 * windows**-0.45, rel=1e-9)
        assert process.marginal.mean == pytest.approx(numbers.mean, rel=1e-12)
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
        process = friction_process(scene, friction_numbers(scene, path), path)
        assert process.correlation_length_m == pytest.approx(length / 2, rel=1e-9)
        half = process.autocorrelation(process.correlation_length_m)
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


EXISTENCE = 0.324424  # of eq. (13) with the paper's numbers
CERTAIN = [72 / (72 + 1.959964**2), 1.0]  # Wilson's interval of 72 hits in 72 runs


@pytest.fixture(scope="module")
def answered(folder):
    """answered(std, varied, **oscillator) is answer.json, once; `varied` are the parameters that are searched."""

    @functools.cache
    def of_scene(std, varied=("damping",), **others):
        asked = scattered(std, **others) | {"answer": {"realisations": 72, "duration_periods": 20.0}}
        output, usage = folder / "answer.json", Usage(folder / "answer", "answer")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(answer, "VARIED", varied)
            answer.work(Job(store.Key(asked, "code"), Namespace(friction=None, output=output), usage))
        return json.loads(output.read_text())

    return of_scene


def test_without_scatter_both_limits_of_damping_are_the_existence_limit(answered):
    """Runs begin in stick, so that stick-slip exists up to there. From steady sliding, which is unstable, 20 periods
    are too short for so small a push to grow by exp(2 pi (0.231 - 0.17) 20) = 2000 to the size of the cycle."""
    answered_result = answered(1e-9)
    assert [answered_result["probability"]["value"], *answered_result["probability"]["interval"]] == pytest.approx(
        [1, *CERTAIN], rel=1e-6
    )
    assert answered_result["probability_from_sliding"]["value"] == 0.0
    above, below = (answered_result["limits"]["damping"][side] for side in ("above", "below"))
    for label in ("0.05", "0.95"):
        assert above[label]["change"] == "falls below"
        assert [above[label]["value"], *above[label]["interval"]] == pytest.approx([EXISTENCE] * 3, rel=2 * ACCURACY)
    assert above["without_scatter"]["value"] == pytest.approx(EXISTENCE, rel=4e-6)
    assert below == {"0.05": None, "0.95": None, "without_scatter": {"value": None, "interval": None, "unit": "1"}}
    assert answered_result["decides"]["by"] == "mean curve"
    assert answered_result["decides"]["existence_limit"]["value"] == pytest.approx(EXISTENCE, abs=1e-6)
    change = answered_result["smallest_change"]
    assert (change["parameter"], change["side"], change["aim"]) == ("damping", "above", "end")
    assert change["value"] == pytest.approx(EXISTENCE / 0.17 - 1, rel=4 * ACCURACY)


def test_without_scatter_amplitude_and_frequency_are_those_of_the_limit_cycle(answered):
    """Samples miss the extremes of the displacement by (pi / 100)^2 / 2 of the amplitude at most."""
    answered_result = answered(1e-9)
    belt, law = mass_on_belt.oscillator(scene_of({"oscillator": OSCILLATOR})), StribeckLaw(0.3, 0.4)
    assert answered_result["frequency"]["value"] == pytest.approx(316 / limit_cycle(belt, law).period, rel=1e-5)
    drawn = trajectory(belt, law, None, 0.0, 10.0, MotionOptions(samples_per_period=4000))
    amplitude = 0.5 * np.ptp(drawn.position[20_000:])
    assert amplitude * (1 - 0.5 * (np.pi / 100) ** 2) <= answered_result["amplitude"]["value"] <= amplitude * (1 + 1e-5)
    for name in ("amplitude", "frequency"):
        assert answered_result[f"{name}_scatter"]["value"] < 1e-3 * answered_result[name]["value"]


@pytest.mark.slow
def test_above_the_limits_stick_slip_begins_where_damping_falls(answered):
    """At D = 1 no run cycles, from either start; with hardly any scatter both levels are passed at the limit."""
    answered_result = answered(1e-9, damping_ratio=1.0)
    assert answered_result["probability"]["value"] == answered_result["probability_from_sliding"]["value"] == 0.0
    assert answered_result["amplitude"] == {"value": None, "interval": None, "unit": "m"}
    limit = answered_result["limits"]["damping"]["below"]
    assert limit["0.05"]["change"] == limit["0.95"]["change"] == "rises above"
    assert limit["0.95"]["value"] == pytest.approx(EXISTENCE, rel=2 * ACCURACY)
    assert answered_result["smallest_change"]["aim"] == "begin"
    assert answered_result["smallest_change"]["value"] == pytest.approx(EXISTENCE - 1, rel=2 * ACCURACY)
    (row,) = change_rows(answered_result)
    assert (row.name, row.now, row.needed, row.change) == ("less damping, D", "1", "0.324", "÷ 3.1")
    assert "practically excluded (0 % [0, 5])" in answered_result["summary"][0]
    assert "begins stick-slip is -68 %" in answered_result["summary"][2]


@pytest.mark.slow
def test_mass_spring_and_load_in_proportion_scale_their_limits_alone(answered):
    """The scaled equation has N / (m omega^2), V, D and omega: with twice the mass and load at one omega all runs are
    the same to the bit, as the factor is a power of two. The damper doubles with D."""
    one, two = (
        answered(0.03, answer.VARIED, mass_kg=factor, normal_force_n=factor * 2500, damping_ratio=0.3)
        for factor in (1.0, 2.0)
    )
    for key in ("probability", "probability_from_sliding", "amplitude", "frequency", "frequency_scatter"):
        assert one[key] == two[key]
    for name, factor in {"damping": 1, "belt_velocity": 1, "mass": 2, "stiffness": 2, "load": 2}.items():
        for side in ("below", "above"):
            for label in ("0.05", "0.95"):
                small, large = (answered_["limits"][name][side][label] for answered_ in (one, two))
                assert (small is None) == (large is None)
                if small is not None:
                    assert large["value"] == pytest.approx(factor * small["value"], rel=1e-9)
                    assert large["change"] == small["change"]
    assert one["limits"]["load"]["below"]["0.05"]["value"] < 2500
    assert one["decides"]["by"] == "scatter"


def test_an_excited_mass_has_no_answer(answered):
    answered_result = answered(0.03, excitation_force_n=10.0)
    assert answered_result["given"] is False
    assert answered_result["summary"] == [f"Stick-slip: no answer, because {answered_result['reason']}."]


MAP = {
    "parameters": ["belt_velocity", "damping"],
    "ranges": [[0.474, 1.896], [0.1, 0.5]],
    "points": 5,
    "realisations": 8,
    "duration_periods": 40,
}
ALL = 1.0  # share of the points that are run
LIMIT = 0.324424  # of existence in damping, by tests/oscillator/test_limits.py


def asked(std: float, **others: object) -> dict:
    configuration = scattered(std, **others) | {"map": MAP}
    del configuration["ensemble"]  # not read
    return configuration


def test_without_scatter_the_map_is_cut_at_the_limit_of_its_velocity(run, monkeypatch):
    """0 or 1 at every point, as runs begin in stick. mu_D' of eq. (13) by hand: the paper's own velocity is the middle
    one, and friction rises with speed soon after. All points are computed."""
    monkeypatch.setattr(stick_slip_map, "SHARE", ALL)
    hardly = run(stick_slip_map, asked(1e-9))
    damping, v = hardly["map_x"], hardly["map_y"]
    assert list(hardly["map_parameters"]) == ["damping", "belt_velocity"]
    np.testing.assert_allclose(v[[0, 2, 4]], [0.474, 0.948, 1.896], rtol=1e-12)
    np.testing.assert_allclose(damping[1] / damping[0], 5**0.25)
    exists = damping[:, None] < hardly["existence_limit"]
    np.testing.assert_array_equal(hardly["probability"], exists)
    assert 0 < exists.sum() < exists.size
    assert hardly["is_computed"].all()
    low, high = hardly["probability_low"], hardly["probability_high"]
    assert np.all(high - low == pytest.approx(1.96**2 / (8 + 1.96**2), abs=1e-4))  # Wilson's, of 0 or 8 of 8
    slope = -0.3 * 1.42 / (1 + 1.42 * v) ** 2 + 0.02 * v
    np.testing.assert_allclose(hardly["hopf_damping"], -slope * 2500 / (2 * 316), rtol=1e-9)
    assert hardly["existence_limit"][2] == pytest.approx(LIMIT, abs=1e-6)
    assert np.all(hardly["existence_limit"] > hardly["hopf_damping"])  # subcritical


@pytest.mark.slow
def test_the_map_of_few_points_is_that_of_all_where_it_has_them(run, monkeypatch):
    """The same realisations at every point, in any order; here the paths change with one of the parameters."""
    ranges = {"parameters": ["load", "correlation_length"], "ranges": [[2000.0, 6000.0], [1e-4, 1e-3]]}
    scene = asked(0.05, damping_ratio=0.4) | {"map": MAP | ranges}
    monkeypatch.setattr(stick_slip_map, "SHARE", ALL)
    whole = run(stick_slip_map, scene, "whole")
    monkeypatch.setattr(stick_slip_map, "SHARE", 18 / 25)
    few = run(stick_slip_map, scene, "few")
    computed = few["is_computed"] == 1
    assert computed.sum() == 18
    np.testing.assert_array_equal(few["probability"][computed], whole["probability"][computed])
    assert np.isnan(whole["existence_limit"]).all()  # no axis is the damping
    assert 0.05 < whole["probability"].mean() < 0.95


def test_a_range_without_effect_is_refused(run):
    scene = asked(1e-9) | {"map": MAP | {"parameters": ["windows", "damping"]}, "ensemble": {"marginal": "empirical"}}
    with pytest.raises(InputError, match="windows has no effect in this scene; choose of: damping, belt_velocity"):
        run(stick_slip_map, scene, "none")


def test_lists_of_dampings_surround_the_scenes_own_limits():
    """From below the Hopf damping, 0.2311, to above the limit. The scatter moves the limit
    (`grazing_response`), a tenth as far with a hundred windows, so that the list draws together."""
    numbers = FrictionNumbers(0.3, 0.05, 2.5e-4, 2.1, 5.0)
    spread = []
    for windows in (1, 100):
        values = {"oscillator": OSCILLATOR | {"windows_in_parallel": windows}, "ensemble": {}}
        ratios = np.array(damping_ratios(scene_of(values), numbers, None))
        assert len(ratios) <= 20
        assert np.all(np.diff(ratios) > 0)
        assert ratios[0] == pytest.approx(0.2 * 0.2311, abs=1e-4)
        assert ratios[-1] >= 1.2499 * LIMIT
        assert np.min(np.abs(ratios - LIMIT)) > 1e-6  # there the count without scatter is undecided
        spread.append(np.sort(np.abs(ratios - LIMIT))[11])
    assert spread[0] > 5 * spread[1]
    given = scene_of({"ensemble": {"damping_ratios": [0.1, 0.2]}})
    assert damping_ratios(given, numbers, None) == (0.1, 0.2)
    fast = {"oscillator": OSCILLATOR | {"belt_velocity_m_per_s": 20.0}, "ensemble": {}}
    with pytest.raises(IllPosedError, match=r"follows from the limits .* give a list"):
        damping_ratios(scene_of(fast), numbers, None)


@pytest.mark.slow
def test_where_no_cycle_exists_the_limit_is_nan_and_sliding_certain(run, capsys, monkeypatch):
    """At 20 m/s eq. (13) rises with speed: the quadratic term has the slope 0.4 s/m there."""
    fast = asked(1e-9) | {"map": MAP | {"ranges": [[0.948, 20.0], [0.1, 0.5]]}}
    monkeypatch.setattr(stick_slip_map, "SHARE", ALL)
    result = run(stick_slip_map, fast, "fast")
    assert list(np.isnan(result["existence_limit"][[0, -1]])) == [False, True]
    assert result["hopf_damping"][-1] < 0
    assert "values of belt_velocity" in capsys.readouterr().err
