"""What the report reads of a scene: this run, not what older targets left in the folder; how surfaces are made."""

import json
from copy import deepcopy

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import StoreError
from roughslip.scene.types import scene_of
from roughslip.stages.report import merged, read_scene, represented

CAPTIONS = {"figure2": "Pressure.", "figure5": "Cycles."}


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
        ("figure5", {"description": "Mine"}),
        ("contact_square", {"oscillator": {"damping_ratio": 0.4}, "square": {"nodes": 10}}),
    ):
        key = {"configuration": configuration, "code": "abc"}
        (tmp_path / "keys" / f"{stage}.json").write_text(json.dumps(key), encoding="utf-8")
    for name in ("figure2", "figure5"):
        (tmp_path / f"{name}.png").write_bytes(name.encode())
    costs = [{"stage": stage} for stage in ("claims", "cycles", "figure5", "all")]
    (tmp_path / "costs.json").write_text(json.dumps(costs), encoding="utf-8")
    (tmp_path / "claims.json").write_text("[]", encoding="utf-8")
    return tmp_path


def test_only_what_this_run_made_is_shown(scene):
    found = read_scene(scene, CAPTIONS)
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
        read_scene(scene, CAPTIONS)


def test_a_damaged_file_is_named_with_what_rebuilds_it(scene):
    (scene / "costs.json").write_text('{"stage": "con', encoding="utf-8")
    with pytest.raises(StoreError, match=r"costs\.json: missing or not JSON.*rebuild it with:"):
        read_scene(scene, CAPTIONS)


@pytest.mark.parametrize(
    ("stage", "targets", "figure"),
    [
        ("karhunen_loeve", ("figure2", "figure_field"), "figure2"),
        ("karhunen_loeve", ("figure_field",), "figure_field"),
        ("contact_strip", ("figure2", "figure3"), "figure3"),
        ("contact_strip", ("figure2", "figure5"), "figure5"),
    ],
)
def test_how_a_surface_is_represented_stands_below_the_figure_it_leads_to(tmp_path, stage, targets, figure):
    names = ("captured_variance", "captured_at_centre", "captured_at_corner", "eigenvalue")
    variables = {name: store.Variable(("mode",), np.ones(1), "1", name) for name in names[3:]}
    variables |= {name: store.Variable((), 0.9, "1", name) for name in names[:3]}
    store.write(tmp_path / "surface" / "modes.nc", variables, store.Key({}, "abc"))
    scene = {
        "roughness": {"covariance": "gaussian", "rms_height_m": 1e-7, "correlation_length_m": 1e-7},
        "square": {"variance_share": 0.95},
        "strip": {"length_m": 2.0e-4, "margin_m": 0.0, "width_m": 4e-5, "cell_m": 1e-6},
        "targets": targets,
    }
    assert represented(tmp_path, [stage], scene_of(scene)).keys() == {figure}
