"""Shipped scenes are valid and say where each number comes from. A mistake has its line; mistakes.txt lists both.

Scenes at random: each loads or is refused with one line for each mistake, and none ends in a traceback.
SCENE_CASES=2000 runs as many cases (`make fuzz`). tests/workflow/test_plans.py plans those that load.
"""

from __future__ import annotations

import json
import os
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from roughslip.errors import InputError
from roughslip.scene.loader import load
from roughslip.study import plan
from tests.scene.shipped import CONFIG, SCENES, WORDS, lines_of, overlays, shipped_scene, slice_for

MISTAKES = (Path(__file__).parent / "mistakes.txt").read_text(encoding="utf-8").split("\n\n")[1:]


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_are_valid(name):
    scene = shipped_scene(name)
    assert "extends" not in scene
    assert scene == load(CONFIG / "scenes" / f"{name}.yaml", CONFIG / "scenes")


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


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_has_its_line(mine, mistake):
    text, line = mistake.strip().split("\n-> ")
    text = text if "extends:" in text else f"extends: paper\n{text}"
    for name, words in WORDS.items():
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
    (message,) = lines_of(mine, content)
    assert message.startswith(f"scenes/mine.yaml: {line}")
    assert "\n" not in message


CASES = int(os.environ.get("SCENE_CASES", "12"))


def fuzz(cases: int) -> settings:
    return settings(
        max_examples=cases,
        deadline=None,
        derandomize="SCENE_SEED" not in os.environ,
        suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
    )


def outcome(folder: Path, content: bytes) -> dict | None:
    """The scene of a file, or None where it is refused: printable lines of bounded length that name a file."""
    (folder / "scenes" / "fuzz.yaml").write_bytes(content)
    try:
        return load("fuzz", Path("scenes"))
    except InputError as error:
        lines = error.lines
    assert lines
    assert len(set(lines)) == len(lines)
    for line in lines:
        assert line.isprintable(), repr(line)
        assert len(line) < 2000
        assert line.startswith("scenes/"), line
    return None


@pytest.fixture(autouse=True)
def here(folder: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(folder)
    yield
    (folder / "scenes" / "fuzz.yaml").unlink(missing_ok=True)


@pytest.mark.slow
@fuzz(CASES)
@given(valid=overlays(SCENES, valid=True), wild=overlays(SCENES, valid=False))
def test_scenes_load_or_are_refused(folder, valid, wild):
    """One that loads has figures, and slices that JSON holds."""
    for overlay in (valid, wild):
        scene = outcome(folder, yaml.safe_dump(overlay, allow_unicode=True).encode())
        if scene is not None:
            assert plan.figures(scene) or {*scene["targets"]} <= {"answer"}  # which has none
            for stage in plan.stages_needed(scene):
                json.dumps(slice_for(scene, stage), allow_nan=False)


@fuzz(100)
@example(text=":\n")
@given(text=st.text(alphabet=st.sampled_from("ab01.-+e:{}[]&*!|>%@`\"'#?,\n\t \u2028\x85é"), max_size=80))
def test_any_text_loads_or_is_refused(folder, text):
    outcome(folder, text.encode())
