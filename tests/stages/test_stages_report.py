"""What the report reads of a scene: this run, not what older targets left in the folder; how surfaces are made."""

import json
from copy import deepcopy

import numpy as np
import pytest

from roughslip import store
from roughslip.errors import StoreError
from roughslip.scene.types import scene_of
from roughslip.stages.report import merged, read_scene, represented, variables_chosen

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


FIELD = {"covariance": "gaussian", "rms_height_m": 1e-7, "correlation_length_m": 1e-7}
STRIP = {"length_m": 2.0e-4, "margin_m": 0.0, "width_m": 4e-5, "cell_m": 1e-6}
FRACTAL = {"rms_height_m": 1e-7, "fractal": {"hurst": 0.8, "azimuths": 8, "gamma": 1.5}}


def strips(folder, roughness, targets=("figure2", "figure3")):
    configuration = {"roughness": roughness, "strip": STRIP, "targets": targets}
    return represented(folder, ["contact_strip"], scene_of(configuration))


def test_why_strips_are_not_expanded_is_told_below_the_figure_they_lead_to(tmp_path):
    """Independent heights take all modes; of a Gaussian spectrum with seven cells a length the rest is rounding."""
    (rough,) = strips(tmp_path, FIELD).values()
    assert rough[0] == "Strips are sampled by circulant embedding, exact and stationary."
    assert rough[1].startswith("An expansion would cost more: 8000 of 8000 modes, ")
    assert rough[1].endswith("than a quarter of all: the embedding carries the whole variance at less cost.")
    (smooth,) = strips(tmp_path, FIELD | {"correlation_length_m": 7e-6}).values()
    assert smooth[0] == rough[0]
    assert smooth[1].startswith("An expansion would serve too: ")
    (fractal,) = strips(tmp_path, FRACTAL).values()
    assert fractal == ["Strips are sums of plane waves with random phases, neither expanded nor embedded."]
    assert strips(tmp_path, FIELD).keys() == {"figure3"}
    assert strips(tmp_path, FIELD, ("figure2", "figure5")).keys() == {"figure5"}
    assert represented(tmp_path, ["cycles"], scene_of({"targets": ["figure5"]})) == {}


def test_what_the_modes_of_the_square_carry_is_told_below_figure_2(tmp_path):
    shares = {"captured_variance": 0.9502, "captured_at_centre": 0.9571, "captured_at_corner": 0.7184}
    variables = {name: store.Variable((), share, "1", name) for name, share in shares.items()}
    variables["eigenvalue"] = store.Variable(("mode",), np.ones(101), "m2", "eigenvalues")
    store.write(tmp_path / "surface" / "modes.nc", variables, store.Key({}, "abc"))
    carried = (
        "They carry 95.0 % of the variance in the mean over the mesh, 95.7 % at the centre and 71.8 % at the corner."
    )
    for square, why in (
        ({"modes": 101}, "as many as the scene asks for"),
        ({"variance_share": 0.95}, "the fewest that carry 95 %"),
    ):
        found = represented(tmp_path, ["karhunen_loeve"], scene_of({"square": square, "targets": ["figure2"]}))
        assert found == {"figure2": [f"The square is expanded in 101 modes, {why}.", carried]}
        alone = represented(tmp_path, ["karhunen_loeve"], scene_of({"square": square, "targets": ["figure_field"]}))
        assert alone == {"figure_field": found["figure2"]}


def test_how_many_variables_were_chosen_is_told_below_figure_2(tmp_path):
    def chosen(counts, scores, number):
        variables = {"count": store.Variable(("count",), np.array(counts), "1", "tried")}
        variables["count_score"] = store.Variable(("count",), np.array(scores), "1", "score")
        store.write(tmp_path / "square.nc", variables, store.Key({}, "abc"), {"variables": number})
        return variables_chosen(store.read(tmp_path / "square.nc"))

    assert chosen([6, 8, 9], [0.15, 0.1247, np.nan], 8) == (
        "Our expansion takes 8 variables, the least number whose ranked probability score is not significantly "
        "above the best, at left-out surfaces: 0.1500 with 6, 0.1247 with 8, refused with 9."
    )
    assert chosen([8], [0.1247], 8) == (
        "Our expansion takes 8 variables, as many as the scene asks for; they score 0.1247 at left-out surfaces."
    )
