"""From a stage's slice of the scene, or from what a scan left, to the model of the surface."""

from __future__ import annotations

from pathlib import Path

from roughslip import store
from roughslip.probability import FamilyDistribution
from roughslip.scene.roughness import Fractal
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import geometry, scan_model
from roughslip.surface import model as surface
from roughslip.surface.fractal import WeierstrassMandelbrot, fractal_on
from roughslip.surface.model import FractalModel, GaussianModel, SurfaceModel
from roughslip.surface.models import MODELS, covariance_of

OPTIONS = ("correlation_length_across_m", "lay_rad", *{name for model in MODELS.values() for name in model.shapes})


def surface_model(scene: Scene, scan: Path | None = None) -> SurfaceModel:
    """The surface of a scene. scan : what stage `scan` found, where the scene has one."""
    if scene.roughness.fractal is not None:
        return FractalModel(fractal_law(scene, scene.roughness.fractal))
    return gaussian_model(scene, scan)


def gaussian_model(scene: Scene, scan: Path | None = None) -> GaussianModel:
    """The surface of a scene that is Gaussian or translated from a Gaussian one."""
    if scan is not None:
        return scan_model.restored(store.read(scan))
    roughness = scene.roughness
    options = {name: value for name in OPTIONS if (value := getattr(roughness, name)) is not None}
    field = covariance_of(roughness.covariance, roughness.rms_height_m, roughness.correlation_length_m, **options)
    law = roughness.marginal
    if law is None:
        return GaussianModel(field, field.axis_lengths_m)
    marginal = FamilyDistribution(law.family, field.rms_height_m, tuple(law.shapes), law.mirrored)
    correct = law.correct_correlation
    return surface.gaussian_model(field, field.axis_lengths_m, marginal, correct_correlation=correct)


def fractal_law(scene: Scene, law: Fractal) -> WeierstrassMandelbrot:
    """The waves of a fractal; where the scene gives no band, that of the strip, from its length to two cells."""
    roughness, grid = scene.roughness, geometry.strip_grid(scene)
    band = fractal_on(grid, law.hurst, roughness.rms_height_m, law.azimuths, law.gamma)
    return WeierstrassMandelbrot(
        law.hurst,
        roughness.rms_height_m,
        law.longest_wavelength_m or band.longest_wavelength_m,
        law.shortest_wavelength_m or band.shortest_wavelength_m,
        law.azimuths,
        law.gamma,
    )
