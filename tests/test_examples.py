"""Each example runs as it stands, and its numbers are right: next to the closed form or number that it prints."""

import math
import runpy
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"


def run(name: str) -> dict:
    """The names that an example leaves behind."""
    return runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_contact():
    """Cells of 1/57 of the contact radius: force to order h^2, peak between nodes. The edge of the wave lies between
    two nodes, so that the count of nodes is exact. Load and penetration are inverse to each other."""
    example = run("contact")
    assert example["force"] == pytest.approx(example["hertz"], rel=1e-4)
    assert example["pressed"].pressure.max() == pytest.approx(example["peak"], rel=2e-4)
    assert example["wavy"].area_fraction == pytest.approx(example["westergaard"], rel=1e-12)
    assert example["heights"].max() - example["loaded"].plane == pytest.approx(1e-7, rel=1e-8)
    assert 0.01 < example["area"] < 1.0  # under the largest load
    assert example["soft"].shares.mean() == pytest.approx(1e9 / 2e9, rel=0.1)  # most of it yields


def test_surface_from_covariance():
    """Some 800 independent patches: Sq to 2.5 %, correlation to 0.03, at two standard errors or less."""
    example = run("surface_from_covariance")
    assert example["rms"] == pytest.approx(1e-6, rel=0.05)
    assert example["correlation"] == pytest.approx(np.exp(-1), abs=0.06)
    assert example["above"] == pytest.approx(0.2, abs=0.03)
    assert example["drawn"].var() * 1e12 == pytest.approx(example["modes"].captured_variance, rel=0.03)


def test_surface_from_scan():
    """The twin lies in the intervals of the scan, and the grooves lie along x."""
    example = run("surface_from_scan")
    along, across = example["best"].axis_lengths_m
    assert along > 2 * across
    for name in ("rms_height", "skewness"):
        scan, twin = getattr(example["found"], name), getattr(example["again"], name)
        assert twin.low < scan.value < twin.high or scan.low < twin.value < scan.high


def test_friction_windows():
    """The scatter that the study keeps lies in the interval."""
    example = run("friction_windows")
    assert float(example["found"].mean.value) == pytest.approx(0.3, rel=1e-2)
    assert example["found"].variation.low < 0.111 < example["found"].variation.high


@pytest.mark.slow  # compiles the motion for the law of the example
def test_own_law_and_trace():
    """The slope of a table of its values is that by hand. A cycle takes a natural period or little more, and ends with
    damping, and with speed."""
    example = run("own_law_and_trace")
    assert example["by_hand"] == pytest.approx(math.exp(-1.25) * 2.5 / 6.0, rel=1e-12)
    assert example["hopf_damping"](example["belt"], example["law"]) == pytest.approx(example["by_hand"], rel=1e-6)
    assert example["ended"].cycles == 2
    for counts in example["counts"].values():
        assert counts[:, 0].min() > 20
        assert counts[:, -1].max() == 0
