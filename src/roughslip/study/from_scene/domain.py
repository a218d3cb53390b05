"""What is solved: strips under planes, or periodic cells under nominal pressures, and their blocks.

A block is as long along the belt as the distance of two windows, and as wide as a window. Blocks one behind the other
are a window, so that friction follows from the contact area and normal force of blocks.

A cell has whole windows along and across the belt, at least WINDOWS of them and EDGE correlation lengths. All of it
bears the nominal pressure, so it also needs many contacts. The expected real area is sqrt(2 pi) p / (E* h') of it at
light loads (Bush, Gibson and Thomas, Wear 35 (1975) 87). It is at least CONTACT correlation areas, some 20 contacts.
What the period itself does is measured in docs/notebook/contact.md.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.contact.influence import Influence
from roughslip.contact.periodic import cell_heights
from roughslip.contact.solve import ContactSolution, solve_loads, sweep
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.scene.part import Scene
from roughslip.study.from_scene import Stream, elastic, geometry
from roughslip.study.from_scene.surface_model import fitted_covariance, gaussian_model, surface_model
from roughslip.study.job import Job
from roughslip.surface.embedding import embed_cell
from roughslip.surface.model import GaussianModel, SurfaceModel
from roughslip.surface.plausibility import (
    CELL_CONTACT,
    LIGHT_AREA,
    MOST_CELL_NODES,
    contact_mistake,
    plasticity_index,
    rms_slope,
    slope_mistake,
    warnings,
    yield_warning,
)

WINDOWS = 6, 2  # along and across, at least: lags of three windows are within half a period
EDGE = 8.0  # correlation lengths of an edge, at least
SAMPLE = 8  # windows of cells that stand for a sample of the scene
FEWEST = 16  # cells that are resampled, at least
FACTORS = tuple(10.0 ** np.array([-1.0, -0.5, 0.5, 1.0]))  # of the nominal pressure of the load
SAMPLES_THERE, FEWEST_THERE = 24, 8  # samples at these, as of strip.samples, and cells at least


@dataclass(frozen=True, eq=False)
class Domain:
    """Samples of a surface in contact, all on meshes of the same size.

    scene : its strip, numerics and material
    model : of the surface
    grid : mesh of a sample
    levels : percentiles of the plane [%], or nominal pressures [Pa] of periodic samples
    count : number of samples
    sample : draws a field on the mesh
    periodic : whether a sample is a period of the surface
    """

    scene: Scene
    model: SurfaceModel
    grid: Grid
    levels: tuple[float, ...]
    count: int
    sample: Callable[[np.random.Generator], np.ndarray]
    periodic: bool

    def numbers(self, first: int, last: int) -> range:
        """Samples of a job that takes [first, last) of `strip.samples`."""
        every = self.scene.strip.samples
        return range(first * self.count // every, last * self.count // every)

    def heights(self, number: int) -> np.ndarray:
        """Heights (nx, ny) [m] of a sample, as cells of constant pressure need them where edges of contacts count."""
        stream = Stream.CELL if self.periodic else Stream.STRIP
        drawn = self.model.heights(self.sample(np.random.default_rng([self.scene.seed, stream, number])))
        return cell_heights(drawn, self.grid) if self.periodic and elastic.counts_shares(self.scene) else drawn

    def solutions(self, heights: np.ndarray) -> list[ContactSolution]:
        """The contact of a sample at every level."""
        tolerance, hardness = self.scene.numerics.contact_tolerance, elastic.hardness_pa(self.scene)
        if self.periodic:
            return solve_loads(self._influence, heights, self.levels, tolerance, hardness)
        planes = self.model.plane_height(np.array(self.levels)).tolist()
        return sweep(self._influence, heights, planes, tolerance, hardness_pa=hardness)

    def touched(self, solution: ContactSolution) -> np.ndarray:
        """(nx, ny) share of each cell in contact, or whether its node is."""
        return solution.shares if elastic.counts_shares(self.scene) else solution.contact

    def middle(self) -> slice:
        """Columns without the margins of a strip."""
        return slice(None) if self.periodic else geometry.middle(self.scene)

    def blocks(self, field: np.ndarray) -> np.ndarray:
        """Integral (X, Y) of a field (nx, ny) over blocks along and across the belt."""
        x, y = geometry.block_nodes(self.scene)
        columns = field[self.middle()]
        along, across = len(columns) // x, columns.shape[1] // y
        sums = columns[: along * x].reshape(along, x, across, y).sum(axis=(1, 3))
        return np.asarray(self.grid.cell_area * sums)

    @cached_property
    def _influence(self) -> Influence:
        modulus = elastic.material(self.scene).plane_strain_modulus_pa
        return Influence(self.grid, modulus, periodic=self.periodic)


def domains(job: Job) -> list[Domain]:
    """The strips of the scene; or its cells under the load, and then those under the pressures about it."""
    scene, scan = job.scene, job.optional("scan")
    model = surface_model(scene, scan)
    if scan is not None and isinstance(model, GaussianModel):  # its surface is known from here on
        cells, window = {"strip.cell_m": scene.strip.cell_m}, scene.strip.window_m
        job.warn(*warnings(model.covariance, model.lengths_m, "roughness.scan", cells, window))
    if scene.load is not None and scene.load.nominal_pressure_pa is not None:
        return _under_load(job)
    levels, grid = tuple(map(float, scene.strip.penetration_percentiles)), geometry.strip_grid(scene)
    return [Domain(scene, model, grid, levels, scene.strip.samples, model.sampler(grid), periodic=False)]


def own_cells(scene: Scene, scan: Path | None) -> Domain:
    """Cells under the load of the scene. Raises IllPosedError where none serve."""
    check_slope(scan)
    model, nominal = gaussian_model(scene, scan), float(scene.load.nominal_pressure_pa)
    grid, mistake = mesh_under(scene, model, nominal)
    if mistake:
        raise IllPosedError(mistake)
    return _cells(scene, model, grid, (nominal,), scene.strip.samples, FEWEST)


def _under_load(job: Job) -> list[Domain]:
    """Cells under the load, and for each size of cells those that bear two decades of pressure about it."""
    scene, scan = job.scene, job.optional("scan")
    own, model, left_out = own_cells(scene, scan), gaussian_model(scene, scan), {}
    young, is_elastic = scene.material.young_modulus_pa, scene.material.hardness_pa is None
    if scan is not None and is_elastic and (text := yield_warning(young, *_stiffness(scene, model))):
        job.warn(text)
    meshes: dict[float, Grid] = {}
    for pressure in (own.levels[0] * float(factor) for factor in FACTORS):
        grid, mistake = mesh_under(scene, model, pressure)
        if mistake:
            left_out[pressure] = mistake
        else:
            meshes[pressure] = grid
    if left_out:
        listed = ", ".join(f"{pressure:.3g}" for pressure in left_out)
        job.warn(f"friction against load leaves out {listed} Pa. At the last {[*left_out.values()][-1]}")
    groups = [(grid, tuple(same)) for grid, same in groupby(meshes, key=meshes.__getitem__)]
    return [own, *(_cells(scene, model, *group, SAMPLES_THERE, FEWEST_THERE) for group in groups)]


def _cells(
    scene: Scene, model: GaussianModel, grid: Grid, pressures_pa: tuple[float, ...], samples: int, fewest: int
) -> Domain:
    """Cells that have SAMPLE windows a sample together, and at least the fewest."""
    windows = grid.size * grid.cell_area / (scene.strip.window_m * scene.strip.width_m)
    count = max(round(samples * SAMPLE / windows), fewest)
    return Domain(scene, model, grid, pressures_pa, count, embed_cell(model.covariance, grid).sample, periodic=True)


def mesh_of(scene: Scene, lengths_m: tuple[float, float], light_area: float) -> Grid:
    """The smallest cell that serves, or one of at most MOST_CELL_NODES nodes. Its shorter edge doubles until it serves.

    lengths_m : 1/e lengths of the heights along and across
    light_area : [-] share of the cell in contact that is expected
    """
    strip = scene.strip
    window, width = strip.window_m, strip.width_m
    along, across = (
        2 * math.ceil(max(least, EDGE * length / edge) / 2)
        for least, length, edge in zip(WINDOWS, lengths_m, (window, width), strict=True)
    )
    needed = CELL_CONTACT * math.prod(lengths_m) / light_area
    most = MOST_CELL_NODES * strip.cell_m**2
    while along * window * across * width < min(needed, most / 2):
        along, across = (2 * along, across) if along * window <= across * width else (along, 2 * across)
    x, y = (round(size / strip.cell_m) for size in (window, width))
    return Grid(along * x, across * y, strip.cell_m, strip.cell_m)


def mesh_under(scene: Scene, model: GaussianModel, pressure_pa: float) -> tuple[Grid, str]:
    """The mesh of a cell under a nominal pressure, and what is wrong where the pressure is too high or too low.

    Raises IllPosedError where a cell of WINDOWS and EDGE has too many nodes.
    """
    (modulus, slope), hardness = _stiffness(scene, model), elastic.hardness_pa(scene)
    share = max(LIGHT_AREA * pressure_pa / (modulus * slope), pressure_pa / hardness)
    least = CELL_CONTACT * math.prod(model.lengths_m) / (MOST_CELL_NODES * scene.strip.cell_m**2)
    mistake = contact_mistake(pressure_pa, modulus, slope, hardness, least)
    grid = mesh_of(scene, model.lengths_m, share)
    if grid.size > MOST_CELL_NODES:
        raise IllPosedError(
            f"a periodic cell of {WINDOWS[0]} x {WINDOWS[1]} windows and {EDGE:g} correlation lengths takes "
            f"{grid.size} nodes, more than {MOST_CELL_NODES}: use larger cells or smaller windows",
            scene_keys="strip.cell_m, strip.window_m, strip.width_m",
        )
    return grid, mistake


def index_of(scene: Scene, model: GaussianModel) -> float:
    """Plasticity index E* h' / H [-], zero in elastic contact."""
    return plasticity_index(*_stiffness(scene, model), elastic.hardness_pa(scene))


def check_slope(scan: Path | None) -> None:
    """Raise IllPosedError for a covariance fitted to a scan whose slope is infinite."""
    fitted = None if scan is None else fitted_covariance(store.read(scan))
    if fitted is not None and (text := slope_mistake(fitted)):
        raise IllPosedError(f"roughness.scan.covariance: {text}. Of a scan, measured ends at its spacing")


def _stiffness(scene: Scene, model: GaussianModel) -> tuple[float, float]:
    """E* [Pa], and the rms slope [-] of the heights on the cells."""
    return elastic.material(scene).plane_strain_modulus_pa, rms_slope(model.covariance, scene.strip.cell_m)
