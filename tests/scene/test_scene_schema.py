"""Shipped scenes are valid; the schema is closed and says what it allows."""

import re

import pytest
import yaml
from jsonschema import Draft202012Validator

from roughslip.scene.loader import describe_allowed, load, scene_names
from roughslip.scene.schema import text
from tests.scene.shipped import CONFIG, FIGURES, KINDS, SCENES, SCHEMA, properties, shipped_scene


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_are_valid(name):
    scene = shipped_scene(name)
    assert "extends" not in scene
    assert scene == load(CONFIG / "scenes" / f"{name}.yaml", CONFIG / "scenes")


def test_shipped_scenes_are_all_tested():
    assert set(scene_names(CONFIG / "scenes")) >= set(SCENES)


def numbers(node: yaml.Node):
    """The lines (from 0) on which a mapping gives a number, or a list that holds one."""
    for key, value in node.value:
        items = value.value if isinstance(value, yaml.SequenceNode) else [value]
        if isinstance(value, yaml.MappingNode):
            yield from numbers(value)
        elif any(item.tag in ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float") for item in items):
            yield key.start_mark.line


@pytest.mark.parametrize("path", sorted((CONFIG / "scenes").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_number_says_where_it_comes_from(path):
    text = path.read_text()
    lines = text.splitlines()
    bare = [lines[n] for n in numbers(yaml.compose(text)) if not re.search(r"# (paper|assumed): \S+ \S+", lines[n])]
    assert not bare


def test_schema_is_closed_and_described():
    Draft202012Validator.check_schema(SCHEMA)
    for key, part in {"": SCHEMA, **properties(SCHEMA)}.items():
        if part["type"] == "object":
            assert part["additionalProperties"] is False, key
            assert set(part.get("required", [])) <= set(part["properties"]), key
        if key:
            assert len(part["description"].split()) >= 2, key
        if part["type"] in ("number", "integer"):
            assert {"minimum", "exclusiveMinimum"} & set(part), key


def test_units_end_the_name_and_the_description():
    units = {
        "m": "m",
        "s": "s",
        "pa": "Pa",
        "kg": "kg",
        "n": "N",
        "rad_per_s": "rad/s",
        "m_per_s": "m/s",
        "s_per_m": "s/m",
    }
    units |= {"s2_per_m2": "s^2/m^2", "per_m2": "1/m^2", "rad": "rad", "percentile": "%"}
    for key, part in properties(SCHEMA).items():
        if part["type"] in ("number", "integer"):
            endings = [ending for ending in units if key.endswith(f"_{ending}")]
            unit = units[max(endings, key=len)] if endings else "-"
            assert part["description"].endswith(f" [{unit}]"), key


def test_what_is_allowed_is_told_from_the_schema():
    allowed = {key: describe_allowed(part) for key, part in properties(SCHEMA).items()}
    assert allowed["strip.cell_m"] == "a number > 0 [m]"
    assert allowed["square.nodes"] == "a whole number >= 2 and <= 1024"
    assert allowed["material.poisson_ratio"] == "a number > -1 and <= 0.5"
    assert allowed["roughness.covariance"] == f"one of {KINDS}"
    assert allowed["oscillator.stochastic_static_limit"] == "true or false"
    assert allowed["numerics"] == "a group of the keys contact_tolerance, oscillator_tolerance"
    assert allowed["targets"] == f"a list of at least 1, each once, of one of {FIGURES}"
    assert allowed["strip.penetration_percentiles"] == "a list of 1 to 99, of a number > 0 and < 100 [%]"
    assert allowed["description"] == "text on one line, 1 to 200 characters"


def test_the_schema_for_editors_is_current():
    written = (CONFIG / "scene.schema.json").read_text(encoding="utf-8")
    assert written == text(), "run: python -m roughslip.scene.schema"
