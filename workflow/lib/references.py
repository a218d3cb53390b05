"""Monte Carlo references of scenes: how many surfaces, in which batches, and what they depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roughslip.scene_rules import slice_for
from workflow.lib.keys import replace_if_changed

# Surfaces of a scene's reference, and how many a batch: some half a minute on one core in `paper`, two in `resolved`.
SURFACES = {"paper": (1_000_000, 200_000), "resolved": (400_000, 10_000)}

# Solves cost more than an hour and follow from the physics alone: another solver finds the same pressures to 1e-6. So
# the key of a batch holds no hash of code or packages, and only a change of seed, material, roughness or square makes
# batches anew; that the code of today gives the kept numbers is for a test to show.
CODE = "any"


def reference_file(name: str) -> str:
    """The kept reference of a scene."""
    return f"results/reference/{name}/pressure.nc"


def missing(names: list[str]) -> list[str]:
    """References of those scenes that have one in SURFACES but no file yet."""
    return [reference_file(name) for name in names if name in SURFACES and not Path(reference_file(name)).is_file()]


def solves(name: str, surfaces: int | None = None) -> list[str]:
    """Batches of the solves of a scene: all, or as many whole ones as hold the first `surfaces`."""
    total, step = SURFACES[name]
    firsts = range(0, total if surfaces is None else min(surfaces, total), step)
    return [f"results/{name}/pressure_solves/{first}-{first + step}.nc" for first in firsts]


def solves_key(name: str, scene: dict[str, Any]) -> str:
    """Path of the key file of a scene's solves, written anew where the slice of the scene changed."""
    path = f"results/{name}/pressure_solves/key.json"
    configuration = {**slice_for(scene, "surface"), "seed": scene["seed"], "material": scene["material"]}
    replace_if_changed(Path(path), {"configuration": configuration, "code": CODE})
    return path
