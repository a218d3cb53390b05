"""Block pivoting: against enumeration, on random contacts, and its failures."""

from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.contact import dense_solver
from roughslip.contact.influence import Influence
from roughslip.errors import ConvergenceError
from roughslip.grid import Grid


def random_matrix(rng: np.random.Generator, n: int, decades: float) -> np.ndarray:
    """Symmetric positive definite with random eigenvectors and eigenvalues 1 to 10^-decades."""
    vectors = np.linalg.qr(rng.standard_normal((n, n)))[0]
    matrix = (vectors * 10 ** np.linspace(0, -decades, n)) @ vectors.T
    return (matrix + matrix.T) / 2


def by_enumeration(matrix: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Try every set of positive unknowns."""
    n = load.size
    for chosen in product([False, True], repeat=n):
        pressed = np.array(chosen)
        x = np.zeros(n)
        x[pressed] = np.linalg.solve(matrix[np.ix_(pressed, pressed)], load[pressed])
        if np.all(x >= 0) and np.all((matrix @ x - load)[~pressed] >= 0):
            return x
    raise AssertionError("a positive definite problem has a solution")


@pytest.mark.parametrize("seed", range(20))
def test_small_problems_by_enumeration(seed: int) -> None:
    """Any positive definite matrix, not only influence matrices. Condition 100: 1e-12 leaves two digits."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 8))
    matrix, load = random_matrix(rng, n, 2.0), rng.standard_normal(n)
    x, _, found = dense_solver.complementary_solution(matrix, load)
    assert found
    np.testing.assert_allclose(x, by_enumeration(matrix, load), rtol=0, atol=1e-12 * np.abs(x).max(initial=1.0))


@pytest.mark.slow
def test_single_exchanges_end_what_block_exchanges_do_not() -> None:
    """Ill-conditioned problems in which the number of violations stands still for longer than the patience."""
    longest = 0
    for seed in range(300):
        rng = np.random.default_rng([7, seed])
        matrix, load = random_matrix(rng, 11, 5.0), rng.standard_normal(11)
        x, factors, found = dense_solver.complementary_solution(matrix, load)
        misfit = np.minimum(x * np.diag(matrix), matrix @ x - load)
        assert found
        assert np.abs(misfit).max() <= 1e-10 * np.abs(load).max()  # condition 1e5
        longest = max(longest, factors)
    assert longest > 2 * dense_solver.PATIENCE


def test_matrix_that_is_not_positive_definite_is_reported() -> None:
    _, _, found = dense_solver.complementary_solution(np.array([[-1.0]]), np.array([1.0]))
    assert not found


def test_failure_is_a_typed_error(monkeypatch: pytest.MonkeyPatch) -> None:
    influence = Influence(Grid(2, 2, 1.0, 1.0), 1.0)
    monkeypatch.setattr(dense_solver, "_pressures", lambda coefficients, load: (np.zeros(load.shape), 7, False))
    with pytest.raises(ConvergenceError, match="set of pressed nodes") as raised:
        dense_solver.solve(influence, np.ones((2, 2)))
    assert raised.value.work == 7
    assert raised.value.residual == 1.0  # no pressure at all: min(gap, 0) = -u_bar


@settings(derandomize=True, deadline=None, max_examples=150)
@given(
    shape=st.tuples(st.integers(1, 16), st.integers(1, 16)),
    aspect=st.floats(-2, 2).map(lambda decades: 10.0**decades),
    penetration=st.sampled_from([-2.0, -1.0, 0.0, 1.0, 2.0, 5.0, 1e4]),
    levels=st.sampled_from([0, 1, 3]),
    seed=st.integers(0, 2**32 - 1),
)
def test_contact_conditions_to_rounding(
    shape: tuple[int, int], aspect: float, penetration: float, levels: int, seed: int
) -> None:
    """Light to full contact on any cells. Levels other than 0 are stepped surfaces, full of ties."""
    influence = Influence(Grid(*shape, 1.0, aspect), 1.0)
    heights = np.random.default_rng(seed).standard_normal(shape)
    interference = (np.round(heights * levels) / levels if levels else heights) + penetration
    if not np.any(interference > 0):
        return
    pressure, _ = dense_solver.solve(influence, interference)
    gap = influence.apply(pressure) - interference
    rounding = 1e-14 * interference.max()  # 1.3e-15 of the norm was the worst of 60 000
    assert np.all(pressure >= 0)
    assert np.all(gap >= -rounding)
    assert np.all(np.abs(gap[pressure > 0]) <= rounding)
