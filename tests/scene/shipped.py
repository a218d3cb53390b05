"""The scenes and the schema that are shipped, and texts that several tests of scenes use.

Strategies for scenes: overlays on shipped ones, with values that the schema allows or with any.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import strategies as st

from roughslip.errors import InputError
from roughslip.scene.loader import load
from roughslip.scene.schema import scene_schema

CONFIG = Path(__file__).parents[2] / "config"
SCHEMA = scene_schema()
CASES = ("cam_follower", "clutch", "disc_brake", "rubber_bearing", "slideway")  # of engineering, each with a load
LONG = tuple(f"{name}_long" for name in CASES)  # the same with waves ten times as long
SCENES = (
    *("coulomb", "elastoplastic", "excited", "excited_away", "fractal", "given", "measured", "nongaussian", "paper"),
    *("quick", "resolved", "smoke", "tribometer", *CASES, *LONG),
)
PAPER = yaml.safe_load((CONFIG / "scenes" / "paper.yaml").read_text())
KNOWN = ", ".join(sorted((*SCENES, "mine")))
KINDS = "exponential, gaussian, matern, self_affine"
FIGURES = (
    "answer, figure2, figure3, figure5, figure_budget, figure_chain, figure_map, "
    "figure_record, figure_scan, friction_against_load"
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
    scenes = {}
    for key, part in schema.get("properties", {}).items():
        scenes[prefix + key] = part
        scenes |= properties(part, f"{prefix}{key}.")
    return scenes


LEAVES = {key: part for key, part in properties(SCHEMA).items() if part["type"] != "object" and key != "extends"}

WILD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**40), 10**40),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["1e9", "auto", "best", ".inf", "0x10", "1_000", "~", "../x", "$(true)", "a\nb", "a;b", "{scene}"]),
    st.lists(st.floats(), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
    st.recursive(st.integers(), lambda inner: st.lists(inner, max_size=2), max_leaves=4),
)


def allowed(part: dict[str, Any]) -> st.SearchStrategy:
    """Values that a part of the schema allows, its ends among them."""
    kind = part["type"]
    if isinstance(kind, list):
        return st.one_of(allowed({**part, "type": kind[0]}), st.just(part["pattern"].strip("^$")))
    if "enum" in part:
        return st.sampled_from(part["enum"])
    if kind == "boolean":
        return st.booleans()
    if kind == "string":
        return st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "S"]), min_size=1, max_size=30)
    if kind == "array":
        most = min(part.get("maxItems", 5), 5)
        unique = part.get("uniqueItems", False)
        items = st.lists(allowed(part["items"]), min_size=part["minItems"], max_size=most, unique=unique)
        return items if unique else items.map(_sorted)
    low = part.get("minimum", part.get("exclusiveMinimum"))
    high = part.get("maximum", part.get("exclusiveMaximum", 1.0))
    if kind == "integer":
        small = st.integers(low, min(high, low + 300))
        return st.one_of(small, small, st.integers(low, high))
    bounds = {"exclude_min": "exclusiveMinimum" in part, "exclude_max": "exclusiveMaximum" in part}
    return st.floats(float(low), float(high), allow_nan=False, **bounds)


def _sorted(items: list[Any]) -> list[Any]:
    """Numbers in their order; words and lists as they are."""
    return sorted(items) if all(isinstance(item, int | float) for item in items) else items


@st.composite
def overlays(draw: st.DrawFn, scenes: tuple[str, ...], *, valid: bool) -> dict[str, Any]:
    """A scene that extends a shipped one and changes some of its keys."""
    scene: dict[str, Any] = {"extends": draw(st.sampled_from(scenes))}
    for key in draw(st.lists(st.sampled_from(sorted(LEAVES)), max_size=4, unique=True)):
        value = draw(allowed(LEAVES[key]) if valid else st.one_of(allowed(LEAVES[key]), WILD))
        *sections, last = key.split(".")
        inner = scene
        for section in sections:
            inner = inner.setdefault(section, {})
        inner[last] = value
    if not valid and draw(st.booleans()):
        place = draw(st.sampled_from([None, *[key for key in scene if isinstance(scene[key], dict)]]))
        (scene if place is None else scene[place])[draw(st.text(max_size=12))] = draw(WILD)
    return scene
