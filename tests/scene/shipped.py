"""The scenes and the schema that are shipped, and texts that several tests of scenes use."""

from pathlib import Path

import pytest
import yaml

from roughslip.errors import InputError
from roughslip.scene.loader import load
from roughslip.scene.schema import scene_schema

CONFIG = Path(__file__).parents[2] / "config"
SCHEMA = scene_schema()
CASES = ("cam_follower", "clutch", "disc_brake", "rubber_bearing", "slideway")  # of engineering, each with a load
SCENES = (
    *("coulomb", "elastoplastic", "excited", "excited_away", "fractal", "given", "measured", "nongaussian", "paper"),
    *("quick", "resolved", "smoke", *CASES),
)
PAPER = yaml.safe_load((CONFIG / "scenes" / "paper.yaml").read_text())
KNOWN = ", ".join(sorted((*SCENES, "mine")))
KINDS = "exponential, gaussian, matern, self_affine, separable_exponential"
FIGURES = (
    "answer, figure2, figure3, figure5, figure_chain, figure_field, figure_map, figure_residence, figure_scan, readings"
)
FRACTAL = "{hurst: 0.8, azimuths: 8, gamma: 1.5}"
SCAN = "{file: a.x3p, form: plane, covariance: best, marginal: gaussian}"
STATISTICS = "{mean: 0.3, standard_deviation: 0.05, correlation_length_m: 2.5e-4, beta_shapes: [2.1, 5]}"
TABLE = "[[0, 0.4], [1, 0.3]]"


def shipped_scene(name: str) -> dict:
    return load(name, CONFIG / "scenes")


def lines_of(call, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return list(caught.value.lines)


def properties(schema: dict, prefix: str = "") -> dict[str, dict]:
    """Every property of the schema by its dotted key, sections among them."""
    found = {}
    for key, part in schema.get("properties", {}).items():
        found[prefix + key] = part
        found |= properties(part, f"{prefix}{key}.")
    return found
