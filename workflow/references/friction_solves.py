"""Contact solves of strips, of which the direct reference of the friction coefficient of windows is made.

A sample is one strip, from default_rng([seed, STREAM, number]), solved at every penetration of the scene as stage
contact_strip does; none of them is a strip of the study.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.contact.solve import sweep
from roughslip.friction.bowden_tabor import window_sums
from roughslip.stages.from_scene import elastic, geometry, surface_model

TOLERANCE = 1e-6  # moves area over force by 3e-6 at most, and takes 0.6 of the time of the study's 1e-10
STREAM = 25  # the second entry of every seed; 20 is the reference of the pressure, 21 to 23 are benchmarks


def windows(
    configuration: geometry.Configuration,
    fields: Iterable[np.ndarray],
    percentiles: Sequence[float],
    tolerance: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Area [m2] and force [N] : (strips, penetrations, windows) of fields : (nx, ny) [m] on the strip of the scene."""
    grid, model = geometry.strip_grid(configuration), surface_model.surface_model(configuration)
    influence, lie = elastic.influence(configuration, grid), geometry.windows(configuration)
    planes = model.plane_height(np.array(percentiles, dtype=float)).tolist()
    hardness, found = elastic.hardness_pa(configuration), []
    for field in fields:
        of_strip = np.empty((2, len(planes), lie.count))
        solutions = sweep(influence, model.heights(field), planes, tolerance, hardness_pa=hardness)
        for level, solution in enumerate(solutions):
            pressure = solution.pressure[lie.middle]
            columns = np.stack([np.count_nonzero(pressure, axis=1), pressure.sum(axis=1)])
            of_strip[:, level] = grid.cell_area * window_sums(columns, lie.length, lie.spacing)
        found.append(of_strip)
    area, force = np.stack(found, axis=1)
    return area, force


def solves(configuration: geometry.Configuration, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Area [m2] and force [N] : (strips, penetrations, windows) of strips first ... last - 1."""
    sample = surface_model.surface_model(configuration).sampler(geometry.strip_grid(configuration))
    fields = (sample(np.random.default_rng([configuration["seed"], STREAM, number])) for number in range(first, last))
    return windows(configuration, fields, configuration["strip"]["penetration_percentiles"], TOLERANCE)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--key", type=Path, required=True, help="the key file, with the scene's slice")
    parser.add_argument("--first", type=int, required=True)
    parser.add_argument("--last", type=int, required=True, help="the number after the last strip")
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()
    key = store.read_key(arguments.key)
    area, force = solves(key.configuration, arguments.first, arguments.last)
    shape = ("sample", "level", "window")
    found = {
        "area": store.Variable(shape, area, "m2", "contact area of the window"),
        "force": store.Variable(shape, force, "N", "normal force on the window"),
    }
    store.write(arguments.output, found, key, {"first": arguments.first})


if __name__ == "__main__":
    main()
