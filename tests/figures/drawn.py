"""Checks that hold of every figure, and results to draw."""

import numpy as np

from roughslip.figures.style import save


class Recorded(dict):
    """A result that remembers what was read."""

    def __init__(self, arrays):
        super().__init__(arrays)
        self.read = set()

    def __getitem__(self, name):
        self.read.add(name)
        return super().__getitem__(name)


def with_interval(name, value, half):
    value = np.asarray(value, dtype=float)
    return {name: value, f"{name}_low": value - half, f"{name}_high": value + half}


def assert_nothing_is_cut(figure):
    """At the edges of the picture, of a figure that has been laid out."""
    for axes in figure.axes:
        box = axes.get_tightbbox()
        assert figure.bbox.x0 <= box.x0
        assert box.x1 <= figure.bbox.x1 + 1
        assert figure.bbox.y0 <= box.y0
        assert box.y1 <= figure.bbox.y1 + 1


def assert_stored_and_the_same_bytes(draw, arrays, drawn, folder):
    """Drawn twice, a figure reads the stored variables and no more, and leaves the same files."""
    arrays = Recorded(arrays)
    for name in ("one", "two"):
        figure = draw(arrays)
        for kind in ("png", "svg"):
            save(figure, folder / f"{name}.{kind}")
    assert arrays.read == set(drawn)
    for kind in ("png", "svg"):
        assert (folder / f"one.{kind}").read_bytes() == (folder / f"two.{kind}").read_bytes()
