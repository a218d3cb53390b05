"""Figure 3 of several scenes: what it draws is stored under the name of its scene, and nothing is cut or hidden."""

import numpy as np
import pytest

from roughslip.figures.comparison import COMPARED, MOST, comparison
from tests.figures.drawn import Recorded, assert_nothing_is_cut, with_interval


def scene(scale, percentile=(5, 20, 50, 95)):
    """Made up: friction that falls with penetration, the expansion a hundredth above what was solved."""
    percentile = np.array(percentile, dtype=float)
    found = {"source": np.array(["solved", "expansion"]), "percentile": percentile}
    for name, row in (("mean", 0.4 - 0.001 * percentile), ("std", 0.1 / (1 + percentile / 10))):
        found |= with_interval(name, scale * row * np.array([[1.0], [1.01]]), 0.005)
        found |= with_interval(f"combined_{name}", scale * row, 0.002)
    return Recorded(found)


@pytest.mark.parametrize("count", [1, 3, MOST])
def test_every_scene_is_drawn_from_what_is_stored(count):
    results = {f"scene{number}": scene(1 + number) for number in range(count)}
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
    figure = comparison({"one": scene(1.0), "other": scene(1.0, percentile=(50,))})
    assert len(figure.axes[0].lines[3].get_ydata()) == 1
