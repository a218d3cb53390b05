"""The gallery of the manual: each example is run, its output shown, and a picture drawn of what it leaves behind."""

from __future__ import annotations

import ast
import runpy
from pathlib import Path
from typing import Any

import numpy as np
from pictures import panel

from roughslip import plot

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"


def sections() -> str:
    """A section for each example, with a cell that runs it. The whole study takes minutes, so it is only named."""
    text = []
    for file in sorted(EXAMPLES.glob("*.py")):
        summary = (ast.get_docstring(ast.parse(file.read_text(encoding="utf-8"))) or "").partition("\n\n")[0]
        text.append(f"## {file.stem}\n\n{summary} {{download}}`{file.name} <../examples/{file.name}>`\n")
        if file.stem != "whole_study":
            text.append(f'```{{code-cell}}\n:tags: [remove-input]\nshow("{file.stem}")\n```\n')
    return "\n".join(text)


def show(name: str) -> None:
    """Run an example, and draw what is known to be worth a look."""
    found = runpy.run_path(str(EXAMPLES / f"{name}.py"))
    globals().get(f"_{name}", lambda found: None)(found)


def _contact_hertz(found: dict[str, Any]) -> None:
    plot.pressure(found["loaded"], found["grid"], panel())


def _contact_periodic(found: dict[str, Any]) -> None:
    loads, area = zip(*found["area"].items(), strict=True)
    panel("area of an egg box", xlabel="load / load of full contact", ylabel="share in contact").plot(loads, area, "o-")


def _surface_from_covariance(found: dict[str, Any]) -> None:
    plot.surface(found["heights"], found["grid"], panel("a surface"))


def _surface_from_scan(found: dict[str, Any]) -> None:
    plot.surface(found["scan"].heights, found["grid"], panel("the scan"))
    plot.surface(found["twin"], found["grid"], panel("its twin"))


def _surface_skewed(found: dict[str, Any]) -> None:
    axes = panel("heights", xlabel="height / Sq", ylabel="density", xlim=(-6, 4))
    axes.hist(found["z"].ravel(), 120, density=True)


def _friction_windows(found: dict[str, Any]) -> None:
    plot.friction_path(found["mu"][0], 3e-5, panel("friction along a strip"))


def _expansion_sobol(found: dict[str, Any]) -> None:
    axes, inputs = panel("first indices", xlabel="mass, frequency, load", ylabel="index"), np.arange(1, 4)
    axes.bar(inputs - 0.2, found["first"], 0.4, label="expansion")
    axes.bar(inputs + 0.2, found["exact"], 0.4, label="exact")
    axes.legend()


def _stick_slip_cycle(found: dict[str, Any]) -> None:
    from roughslip.oscillator import trajectory

    plot.limit_cycle(trajectory(found["belt"], found["law"], duration_periods=20.0), found["belt"], axes=panel())


def _stick_slip_map(found: dict[str, Any]) -> None:
    axes = panel("share of time in stick-slip", xlabel="damping ratio", ylabel="share")
    for velocity, share in found["share"].items():
        axes.plot(found["dampings"], share, label=f"{velocity} m/s")
    axes.legend()


def _own_law_and_trace(found: dict[str, Any]) -> None:
    speeds = np.linspace(0.0, 0.3, 200)
    axes = panel("the law", xlabel="speed [m/s]", ylabel="friction coefficient", ylim=(0, 0.4))
    axes.plot(speeds, [found["falling"](speed) for speed in speeds])
    axes.plot(0.0, 0.38, "o")
