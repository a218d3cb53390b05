import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.contact import kernels


def test_sums() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.standard_normal((2, 7, 5))
    assert kernels.inner(a, b) == pytest.approx((a * b).sum(), rel=1e-14)
    assert kernels.total(a) == pytest.approx(a.sum(), rel=1e-14)
    assert kernels.positive_square(a, 0.3) == pytest.approx((np.maximum(a - 0.3, 0.0) ** 2).sum(), rel=1e-14)
    mean, count = kernels.mean_between(a, b, 0.5)
    between = (b > 0) & (b < 0.5)
    assert count == between.sum()
    assert mean == pytest.approx(a[between].mean(), rel=1e-14)


@pytest.mark.parametrize("cap", [math.inf, 0.6])
def test_assess(cap: float) -> None:
    """Free are pressed nodes that may give way, open ones that penetrate, and those at the cap that give way."""
    rng = np.random.default_rng(2)
    pressure, gap, misfit = np.clip(rng.standard_normal((9, 8)), 0, cap), rng.standard_normal((9, 8)), np.empty((9, 8))
    gap[0, :4], pressure[0, :4] = -0.1, min(cap, 1.0) / 2  # pressed, and not a misfit: free all the same
    told = np.zeros((9, 8), dtype=np.bool_)
    square = kernels.assess(pressure, gap, 0.1, 2.0, cap, misfit, told)
    w = gap + 0.1
    unmet = 2.0 * pressure - np.clip(2.0 * pressure - w, 0.0, 2.0 * cap)
    assert square == pytest.approx((unmet**2).sum(), rel=1e-14)
    free = ((pressure > 0) | (w < 0)) & ((pressure < cap) | (w > 0))
    assert np.array_equal(told, free)
    assert np.array_equal(misfit, np.where(free, -w, 0.0))


def test_steps() -> None:
    rng = np.random.default_rng(3)
    pressure, gap, product, descent = rng.random((4, 6, 7))
    free = rng.random((6, 7)) < 0.5
    misfit = np.where(free, rng.standard_normal((6, 7)), 0.0)
    direction = rng.standard_normal((6, 7))
    expected = np.where(free, descent + 0.5 * direction, 0.0)
    assert kernels.conjugate(descent, 0.5, direction, misfit, free) == pytest.approx(
        (misfit * expected).sum(), rel=1e-13
    )
    assert np.array_equal(direction, expected)
    new_pressure, new_gap, excess = np.empty((3, 6, 7))
    count = kernels.advance(pressure, gap, -1.5, direction, product, 1.2, 0.0, free, new_pressure, new_gap)
    trial = pressure - 1.5 * direction
    assert np.array_equal(new_pressure, np.clip(trial, 0.0, 1.2))
    assert np.array_equal(new_gap, gap - 1.5 * product)
    assert count == ((trial < 0) | (trial > 1.2)).sum() > 0
    kernels.clipped(pressure, -1.5, direction, new_pressure, excess)
    assert np.count_nonzero(excess) == count  # exactly zero elsewhere: few nodes are summed directly
    kernels.balance(direction, misfit**2)
    assert abs(direction.sum()) < 1e-13


@settings(derandomize=True, deadline=None, max_examples=200)
@given(
    seed=st.integers(0, 2**32 - 1),
    share=st.floats(0.01, 0.99),
    cap=st.sampled_from([math.inf, 0.3, 2.0]),
    everywhere=st.booleans(),
)
def test_shift_meets_the_sum(seed: int, share: float, cap: float, everywhere: bool) -> None:
    """Any sum between none and all nodes at the cap; without the nodes that are not moved, any that the others can."""
    rng = np.random.default_rng(seed)
    pressure, direction = np.clip(rng.standard_normal((5, 6)), 0, cap), rng.standard_normal((5, 6))
    free = rng.random((5, 6)) < 0.7
    trial = pressure + 0.7 * direction
    moved = np.full((5, 6), True) if everywhere else free & (trial > 0)
    fixed = np.clip(trial[~moved], 0, cap).sum()
    force = fixed + share * moved.sum() * min(cap, 5.0)
    if not moved.any():
        force = fixed + 1.0
    shift, met = kernels.shift_to_sum(pressure, 0.7, direction, cap, force, free, everywhere)
    assert met == moved.any()
    if met:
        assert np.clip(trial + shift * moved, 0, cap).sum() == pytest.approx(force, rel=1e-12)


def test_shift_that_cannot_meet_the_sum() -> None:
    """Two nodes at the cap cannot carry three times the cap."""
    pressure, free = np.array([[0.5, 0.7, 0.0]]), np.array([[True, True, False]])
    assert not kernels.shift_to_sum(pressure, 0.0, pressure, 1.0, 2.5, free, False)[1]
    shift, met = kernels.shift_to_sum(pressure, 0.0, pressure, 1.0, 2.5, free, True)
    assert met
    assert shift == pytest.approx(0.5)
