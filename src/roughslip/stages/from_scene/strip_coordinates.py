"""Coordinates of results on strips, with which xarray selects penetrations, strips and windows."""

import numpy as np

from roughslip import store
from roughslip.scene.types import Scene


def of_levels(scene: Scene) -> dict[str, store.Variable]:
    """Penetrations."""
    percentiles = np.array(scene.strip.penetration_percentiles)
    return {"percentile": store.Variable(("level",), percentiles, "percent", "share of heights above the plane")}


def of_windows(scene: Scene, numbers: range, windows: int) -> dict[str, store.Variable]:
    """Penetrations, numbers of the strips, and starts of their windows. windows : of a strip"""
    starts = scene.strip.window_spacing_m * np.arange(windows)
    return of_levels(scene) | {
        "sample": store.Variable(("sample",), np.array(numbers), "1", "number of the strip"),
        "window": store.Variable(("window",), starts, "m", "start of the window along the belt"),
    }
