"""Bad input to every subject: of a good call, each argument in turn is replaced by what is no such value.

Only a ParameterError may answer, before a number is returned.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest

from roughslip import probability
from roughslip.chaos.hermite import hermite_basis, multi_indices
from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.regression import least_squares
from roughslip.contact.influence import Influence, Material
from roughslip.contact.solve import solve, solve_load
from roughslip.errors import ParameterError
from roughslip.friction.bowden_tabor import friction_coefficient, window_sums
from roughslip.friction.paths import path_sampler
from roughslip.friction.process import FrictionProcess, average_beta
from roughslip.friction.statistics import strip_weights, window_statistics
from roughslip.grid import Grid
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.models import Matern, covariance_of, self_affine
from roughslip.surface.modes import karhunen_loeve

GRID = Grid(4, 3, 1e-6, 1e-6)
HEIGHTS = 1e-9 * np.arange(12.0).reshape(4, 3)
RNG = np.random.default_rng(1)
POINTS, MU = RNG.uniform(-1, 1, (60, 2)), 0.3 + 0.1 * RNG.random((6, 12))
WEIGHTS = strip_weights(6, 40, np.random.default_rng(4))
WINDOWS = {"mu": MU, "valid": np.ones(MU.shape, bool), "weights": WEIGHTS}
BELT = {
    "mass_kg": 1.0,
    "natural_frequency_rad_per_s": 316.0,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
    "excitation_force_n": 1.0,
    "excitation_frequency_rad_per_s": 316.0,
}
BETA = probability.BetaDistribution(2.1, 5.0, 0.2, 0.6)
PROCESS = FrictionProcess(BETA, 1e-4)
GOOD = {
    "contact": [
        partial(Grid, nx=4, ny=3, dx=1e-6, dy=1e-6),
        partial(Material, young_modulus_pa=2e11, poisson_ratio=0.3),
        partial(Influence, grid=GRID, plane_strain_modulus_pa=2e11),
        partial(solve, Influence(GRID, 2e11), HEIGHTS, tolerance=1e-6),
        partial(solve, Influence(GRID, 2e11), interference=HEIGHTS),
        partial(solve_load, Influence(GRID, 2e11), heights=HEIGHTS, mean_pressure_pa=5e5),
    ],
    "surface": [
        partial(covariance_of, "gaussian", rms_height_m=1.0, correlation_length_m=1.0, lay_rad=0.1),
        partial(covariance_of, "self_affine", 1e-7, 1e-5, hurst=0.8, bandwidth=1e5),
        partial(Matern, 1.0, 1.0, smoothness=1.5),
        partial(self_affine, rms_height_m=1.0, hurst=0.8, rolloff_wavelength_m=2.0, cutoff_wavelength_m=1.0),
        partial(karhunen_loeve, covariance_of("gaussian", 1e-7, 2e-6), GRID, order=4),
        partial(
            WeierstrassMandelbrot, hurst=0.8, rms_height_m=1.0, longest_wavelength_m=1.0, shortest_wavelength_m=0.1
        ),
    ],
    "chaos": [
        partial(hermite_basis, xi=POINTS, indices=multi_indices(2, 2)),
        partial(least_squares, basis=hermite_basis(POINTS, multi_indices(2, 2)), target=POINTS[:, 0]),
        partial(multi_indices, variables=2, degree=2),
        partial(PressureTarget, "squared_pressure", gap_stiffness=1.0),
    ],
    "friction": [
        partial(window_statistics, **WINDOWS),
        partial(friction_coefficient, area=MU, force=MU, shear_strength_pa=1.0, least_area_m2=0.1),
        partial(window_sums, MU, window_nodes=3, stride_nodes=1),
        partial(probability.BetaDistribution, a=2.1, b=5.0, lower=0.0, upper=1.0),
        partial(FrictionProcess, BETA, correlation_length_m=1e-4),
        partial(average_beta, BETA, windows=4.0),
        partial(path_sampler, PROCESS, spacing_m=1e-5),
    ],
    "oscillator": [
        partial(Oscillator, **BELT),
        partial(StribeckLaw, fit=0.3, static=0.4, decay_s_per_m=1.42, quadratic_s2_per_m2=0.01),
        partial(CoulombLaw, static=0.4, kinetic=0.3),
        partial(TableLaw, speeds_m_per_s=(0.0, 1.0), values=(0.4, 0.3)),
        partial(MotionOptions, tolerance=1e-5),
        partial(simulate, Oscillator(**BELT), StribeckLaw(0.3), 1e-3 * MU[0], spacing_m=1.0, duration_periods=3.0),
    ],
}
SIGNED = {"lower", "upper", "poisson_ratio", "lay_rad"}  # numbers of either sign
ZERO = {"damping_ratio", "belt_velocity_m_per_s", "excitation_force_n", "excitation_frequency_rad_per_s", "degree"}
ZERO |= {"fit", "static", "kinetic", "decay_s_per_m", "quadratic_s2_per_m2"}  # numbers that may be zero


def bad_values(name: str, good: Any) -> Iterator[Any]:
    """What may not stand in place of a good value of that name."""
    if isinstance(good, np.ndarray) and good.dtype.kind == "f":
        for value in (math.nan, math.inf):
            spoilt = good.copy()
            spoilt.flat[0] = value
            yield spoilt
        yield from (good[None, None], good + 1e-9j, np.full(good.shape, "high"), "high", None, [[1.0, 2.0], [3.0]])
    elif isinstance(good, np.ndarray):
        yield from (good[..., None, None], np.full(good.shape, None), "often", None)
    elif isinstance(good, (int, float)):
        yield from (math.nan, math.inf, "four", *([2.5] if isinstance(good, int) else []))
        yield from ([] if name in SIGNED else [-1] if name in ZERO else [-1, 0])
    elif isinstance(good, tuple):
        yield from ((*good[:-1], math.nan), (*good[:-1], -1.0), (*good, 1.0), good[0], "often")


@pytest.mark.parametrize("subject", GOOD)
def test_bad_input_is_refused(subject):
    """By a ParameterError alone, and without a warning. The good call itself passes."""
    wrong = []
    for good in GOOD[subject]:
        good()
        for name, value in good.keywords.items():
            for bad in bad_values(name, value):
                try:
                    good(**{name: bad})
                    wrong.append(f"{good.func.__name__}({name}={bad}) is accepted")
                except ParameterError:
                    pass
                except Exception as error:
                    wrong.append(f"{good.func.__name__}({name}={bad}): {error!r}")
    assert not wrong, "\n".join(wrong)
