"""Bad input to every subject, which only a ParameterError answers.

Each entry of a table is a good call, and by parameter the bad values that replace one of its arguments.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import pytest

from roughslip import probability
from roughslip.chaos.functionals import Stencil
from roughslip.chaos.hermite import hermite_basis, multi_indices, sobol_indices
from roughslip.chaos.local import Samples, fit_local
from roughslip.chaos.pressure import PressureTarget, fit_in_contact
from roughslip.chaos.regression import least_squares
from roughslip.chaos.sampling import kolmogorov_distance, sobol
from roughslip.chaos.strip import fit_strip
from roughslip.contact.influence import Influence, Material
from roughslip.contact.solve import solve, solve_load, sweep
from roughslip.errors import IllPosedError, ParameterError
from roughslip.friction.bowden_tabor import friction_coefficient, window_sums
from roughslip.friction.correlation import autocorrelation, correlation_fit
from roughslip.friction.marginal import fit_beta
from roughslip.friction.pad import Surface, influence_covariance, pad_scatter
from roughslip.friction.paths import path_sampler
from roughslip.friction.penetration import curve_over_penetration
from roughslip.friction.process import FrictionProcess, average_beta
from roughslip.friction.statistics import ratio_of_sums, strip_weights, window_statistics
from roughslip.grid import Grid
from roughslip.oscillator.cycles import FEWEST_REALISATIONS, count_difference, reattachment_statistics
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.friction_laws.coulomb import CoulombLaw
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.friction_laws.table import TableLaw
from roughslip.oscillator.limits import existence_limit
from roughslip.oscillator.motion import MotionOptions, simulate
from roughslip.oscillator.states import time_scales
from roughslip.probability import Estimate
from roughslip.probability.empirical import checked_values
from roughslip.probability.estimate import wilson_interval
from roughslip.scan.jackknife import SubAreas
from roughslip.surface.covariance import plane_height
from roughslip.surface.embedding import embed
from roughslip.surface.fractal import WeierstrassMandelbrot, fractal_on
from roughslip.surface.models import Matern, covariance_of, self_affine
from roughslip.surface.modes import karhunen_loeve, representation

NAN, INFINITY = math.nan, math.inf
NOT_FINITE: dict[str, Any] = {"nan": NAN, "infinite": INFINITY, "text": "high"}
NOT_POSITIVE = {"zero": 0.0, "negative": -1.0, **NOT_FINITE}
NEGATIVE = {"negative": -1.0, "nan": NAN, "infinite": INFINITY}
NOT_WHOLE: dict[str, Any] = {"half": 2.5, "nan": NAN, "text": "four"}
NOT_A_DEGREE = {"negative": -1, **NOT_WHOLE}
NOT_A_COUNT = {"zero": 0, **NOT_A_DEGREE}
NOT_A_SHARE: dict[str, Any] = {"zero": 0.0, "negative": -0.1, "above-one": 1.1, "nan": NAN, "text": "half"}
UNKNOWN = {"unknown": "unknown"}

Calls = dict[str, Callable[[], object]]


def with_value(good: np.ndarray, value: object) -> np.ndarray:
    """Return a copy of an array with one bad value."""
    bad = good.copy()
    bad.flat[max(good.size - 4, 0)] = value
    return bad


def not_an_array(good: np.ndarray) -> dict[str, Any]:
    """Return values that are no array of real numbers, by name."""
    return {
        "nan": with_value(good, NAN),
        "infinite": with_value(good, INFINITY),
        "text": np.full(good.shape, "high"),
        "a-word": "high",
        "none": None,
        "complex": good + 1e-9j,
        "objects": np.full(good.shape, None),
    }


def not_a_table(good: np.ndarray) -> dict[str, Any]:
    """Return values that are no array of real numbers with the dimensions of a good one, by name."""
    ragged = [[1.0, 2.0], [3.0]]
    return not_an_array(good) | {"a-number": 1.0, "of-one-dimension-more": good[..., None], "ragged": ragged}


def spoilt(function: Callable[..., object], **bad: Mapping[str, Any]) -> Calls:
    """Return calls of a function, each with one bad argument, by name.

    function : a partial that holds all arguments of a good call
    bad : by parameter, bad values by their names
    """
    name = getattr(getattr(function, "func", function), "__qualname__", "call")
    return {
        f"function={name} argument={parameter} value={kind}": partial(function, **{parameter: value})
        for parameter, values in bad.items()
        for kind, value in values.items()
    }


def joined(*parts: Calls) -> Calls:
    """Return all calls. Raises ValueError if two have the same name."""
    calls = {name: call for part in parts for name, call in part.items()}
    if len(calls) != sum(map(len, parts)):
        raise ValueError("two bad inputs have the same name")
    return calls


GRID = Grid(4, 3, 1e-6, 1e-6)
OUTSIDE = {"zero": 0.0, "one": 1.0, "negative": -0.1, "nan": NAN, "text": "half", "none": None}  # of probabilities


def contact_refusals() -> Calls:
    """Return bad input to contact solves."""
    free, cell = Influence(GRID, 2e11), Influence(GRID, 2e11, periodic=True)
    z = 1e-9 * np.arange(12.0).reshape(4, 3)
    field = not_a_table(z) | {"empty": np.empty((0, 0)), "transposed": z.T, "one-dimensional": z.ravel()}
    guess = {name: value for name, value in field.items() if name != "none"} | {"negative": with_value(z, -1.0)}
    planes = {name: [0.0, value] for name, value in NOT_FINITE.items()}
    hardness = {"zero": 0.0, "negative": -1.0, "nan": NAN, "text": "hard"}
    numbers: dict[str, Any] = {"tolerance": NOT_A_SHARE | {"one": 1.0}, "hardness_pa": hardness}
    pressures = NOT_POSITIVE | {"at-the-hardness": 1e6, "above-the-hardness": 2e6}
    periodic = {"periodic": cell}
    cells, cell_pressures = ({f"of-a-cell-{name}": bad for name, bad in one.items()} for one in (field, pressures))
    load = partial(solve_load, influence=free, heights=z, mean_pressure_pa=5e5, hardness_pa=1e6)
    on_a_plane = partial(solve, influence=free, interference=z)
    return joined(
        spoilt(on_a_plane, influence=periodic, interference=field, initial_pressure=guess, **numbers),
        spoilt(partial(sweep, influence=free, heights=z, planes=[0.0]), influence=periodic, heights=field),
        spoilt(partial(sweep, free, z, planes=[0.0]), planes=planes, **numbers),
        spoilt(load, heights=field, mean_pressure_pa=pressures, initial_pressure=guess, **numbers),
        spoilt(partial(load, influence=cell), heights=cells, mean_pressure_pa=cell_pressures),
        spoilt(partial(Influence, GRID), plane_strain_modulus_pa=NOT_POSITIVE),
        spoilt(partial(Material, 2e11), poisson_ratio={"-1": -1.0, "0.51": 0.51, **NOT_FINITE}),
        spoilt(partial(Material, poisson_ratio=0.3), young_modulus_pa=NOT_POSITIVE),
        spoilt(partial(Grid, nx=4, ny=3, dx=1e-6, dy=1e-6), nx=NOT_A_COUNT, dx=NOT_POSITIVE),
    )


def surface_refusals() -> Calls:
    """Return bad input to covariances and expansions."""
    field = covariance_of("gaussian", 1e-7, 2e-6)
    plain = partial(covariance_of, kind="gaussian", rms_height_m=1.0, correlation_length_m=1.0)
    affine = partial(self_affine, 1.0, 0.8, rolloff_wavelength_m=1.0, cutoff_wavelength_m=1.0)
    banded = partial(covariance_of, "self_affine", 1e-7, 1e-5, hurst=0.8, bandwidth=1e5)
    expanded, share = partial(karhunen_loeve, field, GRID), partial(karhunen_loeve, field, GRID, share=0.5)
    orders = NOT_A_COUNT | {"more-than-nodes": 13}
    percentiles = {"zero": 0.0, "negative": -10.0, "above": 110.0, "nan": NAN, "text": "half"}
    lengths = ("rms_height_m", "correlation_length_m", "correlation_length_across_m")
    sizes: dict[str, Any] = dict.fromkeys(lengths, NOT_POSITIVE)
    of_others = {"smoothness": {"of-a-gaussian": 1.0}, "bandwidth": {"of-a-gaussian": 10.0}}
    return joined(
        spoilt(plain, kind=UNKNOWN | {"without-a-smoothness": "matern"}, lay_rad=NOT_FINITE, **sizes, **of_others),
        spoilt(partial(Matern, 1.0, 1.0), smoothness={f"matern-{k}": v for k, v in NOT_POSITIVE.items()}),
        spoilt(banded, hurst=NOT_A_SHARE, bandwidth=NOT_POSITIVE),
        spoilt(affine, rolloff_wavelength_m=NOT_POSITIVE, cutoff_wavelength_m=NOT_POSITIVE),
        spoilt(expanded, order=orders, share=NOT_A_SHARE | {"missing": None}),
        spoilt(share, order={"and-a-share": 3}),
        spoilt(partial(representation, field, GRID), order=NOT_A_COUNT, share=NOT_A_SHARE),
        spoilt(partial(plane_height, rms_height_m=1.0), percentile=percentiles),
        spoilt(partial(embed, grid=GRID), covariance={"waves-far-below-the-cells": banded()}),
    )


def height_refusals() -> Calls:
    """Return bad input to height distributions and their translation."""
    heights = not_an_array(np.ones(9))
    marginal = probability.FamilyDistribution("beta", 1e-7, (2.1, 5.0))
    translation, row = probability.translate(marginal), np.exp(-np.minimum(np.arange(8), 8 - np.arange(8)) / 2.0)
    correlations = not_an_array(row)
    weibull = partial(probability.FamilyDistribution, family="weibull", standard_deviation=1.0, shapes=(1.0,))
    shapes = {name: (value,) for name, value in NOT_POSITIVE.items()}
    families = UNKNOWN | {"of-no-shape": "gaussian", "of-two-shapes": "beta"}
    moments = partial(probability.distribution_of_moments, "beta", 1.0, skewness=0.1, excess_kurtosis=0.0)
    {"constant": np.full(8, 0.5), "not-even": np.linspace(1, 0, 8)}
    return joined(
        spoilt(weibull, family=families, standard_deviation=NOT_POSITIVE, shapes=shapes),
        spoilt(moments, skewness=NOT_FINITE, excess_kurtosis=NOT_FINITE),
        spoilt(marginal.quantile, probability=OUTSIDE),
        spoilt(partial(probability.fit_distribution, family="gaussian"), values=heights),
        spoilt(probability.empirical_distribution, values=heights),
        spoilt(translation.apply, gaussian=heights),
        spoilt(translation.correlation, gaussian_correlation=correlations | {"above-one": 1.1}),
        spoilt(translation.gaussian_correlation, correlation=correlations),
    )


def fractal_refusals() -> Calls:
    """Return bad input to fractal surfaces."""
    waves = WeierstrassMandelbrot(0.8, 1e-7, 1e-5, 1e-6, 4)
    good: dict[str, Any] = {"hurst": 0.8, "rms_height_m": 1.0, "longest_wavelength_m": 1.0, "gamma": 1.5}
    band = NOT_POSITIVE | {"above-the-longest": 2.0}
    summed = partial(WeierstrassMandelbrot, **good, shortest_wavelength_m=0.1)
    on_a_grid = partial(fractal_on, grid=GRID, hurst=0.8, rms_height_m=1e-7, azimuths=4)
    return joined(
        spoilt(summed, **dict.fromkeys(good, NOT_POSITIVE), shortest_wavelength_m=band),
        spoilt(summed, azimuths=NOT_A_COUNT | {"million": 10**6}),
        spoilt(on_a_grid, grid={"without-a-wave": Grid(1, 1, 1.0, 1.0)}),
        spoilt(waves.marginal().quantile, probability=OUTSIDE),
    )


def regression_refusals() -> Calls:
    """Return bad input to polynomial bases, designs and regressions."""
    points = np.random.default_rng(1).uniform(-1, 1, (60, 2))
    target = points[:, 0] + 0.3 * np.random.default_rng(2).standard_normal(60)
    indices = multi_indices(2, 2)
    table = hermite_basis(points, indices)
    tables, targets = not_a_table(table), not_a_table(target)
    weights = {name: value for name, value in targets.items() if name != "none"}
    in_contact = partial(fit_in_contact, basis=table, pressure=np.abs(target), logarithm=True)
    drawn = partial(sobol, np.random.default_rng(1), samples=4, variables=2)
    squares = partial(least_squares, basis=table, target=target)
    return joined(
        spoilt(partial(hermite_basis, indices=indices), xi=not_a_table(points) | {"narrow": points[:, :1]}),
        spoilt(squares, basis=tables, target=targets),
        spoilt(squares, weights=weights | {"negative": -np.ones(60), "zero": np.zeros(60)}),
        spoilt(in_contact, basis=tables, pressure=targets),
        spoilt(partial(sobol_indices, indices, directions=np.eye(2)), coefficients=not_a_table(np.ones(6))),
        spoilt(partial(multi_indices, variables=2, degree=2), variables=NOT_A_COUNT, degree=NOT_A_DEGREE),
        spoilt(partial(multi_indices, 500), degree={"of-too-many-terms": 15}),
        spoilt(drawn, samples=NOT_A_COUNT, variables=NOT_A_COUNT),
    )


def pressure_refusals() -> Calls:
    """Return bad input to expansions of contact pressures."""
    u = np.random.default_rng(3).standard_normal((120, 1, 2))
    known = Samples(u, np.zeros(1), np.maximum(u[..., 0], 0), np.maximum(-u[..., 0], 0))
    parts = {"variables": np.zeros((30, 1, 2)), "distance2": np.zeros(1), "pressure": np.zeros((30, 1))}
    bad = {name: not_a_table(np.ones((4, *part.shape[1:]))) for name, part in parts.items()}
    bad["gap"] = not_a_table(np.ones((4, 1)))
    bad["pressure"]["negative"] = bad["gap"]["negative"] = -np.ones((30, 1))
    functionals, stencil = np.random.default_rng(4).standard_normal((60, 4, 8)), Stencil((1, 1), (2, 2))
    values, trial = np.ones((60, 4, 1)), PressureTarget("trial_pressure", 1.0)
    strip = partial(fit_strip, functionals=functionals, target_values=values, degree=1, stencil=stencil, target=trial)
    target = partial(PressureTarget, kind="squared_pressure", gap_stiffness=1.0)
    {name: (value, 1) for name, value in NOT_A_DEGREE.items()}
    with_nan = {"nan": np.array([1.0, NAN])}
    return joined(
        spoilt(partial(Samples, **parts, gap=np.zeros((30, 1))), **bad),
        spoilt(strip, functionals=not_a_table(functionals), target_values=not_a_table(values)),
        spoilt(partial(fit_local, samples=known, target=trial), degree=NOT_A_DEGREE),
        spoilt(target, kind=UNKNOWN, gap_stiffness=NOT_POSITIVE, cell_pressure_pa=NEGATIVE),
        spoilt(partial(wilson_interval, trials=2), successes={"more-than-trials": 3}),
        spoilt(partial(kolmogorov_distance, second=np.ones(2)), first=with_nan),
    )


def window_refusals() -> Calls:
    """Return bad input to statistics of windows."""
    mu = 0.3 + 0.1 * np.random.default_rng(3).random((6, 12))
    valid, weights = np.ones(mu.shape, dtype=bool), strip_weights(6, 40, np.random.default_rng(4))
    bad_weights = {
        "none": None,
        "a-word": "often",
        "floats": weights.astype(float),
        "negative": with_value(weights, -1),
        "of-other-strips": weights[:, :4],
        "too-few": weights[:20],
        "without-the-sample": weights[1:],
        "one-row": weights[0],
    }
    bad: dict[str, Any] = {
        "mu": not_a_table(mu),
        "valid": {"numbers": valid.astype(float), "narrow": valid[:, :3], "none": None},
        "weights": bad_weights,
    }
    of_windows = (window_statistics, fit_beta)
    good = {"mu": mu, "valid": valid, "weights": weights}
    sums = partial(window_sums, column_sums=mu, window_nodes=3, stride_nodes=1)
    friction = partial(friction_coefficient, area=mu, force=mu, shear_strength_pa=1.0, least_area_m2=0.1)
    areas, forces = not_an_array(mu) | {"negative": -mu}, not_an_array(mu) | {"zero-in-contact": 0 * mu}
    ratio = partial(ratio_of_sums, area=mu, force=mu, shear_strength_pa=1.0, weights=weights)
    lags, curve = 1e-6 * np.arange(8.0), autocorrelation(mu, valid, 8, weights)
    bad_lags = {"falling": lags[::-1], "without-zero": lags + 1e-6, "of-another-curve": 1e-6 * np.arange(9.0)}
    fitted = partial(correlation_fit, lags=lags, estimate=curve, window=4e-6)
    return joined(
        spoilt(fitted, lags=not_a_table(lags) | bad_lags, window=NOT_POSITIVE),
        *(spoilt(partial(function, **good), **bad) for function in of_windows),
        spoilt(partial(window_statistics, **good), mu={"negative": -mu}),
        spoilt(partial(autocorrelation, **good, lags=4), **bad),
        spoilt(ratio, area=bad["mu"], weights=bad_weights),
        spoilt(sums, column_sums=not_an_array(mu), stride_nodes=NOT_A_COUNT),
        spoilt(sums, window_nodes=NOT_A_COUNT | {"wider-than-the-strip": 13}),
        spoilt(friction, area=areas, force=forces, shear_strength_pa=NOT_POSITIVE, least_area_m2=NOT_POSITIVE),
        spoilt(partial(strip_weights, 6, rng=np.random.default_rng(3)), replicates=NOT_A_COUNT),
    )


def path_refusals() -> Calls:
    """Return bad input to friction processes and their paths."""
    beta, quantiles = probability.BetaDistribution(2.1, 5.0, 0.2, 0.6), np.arange(20.0)
    process = FrictionProcess(beta, 1e-4)
    waves = partial(path_sampler, process, spacing_m=1e-5, length_m=1e-3, method="spectral")
    NOT_POSITIVE | {"far-too-fine": 1e-12, "far-too-wide": 1.0}
    bounds = partial(probability.BetaDistribution, a=2.1, b=5.0, lower=0.0, upper=1.0)
    empirical = partial(probability.QuantileDistribution, quantiles=quantiles, mean=0.3, standard_deviation=0.1)
    tables = not_a_table(quantiles) | {"falling": -quantiles, "too-few": quantiles[:5]}
    many_nodes = {"of-too-many-nodes": 1e4}
    return joined(
        spoilt(waves, spacing_m=NOT_POSITIVE, length_m=NOT_POSITIVE | many_nodes, method=UNKNOWN),
        spoilt(bounds, a=NOT_POSITIVE, b=NOT_POSITIVE, lower=NOT_FINITE | {"above": 2.0}, upper=NOT_FINITE),
        spoilt(empirical, quantiles=tables, mean=NOT_FINITE, standard_deviation=NOT_FINITE),
        spoilt(partial(FrictionProcess, beta), correlation_length_m=NOT_POSITIVE),
        spoilt(partial(average_beta, beta), windows=NOT_POSITIVE | {"below-one": 0.5, "text": "four"}),
    )


def oscillator_refusals() -> Calls:
    """Return bad input to friction laws and motions."""
    positive = {"mass_kg": 1.0, "natural_frequency_rad_per_s": 316.0, "normal_force_n": 2500.0}
    moved = {"damping_ratio": 0.17, "belt_velocity_m_per_s": 0.948}
    excited = {"excitation_force_n": 1.0, "excitation_frequency_rad_per_s": 316.0}
    study, law = partial(Oscillator, **positive, **moved), StribeckLaw(0.3)
    run = partial(simulate, oscillator=study(), law=law, path=None, spacing_m=1e-4, duration_periods=3.0)
    numbers = NEGATIVE | {"zero": 0.0}
    paths = {
        "nan": np.array([0.0, NAN, 0.0]),
        "infinite": np.array([0.0, INFINITY, 0.0]),
        "of-one-node": np.zeros(1),
        "empty": np.zeros(0),
        "two-dimensional": np.zeros((3, 3)),
        "too-short": np.zeros(8),
    }
    tables = partial(TableLaw, speeds_m_per_s=(0.0, 1.0), values=(0.4, 0.3))
    values = {name: (0.4, value) for name, value in NEGATIVE.items()} | {"of-another-length": (0.4,)}
    speeds = {name: (0.0, value) for name, value in NEGATIVE.items()} | {"falling": (0.0, -1.0)}
    stribeck = dict.fromkeys(("fit", "static", "decay_s_per_m", "quadratic_s2_per_m2"), NEGATIVE)
    return joined(
        spoilt(study, **dict.fromkeys(positive, NOT_POSITIVE), **dict.fromkeys((*moved, *excited), NEGATIVE)),
        spoilt(partial(StribeckLaw, fit=0.3), **stribeck),
        spoilt(partial(CoulombLaw, static=0.4), kinetic=NEGATIVE | {"above-static": 0.5}),
        spoilt(tables, values=values, speeds_m_per_s=speeds, interpolation=UNKNOWN),
        spoilt(run, duration_periods=numbers, path=paths),
        spoilt(MotionOptions, tolerance=numbers | {"large": 1e-2}, samples_per_period={"zero": 0}, scatter=UNKNOWN),
        spoilt(run, start_m={"nan": NAN, "infinite": INFINITY, "fast": (0.0, INFINITY), "alone": (0.0,)}),
        spoilt(partial(run, path=np.zeros(9)), spacing_m=numbers),
    )


REFUSALS = {
    "surface": joined(surface_refusals(), height_refusals(), fractal_refusals()),
    "contact": contact_refusals(),
    "chaos": joined(regression_refusals(), pressure_refusals()),
    "friction": joined(window_refusals(), path_refusals()),
    "oscillator": oscillator_refusals(),
}


@pytest.mark.parametrize("subject", REFUSALS)
def test_bad_input_is_refused(subject):
    """By a ParameterError alone, and without a warning."""
    assert len(REFUSALS[subject]) >= 70
    wrong = {}
    for name, call in REFUSALS[subject].items():
        try:
            call()
            wrong[name] = "accepted"
        except ParameterError:
            pass
        except Exception as error:
            wrong[name] = repr(error)
    assert wrong == {}


def ill_posed() -> dict[str, Callable[[], Any]]:
    """By a part of its message each, what data cannot tell, just beyond what they can."""
    some = np.ones((3, 4))
    rng = np.random.default_rng(7)
    weights = strip_weights(3, 40, rng)
    levels = np.array([5.0, 50.0])
    few, one = np.ones((FEWEST_REALISATIONS - 1, 2)), Estimate(*map(np.array, (1.0, 0.0, 2.0)), np.ones(40))
    surface = Surface(lambda x, y: np.exp(-(x**2) - y**2), (1.0, 1.0))
    parts = SubAreas(Grid(9, 9, 1.0, 1.0), (3, 3), (1.0, 1.0))
    return {
        "1 strip": lambda: strip_weights(1, 40, rng),
        "no block carries force": lambda: influence_covariance(some, 0.0 * some, weights),
        "a pad has no scatter": lambda: pad_scatter(np.zeros((2, 5)), np.ones(2), surface, 1.0, 1.0, 4.0),
        "has no scatter to find": lambda: pad_scatter(np.eye(1, 5).repeat(2, 0), np.zeros(2), surface, 1.0, 1.0, 4.0),
        "at least two levels": lambda: curve_over_penetration(levels[:1], [one], levels[:1]),
        "2 realisations give no interval" if len(few) == 2 else "give no interval": lambda: count_difference(
            few[0], few
        ),
        "runs stick again": lambda: reattachment_statistics(rng.random(9), np.arange(9) % len(few), rng),
        "a statistic that must be positive": lambda: parts.interval(np.array([*[1.0] * 9, 0.0]), positive=True),
        "values are equal to 2": lambda: probability.fit_distribution(np.full(9, 2.0), "beta"),
    }


def test_what_data_cannot_tell_is_refused():
    for message, call in ill_posed().items():
        with pytest.raises(IllPosedError, match=message):
            call()
    for values in ([1.0], [1.0, np.nan], [np.inf, 1.0, 2.0]):
        with pytest.raises(ParameterError, match="two or more values, all finite"):
            checked_values(np.array(values))
    belt = Oscillator(1.0, 1.0, 0.1, 0.0, 1.0)
    with pytest.raises(ParameterError, match="a belt at rest has no time scale"):
        time_scales(belt, CoulombLaw(0.2, 0.4), 1.0)
    with pytest.raises(ParameterError, match="for a belt that moves"):
        existence_limit(belt, CoulombLaw(0.2, 0.4))
