"""The scenes that are shipped, texts that several tests of scenes use, and scenes at random as overlays on them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import strategies as st

from roughslip.errors import InputError
from roughslip.scene.files import scene_names
from roughslip.scene.loader import load
from roughslip.scene.roughness import COVARIANCES
from roughslip.scene.schema import inner, keys
from roughslip.scene.types import part_of
from roughslip.study.graph import STAGES, targets

CONFIG = Path(__file__).parents[2] / "config"
SCENES = tuple(scene_names(CONFIG / "scenes"))
CASES = ("cam_follower", "clutch", "disc_brake", "rubber_bearing", "slideway")  # of engineering, each with a load
WORDS = {
    "{KNOWN}": ", ".join(sorted((*SCENES, "mine"))),
    "{KINDS}": ", ".join(COVARIANCES),
    "{FIGURES}": ", ".join(targets()),
}
SCAN = "{file: a.x3p, form: plane, covariance: best, marginal: gaussian}"
TABLE = "[[0, 0.4], [1, 0.3]]"
LEAVES = {key: part for key, part in keys() if part["type"] != "object" and key != "extends"}


def shipped_scene(name: str) -> dict:
    return load(name, CONFIG / "scenes")


def slice_for(scene: dict, stage: str) -> dict:
    """The part of the scene that a stage reads."""
    return part_of(scene, STAGES[stage].keys)


def lines_of(call, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return list(caught.value.lines)


WILD = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-(10**40), 10**40),
    st.floats(),
    st.text(max_size=20),
    st.sampled_from(["1e9", "best", ".inf", "0x10", "1_000", "~", "../x", "$(true)", "a\nb", "a;b", "{x}", "a.py:B"]),
    st.lists(st.floats(), max_size=3),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
    st.recursive(st.integers(), lambda one: st.lists(one, max_size=2), max_leaves=4),
)


def allowed(part: dict[str, Any]) -> st.SearchStrategy:
    """Values that a part of the schema allows, its ends among them."""
    if "enum" in part:
        return st.sampled_from(part["enum"])
    if part["type"] == "boolean":
        return st.booleans()
    if part["type"] == "string":
        return st.text(st.characters(codec="utf-8", categories=["L", "N", "P", "S"]), min_size=1, max_size=30)
    if part["type"] == "array":
        most, unique = min(part.get("maxItems", 5), 5), part.get("uniqueItems", False)
        items = st.lists(allowed(inner(part, 0)), min_size=part["minItems"], max_size=most, unique=unique)
        return items if unique else st.one_of(items, items.map(sorted))
    low = part.get("minimum", part.get("exclusiveMinimum"))
    high = part.get("maximum", part.get("exclusiveMaximum", 1.0))
    if part["type"] == "integer":
        return st.one_of(st.integers(low, min(high, low + 300)), st.integers(low, high))
    bounds = {"exclude_min": "exclusiveMinimum" in part, "exclude_max": "exclusiveMaximum" in part}
    return st.floats(float(low), float(high), allow_nan=False, **bounds)


@st.composite
def overlays(draw: st.DrawFn, scenes: tuple[str, ...], *, valid: bool) -> dict[str, Any]:
    """A scene that extends a shipped one and changes some of its keys."""
    scene: dict[str, Any] = {"extends": draw(st.sampled_from(scenes))}
    for key in draw(st.lists(st.sampled_from(sorted(LEAVES)), max_size=4, unique=True)):
        value = draw(allowed(LEAVES[key]) if valid else st.one_of(allowed(LEAVES[key]), WILD))
        *sections, last = key.split(".")
        place = scene
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = value
    if not valid and draw(st.booleans()):
        place = draw(st.sampled_from([scene, *[value for value in scene.values() if isinstance(value, dict)]]))
        place[draw(st.text(max_size=12))] = draw(WILD)
    return scene
