"""Error texts name keys that a scene has, in one line."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import roughslip
from tests.scene.shipped import SCHEMA, properties

SOURCES = sorted(Path(roughslip.__file__).parent.rglob("*.py"))
KEYS = set(properties(SCHEMA))
ANNOUNCED = re.compile(r"scene keys?: ([^;]*)")
KEY = re.compile(r"[a-z_]+(?:\.[a-z_0-9]+)+|\bseed\b")


def texts() -> Iterator[str]:
    """Every string of the sources, of an f-string what does not depend on values."""
    for source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield node.value
            elif isinstance(node, ast.JoinedStr):
                yield "".join(str(part.value) for part in node.values if isinstance(part, ast.Constant))


NAMED = sorted({key for text in texts() for keys in ANNOUNCED.findall(text) for key in KEY.findall(keys)})


@pytest.mark.parametrize("key", NAMED)
def test_an_error_names_a_key_that_a_scene_has(key):
    assert key in KEYS


def test_the_errors_of_each_subject_name_keys():
    """So that the test above has what to look at; and a key that no scene has is seen."""
    assert {key.partition(".")[0] for key in NAMED} >= {"expansion", "oscillator", "roughness", "square", "strip"}
    assert len(NAMED) >= 30
    assert KEY.findall("expansion.degrees (of a strip, strip.training_samples), seed") == [
        *("expansion.degrees", "strip.training_samples", "seed")
    ]
    assert "expansion.degrees" not in KEYS
