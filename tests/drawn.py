"""Results to draw, made up: what tests of figures share."""

import numpy as np


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
