"""Fits without one or two groups, against fits that never saw them."""

import numpy as np
import pytest

from roughslip.chaos.leave_group_out import group_sums, left_out_predictions, without_one, without_two
from roughslip.errors import IllPosedError

GROUPS = 5


def problem():
    generator = np.random.default_rng(2001)
    rows, values = generator.standard_normal((60, 4)), generator.standard_normal(60)
    return rows, values, generator.uniform(0.2, 1.0, 60), np.arange(60) % GROUPS


def fitted(rows, values, weights, keep):
    root = np.sqrt(weights[keep])
    return np.linalg.lstsq(root[:, None] * rows[keep], root * values[keep], rcond=None)[0]


def test_fits_without_groups_are_fits_to_the_others():
    rows, values, weights, group = problem()
    sums = group_sums(rows, weights, weights * values, group, GROUPS)
    one, two = without_one(*sums), without_two(*sums)
    for g in range(1 + GROUPS):
        np.testing.assert_allclose(one[g], fitted(rows, values, weights, group != g - 1), rtol=0, atol=1e-13)
        for h in range(1 + GROUPS):
            keep = (group != g - 1) & (group != h - 1)
            np.testing.assert_allclose(two[g, h], fitted(rows, values, weights, keep), rtol=0, atol=1e-13)


def test_predictions_have_not_seen_the_group_of_their_sample():
    rows, values, weights, group = problem()
    sums = group_sums(rows, weights, weights * values, group, GROUPS)
    plain, nested = (left_out_predictions(rows, without(*sums), group) for without in (without_one, without_two))
    np.testing.assert_allclose(nested[0], plain, atol=1e-14)
    for k in (0, 17, 58):
        np.testing.assert_allclose(plain[k], rows[k] @ fitted(rows, values, weights, group != group[k]), atol=1e-13)
        keep = (group != group[k]) & (group != 3)
        np.testing.assert_allclose(nested[4, k], rows[k] @ fitted(rows, values, weights, keep), atol=1e-13)


def test_scales_of_terms_do_not_matter():
    """Normal equations square a condition number, unless their columns are of one size."""
    rows, values, weights, group = problem()
    scale = np.array([1.0, 1e-12, 1e12, 1e3])
    plain, scaled = (
        without_one(*group_sums(r, weights, weights * values, group, GROUPS)) for r in (rows, rows * scale)
    )
    np.testing.assert_allclose(scaled * scale, plain, rtol=1e-11)


@pytest.mark.parametrize("column", ["zero", "only in one group", "twice"])
def test_undetermined_coefficients_are_refused(column):
    rows, values, weights, group = problem()
    extra = {"zero": 0 * values, "only in one group": np.where(group == 2, 1.0, 0.0), "twice": rows[:, 1]}[column]
    with pytest.raises(IllPosedError, match="undetermined"):
        without_one(*group_sums(np.column_stack([rows, extra]), weights, weights * values, group, GROUPS))
