"""The model of the surface of a scene, and that of a scan, as stage `scan` leaves it on disk, and back."""

import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.probability import BetaDistribution
from roughslip.probability.distributions import EmpiricalDistribution
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream
from roughslip.surface import model as surface
from roughslip.surface.covariance import Covariance
from roughslip.surface.fractal import WeierstrassMandelbrot
from roughslip.surface.model import GaussianModel, SurfaceModel, endless_lay
from roughslip.surface.models import MODELS, covariance_of

if TYPE_CHECKING:
    from roughslip.scene.roughness import Roughness, Scan

OPTIONS = ("correlation_length_across_m", "lay_rad", *{name for model in MODELS.values() for name in model.shapes})

AZIMUTHS, GAMMA = 16, 1.5  # of a fractal: directions of its waves, isotropic to five lengths; ratio of frequencies
HELPS = {"outliers": "missing", "marginal": "gaussian", "covariance": "measured"}


def surface_model(scene: Scene, scan: Path | None = None) -> SurfaceModel:
    """The surface of a scene. scan : what stage `scan` found, where the scene has one."""
    if scene.roughness.wavelengths_m is not None:
        return fractal_law(scene.roughness)
    return gaussian_model(scene, scan)


def gaussian_model(scene: Scene, scan: Path | None = None) -> GaussianModel:
    """The surface of a scene that is Gaussian or translated from a Gaussian one."""
    if scan is not None:
        return restored_model(store.read(scan))
    roughness = scene.roughness
    options = {name: value for name in OPTIONS if (value := getattr(roughness, name)) is not None}
    field = covariance_of(roughness.covariance, roughness.rms_height_m, roughness.correlation_length_m, **options)
    if roughness.beta_shapes is None:
        return GaussianModel(field, field.axis_lengths_m)
    marginal = BetaDistribution.of_moments(*roughness.beta_shapes, 0.0, field.rms_height_m)
    correct = roughness.correct_correlation
    return surface.gaussian_model(field, field.axis_lengths_m, marginal, correct_correlation=correct)


def fractal_law(roughness: "Roughness") -> WeierstrassMandelbrot:
    """The waves of a fractal."""
    assert roughness.wavelengths_m is not None
    assert roughness.hurst is not None
    shortest, longest = roughness.wavelengths_m
    return WeierstrassMandelbrot(roughness.hurst, roughness.rms_height_m, longest, shortest, AZIMUTHS, GAMMA)


def strip_fields(scene: Scene, model: SurfaceModel, grid: Grid) -> Callable[[int], np.ndarray]:
    """A function that gives the field (nx, ny) [m] of a strip on a mesh by the number of the strip."""
    sample = model.sampler(grid)
    return lambda number: sample(np.random.default_rng([scene.seed, Stream.STRIP, number]))


def with_lay(model: GaussianModel, endless: int | None, length_m: float) -> GaussianModel:
    """The model of a profile with an infinitely long lay along an axis, or the model itself without one.

    length_m : [m] along the lay, in place of infinity: the edge of the scan
    """
    if endless is None:
        return model
    x, y = model.lengths_m
    lengths = (x, length_m) if endless else (length_m, y)
    return replace(model, covariance=endless_lay(model.covariance, endless), lengths_m=lengths)


def stored_model(
    covariance: Covariance | None,
    marginal: EmpiricalDistribution | None,
    correct_correlation: bool,
    rms_height_m: float,
    endless: int | None = None,
) -> tuple[dict[str, store.Variable], dict[str, str]]:
    """Variables and the attribute `model` that `restored_model` reads; statistics stand in the same file.

    covariance : None for the measured autocorrelation
    endless : axis of a lay that is taken as infinitely long, of which the covariance is that of the profile across
    """
    variables = {}
    if marginal is not None:
        score = ("score",)
        variables["marginal_score"] = store.Variable(score, marginal.normal, "1", "standard normal score")
        variables["marginal_height"] = store.Variable(score, marginal.values, "m", "height at that score")
    model = {
        "covariance": None if covariance is None else {"kind": covariance.kind, **asdict(covariance)},
        "rms_height_m": rms_height_m,
        "correct_correlation": correct_correlation,
        "endless_lay": endless,
    }
    return variables, {"model": json.dumps(model, sort_keys=True)}


def what_helps(scan: "Scan", keys: Sequence[str]) -> str:
    """What to try where no surface can be sampled like a scan. scan : its scene keys; keys : those that may help"""
    others = [f"roughness.scan.{key}: {HELPS[key]}" for key in keys if getattr(scan, key, None) != HELPS[key]]
    return f"What may help: {' or '.join(others)}" if others else "What helps: a larger scan in roughness.scan.file"


def fitted_covariance(result: store.Result) -> Covariance | None:
    """The model of the autocorrelation of a scan; None where it is the measured one, or where there is no model."""
    given = json.loads(result.attributes.get("model", "{}")).get("covariance")
    return None if given is None else covariance_of(**given)


def restored_model(result: store.Result) -> GaussianModel:
    """The model of a scan. Raises IllPosedError, which names the keys that help, where stage `scan` found none."""
    if "no_model" in result.attributes:
        raise IllPosedError(f"the scan has no model: {result.attributes['no_model']}")
    model = json.loads(result.attributes["model"])
    marginal: EmpiricalDistribution | None = None
    if "marginal_score" in result:
        marginal = EmpiricalDistribution(result["marginal_score"], result["marginal_height"])
    correct, endless = model["correct_correlation"], model["endless_lay"]
    edge = 1.0 if endless is None else float(result["points"][endless] * result["spacing"][endless])
    if (field := fitted_covariance(result)) is not None:
        profile = surface.gaussian_model(field, field.axis_lengths_m, marginal, correct_correlation=correct)
        return with_lay(profile, endless, edge)
    steps = (float(np.diff(result["lag_x"][:2])[0]), float(np.diff(result["lag_y"][:2])[0]))
    lengths = float(result["length_x"]), float(result["length_y"])
    table, rms = result["correlation"], model["rms_height_m"]
    if endless is not None:  # the lags of the profile alone
        table = np.take(table, [table.shape[endless] // 2], axis=endless)
    profile = surface.measured_model(table, steps, rms, lengths, marginal, correct_correlation=correct)
    return with_lay(profile, endless, edge)
