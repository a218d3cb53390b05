"""Sections `oscillator`, `ensemble`, `map` and `answer` of a scene: the mass on a belt and its runs."""

import math
import operator
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from roughslip.limits import MOST_NUMBERS, PATH_NODES
from roughslip.scene.friction import MEAN, MOST_WINDOWS, RECORD, STATISTICS
from roughslip.scene.mistakes import Mistake, Rule, Values, fits, given, is_increasing, missing, refused
from roughslip.scene.section import EachOnce, Section, key, many, word

Speed = Annotated[float, key("m/s", ge=0, le=1e6)]
Coefficient = Annotated[float, key(uncertain="friction curve", ge=0, le=10)]
Row = Annotated[tuple[Speed, Coefficient], many()]
DampingRatio = Annotated[float, key(ge=0, le=10)]
Value = Annotated[float, key(ge=0, le=1e15)]
Range = Annotated[tuple[Value, Value], many()]


class Memory(Section):
    """Memory of the contact: rate and state friction with ageing, added to the law."""

    direct_effect: float = key(uncertain="memory", ge=0, le=0.1)
    """Direct effect a, the rise of friction at once with the logarithm of speed; usually 0.003 to 0.02."""
    ageing_effect: float = key(uncertain="memory", ge=0, le=0.1)
    """Ageing effect b, the rise with the logarithm of the age of the contacts; usually 0.003 to 0.03."""
    memory_length_m: float = key("m", uncertain="memory", ge=1e-9, le=1)
    """Memory length D_c, the slip that renews the contacts; usually 0.3 to 20 µm."""
    reference_speed_m_per_s: float = key("m/s", uncertain="memory", ge=1e-9, le=1000)
    """Speed v* at which steady friction is that of the law; usually where it was measured."""
    cutoff_speed_m_per_s: float = key("m/s", uncertain="memory", ge=1e-9, le=1e6)
    """Speed v_c above which contacts have no time to age; usually 1 mm/s to 1 m/s."""
    rest_speed_m_per_s: float = key("m/s", uncertain="memory", ge=1e-12, le=1)
    """Speed v_r below which the direct effect ends; usually 1 nm/s to 1 µm/s."""


class Oscillator(Section):
    """Mass on a moving belt, eqs. (12) and (13)."""

    mass_kg: float = key("kg", uncertain="mass", gt=0, le=1e6)
    """Mass m."""
    stiffness_n_per_m: float = key("N/m", uncertain="stiffness", ge=1e-12, le=1e15)
    """Stiffness k of the spring; the natural frequency omega is sqrt(k / m)."""
    damping_ratio: float = key(uncertain="damping", ge=0, le=1)
    """Damping ratio D = d_k / (2 m omega)."""
    belt_velocity_m_per_s: float = key("m/s", uncertain="belt velocity", gt=0, le=1000)
    """Velocity of the belt v0."""
    normal_force_n: float = key("N", uncertain="normal force", gt=0, le=1e9, default=None)
    """Normal force N; with load it follows."""
    excitation_force_n: float = key("N", ge=0, le=1e9, default=0.0)
    """Amplitude Q of the excitation Q cos(Omega t)."""
    excitation_frequency_rad_per_s: float = key("rad/s", ge=0, le=1e6, default=0.0)
    """Angular frequency Omega of the excitation."""
    static_friction: float | None = key(uncertain="friction curve", gt=0, le=10, default=None)
    """Mean friction coefficient at rest, the limit of stick. The laws stribeck and coulomb need it. With a table or a
    record it is at least the coefficient at the slowest speed, which it is where not given."""
    law: str = word(("coulomb", "stribeck", "table"), default="stribeck", or_file=True)
    """Mean friction against sliding speed: stribeck, eq. (13) with the mean friction coefficient of the windows as
    mu_fit; coulomb, that coefficient at every speed; table, friction_table; or a law of your own."""
    friction_table: tuple[Row, ...] | None = many(min_length=2, max_length=1000, default=None)
    """With law table: sliding speeds [m/s], strictly increasing from 0 on, each with the mean friction coefficient. The
    last one holds beyond its speed, and the windows give the scatter alone. Between them friction is a monotone cubic,
    with one slope at each: that at the belt's velocity decides whether steady sliding is stable."""
    stribeck_decay_s_per_m: float = key("s/m", uncertain="friction curve", ge=0, le=1e6, default=None)
    """Decay of the Stribeck law, which needs it; 1.42 in eq. (13)."""
    stribeck_quadratic_s2_per_m2: float = key("s^2/m^2", uncertain="friction curve", ge=0, le=1e6, default=None)
    """Quadratic rise of the Stribeck law, which needs it; 0.01 in eq. (13)."""
    memory: Memory | None = None
    """Memory of the contact: friction ages in stick, and remembers a distance in slip. Not with excitation or a record;
    the limit of stick follows from the age, so static friction is then that of the law at rest."""
    windows_in_parallel: int = key(ge=1, le=MOST_WINDOWS, default=1)
    """Windows that bear the normal force in parallel; the friction of n independent ones scatters less, by sqrt(n);
    with load the number follows."""


class Ensemble(Section):
    """Runs of figure 5."""

    realisations: int = key(ge=8, le=1_000_000)
    """Realisations of the friction process for each damping ratio; fewer than 8 give no interval."""
    duration_periods: float = key(ge=20, le=10000)
    """Duration of a run in natural periods, 2 pi/omega; reattachment statistics leave out the first ten."""
    process: Literal["recursion", "spectral"] = key(default="recursion")
    """Method that draws realisations of the friction process: recursion, exact and piece by piece; spectral, waves of
    random phase as in the paper, which keeps a whole realisation in memory."""
    marginal: Literal["beta", "paper"] = key(default="beta")
    """Distribution of the friction process, at the mean and standard deviation of the windows: beta, fitted; paper,
    Beta(2.1, 5)."""
    nodes_per_correlation_length: int = key(ge=2, le=1000, default=4)
    """Nodes of a realisation of the friction process per correlation length."""
    damping_ratios: tuple[DampingRatio, ...] | None = many(min_length=1, max_length=200, default=None)
    """Damping ratios of figure 5 (c), strictly increasing; not given, a list around the scene's own limits."""


_OF_MACHINE = ("damping", "belt_velocity", "mass", "stiffness", "load")
PARAMETERS = (*_OF_MACHINE, "windows", "correlation_length", "mean_friction")
Parameter = Annotated[str, word(PARAMETERS)]


class StickSlipMap(Section):
    """Probability of stick-slip over two parameters, of figure_map."""

    parameters: Annotated[tuple[Parameter, Parameter], EachOnce] = many(
        unique=True, default=("damping", "belt_velocity")
    )
    """The two parameters that vary; the other parts of the machine stay, as spring and damper of another mass."""
    ranges: tuple[Range, Range] | None = many(default=None)
    """First and last value of each, in SI units; not given, a range around the scene's own. A range is spaced evenly in
    its logarithm, or evenly from zero."""
    points: int = key(ge=8, le=200, default=33)
    """Points on either axis, of which a quarter are run, at most 56."""


class Changeable(Section):
    """What can change at the machine, each from its first value to its last; without this section, all."""

    damping: Range | None = many(default=None)
    """Damping ratio D."""
    belt_velocity: Range | None = many(default=None)
    """Velocity of the belt [m/s]."""
    mass: Range | None = many(default=None)
    """Mass [kg]."""
    stiffness: Range | None = many(default=None)
    """Stiffness [N/m]."""
    load: Range | None = many(default=None)
    """Normal force [N]."""
    memory_length: Range | None = many(default=None)
    """With a memory: memory length D_c [m]."""
    direct_effect: Range | None = many(default=None)
    """With a memory: direct effect a."""
    ageing_effect: Range | None = many(default=None)
    """With a memory: ageing effect b."""


class Answer(Section):
    """Runs for the probability of stick-slip, and for where it ceases or begins: answer.json."""

    realisations: int = key(ge=72, le=10000, default=100)
    """Realisations of the friction process, the same at every value; fewer than 72 do not bound a probability
    of 5 %."""
    duration_periods: float | None = key(ge=20, le=1_000_000, default=None)
    """Duration of a run after its first departure, in natural periods; its second half counts. Where not given, 40 to
    400, as decay, growth of unstable sliding, cycle and correlation of friction take."""
    can_change: Changeable | None = None
    """What can change at the machine: the smallest change is one of these within its range."""


_CHANGES = [f"answer.can_change.{name}" for name in Changeable.model_fields]
_STATIC, _LAW, _MEMORY = "oscillator.static_friction", "oscillator.law", "oscillator.memory"
TABLE, RATIOS = "oscillator.friction_table", "ensemble.damping_ratios"
_FORCE, _PERIODS = "oscillator.excitation_force_n", "ensemble.duration_periods"
_LENGTH = f"{STATISTICS}.correlation_length_m"
_MOTION = ("oscillator.belt_velocity_m_per_s", "oscillator.stiffness_n_per_m", "oscillator.mass_kg", _PERIODS)
# What a law needs, where no record gives the curve.
OF_LAW = {
    "table": ("friction_table",),
    "coulomb": ("static_friction",),
    "stribeck": ("static_friction", "stribeck_decay_s_per_m", "stribeck_quadratic_s2_per_m2"),
}
MOST_STEP = 2.0  # of static friction over that at vanishing speed
FREE = ("figure_budget", "figure_map")  # figures without excitation
MOST_NODES = 4_000_000  # of the friction path of a run, which takes seconds then
MOST_PERIODS = 10_000_000  # natural periods of all runs: 2.5 GB of events
LENGTH_OF_WINDOW = 0.4  # correlation length of the friction over the window, as solved

REPLACES: dict[str, tuple[str, ...]] = {
    _LAW: (TABLE,),
    TABLE: (_STATIC,),
    # In an overlay, another oscillator or friction has its own ranges, and so have other parameters.
    **dict.fromkeys(("oscillator", "friction"), (RATIOS, "map.ranges")),
    "map.parameters": ("map.ranges",),
}


def path_nodes(length: float, velocity: float, stiffness: float, mass: float, periods: float) -> float:
    """Nodes of the friction path on the way of the belt in a number of natural periods."""
    return PATH_NODES * velocity * periods * 2 * math.pi * math.sqrt(mass / stiffness) / length


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
        (_STATIC, TABLE),
        lambda static, table: table[0][0] > 0 or table[0][1] <= static <= MOST_STEP * table[0][1],
        f"from the first coefficient of {TABLE} = {{1}}, or stick holds less than slip, to {MOST_STEP:g} times it",
    ),
    Rule(
        (MEAN, TABLE, "load"),
        lambda mean, table, _: min(row[1] for row in table) <= mean <= max(row[1] for row in table),
        f"a mean between the smallest and the largest coefficient of {TABLE} = {{1}}",
    ),
    Rule(
        (TABLE,),
        lambda table: table[0][0] == 0 and is_increasing([speed for speed, _ in table]),
        "strictly increasing speeds from 0 on",
    ),
    Rule((RATIOS,), is_increasing, "strictly increasing"),
    *(
        Rule((key,), lambda ends: ends is None or ends[0] < ends[1], "a smaller value, then a larger")
        for key in _CHANGES
    ),
    fits(("ensemble.realisations", _PERIODS), operator.mul, f"realisations times {_PERIODS} = {{1}}", MOST_PERIODS),
    fits(
        ("ensemble.realisations", RATIOS),
        lambda runs, ratios: runs * len(ratios),
        "realisations times the number of ensemble.damping_ratios",
        MOST_PERIODS,
    ),
    *(
        Rule(
            (key, *_MOTION),
            lambda length, *motion, part=part: path_nodes(length, *motion) <= part * MOST_NODES,
            f"a length that the belt, {{1}} m/s, passes at most {int(MOST_NODES / PATH_NODES * part)} times in {{4}} "
            f"natural periods of {{3}} kg on {{2}} N/m, or a run takes more than {MOST_NODES} nodes of friction",
        )
        for key, part in ((_LENGTH, 1.0), ("strip.window_m", LENGTH_OF_WINDOW))
    ),
    Rule(
        (_LENGTH, "ensemble.process", "ensemble.nodes_per_correlation_length", *_MOTION),
        lambda length, process, nodes, *motion: (
            process == "recursion" or path_nodes(length, *motion) * nodes / PATH_NODES <= MOST_NUMBERS
        ),
        f"a length of at most {MOST_NUMBERS} nodes over the way of the belt in a run, or ensemble.process: recursion",
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A law has its numbers, a friction table goes with its law alone, and a range of a map rises."""
    oscillator, asked = scene.get("oscillator"), scene.get("map")
    if isinstance(oscillator, dict):
        law, table = oscillator.get("law", "stribeck"), oscillator.get("friction_table")
        if law not in ("table", None) and table is not None:
            yield refused(table, f"{_LAW} = {law}, and only table takes it", TABLE, _LAW)
        elif "record" not in (scene.get("friction") or {}):
            needed = OF_LAW.get(str(law), ()) if law != "coulomb" or not oscillator.get("memory") else ()
            if law == "coulomb" and not needed and not (scene.get("friction") or {}).get("mean"):
                yield missing(f"{_LAW} = coulomb needs it with {_MEMORY}", MEAN, _LAW, _MEMORY)
            for name in (name for name in needed if name not in oscillator):
                yield missing(f"{_LAW} = {law} needs it", f"oscillator.{name}", _LAW, RECORD, TABLE)
        yield from _memory_mistakes(scene, oscillator, law)
    asked = asked if isinstance(asked, dict) else {}
    parameters = asked.get("parameters", StickSlipMap.model_fields["parameters"].default)
    for parameter, (low, high) in zip(parameters or (), asked.get("ranges") or (), strict=False):
        least, most = {"damping": (0.0, 1.0), "windows": (1.0, math.inf)}.get(parameter, (1e-15, math.inf))
        if not least <= low < high <= most:
            where = {"damping": "from 0 to 1", "windows": "from 1 on"}.get(parameter, "above 0")
            allowed = f"for {parameter} a smaller and a larger number, {where}"
            yield refused([low, high], allowed, "map.ranges", "map.parameters")


def _memory_mistakes(scene: Values, oscillator: Values, law: str | None) -> Iterator[Mistake]:
    """A memory goes with a free mass and a given curve, and stick then has no limit of its own."""
    memory, static, friction = oscillator.get("memory"), oscillator.get("static_friction"), scene.get("friction") or {}
    if not isinstance(memory, dict):
        for key in (key for key in _CHANGES if key.endswith(("memory_length", "_effect")) and memory is None):
            if given(scene, key) is not None:
                yield refused(given(scene, key), f"it is of {_MEMORY}, which the scene has not", key, _MEMORY)
        return
    if "record" in friction:
        yield Mistake((_MEMORY, RECORD), "not allowed; the curve of a record has the memory of its contacts in it")
    if (oscillator.get("excitation_force_n") or 0.0) > 0.0:
        yield Mistake((_MEMORY, _FORCE), f"not allowed; a law with memory takes no excitation: set {_FORCE} to 0")
    table, mean = oscillator.get("friction_table") or [[0.0, None]], friction.get("mean")
    level = {"table": table[0][1], "stribeck": static, "coulomb": mean}.get(str(law))
    numbers: list[Any] = [level, *(memory.get(name) for name in Memory.model_fields)]
    if None not in numbers:
        level, a, b, _, reference, cutoff, rest_speed = numbers
        fresh = level + a * math.log(rest_speed / reference) - b * math.log1p(cutoff / reference)
        if not fresh > 0.0:
            less = "raise its rest speed, or lower its effects"
            yield Mistake((_MEMORY,), f"not allowed; fresh contacts at rest have the friction {fresh:.3g}: {less}")
    if law not in OF_LAW:
        yield Mistake((_MEMORY, _LAW), f"not allowed; it is added to {', '.join(OF_LAW)}")
    elif static not in (None, level):
        allowed = "no value" if level is None else f"no value, or that of slow slip, {level}"
        yield refused(static, f"with a memory the limit of stick follows from the age: {allowed}", _STATIC, _MEMORY)
