"""The stages of the oscillator: published limits, identities of the cycle, counts, nodes that friction paths take."""

import numpy as np
import pytest
from scipy.special import stdtrit

from roughslip.probability.estimate import wilson_interval
from roughslip.study import cycles, deterministic
from roughslip.study.from_scene import machine
from roughslip.study.from_scene.machine import DISCARDED_PERIODS
from tests.study.conftest import job_of
from tests.study.scenes import OSCILLATOR

DAMPINGS = [0.1, 0.17, 0.34]
SCATTER = {"standard_deviation": 1e-9, "correlation_length_m": 2.5e-4}
CONFIGURATION = {
    "seed": 7,
    "friction": {"mean": 0.3, "statistics": SCATTER},
    "oscillator": OSCILLATOR,
    "ensemble": {
        "realisations": 8,
        "duration_periods": 30,
        "damping_ratios": DAMPINGS,
        "nodes_per_correlation_length": 8,
    },
}
V, F = 0.003, 2500 / 316**2  # m


def scattered(std: float, **others: object) -> dict:
    section = CONFIGURATION["oscillator"] | others
    friction = {"mean": 0.3, "statistics": SCATTER | {"standard_deviation": std}}
    return CONFIGURATION | {"friction": friction, "oscillator": section}


@pytest.fixture(scope="module", autouse=True)
def precise():
    """Motions as precise as the closed forms that they are compared with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(machine, "TOLERANCE", 1e-9)
        patch.setattr(cycles, "DRAWN", 2)
        yield


@pytest.fixture(scope="module")
def plain(folder):
    """plain(scene) is the motion without scatter, and what it warns of."""

    def made(scene):
        job = job_of("cycles", scene, folder / "plain.nc")
        variables = deterministic.without_scatter(job.scene, job)
        return {name: np.asarray(variable.values) for name, variable in variables.items()}, job.warnings

    return made


@pytest.fixture(scope="module")
def runs(folder):
    """runs(scene, numbers) is an ensemble of the runs of these numbers."""

    def made(scene, numbers):
        job = job_of("cycles", scene, folder / "runs.nc")
        variables = cycles.with_scatter(job.scene, job, numbers)
        return {name: np.asarray(variable.values) for name, variable in variables.items()}

    return made


@pytest.fixture(scope="module")
def without_scatter(plain):
    return plain(CONFIGURATION)[0]


@pytest.fixture(scope="module")
def hardly_scattered(runs):
    return runs(CONFIGURATION, range(1, 4))


def test_limits_cycle_and_counts_without_scatter(without_scatter):
    """mu_D' of eq. (13) by hand; the cycle leaves stick at F mu_s - 2 D V and returns to it at V on the belt."""
    result = without_scatter
    slope = -0.3 * 1.42 / (1 + 1.42 * 0.948) ** 2 + 0.02 * 0.948
    assert result["hopf_damping"] == pytest.approx(-slope * 2500 / (2 * 316), rel=1e-9)
    assert result["hopf_damping"] == pytest.approx(0.2311, abs=1e-4)
    assert result["existence_limit"] == pytest.approx(0.3244, abs=1e-4)
    assert result["departure"] == pytest.approx(F * 0.4 - 2 * 0.17 * V, rel=1e-12)
    assert result["reattachment"] < result["departure"]
    assert result["friction_scatter"] == 1e-9
    # one cycle a period of the cycle; at 0.34, above the limit, none but the first slips of the start
    assert result["cycles"][1] == pytest.approx(30 * 2 * np.pi / result["period"], abs=1)
    assert result["cycles"][0] > 10
    assert result["cycles"][2] <= 1


def test_a_cycle_that_does_not_exist_is_a_finding_and_no_warning(plain):
    result, warnings = plain(scattered(1e-9, damping_ratio=0.4))
    assert result["existence_limit"] == pytest.approx(0.3244, abs=1e-4)
    assert np.isnan([result[name] for name in ("departure", "reattachment", "period", "slipped_distance")]).all()
    assert warnings == []


def test_the_drawn_motion_is_the_cycle(without_scatter):
    """Ten periods after the discarded ones: X' is the slope of X, the belt's V in stick, which lasts from reattachment
    to departure."""
    result = without_scatter
    time, x, velocity = (result[name] for name in ("time", "position", "velocity"))
    assert time[0] == pytest.approx(2 * np.pi * DISCARDED_PERIODS, abs=time[1] - time[0])
    assert time[-1] == pytest.approx(2 * np.pi * (DISCARDED_PERIODS + 10), abs=time[1] - time[0])
    inner = np.gradient(x, time)[1:-1]
    assert np.median(np.abs(inner - velocity[1:-1])) < 1e-6 * V + 1e-4 * np.abs(velocity).max()
    stick = np.isclose(velocity, V, rtol=1e-12)
    step = V * (time[1] - time[0])  # X in stick is sampled so far apart
    assert x[stick].min() == pytest.approx(result["reattachment"], abs=step)
    assert x[stick].max() == pytest.approx(result["departure"], abs=step)
    starts = time[1:][stick[1:] & ~stick[:-1]]
    np.testing.assert_allclose(np.diff(starts), result["period"], atol=2 * (time[1] - time[0]))
    assert result["slipped_distance"] == pytest.approx(  # slip against the belt takes what the belt gains on the mass
        V * result["period"], rel=1e-9
    )


def test_an_ensemble_that_hardly_scatters_is_the_deterministic_run(without_scatter, hardly_scattered):
    """A standard deviation of 1e-9 moves no count and no place by more than some 1e-8 of F."""
    result, plain = hardly_scattered, without_scatter
    np.testing.assert_array_equal(result["cycles"], np.tile(plain["cycles"], (3, 1)))
    np.testing.assert_allclose(result["reattachment"], plain["reattachment"], atol=1e-7 * F)
    owners, events = np.unique(result["reattachment_realisation"], return_counts=True)
    np.testing.assert_array_equal(owners, [1, 2, 3])
    np.testing.assert_allclose(events, 20 * 2 * np.pi / plain["period"], atol=1)  # after 10 of 30 periods
    last = result["last_cycle"]
    assert np.all((last[:, :2] > 30 - plain["period"] / (2 * np.pi)) & (last[:, :2] <= 30))
    np.testing.assert_array_equal(result["nominal_last_cycle"], last[:, 1])
    assert np.all(last[:, 2] < 5)
    assert result["position"].shape == (1, len(plain["time"]))  # number 1 of the two that are drawn
    np.testing.assert_allclose(result["position"][0], plain["position"], atol=1e-6 * F)
    np.testing.assert_allclose(result["velocity"][0], plain["velocity"], atol=1e-5 * F)


def test_an_ensemble_scatters_as_its_friction_does(runs, without_scatter):
    """Departure moves with mu_S by F mu_S, and the place of the next stick by as much."""
    spread = {}
    for std in (2e-3, 4e-3):
        result = runs(scattered(std), range(8))
        spread[std] = result["reattachment"].std()
        assert result["reattachment"].mean() == pytest.approx(float(without_scatter["reattachment"]), abs=F * std)
    assert spread[4e-3] / spread[2e-3] == pytest.approx(2.0, rel=0.1)
    assert 0.3 < spread[2e-3] / (F * 2e-3) < 3.0
    later = runs(scattered(4e-3), range(6, 8))  # a run does not depend on those before it
    np.testing.assert_array_equal(
        later["reattachment"], result["reattachment"][result["reattachment_realisation"] >= 6]
    )


def test_an_ensemble_is_summed_up(run, runs, without_scatter):
    """Eight runs at three dampings."""
    scene = scattered(4e-3)
    ensemble, result = runs(scene, range(8)), run(cycles, scene)
    counts, place = ensemble["cycles"], ensemble["reattachment"]
    np.testing.assert_array_equal(result["deterministic_cycles"], without_scatter["cycles"])
    np.testing.assert_allclose(result["mean_cycles"], counts.mean(axis=0))
    np.testing.assert_allclose(result["difference"], without_scatter["cycles"] - counts.mean(axis=0))
    last, nominal = (ensemble[name] > 20.0 for name in ("last_cycle", "nominal_last_cycle"))  # of 30 periods
    np.testing.assert_allclose(result["still_cycling"], last.mean(axis=0))
    share = [result[f"cycling_share{end}"] for end in ("", "_low", "_high")]
    assert share == pytest.approx([nominal.mean(), *wilson_interval(nominal.sum(), 8)])
    assert run.warnings == []
    assert result["reattachment_mean"] == pytest.approx(place.mean())
    assert result["reattachment_std"] == pytest.approx(place.std())
    # whole runs are resampled, and their events weigh alike; the interval of eight is Student's
    owner = ensemble["reattachment_realisation"]
    far = np.bincount(owner, place - place.mean()) / len(place)
    half = (result["reattachment_mean_high"] - result["reattachment_mean_low"]) / 2
    assert half == pytest.approx(stdtrit(7, 0.975) * np.sqrt(8 / 7 * np.sum(far**2)), rel=0.2)
    edges = result["histogram_edge"]
    assert (edges[0], edges[-1]) == (pytest.approx(place.min()), pytest.approx(place.max()))
    np.testing.assert_allclose(result["histogram"] * np.diff(edges) * len(place), np.histogram(place, edges)[0])
    assert (result["events"], result["realisations"], result["nominal_damping"]) == (len(place), 8, 0.17)
    for name in ("position", "velocity"):
        np.testing.assert_array_equal(result[name], ensemble[name])  # of the two runs that are drawn
        np.testing.assert_array_equal(result[f"deterministic_{name}"], without_scatter[name])
    for name in ("hopf_damping", "existence_limit", "reattachment", "departure"):
        assert result[f"deterministic_{name}"] == without_scatter[name]
