"""From a stage's slice of the scene to what the pressure expansion expands, and in which variables."""

import math
from dataclasses import dataclass

import numpy as np

from roughslip.chaos.functionals import (
    INDEPENDENT,
    MIRRORED,
    NAMES,
    NO_SYMMETRY,
    Stencil,
    local_functionals,
    moving_frame,
    orthonormal_directions,
)
from roughslip.chaos.local import Samples
from roughslip.chaos.pressure import KINDS, Kind, PressureTarget, pressure_target, summit_curvature
from roughslip.errors import IllPosedError
from roughslip.grid import Grid
from roughslip.limits import VARIABLE_COUNTS
from roughslip.scene.expansion import BEST
from roughslip.scene.types import Scene
from roughslip.stages.from_scene import elastic
from roughslip.stages.from_scene.geometry import Nodes
from roughslip.surface.model import GaussianModel, SurfaceModel

RAW = "none"  # of expansion.rotation: the leading modes themselves
REGRESSION = "regression"  # of expansion.rotation: its direction before the local functionals
OFFSET = 3.0  # to a correlation length, of the heights around a node that further variables may take


@dataclass(frozen=True)
class Candidates:
    """What an expansion may take its variables from.

    directions : (nodes, c, M) orthonormal rows at each node that trains it, in terms of the variables of the modes
    given : the number of them that are taken in their order; those behind are a frame for further directions
    count : how many variables the scene asks for, None if that is to be found
    distance2 : (nodes,) [-] of the nodes, as in `Samples`
    odd : (c, symmetries) as in `Samples`
    regression : whether the regression direction comes before the given ones
    """

    directions: np.ndarray
    given: int
    count: int | None
    distance2: np.ndarray
    odd: np.ndarray
    regression: bool = False

    def samples(self, xi: np.ndarray, pressure: np.ndarray, gap: np.ndarray) -> Samples:
        """Surfaces xi : (K, M) with pressure [Pa] and gap [m] : (K, training nodes) in all candidates."""
        nodes = len(self.directions)
        variables = np.einsum("km,nvm->knv", xi, self.directions)
        return Samples(variables, self.distance2, pressure[:, :nodes], gap[:, :nodes], self.odd)


def candidates(scene: Scene, surface: GaussianModel, grid: Grid, modes: np.ndarray, nodes: Nodes) -> Candidates:
    """The variables that the scene names: raw modes at the centre alone, or local functionals at all training nodes.

    modes : (M, nx, ny) [m] scaled Karhunen-Loeve modes

    Further directions of the heights around a node follow the functionals in three cases: the scene asks for more
    variables than functionals, for the best number, or for a regression. The leading modes differ from node to node,
    so raw modes train at one node.
    """
    asked, unknown = scene.expansion, np.zeros((0, 0), dtype=np.int64)
    count = None if asked.variables == BEST else int(asked.variables)
    if asked.rotation == RAW:
        given = min(count or VARIABLE_COUNTS[-1], len(modes))
        return Candidates(np.eye(len(modes))[None, :given], given, count, nodes.distance2[:1], unknown)
    given = min(count or len(NAMES), len(NAMES))
    found, odd = directions(surface, grid, modes, nodes, given)
    regression = asked.rotation == REGRESSION
    if regression or count is None or count > given:
        frame = moving_frame(heights_around(surface, grid, modes, nodes), found)
        found, odd = np.concatenate([found, frame], axis=1), unknown
        if count is not None and count > found.shape[1]:
            raise IllPosedError(
                f"{count} variables were asked for; around the centre the surface has {found.shape[1]}: ask for fewer"
            )
    return Candidates(found, given, count, nodes.distance2, odd, regression)


def heights_around(surface: SurfaceModel, grid: Grid, modes: np.ndarray, nodes: Nodes) -> np.ndarray:
    """Heights of the modes : (nodes, n, M) [m] at the same offsets from every node, those that lie on the mesh.

    Up to as far as the far mean reaches, a third of a correlation length apart where the mesh resolves that.
    """
    reach, steps = stencil(surface, grid).far, []
    for length, cell, most in zip(surface.lengths_m, (grid.dx, grid.dy), reach, strict=True):
        apart = max(1, round(length / cell / OFFSET))
        steps.append(apart * np.arange(-(most // apart), most // apart + 1))
    along, across = (part.ravel() for part in np.meshgrid(*steps, indexing="ij"))
    x, y = nodes.x[:, None] + along, nodes.y[:, None] + across
    kept = np.all((x >= 0) & (x < grid.nx) & (y >= 0) & (y < grid.ny), axis=0)
    return np.moveaxis(modes[:, x[:, kept], y[:, kept]], 0, -1)


def directions(
    surface: GaussianModel, grid: Grid, modes: np.ndarray, nodes: Nodes, count: int
) -> tuple[np.ndarray, np.ndarray]:
    """The variables of an expansion at each node, in terms of those of the modes.

    modes : (M, nx, ny) [m] scaled Karhunen-Loeve modes
    count : number of variables

    Returns directions : (nodes, count, M), orthonormal rows: directions @ xi are local functionals of the heights; and
    odd : (count, symmetries) what the symmetries of the surface do to each, as in `Samples`.
    """
    functionals = local_functionals(modes, stencil(surface, grid))[:, :, nodes.x, nodes.y]
    found = np.stack([orthonormal_directions(functionals[:, :, node], count) for node in range(len(nodes.x))])
    own = np.abs(np.einsum("nvm,vmn->nv", found, functionals[:count])) / np.linalg.norm(functionals[:count], axis=1).T
    if not np.all(own > INDEPENDENT):  # one was passed over, so that a variable is not the functional of its number
        return found, np.zeros((0, 0), dtype=np.int64)
    return found, symmetries(surface)[:count]


def symmetries(surface: GaussianModel) -> np.ndarray:
    """Which functionals change sign under each symmetry of the law of the surface : (8, 2) mirrors, or (8, 1) half a
    turn, under which every covariance stays."""
    return MIRRORED if surface.mirror_symmetric else MIRRORED.sum(axis=1, keepdims=True) % 2


def mirrored_along(surface: SurfaceModel) -> np.ndarray:
    """Which functionals change sign where a strip is mirrored along its length, which keeps every row : (8, 1); (8, 0)
    where the law of the surface does not stay as it is."""
    return MIRRORED[:, :1] if surface.mirror_symmetric else NO_SYMMETRY


def targets(scene: Scene, surface: SurfaceModel, grid: Grid) -> tuple[PressureTarget, ...]:
    """The smooth variables that the square chooses from: the one that the scene names, or all of them."""
    named = scene.expansion.target
    kinds: tuple[Kind, ...] = KINDS if named == "best" else (named,)
    if math.isfinite(elastic.hardness_pa(scene)):
        kinds = tuple(kind for kind in kinds if kind != "censored")
    return tuple(_target(kind, scene, surface, grid) for kind in kinds)


def strip_target(scene: Scene, surface: SurfaceModel, grid: Grid) -> PressureTarget:
    """The smooth variable of the strip; the best is the squared pressure, on coarse meshes the trial pressure."""
    named = scene.expansion.target
    return _target("squared_pressure" if named == "best" else named, scene, surface, grid)


def _target(kind: Kind, scene: Scene, surface: SurfaceModel, grid: Grid) -> PressureTarget:
    return pressure_target(
        kind,
        influence_diagonal=elastic.influence(scene, grid).diagonal,
        plane_strain_modulus_pa=elastic.material(scene).plane_strain_modulus_pa,
        summit_curvature_per_m=summit_curvature(surface.rms_height_m, math.sqrt(math.prod(surface.lengths_m))),
        hardness_pa=elastic.hardness_pa(scene),
    )


def stencil(surface: SurfaceModel, grid: Grid) -> Stencil:
    """Boxes of the near and far mean: half widths of 0.5 and 2 correlation lengths, at least 1 and 2 nodes."""
    axes = list(zip(surface.lengths_m, (grid.dx, grid.dy), strict=True))
    near = [max(1, round(0.5 * length / cell)) for length, cell in axes]
    far = [max(2, round(2.0 * length / cell)) for length, cell in axes]
    return Stencil((near[0], near[1]), (far[0], far[1]))
