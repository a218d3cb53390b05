"""Warnings on a surface that a half-space or a mesh hardly takes: slopes, and lengths against cells and windows."""

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from roughslip.errors import ParameterError
from roughslip.validation import gate, positive

MOST_SLOPE = 0.5  # rms; a half-space stands for a surface of small slopes
CELLS = 4.0  # a correlation length, at least
LENGTHS = 10.0  # correlation lengths a window, at least
FULL = 2.0  # p / (E* h') of four rms pressures of full contact, E* h' / 2: a share of 3e-5 would be in tension
LIGHT_AREA = math.sqrt(2.0 * math.pi)  # A E* h' / N at light loads, Bush et al., Wear 35 (1975) 87
MOST_CELL_NODES = 2**21  # of a periodic cell, whose solve takes 0.7 GB
CELL_CONTACT = 4.0  # correlation areas in contact in a periodic cell, at least
ROUNDING = 1e-9
# Greatest index E* h' / H of elastic contact. Of the elastic real area in light contact at most exp(-2 / index^2) has
# pressures above H (Persson, J. Chem. Phys. 115 (2001) 3840): 2e-10 here, 0.14 at 1, where solved surfaces have 0.04.
ELASTIC = 0.3
# By the modulus from which on it holds, the greatest H / E: three times the yield strain (Tabor, The Hardness of
# Metals, 1951) of the strongest polymers, 0.1, and metals, 0.01 (Ashby, Materials Selection in Mechanical Design, 2011,
# chart of modulus and strength). Elastomers, below 0.1 GPa, do not yield. Hardened steel has 8 GPa of 210 GPa.
HARDEST = ((1e10, 0.04), (1e8, 0.3))


@gate
def rms_slope(covariance: Callable[..., np.ndarray], step_m: float | None = None) -> float:
    """Root mean square h' [-] of the gradient, over both directions.

    covariance : C(x, y) [m^2], one of roughslip.surface.MODELS or, with a step, any
    step_m : h [m]; the gradient is then that between nodes so far apart

    Between nodes it is (4 C(0, 0) - 2 C(h, 0) - 2 C(0, h))^(1/2) / h, and finite. Without a step it is that of the
    field, infinite where heights have no slope; 2 Sq / l of the Gaussian covariance. Raises ParameterError for a
    covariance whose own slope is not known, and for a step that is not positive.
    """
    if step_m is None:
        slope: float | None = getattr(covariance, "rms_slope", None)
        if slope is None:
            raise ParameterError("give step_m where the covariance is not one of roughslip.surface.MODELS")
        return slope
    positive("step_m", step_m, "m")
    whole, along, across = covariance(np.array([0.0, step_m, 0.0]), np.array([0.0, 0.0, step_m])).tolist()
    return math.sqrt(max(4 * whole - 2 * along - 2 * across, 0.0)) / step_m


def slope_mistake(covariance: Callable[..., np.ndarray]) -> str:
    """Why no load can be given to heights without slope, whose contact shrinks with the cell; "" for others."""
    if math.isfinite(getattr(covariance, "rms_slope", 0.0)):
        return ""
    return (
        f"{getattr(covariance, 'kind', 'it')} is not allowed with load: its rms slope is infinite, so that real area "
        "goes to zero with the cell. Allowed: gaussian, matern with roughness.smoothness above 1, or self_affine, "
        "whose roughness.bandwidth, longest over shortest wave, is its cut-off"
    )


def plasticity_index(modulus_pa: float, slope: float, hardness_pa: float) -> float:
    """E* h' / H [-], twice the mean elastic pressure of light contact over the hardness; zero where that is infinite.

    modulus_pa : E* [Pa]
    slope : h' [-] rms
    hardness_pa : H

    Source: Mikic, Int. J. Heat Mass Transfer 17 (1974) 205, with the slope of a profile in place of h'.
    """
    return modulus_pa * slope / hardness_pa


def yielding(index: float, share: float) -> str:
    """Whether the contact of a load yields, as the log and the page say it.

    index : E* h' / H, zero in elastic contact; share : of the real area that bears the hardness
    """
    if not index:
        return "The contact is elastic: material.hardness_pa is not given."
    return f"The plasticity index E* h' / H is {index:.2g}; {100 * share:.2g} % of the real area bears the hardness."


def yield_warning(young_modulus_pa: float, modulus_pa: float, slope: float) -> str:
    """That elastic contact under a load would yield in the hardest metal or polymer; "" where it would not.

    young_modulus_pa : E [Pa]
    modulus_pa, slope : as plasticity_index
    """
    hardest = next((ratio * young_modulus_pa for least, ratio in HARDEST if young_modulus_pa >= least), math.inf)
    index = plasticity_index(modulus_pa, slope, hardest)
    if index <= ELASTIC:
        return ""
    return (
        f"material.hardness_pa is not given: elastic contact here has E* h' / H = {index:.2g} with the hardest metal "
        f"or polymer of that modulus, H = {hardest:.2g} Pa, and yields above {ELASTIC:g}: real area and friction are "
        "those of no such solid. Give the hardness, or smoother heights"
    )


def contact_mistake(pressure_pa: float, modulus_pa: float, slope: float, hardness_pa: float, least_share: float) -> str:
    """What no cell has to be solved for: a nominal pressure of full contact, or of too few contacts; "" for others.

    modulus_pa : E* [Pa]
    slope : h' [-] rms
    hardness_pa : highest contact pressure, infinite in elastic contact
    least_share : [-] of the area in contact, below which the largest cell has too few contacts

    Real contact is LIGHT_AREA p / (E* h') of the area while it is small, and at least p / H.
    """
    full = min(FULL * modulus_pa * slope, hardness_pa)
    if pressure_pa >= full:
        reason = f"{FULL:g} E* h' with E* = {modulus_pa:.3g} Pa, rms slope h' = {slope:.3g}"
        reason = "material.hardness_pa" if full == hardness_pa else reason
        return (
            f"a nominal pressure of {pressure_pa:.4g} Pa presses the surface into full contact, without scatter of "
            f"friction; take less than {full:.3g} Pa ({reason})"
        )
    minimum = least_share * min(modulus_pa * slope / LIGHT_AREA, hardness_pa)
    if pressure_pa < minimum:
        return (
            f"a nominal pressure of {pressure_pa:.4g} Pa is nearly no contact: a periodic cell of {MOST_CELL_NODES} "
            f"nodes has too few of them. Take at least {minimum:.3g} Pa, or larger strip.cell_m"
        )
    return ""


def warnings(
    covariance: Callable[..., np.ndarray],
    lengths_m: tuple[float, float],
    key: str,
    cells_m: Mapping[str, float],
    window_m: float | None = None,
) -> Iterator[str]:
    """A line for each thing: what, its number, the keys of the scene, what to do.

    covariance : C(x, y) [m^2]
    lengths_m : 1/e lengths along x and y
    key : of the scene, that gives them
    cells_m : edges of cells, by key; slopes are those between nodes of the finest
    window_m : length of windows along x; None without windows
    """
    slope, shortest, along = rms_slope(covariance, min(cells_m.values())), min(lengths_m), lengths_m[0]
    if slope > MOST_SLOPE:
        yield (
            f"rms slope {slope:.3g} between neighbouring nodes is above {MOST_SLOPE:g}, too steep for a half-space: "
            f"check the units of heights and lengths, roughness.rms_height_m and {key}"
        )
    coarse = [f"{name} = {cell:.3g} m" for name, cell in cells_m.items() if cell * CELLS > shortest * (1 + ROUNDING)]
    if coarse:
        yield (
            f"{' and '.join(coarse)} above a quarter of the correlation length {shortest:.3g} m ({key}): contacts are "
            f"not resolved. Take at most {shortest / CELLS:.3g} m, unless heights are to be independent from node to "
            "node"
        )
    waves, coarsest = min(getattr(covariance, "cutoff_wavelengths_m", (math.inf,))), max(cells_m.values())
    if CELLS * coarsest > waves * (1 + ROUNDING):
        yield (
            f"cells of {coarsest:.3g} m above a quarter of the shortest wave {waves:.3g} m (roughness.bandwidth): "
            f"slope and real area are those of the mesh. Take cells of at most {waves / CELLS:.3g} m, or less bandwidth"
        )
    if window_m is not None and along * LENGTHS > window_m * (1 + ROUNDING):
        yield (
            f"correlation length {along:.3g} m along the belt ({key}) above a tenth of strip.window_m = {window_m:.3g} "
            f"m: windows hold few contacts and depend on each other. Take windows of at least {along * LENGTHS:.3g} m"
        )
