"""Cycles without stick: the branch from the Hopf point to grazing, closed forms at both ends, published amplitudes."""

import math
from dataclasses import replace

import pytest

from roughslip.errors import IllPosedError, ParameterError
from roughslip.oscillator.law import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import existence_limit, limit_cycle
from roughslip.oscillator.motion import simulate
from roughslip.oscillator.pure_slip import (
    cycle_damping,
    hopf_damping,
    lyapunov_coefficient,
    pure_slip_cycles,
    separating_peak,
)
from roughslip.oscillator.return_map import slip_flow
from roughslip.oscillator.system import Oscillator
from tests.oscillator.laws import Cubic

STUDY = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
LAW = StribeckLaw(0.3)


def van_der_pol(mu: float, unit: float) -> tuple[Oscillator, Cubic]:
    """w = unit x with x'' - mu (1 - x^2) x' + x = 0, at the damping ratio of the study."""
    scale = STUDY.F / STUDY.V
    return STUDY, Cubic(0.3, (mu + 2 * STUDY.damping_ratio) / scale, -mu / (3 * unit**2) / scale, 0.948)


def test_van_der_pol_s_cycle():
    """Amplitude 2 + mu^2/96 - 1033 mu^4/552960 and frequency 1 - mu^2/16 + 17 mu^4/3072 + 35 mu^6/884736 (C. M.
    Andersen & J. F. Geer, SIAM J. Appl. Math. 42 (1982) 678); what is left out at mu = 0.2 is some 1e-8."""
    mu, unit = 0.2, 0.3
    (cycle,) = pure_slip_cycles(*van_der_pol(mu, unit))
    assert cycle.peak / unit == pytest.approx(2 + mu**2 / 96 - 1033 * mu**4 / 552960, abs=5e-8)
    assert 2 * math.pi / cycle.period == pytest.approx(
        1 - mu**2 / 16 + 17 * mu**4 / 3072 + 35 * mu**6 / 884736, abs=1e-8
    )
    # averaging: r' = mu r (1 - r^2 / 4) / 2, so that a turn multiplies by exp(-2 pi mu) to first order
    assert math.log(cycle.multiplier) == pytest.approx(-2 * math.pi * mu, rel=mu**2)


def test_a_supercritical_branch_attracts_and_lies_below_hopf():
    oscillator, law = van_der_pol(0.2, 0.4)
    assert hopf_damping(oscillator, law) == pytest.approx(0.17 + 0.1, rel=1e-12)
    assert lyapunov_coefficient(oscillator, law) == pytest.approx(-2 * 0.2 / 0.4**2 / 16, rel=1e-9)
    assert cycle_damping(oscillator, law, 1.0) < 0.17 < cycle_damping(oscillator, law, 0.3) < 0.27
    assert existence_limit(oscillator, law) == pytest.approx(cycle_damping(oscillator, law, 1.0), abs=1e-9)
    assert separating_peak(oscillator, law) == 1.0  # slip settles on its cycle, and no stick-slip cycle exists
    below = replace(oscillator, damping_ratio=0.9 * existence_limit(oscillator, law))
    assert pure_slip_cycles(below, law) == []
    assert separating_peak(below, law) == 0.0


def test_hopf_and_its_criticality_for_eq_13():
    """mu_D' = -fit k / (1 + k v)^2 + 2 q v and mu_D''' = -6 fit k^3 / (1 + k v)^4; the difference quotient errs by
    h^4 / 90 of the seventh derivative of mu_D."""
    v, k = 0.948, 1.42
    slope, third = -0.3 * k / (1 + k * v) ** 2 + 0.02 * v, -6 * 0.3 * k**3 / (1 + k * v) ** 4
    assert hopf_damping(STUDY, LAW) == pytest.approx(-slope * 2500 / (2 * 316), rel=1e-13)
    seventh = 5040 / 6 * (k / (1 + k * v)) ** 4
    error = (0.01 * v) ** 4 / 90 * seventh
    assert lyapunov_coefficient(STUDY, LAW) == pytest.approx(-third * 2500 / 316 * v**2 / 16, rel=2 * error)


def test_the_branch_begins_at_the_hopf_point_with_its_curvature():
    """(D(a) - D_Hopf) / a^2 tends to the coefficient in second order of a: the branch is even."""
    excess = [(cycle_damping(STUDY, LAW, a) - hopf_damping(STUDY, LAW)) / a**2 for a in (0.1, 0.05, 0.025)]
    error = [value / lyapunov_coefficient(STUDY, LAW) - 1 for value in excess]
    assert abs(error[2]) < 1e-3
    assert math.log2(error[0] / error[1]) == pytest.approx(2, abs=0.05)
    assert math.log2(error[1] / error[2]) == pytest.approx(2, abs=0.05)


def test_the_branch_of_the_study_repels_and_ends_where_stick_slip_ends():
    assert cycle_damping(STUDY, LAW, 1.0) == pytest.approx(existence_limit(STUDY, LAW), abs=2e-10)
    before = hopf_damping(STUDY, LAW)
    for peak in (0.2, 0.6, 0.9):
        damping = cycle_damping(STUDY, LAW, peak)
        assert damping > before
        (cycle,) = pure_slip_cycles(replace(STUDY, damping_ratio=damping), LAW)
        assert cycle.peak == pytest.approx(peak, abs=1e-7)
        assert cycle.multiplier > 1.0
        assert separating_peak(replace(STUDY, damping_ratio=damping), LAW) == cycle.peak
        before = damping


def test_beyond_either_end_there_is_no_cycle():
    for damping, peak in ((0.2, 0.0), (0.33, 1.0)):
        oscillator = replace(STUDY, damping_ratio=damping)
        assert pure_slip_cycles(oscillator, LAW) == []
        assert separating_peak(oscillator, LAW) == peak


def test_a_jump_of_friction_leaves_the_grazing_orbit_between():
    """With Coulomb friction slip only decays: no cycle without stick, and the orbit that grazes the belt parts."""
    law = CoulombLaw(0.3, 0.4)
    assert pure_slip_cycles(STUDY, law) == []
    assert separating_peak(STUDY, law) == 1.0
    assert cycle_damping(STUDY, law, 0.5) == pytest.approx(0.0, abs=1e-10)  # a centre, of every peak


def test_friction_that_rises_has_no_cycle():
    with pytest.raises(IllPosedError, match="would be negative"):
        cycle_damping(STUDY, StribeckLaw(fit=0.0, quadratic_s2_per_m2=0.1), 0.5)


@pytest.mark.parametrize("damping", [0.25, 0.28, 0.32])
def test_motions_leave_the_repelling_cycle_to_either_side(damping):
    """Started on its section a ten thousandth inside and outside: steady sliding there, stick-slip here, for good. A
    turn multiplies the distance by two and more, so that twenty of them decide."""
    oscillator = replace(STUDY, damping_ratio=damping)
    peak, flow = separating_peak(oscillator, LAW), slip_flow(oscillator, LAW)
    motions = [
        simulate(
            oscillator,
            LAW,
            None,
            0.0,
            60.0,
            1e-10,
            flow.position(flow.at_peak(side * peak)),
            start_velocity_m=side * peak * STUDY.V,
        )
        for side in (1 - 1e-4, 1 + 1e-4)
    ]
    assert motions[0].cycles == 0
    assert motions[1].cycles > 20
    assert motions[1].reattachments()[-1] == pytest.approx(limit_cycle(oscillator, LAW).reattachment, rel=1e-8)


def test_a_motion_on_the_cycle_stays_there_for_some_turns():
    """It leaves by the multiplier to the power of the turns, from the 1e-12 of the peak and 1e-13 a step."""
    oscillator = replace(STUDY, damping_ratio=0.25)
    (cycle,) = pure_slip_cycles(oscillator, LAW)
    turns = 5
    motion = simulate(
        oscillator, LAW, None, 0.0, turns * cycle.period / (2 * math.pi), 1e-12, cycle.position,
        start_velocity_m=cycle.peak * STUDY.V,
    )  # fmt: skip
    # X is back, so that the slipped distance is the belt's travel
    assert motion.total_slip == pytest.approx(
        STUDY.V * turns * cycle.period, abs=1e-9 * STUDY.V * cycle.multiplier**turns
    )


def test_refuses_excitation_and_peaks_beyond_the_belt():
    driven = replace(STUDY, excitation_force_n=1.0, excitation_frequency_rad_per_s=100.0)
    for function in (hopf_damping, pure_slip_cycles, separating_peak):
        with pytest.raises(ParameterError, match="free oscillator"):
            function(driven, LAW)
    for peak in (0.0, 1.1, math.nan):
        with pytest.raises(ParameterError, match="peak of a cycle"):
            cycle_damping(STUDY, LAW, peak)
