"""The scene as types: what stages get of it, the schema that is generated from it, and what that says."""

import ast
import dataclasses
import inspect
import math
from functools import reduce

import pytest
from jsonschema import Draft202012Validator

from roughslip.scene import fields, schema
from roughslip.scene.types import Scene, get, scene_of
from tests.scene.shipped import CONFIG, SCENES, SCHEMA, properties, shipped_scene

UNITS = {
    "m": "m",
    "s": "s",
    "pa": "Pa",
    "kg": "kg",
    "n": "N",
    "rad": "rad",
    "rad_per_s": "rad/s",
    "m_per_s": "m/s",
    "s_per_m": "s/m",
    "n_per_m": "N/m",
    "s2_per_m2": "s^2/m^2",
    "n_s_per_m": "N s/m",
    "per_m2": "1/m^2",
    "m2": "m^2",
    "percentile": "%",
}


def sections(kind: type[fields.Section]) -> list[type[fields.Section]]:
    inner = [field.metadata["kind"] for field in dataclasses.fields(kind) if field.metadata["kind"]]
    return [kind, *(section for one in inner for section in sections(one))]


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_becomes_an_object_with_all_its_values_and_defaults(name):
    values = shipped_scene(name)
    for key, part in properties(SCHEMA).items():
        expected = None if part["type"] == "object" or key == "extends" else get(values, key)
        if expected is not None:
            found = reduce(getattr, key.split("."), scene_of(values))
            assert found == (tuple(expected) if isinstance(expected, list) else expected)


def test_defaults_and_absent_sections():
    scene = {"oscillator": {"law": "coulomb"}, "roughness": {"marginal": {"family": "beta", "shapes": [1, 2]}}}
    assert get(scene, "oscillator.law") == "coulomb"
    assert get(scene, "oscillator.friction_follows") == get({}, "oscillator.friction_follows") == "slip"
    assert get(scene, "roughness.scan.file") is None
    assert get(scene, "strip") is None
    marginal = {"family": "beta", "shapes": [1, 2], "mirrored": False, "correct_correlation": False}
    assert get(scene, "roughness.marginal") == get(scene, "roughness")["marginal"] == marginal
    with pytest.raises(KeyError, match=r"oscillator\.laws is no key of a scene"):
        get(scene, "oscillator.laws")
    found = scene_of(scene)
    assert (found.oscillator.law, found.oscillator.windows_in_parallel) == ("coulomb", 1)
    assert found.friction.statistics is found.roughness.scan is None
    assert found.roughness.marginal.shapes == (1, 2)


def test_a_key_that_was_not_read_is_named():
    scene = scene_of({"strip": {"cell_m": 1e-6, "samples": 8}}, ["strip.cell_m", "strip.expansion_spacing_m"])
    assert scene.strip.cell_m == 1e-6
    with pytest.raises(AttributeError, match=r"^strip\.samples is not among the keys that this stage reads;"):
        _ = scene.strip.samples
    with pytest.raises(AttributeError, match=r"^seed is not among"):
        _ = scene.seed
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.strip.cell_m = 2e-6
    assert repr(scene.strip) == "Strip(cell_m=1e-06, expansion_spacing_m=None)"


def test_sections_hold_fields_only():
    """The hash of a stage's code leaves them out: their values stand in its slice."""
    for section in sections(Scene):
        tree = ast.parse(inspect.getsource(section))
        assert {type(node) for node in tree.body[0].body} <= {ast.Expr, ast.AnnAssign}, section


def test_the_schema_for_editors_is_current():
    written = (CONFIG / "scene.schema.json").read_text(encoding="utf-8")
    assert written == schema.text(), "run: python -m roughslip.scene.schema"


VALUES = (0, 1, -1, 50, 0.5, 1e-6, 1e30, "auto", "stribeck", "figure2", "x" * 300, "", [], [1], [0.5, 2.0], [2, 1, 2])
VALUES += (["mass", "load"], ["mass", "mass"], [["a"]], [[0.0, 0.4], [1, 0.3]], {}, {"law": 1}, None, True)


def test_the_check_of_values_is_that_of_json_schema():
    """By jsonschema, an independent judge. No double holds the last two, which it takes for numbers."""
    accepted = 0
    for key, part in properties(SCHEMA).items():
        if key == "sweep":  # its keys are dotted, and scene/sweep.py checks them
            continue
        for value in VALUES:
            ours = not any(schema.refusals(value, part))
            assert ours == Draft202012Validator(part).is_valid(value), (key, value)
            accepted += ours
        assert all(any(schema.refusals(value, part)) for value in (math.inf, 10**400))
    assert accepted > 200


def test_the_schema_is_closed_described_and_gives_units():
    Draft202012Validator.check_schema(SCHEMA)
    for key, part in {"": SCHEMA, **properties(SCHEMA)}.items():
        if part["type"] == "object" and key != "sweep":  # its keys are dotted, and scene/sweep.py checks them
            assert part["additionalProperties"] is False, key
            assert set(part.get("required", [])) <= set(part["properties"]), key
        assert len(part["description"].split()) >= 2, key
        if part["type"] in ("number", "integer"):
            assert {"minimum", "exclusiveMinimum"} & set(part), key
            endings = [ending for ending in UNITS if key.endswith(f"_{ending}")]
            unit = UNITS[max(endings, key=len)] if endings else "-"
            assert part["description"].endswith(f" [{unit}]"), key
