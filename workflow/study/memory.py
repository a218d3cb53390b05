"""Estimate the memory of a job from the sizes of its scene, before anything runs.

A stage declares what Python and its libraries take, and doubles per product of the sizes below. The numbers come from
the peaks that stages measure of themselves (`peak_memory_mib` in costs.json). An estimate may be too high by a factor
of two in a small scene; one that is too low would end the job.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS, MOST_RUNS, MOST_WINDOWS, SHARES, TRAINING_NODES
from roughslip.scene import plan
from roughslip.scene.declarations import Batches, declarations
from roughslip.scene.expansion import terms
from roughslip.scene.fields import AUTO
from roughslip.scene.types import get

Scene = dict[str, Any]

NODE_MB = 400  # of the two Snakemakes that start a job on a node of a cluster

_MB = 1_000_000
_DOUBLE_MB = 8 / _MB
_AUTO_SOLVES = 2**14  # of adaptive_training, at most


def needed_mb(scene: Scene, stage: str, count: int = 0) -> int:
    """Megabytes that a job of the stage takes at its peak.

    count : samples of its batch, 0 for a stage without batches
    """
    declared = declarations()[stage]
    doubles = sum(
        number * math.prod(SIZES[name](scene, count) for name in product.split())
        for product, number in declared.memory_doubles.items()
    )
    return math.ceil(declared.memory_mb + doubles * _DOUBLE_MB)


def is_allotted(scene: Scene, batches: Batches) -> bool:
    """Whether the jobs of a stage take shares of samples whose number the study finds."""
    return bool(batches.asked) and get(scene, batches.asked) is not None


def samples_of_a_share(scene: Scene, stage: str) -> int:
    """The most samples that stand for one number of a batch: those of a share, or else one."""
    batches = declarations()[stage].batches
    if batches is None or not is_allotted(scene, batches):
        return 1
    return math.ceil(_allotted(batches.totals[""])(scene, 0) / SHARES)


def largest_batch(scene: Scene, stage: str, count: int, available_mb: float) -> int:
    """As many samples of a batch as fit into memory, at most those that the scene asks for and at least one."""
    least = needed_mb(scene, stage, 1)
    each = (needed_mb(scene, stage, count) - least) / count
    if least + each * count <= available_mb or each <= 0:
        return count
    return max(1, int((available_mb - least) / each))


def machine_mb() -> int:
    """Memory of this machine, or of the container or control group that holds this process where that is less."""
    limits = [os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")]
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        try:
            text = Path(file).read_text(encoding="ascii").strip()
        except OSError:
            continue
        if text.isdigit():
            limits.append(int(text))
    return min(limits) // _MB


def _nodes(scene: Scene) -> int:
    return int(get(scene, "square.nodes")) ** 2


def _modes(scene: Scene) -> int:
    """Modes of the square; the most that its memory allows where the scene gives their share of the variance."""
    given = get(scene, "square.modes")
    return int(given) if given is not None else min(_nodes(scene) // 4 + 1, MOST_NUMBERS // _nodes(scene))


def _square_modes(scene: Scene) -> int:
    """Numbers in all modes of the square; none where the scene does not expand it."""
    return _modes(scene) * _nodes(scene) if "karhunen_loeve" in plan.stages_needed(scene) else 0


def _covariance_matrix(scene: Scene) -> int:
    """Numbers in the covariance matrix of the nodes, where surface.modes forms it."""
    nodes = _nodes(scene)
    return nodes**2 if nodes <= 1024 or (nodes <= 4096 and _modes(scene) > nodes // 4) else 0


def _training_samples(scene: Scene, auto: int = _AUTO_SOLVES) -> int:
    given = get(scene, "expansion.samples")
    return auto if given == AUTO else int(given)


def _design_numbers(scene: Scene) -> int:
    """Numbers in both designs of the square."""
    latin = get(scene, "square.latin_hypercube_samples") or 0
    return int(latin + _training_samples(scene, 0)) * _modes(scene)


def _terms(scene: Scene) -> int:
    variables, degree = (get(scene, f"expansion.{key}") for key in ("variables", "degree"))
    return terms(variables, degree)


def _fit_table(scene: Scene) -> float:
    """Numbers in the basis at all training nodes."""
    return min(_training_samples(scene) * TRAINING_NODES * _terms(scene) / 4, MOST_NUMBERS)


def _columns(scene: Scene) -> float:
    """Columns of a strip with its margins."""
    strip = scene["strip"]
    return float((strip["length_m"] + 2 * strip["margin_m"]) / strip["cell_m"])


def _cells(scene: Scene) -> float:
    return _columns(scene) * float(scene["strip"]["width_m"] / scene["strip"]["cell_m"])


def _levels(scene: Scene) -> int:
    return len(scene["strip"]["penetration_percentiles"])


def _windows(scene: Scene) -> float:
    """Windows of a strip at all its penetrations."""
    strip = scene["strip"]
    return _levels(scene) * float((strip["length_m"] - strip["window_m"]) / strip["window_spacing_m"] + 1)


def _path_nodes(scene: Scene) -> float:
    """Nodes of a friction path that is kept whole; the recursion keeps a few thousand."""
    ensemble, oscillator = scene["ensemble"], scene["oscillator"]
    if get(scene, "ensemble.process") == "recursion":
        return 1e5
    given = get(scene, "friction.statistics.correlation_length_m")
    length = given if given is not None else 1e-6 + get(scene, "strip.window_m") / 20
    nodes = ensemble["nodes_per_correlation_length"]
    periods = ensemble["duration_periods"]
    way = oscillator["belt_velocity_m_per_s"] * periods * 2 * math.pi / oscillator["natural_frequency_rad_per_s"]
    return float(min((way / length + 300) * (64 if nodes == AUTO else nodes), 2.0**26))


def _dampings(scene: Scene) -> int:
    """Damping ratios of figure5; the most that stages find where the list is left to them."""
    given = get(scene, "ensemble.damping_ratios")
    return 20 if given == AUTO else len(given)


def _scan_points(scene: Scene) -> int:
    """Points of a scan: as many as are read at all, since its file is not read yet."""
    return 2**23


def _allotted(key: str) -> Callable[[Scene, int], float]:
    """A number of strips or runs; where the study finds it, the most that it may find."""

    def number(scene: Scene, count: int) -> float:
        given = get(scene, key)
        if given != AUTO:
            return float(given)
        if key == "ensemble.realisations":
            return MOST_RUNS
        return MOST_WINDOWS / _windows(scene) / (2 if key == "strip.samples" else 1)

    return number


def _value(key: str) -> Callable[[Scene, int], float]:
    return lambda scene, count: float(get(scene, key))


def _of_scene(size: Callable[[Scene], float]) -> Callable[[Scene, int], float]:
    return lambda scene, count: size(scene)


# The sizes that the products in the declarations of the stages name.
SIZES: dict[str, Callable[[Scene, int], float]] = {
    "batch": lambda scene, count: count,
    "nodes": _of_scene(_nodes),
    "modes": _of_scene(_modes),
    "square_modes": _of_scene(_square_modes),
    "covariance_matrix": _of_scene(_covariance_matrix),
    "design_numbers": _of_scene(_design_numbers),
    "training_samples": _of_scene(_training_samples),
    "field_samples": lambda scene, count: _training_samples(scene, max(2048, 4 * _modes(scene))),
    "terms": _of_scene(_terms),
    "fit_table": _of_scene(_fit_table),
    "latin_hypercube": _value("square.latin_hypercube_samples"),
    "monte_carlo": _value("square.monte_carlo_samples"),
    "draws": _value("expansion.draws"),
    "cells": _of_scene(_cells),
    "columns": _of_scene(_columns),
    "levels": _of_scene(_levels),
    "windows": _of_scene(_windows),
    "strips": _allotted("strip.samples"),
    "expansion_strips": _allotted("strip.expansion_samples"),
    "training_strips": _value("strip.training_samples"),
    "trained_strips": lambda scene, count: min(count, scene["strip"]["training_samples"]),
    "strip_terms": lambda scene, count: terms(FUNCTIONALS, scene["expansion"]["degree"]),
    "path_nodes": _of_scene(_path_nodes),
    "drawn_realisations": _value("ensemble.drawn_realisations"),
    "realisations": _allotted("ensemble.realisations"),
    "dampings": _of_scene(_dampings),
    "periods": _value("ensemble.duration_periods"),
    "scan_points": _of_scene(_scan_points),
}
