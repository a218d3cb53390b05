"""Block pivoting against enumeration; conjugate gradients against block pivoting; the residual; nested starts."""

import math
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.contact import conjugate_gradients, dense_solver, kernels, nested
from roughslip.contact.conjugate_gradients import Problem, Solution
from roughslip.contact.influence import Influence
from roughslip.contact.kernels import relative_residual
from roughslip.errors import ConvergenceError
from roughslip.grid import Grid


def found(influence: Influence, interference: np.ndarray, tolerance: float, guess=None) -> Solution:
    return conjugate_gradients.solve(Problem(influence, interference), tolerance, guess)


@pytest.mark.parametrize(
    ("shape", "length", "penetration"),
    [((40, 30), 5.0, 0.0), ((120, 10), 0.0, 1.6), ((30, 30), 3.0, 6.0), ((1, 90), 2.0, 0.5), ((2, 60), 0.0, 0.0)],
)
def test_agrees_with_the_dense_method(surface, shape: tuple[int, int], length: float, penetration: float) -> None:
    """The error of the pressure is at most |B^-1| |B| < 100 times the residual; the sets are the same."""
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0)
    interference = surface(shape, length, 3) + penetration
    exact, _ = dense_solver.solve(influence, interference)
    ours = found(influence, interference, 1e-12)
    np.testing.assert_allclose(ours.pressure, exact, rtol=0, atol=1e-10 * exact.max())
    assert np.array_equal(ours.pressure > 0, exact > 0)
    np.testing.assert_array_equal(ours.gap, influence.apply(ours.pressure) - interference)


@pytest.mark.parametrize("aspect", [0.02, 1.0, 50.0])
@pytest.mark.parametrize("penetration", [-2.0, 0.0, 1.6, 100.0])
def test_any_cells_any_depth(surface, aspect: float, penetration: float) -> None:
    """Measured at most 75 products; cells of aspect 1 take at most 45."""
    influence = Influence(Grid(64, 48, 1.0, aspect), 1.0)
    interference = surface((64, 48), 5.0, 4) + penetration
    ours = found(influence, interference, 1e-10)
    assert relative_residual(ours.gap, ours.pressure, influence.diagonal, interference) <= 1e-10
    assert ours.products <= (50 if aspect == 1 else 100)


def test_loose_tolerance_leaves_no_stragglers(surface) -> None:
    """No node is both pressed and, by B_00 p < gap, on its way out: it would count as contact area."""
    influence = Influence(Grid(40, 24, 1.0, 1.0), 1.0)
    ours = found(influence, surface((40, 24), 3.0, 6) + 1.0, 1e-2)
    assert not np.any((ours.pressure > 0) & (influence.diagonal * ours.pressure < ours.gap))


@pytest.mark.parametrize(("cap", "loaded"), [(math.inf, False), (0.5, False), (math.inf, True)])
def test_energy_falls_at_every_step_of_one_product(surface, cap: float, loaded: bool) -> None:
    """Also where the clip changes a step. p'Bp/2 - p'u_bar in double precision, beyond the rounding of single products;
    the energy is of second order in the error, so the last steps fall below it."""
    influence = Influence(Grid(40, 36, 1.0, 1.0), 1.0)
    u_bar = surface((40, 36), 4.0, 9)
    iteration = conjugate_gradients._Iteration(Problem(influence, u_bar, cap, 100.0 if loaded else None), None)
    energies = []
    for _ in range(15):
        pressure = iteration.pressure.copy()
        energies.append(float(np.sum(pressure * (influence.apply(pressure) / 2 - u_bar))))
        products = iteration.products
        iteration.advance(iteration.assess(), 1e-10)
        assert iteration.products == products + 1
        assert np.all((iteration.pressure >= 0) & (iteration.pressure <= cap))
    assert np.all(np.diff(energies) <= 1e-6 * abs(energies[-1]))
    assert energies[-1] < energies[3] < energies[0]


@pytest.mark.parametrize("tolerance", [1e-6, 1e-13])
def test_single_precision_leaves_no_error(surface, tolerance: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Residuals below single precision are reached, with about the products that double precision takes."""
    influence = Influence(Grid(48, 48, 1.0, 1.0), 1.0)
    interference = surface((48, 48), 5.0, 6)
    rounded = found(influence, interference, tolerance)
    assert rounded.residual <= tolerance
    whole = influence.apply
    monkeypatch.setattr(influence, "apply", lambda pressure, result=None, rounded=False: whole(pressure, result))
    exact = found(influence, interference, tolerance)
    assert rounded.products <= exact.products + 6
    np.testing.assert_allclose(rounded.pressure, exact.pressure, rtol=0, atol=100 * tolerance * exact.pressure.max())


def test_initial_pressure_saves_work(surface) -> None:
    influence = Influence(Grid(48, 48, 1.0, 1.0), 1.0)
    interference = surface((48, 48), 5.0, 6)
    cold = found(influence, interference, 1e-10)
    warm = found(influence, interference, 1e-10, cold.pressure)
    assert warm.products <= 3  # for the guess, for the fresh gap, and if rounding asks for a step
    np.testing.assert_allclose(warm.pressure, cold.pressure, rtol=0, atol=1e-8 * cold.pressure.max())
    problem, lifted = Problem(influence, interference), influence.apply(cold.pressure)
    known = conjugate_gradients.solve(problem, 1e-10, cold.pressure, displacement=lifted)
    assert known.products == warm.products - 1
    np.testing.assert_array_equal(known.pressure, warm.pressure)
    bad = 1e9 * cold.pressure, np.where(interference < 0.5, 1.0, 0.0), np.where(interference < 0, 1.0, 0.0)
    for guess in bad:
        poor = found(influence, interference, 1e-10, guess)
        assert poor.products <= cold.products + 5  # neither size nor place of a bad guess costs much
        np.testing.assert_allclose(poor.pressure, cold.pressure, rtol=0, atol=1e-8 * cold.pressure.max())


def test_limit_is_a_typed_error(surface, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(conjugate_gradients, "PRODUCT_LIMIT", 10)
    influence = Influence(Grid(48, 48, 1.0, 1.0), 1.0)
    with pytest.raises(ConvergenceError, match="larger tolerance") as raised:
        found(influence, surface((48, 48), 5.0, 6), 1e-10)
    assert 1e-10 < raised.value.residual < 1
    assert raised.value.work in (10, 11)


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
    direction[rng.random((5, 6)) < 0.3] = 0.0  # so that trial pressures of exactly zero, which are not moved, are among
    free = rng.random((5, 6)) < 0.7
    trial = pressure + 0.7 * direction
    moved = np.full((5, 6), True) if everywhere else free & (trial > 0)
    held = np.where(trial > 0, np.inf if cap < np.inf else 0.0, trial)  # what is not moved has the cap or nothing
    trial = np.where(moved, trial, held)
    fixed = np.clip(trial[~moved], 0, cap).sum()
    force = fixed + share * moved.sum() * min(cap, 5.0)
    if not moved.any():
        force = fixed + 1.0
    shift, met = kernels.shift_to_sum(trial, cap, force, everywhere)
    assert met == moved.any()
    if met:
        assert np.clip(trial + shift * moved, 0, cap).sum() == pytest.approx(force, rel=1e-12)


def test_the_plane_of_a_load_without_nodes_between_the_bounds() -> None:
    """All at the cap of 1 Pa or off contact: half way between the gaps that must close and those that must not."""
    influence = Influence(Grid(1, 4, 1.0, 1.0), 1.0)
    problem, gap = Problem(influence, np.zeros((1, 4)), 1.0, 2.0), np.array([[-4.0, -2.0, 3.0, 8.0]])
    assert problem.plane(np.array([[1.0, 1.0, 0.0, 0.0]]), gap) == -0.5
    assert problem.plane(np.ones((1, 4)), gap) == -8.0
    assert problem.plane(np.array([[1.0, 0.5, 0.25, 0.0]]), gap) == -0.5  # the mean gap of those between
    assert math.isnan(problem.plane(np.zeros((1, 4)), gap))


def test_each_way_of_missing_the_conditions() -> None:
    """Five nodes: pressed across a small gap, pressed across a large gap, penetration, tension, and a good one."""
    diagonal = 0.5
    gap = np.array([[0.1, 3.0, -0.2, 1.0, 0.0]])
    pressure = np.array([[4.0, 0.6, 1.0, -0.8, 7.0]])
    unmet = np.array([0.1, 0.3, -0.2, -0.4, 0.0])
    interference = np.array([[3.0, -9.0, 4.0, -1.0, 0.0]])  # only what is positive counts: 5
    expected = np.linalg.norm(unmet) / 5
    assert relative_residual(gap, pressure, diagonal, interference) == pytest.approx(expected, rel=1e-14)


@pytest.mark.parametrize(
    ("shape", "periodic"), [((96, 96), False), ((97, 81), False), ((400, 21), False), ((96, 96), True)]
)
@pytest.mark.parametrize("loaded", [False, True])
def test_start_saves_products(surface, shape: tuple[int, int], periodic: bool, loaded: bool, monkeypatch) -> None:
    """Odd meshes too. It saves products in which the contact is found, one to ten of some thirty."""
    if periodic and not loaded:
        pytest.skip("a periodic cell has no fixed plane")
    monkeypatch.setattr(nested, "COARSEST", 32 * 32)
    influence = Influence(Grid(*shape, 1.0, 1.0), 1.0, periodic)
    problem = Problem(influence, surface(shape, 8.0, 1), math.inf, 0.05 * shape[0] * shape[1] if loaded else None)
    guess = nested.guess(problem)
    assert guess is not None
    assert guess.shape == shape
    assert (guess >= 0).all()
    cold, warm = conjugate_gradients.solve(problem, 1e-10), conjugate_gradients.solve(problem, 1e-10, guess)
    assert warm.products <= cold.products - 1
    np.testing.assert_allclose(warm.pressure, cold.pressure, rtol=0, atol=1e-8 * cold.pressure.max())
    if not loaded:
        assert not guess[problem.interference <= 0].any()


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
