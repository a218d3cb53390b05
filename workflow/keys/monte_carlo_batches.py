"""Monte Carlo references of scenes: their numbers of samples, their batches, and what a batch depends on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roughslip.scene.plan import slice_for
from roughslip.scene.types import without_nulls
from workflow.keys.key_files import replace_if_changed

# Samples of a scene's reference, and of a batch. A batch of surfaces takes about half a minute on one core in `paper`
# and two minutes in `resolved`; a batch of strips takes four minutes.
SURFACES = {"paper": (1_000_000, 200_000), "resolved": (400_000, 10_000)}
STRIPS = {"resolved": (4000, 200)}
SAMPLES = {"pressure": SURFACES, "friction": STRIPS}

# Solves take more than an hour and depend on the physics alone: another solver finds the same pressures to 1e-6. So the
# key of a batch holds no hash of code or packages. Only a change of seed, material, roughness or geometry makes batches
# again. A test shows that the present code reproduces the kept numbers.
CODE = "any"


def reference_file(name: str, kind: str = "pressure") -> str:
    """Return the path of the kept Monte Carlo reference of a scene.

    kind : "pressure" at the centre, or "friction" of windows
    """
    return f"results/reference/{name}/{kind}.nc"


def missing(names: list[str]) -> list[str]:
    """Return the references in SAMPLES of those scenes whose file does not exist."""
    files = [reference_file(name, kind) for name in names for kind, samples in SAMPLES.items() if name in samples]
    return [file for file in files if not Path(file).is_file()]


def solves(name: str, kind: str = "pressure", samples: int | None = None) -> list[str]:
    """Return the batches of a scene: all, or as many whole ones as hold the first `samples`."""
    total, step = SAMPLES[kind][name]
    firsts = range(0, total if samples is None else min(samples, total), step)
    return [f"results/{name}/{kind}_solves/{first}-{first + step}.nc" for first in firsts]


def solves_key(name: str, scene: dict[str, Any], kind: str = "pressure") -> str:
    """Write the key file of a scene's solves if the slice of the scene changed, and return its path."""
    path = f"results/{name}/{kind}_solves/key.json"
    if kind == "pressure":
        configuration = {
            **without_nulls(slice_for(scene, "karhunen_loeve")),
            "seed": scene["seed"],
            "material": scene["material"],
        }
    else:
        configuration = without_nulls(slice_for(scene, "contact_strip"))
        del configuration["strip"]["training_samples"]
        configuration["numerics"] = {"contact_area": configuration["numerics"]["contact_area"]}
        configuration["friction"] = {"least_contact_fraction": scene["friction"]["least_contact_fraction"]}
    return replace_if_changed(path, {"configuration": configuration, "code": CODE})
