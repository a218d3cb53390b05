"""Stage record: mean curve and scatter of a measured friction record, with synthetic records of the fitted process."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.scatter_law import autocorrelation_of_friction, doubt_of_law, scatter_by_law
from roughslip.record.fit import FrictionScatter, RecordFit, check_count, fit_record
from roughslip.record.likelihood import scatter_path, through_instrument
from roughslip.record.memory import ContactMemory, contact_memory
from roughslip.record.reading import Trace, read_records
from roughslip.record.slips import Rig, Sliding, sliding
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, elastic
from roughslip.study.from_scene.surface_model import gaussian_model
from roughslip.study.job import Job

KINDS = ("additive", "multiplicative")
MOST_DRAWN = 2000  # samples of the record that are drawn
TWINS = 2  # synthetic records next to the measured one
OF_SURFACE = (
    *("roughness.covariance", "material.young_modulus_pa"),
    *("strip.width_m", "strip.window_m", "oscillator.normal_force_n"),
)
LAW_ERROR = 0.1  # of the law of scatter: two of its rms errors
LAGS, REACH = 60, 5.0  # of the autocorrelation that is drawn, up to so many correlation lengths
NORMAL = (100.0, 100.0)  # shapes of a Beta distribution that is normal to its fourth moment, to 0.03
MOST_SHAPES = 200.0  # their sum
SHORTEST, LONGEST, MOST_LENGTHS = 1e-5, 1.0, 1e4  # [m], [m]: of the correlation of a record whose units are right
SURE = 2.0  # standard errors of moments, below which the scatter counts as normal


def beta_shapes(found: RecordFit) -> tuple[float, float]:
    """Shapes of the Beta distribution with skewness and excess kurtosis of the scatter (N. L. Johnson et al.,
    Continuous Univariate Distributions 2, 1995, ch. 25); those of a normal one where neither is significant."""
    (skewness, s_error), (excess, e_error) = found.skewness, found.excess
    if abs(skewness) < SURE * s_error and abs(excess) < SURE * e_error:
        return NORMAL
    s = min(skewness**2, 4.0)
    bounded = 1.5 * s - excess  # positive for every Beta, and small near a gamma distribution
    total = min(3.0 * (2.0 + excess - s) / bounded, MOST_SHAPES) if bounded > 0.0 else MOST_SHAPES
    total = max(total, 2.0)
    share = math.copysign(math.sqrt(s / (s + 16.0 * (total + 1.0) / (total + 2.0) ** 2)), skewness)
    return 0.5 * total * (1.0 - share), 0.5 * total * (1.0 + share)


def slid_in(wanted: Any, files: list[Path]) -> tuple[list[Trace], Rig | None, Sliding]:
    """Records, their rig and the sliding in them.

    Raises InputError where they cannot be read, IllPosedError where too little slides.
    """
    rig = None
    if wanted.rig_mass_kg is not None and wanted.rig_stiffness_n_per_m is not None:
        rig = Rig(wanted.rig_mass_kg, wanted.rig_stiffness_n_per_m, wanted.rig_damping_n_s_per_m or 0.0)
    traces = read_records(files, wanted.radius_m)
    slid = sliding(traces, rig, wanted.radius_m)
    check_count(slid.samples)
    return traces, rig, slid


def doubt_of_units(scatter: FrictionScatter) -> list[str]:
    """A question on a correlation length, or on how many a record holds, where a wrong unit of speed gives such."""
    length, lengths = scatter.correlation_length_m, scatter.lengths
    text = f"the record holds {lengths:.2g} correlation lengths of {length:.2g} m: is the unit of speed right?"
    return [] if SHORTEST < length < LONGEST and lengths < MOST_LENGTHS else [text]


def work(scene: Scene, job: Job) -> None:
    """Read, separate stick from slip, fit, draw synthetic records."""
    wanted = scene.friction.record
    assert wanted is not None
    traces, rig, slid = slid_in(wanted, job.paths("record"))
    memory = contact_memory(traces, rig, wanted.time_constant_s)
    if memory is not None:
        pairs = zip(traces, memory.transients, strict=False)  # none where the record cannot tell
        steady = [replace(trace, friction=trace.friction - more) for trace, more in pairs]
        slid = sliding(steady, rig, wanted.radius_m) if steady else slid
        slid = replace(slid, notes=(*memory.notes, *slid.notes))
    around = None if wanted.radius_m is None else 2.0 * math.pi * wanted.radius_m
    found = fit_record(slid.samples, around, wanted.time_constant_s, slid.from_slips, job.say)
    job.warn(*found.notes, *slid.notes, *doubt_of_units(found.additive))
    asked = scene.friction.scatter
    if found.kind not in (asked, "cannot tell"):
        job.warn(f"the record has {found.kind} scatter, and {asked} scatter is taken: give friction.scatter")
    job.count(samples=slid.samples.friction.size)
    variables = of_fit(found, slid) | _drawn(scene.seed, found, slid) | (of_memory(memory) if memory else {})
    if has_surface(job.key.configuration):
        try:
            by_law = of_surface(scene, float(np.mean(found.mean)), variables["lag"].values)
        except IllPosedError as error:
            job.warn(f"the surface has no scatter by law to compare with the record: {error.in_scene}")
        else:
            doubt = doubt_of_law(gaussian_model(scene).covariance)
            cause = is_roughness_the_cause(by_law["surface_std"].values, *found.additive.interval()[0])
            job.warn(*filter(None, (doubt, cause)))
            variables |= by_law
    store.write(job.output, variables, job.key)


def of_fit(found: RecordFit, slid: Sliding) -> dict[str, store.Variable]:
    """Curve and scatter with their errors, what else is in the record, and the samples that are drawn."""
    samples, curve, speed = slid.samples, found.curve, ("speed",)
    notes = np.array(found.notes + slid.notes or ("nothing",))
    variables = store.variables_of(found, leave_out=("mean", "explained"))
    variables |= store.variables_of(curve, "curve_", leave_out=("friction", "speeds_m_per_s")) | {
        "note": store.Variable(("note",), notes, "1", "what the record leaves open"),
        "record_mean": store.Variable((), float(np.mean(found.mean)), "1", "mean friction coefficient over the record"),
        "curve_speed": store.Variable(speed, curve.speeds_m_per_s, "m/s", "sliding speed"),
        "beta_shapes": store.Variable(("shape_of_beta",), beta_shapes(found), "1", "shapes of the Beta distribution"),
        **store.with_interval("curve", speed, (curve.friction, *curve.interval()), "1", "mean friction coefficient"),
    }
    for kind in KINDS:
        scatter, numbers = found.scatter(kind), ("standard_deviation", "correlation_length_m")
        variables |= store.variables_of(scatter, f"{kind}_", leave_out=numbers)
        shown = ("std", "1", "standard deviation"), ("length", "m", "correlation length")
        for number, ends, (name, unit, title) in zip(numbers, scatter.interval(), shown, strict=True):
            columns = getattr(scatter, number), *ends
            variables |= store.with_interval(f"{kind}_{name}", (), columns, unit, f"{title} of {kind} scatter")
    drawn = {
        "time": (samples.elapsed, "s", "time of sliding"),
        "speed": (samples.speed, "m/s", "sliding speed"),
        "friction": (samples.friction, "1", "friction coefficient as measured"),
        "explained": (found.explained, "1", "curve, drift and period"),
    }
    step = _step(slid)
    return variables | {
        f"sample_{name}": store.Variable(("sample",), values[::step], unit, title)
        for name, (values, unit, title) in drawn.items()
    }


def of_memory(found: ContactMemory) -> dict[str, store.Variable]:
    """What `oscillator.memory` takes, and the growth of static friction, with their intervals."""
    one, title = "1", "growth of static friction with ln(time of hold)"
    return {
        **store.with_interval("memory_direct_effect", (), found.direct_effect, one, "direct effect a"),
        **store.with_interval("memory_ageing_effect", (), found.ageing_effect, one, "ageing effect b"),
        **store.with_interval("memory_length", (), found.length_m, "m", "memory length D_c"),
        **store.with_interval("memory_growth", (), found.growth, one, title),
        "memory_chance": store.Variable((), found.chance, one, "p-value that steps of speed show no memory"),
    }


def _step(slid: Sliding) -> int:
    return -(-slid.samples.friction.size // MOST_DRAWN)


def has_surface(configuration: dict[str, Any]) -> bool:
    """Whether a scene itself gives a surface, a material, a window and its force: friction with a law of scatter."""
    keys = (key.split(".") for key in OF_SURFACE)
    return all((configuration.get(section) or {}).get(name) is not None for section, name in keys)


def of_surface(scene: Scene, mean: float, lags_m: np.ndarray) -> dict[str, store.Variable]:
    """Friction of a window of the surface by the law of scatter: standard deviation and autocovariance at lags.

    The record is that of one window, under its part of the normal force.
    """
    window = scene.strip.window_m, scene.strip.width_m
    pressure = scene.oscillator.normal_force_n / (scene.oscillator.windows_in_parallel * window[0] * window[1])
    law = gaussian_model(scene).covariance, elastic.material(scene).plane_strain_modulus_pa, pressure, window
    deviation = mean * scatter_by_law(*law)
    covariance = deviation**2 * autocorrelation_of_friction(*law, lags_m)
    return {
        "surface_std": store.Variable((), deviation, "1", "standard deviation of friction by the law of scatter"),
        "surface_covariance": store.Variable(("lag",), covariance, "1", "autocovariance of friction by that law"),
    }


def is_roughness_the_cause(by_law: float, low: float, high: float) -> str:
    """A sentence on the scatter by law, right to LAW_ERROR, and the 95 % interval of that of the record."""
    shown = f"the surface makes friction scatter by {by_law:.2g}, and the record has {low:.2g} to {high:.2g}"
    if by_law * (1.0 + LAW_ERROR) < low:
        share = (by_law / (0.5 * (low + high))) ** 2
        return f"{shown}: roughness is {share:.0%} of the variance, and not the main cause"
    if by_law * (1.0 - LAW_ERROR) > high:
        return f"{shown}: the surface or its pad and load are not those of the record"
    return f"{shown}: roughness can be the cause; compare the lengths over which both are correlated"


def variance_of_mean(covariance: np.ndarray) -> float:
    """Variance of the mean of a process over places at equal distances, from its autocovariance (n,) at these."""
    n = len(covariance)
    pairs = np.where(np.arange(n) > 0, 2.0, 1.0) * (n - np.arange(n))  # of places so far apart
    return float(pairs @ covariance) / n**2


def _drawn(seed: int, found: RecordFit, slid: Sliding) -> dict[str, store.Variable]:
    """Autocorrelation of the residuals with that of the fit, and synthetic records of the fit."""
    kind = found.kind if found.kind in found.fits else "additive"
    fit, samples = found.fits[kind], slid.samples
    response = samples.response(fit.time_constant, fit.digital)
    place, residual = samples.slipped, (samples.friction - found.explained) / fit.weight
    even = np.linspace(0.0, place[-1], int(min(place[-1] / fit.length * LAGS / REACH, 1e5)) + 2)
    values = np.interp(even, place, residual)
    values -= values.mean()
    lags = min(LAGS, even.size - 1)
    products = np.array([np.mean(values[: even.size - k] * values[k:]) for k in range(lags)])
    modelled = fit.deviation**2 * np.exp(-even / fit.length)
    products += variance_of_mean(modelled)  # which the mean takes out
    twins = []
    for number in range(TWINS):
        generator = np.random.default_rng([seed, Stream.RECORD, number])
        path = fit.deviation * fit.weight * scatter_path(place, fit.length, generator)
        noise = fit.noise * generator.standard_normal(place.size)
        twins.append((found.explained + through_instrument(path, response) + noise)[:: _step(slid)])
    titles = "autocovariance of the residuals, with what their mean takes out", "autocovariance of the fitted scatter"
    return {
        "lag": store.Variable(("lag",), even[:lags], "m", "slipped distance between two samples"),
        "covariance": store.Variable(("lag",), products, "1", titles[0]),
        "covariance_fit": store.Variable(("lag",), modelled[:lags], "1", titles[1]),
        "twin": store.Variable(("number", "sample"), np.array(twins), "1", "synthetic records"),
    }
