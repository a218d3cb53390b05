"""What solves and motions left out: counts of known kinds."""

import math
from itertools import islice

import numpy as np
import pytest

from roughslip.chaos.hermite import multi_indices
from roughslip.contact.influence import DIRECT_SUM_LIMIT, Influence
from roughslip.contact.solve import solve, sweep
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import LOOPS, counts_by_period
from roughslip.oscillator.motion import ensemble_counts
from roughslip.oscillator.path import KeptPath
from roughslip.stages.runtime import skip_counts, skip_reasons


def summit(n: int, radius: float) -> tuple[Influence, np.ndarray]:
    """A paraboloid that stands over the plane on a disc of so many nodes' radius, in the middle of n x n."""
    x = np.arange(n) - n // 2
    return Influence(Grid(n, n, 1e-6, 1e-6), 1e11), 1e-9 * (radius**2 - x[:, None] ** 2 - x**2)


def counted(*solutions) -> dict[str, int]:
    counts = skip_counts.nothing_yet()
    for solution in solutions:
        skip_counts.count_solve(counts, solution)
    return {name: number for name, number in counts.items() if number}


def test_no_contact_is_no_solve():
    influence, gap = summit(16, 3.0)
    assert counted(solve(influence, gap - 1e-6)) == {skip_reasons.NO_CONTACT: 1}
    assert set(skip_counts.nothing_yet()) == set(skip_reasons.OF_SOLVES)


def test_few_nodes_are_solved_alone_and_summed_one_by_one():
    influence, u_bar = summit(16, 3.0)
    found = solve(influence, u_bar)
    inside = np.count_nonzero(u_bar > 0)
    assert (found.method, found.nodes, found.start) == ("dense", inside, "none")
    assert counted(found) == {skip_reasons.BELOW: 256 - inside, skip_reasons.SUMMED: 1}
    influence, u_bar = summit(32, 9.0)
    found = solve(influence, u_bar)
    assert np.count_nonzero(found.pressure) > DIRECT_SUM_LIMIT
    assert counted(found, found) == {skip_reasons.BELOW: 2 * (1024 - np.count_nonzero(u_bar > 0))}


def test_what_cannot_touch_is_cropped():
    """A square of 57 nodes holds the disc; 57^2 < 64^2 starts from nothing."""
    influence, u_bar = summit(128, 28.5)
    found = solve(influence, u_bar)
    assert (found.method, found.nodes, found.start) == ("fft", 57**2, "zero")
    assert counted(found) == {skip_reasons.CROPPED: 128**2 - 57**2}


def test_sweeps_start_warm_and_large_meshes_from_coarser_ones():
    influence, u_bar = summit(128, 90.0)
    found = sweep(influence, u_bar, [0.0, -1e-7, -2e-7])
    assert [one.start for one in found] == ["nested", "given", "given"]
    assert counted(*found) == {skip_reasons.NESTED: 1, skip_reasons.WARM: 2}


def test_periods_that_are_counted_and_not_followed():
    """A run by the period ends behind its first cycle: half a period of stick, and LOOPS of slip at D = 0.17."""
    belt, law = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0), StribeckLaw(0.3)
    followed = counts_by_period(belt, law, 100.0, [0.17, 0.17])
    assert ensemble_counts(belt, law, None, 0.0, 100.0, [0.17, 0.17]).periods == 200.0
    first = (belt.F * law.static - 2 * belt.damping_ratio * belt.V) / belt.V / (2 * math.pi)
    assert followed.periods == pytest.approx(2 * (first + LOOPS / math.sqrt(1 - 0.17**2)))


def test_nodes_that_runs_have_asked_for():
    pieces = [np.zeros(10), np.zeros(7), np.zeros(5)]
    path = KeptPath(pieces)
    assert path.nodes == 0
    for _ in range(2):
        np.concatenate(list(islice(path, 2)))
        assert path.nodes == 17


def test_terms_that_a_basis_leaves_out():
    assert skip_reasons.forbidden_terms(multi_indices(8, 3), 3) == 0
    assert skip_reasons.forbidden_terms(multi_indices(8, 3)[:75], 3) == 90
