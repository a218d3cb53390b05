"""What stages read of a scene, which of them its targets need, and why the others do not run.

Cells and tolerance that a scene leaves to its accuracy.

The scene as types: what stages get of it, the schema that is generated from it, and what that says.
"""

import ast
import dataclasses
import inspect
import math
from functools import reduce

import pytest
import yaml
from jsonschema import Draft202012Validator

from roughslip.scene import fields, schema
from roughslip.scene.accuracy import CELL_SHARE, COARSEST, ERRORS, ORDER, cell_m
from roughslip.scene.declarations import declarations
from roughslip.scene.plan import figures, skip_reasons, stages_needed
from roughslip.scene.types import Scene, get, scene_of, slice_for, without_nulls
from tests.scene.shipped import CONFIG, SCAN, SCENES, SCHEMA, lines_of, properties, shipped_scene

ALWAYS = {"claims", "costs", "report"}
SEVERAL = {"reference", "verify"}  # of several scenes together, asked for by name
OSCILLATOR = {"answer", "deterministic", "oscillator", "cycles", "figure5"}
SCANNED = {"scan", "synthetic_surfaces", "figure_scan"}


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(properties(SCHEMA))
    read = {key for stage in declarations().values() for key in stage.keys}
    read.remove("standard_uncertainties")  # of the loader, not of scene files
    assert read <= keys
    unread = {key for key in keys if not any(f"{key}.".startswith(f"{r}.") or r.startswith(f"{key}.") for r in read)}
    assert unread == {"extends", "jobs"}


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
    assert paper["adaptive_training"] == "expansion.samples is given"
    assert paper["ensemble_pilot"] == "accuracy.cycles is not given"
    assert paper["scan"] == "roughness.scan is not given"
    assert given["contact_strip"] == "friction.statistics is given"
    for name in ("given", "paper"):
        square = skip_reasons(shipped_scene(name) | {"targets": ["figure2"]})
        of_oscillator = "figure5, figure_budget, figure_chain, figure_map"
        asking = f"not asked for: answer, figure3, {of_oscillator}"
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


def test_a_square_beyond_memory_is_refused(mine):
    (line,) = lines_of(mine, SQUARE.format(0.1) + "\nroughness: {correlation_length_m: 5.0e-7}")
    assert line == (
        "scenes/mine.yaml: square.nodes: 1095 is not allowed; at most 1024; auto takes so many for accuracy.pressure"
    )


def _left(cell: float, length: float) -> float:
    return ERRORS["friction_std"] * (cell / length) ** ORDER


UNITS = {
    "m": "m",
    "s": "s",
    "pa": "Pa",
    "kg": "kg",
    "n": "N",
    "rad": "rad",
    "rad_per_s": "rad/s",
    "m_per_s": "m/s",
    "s_per_m": "s/m",
    "n_per_m": "N/m",
    "s2_per_m2": "s^2/m^2",
    "n_s_per_m": "N s/m",
    "per_m2": "1/m^2",
    "m2": "m^2",
    "percentile": "%",
}


def sections(kind: type[fields.Section]) -> list[type[fields.Section]]:
    inner = [field.metadata["kind"] for field in dataclasses.fields(kind) if field.metadata["kind"]]
    return [kind, *(section for one in inner for section in sections(one))]


@pytest.mark.parametrize("name", SCENES)
def test_a_scene_becomes_an_object_with_all_its_values_and_defaults(name):
    values = shipped_scene(name)
    for key, part in properties(SCHEMA).items():
        expected = None if part["type"] == "object" or key == "extends" else get(values, key)
        if expected is not None:
            value = reduce(getattr, key.split("."), scene_of(values))
            assert value == (tuple(expected) if isinstance(expected, list) else expected)


def test_defaults_and_absent_sections():
    scene = {"oscillator": {"law": "coulomb"}, "roughness": {"marginal": {"family": "beta", "shapes": [1, 2]}}}
    assert get(scene, "oscillator.law") == "coulomb"
    assert get(scene, "oscillator.friction_follows") == get({}, "oscillator.friction_follows") == "slip"
    assert get(scene, "roughness.scan.file") is None
    assert get(scene, "strip") is None
    marginal = {"family": "beta", "shapes": [1, 2], "mirrored": False, "correct_correlation": False}
    assert get(scene, "roughness.marginal") == get(scene, "roughness")["marginal"] == marginal
    with pytest.raises(KeyError, match=r"oscillator\.laws is no key of a scene"):
        get(scene, "oscillator.laws")
    typed = scene_of(scene)
    assert (typed.oscillator.law, typed.oscillator.windows_in_parallel) == ("coulomb", 1)
    assert typed.friction.statistics is typed.roughness.scan is None
    assert typed.roughness.marginal.shapes == (1, 2)


def test_a_key_that_was_not_read_is_named():
    scene = scene_of({"strip": {"cell_m": 1e-6, "samples": 8}}, ["strip.cell_m", "strip.expansion_spacing_m"])
    assert scene.strip.cell_m == 1e-6
    with pytest.raises(AttributeError, match=r"^strip\.samples is not among the keys that this stage reads;"):
        _ = scene.strip.samples
    with pytest.raises(AttributeError, match=r"^seed is not among"):
        _ = scene.seed
    with pytest.raises(dataclasses.FrozenInstanceError):
        scene.strip.cell_m = 2e-6
    assert repr(scene.strip) == "Strip(cell_m=1e-06, expansion_spacing_m=None)"


def test_sections_hold_fields_only():
    """The hash of a stage's code leaves them out: their values stand in its slice."""
    for section in sections(Scene):
        tree = ast.parse(inspect.getsource(section))
        assert {type(node) for node in tree.body[0].body} <= {ast.Expr, ast.AnnAssign}, section


def test_the_schema_for_editors_is_current():
    written = (CONFIG / "scene.schema.json").read_text(encoding="utf-8")
    assert written == schema.text(), "run: python -m roughslip.scene.schema"


VALUES = (0, 1, -1, 50, 0.5, 1e-6, 1e30, "auto", "stribeck", "figure2", "x" * 300, "", [], [1], [0.5, 2.0], [2, 1, 2])
VALUES += (["mass", "load"], ["mass", "mass"], [["a"]], [[0.0, 0.4], [1, 0.3]], {}, {"law": 1}, None, True)


def test_the_check_of_values_is_that_of_json_schema():
    """By jsonschema, an independent judge. No double holds the last two, which it takes for numbers."""
    accepted = 0
    for key, part in properties(SCHEMA).items():
        for value in VALUES:
            ours = not any(schema.refusals(value, part))
            assert ours == Draft202012Validator(part).is_valid(value), (key, value)
            accepted += ours
        assert all(any(schema.refusals(value, part)) for value in (math.inf, 10**400))
    assert accepted > 200


def test_the_schema_is_closed_described_and_gives_units():
    Draft202012Validator.check_schema(SCHEMA)
    for key, part in {"": SCHEMA, **properties(SCHEMA)}.items():
        if part["type"] == "object":
            assert part["additionalProperties"] is False, key
            assert set(part.get("required", [])) <= set(part["properties"]), key
        assert len(part["description"].split()) >= 2, key
        if part["type"] in ("number", "integer"):
            assert {"minimum", "exclusiveMinimum"} & set(part), key
            endings = [ending for ending in UNITS if key.endswith(f"_{ending}")]
            unit = UNITS[max(endings, key=len)] if endings else "-"
            assert part["description"].endswith(f" [{unit}]"), key
