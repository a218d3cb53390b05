"""The figure of the stick-slip map: what it draws is stored, twice the same bytes, and nothing is cut."""

import numpy as np
import pytest

from roughslip.figures.figure_map import DRAWN, figure_map
from tests.figures.drawn import assert_nothing_is_cut, assert_stored_and_the_same_bytes, with_interval


def result(points=12, scatters=(0.25, 0.5, 1.0, 2.0)):
    """Made up: a limit that falls with the velocity, lifetimes that cross near it."""
    velocity, damping = np.geomspace(0.1, 2.0, points), np.linspace(0, 0.6, points)
    limit = 0.5 / (1 + velocity)
    share = 1 / (1 + np.exp((damping - limit[:, None]) / 0.03))
    deviation = 0.05 * np.array(scatters)
    grid = 0.32 + deviation[:, None] * np.linspace(-3, 3, points)
    time = np.linspace(0, 50, 9)
    lifetime, waiting = np.exp(-(grid - 0.32) / 0.03 + 2), np.exp((grid - 0.32) / 0.03 + 2)
    found = {
        "belt_velocity": velocity,
        "damping_ratio": damping,
        "probability": share,
        "hopf_damping": 0.8 * limit,
        "existence_limit": np.where(velocity > 1.5, np.nan, limit),
        "nominal_damping": np.array(0.17),
        "nominal_velocity": np.array(0.948),
        "map_runs": np.array(20),
        "scatter_factor": np.array(scatters),
        "friction_deviation": deviation,
        "survival_damping": grid,
        "survival_time": time,
        "survival_limit": np.array(0.3244),
        "survival_hopf": np.array(0.2311),
        "band_level": np.array([0.9, 0.5, 0.1]),
        "band_start": np.array(["from rest on the belt", "from steady sliding"]),
    }
    curve = np.exp(-time / lifetime[..., None])
    found |= with_interval("survival_curve", curve, 0.02) | with_interval("waiting", waiting, 0.2 * waiting)
    found |= with_interval("lifetime", np.where(lifetime > 1e3, np.nan, lifetime), 0.2 * lifetime)
    found["lifetime_low"] = 0.8 * lifetime
    band = 0.3 + deviation[:, None, None] * np.array([[-1, 0, 1], [-1.5, -0.5, 0.5]])
    return found | with_interval("band", band, 0.01)


CASES = {
    "four scatters": result(),
    "one scatter": result(5, (1.0,)),
    "nothing decided": result() | {"survival_curve": np.ones((4, 12, 9)), "existence_limit": np.full(12, np.nan)},
}


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_cut_and_no_title_leaves_its_panel(case):
    figure = figure_map(CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)
    for left, right in ((0, 1), (2, 3)):
        axes, after = figure.axes[left], figure.axes[right]
        assert axes._left_title.get_window_extent().x1 < after._left_title.get_window_extent().x0


def test_what_is_drawn_is_stored_and_the_same_bytes(tmp_path):
    assert_stored_and_the_same_bytes(figure_map, result(), DRAWN, tmp_path)


def test_the_stored_numbers_are_drawn():
    arrays = result()
    over, curves, lifetimes, band = figure_map(arrays).axes[:4]
    mesh = over.collections[0]
    np.testing.assert_allclose(mesh.get_array(), arrays["probability"])
    assert mesh.get_clim() == (0, 1)
    np.testing.assert_allclose(over.lines[0].get_xdata(), arrays["existence_limit"])
    np.testing.assert_allclose(over.lines[1].get_xdata(), arrays["hopf_damping"])
    assert (over.get_yscale(), over.lines[2].get_xdata()[0], over.lines[2].get_ydata()[0]) == ("log", 0.17, 0.948)
    *labels, scatter = [text.get_text() for text in curves.get_legend().get_texts()]
    assert scatter == f"std {arrays['friction_deviation'][2]:.3g}"
    places = [float(label.removeprefix("$D$ = ")) for label in labels]
    assert places == sorted(places)
    for line, place in zip(curves.lines[:-1], places, strict=True):
        column = np.argmin(np.abs(arrays["survival_damping"][2] - place))  # at the scene's own scatter
        np.testing.assert_allclose(line.get_ydata(), arrays["survival_curve"][2, column])
    np.testing.assert_allclose(lifetimes.lines[2].get_ydata(), arrays["waiting"][0])
    drawn = [line for line in band.lines if line.get_label().startswith(("from", "_"))]
    middles = [line.get_ydata() for line in drawn if len(line.get_ydata()) == 4 and line.get_marker() in "os"]
    for start, middle in enumerate(middles):
        np.testing.assert_allclose(middle, arrays["band"][:, start, 1])
