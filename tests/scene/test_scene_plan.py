"""What stages read of a scene, which of them its targets need, and why the others do not run."""

import copy

import pytest
import yaml

from roughslip.scene.declarations import declarations
from roughslip.scene.plan import figures, skip_reasons, stages_needed
from roughslip.scene.types import slice_for, without_nulls
from tests.scene.shipped import SCAN, SCENES, SCHEMA, properties, shipped_scene

ALWAYS = {"claims", "costs", "report"}
SEVERAL = {"reference", "comparison", "sweep", "verify"}  # of several scenes together, asked for by name
OSCILLATOR = {"answer", "deterministic", "oscillator", "cycles", "figure5"}
SCANNED = {"scan", "synthetic_surfaces", "figure_scan"}
SOLVED_SQUARES = {"square_pilot", "contact_square", "adaptive_training", "field_square"}
SOLVED_STRIPS = {"strip_pilot", "contact_strip"}
FIGURES = {
    "figure2",
    "figure2_traps",
    "figure3",
    "figure3_law",
    "figure5",
    "figure_record",
    "figure_scan",
    "figure_field",
    "figure_map",
} | {
    "figure_chain",
    "figure_residence",
    "friction_against_load",
}
CELLS = {"contact_periodic", "contact_over_loads"}


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(properties(SCHEMA))
    read = {key for stage in declarations().values() for key in stage.keys}
    assert read <= keys
    unread = {key for key in keys if not any(f"{key}.".startswith(f"{r}.") or r.startswith(f"{key}.") for r in read)}
    assert unread == {"extends", "sweep", "jobs"}


def test_a_slice_has_the_shape_of_the_scene_and_its_defaults():
    scene = shipped_scene("paper")
    square = {key: scene["square"][key] for key in ("edge_m", "nodes", "modes")}
    assert without_nulls(slice_for(scene, "karhunen_loeve")) == {"roughness": scene["roughness"], "square": square}
    assert slice_for(shipped_scene("given"), "oscillator")["friction"]["statistics"]["mean"] > 0
    assert slice_for(scene, "oscillator")["friction"] == {"statistics": None, "scatter": "additive"}
    assert slice_for(scene, "oscillator")["oscillator"]["law"] == "stribeck"
    slice_for(scene, "friction")["strip"]["penetration_percentiles"].clear()
    assert scene["strip"]["penetration_percentiles"]


RUNS = {"deterministic", "ensemble_pilot", "oscillator", "belt_readings", "figure_chain"}


@pytest.mark.parametrize(
    ("key", "value", "stages"),
    [
        ("ensemble.damping_ratios", [0.1, 0.2], RUNS),
        ("jobs", 7, set()),
        ("map.points", 9, {"stick_slip_map"}),
        ("survival.points", 7, {"residence"}),
        ("ensemble.duration_periods", 7, RUNS | {"cycles"}),
        ("numerics.contact_tolerance", 1e-9, {*SOLVED_SQUARES, *SOLVED_STRIPS, *CELLS, "figure_chain", "wide_field"}),
        ("strip.samples", 99, {"strip_allocation", "expansion_strip", "friction", "contact_periodic"}),
        ("friction.mean_at_median", 0.2, {"friction", "wide_field", "friction_under_load", "friction_against_load"}),
        ("square.monte_carlo_samples", 999, {"square_pilot"}),
        ("expansion.draws", 9999, {"chaos_square"}),
        ("description", "other", FIGURES | ALWAYS | SEVERAL),
    ],
)
def test_a_change_reaches_only_the_stages_that_read_it(key, value, stages):
    scene = shipped_scene("paper")
    changed = copy.deepcopy(scene)
    *sections, last = key.split(".")
    inner = changed
    for section in sections:
        inner = inner[section]
    assert inner.get(last) != value
    inner[last] = value
    assert {stage for stage in declarations() if slice_for(scene, stage) != slice_for(changed, stage)} == stages


def test_given_statistics_need_nothing_but_an_oscillator(mine):
    """tests/workflow/test_plans.py has the stages of other targets."""
    paper = shipped_scene("paper")
    own = {key: paper[key] for key in ("description", "seed", "oscillator", "ensemble")}
    own |= {"targets": ["figure5"], "friction": shipped_scene("given")["friction"]}
    assert stages_needed(mine(yaml.safe_dump(own))) == OSCILLATOR | ALWAYS


def test_a_surface_after_a_scan_needs_the_scan_and_draws_it(mine):
    scene = mine(f"extends: paper\nroughness: {{scan: {SCAN}}}")
    for target in ("figure2", "figure3", "figure5", "figure_scan"):
        assert stages_needed(scene | {"targets": [target]}) >= SCANNED
        second = {"figure2": ["figure2_traps"], "figure3": ["figure3_law"]}
        sheets = [target, *second.get(target, ())]
        chain = ["figure_chain"] if target == "figure5" else []
        assert figures(scene | {"targets": [target]}) == list(dict.fromkeys([*chain, "figure_scan", *sheets]))
    assert stages_needed(scene | {"targets": ["figure_scan"]}) == SCANNED | ALWAYS
    given = mine(f"extends: given\ntargets: [figure5]\nroughness: {{scan: {SCAN}}}")
    assert stages_needed(given) == OSCILLATOR | ALWAYS
    assert skip_reasons(given)["synthetic_surfaces"] == "friction.statistics is given"


def test_every_stage_runs_or_has_a_reason():
    for name in SCENES:
        scene = shipped_scene(name)
        reasons = skip_reasons(scene)
        assert reasons.keys() == declarations().keys() - stages_needed(scene) - SEVERAL
        asked = {reason.removeprefix("not asked for: ") for reason in reasons.values()}
        assert set(scene["targets"]).isdisjoint(target for some in asked for target in some.split(", "))
    paper, given = skip_reasons(shipped_scene("paper")), skip_reasons(shipped_scene("given"))
    assert paper["field_square"] == "not asked for: figure_field"
    assert paper["adaptive_training"] == "expansion.samples is given"
    assert paper["ensemble_pilot"] == "accuracy.cycles is not given"
    assert paper["scan"] == "roughness.scan is not given"
    assert given["contact_strip"] == "friction.statistics is given"
    for name in ("given", "paper"):
        square = skip_reasons(shipped_scene(name) | {"targets": ["figure2"]})
        asking = "not asked for: answer, figure3, figure5, figure_chain, figure_map, figure_residence, readings"
        assert square["contact_strip"] == square["friction"] == asking
        assert square["ensemble_pilot"] == "not asked for: figure5, figure_chain"
