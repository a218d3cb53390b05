"""Bad input to surface, each kind once: a ParameterError and nothing else is the answer to all of it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from roughslip.grid import Grid
from roughslip.probability import (
    FamilyDistribution,
    distribution_of_moments,
    empirical_distribution,
    fit_distribution,
    translate,
)
from roughslip.scan.covariance_fit import fit_covariance
from roughslip.scan.fit_data import estimates
from roughslip.surface.corrected_covariance import corrected_correlation, nearest_correlation
from roughslip.surface.covariance import Covariance, plane_height, self_affine
from roughslip.surface.embedding import embed
from roughslip.surface.fractal import WeierstrassMandelbrot, fractal_on, plane_waves, rms_height
from roughslip.surface.karhunen_loeve import karhunen_loeve, representation
from roughslip.surface.lanczos import leading_modes

NAN, INFINITY = math.nan, math.inf
NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, "nan": NAN, "infinite": INFINITY, "text": "long", "none": None}
NOT_WHOLE = {"zero": 0, "negative": -1, "half": 2.5, "nan": NAN, "text": "four"}
NOT_A_SHARE = {"zero": 0.0, "negative": -0.1, "above one": 1.1, "nan": NAN, "text": "half"}

GRID = Grid(4, 3, 1e-6, 1e-6)
FIELD = Covariance("gaussian", 1e-7, 2e-6)
WAVES = WeierstrassMandelbrot(0.8, 1e-7, 1e-5, 1e-6, 4)
LAW = FamilyDistribution("beta", 1e-7, (2.1, 5.0))
ROW = np.exp(-np.minimum(np.arange(8), 8 - np.arange(8)) / 2.0)


def _put(good: np.ndarray, value: Any) -> np.ndarray:
    bad = good.copy()
    bad.flat[len(good.flat) - 4] = value
    return bad


def _not_an_array(good: np.ndarray) -> dict[str, Any]:
    """What is no array like a good one, by name."""
    return {
        "nan": _put(good, NAN),
        "infinite": _put(good, INFINITY),
        "text": np.full(good.shape, "high"),
        "a word": "high",
        "none": None,
        "complex": good + 1e-9j,
        "objects": np.full(good.shape, None),
    }


def _fields() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    bad: Any
    for name, bad in NOT_POSITIVE.items():
        calls |= {
            f"rms height {name}": partial(Covariance, "gaussian", bad, 1.0),
            f"correlation length {name}": partial(Covariance, "gaussian", 1.0, bad),
            f"roll-off {name}": partial(self_affine, 1.0, 0.8, bad, 1.0),
            f"cut-off {name}": partial(self_affine, 1.0, 0.8, 1.0, bad),
            f"smoothness {name}": partial(Covariance, "matern", 1.0, 1.0, smoothness=bad),
            f"hurst {name}": partial(Covariance, "self_affine", 1.0, 1.0, hurst=bad, bandwidth=10.0),
            f"bandwidth {name}": partial(Covariance, "self_affine", 1.0, 1.0, hurst=0.8, bandwidth=bad),
        }
        if bad is not None:
            calls[f"correlation length across {name}"] = partial(Covariance, "gaussian", 1.0, 1.0, bad)
    for name, bad in {"nan": NAN, "infinite": INFINITY, "text": "along", "none": None}.items():
        calls[f"lay {name}"] = partial(Covariance, "gaussian", 1.0, 1.0, lay_rad=bad)
    for name, bad in NOT_WHOLE.items():
        calls |= {
            f"order {name}": partial(karhunen_loeve, FIELD, GRID, bad),
            f"order of lanczos {name}": partial(leading_modes, FIELD, GRID, bad),
            f"order of a representation {name}": partial(representation, FIELD, GRID, bad),
        }
    for name, bad in NOT_A_SHARE.items():
        calls |= {
            f"share {name}": partial(karhunen_loeve, FIELD, GRID, share=bad),
            f"share of a representation {name}": partial(representation, FIELD, GRID, share=bad),
            f"percentile {name}": partial(plane_height, 100 * bad if isinstance(bad, float) else bad, 1.0),
        }
    fine = Covariance("self_affine", 1e-7, 1e-5, hurst=0.8, bandwidth=1e5)
    return calls | {
        "a kind that is not known": partial(Covariance, "gauss", 1.0, 1.0),
        "a smoothness of a gaussian": partial(Covariance, "gaussian", 1.0, 1.0, smoothness=1.0),
        "a bandwidth of a gaussian": partial(Covariance, "gaussian", 1.0, 1.0, bandwidth=10.0),
        "a hurst above one": partial(Covariance, "self_affine", 1.0, 1.0, hurst=1.1, bandwidth=10.0),
        "more modes than nodes": partial(karhunen_loeve, FIELD, GRID, 13),
        "more modes than nodes of lanczos": partial(leading_modes, FIELD, GRID, 13),
        "order and share": partial(karhunen_loeve, FIELD, GRID, 3, share=0.5),
        "neither order nor share": partial(karhunen_loeve, FIELD, GRID),
        "waves far below the cells": partial(embed, fine, GRID),
    }


def _laws() -> dict[str, Callable[[], object]]:
    calls: dict[str, Callable[[], object]] = {}
    translation = translate(LAW)
    bad: Any
    for name, bad in NOT_POSITIVE.items():
        calls |= {
            f"rms height of a law {name}": partial(FamilyDistribution, "gaussian", bad),
            f"shape {name}": partial(FamilyDistribution, "weibull", 1.0, (bad,)),
            f"rms height of moments {name}": partial(distribution_of_moments, "weibull", bad, 1.0, 1.0),
            f"rms height of waves {name}": partial(WeierstrassMandelbrot, 0.8, bad, 1.0, 0.1),
            f"longest wave {name}": partial(WeierstrassMandelbrot, 0.8, 1.0, bad, 0.1),
            f"shortest wave {name}": partial(WeierstrassMandelbrot, 0.8, 1.0, 1.0, bad),
            f"hurst of waves {name}": partial(WeierstrassMandelbrot, bad, 1.0, 1.0, 0.1),
            f"gamma {name}": partial(WeierstrassMandelbrot, 0.8, 1.0, 1.0, 0.1, gamma=bad),
            f"roughness parameter {name}": partial(rms_height, bad, WAVES),
            f"nodes a wave {name}": partial(fractal_on, GRID, 0.8, 1e-7, 4, nodes_per_wave=bad),
        }
    for name, bad in NOT_WHOLE.items():
        calls[f"azimuths {name}"] = partial(WeierstrassMandelbrot, 0.8, 1.0, 1.0, 0.1, bad)
    for name, bad in {"nan": NAN, "infinite": INFINITY, "text": "skew", "none": None}.items():
        calls |= {
            f"skewness {name}": partial(distribution_of_moments, "beta", 1.0, bad, 0.0),
            f"excess kurtosis {name}": partial(distribution_of_moments, "beta", 1.0, 0.1, bad),
        }
    for name, bad in {"zero": 0.0, "one": 1.0, "negative": -0.1, "nan": NAN, "text": "half", "none": None}.items():
        calls |= {
            f"probability {name}": partial(LAW.quantile, bad),
            f"probability of waves {name}": partial(WAVES.marginal().quantile, bad),
        }
    fine = plane_waves(WAVES, Grid(4, 3, 1e-7, 1e-7))
    for name, bad in _not_an_array(np.ones(WAVES.variables)).items():
        calls |= {
            f"phases {name}": partial(fine.heights, bad),
            f"heights of a law {name}": partial(fit_distribution, bad, "gaussian"),
            f"heights of an empirical law {name}": partial(empirical_distribution, bad),
            f"field {name}": partial(translation.apply, bad),
        }
    for name, bad in _not_an_array(ROW).items():
        calls |= {
            f"correlation {name}": partial(translation.correlation, bad),
            f"correlation of heights {name}": partial(translation.gaussian_correlation, bad),
            f"correlation on a torus {name}": partial(nearest_correlation, translation, bad),
        }
    return calls | {
        "a law that is not known": partial(FamilyDistribution, "cauchy", 1.0),
        "a law without its shapes": partial(FamilyDistribution, "beta", 1.0),
        "a law with too many shapes": partial(FamilyDistribution, "gaussian", 1.0, (1.0,)),
        "moments of a law that is not known": partial(distribution_of_moments, "cauchy", 1.0, 0.0, 0.0),
        "the shortest wave above the longest": partial(WeierstrassMandelbrot, 0.8, 1.0, 0.1, 1.0),
        "a million waves": partial(WeierstrassMandelbrot, 0.8, 1.0, 1.0, 0.1, 10**6),
        "waves that alias": partial(plane_waves, WAVES, Grid(4, 3, 1e-5, 1e-5)),
        "a mesh without a wave": partial(fractal_on, Grid(1, 1, 1.0, 1.0), 0.8, 1.0, 1),
        "no correlation on a torus": partial(corrected_correlation, translation, np.full(8, 0.5)),
        "an odd correlation on a torus": partial(corrected_correlation, translation, np.linspace(1, 0, 8)),
        "correlations above one": partial(translation.correlation, 1.1),
    }


def _fits() -> dict[str, Callable[[], object]]:
    x = np.arange(-2.0, 3.0)
    table = FIELD(1e-6 * x[:, None], 1e-6 * x) / 1e-14
    error = np.full(table.shape, 0.01)
    calls: dict[str, Callable[[], object]] = {}
    for name, bad in _not_an_array(table).items():
        calls |= {
            f"lags {name}": partial(estimates, x[:, None], x, bad, error),
            f"errors of lags {name}": partial(estimates, x[:, None], x, table, bad),
        }
    data = estimates(1e-6 * x[:, None], 1e-6 * x, table, error)
    for name, worse in NOT_POSITIVE.items():
        calls[f"rms height of a fit {name}"] = partial(fit_covariance, "gaussian", data, worse)
    return calls | {
        "errors of zero": partial(estimates, x[:, None], x, table, 0 * error),
        "one part": partial(estimates, x[:, None], x, table, error, table[None]),
        "a cut-off of a gaussian": partial(fit_covariance, "gaussian", data, 1e-7, cutoff_wavelength_m=1e-6),
        "a self-affine fit without a cut-off": partial(fit_covariance, "self_affine", data, 1e-7),
        "a fit of a kind that is not known": partial(fit_covariance, "gauss", data, 1e-7),
    }


REFUSED = {**_fields(), **_laws(), **_fits()}
