"""Sections `ensemble`, `map` and `answer` of a scene: the runs of the oscillator."""

from __future__ import annotations

import math
import operator
from collections.abc import Iterator
from typing import Literal

from roughslip.limits import MOST_NUMBERS, PATH_NODES
from roughslip.scene.fields import Section, choice, integer, many, number, section
from roughslip.scene.friction import RECORD, STATISTICS
from roughslip.scene.mistakes import Mistake, Rule, Values, increasing, refused

Process = Literal["recursion", "spectral"]
Marginal = Literal["beta", "empirical", "paper"]

# By the parameters of stages.from_scene.variation, the smallest and the largest value. Only damping may be zero.
LIMITS = {
    "damping": (0.0, 10.0),
    "belt_velocity": (0.0, 1000.0),
    "mass": (0.0, 1e6),
    "stiffness": (0.0, 1e15),
    "load": (0.0, 1e9),
    "windows": (1.0, 1e6),
    "correlation_length": (0.0, 1.0),
    "mean_friction": (0.0, 10.0),
}


@section
class Ensemble(Section):
    """Runs of figure 5."""

    realisations: int = integer(
        "Realisations of the friction process for each damping ratio; fewer than 8 give no interval",
        minimum=8,
        maximum=1_000_000,
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, 2 pi/omega; reattachment statistics leave out the first ten",
        minimum=20,
        maximum=10000,
    )
    process: Process = choice(
        "Method that draws realisations of the friction process: recursion, exact and piece by piece; spectral, "
        "waves of random phase as in the paper, which keeps a whole realisation in memory",
        Process,
        default="recursion",
    )
    marginal: Marginal = choice(
        "Distribution of the friction process, at the mean and standard deviation of the windows: beta, fitted; "
        "empirical, the quantiles of the windows; paper, Beta(2.1, 5)",
        Marginal,
        default="beta",
    )
    nodes_per_correlation_length: int = integer(
        "Nodes of a realisation of the friction process per correlation length", minimum=2, maximum=1000
    )
    damping_ratios: tuple[float, ...] | None = many(
        "Damping ratios of figure 5 (c), strictly increasing; where not given, a list around the scene's own limits",
        number("A damping ratio, as oscillator.damping_ratio", minimum=0, maximum=10),
        maximum=200,
        default=None,
    )
    drawn_realisations: int = integer(
        "Realisations drawn in figure 5 (a); only their whole trajectories are stored", minimum=1, maximum=1000
    )


@section
class StickSlipMap(Section):
    """Probability of stick-slip over two parameters, of figure_map."""

    parameters: tuple[str, ...] = many(
        "The two parameters that vary; the other parts of the machine stay, as spring and damper of another mass",
        choice("A parameter", tuple(LIMITS)),
        minimum=2,
        maximum=2,
        unique=True,
        default=["damping", "belt_velocity"],
    )
    ranges: tuple[tuple[float, float], ...] | None = many(
        "First and last value of each, in SI units; where not given, ranges around the scene's own values. A range is "
        "spaced evenly in its logarithm, or evenly from zero",
        many("A range", number("A value", minimum=0, maximum=1e15), minimum=2, maximum=2),
        minimum=2,
        maximum=2,
        default=None,
    )
    points: int = integer(
        "Points on either axis, of which a quarter are run, at most 56", minimum=8, maximum=200, default=33
    )
    realisations: int = integer(
        "Realisations of the friction process, the same at every point", minimum=8, maximum=10000, default=20
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, of which the second half counts", minimum=20, maximum=10000, default=40
    )


@section
class Answer(Section):
    """Runs that tell whether stick-slip occurs, and where it ceases or begins: answer.json."""

    realisations: int = integer(
        "Realisations of the friction process, the same at every value; fewer than 72 do not bound a probability of "
        "5 %",
        minimum=72,
        maximum=10000,
        default=100,
    )
    duration_periods: float | None = number(
        "Duration of a run after its first departure, in natural periods, of which the second half counts; where not "
        "given, what the vibration's decay, the cycle and the correlation of friction take, 40 to 400",
        minimum=20,
        maximum=1_000_000,
        default=None,
    )


MOST_NODES = 4_000_000  # of the friction path of a run, which takes seconds then
MOST_PERIODS = 10_000_000  # natural periods of all runs: 2.5 GB of events
LENGTH_OF_WINDOW = 0.4  # correlation length of the friction over the window, as solved
_VELOCITY, _OMEGA = "oscillator.belt_velocity_m_per_s", "oscillator.natural_frequency_rad_per_s"
_LENGTH, _PROCESS = f"{STATISTICS}.correlation_length_m", "ensemble.process"

# In an overlay, another oscillator or friction has its own ranges, and so have other parameters.
_OF_OTHERS = ("ensemble.damping_ratios", "map.ranges")
REPLACES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("oscillator", "friction"), _OF_OTHERS),
    "map.parameters": ("map.ranges",),
}


def path_nodes(length: float, velocity: float, omega: float, periods: float) -> float:
    """Nodes of the friction path on the way of the belt in a number of natural periods."""
    return PATH_NODES * velocity * periods * 2 * math.pi / omega / length


def _path_fits(length: float, process: str, velocity: float, omega: float, periods: float, nodes: int) -> bool:
    """Whether a friction path over the distance that the belt moves in a run fits into memory, where it is kept."""
    if process == "recursion" or path_nodes(length, velocity, omega, periods) > MOST_NODES:
        return True
    return velocity * periods * 2 * math.pi / omega / length * nodes <= MOST_NUMBERS


RULES = (
    increasing("ensemble.damping_ratios"),
    Rule(
        ("ensemble.realisations", "ensemble.duration_periods"),
        lambda runs, periods: runs * periods <= MOST_PERIODS,
        f"realisations times ensemble.duration_periods = {{1}} at most {MOST_PERIODS} (2.5 GB of memory)",
    ),
    Rule(
        ("ensemble.realisations", "ensemble.damping_ratios"),
        lambda runs, ratios: runs * len(ratios) <= MOST_PERIODS,
        f"realisations times the number of ensemble.damping_ratios at most {MOST_PERIODS} (2 GB of memory)",
    ),
    Rule(("ensemble.drawn_realisations", "ensemble.realisations"), operator.le, "at most ensemble.realisations = {1}"),
    *(
        Rule(
            ("ensemble.marginal", form),
            lambda marginal, _: marginal != "empirical",
            f"beta or paper where {form} replaces the windows",
        )
        for form in (STATISTICS, RECORD)
    ),
    Rule(
        (_LENGTH, _VELOCITY, _OMEGA, "ensemble.duration_periods"),
        lambda length, velocity, omega, periods: path_nodes(length, velocity, omega, periods) <= MOST_NODES,
        f"a length that the belt, {{1}} m/s, passes at most {MOST_NODES // PATH_NODES} times in {{3}} natural periods, "
        f"or a run takes more than {MOST_NODES} nodes of friction",
    ),
    Rule(
        (_VELOCITY, "strip.window_m", _OMEGA, "ensemble.duration_periods"),
        lambda velocity, window, omega, periods: (
            path_nodes(LENGTH_OF_WINDOW * window, velocity, omega, periods) <= MOST_NODES
        ),
        f"a belt that passes strip.window_m = {{1}} m at most {MOST_NODES // PATH_NODES * LENGTH_OF_WINDOW:g} times in "
        f"{{3}} natural periods, or a run takes more than {MOST_NODES} nodes of friction",
    ),
    Rule(
        (_LENGTH, _PROCESS, _VELOCITY, _OMEGA, "ensemble.duration_periods", "ensemble.nodes_per_correlation_length"),
        _path_fits,
        f"long enough for at most {MOST_NUMBERS} nodes (0.8 GB of memory) over the belt's way in a run, "
        f"or {_PROCESS}: recursion",
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A range rises within the limits of its parameter."""
    asked = scene.get("map")
    if not isinstance(asked, dict) or not asked.get("ranges"):
        return
    parameters = asked.get("parameters", ["damping", "belt_velocity"]) or ()
    for parameter, values in zip(parameters, asked["ranges"], strict=False):
        low, high = LIMITS[parameter]
        if not low <= values[0] < values[1] <= high:
            allowed = f"for {parameter} a smaller and a larger number from {low:g} to {high:g}"
            yield refused(values, allowed, "map.ranges", "map.parameters")
        elif values[0] == 0 and parameter != "damping":
            yield refused(values, f"for {parameter} a first number above 0", "map.ranges", "map.parameters")
