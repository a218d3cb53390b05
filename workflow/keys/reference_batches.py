"""Monte Carlo references of scenes: of how many samples, in which batches, and what they depend on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roughslip.scene.plan import slice_for
from workflow.keys.key_files import replace_if_changed

# Samples of a scene's reference, and how many a batch: surfaces of the square, some half a minute on one core in
# `paper`, two in `resolved`; and strips, four minutes.
SURFACES = {"paper": (1_000_000, 200_000), "resolved": (400_000, 10_000)}
STRIPS = {"resolved": (4000, 200)}
SAMPLES = {"pressure": SURFACES, "friction": STRIPS}

# Solves cost more than an hour and follow from the physics alone: another solver finds the same pressures to 1e-6. So
# the key of a batch holds no hash of code or packages, and only a change of seed, material, roughness or geometry makes
# batches anew; that the code of today gives the kept numbers is for a test to show.
CODE = "any"


def reference_file(name: str, kind: str = "pressure") -> str:
    """The kept reference of a scene. kind : of the pressure at the centre, or of the friction of windows"""
    return f"results/reference/{name}/{kind}.nc"


def missing(names: list[str]) -> list[str]:
    """References of those scenes that have one in SAMPLES but no file yet."""
    files = [reference_file(name, kind) for name in names for kind, samples in SAMPLES.items() if name in samples]
    return [file for file in files if not Path(file).is_file()]


def solves(name: str, kind: str = "pressure", samples: int | None = None) -> list[str]:
    """Batches of the solves of a scene: all, or as many whole ones as hold the first `samples`."""
    total, step = SAMPLES[kind][name]
    firsts = range(0, total if samples is None else min(samples, total), step)
    return [f"results/{name}/{kind}_solves/{first}-{first + step}.nc" for first in firsts]


def solves_key(name: str, scene: dict[str, Any], kind: str = "pressure") -> str:
    """Path of the key file of a scene's solves, written anew where the slice of the scene changed."""
    path = f"results/{name}/{kind}_solves/key.json"
    if kind == "pressure":
        configuration = {**slice_for(scene, "surface"), "seed": scene["seed"], "material": scene["material"]}
    else:
        configuration = slice_for(scene, "contact_strip")
        del configuration["strip"]["training_samples"], configuration["numerics"]
        configuration["friction"] = {"least_contact_fraction": scene["friction"]["least_contact_fraction"]}
    return replace_if_changed(path, {"configuration": configuration, "code": CODE})
