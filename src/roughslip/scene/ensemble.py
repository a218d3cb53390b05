"""The friction process of the ensemble: which keys go with one another."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from roughslip.scene.roughness import Mistake
from roughslip.scene.strict_yaml import shown

AUTO = "auto"
NODES, ERROR = "ensemble.nodes_per_correlation_length", "ensemble.count_error"
MARGINAL, PROCESS = "ensemble.marginal", "ensemble.process"
PARALLEL = "oscillator.windows_in_parallel"
DEPTH, LEVELS = "oscillator.penetration_percentile", "penetration_percentiles"
LENGTH = "friction.statistics.correlation_length_m"
MOST_NODES = 100_000_000  # in one array: 0.8 GB

# In an overlay: by section, what a key takes the place of, where the overlay does not give that too.
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"ensemble": {"nodes_per_correlation_length": ("count_error",)}}


def mistakes(scene: dict[str, Any]) -> Iterator[Mistake]:
    """What does not go together in ensemble, friction and oscillator; what the schema refuses is left to it."""
    ensemble = scene["ensemble"]
    nodes, error = ensemble.get("nodes_per_correlation_length"), ensemble.get("count_error")
    if nodes == AUTO and error is None:
        yield Mistake((ERROR, NODES), f"missing; {NODES} = {AUTO} needs it")
    elif nodes is not None and nodes != AUTO and error is not None:
        text = f"{shown(error)} is not allowed beside {NODES} = {shown(nodes)}; only {AUTO} takes it"
        yield Mistake((ERROR, NODES), text)
    statistics = _section(scene, "friction").get("statistics")
    if statistics is not None and ensemble.get("marginal") == "empirical":
        text = f"{shown('empirical')} is not allowed; beta or paper where friction.statistics stands for the windows"
        yield Mistake((MARGINAL, "friction.statistics"), text)
    parallel = _section(scene, "oscillator").get("windows_in_parallel", 1)
    if parallel != 1 and ensemble.get("marginal") == "empirical":
        text = f"{shown(parallel)} is not allowed beside {MARGINAL} = empirical; 1, or beta or paper for the marginal"
        yield Mistake((PARALLEL, MARGINAL), text)
    depth = _section(scene, "oscillator").get("penetration_percentile")
    levels = _range(_section(scene, "strip").get(LEVELS))
    if depth is not None and statistics is not None:
        yield Mistake((DEPTH, "friction.statistics"), f"{shown(depth)} is not allowed beside friction.statistics")
    elif isinstance(depth, int | float) and levels is not None and not levels[0] <= depth <= levels[1]:
        text = f"{shown(depth)} is not allowed; between the first and last of strip.{LEVELS}"
        yield Mistake((DEPTH, f"strip.{LEVELS}"), f"{text}, {levels[0]} and {levels[1]}")
    elif depth is not None and depth != 50 and ensemble.get("marginal") == "empirical":
        text = f"{shown(depth)} is not allowed beside {MARGINAL} = empirical"
        yield Mistake((DEPTH, MARGINAL), f"{text}; 50, where quantiles of the windows are kept")
    if ensemble.get("process", "recursion") != "recursion" and isinstance(statistics, dict):
        section = _section(scene, "oscillator")
        velocity, omega = section.get("belt_velocity_m_per_s"), section.get("natural_frequency_rad_per_s")
        length, periods = statistics.get("correlation_length_m"), ensemble.get("duration_periods")
        if _path_nodes(length, velocity, omega, periods, nodes) > MOST_NODES:
            text = (
                f"{shown(length)} is not allowed; long enough for at most {MOST_NODES} nodes (0.8 GB of memory) over "
            )
            keys = (LENGTH, "oscillator", "ensemble.duration_periods", NODES, PROCESS)
            yield Mistake(keys, f"{text}the belt's way in a run, or {PROCESS}: recursion")


def _range(levels: Any) -> tuple[float, float] | None:
    """The first and the last of a list of numbers; None where it is something else."""
    if not isinstance(levels, list) or not levels or not all(type(one) in (int, float) for one in levels):
        return None
    return levels[0], levels[-1]


def _section(scene: dict[str, Any], name: str) -> dict[str, Any]:
    section = scene.get(name)
    return section if isinstance(section, dict) else {}


def _path_nodes(length: Any, velocity: Any, omega: Any, periods: Any, nodes: Any) -> float:
    """Nodes of a friction path over the distance that the belt moves in a run; 0 where that cannot be told."""
    values = (length, velocity, omega, periods, nodes)
    if not all(type(value) in (int, float) and value > 0 for value in values):
        return 0.0
    return float(velocity * periods * 2 * math.pi / omega / length * nodes)
