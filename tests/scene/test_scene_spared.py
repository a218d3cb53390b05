"""Stages that a scene does without: all that do not run, each with a reason that holds."""

import pytest

from roughslip.scene.loader import stages_needed
from roughslip.scene.rules import SLICES
from roughslip.scene.skipped_stages import not_needed
from tests.scene.shipped import ALWAYS, ASIDE, SCAN, SCENES, shipped_scene


@pytest.mark.parametrize("name", SCENES)
def test_every_stage_runs_or_has_a_reason(name):
    scene = shipped_scene(name)
    spared = not_needed(scene)
    assert spared.keys() == SLICES.keys() - stages_needed(scene) - ASIDE
    assert ALWAYS.isdisjoint(spared)
    asked = set(scene["targets"])
    for stage, reason in spared.items():
        assert asked.isdisjoint(reason.removeprefix("not asked for: ").split(", ")), stage


def test_reasons():
    paper, given = shipped_scene("paper"), shipped_scene("given")
    assert not_needed(paper)["field_square"] == "not asked for: figure_field"
    assert not_needed(paper)["training_square"] == "expansion.samples is given"
    assert not_needed(paper)["spacing"] == "ensemble.nodes_per_correlation_length is given"
    assert not_needed(paper)["grinding"] == not_needed(paper)["scan"] == "roughness.scan is not given"
    assert not_needed(given)["contact_strip"] == "friction.statistics is given"
    square_of_given = not_needed(given | {"targets": ["figure2"]})
    assert square_of_given["contact_strip"] == "not asked for: figure3, figure5, figure_map"
    only_square = not_needed(paper | {"targets": ["figure2"]})
    assert only_square["friction"] == "not asked for: figure3, figure5, figure_map"
    assert only_square["spacing"] == "not asked for: figure5"


def test_a_scan_that_nobody_samples(mine):
    found = not_needed(mine(f"extends: given\nroughness: {{scan: {SCAN}}}"))
    assert found["twins"] == found["grinding"] == "no surface is sampled"
    scanned = not_needed(mine(f"extends: paper\nroughness: {{scan: {SCAN}}}"))
    assert scanned["grinding"] == "the scan is a file"
    assert "scan" not in scanned
