"""The Monte Carlo reference of the pressure at the centre of a scene's square, at three penetrations.

A sample is one surface, its Karhunen-Loeve variables from default_rng([seed, STREAM, number]), solved at every
penetration. Its four central nodes have one distribution but are not independent. So every standard error takes the sum
over a surface as one observation (clusters).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from roughslip import store
from roughslip.contact.solve import sweep
from roughslip.errors import InputError
from roughslip.grid import Grid
from roughslip.scene.mistakes import Values
from roughslip.scene.types import Scene, scene_of, slice_for, without_nulls
from roughslip.stages.from_scene import elastic, geometry, surface_model
from roughslip.stages.from_scene.geometry import Nodes, central_nodes
from roughslip.surface.model import GaussianModel
from roughslip.surface.modes import heights, karhunen_loeve

# By scene, the samples of its reference and of a batch, which takes half a minute on one core in `paper`, else two.
SAMPLES = {"paper": (1_000_000, 200_000), "resolved": (400_000, 10_000)}
PERCENTILES = (20.0, 50.0, 80.0)
STREAM = 20  # the second entry of every seed; streams of the study are below 20
TOLERANCE = 1e-6  # far below the sampling error of any number of samples
KEPT = np.float32  # seven digits, and half the size
STEPS = 380  # of the table of the distribution, equal in the probability given contact
TAIL = 10  # steps into which the first and the last are divided in geometric progression
LEAST = 1e-5  # probability where that progression starts


def slice_of(scene: Values) -> Values:
    """The part of a scene that its solves depend on."""
    part = without_nulls(slice_for(scene, "karhunen_loeve"))
    return {**part, "seed": scene["seed"], "material": scene["material"]}


def square_of(scene: Scene) -> tuple[GaussianModel, Grid, np.ndarray, Nodes]:
    """Return the surface model, the mesh, the modes (M, nx, ny) [m], and the central nodes of a scene's square."""
    model, grid = surface_model.gaussian_model(scene), geometry.square_grid(scene)
    modes = karhunen_loeve(model.covariance, grid, scene.square.modes, share=scene.square.variance_share).modes
    return model, grid, modes, central_nodes(model.lengths_m, grid)


def solve(configuration: Values, first: int, last: int) -> dict[str, store.Variable]:
    """Return pressure and gap (samples, penetrations, central nodes) of samples first ... last - 1.

    The nodes are in the order of `geometry.central_nodes`.
    """
    scene = scene_of(configuration)
    model, grid, modes, nodes = square_of(scene)
    planes = np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES])
    hardness, influence = elastic.hardness_pa(scene), elastic.influence(scene, grid)
    pressure, gap = np.empty((2, last - first, len(planes), len(nodes.x)), dtype=KEPT)
    for row, number in enumerate(range(first, last)):
        xi = np.random.default_rng([scene.seed, STREAM, number]).standard_normal(len(modes))
        z = model.heights(heights(modes, xi))
        for level, solution in enumerate(sweep(influence, z, planes, TOLERANCE, hardness_pa=hardness)):
            pressure[row, level] = solution.pressure[nodes.x, nodes.y]
            gap[row, level] = solution.signed_gap[nodes.x, nodes.y]
    dimensions = ("sample", "penetration", "node")
    return {
        "pressure": store.Variable(dimensions, pressure, "Pa", "contact pressure at the central nodes"),
        "gap": store.Variable(dimensions, gap, "m", "gap at the central nodes"),
        "percentile": store.Variable(("penetration",), np.array(PERCENTILES), "percent", "penetration"),
    }


def choose_levels(pressure: np.ndarray) -> np.ndarray:
    """Return levels [Pa] of the kept distribution, ascending, from zero to the largest pressure."""
    even = np.linspace(0.0, 1.0, STEPS + 1)
    tail = np.geomspace(LEAST, even[1], TAIL, endpoint=False)
    probabilities = np.sort(np.concatenate([even, tail, 1.0 - tail]))
    return np.concatenate([[0.0], np.quantile(pressure[pressure > 0], probabilities)])


def clustered_mean(values: np.ndarray) -> tuple[float, float]:
    """Return the mean over values (surfaces, nodes) and its clustered standard error."""
    of_surface = values.mean(axis=1, dtype=np.float64)
    return float(of_surface.mean()), float(of_surface.std(ddof=1) / np.sqrt(len(of_surface)))


def gather(_: Values, batches: Sequence[Mapping[str, np.ndarray]]) -> dict[str, store.Variable]:
    """Return distribution and means of the pressures (surfaces, penetrations, nodes) [Pa] of all batches.

    Raises InputError for a penetration without contact or with fewer than two surfaces.
    """
    pressure = np.concatenate([batch["pressure"] for batch in batches])
    if len(pressure) < 2 or not (pressure > 0).any(axis=(0, 2)).all():
        raise InputError(["a reference needs two surfaces and contact at every penetration: gather more surfaces"])
    of_level, of_penetration = ("penetration", "level"), ("penetration",)
    levels, rows = [], []
    for number in range(pressure.shape[1]):
        nodes = np.ascontiguousarray(pressure[:, number])
        levels.append(choose_levels(nodes.astype(np.float64)))
        share, error = np.transpose([clustered_mean(nodes <= level) for level in levels[-1]])
        rows.append(((share, error), (1.0 - share[0], error[0]), clustered_mean(nodes)))
    reference = {
        "level": store.Variable(of_level, np.array(levels), "Pa", "levels from zero to the largest pressure"),
        "percentile": store.Variable(of_penetration, batches[0]["percentile"], "percent", "penetration"),
        "surfaces": store.Variable((), len(pressure), "1", "surfaces that were solved"),
        "nodes": store.Variable((), pressure.shape[2], "1", "nodes of a surface whose pressure counts"),
    }
    numbers = (
        ("cumulative", of_level, "1", "share of the pressures that are at most the level, zeros included"),
        ("contact_probability", of_penetration, "1", "share of the pressures above zero"),
        ("mean_pressure", of_penetration, "Pa", "mean pressure, zeros included"),
    )
    for (name, dimensions, units, title), column in zip(numbers, zip(*rows, strict=True), strict=True):
        values, errors = (np.array(part) for part in zip(*column, strict=True))
        reference[name] = store.Variable(dimensions, values, units, title)
        reference[f"{name}_standard_error"] = store.Variable(dimensions, errors, units, f"standard error of {name}")
    return reference
