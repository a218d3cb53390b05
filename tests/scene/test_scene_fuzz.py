"""Scenes at random: each loads or is refused with one line for each mistake, and none ends in a traceback.

SCENE_CASES=2000 runs as many cases (`make fuzz`). tests/workflow/test_plans.py plans those that load.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from roughslip.errors import InputError
from roughslip.scene import plan, types
from roughslip.scene.loader import load
from tests.scene.shipped import SCENES, overlays

CASES = int(os.environ.get("SCENE_CASES", "12"))

BOMB = "\n".join(f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9) if n else 'x'}]" for n in range(30))
HOSTILE = [
    b"\xff\xfe\x00",
    "extends: paper\nseed: 1\n".encode("utf-16"),
    b'extends: paper\ndescription: "\\ud800"\n',
    b"extends: paper\n\x00: 1\n",
    BOMB.encode(),
    ("[" * 5000).encode(),
    ("a: " + "{b: " * 3000).encode(),
    ("extends: paper\n" + "- " * 4000).encode(),
    b"!!python/object/apply:os.system ['true']\n",
    b"extends: !!python/name:os.system\n",
    b"seed: " + b"9" * 100_000,
    b"seed: 1.0e+99999\nextends: paper\n",
    b"<<: {a: 1}\nextends: paper\n",
    b"? {a: 1}\n: 2\n",
    b"--- 1\n--- 2\n",
    b"%YAML 9.9\n---\na: 1\n",
    b"description: " + b"x" * 2_000_000,
    b"extends: ../../etc/passwd\n",
]


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


@fuzz(CASES)
@given(valid=overlays(SCENES, valid=True), wild=overlays(SCENES, valid=False))
def test_scenes_load_or_are_refused(folder, valid, wild):
    """One that loads has figures, and slices that JSON holds."""
    for overlay in (valid, wild):
        scene = outcome(folder, yaml.safe_dump(overlay, allow_unicode=True).encode())
        if scene is not None:
            assert plan.figures(scene) or {*scene["targets"]} <= {"answer", "readings"}  # which have none
            for stage in plan.stages_needed(scene):
                json.dumps(types.slice_for(scene, stage), allow_nan=False)


@fuzz(CASES)
@given(
    overlay=overlays(SCENES, valid=True),
    cuts=st.lists(st.tuples(st.floats(0, 1), st.binary(max_size=4)), min_size=1, max_size=4),
)
def test_files_with_wrong_bytes_load_or_are_refused(folder, overlay, cuts):
    content = yaml.safe_dump(overlay).encode()
    for place, put in cuts:
        at = int(place * len(content))
        content = content[:at] + put + content[at + len(put) // 2 :]
    outcome(folder, content)


@fuzz(100)
@example(text=":\n")
@given(text=st.text(alphabet=st.sampled_from("ab01.-+e:{}[]&*!|>%@`\"'#?,\n\t \u2028\x85é"), max_size=80))
def test_any_text_loads_or_is_refused(folder, text):
    outcome(folder, text.encode())


def test_hostile_files_are_refused_at_once(folder):
    assert [content for content in HOSTILE if outcome(folder, content) is not None] == []


def test_a_scene_may_not_be_a_link_to_itself_or_out_of_its_folder(folder, tmp_path):
    """A project of unknown origin must not read files elsewhere, by a link or by what a scene extends."""
    (folder / "scenes" / "loop.yaml").symlink_to("loop.yaml")
    with pytest.raises(InputError, match=r"loop\.yaml: no such file"):
        load("loop", Path("scenes"))
    (tmp_path / "secret.yaml").write_text("extends: paper\n")
    (folder / "scenes" / "fuzz.yaml").symlink_to(tmp_path / "secret.yaml")
    with pytest.raises(InputError, match=r"^scenes/fuzz\.yaml: a link to ") as caught:
        load("fuzz", Path("scenes"))
    assert len(caught.value.lines) == 1
