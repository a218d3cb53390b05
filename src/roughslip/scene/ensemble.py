"""Section `ensemble` of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Literal

from roughslip.limits import MOST_NUMBERS
from roughslip.scene.expansion import AUTO
from roughslip.scene.fields import Section, choice, flag, integer, many, number, section
from roughslip.scene.friction import STATISTICS
from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused

Process = Literal["recursion", "embedding", "spectral"]
Marginal = Literal["beta", "empirical", "paper"]
Interpolation = Literal["cubic", "linear"]


@section
class Ensemble(Section):
    """Runs of figure 5."""

    realisations: int = integer(
        "Realisations of the friction process for each damping ratio; fewer than 8 give no interval",
        at_least=8,
        at_most=1_000_000,
    )
    duration_periods: float = number("Duration of a run in natural periods, 2 pi/omega", above=0, at_most=10000)
    discarded_periods: float = number(
        "Periods at the start that the reattachment statistics leave out; the counts use all periods",
        at_least=0,
        at_most=10000,
    )
    process: Process = choice(
        "Method that draws realisations of the friction process: recursion, exact and piece by piece; embedding, "
        "exact; spectral, waves of random phase as in the paper. The last two keep a whole realisation in memory",
        Process,
        default="recursion",
    )
    marginal: Marginal = choice(
        "Distribution of the friction process, at the mean and standard deviation of the windows: beta, fitted; "
        "empirical, the quantiles of the windows; paper, Beta(2.1, 5)",
        Marginal,
        default="beta",
    )
    interpolation: Interpolation = choice(
        "Interpolation between the nodes of a realisation: cubic with a continuous slope, or linear",
        Interpolation,
        default="cubic",
    )
    nodes_per_correlation_length: int | Literal["auto"] = integer(
        "Nodes of a realisation of the friction process per correlation length; auto doubles them until the error of "
        "the mean numbers of cycles is at most count_error",
        at_least=2,
        at_most=1000,
        or_word=AUTO,
    )
    count_by_period: bool = flag(
        "Whether the runs without scatter end with their first cycle, which all later ones repeat, and are counted by "
        "its period; not with excitation",
        default=False,
    )
    count_error: float = number(
        "With nodes_per_correlation_length auto: largest error of the mean number of cycles at every damping ratio "
        "from the spacing of the nodes, relative to the largest of these numbers",
        at_least=0.001,
        at_most=0.5,
        default=None,
    )
    damping_ratios: tuple[float, ...] = many(
        "Damping ratios of figure 5 (c), strictly increasing",
        number("A damping ratio, as oscillator.damping_ratio", at_least=0, at_most=10),
        most=200,
    )
    drawn_realisations: int = integer(
        "Realisations drawn in figure 5 (a); only their whole trajectories are stored", at_least=1, at_most=1000
    )


REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"ensemble": {"nodes_per_correlation_length": ("count_error",)}}

NODES, ERROR = "ensemble.nodes_per_correlation_length", "ensemble.count_error"
MARGINAL, PROCESS = "ensemble.marginal", "ensemble.process"
DURATION, LENGTH = "ensemble.duration_periods", "friction.statistics.correlation_length_m"
PARALLEL = "oscillator.windows_in_parallel"
DEPTH, LEVELS = "oscillator.penetration_percentile", "strip.penetration_percentiles"


def mistakes(scene: Values) -> Iterator[Mistake]:
    """What does not go together in ensemble, friction and oscillator."""
    nodes, error, marginal = (given(scene, key) for key in (NODES, ERROR, MARGINAL))
    if nodes == AUTO and error is None:
        yield missing(f"{NODES} = {AUTO} needs it", ERROR, NODES)
    elif nodes is not None and nodes != AUTO and error is not None:
        yield not_together(ERROR, error, NODES, nodes, allowed=f"only {AUTO} takes it")
    empirical, statistics = marginal == "empirical", given(scene, STATISTICS)
    if statistics is not None and empirical:
        yield refused(marginal, f"beta or paper where {STATISTICS} replaces the windows", MARGINAL, STATISTICS)
    parallel = given(scene, PARALLEL)
    if parallel is not None and parallel != 1 and empirical:
        allowed = "1, or beta or paper for the marginal"
        yield not_together(PARALLEL, parallel, MARGINAL, marginal, allowed=allowed)
    depth, levels = given(scene, DEPTH), given(scene, LEVELS)
    if depth is not None and statistics is not None:
        yield not_together(DEPTH, depth, STATISTICS)
    elif depth is not None and levels and not levels[0] <= depth <= levels[-1]:
        allowed = f"between the first and last of {LEVELS}, {levels[0]} and {levels[-1]}"
        yield refused(depth, allowed, DEPTH, LEVELS)
    elif depth is not None and depth != 50 and empirical:
        allowed = "50, where quantiles of the windows are kept"
        yield not_together(DEPTH, depth, MARGINAL, marginal, allowed=allowed)
    length = given(scene, LENGTH)
    if scene["ensemble"].get("process", "recursion") != "recursion" and _path_nodes(scene) > MOST_NUMBERS:
        allowed = f"long enough for at most {MOST_NUMBERS} nodes (0.8 GB of memory) over the belt's way in a run, "
        keys = (LENGTH, "oscillator", DURATION, NODES, PROCESS)
        yield refused(length, f"{allowed}or {PROCESS}: recursion", *keys)


def _path_nodes(scene: Values) -> float:
    """Nodes of a friction path over the distance that the belt moves in a run; 0 where they are not known."""
    keys = (LENGTH, "oscillator.belt_velocity_m_per_s", "oscillator.natural_frequency_rad_per_s", DURATION, NODES)
    length, velocity, omega, periods, nodes = (given(scene, key) for key in keys)
    if None in (length, velocity, omega, periods, nodes) or nodes == AUTO:
        return 0.0
    return float(velocity * periods * 2 * math.pi / omega / length * nodes)
