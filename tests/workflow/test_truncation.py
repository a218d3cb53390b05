"""A square whose expansion is given by the share of the variance: to its report, or to a line that says what to do."""

from __future__ import annotations

import re

import pytest

from roughslip import store

pytestmark = pytest.mark.slow

SMOOTH = """\
extends: tiny
description: Modes by their share
targets: [figure2]
roughness: {correlation_length_m: 2.0e-4}
square: {variance_share: 0.9}
"""


def test_a_share_goes_from_the_modes_to_the_report(finished, tmp_path):
    """Every stage takes the number of modes from the first one."""
    project = finished.copy(tmp_path / "copy")
    project.scene("smooth", SMOOTH)
    project.make("-j2", "smooth")
    results = project.path("results/smooth")
    modes = store.read(results / "surface/modes.nc")
    count = len(modes["eigenvalue"])
    assert modes["captured_variance"] >= 0.9
    assert store.read(results / "surface/design.nc")["expansion"].shape == (200, count)
    assert store.read(results / "chaos/square.nc")["direction"].shape == (3, count)
    page = re.sub(r"\s+", " ", (results / "report.html").read_text())
    assert f"The square is expanded in {count} modes, the fewest that carry 90 %. They carry " in page
    assert "circulant embedding" not in page  # no strip in this scene


def test_a_share_that_takes_most_modes_ends_in_one_line(project):
    """The heights of tiny are independent from node to node."""
    project.scene("rough", "extends: tiny\ntargets: [figure2]\nsquare: {variance_share: 0.9}\n")
    run = project.snakemake("-j1", "results/rough/surface/design.nc")
    said = run.stdout + run.stderr
    assert run.returncode == 1
    assert "Traceback" not in said
    (line,) = {line for line in said.splitlines() if line.startswith("surface: ")}
    assert line.startswith("surface: 58 of 64 modes, ")
    assert "take a lower square.variance_share, or give their number as square.modes" in line
    assert not project.path("results/rough/surface/modes.nc").exists()
