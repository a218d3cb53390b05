"""The stages of the stick-slip map: without scatter the deterministic limits decide, with it lifetimes agree."""

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.stages import lifetimes, stick_slip_map
from tests.stages.test_stages_motion import scattered

MAP = {
    "belt_velocities_m_per_s": [0.474, 1.896],
    "damping_ratios": [0.1, 0.5],
    "points": 3,
    "realisations": 8,
    "duration_periods": 40,
}
SURVIVAL = {"scatter_factors": [0.5, 1.0], "points": 5, "realisations": 8, "duration_periods": 40}


def asked(std: float, **others: object) -> dict:
    found = scattered(std, **others) | {"map": MAP, "survival": SURVIVAL}
    del found["ensemble"]  # not read
    return found


def test_without_scatter_the_map_is_cut_at_the_limit_of_its_velocity(run):
    """0 or 1 at every point, as runs begin in stick. mu_D' of eq. (13) by hand: the paper's own velocity is the middle
    one, and friction rises with speed soon after."""
    hardly = run(stick_slip_map, asked(1e-9))
    v = hardly["belt_velocity"]
    np.testing.assert_allclose(v, [0.474, 0.948, 1.896], rtol=1e-12)
    np.testing.assert_allclose(hardly["damping_ratio"], [0.1, 0.3, 0.5])
    exists = hardly["damping_ratio"] < hardly["existence_limit"][:, None]
    np.testing.assert_array_equal(hardly["probability"], exists)
    assert 0 < exists.sum() < exists.size
    assert not hardly["probability_error"].any()
    slope = -0.3 * 1.42 / (1 + 1.42 * v) ** 2 + 0.02 * v
    np.testing.assert_allclose(hardly["hopf_damping"], -slope * 2500 / (2 * 316), rtol=1e-9)
    assert hardly["existence_limit"][1] == pytest.approx(0.324424, abs=1e-6)
    assert np.all(hardly["existence_limit"] > hardly["hopf_damping"])  # subcritical


@pytest.mark.slow
def test_where_no_cycle_exists_the_limit_is_nan_and_sliding_certain(run, capsys):
    """At 20 m/s eq. (13) rises with speed: the quadratic term has the slope 0.4 s/m there."""
    fast = asked(1e-9) | {"map": MAP | {"belt_velocities_m_per_s": [0.948, 20.0], "points": 2}}
    found = run(stick_slip_map, fast, "fast")
    np.testing.assert_array_equal(np.isnan(found["existence_limit"]), [False, True])
    assert found["hopf_damping"][1] < 0
    assert "v0 = 20 m/s: no stick-slip cycle" in capsys.readouterr().err


@pytest.mark.slow
def test_lifetimes_change_with_damping_and_bands_order_their_levels_and_starts(run):
    """Stick-slip lives ever shorter and steady sliding ever longer. A larger probability of stick-slip is at less
    damping, and for runs that begin with it."""
    lived = run(lifetimes, asked(0.03))
    assert lived["survival_limit"] == pytest.approx(0.324424, abs=1e-6)
    reach = 4 * lived["unit_scatter"] * lived["friction_deviation"]
    ends = np.minimum(lived["survival_limit"] - reach, lived["survival_hopf"]), lived["survival_limit"] + reach
    np.testing.assert_allclose(lived["survival_damping"][:, [0, -1]].T, ends)
    np.testing.assert_array_equal(lived["survival"][:, [0, -1]], [[1, 0]] * 2)
    assert np.all(lived["kicked"][:, 0] == 1)
    for name in ("survival", "kicked", "survival_curve"):
        assert np.all((lived[f"{name}_low"] <= lived[name]) & (lived[name] <= lived[f"{name}_high"]))
    known = np.isfinite(lived["lifetime"])
    assert np.all(lived["lifetime"][:, -1] < 5)
    assert np.all(lived["lifetime_low"][known] < lived["lifetime"][known])
    np.testing.assert_array_equal(lived["survival_curve"][..., 0], 1.0)
    assert np.all(np.diff(lived["survival_curve"], axis=-1) <= 0)
    band = lived["band"]
    assert list(lived["band_start"]) == ["from rest on the belt", "from steady sliding"]
    from_rest = band[:, 0]
    assert np.all(np.diff(from_rest[np.isfinite(from_rest).all(axis=1)], axis=1) >= 0)
    both = np.isfinite(band).all(axis=1)
    assert np.all(band[:, 0][both] >= band[:, 1][both] - 0.03)


@pytest.mark.slow
def test_bands_that_the_runs_do_not_hold_are_nan_with_a_line_in_the_log(run, capsys):
    """Hardly any scatter, at the Hopf damping and just beyond the limit: runs from rest cycle at the first alone, those
    from sliding at neither."""
    found = run(lifetimes, asked(1e-9) | {"survival": SURVIVAL | {"points": 2}}, "narrow")
    assert np.isfinite(found["band"][:, 0]).all()
    assert np.isnan(found["band"][:, 1]).all()
    assert "from steady sliding: the damping ratios from 0.2311 to 0.3244 do not hold" in capsys.readouterr().err
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        run(lifetimes, asked(0.03, belt_velocity_m_per_s=20.0), "none")
