"""Sensitivity of verdicts: ends with closed forms, scaling, and the verdict on both sides of every end."""

import functools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.chaos.sampling import wilson_interval
from roughslip.contact.influence import Influence
from roughslip.contact.solve import solve
from roughslip.errors import ParameterError
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.grid import Grid
from roughslip.verdicts import bracket
from roughslip.verdicts.bracket import REACH, end
from roughslip.verdicts.rules import claims
from roughslip.verdicts.sensitivity import (
    ACCURACY,
    LEAST_CONTACT,
    LENGTH,
    MATERIAL,
    PROPORTION,
    RMS,
    STRIPS,
    WINDOW,
    lengthened,
    narrowed,
    of_friction,
    of_the_square,
    with_sensitivity,
)
from roughslip.verdicts.sensitivity_oscillator import PARALLEL, of_the_oscillator, with_runs
from tests.verdicts.claimed import friction, oscillator, square, with_interval

ROUGHNESS = {"covariance": "gaussian", "rms_height_m": 5e-8, "correlation_length_m": 6e-7}
STRIP = {"length_m": 2.4e-3, "margin_m": 3e-4, "cell_m": 2.5e-6, "window_m": 6e-4, "window_spacing_m": 1.5e-5}
BELT = {"mass_kg": 2.0, "belt_velocity_m_per_s": 0.5, "damping_ratio": 0.17, "excitation_force_n": 0.0}
BELT |= {"law": "stribeck", "penetration_percentile": 50.0, "windows_in_parallel": 1}
SCENES = {
    "claims": {"targets": ["figure2", "figure3", "figure5"]},
    "square": {"roughness": ROUGHNESS, "square": {"nodes": 10, "edge_m": 6e-4}},
    "friction": {
        "roughness": ROUGHNESS,
        "strip": STRIP | {"samples": 480, "penetration_percentiles": [10, 50, 90]},
        "friction": {"mean_at_median": 0.3, "least_contact_fraction": 1e-3},
    },
    "deterministic": {"oscillator": BELT, "ensemble": {"duration_periods": 100}},
}
RUNS = 400


def of_strips():
    return friction() | {"missing_share": np.zeros(3)}


def of_runs(**changes):
    """The scene of the claims with shares of 400 runs, the Hopf point at 0.23."""
    low, high = wilson_interval(RUNS * np.array([1, 1, 0.6, 0.3, 0]), RUNS)
    share = wilson_interval(RUNS, RUNS)
    return (
        oscillator()
        | {"realisations": np.array(RUNS), "deterministic_hopf_damping": np.array(0.23)}
        | {"still_cycling_low": low, "still_cycling_high": high}
        | {"cycling_share_low": share[0], "cycling_share_high": share[1]}
        | changes
    )


# As factors: the cycle exists up to 1.9, sliding is unstable up to 1.4, the list has both sides from 0.8 to 6; the belt
# may go slower as it likes, and nothing is known of a slow one.
NAN = np.nan
SKELETON = {
    "parameter": np.array(["mass_kg", "belt_velocity_m_per_s"]),
    "cycle_range": np.array([[[0.1, NAN], [1.9, 1.9 * (1 + 1e-6)]], [[0.5, NAN], [1.5, 1.5 * (1 + 1e-6)]]]),
    "unstable_range": np.array([[[0.1, NAN], [1.4, 1.4 * (1 + 1e-6)]], [[0.1, NAN], [1.2, 1.2 * (1 + 1e-6)]]]),
    "sides_range": np.array([[[0.8, 0.8 * (1 - 1e-6)], [6.0, 6.0 * (1 + 1e-6)]], [[NAN, NAN], [NAN, NAN]]]),
}


def verdicts_on(square_=None, friction_=None, oscillator_=None, skeleton=SKELETON, scenes=SCENES):
    """The claims with their sensitivities, by id."""
    found = claims(square_, friction_, oscillator_)
    tested = {c["id"]: c["verdict"] for c in found if c["verdict"] not in ("not tested", "contradicts itself")}
    sensitivities = of_the_square(tested, scenes) if square_ is not None else {}
    if friction_ is not None:
        sensitivities |= of_friction(tested, friction_, scenes)
    if oscillator_ is not None:
        sensitivities |= of_the_oscillator(tested, oscillator_, skeleton, scenes)
    found = with_sensitivity(found, sensitivities)
    json.dumps(found, allow_nan=False)
    return {claim["id"]: claim for claim in found}


@functools.cache
def of_all():
    """Of three branches, computed once."""
    return verdicts_on(square(), of_strips(), of_runs())


def range_in(claim, name):
    (found,) = [one for one in claim["stands"]["ranges"] if one["input"] == name]
    return found


def ends(found):
    return [found[key] for key in ("low_changes", "low", "high", "high_changes")]


def test_every_claim_lists_the_inputs_that_it_depends_on():
    found = of_all()
    for name, claim in found.items():
        stands = claim["stands"]
        assert set(stands) == {"always", "any_value", "ranges", "new_runs", "new_solves"}
        inputs = [*(one["input"] for one in stands["ranges"]), *stands["new_runs"], *stands["new_solves"]]
        inputs += [entry for entry in stands["any_value"] if "." in entry and " " not in entry]
        assert len(inputs) == len(set(inputs)), name
        assert bool(inputs) != bool(stands["always"])
    assert verdicts_on(square_=square())["fig5-sharp-limit"]["stands"] is None


def test_the_verdict_is_another_on_the_far_side_of_every_end_and_the_same_on_the_near_one():
    """Judged anew from results scaled to each end; intervals undecided here, decided there."""
    table = of_strips()
    for name, value, half in (("combined_skewness", 0.56, 0.5), ("combined_length_least_squares", 260e-6, 30e-6)):
        table |= with_interval(name, *(np.full(3, value + off) for off in (0.0, -half, half)))
    runs = of_runs(**with_interval("reattachment_skewness", 0.3, 0.15, 0.45))
    moves = {
        STRIPS: lambda factor: claims(None, narrowed(table, factor), None),
        WINDOW: lambda factor: claims(None, lengthened(table, factor), None),
        "ensemble.realisations": lambda factor: claims(None, None, with_runs(runs, factor)),
    }
    tried = dict.fromkeys(moves, 0)
    for name, claim in verdicts_on(None, table, runs).items():
        for one in claim["stands"]["ranges"] if claim["stands"] else ():
            if one["input"] not in moves:
                continue
            for near, far in (("low", "low_changes"), ("high", "high_changes")):
                for place, same in ((one[near], True), (one[far], False)):
                    if place is not None:
                        judged = {c["id"]: c["verdict"] for c in moves[one["input"]](place / one["value"])}
                        assert (judged[name] == claim["verdict"]) == same, (name, one)
                        tried[one["input"]] += not same
    assert min(tried.values()) >= 2


def test_fewer_strips_widen_the_interval_up_to_the_rule():
    """0.56 +- 0.4 lies above zero until its half width is 0.56: with (0.4 / 0.56)^2 of 480 strips, 244.9."""
    table = of_strips() | with_interval("combined_skewness", *(np.full(3, value) for value in (0.56, 0.16, 0.96)))
    found = range_in(verdicts_on(friction_=table)["mu-right-skewed"], STRIPS)
    assert ends(found) == [244, 245, 4800, None]
    assert found["value"] == 480
    few = SCENES["friction"] | {"strip": SCENES["friction"]["strip"] | {"samples": 12}}
    found = verdicts_on(friction_=of_strips(), scenes=SCENES | {"friction": few})["fig3-mean-decreases"]
    assert ends(range_in(found, STRIPS)) == [None, 8, 120, None]  # a scene has eight strips at least


def test_a_length_in_metres_moves_with_all_lengths_and_nothing_else_does():
    """230 to 270 um stays within 200 to 300 um from 600 / 1.15 to 600 / 0.9 um of window."""
    found = verdicts_on(friction_=of_strips())
    (low_changes, low, high, high_changes) = ends(range_in(found["mu-correlation-250um"], WINDOW))
    assert (low, high) == (pytest.approx(600e-6 * 200 / 230, rel=2e-4), pytest.approx(600e-6 * 300 / 270, rel=2e-4))
    assert low_changes < low < high < high_changes
    assert max(low / low_changes, high_changes / high) <= 1.0 + 2 * ACCURACY
    assert PROPORTION not in found["mu-correlation-250um"]["stands"]["any_value"]
    table = of_strips()
    for factor in (0.1, 10.0):
        before, after = (claims(None, one, None) for one in (table, lengthened(table, factor)))
        for one, other in zip(before, after, strict=True):
            if one["id"] != "mu-correlation-250um":
                assert one["verdict"] == other["verdict"]
    for name in ("fig3-mean-decreases", "mu-correlation-any-depth", "mu-beta-2.1-5"):
        assert PROPORTION in found[name]["stands"]["any_value"]


def test_modulus_heights_and_lengths_cancel_in_calibrated_friction():
    """Three times E*, twice the heights, five times the lengths: mu of every window stays, so that no verdict moves."""
    heights = np.random.default_rng(7).standard_normal((4, 12, 12))

    def mu(modulus, rms, cell):
        area, force = np.empty((2, 4))
        for window, surface in enumerate(heights):
            influence = Influence(Grid(12, 12, cell, cell), modulus)
            pressure = solve(influence, rms * (surface - 0.5)).pressure
            area[window], force[window] = np.count_nonzero(pressure) * cell**2, pressure.sum() * cell**2
        whole = np.mean(area / force)
        return friction_coefficient(area, force, 0.3 / whole, 1e-3 * (12 * cell) ** 2)[0]

    np.testing.assert_allclose(mu(6e11, 1e-7, 5e-6), mu(2e11, 5e-8, 1e-6), rtol=1e-8)
    found = of_all()
    for claim in found.values():
        stands = claim["stands"]
        of_load = claim["id"] == "own-fig5-under-load"  # forces do not cancel
        assert stands["always"] or {*MATERIAL, RMS} <= set(stands["new_solves" if of_load else "any_value"])
        assert LENGTH not in [one["input"] for one in stands["ranges"]]
        assert (LENGTH in stands["new_solves"]) == (claim["id"] != "fig5-sharp-limit")


def test_a_surface_that_yields_has_one_group_more():
    yielding = SCENES | {"claims": SCENES["claims"] | {"material": {"hardness_pa": 2e9}}}
    for claim in verdicts_on(square(), of_strips(), of_runs(), scenes=yielding).values():
        if claim["id"] not in ("mu-leptokurtic", "fig5-sharp-limit"):
            assert {*MATERIAL, RMS} <= set(claim["stands"]["new_solves"])
            assert not {*MATERIAL, RMS} & set(claim["stands"]["any_value"])


def test_a_lower_least_contact_drops_no_window_where_none_is_dropped():
    missing = np.zeros(3)
    missing[0] = 0.01  # at the first level, not at the median
    found = verdicts_on(friction_=of_strips() | {"missing_share": missing})
    assert ends(range_in(found["mu-right-skewed"], LEAST_CONTACT)) == [None, 0.0, 1e-3, None]
    assert found["mu-right-skewed"]["stands"]["new_runs"] == ()
    assert found["fig3-mean-decreases"]["stands"]["new_runs"] == (LEAST_CONTACT,)


def test_mass_and_belt_stand_as_long_as_sliding_repels_and_fail_where_no_cycle_is():
    """In between the scatter decides. What is known of the slow belt ends at half its velocity."""
    found = verdicts_on(oscillator_=of_runs())["fig5-limit-cycle"]
    close = {"rel": 2 * ACCURACY}
    assert ends(range_in(found, "oscillator.mass_kg")) == [
        *(None, pytest.approx(2.0 * 0.1, **close), pytest.approx(2.0 * 1.4, **close)),
        pytest.approx(2.0 * 1.9, **close),
    ]
    assert ends(range_in(found, "oscillator.belt_velocity_m_per_s")) == [
        *(None, pytest.approx(0.5 * 0.5, **close), pytest.approx(0.5 * 1.2, **close)),
        pytest.approx(0.5 * 1.5, **close),
    ]
    assert f"{PARALLEL} from 1 on" in found["stands"]["any_value"]


def test_where_runs_below_the_hopf_point_do_not_all_cycle_nothing_is_concluded():
    """Then the cycle without scatter says only where the cycle ends."""
    doubtful = of_runs(still_cycling_low=np.array([0.99, 0.94, 0.5, 0.2, 0.0]))
    found = verdicts_on(oscillator_=doubtful)["fig5-limit-cycle"]
    mass = range_in(found, "oscillator.mass_kg")
    assert (mass["low"], mass["high"]) == (2.0, 2.0)
    assert mass["high_changes"] == pytest.approx(3.8, rel=2 * ACCURACY)
    assert PARALLEL in found["stands"]["new_runs"]


def test_damping_stands_between_listed_values_and_runs_while_a_share_of_one_is_sure():
    """Shares of 1, 1, 0.6, 0.3, 0 at 0.05, 0.17, 0.32, 0.33, 0.4, judged as that at 0.17.

    Wilson: n of n are sure to lie above 0.95 from n = 0.95 z^2 / 0.05 on, 72.99.
    """
    found = verdicts_on(oscillator_=of_runs())["fig5-limit-cycle"]
    assert ends(range_in(found, "oscillator.damping_ratio")) == [None, 0.05, 0.17, 0.32]
    assert ends(range_in(found, "ensemble.realisations")) == [72, 73, 4000, None]


def test_the_sharp_limit_stands_while_the_list_has_both_sides_of_it():
    found = verdicts_on(oscillator_=of_runs())["fig5-sharp-limit"]["stands"]
    (mass,) = found["ranges"]
    assert mass["input"] == "oscillator.mass_kg"
    close = {"rel": 2 * ACCURACY}
    assert ends(mass) == [pytest.approx(2.0 * end, **close) for end in (0.8, 0.8, 6.0, 6.0)]
    assert "oscillator.belt_velocity_m_per_s" in found["new_runs"]  # whose ends are not known
    assert {"oscillator.damping_ratio", "ensemble.realisations", PARALLEL} <= set(found["any_value"])
    assert found["new_solves"] == ()


def test_at_another_penetration_than_the_calibrated_one_the_surface_moves_the_limit():
    deeper = BELT | {"penetration_percentile": 20.0}
    scenes = SCENES | {"deterministic": SCENES["deterministic"] | {"oscillator": deeper}}
    found = verdicts_on(friction_=of_strips(), oscillator_=of_runs(), scenes=scenes)["fig5-sharp-limit"]
    assert LENGTH in found["stands"]["new_solves"]


def test_an_excited_oscillator_keeps_its_ratio_of_forces_alone():
    excited = BELT | {"excitation_force_n": 100.0}
    scenes = {"claims": {}, "deterministic": {"oscillator": excited, "ensemble": {}}}
    runs = of_runs(deterministic_existence_limit=np.array(NAN), deterministic_hopf_damping=np.array(NAN))
    blind = {name: values if name == "parameter" else np.full((2, 2, 2), NAN) for name, values in SKELETON.items()}
    found = verdicts_on(oscillator_=runs, skeleton=blind, scenes=scenes)
    assert [name for name, claim in found.items() if claim["stands"]] == ["fig5-reattachment-nonnormal"]
    stands = found["fig5-reattachment-nonnormal"]["stands"]
    assert "oscillator.normal_force_n with mass and excitation force in proportion" in stands["any_value"]
    assert {"oscillator.mass_kg", "friction.statistics.standard_deviation"} <= set(stands["new_runs"])


@settings(derandomize=True, max_examples=60)
@given(st.floats(0.01, 100.0), st.floats(1.001, 9.99), st.booleans())
def test_an_end_is_found_from_both_sides_to_the_stated_accuracy(start, factor, upwards):
    """The answer changes at a known value: it is kept at the one number of the end, and not at the other."""
    place = start * factor if upwards else start / factor

    def answer(value):
        return (value < place) if upwards else (value > place)

    found = end(answer, start, start * REACH if upwards else start / REACH)
    assert answer(found.stands)
    assert not answer(found.changes)
    for number in (found.stands, found.changes):
        assert number == pytest.approx(place, rel=bracket.ACCURACY)
    assert min(found.stands, found.changes) <= place <= max(found.stands, found.changes)


@pytest.mark.parametrize("reach", [10.0, 0.1])
def test_what_is_unknown_lies_between_the_two_numbers(reach):
    """Known up to a factor of 2, another from 5 on, and nothing in between."""

    def answer(value):
        factor = max(value, 1.0 / value)
        return "a" if factor < 2.0 else None if factor < 5.0 else "b"

    found = end(answer, 1.0, reach)
    assert max(found.stands, 1.0 / found.stands) == pytest.approx(2.0, rel=2 * bracket.ACCURACY)
    assert max(found.changes, 1.0 / found.changes) == pytest.approx(5.0, rel=2 * bracket.ACCURACY)
    assert (answer(found.stands), answer(found.changes)) == ("a", "b")


def test_what_comes_back_beyond_a_gap_is_not_taken_for_known():
    found = end(lambda value: None if 2.0 < value < 3.0 else "a", 1.0, 10.0)
    assert (found.stands, found.changes) == (pytest.approx(2.0, rel=2 * bracket.ACCURACY), None)


@pytest.mark.parametrize(("start", "reach"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, math.inf), (math.nan, 1.0)])
def test_a_range_lies_between_finite_positive_numbers(start, reach):
    with pytest.raises(ParameterError, match="finite positive"):
        end(lambda value: True, start, reach)
    with pytest.raises(ParameterError, match="is unknown"):
        end(lambda value: None, 1.0, 10.0)
