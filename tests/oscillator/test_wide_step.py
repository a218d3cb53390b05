"""Steps over many nodes of a path: the quadratic in place of it, and the motion against steps that end at each node."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicHermiteSpline

from roughslip.oscillator.equation import SCATTERS, Oscillator, coefficients, slip_state
from roughslip.oscillator.laws import CoulombLaw
from roughslip.oscillator.motion import MotionOptions, simulate, trajectory
from roughslip.oscillator.path import WIDTHS, Path, mu_s_at, piece_at
from roughslip.oscillator.slip import Horizon, Samples, slip
from roughslip.oscillator.switching_events import branch_at
from roughslip.oscillator.table_law import TableLaw
from roughslip.oscillator.wide_step import least_of, wide_piece, wide_step
from tests.oscillator.motions import LAW, STUDY, F, V, ends, machine

SPACING, FIRST = 2.5e-4 / 8, 100
KINKED = TableLaw((0.0, 2.8, 2.85, 2.9, 9.0), (0.4, 0.35, 0.34, 0.36, 0.4), 0.4)
NONE = np.zeros(0)
WIDE = WIDTHS.index(16)


def rough(seed, scale=1.0, size=1000):
    """A path of deviation 0.034 and length 250 um."""
    return scale * next(iter(machine(0.034, 2.5e-4).friction.paths(8).realisation([seed])))[:size]


@pytest.mark.parametrize("level", range(len(WIDTHS)))
def test_quadratic_has_the_integrals_of_the_path(level):
    """Against polynomials of degree 0 to 2, by Gauss's rule, exact up to degree 9; so has the running integral."""
    nodes, n = rough(level), WIDTHS[level]
    path = Path(nodes, 0, SPACING, True)
    wide, deviation = wide_piece(path, FIRST, level)
    points, weights = np.polynomial.legendre.leggauss(5)
    t = (np.arange(n)[:, None] + 0.5 + 0.5 * points) / n
    mu_s = CubicHermiteSpline(np.arange(nodes.size), nodes, np.gradient(nodes))(FIRST + n * t)
    left_out = mu_s - np.vectorize(lambda s: mu_s_at(wide, s))((FIRST + n * t) * SPACING)
    for degree in range(3):
        assert np.sum(weights * left_out * t**degree) == pytest.approx(0.0, abs=1e-14 * n)
    inner = np.cumsum(left_out @ weights * SPACING / 2)[:-1]
    assert deviation == pytest.approx(np.sqrt(np.mean(inner**2)), rel=1e-8)
    assert least_of(path, FIRST, level) <= mu_s.min()


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    st.integers(0, 200), st.sampled_from([1.0, -1.0]), st.sampled_from(SCATTERS), st.floats(0.2, 5.0),
    st.floats(-8.0, -4.0), st.sampled_from([LAW, CoulombLaw(0.3, 0.4), KINKED]), st.floats(0.0, 200.0),
)  # fmt: skip
def test_error_of_a_step_is_estimated(seed, sigma, scatter, speed, exponent, law, excitation):
    """Property: X and X' differ by some estimates from steps that end at every node, driven or not."""
    p = coefficients(Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0, excitation, 450.0), law, scatter)
    path = Path(rough(seed, 1.0 if scatter == "additive" else 3.0), 0, SPACING, True)
    u, s = V - sigma * speed * V, FIRST * SPACING
    here = branch_at(u, sigma, p)
    y = slip_state(0.3, 0.1 * F, u, s, sigma, piece_at(path, s + 0.5 * SPACING), here.p)
    end, error, level, _ = wide_step(y, len(WIDTHS) - 1, True, sigma, here, path, p, 10.0**exponent, 9.0)
    if level >= 0:
        run = slip(
            y, -1.0, (1e-3, -1000), True, sigma, path, p, 1e-13, Horizon(end.tau, 9999), Samples(1.0, NONE, NONE)
        )
        allowed = 10.0**exponent * (end.tau - y.tau) * F
        assert max(abs(end.x - run.y.x), abs(end.u - run.y.u)) < 5.0 * error + 0.2 * allowed


@pytest.mark.parametrize("scatter", SCATTERS)
@pytest.mark.parametrize(("tolerance", "steps"), [(1e-4, 60), (1e-6, 160), (1e-8, 900)])
def test_motion_on_rough_paths(tolerance, steps, scatter):
    """Events and samples agree with a tolerance of 1e-12, at which hardly a step spans two nodes; some 670 are passed.

    Errors of X in a slip of five units of tau add up to five tolerances of F + |X|, 7 of F.
    """
    taken = []
    for seed in range(6):
        nodes = rough(seed, 1.0 if scatter == "additive" else 2.5)
        run = STUDY, LAW, nodes, SPACING, 1.1
        start = F * 0.4 * (1.0 + nodes[0] / (0.4 if scatter == "additive" else 1.0)) - 0.34 * V
        cycle, drawn = (f(*run, MotionOptions(tolerance, scatter=scatter), start) for f in (simulate, trajectory))
        exact = trajectory(*run, MotionOptions(1e-12, scatter=scatter), start)
        assert cycle.kind.tolist() == exact.motion.kind.tolist()
        assert cycle.backwards.tolist() == exact.motion.backwards.tolist()
        assert ends(cycle)[0, 1] == pytest.approx(ends(exact.motion)[0, 1], abs=7.0 * tolerance * F)
        assert drawn.position == pytest.approx(exact.position, abs=7.0 * tolerance * F)
        assert drawn.motion.steps == cycle.steps
        taken.append(cycle.steps)
    assert np.mean(taken) < steps


def test_no_wide_step_where_the_equation_changes():
    """Each case alone: the same state steps over nodes where nothing changes."""
    path = Path(rough(3), 0, SPACING, True)

    def level(w=3.0, at=FIRST, law=LAW, backwards=False, tau_end=9.0, path=path):
        p, s = coefficients(STUDY, law), at * SPACING
        here = branch_at(V - w * V, 1.0, p)
        y = slip_state(0.0, 0.1 * F, V - w * V, s, 1.0, piece_at(path, s + 0.5 * SPACING), here.p)
        return wide_step(y, WIDE, backwards, 1.0, here, path, p, 1e-4, tau_end)[2]

    assert level() >= WIDE
    assert level(at=0) < 0  # there is no node before the first
    assert level(at=998) < 0  # the last node but one
    assert level(path=path._replace(nodes=path.nodes - 0.4)) < 0  # friction would be negative
    assert level(path=path._replace(least=-1.0)) >= WIDE  # elsewhere on the path
    assert level(tau_end=1e-3) < 0
    assert 0 <= level(w=0.9999) < WIDE  # X' = 0 lies within longer steps, at their start or end
    assert level(w=0.9999, backwards=True) >= WIDE
    assert 0 <= level(law=KINKED) < WIDE  # the speed is 2.844 m/s
    assert level(law=KINKED, w=5.0) >= WIDE
