"""From friction statistics to process and oscillator; runs without a cycle; ranges of mass and belt velocity.

The answer on stick-slip: the deterministic limits without scatter, identities of the equation of motion.

The stages of the stick-slip map: without scatter the deterministic limits decide, with it durations agree.
"""

import functools
import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import IllPosedError, InputError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import StribeckLaw
from roughslip.oscillator.limits import limit_cycle
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.probability.search import ACCURACY
from roughslip.scene.types import scene_of
from roughslip.study import answer, deterministic, stick_slip_map
from roughslip.study.cycles import CLOSING_PERIODS, cycling_share
from roughslip.study.from_scene import machine as from_scene
from tests.study.conftest import job_of
from tests.study.scenes import OSCILLATOR
from tests.study.test_stages_motion import scattered

BELT = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(fit=0.3)
EXISTENCE = 0.324424  # of eq. (13) with the paper's numbers


@pytest.mark.parametrize("method", ["recursion", "spectral"])
def test_paths_are_long_enough_for_every_run(method):
    """For the runs and for the trajectories drawn, whichever take longer; a path by recursion has no end."""
    scene = scene_of(
        scattered(0.05) | {"ensemble": {"duration_periods": 2, "process": method, "nodes_per_correlation_length": 4}}
    )
    paths = from_scene.friction_paths(scene, from_scene.friction_of(scene, None))
    assert paths.spacing == 2.5e-4 / 4
    periods = from_scene.DISCARDED_PERIODS + from_scene.DRAWN_PERIODS
    needed = from_scene.path_length(BELT, periods)
    assert needed == pytest.approx(0.948 * periods * 2 * np.pi / 316 + 10 * BELT.F)  # more than the belt travels
    pieces, nodes = iter(paths.realisation([0])), 0
    while nodes * paths.spacing <= needed:
        nodes += next(pieces).size


def test_friction_is_that_of_the_windows_unless_the_scene_gives_it(tmp_path):
    """Mean and scatter with the expansion as control, shapes of the solved windows; quantiles where they are asked."""
    path = load_statistics(tmp_path / "statistics.nc")
    own = from_scene.friction_of(parallel(1), path)
    assert (own.mean, own.deviation, own.length_m, own.marginal) == (0.3, 0.04, 2e-4, (3.0, 6.0))
    given = from_scene.friction_of(scene_of(scattered(0.05)), tmp_path / "absent.nc")
    assert (given.mean, given.deviation, given.length_m, given.marginal) == (0.3, 0.05, 2.5e-4, (2.1, 5.0))
    with pytest.raises(InputError, match="--friction"):
        from_scene.friction_of(parallel(1), None)
    paper = from_scene.friction_of(parallel(1, ensemble={"marginal": "paper"}), path)
    assert paper.marginal == (2.1, 5.0)


def test_friction_of_a_pad_scatters_and_is_correlated_as_the_strips_say(tmp_path):
    """n windows count as n^0.9, at stored numbers, between them and beyond. The triangle of the pad is 0.6 mm long up
    to four windows, twice that of 16, four times that of 256; a longer window stretches it."""
    path = load_statistics(tmp_path / "statistics.nc")
    for windows, length in ((2, 6e-4), (4, 6e-4), (8, 6e-4 * 2**0.5), (16, 1.2e-3), (256, 4.8e-3)):
        friction = from_scene.friction_of(parallel(windows), path)
        assert friction.mean == pytest.approx(0.3 * windows**-0.01, rel=1e-12)
        assert friction.pad_deviation == pytest.approx(0.04 * windows**-0.45, rel=1e-12)
        process = friction.process
        assert process.marginal.standard_deviation == pytest.approx(0.04 * windows**-0.45, rel=1e-9)
        assert process.correlation_length_m == pytest.approx(length / 2, rel=1e-9)
        assert process.autocorrelation(process.correlation_length_m) == pytest.approx(0.5, rel=1e-9)
    stretched = friction.changed(mean=friction.mean, windows=4, length_m=4e-4)
    assert stretched.correlation_length_m == pytest.approx(6e-4)
    assert stretched.changed(mean=0.3, windows=1, length_m=2e-4).process.shape is None


def test_scatter_of_a_pad_far_longer_than_a_loop(tmp_path):
    """Added scatter moves nothing. Multiplied scatter moves the limit as the force does, by 0.933 of its coefficient
    of variation."""
    path, moved = load_statistics(tmp_path / "statistics.nc"), {}
    for kind in ("additive", "multiplicative"):
        scene = parallel(256, friction={"scatter": kind})
        friction = from_scene.friction_of(scene, path)
        made = replace(from_scene.machine_of(scene, path), law=LAW)
        assert made.options.scatter == kind
        longer = replace(friction, mean=0.3, windows=2.56e10)
        moved[kind] = [from_scene.response_of_limit(made, one)[1] for one in (replace(friction, mean=0.3), longer)]
    assert moved["additive"] == [pytest.approx(2.53, abs=0.01), pytest.approx(0.0, abs=0.2)]
    assert moved["multiplicative"][1] == pytest.approx(0.933 * EXISTENCE / 0.3, rel=0.01)


def test_lists_of_dampings_surround_the_scenes_own_limits():
    """From below the Hopf damping, 0.2311, to above the limit. Scatter moves the limit, a tenth as far with a hundred
    windows, so that the list draws together."""
    spread = []
    for windows in (1, 100):
        scene = scene_of(scattered(0.05, windows_in_parallel=windows) | {"ensemble": {}})
        friction, made = from_scene.friction_of(scene, None), from_scene.machine_of(scene, None)
        ratios = np.array(from_scene.damping_ratios(scene, made, friction))
        assert len(ratios) <= 20
        assert np.all(np.diff(ratios) > 0)
        assert ratios[0] == pytest.approx(0.2 * 0.2311, abs=1e-4)
        assert ratios[-1] >= 1.2499 * EXISTENCE
        assert np.min(np.abs(ratios - EXISTENCE)) > 1e-6  # there the count without scatter is undecided
        spread.append(np.sort(np.abs(ratios - EXISTENCE))[11])
    assert spread[0] > 5 * spread[1]
    with pytest.raises(IllPosedError, match=r"follows from the limits of .* give a list"):
        from_scene.damping_ratios(scene, made.changed({"belt_velocity": 20.0}), friction)


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
        "quantile": (("quantile",), np.append(-np.log1p(-np.linspace(0.0, 0.999, 1000)), 9.0)),
    }
    variables = {name: store.Variable(dimensions, values, "1", name) for name, (dimensions, values) in columns.items()}
    store.write(path, variables, store.Key({}, "abc"))
    return path


def parallel(windows, **sections):
    return scene_of({"oscillator": OSCILLATOR | {"windows_in_parallel": windows}} | sections)


@pytest.mark.parametrize(("windows", "warns"), [(1, True), (199, True), (201, False), (799, False), (801, True)])
def test_windows_that_miss_the_load_by_a_factor_of_two_are_warned_of(tmp_path, windows, warns):
    """400 windows bear the force at the median."""
    said: list[str] = []
    job = SimpleNamespace(scene=parallel(windows), warn=said.append)
    deterministic.warn_of_load(job, store.read(load_statistics(tmp_path / "statistics.nc")), 0.04)
    assert bool(said) == warns
    if warns:
        (text,) = said
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


CERTAIN = [72 / (72 + 1.959964**2), 1.0]  # Wilson's interval of 72 hits in 72 runs


@pytest.fixture(scope="module")
def answered(folder):
    """answered(std, varied, **oscillator) is answer.json, once; `varied` are the parameters that are searched."""

    @functools.cache
    def of_scene(std, varied=("damping",), **others):
        asked = scattered(std, **others) | {"answer": {"realisations": 72, "duration_periods": 20.0}}
        job = job_of("answer", asked, folder / "answer.json")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(answer, "VARIED", varied)
            answer.work(job.scene, job)
        return json.loads(job.output.read_text())

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
    belt, law = BELT, StribeckLaw(0.3, 0.4)
    assert answered_result["frequency"]["value"] == pytest.approx(316 / limit_cycle(belt, law).period, rel=1e-5)
    drawn = trajectory(belt, law, None, 0.0, 10.0, MotionOptions(samples_per_period=4000))
    amplitude = 0.5 * np.ptp(drawn.position[20_000:])
    assert amplitude * (1 - 0.5 * (np.pi / 100) ** 2) <= answered_result["amplitude"]["value"] <= amplitude * (1 + 1e-5)
    for name in ("amplitude", "frequency"):
        assert answered_result[f"{name}_scatter"]["value"] < 1e-3 * answered_result[name]["value"]


@pytest.mark.slow
def test_mass_spring_and_load_in_proportion_scale_their_limits_alone(answered):
    """The scaled equation has N / (m omega^2), V, D and omega: with twice the mass and load at one omega all runs are
    the same to the bit, as the factor is a power of two. The damper doubles with D."""
    one, two = (
        answered(
            0.03,
            answer.VARIED,
            mass_kg=factor,
            stiffness_n_per_m=factor * 316.0**2,
            normal_force_n=factor * 2500,
            damping_ratio=0.3,
        )
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
}
ALL = 1.0  # share of the points that are run


@pytest.fixture(autouse=True)
def few(monkeypatch):
    monkeypatch.setattr(stick_slip_map, "RUNS", 8)


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
    assert hardly["existence_limit"][2] == pytest.approx(EXISTENCE, abs=1e-6)
    assert np.all(hardly["existence_limit"] > hardly["hopf_damping"])  # subcritical
