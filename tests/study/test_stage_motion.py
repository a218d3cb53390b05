"""From friction to motion: the machine of a scene, cycles with and without scatter, the answer, and the map."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import stdtrit

from roughslip import store
from roughslip.errors import InputError
from roughslip.oscillator.laws import StribeckLaw
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.probability.estimate import wilson_interval
from roughslip.probability.search import ACCURACY
from roughslip.scene.types import scene_of
from roughslip.study import deterministic
from roughslip.study.from_scene import machine
from tests.study.conftest import KEY, OSCILLATOR, changed

SCATTER = {"standard_deviation": 1e-9, "correlation_length_m": 2.5e-4}
DAMPINGS = [0.1, 0.17, 0.34]
ENSEMBLE = {"realisations": 8, "duration_periods": 30, "damping_ratios": DAMPINGS, "nodes_per_correlation_length": 8}
SCENE = {"seed": 7, "friction": {"mean": 0.3, "statistics": SCATTER}, "oscillator": OSCILLATOR, "ensemble": ENSEMBLE}
V, F = 0.003, 2500 / 316**2  # m
EXISTENCE = 0.324424  # of eq. (13) with the paper's numbers
LAW = StribeckLaw(fit=0.3)


def scattered(std: float, **others: object) -> dict:
    statistics = SCATTER | {"standard_deviation": std}
    return changed(SCENE, friction={"statistics": statistics}, oscillator=others)


@pytest.fixture(scope="module")
def cycles(run):
    """cycles(scene, name) is the result of stage cycles, of motions as precise as the closed forms."""

    def made(scene, name):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(machine, "TOLERANCE", 1e-9)
            return run("cycles", scene, name, {"DRAWN": 2})

    return made


@pytest.fixture(scope="module")
def hardly(cycles):
    return cycles(scattered(1e-9), "hardly")


def test_the_cycle_without_scatter_is_that_of_eq_13(run, cycles, hardly):
    """mu_D' by hand; the cycle leaves stick at F mu_s - 2 D V and returns to it at V on the belt. Slip against the belt
    takes what the belt gains on the mass. A cycle that does not exist is a finding and no warning."""
    plain = {name.removeprefix("deterministic_"): hardly[name] for name in hardly if name.startswith("deterministic_")}
    slope = -0.3 * 1.42 / (1 + 1.42 * 0.948) ** 2 + 0.02 * 0.948
    assert plain["hopf_damping"] == pytest.approx(-slope * 2500 / (2 * 316), rel=1e-9)
    assert plain["existence_limit"] == pytest.approx(EXISTENCE, abs=1e-6)
    assert plain["departure"] == pytest.approx(F * 0.4 - 2 * 0.17 * V, rel=1e-12)
    period = float(plain["period"])
    assert plain["slipped_distance"] == pytest.approx(V * period, rel=1e-9)
    # one cycle a period of the cycle; at 0.34, above the limit, none but the first slips of the start
    counts = hardly["deterministic_cycles"]
    assert counts[1] == pytest.approx(30 * 2 * np.pi / period, abs=1)
    assert counts[0] > 10
    assert counts[2] <= 1
    # ten periods after the discarded ones: X' is the slope of X, the belt's V in stick
    time, x, velocity = (hardly[name] for name in ("time", "deterministic_position", "deterministic_velocity"))
    step = time[1] - time[0]
    np.testing.assert_allclose(time[[0, -1]], 2 * np.pi * np.array([10, 20]), atol=step)
    assert np.median(np.abs(np.gradient(x, time) - velocity)[1:-1]) < 1e-6 * V + 1e-4 * np.abs(velocity).max()
    stick = np.isclose(velocity, V, rtol=1e-12)
    ends = [float(plain[name]) for name in ("reattachment", "departure")]
    np.testing.assert_allclose([x[stick].min(), x[stick].max()], ends, atol=V * step)
    np.testing.assert_allclose(np.diff(time[1:][stick[1:] & ~stick[:-1]]), period, atol=2 * step)
    none = cycles(scattered(1e-9, damping_ratio=0.4), "none")
    assert none["deterministic_existence_limit"] == pytest.approx(EXISTENCE, abs=1e-6)
    assert np.isnan([none[f"deterministic_{name}"] for name in ("departure", "reattachment", "period")]).all()
    assert run.warnings == []
    assert none["cycling_share"] == 0.0
    excited = cycles(scattered(1e-9, excitation_force_n=1.0), "excited")
    assert np.isnan([excited[f"deterministic_{name}"] for name in ("hopf_damping", "existence_limit")]).all()


def test_an_ensemble_that_hardly_scatters_is_the_deterministic_run(hardly):
    """A standard deviation of 1e-9 moves no count and no place by more than some 1e-8 of F."""
    plain = hardly["deterministic_cycles"]
    np.testing.assert_array_equal(hardly["cycles"], np.tile(plain, (8, 1)))
    np.testing.assert_allclose(hardly["reattachment"], hardly["deterministic_reattachment"], atol=1e-7 * F)
    period = float(hardly["deterministic_period"]) / (2 * np.pi)
    owners, events = np.unique(hardly["reattachment_realisation"], return_counts=True)
    np.testing.assert_array_equal(owners, range(8))
    np.testing.assert_allclose(events, 20 / period, atol=1)  # after 10 of 30 periods
    last = hardly["last_cycle"]
    assert np.all((last[:, :2] > 30 - period) & (last[:, :2] <= 30))
    np.testing.assert_array_equal(hardly["nominal_last_cycle"], last[:, 1])
    assert hardly["position"].shape == (2, len(hardly["time"]))
    for name, close in (("position", 1e-6 * F), ("velocity", 1e-5 * F)):
        np.testing.assert_allclose(hardly[name][0], hardly[f"deterministic_{name}"], atol=close)


def test_an_ensemble_scatters_as_its_friction_does_and_is_summed_up(run, cycles):
    """Departure moves with mu_S by F mu_S, and the place of the next stick by as much. A run does not depend on those
    before it. Whole runs are resampled, and their events weigh alike; the interval of eight is Student's."""
    half, result = cycles(scattered(2e-3), "half"), cycles(scattered(4e-3), "scattered")
    place, owner = result["reattachment"], result["reattachment_realisation"]
    assert run.warnings == []
    assert place.std() / half["reattachment"].std() == pytest.approx(2.0, rel=0.1)
    assert 0.3 < place.std() / (F * 4e-3) < 3.0
    assert place.mean() == pytest.approx(float(result["deterministic_reattachment"]), abs=F * 4e-3)
    more = cycles(changed(scattered(4e-3), ensemble={"realisations": 10}), "more")
    np.testing.assert_array_equal(place, more["reattachment"][more["reattachment_realisation"] < 8])
    counts = result["cycles"].mean(axis=0)
    np.testing.assert_allclose(result["mean_cycles"], counts)
    np.testing.assert_allclose(result["difference"], result["deterministic_cycles"] - counts)
    np.testing.assert_allclose(result["returns"], counts + result["micro_slips"].mean(axis=0))
    np.testing.assert_allclose(result["still_cycling"], (result["last_cycle"] > 20.0).mean(axis=0))  # of 30 periods
    cycling = np.sum(result["nominal_last_cycle"] > 20.0)
    share = [result[f"cycling_share{end}"] for end in ("", "_low", "_high")]
    assert share == pytest.approx([cycling / 8, *wilson_interval(cycling, 8)])
    shares, spread = result["stick_slip"].mean(axis=0), result["stick_slip"].std(axis=0, ddof=1) / np.sqrt(8)
    np.testing.assert_allclose(result["stick_slip_share"], shares)
    low = np.maximum(shares - stdtrit(7, 0.975) * spread, 0.0)
    np.testing.assert_allclose(result["stick_slip_share_low"], low, atol=1e-12)
    assert (result["reattachment_mean"], result["reattachment_std"]) == pytest.approx((place.mean(), place.std()))
    far = np.bincount(owner, place - place.mean()) / len(place)
    width = (result["reattachment_mean_high"] - result["reattachment_mean_low"]) / 2
    assert width == pytest.approx(stdtrit(7, 0.975) * np.sqrt(8 / 7 * np.sum(far**2)), rel=0.2)
    edges = result["histogram_edge"]
    np.testing.assert_allclose(result["histogram"] * np.diff(edges) * len(place), np.histogram(place, edges)[0])
    assert (result["events"], result["realisations"], result["nominal_damping"]) == (len(place), 8, 0.17)
    assert result["friction_scatter"] == pytest.approx(4e-3)


LAG = np.linspace(0.0, 1.5, 7)
TRIANGLE, ZERO = np.maximum(1 - LAG, 0.0), np.zeros((3, 1, 1))


@pytest.fixture(scope="module")
def statistics(stored):
    """Statistics of two penetrations, of pads of 1, 4 and 16 windows that scatter by n^-0.45."""
    pads, both, of_level = np.array([1.0, 4.0, 16.0]), ("level", "pad"), ("level",)
    means = np.stack([TRIANGLE, np.minimum(2 * TRIANGLE, 1.0)], axis=-1)[None] + ZERO
    needed = dict.fromkeys(("load_windows", "load_windows_low", "load_windows_high"), (of_level, [1200.0, 400.0]))
    return stored(
        "statistics.nc",
        percentile=(of_level, np.array([10.0, 50.0])),
        combined_mean=(of_level, np.array([0.4, 0.3])),
        combined_std=(of_level, np.array([0.08, 0.04])),
        combined_length_least_squares=(of_level, np.full(2, 2e-4)),
        beta_a=(of_level, np.full(2, 3.0)),
        beta_b=(of_level, np.full(2, 6.0)),
        pad_windows=(("pad",), pads),
        pad_lag=(("pad", "lag"), 6e-4 * np.array([[1.0], [1.0], [2.0]]) * LAG),
        pad_means=(("pad", "lag", "part"), means),
        pad_parts=(("level", "part"), np.array([[0.0, 3.0], [2.0, 0.0]])),
        pad_mean=(both, np.array([[0.4], [0.3]]) * pads**-0.01),
        pad_std=(both, np.array([[0.08], [0.04]]) * pads**-0.45),
        load_std=(of_level, np.full(2, 1e-3)),
        **{name: (dimensions, np.array(values)) for name, (dimensions, values) in needed.items()},
    )


def parallel(windows: int, **sections: dict):
    return scene_of({"oscillator": OSCILLATOR | {"windows_in_parallel": windows}} | sections)


def test_friction_is_that_of_the_windows_unless_the_scene_gives_it(statistics, tmp_path):
    """Mean and scatter with the expansion as control, shapes of the solved windows."""
    own = machine.friction_of(parallel(1), statistics)
    assert (own.mean, own.deviation, own.length_m, own.marginal) == (0.3, 0.04, 2e-4, (3.0, 6.0))
    given = machine.friction_of(scene_of(scattered(0.05)), tmp_path / "absent.nc")
    assert (given.mean, given.deviation, given.length_m, given.marginal) == (0.3, 0.05, 2.5e-4, (2.1, 5.0))
    with pytest.raises(InputError, match="--friction"):
        machine.friction_of(parallel(1), None)
    assert machine.friction_of(parallel(1, ensemble={"marginal": "paper"}), statistics).marginal == (2.1, 5.0)


def test_friction_of_a_pad_scatters_and_is_correlated_as_the_strips_say(statistics, tmp_path):
    """n windows count as n^0.9, at stored numbers, between them and beyond. The triangle of the pad is 0.6 mm long up
    to four windows, twice that of 16, four times that of 256; a longer window stretches it."""
    for windows, length in ((2, 6e-4), (4, 6e-4), (8, 6e-4 * 2**0.5), (16, 1.2e-3), (256, 4.8e-3)):
        friction = machine.friction_of(parallel(windows), statistics)
        assert friction.mean == pytest.approx(0.3 * windows**-0.01, rel=1e-12)
        process = friction.process
        for deviation in (friction.pad_deviation, process.marginal.standard_deviation):
            assert deviation == pytest.approx(0.04 * windows**-0.45, rel=1e-9)
        assert process.correlation_length_m == pytest.approx(length / 2, rel=1e-9)
        assert process.autocorrelation(process.correlation_length_m) == pytest.approx(0.5, rel=1e-9)
    # between two pads of unlike curves the mean of both
    result = store.read(statistics)
    unlike = {name: result.variable(name) for name in result}
    means = np.concatenate([result["pad_means"][:2], result["pad_means"][2:] ** 2])
    unlike["pad_means"] = unlike["pad_means"]._replace(values=means)
    store.write(tmp_path / "unlike.nc", unlike, KEY)
    mixed = machine.friction_of(parallel(8), tmp_path / "unlike.nc").process
    wanted, _ = machine.CorrelationShape.of_lags(6e-4 * 2**0.5 * LAG, (TRIANGLE + TRIANGLE**2) / 2)
    assert mixed.correlation_length_m == pytest.approx(wanted, rel=1e-9)
    stretched = friction.changed(mean=friction.mean, windows=4, length_m=4e-4)
    assert stretched.correlation_length_m == pytest.approx(6e-4)
    assert stretched.changed(mean=0.3, windows=1, length_m=2e-4).process.shape is None


def test_scatter_of_a_pad_far_longer_than_a_loop(statistics):
    """Added scatter moves nothing. Multiplied scatter moves the limit as the force does, by 0.933 of its coefficient
    of variation."""
    for kind, moved in (("additive", 0.0), ("multiplicative", 0.933 * EXISTENCE / 0.3)):
        scene = parallel(256, friction={"scatter": kind})
        made = replace(machine.machine_of(scene, statistics), law=LAW)
        assert made.options.scatter == kind
        far = replace(machine.friction_of(scene, statistics), mean=0.3, windows=2.56e10)
        assert machine.response_of_limit(made, far)[1] == pytest.approx(moved, rel=0.01, abs=0.2 * (moved == 0.0))


@pytest.mark.parametrize("method", ["recursion", "spectral"])
def test_paths_are_long_enough_for_every_run(method):
    """For the runs and for the trajectories drawn, whichever take longer; a path by recursion has no end."""
    ensemble = {"duration_periods": 2, "process": method, "nodes_per_correlation_length": 4}
    scene = scene_of(scattered(0.05) | {"ensemble": ensemble})
    paths = machine.friction_paths(scene, machine.friction_of(scene, None))
    assert paths.spacing == 2.5e-4 / 4
    needed = 20 * 2 * np.pi * V + 10 * F  # more than the belt travels
    pieces, nodes = iter(paths.realisation([0])), 0
    while nodes * paths.spacing <= needed:
        nodes += next(pieces).size


def test_lists_of_dampings_surround_the_scenes_own_limits():
    """From below the Hopf damping, 0.2311, to above the limit. Scatter moves the limit, a tenth as far with a hundred
    windows, so that the list draws together."""
    spread = []
    for windows in (1, 100):
        scene = scene_of(scattered(0.05, windows_in_parallel=windows) | {"ensemble": {}})
        friction, made = machine.friction_of(scene, None), machine.machine_of(scene, None)
        ratios = np.array(machine.damping_ratios(scene, made, friction))
        assert len(ratios) <= 20
        assert np.all(np.diff(ratios) > 0)
        assert ratios[0] == pytest.approx(0.2 * 0.2311, abs=1e-4)
        assert ratios[-1] >= 1.2499 * EXISTENCE
        assert np.min(np.abs(ratios - EXISTENCE)) > 1e-6  # there the count without scatter is undecided
        spread.append(np.sort(np.abs(ratios - EXISTENCE))[11])
    assert spread[0] > 5 * spread[1]
    own = machine.damping_ratios(scene, made.changed({"belt_velocity": 20.0}), friction)  # friction rises there
    assert (own[0], own[-1]) == pytest.approx((0.2 * 0.17, 1.25 * 0.17))
    assert 0.17 in own


def test_the_pad_of_the_load_moves_the_limit_as_its_own_windows_do(statistics):
    """400 windows bear the force: their response over that of as many windows is 1, as the scatter is added."""
    scene = parallel(400, friction={"scatter": "additive"})
    made, friction = machine.machine_of(scene, statistics), machine.friction_of(scene, statistics)
    found = deterministic.load_responses(store.read(statistics), replace(made, law=LAW), friction)
    assert found["additive"] == pytest.approx(1.0, rel=1e-9)
    multiplied = machine.response_of_limit(replace(made, law=LAW), replace(friction, multiplies=True))[1]
    own = machine.response_of_limit(replace(made, law=LAW), friction)[1]
    assert found["multiplicative"] == pytest.approx(multiplied / own, rel=1e-9)


@pytest.fixture(scope="module")
def answered(run, folder):
    """answered(std, **oscillator) is answer.json without a summary, with limits in damping alone."""

    def of_scene(std, **others):
        asked = scattered(std, **others) | {"answer": {"realisations": 72, "duration_periods": 20.0}}
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(store, "read", lambda path: json.loads(path.read_text()))
            return run("answer", asked, "answer", {"VARIED": ("damping",), "answer_summary": lambda _: []})

    return of_scene


def test_without_scatter_the_answer_is_the_limit_cycle_up_to_its_existence(answered, hardly):
    """Runs begin in stick, so that stick-slip exists up to there. From steady sliding, which is unstable, 20 periods
    are too short for so small a push to grow by exp(2 pi (0.231 - 0.17) 20) = 2000 to the size of the cycle.

    Samples miss the extremes of the displacement by (pi / 100)^2 / 2 of the amplitude at most.
    """
    result = answered(1e-9)
    certain = [1, 72 / (72 + 1.959964**2), 1]  # Wilson's interval of 72 hits in 72 runs
    assert [result["probability"]["value"], *result["probability"]["interval"]] == pytest.approx(certain, rel=1e-6)
    assert result["probability_from_sliding"]["value"] == 0.0
    above, below = (result["limits"]["damping"][side] for side in ("above", "below"))
    for label in ("0.05", "0.95"):
        assert above[label]["change"] == "falls below"
        assert [above[label]["value"], *above[label]["interval"]] == pytest.approx([EXISTENCE] * 3, rel=2 * ACCURACY)
        assert below[label] is None
    assert above["without_scatter"]["value"] == pytest.approx(EXISTENCE, rel=4e-6)
    assert result["decides"]["by"] == "mean curve"
    (change,) = result["smallest_changes"]
    assert (change["parameter"], change["side"], change["aim"]) == ("damping", "above", "end")
    assert change["value"] == pytest.approx(EXISTENCE / 0.17 - 1, rel=4 * ACCURACY)
    # some steps of a cycle err by the tolerance, 1e-5, one way
    assert result["frequency"]["value"] == pytest.approx(316 / float(hardly["deterministic_period"]), rel=3e-5)
    belt = machine.oscillator_of(SimpleNamespace(**OSCILLATOR))
    drawn = trajectory(belt, LAW, None, 0.0, 10.0, MotionOptions(samples_per_period=4000))
    amplitude = 0.5 * np.ptp(drawn.position[20_000:])
    assert amplitude * (1 - 0.5 * (np.pi / 100) ** 2) <= result["amplitude"]["value"] <= amplitude * (1 + 1e-5)
    for name in ("amplitude", "frequency"):
        assert result[f"{name}_scatter"]["value"] < 1e-3 * result[name]["value"]
    assert [result[f"friction_{name}"]["value"] for name in ("mean", "deviation", "pad_deviation")] == [0.3, 1e-9, 1e-9]
    excited = answered(0.03, excitation_force_n=10.0)
    assert excited["given"] is False
    assert excited["summary"] == [f"Stick-slip: no answer, because {excited['reason']}."]


def test_a_map_has_three_areas_where_friction_falls_in_the_middle(run):
    """Hardly any scatter: stick-slip up to D = 0.329, vibration up to 0.733 at 50 mm/s, steady sliding beyond."""
    table = [[0, 0.15], [0.02, 0.147], [0.04, 0.13], [0.06, 0.09], [0.08, 0.065], [0.2, 0.06]]
    of_hump = {"law": "table", "static_friction": 0.15, "friction_table": table, "belt_velocity_m_per_s": 0.05}
    of_hump |= {"mass_kg": 10.0, "stiffness_n_per_m": 1e6, "normal_force_n": 2000.0}
    asked = changed(SCENE, friction={"mean": 0.12, "statistics": SCATTER | {"standard_deviation": 1e-9}})
    asked = changed(asked, oscillator=of_hump) | {"map": {"ranges": [[0.2, 0.8], [0.04, 0.0625]], "points": 5}}
    result = run(
        "stick_slip_map", {key: asked[key] for key in asked if key != "ensemble"}, "hump", {"RUNS": 2, "SHARE": 1.0}
    )
    middle = result["map_x"]
    np.testing.assert_array_equal(result["probability"][:, 2], middle < 0.329)
    is_between = (middle[:, None] > result["existence_limit"]) & (middle[:, None] < result["vibration_limit"])
    np.testing.assert_array_equal(result["vibration"], is_between)
    assert list(result["vibration"][:, 2]) == [0, 0, 1, 1, 0]
    assert result["existence_limit"][2] == pytest.approx(0.32914, rel=1e-4)
    assert result["vibration_limit"][2] == pytest.approx(0.73274, rel=1e-4)


MAP = {"parameters": ["belt_velocity", "damping"], "ranges": [[0.474, 1.896], [0.1, 0.5]], "points": 5}


def test_without_scatter_the_map_is_cut_at_the_limit_of_its_velocity(run):
    """0 or 1 at every point, as runs begin in stick. mu_D' of eq. (13) by hand: the paper's own velocity is the middle
    one, and friction rises with speed soon after. All points are computed."""
    asked = {key: value for key, value in scattered(1e-9).items() if key != "ensemble"} | {"map": MAP}
    result = run("stick_slip_map", asked, "map", {"RUNS": 8, "SHARE": 1.0})
    damping, v = result["map_x"], result["map_y"]
    assert list(result["map_parameters"]) == ["damping", "belt_velocity"]
    np.testing.assert_allclose(v[[0, 2, 4]], [0.474, 0.948, 1.896], rtol=1e-12)
    np.testing.assert_allclose(damping[1] / damping[0], 5**0.25)
    assert (result["map_x_own"], result["map_y_own"]) == (0.17, 0.948)
    exists = damping[:, None] < result["existence_limit"]
    np.testing.assert_array_equal(result["probability"], exists)
    assert 0 < exists.sum() < exists.size
    width = result["probability_high"] - result["probability_low"]
    np.testing.assert_allclose(width, 1.96**2 / (8 + 1.96**2), atol=1e-4)  # Wilson's, of 0 or 8 of 8
    slope = -0.3 * 1.42 / (1 + 1.42 * v) ** 2 + 0.02 * v
    np.testing.assert_allclose(result["hopf_damping"], -slope * 2500 / (2 * 316), rtol=1e-9)
    assert result["existence_limit"][2] == pytest.approx(EXISTENCE, abs=1e-6)
    assert not result["vibration"].any()
    assert np.isnan(result["vibration_limit"]).all()
    own = changed(asked, map={"parameters": ["damping", "mass"], "ranges": None, "points": 8})
    ranges = run("stick_slip_map", own, "own-map", {"RUNS": 2, "PERIODS": 4})
    np.testing.assert_allclose(ranges["map_x"][[0, -1]], [0.17 / 4, 0.17 * 4])  # around the scene's own values
    np.testing.assert_allclose(ranges["map_y"][[0, -1]], [0.25, 4.0])
