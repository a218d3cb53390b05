"""A ground surface, made grain by grain.

Grinding drags many hard grains through the work along x. Each grain has a height g, a transverse place y_g and a tip of
radius r. It moves on the circle of the wheel, dips into the work about x_g, and cuts no deeper than

    c(x, y) = g + (x - x_g)^2 / (2 R) + (y - y_g)^2 / (2 r),

with R the radius of its path in the frame of the work. A scratch of depth d is 2 sqrt(2 R d) long and 2 sqrt(2 r d)
wide. The surface is the minimum of the blank and all cuts (Salisbury, Domala, Moon, Miller and Sutherland, Journal of
Manufacturing Science and Engineering 123, 2001, 576). It has grooves along x, no ridges, and a negative skewness.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields

import numpy as np

from roughslip.errors import ParameterError
from roughslip.grid import Grid
from roughslip.surface.embedding import embed
from roughslip.surface.models import covariance_of
from roughslip.validation import gate


@gate
@dataclass(frozen=True)
class Grinding:
    """How a surface is ground.

    grains_per_m2 : [1/m^2] grains whose deepest point lies over a unit of area; their number is Poisson's
    depth_m : [m] mean of the exponential distribution of how deep grains dip below the mean of the blank
    tip_radius_m : [m] median of the log-normal distribution of the radius of their tips
    tip_spread : standard deviation of the logarithm of that radius
    path_radius_m : [m] R, radius of the path of a grain in the frame of the work
    blank_rms_m, blank_length_m : [m] Sq and 1/e length of the Gaussian blank
    """

    grains_per_m2: float = 2.0e10
    depth_m: float = 0.3e-6
    tip_radius_m: float = 3.0e-6
    tip_spread: float = 0.5
    path_radius_m: float = 0.15e-3
    blank_rms_m: float = 0.3e-6
    blank_length_m: float = 3.0e-6

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not (math.isfinite(value) and value > 0.0):
                raise ParameterError(f"{field.name} of grinding must be positive and finite, not {value}")


@gate
def ground_surface(grinding: Grinding, grid: Grid, generator: np.random.Generator) -> np.ndarray:
    """z : (nx, ny) [m] heights of a ground surface about the mean of its blank.

    Grains just outside the mesh cut into it too, so the surface is stationary to its edges.
    """
    blank = covariance_of("gaussian", grinding.blank_rms_m, grinding.blank_length_m)
    z = embed(blank, grid).sample(generator)
    lengths = np.array([grid.nx * grid.dx, grid.ny * grid.dy])
    top = float(z.max())
    # how far outside the mesh a grain can stand and cut into it: one in a million is deeper, or wider
    deepest = grinding.depth_m * math.log(1e6)
    widest = grinding.tip_radius_m * math.exp(5.0 * grinding.tip_spread)
    margin = np.sqrt(2.0 * np.array([grinding.path_radius_m, widest]) * (top + deepest))
    number = generator.poisson(grinding.grains_per_m2 * np.prod(lengths + 2.0 * margin))
    places = generator.uniform(-margin, lengths + margin, size=(number, 2))
    depths = generator.exponential(grinding.depth_m, number)
    radii = grinding.tip_radius_m * np.exp(grinding.tip_spread * generator.standard_normal(number))
    x, y = grid.x(), grid.y()
    for (x_grain, y_grain), depth, radius in zip(places, depths, radii, strict=True):
        highest = max(top + depth, 0.0)  # of the work above the grain; beyond, its path passes over
        half_length, half_width = math.sqrt(2.0 * grinding.path_radius_m * highest), math.sqrt(2.0 * radius * highest)
        i = slice(*np.searchsorted(x, [x_grain - half_length, x_grain + half_length]))
        j = slice(*np.searchsorted(y, [y_grain - half_width, y_grain + half_width]))
        along = (x[i] - x_grain) ** 2 / (2.0 * grinding.path_radius_m) - depth
        across = (y[j] - y_grain) ** 2 / (2.0 * radius)
        np.minimum(z[i, j], along[:, None] + across[None, :], out=z[i, j])
    return z
