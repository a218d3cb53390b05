"""Covariance models and their shape parameters, read from the source of `surface/models.py`: numpy is not imported."""

from __future__ import annotations

import ast
from functools import cache
from pathlib import Path
from typing import Any

MODELS = Path(__file__).resolve().parents[1] / "surface" / "models.py"


@cache
def covariance_shapes() -> dict[str, dict[str, tuple[float, float]]]:
    """By the name of each model, its literal `kind`, the ranges of its shape parameters: its literal `shapes`."""
    classes = [node for node in ast.parse(MODELS.read_text(encoding="utf-8")).body if isinstance(node, ast.ClassDef)]
    found = {str(own["kind"]): own.get("shapes", {}) for own in map(_literals, classes) if "kind" in own}
    return dict(sorted(found.items()))


def _literals(model: ast.ClassDef) -> dict[str, Any]:
    """The attributes `kind` and `shapes` of a class, where it has them."""
    named = [(node.targets[0], node.value) for node in model.body if isinstance(node, ast.Assign)]
    named += [(node.target, node.value) for node in model.body if isinstance(node, ast.AnnAssign) and node.value]
    values = {ast.unparse(name): value for name, value in named}
    return {name: ast.literal_eval(values[name]) for name in ("kind", "shapes") if name in values}
