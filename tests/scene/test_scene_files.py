"""Shipped scenes are valid, say where each number comes from, and overlays exercise every option that is offered.

A mistake in a scene file has its line; mistakes.txt lists mistakes and lines.
"""

import re
from pathlib import Path

import pytest
import yaml

from roughslip.scene.loader import _document, load, scene_names
from roughslip.scene.plan import stages_needed
from roughslip.scene.types import slice_for
from tests.scene.shipped import CONFIG, FIGURES, KINDS, KNOWN, SCENES, SCHEMA, lines_of, properties, shipped_scene

OPTIONS = (Path(__file__).parent / "options.txt").read_text(encoding="utf-8").strip().split("\n\n")[1:]


def leaves(values: dict, prefix: str = ""):
    """The dotted keys of a scene file, with their values."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


@pytest.mark.parametrize("text", OPTIONS)
def test_an_option_validates_and_plans(mine, text):
    scene = mine(text if "extends:" in text else f"extends: paper\n{text}")
    assert all(slice_for(scene, stage) for stage in stages_needed(scene))


def test_every_key_and_word_is_set_by_a_shipped_scene_or_an_option():
    texts = [*OPTIONS, *((CONFIG / "scenes" / f"{name}.yaml").read_text() for name in SCENES)]
    given = [pair for text in texts for pair in leaves(yaml.safe_load(text))]
    keys, words = {key for key, _ in given}, {(key, value) for key, value in given if isinstance(value, str)}
    for key, part in properties(SCHEMA).items():
        assert part["type"] == "object" or key in keys, key
        assert all((key, word) in words for word in part.get("enum", ())), (key, part["enum"])


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_are_valid(name):
    scene = shipped_scene(name)
    assert "extends" not in scene
    assert scene == load(CONFIG / "scenes" / f"{name}.yaml", CONFIG / "scenes")


def test_both_parsers_read_the_same():
    """Where libyaml is missing, PyYAML reads scenes."""
    for text in [*OPTIONS, *(path.read_text() for path in (CONFIG / "scenes").glob("*.yaml"))]:
        assert _document(text, yaml.CSafeLoader) == _document(text, yaml.SafeLoader)


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
    assert path.stem in SCENES
    assert scene_names(path.parent) == sorted(SCENES)


MISTAKES = (Path(__file__).parent / "mistakes.txt").read_text(encoding="utf-8").split("\n\n")[1:]


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_has_its_line(mine, mistake):
    text, line = mistake.strip().split("\n-> ")
    text = text if "extends:" in text else f"extends: paper\n{text}"
    for name, words in (("{FIGURES}", FIGURES), ("{KINDS}", KINDS), ("{KNOWN}", KNOWN)):
        line = line.replace(name, words)
    assert lines_of(mine, text) == [f"scenes/mine.yaml: {line}"]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("", "empty; a scene file holds keys and values"),
        ("# nothing\n", "empty; a scene file holds keys and values"),
        ("- 1\n- 2\n", "[1, 2] is not allowed; a scene file holds keys and values"),
        ("text\n", "'text' is not allowed; a scene file holds keys and values"),
        (b"seed: 1  # \xb5m\n", "not UTF-8 text; byte 11 is 0xb5"),
        (
            b"a: \x00\n",
            "not valid YAML: unacceptable character #x0000: special characters are not allowed in "
            '"<unicode string>", position 3',
        ),
        (
            "a: 'b\n",
            "line 2, column 1: not valid YAML: found unexpected end of stream, while scanning a quoted scalar that "
            "begins in line 1",
        ),
        ("a:\n\tb: 1\n", "line 2, column 1: not valid YAML: found character '\\t' that cannot start any token"),
        ("a: 1\n---\na: 1\n", "line 2, column 1: not valid YAML: but found another document"),
        ('a: "\\Uffffffff"\n', "not valid YAML: "),
        ("a: " + "[" * 5000, "not valid YAML: nested too deeply"),
        ("# " + "x" * 100_000, "larger than 100000 bytes, which no scene needs"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_file_that_is_no_scene(mine, content, line):
    (found,) = lines_of(mine, content)
    assert found.startswith(f"scenes/mine.yaml: {line}")
    assert "\n" not in found
