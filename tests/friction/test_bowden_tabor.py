import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ParameterError
from roughslip.friction.bowden_tabor import friction_coefficient, window_sums

ROUNDING = 2.0**-53


@settings(derandomize=True, max_examples=60, deadline=None)
@given(
    columns=st.lists(st.floats(-1e6, 1e6, allow_subnormal=False), min_size=1, max_size=40),
    window=st.integers(1, 40),
    stride=st.integers(1, 45),
)
def test_window_sums_are_the_plain_sums_within_the_stated_error(columns: list[float], window: int, stride: int) -> None:
    window = min(window, len(columns))
    sums = window_sums(np.array(columns), window, stride)
    exact = [math.fsum(columns[i : i + window]) for i in range(0, len(columns) - window + 1, stride)]
    assert len(sums) == len(exact)
    # the stated bound, and fsum's own last rounding
    bound = (window + 1) * ROUNDING * math.fsum(map(abs, columns)) * (1 + 1e-9)
    assert np.all(np.abs(sums - exact) <= bound + ROUNDING * np.abs(exact))


def test_window_sums_of_a_strip_do_not_depend_on_other_strips() -> None:
    columns = np.random.default_rng(1).random((5, 3, 97))
    together = window_sums(columns, 20, 7)
    assert together.shape == (5, 3, 12)
    for level in range(5):
        for strip in range(3):
            alone = window_sums(columns[level, strip].copy(), 20, 7)
            assert np.array_equal(together[level, strip], alone)


def test_windows_without_contact_sum_to_exactly_zero_behind_heavy_ones() -> None:
    columns = np.concatenate((np.full(10, 1e9 / 3.0), np.zeros(10), np.full(5, 1e-9 / 3.0)))
    sums = window_sums(columns, 5, 1)
    assert np.all(sums[10:16] == 0.0)
    assert np.all(sums >= 0.0)


@pytest.mark.parametrize(("window", "stride"), [(0, 1), (11, 1), (5, 0)])
def test_windows_that_do_not_fit_are_refused(window: int, stride: int) -> None:
    with pytest.raises(ParameterError, match="does not fit"):
        window_sums(np.ones(10), window, stride)


def test_nan_in_column_sums_is_refused() -> None:
    with pytest.raises(ParameterError, match="finite"):
        window_sums(np.array([1.0, np.nan]), 1, 1)


def test_hertz_contact_has_mu_inversely_proportional_to_its_radius() -> None:
    # Johnson, Contact Mechanics, 1985, eq. 4.22: N = 4 E* a^3 / (3 R), A = pi a^2
    radius, modulus, shear = 1e-3, 115e9, 2e9
    a = np.geomspace(1e-7, 1e-5, 9)
    mu, valid = friction_coefficient(math.pi * a**2, 4.0 * modulus * a**3 / (3.0 * radius), shear, 1e-15)
    assert valid.all()
    # a handful of roundings on each side
    np.testing.assert_allclose(mu, 3.0 * math.pi * radius * shear / (4.0 * modulus * a), rtol=1e-14)


def test_fully_plastic_contact_has_the_ratio_of_shear_strength_to_hardness() -> None:
    area = np.random.default_rng(2).random((4, 6)) + 0.1
    mu, _ = friction_coefficient(area, 6e9 * area, 1.2e9, 1e-3)
    np.testing.assert_allclose(mu, 0.2, rtol=4 * ROUNDING * 2)


def test_mu_scales_with_shear_strength_and_not_with_the_unit_of_force_and_area() -> None:
    rng = np.random.default_rng(3)
    area, force = rng.random((2, 5, 7)) + 0.1
    mu, _ = friction_coefficient(area, force, 3.0, 0.05)
    # powers of two scale without rounding
    assert np.array_equal(friction_coefficient(area, force, 12.0, 0.05)[0], 4.0 * mu)
    assert np.array_equal(friction_coefficient(8.0 * area, 8.0 * force, 3.0, 0.4)[0], mu)


def test_windows_below_the_least_area_are_marked_and_never_nan() -> None:
    area = np.array([[0.0, 0.5, 1.0], [2.0, 0.0, 0.999]])
    force = np.array([[0.0, 1e-300, 1.0], [4.0, 0.0, 1.0]])
    mu, valid = friction_coefficient(area, force, 1.0, 1.0)
    assert valid.tolist() == [[False, False, True], [True, False, False]]
    assert mu.tolist() == [[0.0, 0.0, 1.0], [0.5, 0.0, 0.0]]


def test_faults_are_refused_with_a_reason() -> None:
    one = np.ones((1, 2))
    with pytest.raises(ParameterError, match="no normal force"):
        friction_coefficient(one, np.array([[1.0, 0.0]]), 1.0, 0.5)
    with pytest.raises(ParameterError, match="finite"):
        friction_coefficient(one, np.array([[1.0, np.inf]]), 1.0, 0.5)
    with pytest.raises(ParameterError, match="not negative"):
        friction_coefficient(-one, one, 1.0, 0.5)
    with pytest.raises(ParameterError, match="one shape"):
        friction_coefficient(one, np.ones(2), 1.0, 0.5)
    with pytest.raises(ParameterError, match="least contact area"):
        friction_coefficient(one, one, 1.0, 0.0)
    with pytest.raises(ParameterError, match="shear strength"):
        friction_coefficient(one, one, np.nan, 0.5)
