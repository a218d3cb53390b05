"""Figures of scans, of whole fields, of the stick-slip map and of several scenes: stored numbers, drawn in full."""

from itertools import pairwise

import numpy as np
import pytest

from roughslip.figures.figure3 import COMPARED, MOST, comparison
from roughslip.figures.figure_field import DRAWN as FIELD_DRAWN
from roughslip.figures.figure_field import figure_field
from roughslip.figures.figure_map import DRAWN as MAP_DRAWN
from roughslip.figures.figure_map import figure_map
from roughslip.figures.figure_scan import DRAWN as SCAN_DRAWN
from roughslip.figures.figure_scan import NUMBERS, OUTSIDE, figure_scan
from tests.figures.drawn import Recorded, assert_nothing_is_cut, assert_stored_and_the_same_bytes, with_interval


def sampled(name, value, spread):
    return {f"twin_{name}": np.asarray(value) + spread * np.linspace(-1, 1, 19)[(..., *[None] * np.ndim(value))]}


def scan_result(*, sufficient=1, fractal=2.3):
    """A surface of Sq 0.3 um with grooves along x, whose numbers lie in intervals of a tenth of them."""
    lag_x, lag_y = 1e-6 * np.arange(-30, 31), 1e-6 * np.arange(-10, 11)
    table = np.exp(-np.hypot(lag_x[:, None] / 1e-5, lag_y / 3e-6))
    edges = 6e-8 * np.arange(-20, 16)
    density = np.exp(-((edges[1:] / 3e-7) ** 2) / 2) / 3e-7 / np.sqrt(2 * np.pi)
    wavenumber = np.geomspace(1e5, 6e6, 20)
    power = 1e-24 / (1 + (wavenumber / 3e5) ** 3)
    heights = 3e-7 * np.random.default_rng(1).standard_normal((64, 48))
    values = dict(zip(NUMBERS, (3e-7, -0.6, 4.1, 1e-5, 3e-6, 0.01, fractal), strict=True))
    result = {
        "map": heights, "twin_map": heights[::-1],
        "map_x": 1e-6 * np.arange(0.5, 64), "map_y": 1e-6 * np.arange(0.5, 48),
        "lag_x": lag_x, "lag_y": lag_y, "density_edge": edges, "wavenumber": wavenumber, "sufficient": sufficient,
        **with_interval("correlation", table, 0.05),
        **with_interval("density", density, 0.05 / 3e-7),
        "power": power, "power_low": power / 2, "power_high": power * 2,
        **sampled("correlation_x", table[:, 10], 0.02),
        **sampled("correlation_y", table[30], 0.02),
        **sampled("density", density, 0.02 / 3e-7),
        "twin_power": np.outer(np.linspace(0.9, 1.1, 19), power),
    }  # fmt: skip
    for name, value in values.items():
        result |= with_interval(name, value, abs(value) / 10) | sampled(name, value, abs(value) / 5)
    return result


SCAN_CASES = {
    "whole": scan_result(),
    "small": scan_result(sufficient=0),
    "smooth": scan_result(fractal=-0.4),
    "without": scan_result(fractal=np.nan),
}


@pytest.mark.parametrize("case", SCAN_CASES)
def test_nothing_of_the_scan_is_cut(case):
    figure = figure_scan(SCAN_CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)


def test_the_scan_draws_the_stored_numbers():
    result = scan_result()
    figure = figure_scan(result)
    density, correlation, spectrum, numbers = figure.axes[2:6]
    lines = {line.get_label(): line.get_data() for line in correlation.lines}
    np.testing.assert_allclose(lines["scan, along x"], [1e6 * result["lag_x"][30:], result["correlation"][30:, 10]])
    np.testing.assert_allclose(lines["twins, along y"][1], result["twin_correlation_y"][:, 10:].mean(axis=0))
    np.testing.assert_allclose(density.lines[0].get_ydata(), 1e-6 * result["density"])
    np.testing.assert_allclose(spectrum.lines[1].get_ydata(), 1e24 * result["twin_power"].mean(axis=0))
    # twins spread to two half widths of the interval
    assert numbers.lines[1].get_xdata().max() == pytest.approx(2.0)
    assert [label.get_text() for label in numbers.get_yticklabels()] == [label for label, _, _ in NUMBERS.values()]
    # of 19 equally spaced over -2 to 2, nine lie within -1 to 1
    assert [text.get_text() for text in numbers.texts[:2]] == ["9 of 19", "0.3 µm (0.27 to 0.33)"]


def test_far_twins_stay_in_the_picture_and_no_dimension_is_made_up():
    result = scan_result(fractal=-0.4)
    result["twin_skewness"] = result["skewness"] + np.array([0.0, 99.0])
    numbers = figure_scan(result).axes[5]
    np.testing.assert_allclose(numbers.lines[3].get_xdata(), [0.0, OUTSIDE])
    assert "fractal dimension" not in [label.get_text() for label in numbers.get_yticklabels()]


def field_result(nodes=8, modes=20, scale=1e8):
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


FIELD_CASES = {
    "pascals": field_result(scale=1e6),
    "gigapascals": field_result(scale=5e9),
    "large": field_result(nodes=64, modes=300),
}


@pytest.mark.parametrize("case", FIELD_CASES)
def test_no_title_of_the_field_leaves_its_panel(case):
    figure = figure_field(FIELD_CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)
    for row in np.array(figure.axes[:9]).reshape(3, 3):
        for axes, after in pairwise(row):
            assert axes._left_title.get_window_extent().x1 < after._left_title.get_window_extent().x0


def test_the_field_draws_the_stored_numbers_in_its_units():
    arrays = field_result()
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


def map_result(points=12, scatters=(0.25, 0.5, 1.0, 2.0)):
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


MAP_CASES = {
    "four scatters": map_result(),
    "one scatter": map_result(5, (1.0,)),
    "nothing decided": map_result() | {"survival_curve": np.ones((4, 12, 9)), "existence_limit": np.full(12, np.nan)},
}


@pytest.mark.parametrize("case", MAP_CASES)
def test_no_title_of_the_map_leaves_its_panel(case):
    figure = figure_map(MAP_CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)
    for left, right in ((0, 1), (2, 3)):
        axes, after = figure.axes[left], figure.axes[right]
        assert axes._left_title.get_window_extent().x1 < after._left_title.get_window_extent().x0


def test_the_map_draws_the_stored_numbers():
    arrays = map_result()
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


def scene_result(scale, percentile=(5, 20, 50, 95)):
    """Made up: friction that falls with penetration, the expansion a hundredth above what was solved."""
    percentile = np.array(percentile, dtype=float)
    found = {"source": np.array(["solved", "expansion"]), "percentile": percentile}
    for name, row in (("mean", 0.4 - 0.001 * percentile), ("std", 0.1 / (1 + percentile / 10))):
        found |= with_interval(name, scale * row * np.array([[1.0], [1.01]]), 0.005)
        found |= with_interval(f"combined_{name}", scale * row, 0.002)
    return Recorded(found)


@pytest.mark.parametrize("count", [1, 3, MOST])
def test_every_scene_is_drawn_from_what_is_stored(count):
    results = {f"scene{number}": scene_result(1 + number) for number in range(count)}
    figure = comparison(results)
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == [*results, "solved contact", "expansion", "expansion as control"]
    for result in results.values():
        assert result.read == set(COMPARED)
    for axes, name in zip(figure.axes, ("mean", "std"), strict=True):
        for number, result in enumerate(results.values()):
            lines = axes.lines[3 * number : 3 * number + 3]
            expected = (result[f"combined_{name}"], *result[name])
            for line, values in zip(lines, expected, strict=True):
                np.testing.assert_array_equal(line.get_ydata(), values)
        places = np.array([line.get_xdata() for line in axes.lines[::3]])
        assert np.all(np.diff(places, axis=0) > 0)  # no marker hides another
        np.testing.assert_allclose(places.mean(axis=0), result["percentile"])


def test_scenes_of_other_penetrations_go_together():
    figure = comparison({"one": scene_result(1.0), "other": scene_result(1.0, percentile=(50,))})
    assert len(figure.axes[0].lines[3].get_ydata()) == 1


SHARED = {"scan": (figure_scan, scan_result(), SCAN_DRAWN), "field": (figure_field, field_result(), FIELD_DRAWN)}
SHARED["map"] = figure_map, map_result(), MAP_DRAWN


@pytest.mark.parametrize("name", SHARED)
def test_a_figure_reads_the_stored_variables_and_leaves_the_same_bytes(name, tmp_path):
    draw, arrays, drawn = SHARED[name]
    assert_stored_and_the_same_bytes(draw, arrays, drawn, tmp_path)
