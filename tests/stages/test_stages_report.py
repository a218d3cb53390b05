"""What the report reads of a scene: this run, not what older targets left in the folder."""

import json
from copy import deepcopy

import pytest

from roughslip.errors import StoreError
from roughslip.stages.report import merged, read_scene


def test_slices_of_several_stages_merge_at_every_depth():
    slices = [
        {"seed": 1, "strip": {"cell_m": 2.0, "margin": {"left": 1}}},
        {"strip": {"length_m": 3.0, "margin": {"right": 2}}, "targets": ["figure3"]},
        {"seed": 1},
    ]
    before = deepcopy(slices)
    assert merged(slices) == {
        "seed": 1,
        "strip": {"cell_m": 2.0, "length_m": 3.0, "margin": {"left": 1, "right": 2}},
        "targets": ["figure3"],
    }
    assert slices == before
    assert merged([]) == {}


@pytest.fixture
def scene(tmp_path):
    """A scene that ran claims and one stage for Figure 5, in a folder where Figure 2 was made before."""
    (tmp_path / "keys").mkdir()
    for stage, configuration in (
        ("claims", {"description": "Mine", "targets": ["figure5"]}),
        ("cycles", {"oscillator": {"damping_ratio": 0.17}}),
        ("contact_square", {"oscillator": {"damping_ratio": 0.4}, "square": {"nodes": 10}}),
    ):
        key = {"configuration": configuration, "code": "abc"}
        (tmp_path / "keys" / f"{stage}.json").write_text(json.dumps(key), encoding="utf-8")
    for name in ("figure2", "figure5"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
    costs = [{"stage": stage} for stage in ("claims", "cycles", "all")]
    (tmp_path / "costs.json").write_text(json.dumps(costs), encoding="utf-8")
    (tmp_path / "claims.json").write_text("[]", encoding="utf-8")
    return tmp_path


def test_only_what_this_run_made_is_shown(scene):
    found = read_scene(scene)
    assert (found.name, found.description) == (scene.name, "Mine")
    assert found.figures == {"figure5": b"figure5"}
    assert json.loads(found.configuration) == {
        "description": "Mine",
        "targets": ["figure5"],
        "oscillator": {"damping_ratio": 0.17},
    }


@pytest.mark.parametrize("name", ["figure5.png", "claims.json", "costs.json", "keys/cycles.json"])
def test_what_is_missing_is_named(scene, name):
    (scene / name).unlink()
    with pytest.raises(StoreError, match=name.partition("/")[2] or name):
        read_scene(scene)
