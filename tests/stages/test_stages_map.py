"""The stages of the stick-slip map: without scatter the deterministic limits decide, with it durations agree."""

import numpy as np
import pytest
from matplotlib.path import Path

from roughslip.errors import IllPosedError, InputError
from roughslip.figures.figure_basins import DRAWN, figure_basins
from roughslip.scene.types import scene_of
from roughslip.stages import basins, residence, stick_slip_map
from roughslip.stages.from_scene.mass_on_belt import FrictionNumbers
from roughslip.stages.from_scene.variation import damping_ratios
from tests.stages.scenes import OSCILLATOR
from tests.stages.test_stages_motion import scattered

MAP = {
    "parameters": ["belt_velocity", "damping"],
    "ranges": [[0.474, 1.896], [0.1, 0.5]],
    "points": 5,
    "realisations": 8,
    "duration_periods": 40,
}
SURVIVAL = {"scatter_factors": [0.5, 1.0], "points": 5, "realisations": 8, "duration_periods": 40}
ALL = 1.0  # share of the points that are run
LIMIT = 0.324424  # of existence in damping, by tests/oscillator/test_limits.py


def asked(std: float, **others: object) -> dict:
    found = scattered(std, **others) | {"map": MAP, "survival": SURVIVAL}
    del found["ensemble"]  # not read
    return found


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
        values = {"oscillator": OSCILLATOR | {"windows_in_parallel": windows}, "ensemble": {"damping_ratios": "auto"}}
        found = np.array(damping_ratios(scene_of(values), numbers, None))
        assert len(found) <= 20
        assert np.all(np.diff(found) > 0)
        assert found[0] == pytest.approx(0.2 * 0.2311, abs=1e-4)
        assert found[-1] >= 1.2499 * LIMIT
        assert np.min(np.abs(found - LIMIT)) > 1e-6  # there the count without scatter is undecided
        spread.append(np.sort(np.abs(found - LIMIT))[11])
    assert spread[0] > 5 * spread[1]
    given = scene_of({"ensemble": {"damping_ratios": [0.1, 0.2]}})
    assert damping_ratios(given, numbers, None) == (0.1, 0.2)
    fast = {"oscillator": OSCILLATOR | {"belt_velocity_m_per_s": 20.0}, "ensemble": {}}
    with pytest.raises(IllPosedError, match=r"takes a list around the limits .* give a list"):
        damping_ratios(scene_of(fast), numbers, None)


@pytest.mark.slow
def test_where_no_cycle_exists_the_limit_is_nan_and_sliding_certain(run, capsys, monkeypatch):
    """At 20 m/s eq. (13) rises with speed: the quadratic term has the slope 0.4 s/m there."""
    fast = asked(1e-9) | {"map": MAP | {"ranges": [[0.948, 20.0], [0.1, 0.5]]}}
    monkeypatch.setattr(stick_slip_map, "SHARE", ALL)
    found = run(stick_slip_map, fast, "fast")
    assert list(np.isnan(found["existence_limit"][[0, -1]])) == [False, True]
    assert found["hopf_damping"][-1] < 0
    assert "values of belt_velocity" in capsys.readouterr().err


@pytest.mark.slow
def test_durations_change_with_damping_and_theory_has_their_order(run):
    """Stick-slip lasts ever shorter with damping and steady sliding ever longer, in the runs and in theory."""
    found = run(residence, asked(0.03))
    assert found["residence_limit"] == pytest.approx(0.324424, abs=1e-6)
    reach = 4 * found["unit_scatter"] * found["friction_deviation"]
    ends = np.minimum(found["residence_limit"] - reach, found["residence_hopf"]), found["residence_limit"] + reach
    np.testing.assert_allclose(found["residence_damping"][:, [0, -1]].T, ends)
    assert np.all(found["share"][:, 0] > 0.75)  # sliding lasts some periods where a run begins with it
    np.testing.assert_array_equal(found["share"][:, -1], 0.0)
    for name in ("stick_slip", "sliding", "share"):
        known = np.isfinite(found[name]) & np.isfinite(found[f"{name}_high"])  # a share is not where no state ended
        values = (found[f"{name}{end}"][known] for end in ("_low", "", "_high"))
        low, value, high = values
        assert np.all((low <= value) & (value <= high))
    theory = found["stick_slip_by_theory"][1]
    assert np.all(np.diff(theory[np.isfinite(theory)]) < 0)
    theory = found["sliding_by_theory"][1]
    assert np.all(np.diff(theory[np.isfinite(theory)]) > 0)


@pytest.mark.slow
def test_a_half_that_the_runs_do_not_hold_is_nan_with_a_warning(run, capsys):
    """Hardly any scatter, at the Hopf damping and just beyond the limit."""
    found = run(residence, asked(1e-9) | {"survival": SURVIVAL | {"points": 2}}, "narrow")
    assert np.isfinite(found["half"]).all() or "do not hold" in capsys.readouterr().err
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        run(residence, asked(0.03, belt_velocity_m_per_s=20.0), "none")


def test_the_unstable_cycle_parts_the_basins_and_is_drawn(run, monkeypatch):
    """Orbits do not cross: what begins within ends in sliding. Below the Hopf damping there is no such cycle."""
    monkeypatch.setattr(basins, "STATES", 200)
    found = run(basins, asked(1e-9, damping_ratio=0.28))
    cycle = Path(np.column_stack([found["unstable_position"], found["unstable_velocity"]]))
    within = cycle.contains_points(np.column_stack([found["basin_position"], found["basin_velocity"]]))
    np.testing.assert_array_equal(found["ends_in_stick_slip"] > 0, ~within)
    assert found["basin_share"] == pytest.approx(1 - within.mean())
    assert np.ptp(found["from_rest_velocity"]) > np.ptp(found["unstable_velocity"])
    figure = figure_basins({name: found[name] for name in DRAWN["figure_basins"]})
    assert f"{100 * found['basin_share']:.0f} % of the states" in figure.axes[0].get_title(loc="left")
    assert len(figure.axes[0].lines) == 4
    figure = figure_basins(run(basins, asked(1e-9, damping_ratio=0.22), "below"))
    assert figure.axes[0].lines[1].get_xdata().size == 0
