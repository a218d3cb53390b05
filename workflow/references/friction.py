"""The direct reference of the friction coefficient of windows, gathered from the strips of `friction_solves`.

Told in units of the shear strength, as area over force [1/Pa]: what the shear strength is, a scene sets by the mean at
the median, which is an estimate itself. Standard errors are those of resampled strips.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from roughslip import store
from roughslip.friction.bowden_tabor import friction_coefficient
from roughslip.friction.resampling import strip_weights
from roughslip.friction.statistics import window_statistics

REPLICATES = 1000  # a standard error is then known to 2 %
SEED = 26
NUMBERS = {"mean": "Pa-1", "std": "Pa-1", "variation": "1", "skewness": "1", "kurtosis": "1", "missing_share": "1"}


def gathered(area: np.ndarray, force: np.ndarray, configuration: dict[str, Any]) -> dict[str, store.Variable]:
    """What is kept of windows : (strips, penetrations, windows) [m2], [N].

    Raises IllPosedError as `window_statistics` does, as for too few strips in contact.
    """
    strip = configuration["strip"]
    least = configuration["friction"]["least_contact_fraction"] * strip["window_m"] * strip["width_m"]
    weights = strip_weights(len(area), REPLICATES, np.random.default_rng(SEED))
    rows = []
    for level in range(area.shape[1]):
        statistics = window_statistics(*friction_coefficient(area[:, level], force[:, level], 1.0, least), weights)
        rows.append([getattr(statistics, name) for name in NUMBERS])
    found = {
        "percentile": store.Variable(("level",), strip["penetration_percentiles"], "percent", "penetration"),
        "strips": store.Variable((), len(area), "1", "strips that were solved"),
    }
    for column, (name, unit) in enumerate(NUMBERS.items()):
        estimates = [row[column] for row in rows]
        title = f"{name.replace('_', ' ')} of area over force of windows"
        errors = [estimate.replicates.std(ddof=1) for estimate in estimates]
        found[name] = store.Variable(("level",), [float(each.value) for each in estimates], unit, title)
        found[f"{name}_standard_error"] = store.Variable(("level",), errors, unit, f"standard error of the {title}")
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--key", type=Path, required=True, help="the key file of the solves")
    parser.add_argument("--solves", type=Path, nargs="+", required=True)
    parser.add_argument("--output", type=Path, required=True)
    arguments = parser.parse_args()
    key, batches = store.read_key(arguments.key), store.read_all(arguments.solves)
    area, force = (store.join(batches, name) for name in ("area", "force"))
    store.write(arguments.output, gathered(area, force, key.configuration), key)


if __name__ == "__main__":
    main()
