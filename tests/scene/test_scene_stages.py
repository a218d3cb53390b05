"""What stages read of a scene, and which of them its targets need."""

import copy

import pytest
import yaml

from roughslip.scene.declarations import declarations
from roughslip.scene.plan import figures, slice_for, stages_needed
from roughslip.scene.types import without_nulls
from tests.scene.shipped import (
    ALWAYS,
    ASIDE,
    FIELD_STAGES,
    MAP_STAGES,
    OSCILLATOR,
    SCAN,
    SCAN_STAGES,
    SCHEMA,
    properties,
    shipped_scene,
)


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(properties(SCHEMA))
    read = {key for stage in declarations().values() for key in stage.keys}
    assert read <= keys
    unread = {key for key in keys if not any(f"{key}.".startswith(f"{r}.") or r.startswith(f"{key}.") for r in read)}
    # the rules turn this number of samples into jobs, and no stage reads it
    assert {key for key in unread if not key.startswith("batches")} == {"extends", "square.monte_carlo_samples"}


def test_a_slice_has_the_shape_of_the_scene():
    scene = shipped_scene("paper")
    square = scene["square"]
    assert without_nulls(slice_for(scene, "karhunen_loeve")) == {
        "roughness": scene["roughness"],
        "square": {key: square[key] for key in ("edge_m", "nodes", "modes")},
    }
    assert slice_for(shipped_scene("given"), "oscillator")["friction"]["statistics"]["mean"] > 0
    assert slice_for(scene, "oscillator")["friction"] == {"statistics": None}
    assert slice_for(scene, "oscillator")["oscillator"]["integrator"] == "fehlberg45"
    slice_for(scene, "friction")["strip"]["penetration_percentiles"].clear()
    assert scene["strip"]["penetration_percentiles"]


@pytest.mark.parametrize(
    ("key", "value", "stages"),
    [
        ("ensemble.damping_ratios", [0.1, 0.2], {"deterministic", "path_resolution", "oscillator"}),
        ("batches.strip_samples", 7, set()),
        ("map.points", 7, {"stick_slip_map"}),
        ("survival.points", 7, {"lifetimes"}),
        ("ensemble.duration_periods", 7, {"deterministic", "path_resolution", "oscillator", "cycles"}),
        ("numerics.contact_tolerance", 1e-9, {"contact_square", "adaptive_training", "field_square", "contact_strip"}),
        ("strip.samples", 99, {"expansion_strip", "friction"}),
        ("friction.mean_at_median", 0.2, {"friction"}),
        ("square.monte_carlo_samples", 999, set()),
        ("expansion.draws", 9999, {"chaos_square"}),
        (
            "description",
            "other",
            {
                *("figure2", "figure3", "figure3_law", "figure5", "figure_scan", "figure_field", "figure_map"),
                *(*ALWAYS, *ASIDE),
            },
        ),
    ],
)
def test_a_change_reaches_only_the_stages_that_read_it(key, value, stages):
    scene = shipped_scene("paper")
    changed = copy.deepcopy(scene)
    inner = changed
    for part in key.split(".")[:-1]:
        inner = inner[part]
    assert inner[key.split(".")[-1]] != value
    inner[key.split(".")[-1]] = value
    assert {stage for stage in declarations() if slice_for(scene, stage) != slice_for(changed, stage)} == stages


def test_only_stages_that_the_targets_need():
    paper = shipped_scene("paper")
    square = {"karhunen_loeve", "design", "contact_square", "chaos_square", "figure2"}
    strip = {"contact_strip", "chaos_strip", "expansion_strip", "friction"}
    not_asked = {*ASIDE, "adaptive_training", "path_resolution", *SCAN_STAGES, *FIELD_STAGES, *MAP_STAGES}
    assert stages_needed(paper) == set(declarations()) - not_asked
    assert stages_needed(paper | {"targets": ["figure2"]}) == square | ALWAYS
    assert stages_needed(paper | {"targets": ["figure3"]}) == strip | {"figure3", "figure3_law"} | ALWAYS
    found = paper | {"expansion": paper["expansion"] | {"samples": "auto", "cdf_error": 0.01}}
    assert stages_needed(found | {"targets": ["figure2"]}) == square | {"adaptive_training"} | ALWAYS
    assert stages_needed(found | {"targets": ["figure3"]}) == strip | {"figure3", "figure3_law"} | ALWAYS
    assert stages_needed(paper | {"targets": ["figure5"]}) == strip | OSCILLATOR | ALWAYS
    spaced = paper | {"ensemble": paper["ensemble"] | {"nodes_per_correlation_length": "auto", "count_error": 0.01}}
    assert stages_needed(spaced | {"targets": ["figure5"]}) == strip | OSCILLATOR | {"path_resolution"} | ALWAYS
    assert stages_needed(spaced | {"targets": ["figure3"]}) == strip | {"figure3", "figure3_law"} | ALWAYS
    assert stages_needed(paper | {"targets": ["figure_map"]}) == strip | MAP_STAGES | ALWAYS
    assert stages_needed(spaced | {"targets": ["figure_map"]}) == strip | MAP_STAGES | ALWAYS
    assert stages_needed(paper | {"targets": ["figure_field"]}) == {"karhunen_loeve"} | FIELD_STAGES | ALWAYS
    assert stages_needed(found | {"targets": ["figure_field"]}) == {"karhunen_loeve"} | FIELD_STAGES | ALWAYS


def test_given_statistics_need_no_contact():
    given = shipped_scene("given")
    assert stages_needed(given) == OSCILLATOR | ALWAYS
    assert stages_needed(given | {"targets": ["figure_map"]}) == MAP_STAGES | ALWAYS


def test_given_statistics_need_nothing_but_an_oscillator(mine):
    paper = shipped_scene("paper")
    own = {key: paper[key] for key in ("description", "seed", "oscillator", "ensemble")}
    own |= {"targets": ["figure5"], "friction": shipped_scene("given")["friction"]}
    own |= {"numerics": {"oscillator_tolerance": 1e-8}, "batches": {"realisations": 50}}
    assert stages_needed(mine(yaml.safe_dump(own))) == OSCILLATOR | ALWAYS


def test_a_surface_after_a_scan_needs_the_scan_and_draws_it(mine):
    scene = mine(f"extends: paper\nroughness: {{scan: {SCAN}}}")
    for target in ("figure2", "figure3", "figure5", "figure_scan"):
        assert SCAN_STAGES - {"grinding"} <= stages_needed(scene | {"targets": [target]})
        sheets = ["figure3", "figure3_law"] if target == "figure3" else [target]
        assert figures(scene | {"targets": [target]}) == list(dict.fromkeys(["figure_scan", *sheets]))
    assert stages_needed(scene | {"targets": ["figure_scan"]}) == (SCAN_STAGES - {"grinding"}) | ALWAYS
    given = mine(f"extends: given\nroughness: {{scan: {SCAN}}}")
    assert stages_needed(given) == OSCILLATOR | ALWAYS
