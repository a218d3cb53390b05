"""Correlation of the heights of a scene, and with it that of the friction of a pad over the slipped distance."""

from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.friction.pad import WINDOWS, Surface, pad_edges, pad_means
from roughslip.scene.types import Scene
from roughslip.study.from_scene.surface_model import fractal_law, gaussian_model, surface_model

PARTS = "1", "shares of powers 1, 2, 4, 8 of the correlation of the heights, and of no correlation, in the influence"
LAGS = 49  # slipped distances
BEYOND = 6.0  # correlation lengths of the heights by which it reaches over the length of the pad


def correlation_variables(scene: Scene, scan: Path | None, length_m: float | None = None) -> dict[str, store.Variable]:
    """What with `pad_parts` gives the autocorrelation of the friction of a pad over the slipped distance."""
    strip, surface = scene.strip, correlated(scene, scan)
    pads = [pad_edges(count, strip.window_m, strip.width_m, length_m) for count in WINDOWS]
    lags = np.array([np.linspace(0.0, length + BEYOND * surface.lengths_m[0], LAGS) for length, _ in pads])
    sizes = strip.window_spacing_m, strip.width_m
    means = np.array([pad_means(surface, *sizes, pad, row) for pad, row in zip(pads, lags, strict=True)])
    title = "means of the parts over pairs of points of a pad and of the pad a lag behind"
    return {
        "pad_lag": store.Variable(("pad", "lag_of_pad"), lags, "m", "slipped distances"),
        "pad_means": store.Variable(("pad", "lag_of_pad", "part"), means, "1", title),
    }


def correlated(scene: Scene, scan: Path | None = None) -> Surface:
    """Correlation of the heights of the surface; of translated ones, that of the Gaussian field behind them."""
    roughness, model = scene.roughness, surface_model(scene, scan)
    if roughness.wavelengths_m is None:
        covariance: Any = gaussian_model(scene, scan).covariance
    else:
        covariance = fractal_law(roughness)
    variance = covariance.rms_height_m**2
    return Surface(lambda x, y: covariance(x, y) / variance, model.lengths_m)
