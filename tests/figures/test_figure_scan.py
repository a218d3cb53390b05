"""The figure of a scan draws what is stored and nothing else, the same bytes each time."""

import numpy as np
import pytest

from roughslip.figures.figure_scan import DRAWN, NUMBERS, OUTSIDE, figure_scan
from tests.figures.drawn import assert_nothing_is_cut, assert_stored_and_the_same_bytes, with_interval


def twins(name, value, spread):
    return {f"twin_{name}": np.asarray(value) + spread * np.linspace(-1, 1, 19)[(..., *[None] * np.ndim(value))]}


def scan(*, sufficient=1, fractal=2.3):
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
        **twins("correlation_x", table[:, 10], 0.02),
        **twins("correlation_y", table[30], 0.02),
        **twins("density", density, 0.02 / 3e-7),
        "twin_power": np.outer(np.linspace(0.9, 1.1, 19), power),
    }  # fmt: skip
    for name, value in values.items():
        result |= with_interval(name, value, abs(value) / 10) | twins(name, value, abs(value) / 5)
    return result


CASES = {"whole": scan(), "small": scan(sufficient=0), "smooth": scan(fractal=-0.4), "without": scan(fractal=np.nan)}


@pytest.mark.parametrize("case", CASES)
def test_nothing_is_cut_and_no_title_runs_into_the_next_panel(case):
    figure = figure_scan(CASES[case])
    figure.draw_without_rendering()
    assert_nothing_is_cut(figure)


def test_what_is_drawn_is_stored_and_the_same_bytes(tmp_path):
    assert_stored_and_the_same_bytes(figure_scan, scan(), DRAWN, tmp_path)


def test_the_stored_numbers_are_drawn():
    result = scan()
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
    result = scan(fractal=-0.4)
    result["twin_skewness"] = result["skewness"] + np.array([0.0, 99.0])
    numbers = figure_scan(result).axes[5]
    np.testing.assert_allclose(numbers.lines[3].get_xdata(), [0.0, OUTSIDE])
    assert "fractal dimension" not in [label.get_text() for label in numbers.get_yticklabels()]
