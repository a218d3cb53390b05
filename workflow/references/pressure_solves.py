"""Contact solves of a scene's square at three penetrations, of which the reference of the centre's pressure is made.

A sample is one surface, its Karhunen-Loeve variables from default_rng([seed, STREAM, number]), solved at every
penetration. Kept are pressure and gap of the four central nodes, in the order of `nodes.central_nodes`: falling
number along x, and for each of these falling number along y.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.contact.solve import sweep
from roughslip.stages.from_scene import elastic, geometry, surface_model
from roughslip.stages.from_scene.nodes import central_nodes
from roughslip.surface.karhunen_loeve import heights, karhunen_loeve

PERCENTILES = (20.0, 50.0, 80.0)
STREAM = 20  # the second entry of every seed; streams of the study are below 20
TOLERANCE = 1e-6  # far below the sampling error of any number of samples
KEPT = np.float32  # seven digits, and half the size


def variables(seed: int, number: int, modes: int) -> np.ndarray:
    """xi : (modes,) standard normal of one sample."""
    return np.random.default_rng([seed, STREAM, number]).standard_normal(modes)


def solves(configuration: geometry.Configuration, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Pressure [Pa] and gap [m] : (samples, penetrations, central nodes) of samples first ... last - 1."""
    model, grid = surface_model.gaussian_model(configuration), geometry.square_grid(configuration)
    order, share = (configuration["square"].get(name) for name in ("modes", "variance_share"))
    modes = karhunen_loeve(model.covariance, grid, order, share=share).modes
    planes = np.array([float(model.plane_height(percentile)) for percentile in PERCENTILES])
    hardness = elastic.hardness_pa(configuration)
    influence, nodes = elastic.influence(configuration, grid), central_nodes(model, grid)
    shape = (last - first, len(planes), len(nodes.x))
    pressure, gap = np.empty(shape, dtype=KEPT), np.empty(shape, dtype=KEPT)
    for row, number in enumerate(range(first, last)):
        z = model.heights(heights(modes, variables(configuration["seed"], number, len(modes))))
        for level, solution in enumerate(sweep(influence, z, planes, TOLERANCE, hardness_pa=hardness)):
            pressure[row, level] = solution.pressure[nodes.x, nodes.y]
            gap[row, level] = solution.signed_gap[nodes.x, nodes.y]
    return pressure, gap


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--key", type=Path, required=True, help="the key file, with the scene's slice")
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--last", type=int, required=True, help="the number after the last sample")
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()
    key = store.read_key(arguments.key)
    pressure, gap = solves(key.configuration, arguments.first, arguments.last)
    dimensions = ("sample", "penetration", "node")
    found = {
        "pressure": store.Variable(dimensions, pressure, "Pa", "contact pressure at the central nodes"),
        "gap": store.Variable(dimensions, gap, "m", "gap at the central nodes"),
        "percentile": store.Variable(("penetration",), np.array(PERCENTILES), "percent", "penetration"),
    }
    store.write(arguments.output, found, key, {"first": arguments.first})


if __name__ == "__main__":
    main()
