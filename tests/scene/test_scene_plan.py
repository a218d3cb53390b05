"""What stages read of a scene, which of them its targets need, and why the others do not run.

Cells and tolerance that a scene leaves to its accuracy."""

import pytest
import yaml

from roughslip.scene.accuracy import CELL_SHARE, COARSEST, ERRORS, ORDER, cell_m
from roughslip.scene.declarations import declarations
from roughslip.scene.plan import figures, skip_reasons, stages_needed
from roughslip.scene.types import slice_for, without_nulls
from tests.scene.shipped import SCAN, SCENES, SCHEMA, lines_of, properties, shipped_scene

ALWAYS = {"claims", "costs", "report"}
SEVERAL = {"reference", "comparison", "sweep", "verify"}  # of several scenes together, asked for by name
OSCILLATOR = {"answer", "deterministic", "oscillator", "cycles", "figure5"}
SCANNED = {"scan", "synthetic_surfaces", "figure_scan"}


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(properties(SCHEMA))
    read = {key for stage in declarations().values() for key in stage.keys}
    read.remove("standard_uncertainties")  # of the loader, not of scene files
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
        of_oscillator = "figure5, figure_basins, figure_budget, figure_chain, figure_map, figure_residence"
        asking = f"not asked for: answer, figure3, {of_oscillator}, readings"
        assert square["contact_strip"] == square["friction"] == asking
        assert square["ensemble_pilot"] == "not asked for: figure5, figure_chain"


SIZES = [2.4e-3, 3e-4, 2.5e-5, 6e-4, 1.5e-5, 1e-5]  # of the strips of resolved, so that twice the cell divides 5 um


@pytest.mark.parametrize("asked", [0.3, 0.1, 0.03, 0.01, 0.003])
def test_cells_are_the_coarsest_that_leave_their_share(asked):
    """The next coarser ones would leave more, or hold fewer than 4 in a correlation length. n cells are 2.5 um."""
    length = 1.4e-5
    cell = cell_m({"friction_mean": asked, "friction_std": asked}, length, SIZES)
    count = round(2.5e-6 / cell)
    assert cell == pytest.approx(2.5e-6 / count, rel=1e-12)
    assert _left(cell, length) <= CELL_SHARE * asked
    assert cell <= COARSEST * length
    coarser = 2.5e-6 / (count - 1) if count > 1 else None
    assert coarser is None or _left(coarser, length) > CELL_SHARE * asked or coarser > COARSEST * length


def test_resolved_has_the_cells_and_the_tolerance_of_its_accuracies(mine):
    assert shipped_scene("resolved")["strip"]["cell_m"] == 1.25e-6
    assert shipped_scene("resolved")["numerics"]["contact_tolerance"] == 1e-4
    finer = mine("extends: resolved\naccuracy: {friction_std: 0.01}")
    assert finer["strip"]["cell_m"] == 6.25e-7
    assert finer["numerics"]["contact_tolerance"] == 1e-5


def test_what_does_not_follow_from_an_accuracy_has_to_be_given(mine):
    text = "extends: paper\nstrip: {cell_m: auto}\nnumerics: {contact_tolerance: auto}"
    accuracy, tolerance = "accuracy of friction (mean and std)", "numerics.contact_tolerance"
    assert lines_of(mine, text) == [
        f"scenes/mine.yaml: strip.cell_m: 'auto' is not allowed; a number > 0 [m], or auto with {accuracy} and a "
        "correlation length",
        f"scenes/mine.yaml: {tolerance}: 'auto' is not allowed; a number from 1e-14 to 0.001, or auto with {accuracy}",
    ]


def test_a_scan_has_no_length_before_it_is_read_so_its_scene_gives_the_cells(mine):
    """The line names the file that has the scan, not the shipped one that says auto."""
    scan = "file: a.txt, form: mean, covariance: best, marginal: gaussian"
    assert lines_of(mine, f"extends: resolved\ntargets: [figure3]\nroughness: {{scan: {{{scan}}}}}") == [
        "scenes/mine.yaml: strip.cell_m: 'auto' is not allowed; with roughness.scan a number > 0 [m], for cells of at "
        "most a quarter of its shortest correlation length"
    ]


SQUARE = (
    "extends: resolved\ntargets: [figure2]\nsquare: {{nodes: auto, variance_share: auto}}\naccuracy: {{pressure: {}}}"
)


@pytest.mark.parametrize(("asked", "nodes", "share"), [(0.1, 39, 0.95), (0.05, 44, 0.975), (0.0125, 87, 0.9938)])
def test_a_square_has_the_fewest_nodes_and_modes_that_leave_their_share(mine, asked, nodes, share):
    """0.1 x^2 of the distribution at x = cell / correlation length, and 0.4 of the missing variance.

    A tenth and two tenths of what is asked are theirs. The correlation length is 0.1035 of the edge, so that 39 nodes
    are 4 cells in it, the fewest.
    """
    square = mine(SQUARE.format(asked))["square"]
    assert (square["nodes"], square["variance_share"]) == (nodes, share)
    x = 1 / (0.1035 * nodes)
    assert 0.1 * x**2 <= 0.1 * asked < 0.1 * (x * nodes / (nodes - 1)) ** 2 or nodes == 39
    assert 0.4 * (1 - share) == pytest.approx(0.2 * asked, rel=0.01)


def test_a_square_without_the_correction_at_edges_has_finer_cells(mine):
    """There the error is 0.06 x."""
    square = mine(SQUARE.format(0.05) + "\nnumerics: {contact_area: nodes}")["square"]
    assert square["nodes"] == pytest.approx(0.06 / (0.1 * 0.05 * 0.1035), abs=1)


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ("targets: [figure2]\nsquare: {nodes: auto}", "a whole number from 2 to 1024, or auto with accuracy.pressure"),
        ("targets: [figure2]\nsquare: {variance_share: auto}", "a number > 0 and <= 1, or auto with accuracy.pressure"),
    ],
)
def test_a_square_that_does_not_follow_from_an_accuracy_is_refused(mine, given, line):
    key = "square.nodes" if "nodes" in given else "square.variance_share"
    (found,) = lines_of(mine, "extends: paper\n" + given)
    assert found.startswith(f"scenes/mine.yaml: {key}: 'auto' is not allowed; {line}")


def test_a_square_beyond_memory_is_refused(mine):
    (found,) = lines_of(mine, SQUARE.format(0.1) + "\nroughness: {correlation_length_m: 5.0e-7}")
    assert found == (
        "scenes/mine.yaml: square.nodes: 1095 is not allowed; at most 1024; auto takes so many for accuracy.pressure"
    )


def _left(cell: float, length: float) -> float:
    return ERRORS["friction_std"] * (cell / length) ** ORDER
