"""From a stage's slice of the scene, or from what a scan left, to the model of the surface."""

from __future__ import annotations

from pathlib import Path

from roughslip import store
from roughslip.probability import FamilyDistribution
from roughslip.stages.from_scene import geometry, scan_model
from roughslip.stages.from_scene.geometry import Configuration
from roughslip.surface import model as surface
from roughslip.surface.covariance import Covariance
from roughslip.surface.fractal import WeierstrassMandelbrot, fractal_on
from roughslip.surface.model import FractalModel, GaussianModel, SurfaceModel

OPTIONS = ("correlation_length_across_m", "lay_rad", "smoothness", "hurst", "bandwidth")


def surface_model(configuration: Configuration, scan: Path | None = None) -> SurfaceModel:
    """The surface of a scene. scan : what stage `scan` found, where the scene has one."""
    roughness = configuration["roughness"]
    if "fractal" in roughness:
        return FractalModel(fractal_law(configuration))
    return gaussian_model(configuration, scan)


def gaussian_model(configuration: Configuration, scan: Path | None = None) -> GaussianModel:
    """The surface of a scene that is Gaussian or translated from a Gaussian one."""
    if scan is not None:
        return scan_model.restored(store.read(scan))
    roughness = configuration["roughness"]
    options = {name: roughness[name] for name in OPTIONS if name in roughness}
    field = Covariance(roughness["covariance"], roughness["rms_height_m"], roughness["correlation_length_m"], **options)
    law = roughness.get("marginal")
    if law is None:
        return GaussianModel(field, field.axis_lengths_m)
    marginal = FamilyDistribution(law["family"], field.rms_height_m, tuple(law["shapes"]), law.get("mirrored", False))
    correct = law.get("correct_correlation", False)
    return surface.gaussian_model(field, field.axis_lengths_m, marginal, correct_correlation=correct)


def fractal_law(configuration: Configuration) -> WeierstrassMandelbrot:
    """The waves of a fractal; where the scene gives no band, that of the strip, from its length to two cells."""
    roughness, grid = configuration["roughness"], geometry.strip_grid(configuration)
    law = roughness["fractal"]
    band = fractal_on(grid, law["hurst"], roughness["rms_height_m"], law["azimuths"], law["gamma"])
    return WeierstrassMandelbrot(
        law["hurst"],
        roughness["rms_height_m"],
        law.get("longest_wavelength_m", band.longest_wavelength_m),
        law.get("shortest_wavelength_m", band.shortest_wavelength_m),
        law["azimuths"],
        law["gamma"],
    )
