"""Sections `oscillator`, `ensemble`, `map` and `answer` of a scene: the mass on a belt and its runs."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from roughslip.limits import MOST_NUMBERS
from roughslip.oscillator.friction_laws import FRICTION_LAWS
from roughslip.scene.friction import MEAN, MOST_WINDOWS, RECORD, STATISTICS
from roughslip.scene.mistakes import (
    Mistake,
    Rule,
    Values,
    increasing,
    missing,
    not_together,
    refused,
    strictly_increasing,
)
from roughslip.scene.section import EachOnce, Section, choice, many, number, word

Uncertain = Annotated[
    float, Field(ge=0, le=1e6, description="A number [-]", json_schema_extra={"uncertain": "friction curve"})
]
DampingRatio = Annotated[float, Field(ge=0, le=10, description="A damping ratio, as oscillator.damping_ratio [-]")]
Value = Annotated[float, Field(ge=0, le=1e15, description="A value [-]")]
Row = Annotated[tuple[Uncertain, Uncertain], Field(strict=False)]
Range = Annotated[tuple[Value, Value], Field(strict=False)]


class Oscillator(Section):
    """Mass on a moving belt, eqs. (12) and (13)."""

    mass_kg: float = number("Mass m", "kg", uncertain="mass", gt=0, le=1e6)
    stiffness_n_per_m: float = number(
        "Stiffness k of the spring; the natural frequency omega is sqrt(k / m)",
        "N/m",
        uncertain="stiffness",
        ge=1e-12,
        le=1e15,
    )
    damping_ratio: float = number("Damping ratio D = d_k / (2 m omega)", uncertain="damping", ge=0, le=1)
    belt_velocity_m_per_s: float = number("Velocity of the belt v0", "m/s", uncertain="belt velocity", gt=0, le=1000)
    normal_force_n: float = number(
        "Normal force N; with load it follows", "N", uncertain="normal force", gt=0, le=1e9, default=None
    )
    excitation_force_n: float = number("Amplitude Q of the excitation Q cos(Omega t)", "N", ge=0, le=1e9)
    excitation_frequency_rad_per_s: float = number("Angular frequency Omega of the excitation", "rad/s", ge=0, le=1e6)
    static_friction: float = number(
        "Mean friction coefficient at rest, eq. (13) at v_rel = 0", uncertain="friction curve", gt=0, le=10
    )
    law: str = word(
        "Mean friction against sliding speed: stribeck, eq. (13) with the mean friction coefficient of the windows as "
        "mu_fit; coulomb, that coefficient at every speed; table, friction_table; or a law of your own",
        FRICTION_LAWS,
        default="stribeck",
        or_file=True,
    )
    friction_table: tuple[Row, ...] | None = many(
        "With law table: sliding speeds [m/s], strictly increasing from 0 on, each with the mean friction coefficient. "
        "The last one holds beyond its speed, and the windows give the scatter alone",
        min_length=2,
        max_length=1000,
        default=None,
    )
    stribeck_decay_s_per_m: float = number(
        "Decay of the Stribeck law, 1.42 in eq. (13)", "s/m", uncertain="friction curve", ge=0, le=1e6
    )
    stribeck_quadratic_s2_per_m2: float = number(
        "Quadratic rise of the Stribeck law, 0.01 in eq. (13)", "s^2/m^2", uncertain="friction curve", ge=0, le=1e6
    )
    windows_in_parallel: int = number(
        "Windows that bear the normal force in parallel; the friction of n independent ones scatters less, by sqrt(n); "
        "with load the number follows",
        ge=1,
        le=MOST_WINDOWS,
        default=1,
    )


class Ensemble(Section):
    """Runs of figure 5."""

    realisations: int = number(
        "Realisations of the friction process for each damping ratio; fewer than 8 give no interval", ge=8, le=1_000_000
    )
    duration_periods: float = number(
        "Duration of a run in natural periods, 2 pi/omega; reattachment statistics leave out the first ten",
        ge=20,
        le=10000,
    )
    process: Literal["recursion", "spectral"] = choice(
        "Method that draws realisations of the friction process: recursion, exact and piece by piece; spectral, "
        "waves of random phase as in the paper, which keeps a whole realisation in memory",
        default="recursion",
    )
    marginal: Literal["beta", "empirical", "paper"] = choice(
        "Distribution of the friction process, at the mean and standard deviation of the windows: beta, fitted; "
        "empirical, the quantiles of the windows; paper, Beta(2.1, 5)",
        default="beta",
    )
    nodes_per_correlation_length: int = number(
        "Nodes of a realisation of the friction process per correlation length", ge=2, le=1000, default=4
    )
    damping_ratios: tuple[DampingRatio, ...] | None = many(
        "Damping ratios of figure 5 (c), strictly increasing; not given, a list around the scene's own limits",
        min_length=1,
        max_length=200,
        default=None,
    )


# Of the parameters of maps, the smallest and the largest value. Only damping may be zero.
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
Parameter = Annotated[str, Field(pattern=f"^({'|'.join(LIMITS)})$", json_schema_extra={"enum": list(LIMITS)})]


class StickSlipMap(Section):
    """Probability of stick-slip over two parameters, of figure_map."""

    parameters: Annotated[tuple[Parameter, Parameter], EachOnce] = many(
        "The two parameters that vary; the other parts of the machine stay, as spring and damper of another mass",
        unique=True,
        default=("damping", "belt_velocity"),
    )
    ranges: tuple[Range, Range] | None = many(
        "First and last value of each, in SI units; not given, a range around the scene's own. "
        "A range is spaced evenly in its logarithm, or evenly from zero",
        default=None,
    )
    points: int = number("Points on either axis, of which a quarter are run, at most 56", ge=8, le=200, default=33)


class Answer(Section):
    """Runs that tell whether stick-slip occurs, and where it ceases or begins: answer.json."""

    realisations: int = number(
        "Realisations of the friction process, the same at every value; fewer than 72 do not bound a probability of "
        "5 %",
        ge=72,
        le=10000,
        default=100,
    )
    duration_periods: float | None = number(
        "Duration of a run after its first departure, in natural periods, of which the second half counts; where not "
        "given, what the vibration's decay, the cycle and the correlation of friction take, 40 to 400",
        ge=20,
        le=1_000_000,
        default=None,
    )


_STATIC, _LAW, _TABLE = "oscillator.static_friction", "oscillator.law", "oscillator.friction_table"
_FORCE, _VELOCITY = "oscillator.excitation_force_n", "oscillator.belt_velocity_m_per_s"
_LENGTH, _PROCESS, _PERIODS = f"{STATISTICS}.correlation_length_m", "ensemble.process", "ensemble.duration_periods"
_MOTION = (_VELOCITY, "oscillator.stiffness_n_per_m", "oscillator.mass_kg", _PERIODS)
MOST_FRICTION = 10  # as of other coefficients
MOST_STEP = 2.0  # of static friction over that at vanishing speed
FREE = ("figure_budget", "figure_map")  # figures without excitation
PATH_NODES, MOST_NODES = 4, 4_000_000  # of a friction path: a correlation length; a run, which takes seconds then
MOST_PERIODS = 10_000_000  # natural periods of all runs: 2.5 GB of events
LENGTH_OF_WINDOW = 0.4  # correlation length of the friction over the window, as solved

REPLACES: dict[str, tuple[str, ...]] = {
    _LAW: (_TABLE,),
    # In an overlay, another oscillator or friction has its own ranges, and so have other parameters.
    **dict.fromkeys(("oscillator", "friction"), ("ensemble.damping_ratios", "map.ranges")),
    "map.parameters": ("map.ranges",),
}


def path_nodes(length: float, velocity: float, stiffness: float, mass: float, periods: float) -> float:
    """Nodes of the friction path on the way of the belt in a number of natural periods."""
    return PATH_NODES * velocity * periods * 2 * math.pi * math.sqrt(mass / stiffness) / length


def _path_fits(
    length: float, process: str, nodes: int, velocity: float, stiffness: float, mass: float, periods: float
) -> bool:
    """Whether a friction path over the distance that the belt moves in a run fits into memory, where it is kept."""
    count = path_nodes(length, velocity, stiffness, mass, periods)
    return process == "recursion" or count > MOST_NODES or count * nodes / PATH_NODES <= MOST_NUMBERS


RULES = (
    Rule(
        ("oscillator.excitation_frequency_rad_per_s", _FORCE),
        lambda frequency, force: frequency > 0 or force == 0,
        f"a number > 0 [rad/s] where {_FORCE} is not 0",
    ),
    Rule(
        ("targets", _FORCE),
        lambda targets, force: force == 0 or not {*FREE}.intersection(targets),
        f"{', '.join(FREE)} are for the free oscillator, and {_FORCE} is not 0",
    ),
    Rule(
        (_STATIC, MEAN, _LAW),
        lambda static, mean, law: law == "table" or static >= mean,
        f"at least {MEAN} = {{1}}; below it friction turns negative at high speed, or stick holds less than slip",
    ),
    Rule(
        (_STATIC, _TABLE),
        lambda static, table: static >= table[0][1],
        f"at least the first coefficient of {_TABLE} = {{1}}, or stick holds less than slip",
    ),
    Rule(
        (_STATIC, _TABLE),
        lambda static, table: static <= MOST_STEP * table[0][1],
        f"at most {MOST_STEP:g} times the first coefficient of {_TABLE} = {{1}}, at vanishing speed",
    ),
    Rule(
        (MEAN, _TABLE, "load"),
        lambda mean, table, _: min(row[1] for row in table) <= mean <= max(row[1] for row in table),
        f"a mean between the smallest and the largest coefficient of {_TABLE} = {{1}}",
    ),
    Rule(
        (_TABLE,),
        lambda table: table[0][0] == 0 and strictly_increasing([speed for speed, _ in table]),
        "strictly increasing speeds from 0 on",
    ),
    Rule(
        (_TABLE,),
        lambda table: all(coefficient <= MOST_FRICTION for _, coefficient in table),
        f"friction coefficients of at most {MOST_FRICTION}",
    ),
    Rule(
        ("oscillator.windows_in_parallel", "ensemble.marginal"),
        lambda windows, marginal: windows == 1 or marginal != "empirical",
        "1 where ensemble.marginal is {1}",
    ),
    increasing("ensemble.damping_ratios"),
    Rule(
        ("ensemble.realisations", _PERIODS),
        lambda runs, periods: runs * periods <= MOST_PERIODS,
        f"realisations times {_PERIODS} = {{1}} at most {MOST_PERIODS} (2.5 GB of memory)",
    ),
    Rule(
        ("ensemble.realisations", "ensemble.damping_ratios"),
        lambda runs, ratios: runs * len(ratios) <= MOST_PERIODS,
        f"realisations times the number of ensemble.damping_ratios at most {MOST_PERIODS} (2 GB of memory)",
    ),
    *(
        Rule(
            ("ensemble.marginal", form),
            lambda marginal, _: marginal != "empirical",
            f"beta or paper where {form} replaces the windows",
        )
        for form in (STATISTICS, RECORD)
    ),
    Rule(
        (_LENGTH, *_MOTION),
        lambda length, *motion: path_nodes(length, *motion) <= MOST_NODES,
        f"a length that the belt, {{1}} m/s, passes at most {MOST_NODES // PATH_NODES} times in {{4}} natural periods, "
        f"or a run takes more than {MOST_NODES} nodes of friction",
    ),
    Rule(
        (_MOTION[0], "strip.window_m", *_MOTION[1:]),
        lambda velocity, window, *motion: path_nodes(LENGTH_OF_WINDOW * window, velocity, *motion) <= MOST_NODES,
        f"a belt that passes strip.window_m = {{1}} m at most {MOST_NODES // PATH_NODES * LENGTH_OF_WINDOW:g} times in "
        f"{{4}} natural periods, or a run takes more than {MOST_NODES} nodes of friction",
    ),
    Rule(
        (_LENGTH, _PROCESS, "ensemble.nodes_per_correlation_length", *_MOTION),
        _path_fits,
        f"long enough for at most {MOST_NUMBERS} nodes (0.8 GB of memory) over the belt's way in a run, "
        f"or {_PROCESS}: recursion",
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A friction table goes with its law alone, and a range of a map rises."""
    values = scene.get("oscillator")
    if isinstance(values, dict):
        yield from _oscillator_mistakes(values)
    if isinstance(scene.get("map"), dict):
        yield from _map_mistakes(scene["map"])


def _oscillator_mistakes(values: Values) -> Iterator[Mistake]:
    law, table = values.get("law", "stribeck"), values.get("friction_table")
    if law == "table" and "friction_table" not in values:
        yield missing(f"{_LAW} = table needs it", _TABLE, _LAW)
    elif law not in ("table", None) and table is not None:
        yield not_together(_TABLE, table, _LAW, law, allowed="only table takes it")


def _map_mistakes(asked: Values) -> Iterator[Mistake]:
    """A range rises within the limits of its parameter."""
    parameters = asked.get("parameters", ["damping", "belt_velocity"]) or ()
    for parameter, values in zip(parameters, asked.get("ranges") or (), strict=False):
        low, high = LIMITS[parameter]
        allowed = ""
        if not low <= values[0] < values[1] <= high:
            allowed = f"for {parameter} a smaller and a larger number from {low:g} to {high:g}"
        elif values[0] == 0 and parameter != "damping":
            allowed = f"for {parameter} a first number above 0"
        if allowed:
            yield refused(values, allowed, "map.ranges", "map.parameters")
