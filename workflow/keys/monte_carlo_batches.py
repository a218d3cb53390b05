"""Monte Carlo references of scenes: their numbers of samples, their batches, and what a batch depends on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from roughslip.scene.types import slice_for, without_nulls

# Samples of a scene's reference, and of a batch. A batch of surfaces takes about half a minute on one core in `paper`
# and two minutes in `resolved`; a batch of strips takes four minutes.
SURFACES = {"paper": (1_000_000, 200_000), "resolved": (400_000, 10_000)}
STRIPS = {"resolved": (4000, 200)}
SAMPLES = {"pressure": SURFACES, "friction": STRIPS}

# Solves take more than an hour and depend on the physics alone: another solver finds the same pressures to 1e-6. So the
# key of a batch holds no hash of code or packages. Only a change of seed, material, roughness or geometry makes batches
# again. A test shows that the present code reproduces the kept numbers.


def reference_file(name: str, kind: str = "pressure") -> str:
    """Return the path of the kept Monte Carlo reference of a scene.

    kind : "pressure" at the centre, or "friction" of windows
    """
    return f"results/reference/{name}/{kind}.nc"


def missing(names: list[str]) -> list[str]:
    """Return the references in SAMPLES of those scenes whose file does not exist."""
    files = [reference_file(name, kind) for name in names for kind, samples in SAMPLES.items() if name in samples]
    return [file for file in files if not Path(file).is_file()]


def ranges(name: str, kind: str = "pressure", samples: int | None = None) -> list[tuple[int, int]]:
    """Return the batches [first, last) of a scene: all, or as many whole ones as hold the first `samples`."""
    total, step = SAMPLES[kind][name]
    firsts = range(0, total if samples is None else min(samples, total), step)
    return [(first, first + step) for first in firsts]


def configuration(scene: dict[str, Any], kind: str = "pressure") -> dict[str, Any]:
    """Return the slice of a scene that its solves depend on."""
    if kind == "pressure":
        return {
            **without_nulls(slice_for(scene, "karhunen_loeve")),
            "seed": scene["seed"],
            "material": scene["material"],
        }
    part = without_nulls(slice_for(scene, "contact_strip"))
    del part["strip"]["training_samples"]
    part["numerics"] = {"contact_area": part["numerics"]["contact_area"]}
    part["friction"] = {"least_contact_fraction": scene["friction"]["least_contact_fraction"]}
    return part
