"""Stages that a scene does without: all that do not run, each with a reason that holds."""

import pytest

from roughslip.scene.declarations import declarations
from roughslip.scene.plan import skip_reasons, stages_needed
from tests.scene.shipped import ALWAYS, ASIDE, SCAN, SCENES, shipped_scene


@pytest.mark.parametrize("name", SCENES)
def test_every_stage_runs_or_has_a_reason(name):
    scene = shipped_scene(name)
    spared = skip_reasons(scene)
    assert spared.keys() == declarations().keys() - stages_needed(scene) - ASIDE
    assert ALWAYS.isdisjoint(spared)
    asked = set(scene["targets"])
    for stage, reason in spared.items():
        assert asked.isdisjoint(reason.removeprefix("not asked for: ").split(", ")), stage


def test_reasons():
    paper, given = shipped_scene("paper"), shipped_scene("given")
    assert skip_reasons(paper)["field_square"] == "not asked for: figure_field"
    assert skip_reasons(paper)["adaptive_training"] == "expansion.samples is given"
    assert skip_reasons(paper)["path_resolution"] == "ensemble.nodes_per_correlation_length is given"
    assert skip_reasons(paper)["grinding"] == skip_reasons(paper)["scan"] == "roughness.scan is not given"
    assert skip_reasons(given)["contact_strip"] == "friction.statistics is given"
    square_of_given = skip_reasons(given | {"targets": ["figure2"]})
    assert square_of_given["contact_strip"] == "not asked for: figure3, figure5, figure_map"
    only_square = skip_reasons(paper | {"targets": ["figure2"]})
    assert only_square["friction"] == "not asked for: figure3, figure5, figure_map"
    assert only_square["path_resolution"] == "not asked for: figure5"


def test_a_scan_of_which_no_surface_is_sampled(mine):
    found = skip_reasons(mine(f"extends: given\nroughness: {{scan: {SCAN}}}"))
    assert found["synthetic_surfaces"] == found["grinding"] == "friction.statistics is given"
    scanned = skip_reasons(mine(f"extends: paper\nroughness: {{scan: {SCAN}}}"))
    assert scanned["grinding"] == "roughness.scan.grinding is not given"
    assert "scan" not in scanned
