"""Covariance models and their shape parameters, read from the source of their modules: numpy is not imported."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path

MODELS_FOLDER = Path(__file__).resolve().parents[1] / "surface" / "models"


@cache
def covariance_shapes() -> dict[str, dict[str, tuple[float, float]]]:
    """By the name of each model the ranges of its shape parameters: its literal SHAPES, or none."""
    return {file.stem: _shapes(file) for file in sorted(MODELS_FOLDER.glob("*.py")) if file.stem != "__init__"}


def _shapes(file: Path) -> dict[str, tuple[float, float]]:
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Assign) and [ast.unparse(target) for target in node.targets] == ["SHAPES"]:
            return dict(ast.literal_eval(node.value))
    return {}
