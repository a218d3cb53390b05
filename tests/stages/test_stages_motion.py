"""The stages of the oscillator: published limits, identities of the cycle, counts, nodes that friction paths take."""

import numpy as np
import pytest

from roughslip.chaos.sampling import wilson_interval
from roughslip.errors import ConvergenceError
from roughslip.stages import cycles, deterministic, oscillator, path_resolution
from roughslip.stages.path_resolution import Thinned, error_bounds
from roughslip.stages.runtime import skip_reasons
from tests.stages.scenes import OSCILLATOR

DAMPINGS = [0.1, 0.17, 0.34]
CONFIGURATION = {
    "seed": 7,
    "friction": {
        "statistics": {
            "mean": 0.3,
            "standard_deviation": 1e-9,
            "correlation_length_m": 2.5e-4,
            "beta_a": 2.1,
            "beta_b": 5.0,
        }
    },
    "oscillator": OSCILLATOR,
    "ensemble": {
        "realisations": 8,
        "duration_periods": 30,
        "discarded_periods": 12,
        "damping_ratios": DAMPINGS,
        "drawn_realisations": 2,
        "nodes_per_correlation_length": 8,
    },
    "numerics": {"oscillator_tolerance": 1e-9},
}
V, F = 0.003, 2500 / 316**2  # m


def scattered(std: float, **others: object) -> dict:
    statistics = CONFIGURATION["friction"]["statistics"] | {"standard_deviation": std}
    section = CONFIGURATION["oscillator"] | others
    return CONFIGURATION | {"friction": {"statistics": statistics}, "oscillator": section}


@pytest.fixture(scope="module")
def without_scatter(run):
    return run(deterministic, CONFIGURATION)


@pytest.fixture(scope="module")
def hardly_scattered(run):
    return run(oscillator, CONFIGURATION, "hardly", first=1, last=4)


def test_limits_cycle_and_counts_without_scatter(without_scatter):
    """mu_D' of eq. (13) by hand; the cycle leaves stick at F mu_s - 2 D V and returns to it at V on the belt."""
    found = without_scatter
    slope = -0.3 * 1.42 / (1 + 1.42 * 0.948) ** 2 + 0.02 * 0.948
    assert found["hopf_damping"] == pytest.approx(-slope * 2500 / (2 * 316), rel=1e-9)
    assert found["hopf_damping"] == pytest.approx(0.2311, abs=1e-4)
    assert found["existence_limit"] == pytest.approx(0.3244, abs=1e-4)
    assert found["departure"] == pytest.approx(F * 0.4 - 2 * 0.17 * V, rel=1e-12)
    assert found["reattachment"] < found["departure"]
    for name, value in CONFIGURATION["friction"]["statistics"].items():
        assert found[f"friction_{name}"] == value
    # one cycle a period of the cycle; at 0.34, above the limit, none but the first slips of the start
    assert found["cycles"][1] == pytest.approx(30 * 2 * np.pi / found["period"], abs=1)
    assert found["cycles"][0] > 10
    assert found["cycles"][2] <= 1


def test_the_drawn_motion_is_the_cycle(without_scatter):
    """Ten periods after the discarded ones: X' is the slope of X, the belt's V in stick, which lasts from reattachment
    to departure."""
    found = without_scatter
    time, x, velocity = (found[name] for name in ("time", "position", "velocity"))
    assert time[0] == pytest.approx(2 * np.pi * 12, abs=time[1] - time[0])
    assert time[-1] == pytest.approx(2 * np.pi * 22, abs=time[1] - time[0])
    inner = np.gradient(x, time)[1:-1]
    assert np.median(np.abs(inner - velocity[1:-1])) < 1e-6 * V + 1e-4 * np.abs(velocity).max()
    stick = np.isclose(velocity, V, rtol=1e-12)
    step = V * (time[1] - time[0])  # X in stick is sampled so far apart
    assert x[stick].min() == pytest.approx(found["reattachment"], abs=step)
    assert x[stick].max() == pytest.approx(found["departure"], abs=step)
    starts = time[1:][stick[1:] & ~stick[:-1]]
    np.testing.assert_allclose(np.diff(starts), found["period"], atol=2 * (time[1] - time[0]))
    assert found["slipped_distance"] == pytest.approx(  # slip against the belt takes what the belt gains on the mass
        V * found["period"], rel=1e-9
    )


def test_an_ensemble_that_hardly_scatters_is_the_deterministic_run(without_scatter, hardly_scattered):
    """A standard deviation of 1e-9 moves no count and no place by more than some 1e-8 of F."""
    found, plain = hardly_scattered, without_scatter
    np.testing.assert_array_equal(found["cycles"], np.tile(plain["cycles"], (3, 1)))
    np.testing.assert_allclose(found["reattachment"], plain["reattachment"], atol=1e-7 * F)
    owners, events = np.unique(found["reattachment_realisation"], return_counts=True)
    np.testing.assert_array_equal(owners, [1, 2, 3])
    np.testing.assert_allclose(events, 18 * 2 * np.pi / plain["period"], atol=1)  # after 12 of 30 periods
    last = found["last_cycle"]
    assert np.all((last[:, :2] > 30 - plain["period"] / (2 * np.pi)) & (last[:, :2] <= 30))
    np.testing.assert_array_equal(found["nominal_last_cycle"], last[:, 1])
    assert np.all(last[:, 2] < 5)
    assert found["position"].shape == (1, len(plain["time"]))  # number 1 of the two that are drawn
    np.testing.assert_allclose(found["position"][0], plain["position"], atol=1e-6 * F)
    np.testing.assert_allclose(found["velocity"][0], plain["velocity"], atol=1e-5 * F)
    assert found.attributes["first"] == 1


def test_an_ensemble_scatters_as_its_friction_does(run, without_scatter):
    """Departure moves with mu_S by F mu_S, and the place of the next stick by as much; half the scatter in the static
    limit alone is another motion."""
    spread = {}
    for std in (2e-3, 4e-3):
        found = run(oscillator, scattered(std), first=0, last=8)
        spread[std] = found["reattachment"].std()
        assert found["reattachment"].mean() == pytest.approx(float(without_scatter["reattachment"]), abs=F * std)
    assert spread[4e-3] / spread[2e-3] == pytest.approx(2.0, rel=0.1)
    assert 0.3 < spread[2e-3] / (F * 2e-3) < 3.0
    later = run(
        oscillator, scattered(4e-3), "later", first=6, last=8
    )  # runs have numbers that do not depend on the batch
    np.testing.assert_array_equal(later["reattachment"], found["reattachment"][found["reattachment_realisation"] >= 6])
    still = run(oscillator, scattered(4e-3, stochastic_static_limit=False), "still", first=0, last=8)
    assert still["reattachment"].std() != pytest.approx(spread[4e-3], rel=1e-3)


@pytest.mark.slow
def test_keys_of_the_ensemble_reach_the_runs(run, stored):
    """Each changes the places of reattachment, none by more than the scatter does; nodes found are nodes given."""
    plain = scattered(4e-3)

    def places(name, **keys):
        configuration = plain | {"ensemble": plain["ensemble"] | keys}
        extra = {"path_resolution": spacing} if keys.get("nodes_per_correlation_length") == "auto" else {}
        return run(oscillator, configuration, name, first=0, last=2, **extra)["reattachment"]

    spacing = stored("spacing.nc", nodes_per_correlation_length=((), 4))
    default = places("default")
    np.testing.assert_array_equal(default, places("named", process="recursion", marginal="beta", interpolation="cubic"))
    np.testing.assert_array_equal(
        places("found", nodes_per_correlation_length="auto"), places("four", nodes_per_correlation_length=4)
    )
    changes = {"process": "spectral", "interpolation": "linear", "nodes_per_correlation_length": 4}
    for key, value in (*changes.items(), ("process", "embedding")):
        found = places("changed", **{key: value})
        assert not np.array_equal(found, default)
        assert found.mean() == pytest.approx(default.mean(), abs=4 * default.std())
    plain = scattered(4e-3)
    plain["friction"]["statistics"] |= {"beta_a": 0.5, "beta_b": 0.5}
    assert not np.array_equal(places("shapes"), default)
    np.testing.assert_array_equal(places("paper", marginal="paper"), default)


def test_an_ensemble_of_known_runs_is_summed_up(run, stored, capsys):
    """Ten runs, in two batches named in another order than numbered, at three dampings."""
    rng = np.random.default_rng(3)
    counts = rng.integers(5, 20, (10, 3))
    micro = rng.integers(0, 9, (10, 3))
    last = np.where(np.arange(10)[:, None] < [8, 5, 2], 29.0, 19.0)
    nominal_last = np.array([29.0] * 7 + [19.0] * 3)
    owner = np.repeat(np.arange(10), 6)
    place = 1e-3 * (3 + rng.standard_normal(10)[owner] + 0.1 * rng.standard_normal(60))
    drawn = rng.standard_normal((2, 2, 5))
    two, one = ("realisation", "damping"), ("realisation",)
    batches = []
    for name, part in (("b", slice(0, 4)), ("a", slice(4, 10))):
        events = (part.start <= owner) & (owner < part.stop)
        arrays = {
            "cycles": (two, counts[part]),
            "micro_slips": (two, micro[part]),
            "last_cycle": (two, last[part]),
            "nominal_last_cycle": (one, nominal_last[part]),
            "reattachment": (("event",), place[events]),
            "reattachment_realisation": (("event",), owner[events]),
        }
        if name == "b":
            arrays |= {key: (("drawn", "time"), drawn[k]) for k, key in enumerate(("position", "velocity"))}
        batches.append(stored(f"{name}.nc", {"first": part.start}, **arrays))
    scalars = {"hopf_damping": 0.23, "existence_limit": 0.32, "reattachment": 3.1e-3, "departure": 9e-3}
    plain = stored(
        "plain.nc",
        damping_ratio=(("damping",), np.array(DAMPINGS)),
        cycles=(("damping",), np.array([20, 18, 0])),
        position=(("time",), np.arange(5.0)),
        velocity=(("time",), -np.arange(5.0)),
        **{name: ((), value) for name, value in scalars.items()},
    )
    found = run(cycles, CONFIGURATION, deterministic=plain, ensemble=batches)
    np.testing.assert_array_equal(found["deterministic_cycles"], [20, 18, 0])
    np.testing.assert_allclose(found["mean_cycles"], counts.mean(axis=0))
    error = counts.std(axis=0, ddof=1) / np.sqrt(10)
    np.testing.assert_allclose(found["mean_cycles_error"], error)
    np.testing.assert_allclose(found["difference"], [20, 18, 0] - counts.mean(axis=0))
    half = 2.2621571627409915 * error  # of Student's t with 9 degrees of freedom
    np.testing.assert_allclose(found["difference_high"] - found["difference"], half)
    np.testing.assert_allclose(found["difference"] - found["difference_low"], half)
    np.testing.assert_allclose(found["mean_micro_slips"], micro.mean(axis=0))
    np.testing.assert_allclose(found["still_cycling"], [0.8, 0.5, 0.2])
    share = [found[f"cycling_share{end}"] for end in ("", "_low", "_high")]
    assert share == pytest.approx([0.7, *wilson_interval(7, 10)])
    assert np.isnan([found["normality_jarque_bera_p"], found["normality_anderson_darling_p"]]).all()  # of 60 events
    assert "too few for a test of normality" in capsys.readouterr().err
    assert found["reattachment_mean"] == pytest.approx(place.mean())
    assert found["reattachment_std"] == pytest.approx(place.std())
    assert found["reattachment_skewness"] == pytest.approx(np.mean((place - place.mean()) ** 3) / place.std() ** 3)
    # whole runs are resampled: six events of one are hardly more than one; percentiles are sqrt(9/10) as wide
    runs = place.reshape(10, 6).mean(axis=1)
    half = (found["reattachment_mean_high"] - found["reattachment_mean_low"]) / 2
    assert half == pytest.approx(1.96 * runs.std() / np.sqrt(10), rel=0.15)
    edges = found["histogram_edge"]
    assert (edges[0], edges[-1]) == (pytest.approx(place.min()), pytest.approx(place.max()))
    np.testing.assert_allclose(found["histogram"] * np.diff(edges) * 60, np.histogram(place, edges)[0])
    assert (found["events"], found["realisations"], found["nominal_damping"]) == (60, 10, 0.17)
    np.testing.assert_array_equal([found["position"], found["velocity"]], drawn)
    np.testing.assert_array_equal(found["deterministic_velocity"], -np.arange(5.0))
    for name, value in scalars.items():
        assert found[f"deterministic_{name}"] == value


@pytest.mark.slow
def test_what_runs_left_out_is_counted(run):
    """Every stick phase that was left is one not integrated. A path is drawn once for all dampings, the scene's own and
    two drawings. It is drawn as far as the runs slip. Without scatter a run is followed to its end, or by the period
    for some four periods."""
    found = run(oscillator, CONFIGURATION, "counted", first=0, last=2)
    skipped, events = run.skipped, found["cycles"].sum() + found["micro_slips"].sum()
    assert skipped[skip_reasons.KEPT] == 2 * len(DAMPINGS) + 2
    assert events + 2 * 20 < skipped[skip_reasons.STICK] < events + 2 * 30  # 27 or so of the scene's own damping
    assert skipped[skip_reasons.UNREAD] > 0
    run(deterministic, CONFIGURATION)
    assert run.skipped[skip_reasons.BY_PERIOD] == 0
    assert run.skipped[skip_reasons.STICK] > 0
    by_period = CONFIGURATION | {"ensemble": CONFIGURATION["ensemble"] | {"count_by_period": True}}
    run(deterministic, by_period, "by_period")
    assert run.skipped[skip_reasons.STICK] == 0
    assert 24 * len(DAMPINGS) < run.skipped[skip_reasons.BY_PERIOD] < 30 * len(DAMPINGS)


def asked(error: float, std: float = 1e-9, dampings: tuple[float, ...] = (0.1, 0.17)) -> dict:
    auto = {"nodes_per_correlation_length": "auto", "count_error": error, "damping_ratios": list(dampings)}
    return scattered(std) | {"ensemble": CONFIGURATION["ensemble"] | auto | {"duration_periods": 10}}


@pytest.mark.parametrize("step", [1, 3, 7])
@pytest.mark.parametrize("size", [1, 5, 100])
def test_thinned_pieces_are_the_thinned_path(step, size):
    path = np.arange(100.0)
    pieces = [path[k : k + size] for k in range(0, 100, size)]
    assert np.array_equal(np.concatenate(list(Thinned(pieces, step))), path[::step])


def test_bounds_of_a_known_change():
    """Changes 1 and 3 at a damping of mean 20: 2 +- 12.7062 cycles, twice that, over the largest mean of 40."""
    fine = np.array([[40.0, 20.0], [40.0, 20.0]])
    lower, upper = error_bounds(fine + np.array([[0.0, 1.0], [0.0, 3.0]]), fine)
    assert (lower, upper) == (0.0, pytest.approx(2 * (2 + 12.706204736) / 40))
    lower, upper = error_bounds(fine - np.array([[0.0, 4.0], [0.0, 4.0]]), fine)
    assert (lower, upper) == (pytest.approx(2 * (4 - 1.5) / 40), pytest.approx(2 * (4 + 1.5) / 40))  # 3 of 2 paths
    assert error_bounds(np.zeros((8, 2)), np.zeros((8, 2))) == (0.0, 0.0)


def test_bounds_cover_a_change_of_few_paths():
    """One path in ten counts one cycle less: in most trials with eight none shows it, and still the bound covers it."""
    rng = np.random.default_rng(1)
    fine = np.full((8, 1), 20.0)
    trials = [error_bounds(fine - (rng.random((8, 1)) < 0.1), fine)[1] >= 2 * 0.1 / 20 for _ in range(400)]
    assert np.mean(trials) > 0.95


@pytest.mark.slow
def test_nodes_and_paths_that_an_error_takes(run):
    """Without scatter the fewest nodes, and paths for the rule of three: three changes in so many of eight cycles. At a
    damping where counts scatter eight paths do not determine an error of a fifth. Every trial is kept."""
    found = run(path_resolution, asked(0.01))
    assert found["nodes_per_correlation_length"] == 4
    assert 0 < found["count_error"] <= 0.01
    assert found["count_error"] * found["tried_paths"][-1] == pytest.approx(2 * 3 / 8)
    found = run(path_resolution, asked(0.2, 0.05, (0.17, 0.31)), "scatter")
    assert found["tried_error"][-1] == found["count_error"] <= 0.2
    assert found["tried_paths"][-1] > 8
    assert found["tried_nodes"][-1] == found["nodes_per_correlation_length"]


def test_an_error_that_nodes_or_paths_do_not_reach(run, monkeypatch):
    """Too few paths; then counts that change by a tenth whenever the spacing is halved, to the most nodes."""
    monkeypatch.setattr(path_resolution, "MOST_PATHS", 8)
    with pytest.raises(ConvergenceError, match="8 paths determine it no closer"):
        run(path_resolution, asked(0.001, 0.05, (0.17, 0.31)), "undecided")
    monkeypatch.setattr(path_resolution, "MOST_NODES", 8)
    monkeypatch.setattr(path_resolution, "error_bounds", lambda coarse, fine: (0.1, 0.1))
    with pytest.raises(ConvergenceError, match="8 nodes are not enough") as caught:
        run(path_resolution, asked(0.01), "few")
    assert (caught.value.residual, caught.value.work) == (0.1, 2 * (8 + 8) * 2)  # 4 and 8 nodes, two dampings
