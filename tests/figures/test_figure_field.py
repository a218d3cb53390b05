"""The figure of the whole field: what it draws is stored, twice the same bytes, and nothing is cut."""

from itertools import pairwise

import numpy as np
import pytest

from roughslip.figures.figure_field import DRAWN, figure_field
from tests.figures.drawn import assert_nothing_is_cut, assert_stored_and_the_same_bytes


def result(nodes=8, modes=20, scale=1e8):
    """Made up: fields that rise towards an edge, shares that fall with the mode."""
    x = np.linspace(1e-6, 1e-4, nodes)
    field = np.add.outer(x, np.zeros(nodes)) / x[-1]
    share = 0.4 / np.arange(1, modes + 1)
    found = {"x": x, "y": x, "missed": 0.1 + 0.05 * field, "leading_share": 0.3 * field, "mean_gain": 5 + field}
    for name, unit in (("contact", 0.2), ("mean", scale), ("deviation", 2 * scale)):
        found |= {name: unit * (0.5 + field), f"{name}_error": 0.01 * unit * (0.5 + field)}
    for name in ("first", "total"):
        found |= {f"sobol_{name}": share, f"sobol_{name}_error": 0.1 * share}
    for number, name in enumerate(("solved", "expected", "drawn")):
        found[f"{name}_pressure"] = np.stack([(number + 1) * scale * field, np.zeros_like(field)])
    return found


CASES = {"pascals": result(scale=1e6), "gigapascals": result(scale=5e9), "large": result(nodes=64, modes=300)}


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_cut_and_no_title_leaves_its_panel(case):
    figure = figure_field(CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)
    for row in np.array(figure.axes[:9]).reshape(3, 3):
        for axes, after in pairwise(row):
            assert axes._left_title.get_window_extent().x1 < after._left_title.get_window_extent().x0


def test_what_is_drawn_is_stored_and_the_same_bytes(tmp_path):
    assert_stored_and_the_same_bytes(figure_field, result(), DRAWN, tmp_path)


def test_the_stored_numbers_are_drawn_in_the_units_that_are_told():
    arrays = result()
    axes = figure_field(arrays).axes
    units = {0: ("contact", 100), 1: ("mean", 1e-6), 2: ("deviation", 1e-6)}
    for place, (name, unit) in units.items():
        np.testing.assert_allclose(axes[place].images[0].get_array(), unit * arrays[name].T)
        assert axes[place].get_title(loc="left").endswith("±1.0 %")
    np.testing.assert_allclose(axes[4].images[0].get_array(), 100 * (1 - arrays["missed"].T))
    for place, name in ((6, "solved"), (7, "expected"), (8, "drawn")):
        np.testing.assert_allclose(axes[place].images[0].get_array(), 1e-6 * arrays[f"{name}_pressure"][0].T)
        assert axes[place].images[0].get_clim() == (0.0, pytest.approx(300.0))  # one scale for the three
    np.testing.assert_allclose(axes[5].lines[0].get_ydata(), 100 * arrays["sobol_total"])
    assert "0.3 to 30.0 %" in axes[5].get_legend().get_title().get_text()
