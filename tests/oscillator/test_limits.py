"""Motion without scatter: next peaks, cycle, limits in damping, counts by the period; the first order of noise.

States that another project labels by their end, found again.
"""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from roughslip.errors import IllPosedError
from roughslip.friction.process import CorrelationShape, FrictionProcess
from roughslip.oscillator.cycles import ensemble
from roughslip.oscillator.equation import Oscillator, acceleration, coefficients
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.grazing import _orbit, grazing_response
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import existence_limit, hopf_damping, limit_cycle, slip_loop
from roughslip.oscillator.machine import Machine
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.oscillator.slip_orbit import balance, equilibrium, rate_of_slip, slip_flow, turn
from roughslip.oscillator.table_law import TableLaw, friction_law
from roughslip.probability import BetaDistribution
from tests.oscillator.motions import LAW, STUDY, machine


def next_peak(flow, y, w):
    """The peak after a peak or departure, and the time between them."""
    trough, depth, down = turn(flow, y, w)
    _, peak, up = turn(flow, trough, depth)
    return peak, down + up


TABLE = TableLaw((0.0, 0.4, 1.0, 2.0, 4.0), (0.4, 0.3, 0.24, 0.25, 0.27))


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.4), TABLE, StribeckLaw(0.6)])
def test_the_flow_is_the_motion_s_right_hand_side(law):
    """X'' of the compiled motion, in units of V, on a grid of states; rounding of X / V, some 4, alone.

    With a fit of 0.6 friction would be negative from 1.4 m/s on, and is cut.
    """
    p, flow = coefficients(STUDY, law), slip_flow(STUDY, law)
    for w in (-3.0, -0.5, 0.0, 0.7, 1.0):
        for y in (-2.0, 0.3, 1.5):
            expected = acceleration(0.0, equilibrium(STUDY, law) + p.V * y, w * p.V, 1.0, 0.0, p) / p.V
            assert flow.at_peak(w) - y == pytest.approx(expected, abs=1e-13)


def test_equilibrium_and_hopf_from_the_right_hand_side():
    """X'' vanishes at the equilibrium, and its derivative by X' there changes sign at the Hopf damping."""
    oscillator = replace(STUDY, damping_ratio=hopf_damping(STUDY, LAW))
    p = coefficients(oscillator, LAW)
    x = equilibrium(oscillator, LAW)
    assert acceleration(0.0, x, 0.0, 1.0, 0.0, p) == pytest.approx(0.0, abs=1e-15 * p.F)
    h = 1e-4 * p.V  # central difference: error h^2 mu''' ~ 1e-8
    slope = (acceleration(0.0, x, h, 1.0, 0.0, p) - acceleration(0.0, x, -h, 1.0, 0.0, p)) / (2 * h)
    assert slope == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize(("jump", "published"), [(0.5, 0.017938), (1.0, 0.057829), (2.0, 0.145359), (5.0, 0.322719)])
def test_coulomb_s_limit_in_closed_form(jump, published):
    """Linear slip from y = jump - 2 D, w = 1 has its next peak at w = 1.

    It is w = e^(-D t) (cos b t - c sin b t). Here b^2 = 1 - D^2 and c = (D + y) / b. Its rate vanishes where
    tan b t = -(D + c b) / (c D - b).
    """

    def linear_peak(d):
        b = math.sqrt(1 - d * d)
        c = (d + jump - 2 * d) / b
        angle = math.atan2(d + c * b, -(b - c * d))
        times = [(angle + k * math.pi) / b for k in range(1, 5)]
        rise = [t for t in times if math.cos(b * t) - c * math.sin(b * t) > 0]
        return math.exp(-d * rise[0]) * (math.cos(b * rise[0]) - c * math.sin(b * rise[0]))

    root = brentq(lambda d: linear_peak(d) - 1, 1e-3, 0.9, xtol=1e-14)
    assert root == pytest.approx(published, abs=6e-7)
    law = CoulombLaw(0.3, 0.3 + jump * STUDY.V / STUDY.F)
    assert existence_limit(STUDY, law) == pytest.approx(root, abs=2e-10)


def test_cycle_on_either_side_of_the_existence_limit():
    """Both attract between Hopf and existence limit; beyond it no motion returns to stick. The motion has an integrator
    of its own, so that 1e-8 on either side is its word on the limit."""
    limit = existence_limit(STUDY, LAW)
    below, above = (replace(STUDY, damping_ratio=limit + side * 1e-8) for side in (-1.0, 1.0))
    assert limit_cycle(below, LAW).period > 2.0 * math.pi
    with pytest.raises(IllPosedError, match="no stick-slip cycle"):
        limit_cycle(above, LAW)
    assert slip_loop(above, LAW).cycle is None
    damped = replace(STUDY, damping_ratio=1.2 * limit)
    flow = slip_flow(damped, LAW)
    _, peak = next_peak(flow, flow.departure, 1.0)
    assert slip_loop(damped, LAW).periods == pytest.approx(peak / (2 * math.pi), rel=1e-8)
    assert simulate(below, LAW, None, 0.0, 30.0, MotionOptions(1e-11)).cycles > 20
    assert simulate(above, LAW, None, 0.0, 30.0, MotionOptions(1e-11)).cycles == 0


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.4)])
@pytest.mark.parametrize("periods", [0.3, 1.7, 40.3, 97.0])
def test_cycles_are_counted_by_their_period(law, periods):
    """On both sides of the end of the cycle, for runs that end in stick, in slip and before the first slip.

    From rest the mass first departs at tau = X_d / V. Then every cycle is the first one again.
    """
    dampings = [0.0, 0.05, 0.17, 0.23, 0.3, 0.324, 0.325, 0.34, 0.6, 0.99, 1.5]
    counts = ensemble(Machine(STUDY, law), [None], duration_periods=periods, over={"damping": dampings})
    for damping, cycles, last in zip(dampings, counts.cycles[0], counts.last_cycle[0], strict=True):
        if damping >= existence_limit(STUDY, law):
            assert (cycles, last) == (0, 0.0)
            continue
        cycle = limit_cycle(replace(STUDY, damping_ratio=damping), law)
        first = cycle.departure / STUDY.V + cycle.slip_duration
        whole = max(math.floor((2 * math.pi * periods - first) / cycle.period) + 1, 0)
        assert cycles == whole
        assert last == pytest.approx((first + (whole - 1) * cycle.period) / (2 * math.pi) * (whole > 0), abs=1e-6)


TRIANGLE = CorrelationShape(np.array([0.0, 2.0]), np.array([1.0, 0.0]))  # 1 - s / (2 L)
LENGTH, BETA = 2.5e-4, BetaDistribution.of_moments(2.1, 5.0, 0.3, 0.03)
JUMP = CoulombLaw(0.3, 0.3 + STUDY.V / STUDY.F)


@pytest.fixture(scope="module")
def response():
    return grazing_response(Machine(STUDY, LAW))


def peak_at(law, damping, shift=0.0):
    flow = slip_flow(replace(STUDY, damping_ratio=damping), law)
    return next_peak(flow, flow.departure + shift, 1.0)[0]


def test_responses_are_difference_quotients(response):
    """Of the next peak to damping, on the side where it stays below the belt, beyond which friction turns."""
    h = 1e-5
    # a constant mu_S moves the motion along X: what is left is the trapezoidal rule
    assert abs(response.kernel.sum()) < 1e-5 * np.abs(response.kernel).sum()
    assert response.limit == existence_limit(STUDY, LAW)
    lower = [peak_at(LAW, response.limit + k * h) for k in range(3)]
    assert response.damping == pytest.approx((-3 * lower[0] + 4 * lower[1] - lower[2]) / (2 * h), rel=1e-5)


def plain_turn(flow, y, w, end):
    """The same motion by SciPy: state (y, w) after the time `end`."""
    leg = solve_ivp(lambda _, z: (z[1], flow.at_peak(z[1]) - z[0]), (0, end), (y, w), "DOP853", rtol=1e-13, atol=1e-14)
    return leg.y[:, -1]


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.35), TableLaw((0.0, 0.2, 0.6, 3.0), (0.4, 0.31, 0.25, 0.27))])
@pytest.mark.parametrize("damping", [0.02, 0.2, 0.9])
def test_turns_are_those_of_scipy(law, damping):
    """A trough and a peak beyond the belt. As w' vanishes there, an error of the time e moves
    y by |w| e, and w by less. The table has kinks, at which SciPy's steps err by some 1e-9."""
    flow = slip_flow(replace(STUDY, damping_ratio=damping), law)
    state = flow.departure, 1.0
    for _ in range(2):
        y, w, time = turn(flow, *state)
        assert (y, w) == pytest.approx(plain_turn(flow, *state, time), abs=2e-8)
        assert flow.at_peak(w) == pytest.approx(y, abs=1e-9)
        state = y, w


def test_the_adjoint_holds_where_slip_contracts():
    """A strong damping: the propagator over the orbit is singular to rounding, its adjoint is a difference quotient.

    So is the rate of slip.
    """
    flow, h = slip_flow(replace(STUDY, damping_ratio=9.0), StribeckLaw(0.1)), 1e-4
    for w in (-0.4, 0.3, 0.9):
        rate = (balance(w + h, flow) - balance(w - h, flow)) / (2 * h)
        assert rate_of_slip(w, flow) == pytest.approx(rate, rel=1e-6)
    start, samples = (0.3, -0.4), 801
    orbit, adjoint, _ = _orbit(start, flow, 4.0, samples)
    for sample, direction in ((0, (1.0, 0.0)), (400, (1.0, 0.0)), (760, (0.0, 1.0))):
        left = 4.0 * (1.0 - sample / (samples - 1))
        ends = [plain_turn(flow, *(orbit[sample] + side * h * np.array(direction)), left)[1] for side in (1, -1)]
        assert adjoint[sample] @ direction == pytest.approx((ends[0] - ends[1]) / (2 * h), rel=1e-5, abs=1e-9)


def test_the_departure_point_matters_where_friction_jumps(response):
    """Of Coulomb's law, which does not turn at the belt. Without a jump the mass departs along the belt's line, y' = 1
    and w' = 0, so that an earlier departure is the same orbit."""
    h, jump = 1e-4, grazing_response(Machine(STUDY, JUMP))
    slope = (peak_at(JUMP, jump.limit, h) - peak_at(JUMP, jump.limit, -h)) / (2 * h)
    departure = jump.kernel[0] - 0.5 * jump.kernel[1]  # the end of the trapezoidal rule has half a sample of slip
    assert departure == pytest.approx(STUDY.F / STUDY.V * slope, rel=1e-2)
    assert departure > 1.0
    assert response.kernel[0] == pytest.approx(0.5 * response.kernel[1], rel=1e-2)


def test_long_windows_move_the_limit_farther_until_friction_is_constant_over_a_loop(response):
    """A loop slips 20 mm. A constant mu_S moves nothing: beyond it the response falls as the root of the length, as
    that of a triangle 1 - s / T does: the variance is that of -|s| over T."""
    scatter = {
        length: response.scatter(FrictionProcess(BETA, length / 2, TRIANGLE).autocorrelation)
        for length in (4.8e-3, 6e-3, 8e-3, 63e-3, 252e-3)
    }
    assert scatter[252e-3] == pytest.approx(scatter[63e-3] / 2, rel=1e-3)
    assert scatter[6e-3] > max(scatter[4.8e-3], scatter[8e-3])
    assert response.scatter(lambda lag: np.exp(-lag / 3e-4)) == response.scatter(3e-4)


@pytest.mark.parametrize("law", [LAW, JUMP], ids=["stribeck", "jump"])
def test_a_constant_factor_moves_the_limit_as_the_normal_force_does(law):
    """d D / d ln N of the limit of existence, by a difference of second order.

    The paper's oscillator has d ln D / d ln N = 0.933: long waves of the friction of a pad, which only change the force
    on it, move its limit by 0.933 of their coefficient of variation.
    """
    response, h = grazing_response(Machine(STUDY, law, options=MotionOptions(scatter="multiplicative"))), 1e-3
    more, less = (
        existence_limit(replace(STUDY, normal_force_n=STUDY.normal_force_n * math.exp(step)), law) for step in (h, -h)
    )
    moved = -response.kernel.sum() / response.damping
    assert moved == pytest.approx((more - less) / (2 * h), rel=1e-4)
    if law is LAW:
        assert moved / response.limit == pytest.approx(0.933, abs=5e-4)
        assert response.scatter(1e3) == pytest.approx(moved, rel=1e-3)  # of correlation lengths far beyond a loop


@pytest.mark.nightly
def test_motions_miss_the_belt_as_often_as_predicted(response):
    """300 paths with a deviation of 0.004, at the limit and one standard deviation on either side.

    The second order is a hundredth of the first. The tolerance is four standard errors of a share, and 0.02.
    """
    deviation, runs, missed = 0.004, 300, np.zeros(3)
    scatter, paths = deviation * response.scatter(LENGTH), machine(deviation, LENGTH).friction.paths(8)
    dampings = response.limit + scatter * np.array([-1.0, 0.0, 1.0])
    for number in range(runs):
        for place, damping in enumerate(dampings):
            damped = replace(STUDY, damping_ratio=float(damping))
            start = LAW.static * STUDY.F - 2 * damping * STUDY.V - 5 * deviation * STUDY.F  # sticks for all mu_S(0)
            motion = simulate(damped, LAW, paths.realisation([4, number]), paths.spacing, 1.6, start_m=start)
            missed[place] += not np.any(motion.kind == REATTACHMENT)
    expected = stats.norm.cdf((dampings - response.limit) / scatter)
    assert np.all(np.abs(missed / runs - expected) < 4 * np.sqrt(expected * (1 - expected) / runs) + 0.02)


BSTAB = Oscillator(1.0, 1.0, 0.05, 1.5, 1.0)
LABELS = Path(__file__).resolve().parents[3] / "shared" / "data" / "bstab-friction.csv"


def falling(speed):
    return 0.5 + 0.5 * math.exp(-speed / 0.5)


def sticks(start):
    """Whether the motion from X and X' ever sticks, in sixty loops."""
    run = simulate(BSTAB, friction_law(falling), None, 0.0, 60.0, start_m=start)
    return REATTACHMENT in run.kind or run.kind.size == 0 or run.time[0] > 0.0


@pytest.mark.slow
@pytest.mark.skipif(not LABELS.is_file(), reason="needs the labelled states ../shared/data/bstab-friction.csv")
def test_the_labels_of_bstab_agree():
    """M. Stender & N. Hoffmann (Nonlinear Dyn. 107 (2022) 1451): all but one, within 1e-5 of the unstable cycle."""
    with LABELS.open() as file:
        rows = [((float(row["x1"]), float(row["x2"])), row["label"] == "LC") for row in csv.DictReader(file)]
    differ = [state for state, label in rows if sticks(state) != label]
    assert (len(rows), len(differ)) == (4000, 1)
    (x, u), steps = differ[0], (-1e-5, 0.0, 1e-5)
    assert len({sticks((x + dx, u + du)) for dx in steps for du in steps}) == 2
