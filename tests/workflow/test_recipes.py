"""The recipes of CONTRIBUTING.md, carried out in a copy of the project."""

import json

import pytest

pytestmark = pytest.mark.slow

SECTION = '''"""Section `slopes` of a scene."""

from roughslip.scene.fields import Section, integer, section


@section
class Slopes(Section):
    """Slopes of the square, of figure_slopes."""

    bins: int = integer("Bins of the histogram", at_least=2, at_most=1000)
'''

FIGURE = '''"""Slopes along the sliding direction."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from roughslip.figures.style import panels

DRAWN = ("modes",)


def figure_slopes(result: Mapping[str, np.ndarray], bins: int) -> Figure:
    """Histogram of the slopes of all modes."""
    figure, axes = panels(1, 1, 4.0)
    axes.hist(np.diff(result["modes"], axis=1).ravel(), bins)
    axes.set(xlabel="Slope", ylabel="Nodes")
    return figure
'''

STAGE = '''"""Stage figure_slopes: draw the slopes of the square."""

from functools import partial

from roughslip.figures.figure_slopes import DRAWN, figure_slopes
from roughslip.scene.declarations import Stage
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.drawing import draw_and_save

STAGE = Stage(
    name="figure_slopes",
    reads="description slopes",
    many={"results": "karhunen_loeve"},
    result="figure_slopes.nc",
    target="figure_slopes",
    caption="Slopes of the square along the sliding direction.",
    memory_mb=320,
)


def work(job: Job) -> None:
    """Draw the figure and write its numbers."""
    draw_and_save(job, partial(figure_slopes, bins=job.scene.slopes.bins), DRAWN)
'''


@pytest.fixture
def copy(empty, tmp_path):
    return empty.copy(tmp_path / "copy")


def jobs(project, scene: str) -> str:
    return project.make("-n", scene).partition("Job stats:")[2].partition("Reasons:")[0]


def test_a_stage_with_its_figure(copy):
    copy.path("src/roughslip/stages/figure_slopes.py").write_text(STAGE)
    copy.path("src/roughslip/figures/figure_slopes.py").write_text(FIGURE)
    copy.path("src/roughslip/scene/slopes.py").write_text(SECTION)
    copy.edit(
        "src/roughslip/scene/types.py",
        "from roughslip.scene.roughness import",
        "from roughslip.scene.slopes import Slopes\nfrom roughslip.scene.roughness import",
    )
    copy.edit(
        "src/roughslip/scene/types.py",
        "    numerics: Numerics",
        "    slopes: Slopes = group(Slopes)\n    numerics: Numerics",
    )
    copy.scene("steep", "extends: tiny\ntargets: [figure_slopes]\nslopes: {bins: 20}\n")
    assert "figure_slopes" not in jobs(copy, "tiny")
    planned = jobs(copy, "steep")
    assert {"karhunen_loeve", "figure_slopes", "scene_report"} <= set(planned.split())
    assert "contact_square" not in planned
    copy.make("-j1", "results/steep/figure_slopes.png", "results/steep/figure_slopes.svg")
    (file,) = copy.path("results/store/figure_slopes").glob("*/key.json")
    key = json.loads(file.read_text())
    assert key["configuration"]["slopes"] == {"bins": 20}
    assert copy.path("results/steep/figure_slopes.svg").is_file()
    copy.scene("lacking", "extends: tiny\ntargets: [figure_slopes]\n")
    run = copy.snakemake("-n", "lacking")
    assert "slopes" in run.stderr
    assert "missing; needed for figure_slopes" in run.stderr


def test_a_scene_key(copy):
    """A new key of the material, with a default, that one stage reads."""
    copy.edit(
        "src/roughslip/scene/contact.py",
        "    poisson_ratio",
        '    yield_share: float = number("Share of the hardness", above=0, at_most=1, default=1.0)\n    poisson_ratio',
    )
    copy.edit("src/roughslip/stages/karhunen_loeve.py", 'reads_if_given="', 'reads_if_given="material.yield_share ')
    ask = "from roughslip.scene.types import slice_for; from roughslip.scene.loader import load\n"
    ask += "from pathlib import Path\n"
    ask += "print(slice_for(load(Path('config/scenes/{}.yaml'), Path('config/scenes')), 'karhunen_loeve')['material'])"
    copy.scene("mine", "extends: tiny\nmaterial: {yield_share: 0.5}\n")
    for name, value in (("tiny", 1.0), ("mine", 0.5)):
        code = copy.path(f"ask_{name}.py")  # of its own name, so that no cached bytecode stands in
        code.write_text(ask.format(name))
        assert copy.python(f"ask_{name}").stdout.strip() == f"{{'yield_share': {value}}}"
    copy.scene("wrong", "extends: tiny\nmaterial: {yield_share: 2}\n")
    assert "material.yield_share: 2 is not allowed" in copy.snakemake("-n", "wrong").stderr
