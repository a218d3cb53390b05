"""Contact solves of strips, of which the direct reference of the friction coefficient of windows is made.

A sample is one strip, from default_rng([seed, STREAM, number]), solved at every penetration of the scene as stage
contact_strip does; none of them is a strip of the study.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from roughslip import store
from roughslip.contact.solve import sweep
from roughslip.friction.bowden_tabor import window_sums
from roughslip.stages import elastic, geometry, surfaces

TOLERANCE = 1e-6  # moves area over force by 3e-6 at most, and takes 0.6 of the time of the study's 1e-10
STREAM = 25  # the second entry of every seed; 20 is the reference of the pressure, 21 to 23 are benchmarks


def solves(configuration: geometry.Configuration, first: int, last: int) -> tuple[np.ndarray, np.ndarray]:
    """Area [m2] and force [N] : (strips, penetrations, windows) of strips first ... last - 1."""
    grid, model = geometry.strip_grid(configuration), surfaces.surface_model(configuration)
    sample, influence = model.sampler(grid), elastic.influence(configuration, grid)
    planes = model.plane_height(np.array(configuration["strip"]["penetration_percentiles"], dtype=float)).tolist()
    hardness, windows = elastic.hardness_pa(configuration), geometry.windows(configuration)
    found = np.empty((2, last - first, len(planes), windows.count))
    for row, number in enumerate(range(first, last)):
        heights = model.heights(sample(np.random.default_rng([configuration["seed"], STREAM, number])))
        for level, solution in enumerate(sweep(influence, heights, planes, TOLERANCE, hardness_pa=hardness)):
            pressure = solution.pressure[windows.middle]
            columns = np.stack([np.count_nonzero(pressure, axis=1), pressure.sum(axis=1)])
            for total, column in zip(found, columns, strict=True):
                total[row, level] = grid.cell_area * window_sums(column, windows.length, windows.spacing)
    return found[0], found[1]


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
