"""First order of noise at the grazing orbit: identities, difference quotients, and motions on drawn paths."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from roughslip.errors import ParameterError
from roughslip.oscillator import grazing as module
from roughslip.oscillator.event_loop import REATTACHMENT
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.grazing import grazing_response
from roughslip.oscillator.limits import existence_limit
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.oscillator.return_map import slip_flow, turn_from
from tests.oscillator.motions import LAW, STUDY

LENGTH = 2.5e-4
JUMP = CoulombLaw(0.3, 0.3 + STUDY.V / STUDY.F)


@pytest.fixture(scope="module")
def response():
    return grazing_response(STUDY, LAW)


def peak_at(law, damping, shift=0.0):
    flow = slip_flow(replace(STUDY, damping_ratio=damping), law)
    departure = (STUDY.F * law.static - flow.steady) / STUDY.V - 2 * damping
    return turn_from(flow, departure + shift, 1.0).peak


@pytest.mark.parametrize("law", [LAW, JUMP])
def test_constant_friction_does_not_matter(law):
    """It moves the motion along X. What is left is the trapezoidal rule, h^2 / 12 of the ends' difference of slopes."""
    response = grazing_response(STUDY, law)
    assert abs(response.kernel.sum()) < 1e-5 * np.abs(response.kernel).sum()


def test_responses_are_difference_quotients(response):
    """Of the next peak to damping, on the side where it stays below the belt, beyond which friction turns."""
    h = 1e-5
    assert response.limit == existence_limit(STUDY, LAW)
    lower = [peak_at(LAW, response.limit + k * h) for k in range(3)]
    assert response.damping == pytest.approx((-3 * lower[0] + 4 * lower[1] - lower[2]) / (2 * h), rel=1e-5)


def test_the_departure_point_matters_where_friction_jumps(response):
    """Of Coulomb's law, which does not turn at the belt. Without a jump the mass departs along the belt's line, y' = 1
    and w' = 0, so that an earlier departure is the same orbit."""
    h, jump = 1e-4, grazing_response(STUDY, JUMP)
    slope = (peak_at(JUMP, jump.limit, h) - peak_at(JUMP, jump.limit, -h)) / (2 * h)
    departure = jump.kernel - grazing_response(STUDY, JUMP, stochastic_static_limit=False).kernel
    assert not departure[1:].any()
    assert departure[0] == pytest.approx(STUDY.F / STUDY.V * slope, rel=1e-6)
    assert departure[0] > 1.0
    fixed = grazing_response(STUDY, LAW, stochastic_static_limit=False)
    assert fixed.scatter(LENGTH) == pytest.approx(response.scatter(LENGTH), rel=1e-9)


def test_a_long_correlation_moves_friction_as_a_whole():
    """With a departure point that stands still the peak moves by all of the kernel; else increments alone move it,
    which go as the root of 1 / L."""
    jump, fixed = (grazing_response(STUDY, JUMP, stochastic) for stochastic in (True, False))
    assert fixed.scatter(1e6) == pytest.approx(abs(fixed.kernel.sum() / fixed.damping), rel=1e-6)
    assert jump.scatter(40.0) / jump.scatter(10.0) == pytest.approx(0.5, rel=1e-3)


def test_the_samples_are_enough(response, monkeypatch):
    """Second order: half as many samples would err by four times what is left."""
    monkeypatch.setattr(module, "SAMPLES", 1001)
    assert grazing_response(STUDY, LAW).scatter(LENGTH) == pytest.approx(response.scatter(LENGTH), rel=1e-3)


def test_slipped_distance_is_that_of_the_cycle(response):
    """Of the loop at the limit, where the cycle is slip alone: V times its duration, as X comes back."""
    assert response.slipped[0] == 0.0
    assert np.all(np.diff(response.slipped) >= 0.0)
    motion = simulate(
        replace(STUDY, damping_ratio=response.limit - 1e-7),
        LAW,
        None,
        0.0,
        2.0,
        MotionOptions(1e-11),
        start_position_m=0.0,
    )
    loop = motion.slipped_distance[motion.kind == REATTACHMENT][0]
    assert response.slipped[-1] == pytest.approx(loop, rel=1e-3)  # the belt is met sqrt(1e-7) before the peak


@pytest.mark.slow
def test_motions_miss_the_belt_as_often_as_predicted(response):
    """300 paths with a deviation of 0.004, at the limit and one standard deviation on either side.

    The second order is a hundredth of the first. The tolerance is four standard errors of a share, and 0.02.
    """
    deviation, runs, nodes = 0.004, 300, 1200
    scatter = deviation * response.scatter(LENGTH)
    step = LENGTH / 8
    rho = math.exp(-step / LENGTH)
    missed = np.zeros(3)
    dampings = response.limit + scatter * np.array([-1.0, 0.0, 1.0])
    for number in range(runs):
        noise = np.random.default_rng([4, number]).standard_normal(nodes)
        path = np.empty(nodes)
        path[0] = noise[0]
        for k in range(1, nodes):
            path[k] = rho * path[k - 1] + math.sqrt(1 - rho**2) * noise[k]
        for place, damping in enumerate(dampings):
            damped = replace(STUDY, damping_ratio=float(damping))
            start = LAW.static * STUDY.F - 2 * damping * STUDY.V - 5 * deviation * STUDY.F  # sticks for all mu_S(0)
            motion = simulate(damped, LAW, deviation * path, step, 1.6, start_position_m=start)
            missed[place] += not np.any(motion.kind == REATTACHMENT)
    expected = stats.norm.cdf((dampings - response.limit) / scatter)
    assert np.all(np.abs(missed / runs - expected) < 4 * np.sqrt(expected * (1 - expected) / runs) + 0.02)


def test_refuses_a_length_that_is_none(response):
    for length in (0.0, math.nan, -1.0):
        with pytest.raises(ParameterError, match="correlation length"):
            response.scatter(length)
