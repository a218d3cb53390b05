"""Memory that a job of each stage takes, from the sizes of its scene: declared to Snakemake before anything runs.

Each estimate is what Python, its libraries and compiled functions take, and the arrays that grow with the scene, in so
many copies as the peaks that stages measure of themselves ask for (`peak_memory_mib` in costs.json, kept for two scenes
in results/reference). Too high by a factor of up to two or so in a small scene, which a scheduler forgives; one that is
too low kills the job.
"""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

from roughslip.limits import FUNCTIONALS, MOST_NUMBERS, VARIABLE_COUNTS
from roughslip.scene import plan
from roughslip.scene.expansion import AUTO, BEST, terms

Scene = dict[str, Any]

NODE_MB = 400  # of the two Snakemakes that start a job on a node of a cluster

_MB = 1_000_000
_NUMBER = 8  # bytes
_PLAIN, _DRAWING, _COMPILED = 260, 320, 420  # MB: Python with libraries; with plots; with compiled functions
_MOTION = 520  # MB: with those of the oscillator, while they are compiled
_NODES_KEPT = 16  # around the centre of the square, at most
_AUTO_SOLVES = 2**14  # of training_square, and 2048 or more of field_square
_REPLICATES = 400  # of the bootstrap
_LEAST_BATCH = 1


def needed_mb(scene: Scene, stage: str, count: int = 0) -> int:
    """Megabytes that a job of the stage takes at its peak.

    count : samples of its batch, 0 for a stage without batches
    """
    estimate = _STAGES.get(stage)
    if estimate is not None:
        return math.ceil(estimate(scene, count))
    return _DRAWING if stage.startswith("figure") else _PLAIN


def largest_batch(scene: Scene, stage: str, count: int, available_mb: float) -> int:
    """As many samples of a batch as fit into memory, at most those that the scene asks for and at least one."""
    least = needed_mb(scene, stage, _LEAST_BATCH)
    each = (needed_mb(scene, stage, count) - least) / count
    if least + each * count <= available_mb or each <= 0:
        return count
    return max(_LEAST_BATCH, int((available_mb - least) / each))


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


def _megabytes(numbers: float) -> float:
    return numbers * _NUMBER / _MB


def _nodes(scene: Scene) -> int:
    return int(plan.get(scene, "square.nodes")) ** 2


def _modes(scene: Scene) -> int:
    """Modes of the square; the most that its memory allows where they are given by their share."""
    given = plan.get(scene, "square.modes")
    return int(given) if given is not None else min(_nodes(scene) // 4 + 1, MOST_NUMBERS // _nodes(scene))


def _modes_mb(scene: Scene) -> float:
    return _megabytes(_modes(scene) * _nodes(scene))


def _samples(scene: Scene, auto: int) -> int:
    given = plan.get(scene, "expansion.samples")
    return auto if given == AUTO else int(given)


def _terms(scene: Scene) -> int:
    variables, degree = (plan.get(scene, f"expansion.{key}") for key in ("variables", "degree"))
    return terms(FUNCTIONALS if variables == BEST else variables, degree, VARIABLE_COUNTS[-1])


def _designs(scene: Scene) -> float:
    """Variables of both designs of the square."""
    latin = plan.get(scene, "square.latin_hypercube_samples") or 0
    return (latin + _samples(scene, 0)) * _modes(scene)


def _surface(scene: Scene, _: int) -> float:
    """Modes, and the covariance matrix of the nodes where these are few, or the modes many."""
    nodes = _nodes(scene)
    formed = nodes <= 1024 or (nodes <= 4096 and _modes(scene) > nodes // 4)  # as karhunen_loeve decides
    return _PLAIN + 80 + 4 * _modes_mb(scene) + (3 * _megabytes(nodes**2) if formed else 0)


def _read_modes(scene: Scene) -> float:
    """Modes, read and checked."""
    return 2.5 * _modes_mb(scene)


def _design(scene: Scene, _: int) -> float:
    return _PLAIN + _read_modes(scene) + 3 * _megabytes(_designs(scene))


def _report(scene: Scene, _: int) -> float:
    return _DRAWING + (_read_modes(scene) if "surface" in plan.stages_needed(scene) else 0)


def _solver(scene: Scene) -> float:
    """Modes, and the mesh in the solver with its transforms on a mesh four times as large."""
    return _COMPILED + _read_modes(scene) + _megabytes(80 * _nodes(scene))


def _contact_square(scene: Scene, count: int) -> float:
    return _solver(scene) + _megabytes(2 * _designs(scene) + 4 * count * (2 * _NODES_KEPT + 4))


def _fit(scene: Scene, samples: float) -> float:
    """Tables of samples times terms: the basis at all nodes, its factor, and those of groups that are left out."""
    return 6 * min(_megabytes(samples * _NODES_KEPT * _terms(scene) / 4), _megabytes(MOST_NUMBERS))


def _training_square(scene: Scene, _: int) -> float:
    samples = _samples(scene, _AUTO_SOLVES)
    return _solver(scene) + _fit(scene, samples) + 4 * _megabytes(samples * _modes(scene))


def _chaos_square(scene: Scene, _: int) -> float:
    draws, samples = scene["expansion"]["draws"], _samples(scene, _AUTO_SOLVES)
    latin = plan.get(scene, "square.latin_hypercube_samples")
    carlo = plan.get(scene, "square.monte_carlo_samples")
    paper = _megabytes(2 * (20_000 + 2 * latin) * _terms(scene))
    return (
        _COMPILED
        + 80
        + 3 * _modes_mb(scene)
        + _fit(scene, samples)
        + 2 * paper
        + _megabytes(20 * draws + 40 * carlo + 3 * (_designs(scene) + samples * _modes(scene)))
    )


def _field_square(scene: Scene, _: int) -> float:
    samples = _samples(scene, max(2048, 4 * _modes(scene)))
    groups = 10 * _modes(scene) * _nodes(scene)
    return _solver(scene) + _megabytes(4 * samples * _nodes(scene) + 3 * groups + 20 * samples * _modes(scene))


def _cells(scene: Scene) -> float:
    """Cells of a strip with its margins."""
    strip = scene["strip"]
    return (strip["length_m"] + 2 * strip["margin_m"]) / strip["cell_m"] * (strip["width_m"] / strip["cell_m"])


def _windows(scene: Scene) -> float:
    """Windows of a strip at all its penetrations."""
    strip = scene["strip"]
    return len(strip["penetration_percentiles"]) * (
        (strip["length_m"] - strip["window_m"]) / strip["window_spacing_m"] + 1
    )


def _sampler(scene: Scene) -> float:
    """Strips drawn by embedding them in a torus of several times their cells, and the solver on their mesh."""
    return _COMPILED + _megabytes(150 * _cells(scene))


def _training_columns(scene: Scene, strips: int) -> float:
    """Pressure and gap on every eighth column of the strips that train, at every penetration."""
    return strips * len(scene["strip"]["penetration_percentiles"]) * _cells(scene) / 8


def _contact_strip(scene: Scene, count: int) -> float:
    trained = min(count, scene["strip"]["training_samples"])
    return _sampler(scene) + _megabytes(8 * count * _windows(scene) + 8 * _training_columns(scene, trained))


def _chaos_strip(scene: Scene, _: int) -> float:
    strips = scene["strip"]["training_samples"]
    samples = strips * _cells(scene) / 8
    along = terms(FUNCTIONALS, scene["expansion"]["degree"], VARIABLE_COUNTS[-1])
    rows = max(1.0, scene["strip"]["width_m"] / scene["strip"]["cell_m"])
    return (
        _sampler(scene)
        + _megabytes(12 * _training_columns(scene, strips))
        + _megabytes(samples * 60 + 4 * samples / rows * 2 * along)
    )


def _expansion_strip(scene: Scene, count: int) -> float:
    levels = len(scene["strip"]["penetration_percentiles"])
    return _sampler(scene) + _megabytes(8 * count * _windows(scene) + 8 * levels * _cells(scene))


def _friction(scene: Scene, _: int) -> float:
    strip = scene["strip"]
    solved, many = strip["samples"], strip["expansion_samples"]
    windows = _windows(scene)
    levels = len(strip["penetration_percentiles"])
    lags = windows / levels
    replicates = _REPLICATES * (2 * many + 3 * lags * levels * 8)
    return _COMPILED + _megabytes(10 * (solved + many) * windows + replicates)


def _path_nodes(scene: Scene) -> float:
    """Nodes of a friction path that is kept whole; the recursion keeps a few thousand."""
    ensemble, oscillator = scene["ensemble"], scene["oscillator"]
    if ensemble.get("process", "recursion") == "recursion":
        return 1e5
    given = plan.get(scene, "friction.statistics.correlation_length_m")
    length = given if given is not None else 1e-6 + plan.get(scene, "strip.window_m") / 20
    nodes = ensemble["nodes_per_correlation_length"]
    periods = ensemble["duration_periods"]
    way = oscillator["belt_velocity_m_per_s"] * periods * 2 * math.pi / oscillator["natural_frequency_rad_per_s"]
    return min((way / length + 300) * (1000 if nodes == AUTO else nodes), 2.0**26)


def _oscillator(scene: Scene, count: int) -> float:
    ensemble = scene["ensemble"]
    periods = ensemble["duration_periods"]
    drawn = 2 * ensemble["drawn_realisations"] * 4000
    return (
        _MOTION
        + _megabytes(10 * _path_nodes(scene) + 4 * drawn)
        + _megabytes(6 * count * (3 * len(ensemble["damping_ratios"]) + 4 * periods) + 2000 * periods)
    )


def _cycles(scene: Scene, _: int) -> float:
    ensemble = scene["ensemble"]
    runs = ensemble["realisations"] * (3 * len(ensemble["damping_ratios"]) + 4 * ensemble["duration_periods"])
    return _PLAIN + _megabytes(8 * runs + _REPLICATES * 2 * ensemble["realisations"])


def _scan(scene: Scene, _: int) -> float:
    """Of a scan the number of points is not known before it is read: as many as are read at all."""
    points = plan.get(scene, "roughness.scan.grinding.points")
    return _DRAWING + _megabytes(40 * (2**23 if points is None else points**2))


_STAGES = {
    "surface": _surface,
    "design": _design,
    "report": _report,
    "contact_square": _contact_square,
    "training_square": _training_square,
    "chaos_square": _chaos_square,
    "field_square": _field_square,
    "contact_strip": _contact_strip,
    "chaos_strip": _chaos_strip,
    "expansion_strip": _expansion_strip,
    "friction": _friction,
    "deterministic": lambda *_: _MOTION,
    "spacing": _oscillator,
    "oscillator": _oscillator,
    "cycles": _cycles,
    "stick_slip_map": lambda *_: _MOTION + 100,
    "survival": lambda *_: _MOTION + 100,
    **dict.fromkeys(("grinding", "scan", "twins", "figure_scan"), _scan),
}
