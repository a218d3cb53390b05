"""From a stage's slice of the scene to what the pressure expansion expands, and in which variables."""

from __future__ import annotations

from roughslip.chaos.functionals import Stencil
from roughslip.chaos.pressure import PressureTarget, pressure_target, summit_curvature
from roughslip.grid import Grid
from roughslip.stages import elastic, geometry
from roughslip.surface.covariance import Covariance


def target(configuration: geometry.Configuration, grid: Grid) -> PressureTarget:
    """The smooth variable whose positive part gives the pressure on a mesh."""
    surface = geometry.covariance(configuration)
    return pressure_target(
        configuration["expansion"]["target"],
        influence_diagonal=elastic.influence(configuration, grid).diagonal,
        plane_strain_modulus_pa=elastic.material(configuration).plane_strain_modulus_pa,
        summit_curvature_per_m=summit_curvature(surface.rms_height_m, surface.correlation_length_m),
    )


def stencil(surface: Covariance, grid: Grid) -> Stencil:
    """Boxes of the near and far mean: half widths of 0.5 and 2 correlation lengths, at least 1 and 2 nodes."""
    near = [max(1, round(0.5 * surface.correlation_length_m / cell)) for cell in (grid.dx, grid.dy)]
    far = [max(2, round(2.0 * surface.correlation_length_m / cell)) for cell in (grid.dx, grid.dy)]
    return Stencil((near[0], near[1]), (far[0], far[1]))
