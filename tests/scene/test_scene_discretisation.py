"""Cells and tolerance that a scene leaves to its accuracy."""

import pytest

from roughslip.scene.discretisation import COARSEST, ERRORS, ORDER, SHARE, cell_m
from tests.scene.shipped import lines_of, shipped_scene

SIZES = [2.4e-3, 3e-4, 2.5e-5, 6e-4, 1.5e-5, 1e-5]  # of the strips of resolved, so that twice the cell divides 5 um


@pytest.mark.parametrize("asked", [0.3, 0.1, 0.03, 0.01, 0.003])
def test_cells_are_the_coarsest_that_leave_their_share(asked):
    """The next coarser ones would leave more, or hold fewer than 4 in a correlation length. n cells are 2.5 um."""
    length = 1.4e-5
    cell = cell_m({"friction_mean": asked, "friction_std": asked}, length, SIZES)
    count = round(2.5e-6 / cell)
    assert cell == pytest.approx(2.5e-6 / count, rel=1e-12)
    assert _left(cell, length) <= SHARE * asked
    assert cell <= COARSEST * length
    coarser = 2.5e-6 / (count - 1) if count > 1 else None
    assert coarser is None or _left(coarser, length) > SHARE * asked or coarser > COARSEST * length


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
        "scenes/mine.yaml: strip.cell_m: 'auto' is not allowed; with roughness.scan a number > 0 [m], at most a "
        "quarter of its shortest correlation length"
    ]


def _left(cell: float, length: float) -> float:
    return ERRORS["friction_std"] * (cell / length) ** ORDER
