"""The scenes that are shipped, texts that several tests of scenes use, and mixtures of shipped scenes."""

import math
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from hypothesis import strategies as st

from roughslip.errors import InputError
from roughslip.scene.files import scene_names
from roughslip.scene.loader import load
from roughslip.scene.roughness import COVARIANCES
from roughslip.scene.schema import keys
from roughslip.scene.types import get, part_of
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


@cache
def shipped_scene(name: str) -> dict:
    """Read once; who changes it copies it."""
    return load(name, CONFIG / "scenes")


def slice_for(scene: dict, stage: str) -> dict:
    """The part of the scene that a stage reads."""
    return part_of(scene, STAGES[stage].keys)


def lines_of(call, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return list(caught.value.lines)


ODD = (None, True, -1, 0, 10**40, math.inf, math.nan, "1e9", "~", "a\nb", "../x", "a.py:B", [], {"value": 1})


def values(key: str) -> list[Any]:
    """What shipped scenes give for a key, the ends of its range, and what is no such value."""
    part, given = LEAVES[key], [get(shipped_scene(name), key) for name in SCENES]
    ends = [part[end] for end in ("minimum", "maximum", "exclusiveMaximum") if end in part]
    return [*(value for value in given if value is not None), *ends, *part.get("enum", ()), *ODD]


@st.composite
def overlays(draw: st.DrawFn) -> dict[str, Any]:
    """A scene that extends a shipped one and changes some of its keys."""
    scene: dict[str, Any] = {"extends": draw(st.sampled_from(SCENES))}
    for key in draw(st.lists(st.sampled_from(sorted(LEAVES)), max_size=4, unique=True)):
        *sections, last = key.split(".")
        place = scene
        for section in sections:
            place = place.setdefault(section, {})
        place[last] = draw(st.sampled_from(values(key)))
    return scene
