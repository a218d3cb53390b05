"""From the scene to meshes, windows, training columns and random streams."""

import numpy as np
import pytest

from roughslip.grid import Grid
from roughslip.scene.types import scene_of
from roughslip.stages.from_scene import expansion, geometry
from roughslip.stages.from_scene.training import TRAINING_SPACING, training_columns
from roughslip.surface.models import covariance_of


def configuration(**strip):
    """The strip of the paper's scene: lengths that are no whole numbers of cells in floating point."""
    return scene_of(
        {
            "square": {"edge_m": 6e-4, "nodes": 10},
            "strip": {
                "length_m": 2.4e-3,
                "margin_m": 3e-4,
                "width_m": 2.5e-5,
                "cell_m": 2.5e-6,
                "window_m": 6e-4,
                "window_spacing_m": 1.5e-5,
            }
            | strip,
        }
    )


def test_meshes_have_the_size_of_the_scene():
    square = geometry.square_grid(configuration())
    assert (square.nx, square.ny, square.nx * square.dx) == (10, 10, pytest.approx(6e-4))
    strip = geometry.strip_grid(configuration())
    assert (strip.nx, strip.ny) == (1200, 10)
    assert (strip.nx * strip.dx, strip.ny * strip.dy) == pytest.approx((3e-3, 2.5e-5))


@pytest.mark.parametrize("margin", [0.0, 3e-4])
def test_windows_fill_the_middle_of_the_strip(margin):
    windows = geometry.windows(configuration(margin_m=margin))
    nx = geometry.strip_grid(configuration(margin_m=margin)).nx
    assert windows.middle == geometry.middle(configuration(margin_m=margin))
    assert windows.middle.start == nx - windows.middle.stop == round(margin / 2.5e-6)
    assert (windows.length, windows.spacing, windows.count) == (240, 6, 121)
    last = windows.middle.start + (windows.count - 1) * windows.spacing + windows.length
    assert last == windows.middle.stop  # four windows are a whole number of spacings here


def test_windows_that_do_not_fill_the_strip_stay_on_it():
    windows = geometry.windows(configuration(length_m=2.41e-3))
    assert windows.count == 121
    assert windows.middle.stop - windows.middle.start == 964


def test_training_columns_lie_on_the_middle_at_equal_distances():
    columns = training_columns(slice(120, 1080))
    assert set(np.diff(columns)) == {TRAINING_SPACING}
    assert columns[0] - 120 < TRAINING_SPACING
    assert 0 < 1080 - columns[-1] <= TRAINING_SPACING
    assert len(columns) == 120
    assert list(training_columns(slice(0, 4))) == []


def test_streams_of_different_stages_never_meet():
    streams = [value for name, value in vars(geometry).items() if name.startswith("STREAM_")]
    assert len(streams) == len(set(streams)) >= 7


@pytest.mark.parametrize(("length", "near", "far"), [(6e-7, 1, 2), (1e-5, 5, 20), (1.42e-5, 7, 28)])
def test_boxes_of_local_means_follow_the_correlation_length(length, near, far):
    stencil = expansion.stencil(covariance_of("gaussian", 1e-8, length), Grid(100, 50, 1e-6, 2e-6))
    assert (stencil.near[0], stencil.far[0]) == (near, far)
    assert stencil.far[1] == max(2, round(far / 2))
