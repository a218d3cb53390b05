"""Cells and tolerance that a scene leaves to its accuracy."""

import pytest

from roughslip.scene.accuracy import CELL_SHARE, COARSEST, ERRORS, ORDER, cell_m
from tests.scene.shipped import lines_of, shipped_scene

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
