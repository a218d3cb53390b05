"""Section `oscillator` of a scene."""

from __future__ import annotations

import math
from collections.abc import Iterator

from roughslip.oscillator.friction_laws import FRICTION_LAWS
from roughslip.scene.fields import Section, choice, flag, integer, many, number, section
from roughslip.scene.friction import MOST_WINDOWS, RECORD, STATISTICS
from roughslip.scene.mistakes import Mistake, Rule, Values, missing, not_together, strictly_increasing


@section
class Oscillator(Section):
    """Mass on a moving belt, eqs. (12) and (13)."""

    mass_kg: float = number("Mass m", "kg", measured=True, above=0, maximum=1e6)
    natural_frequency_rad_per_s: float = number(
        "Natural frequency omega; the spring has m omega^2",
        "rad/s",
        measured=True,
        above=0,
        maximum=1e6,
        default=None,
    )
    stiffness_n_per_m: float | None = number(
        "Stiffness k of the spring, in place of natural_frequency_rad_per_s, which is then sqrt(k / m)",
        "N/m",
        measured=True,
        minimum=1e-12,
        maximum=1e15,
        default=None,
    )
    damping_ratio: float = number("Damping ratio D = d_k / (2 m omega)", measured=True, minimum=0, maximum=1)
    belt_velocity_m_per_s: float = number("Velocity of the belt v0", "m/s", measured=True, above=0, maximum=1000)
    normal_force_n: float = number(
        "Normal force N; with load it follows", "N", measured=True, above=0, maximum=1e9, default=None
    )
    excitation_force_n: float = number("Amplitude Q of the excitation Q cos(Omega t)", "N", minimum=0, maximum=1e9)
    excitation_frequency_rad_per_s: float = number(
        "Angular frequency Omega of the excitation", "rad/s", minimum=0, maximum=1e6
    )
    static_friction: float = number(
        "Mean friction coefficient at rest, eq. (13) at v_rel = 0", measured=True, above=0, maximum=10
    )
    law: str = choice(
        "Mean friction against sliding speed: stribeck, eq. (13) with the mean friction coefficient of the windows as "
        "mu_fit; coulomb, that coefficient at every speed; table, friction_table",
        FRICTION_LAWS,
        default="stribeck",
    )
    friction_table: tuple[tuple[float, float], ...] | None = many(
        "With law table: sliding speeds [m/s], strictly increasing from 0 on, each with the mean friction coefficient. "
        "The last one holds beyond its speed, and the windows give the scatter alone",
        many(
            "A speed and its coefficient",
            number("A number", measured=True, minimum=0, maximum=1e6),
            minimum=2,
            maximum=2,
        ),
        minimum=2,
        maximum=1000,
        default=None,
    )
    stribeck_decay_s_per_m: float = number(
        "Decay of the Stribeck law, 1.42 in eq. (13)", "s/m", measured=True, minimum=0, maximum=1e6
    )
    stribeck_quadratic_s2_per_m2: float = number(
        "Quadratic rise of the Stribeck law, 0.01 in eq. (13)", "s^2/m^2", measured=True, minimum=0, maximum=1e6
    )
    stochastic_static_limit: bool = flag("Whether the stochastic part enters the static limit too")
    penetration_percentile: float | None = number(
        "Penetration of the surfaces that the mass slides on, between the first and the last of the strip, as the "
        "share of the heights above the plane; with load it follows",
        "%",
        above=0,
        below=100,
        default=50.0,
    )
    windows_in_parallel: int = integer(
        "Windows that bear the normal force in parallel; the friction of n independent ones scatters less, by sqrt(n); "
        "with load the number follows",
        minimum=1,
        maximum=MOST_WINDOWS,
        default=1,
    )


_FREQUENCY, _STIFFNESS, _MASS = "natural_frequency_rad_per_s", "stiffness_n_per_m", "mass_kg"
_STATIC, _LAW, _TABLE = "oscillator.static_friction", "oscillator.law", "oscillator.friction_table"
_FORCE, _DEPTH = "oscillator.excitation_force_n", "oscillator.penetration_percentile"
MOST_FRICTION = 10  # as of other coefficients
MOST_STEP = 2.0  # of static friction over that at vanishing speed
FREE = ("figure_budget", "figure_map")  # figures without excitation

REPLACES: dict[str, tuple[str, ...]] = {
    f"oscillator.{_FREQUENCY}": (f"oscillator.{_STIFFNESS}",),
    f"oscillator.{_STIFFNESS}": (f"oscillator.{_FREQUENCY}",),
    _LAW: (_TABLE,),
}

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
    *(
        Rule(
            (_STATIC, mean, _LAW),
            lambda static, mean, law: law == "table" or static >= mean,
            f"at least {mean} = {{1}}; below it friction turns negative at high speed, or stick holds less than slip",
        )
        for mean in ("friction.mean_at_median", "load.mean_friction", f"{STATISTICS}.mean")
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
        ("load.mean_friction", _TABLE, _LAW),
        lambda mean, table, law: law != "table" or min(row[1] for row in table) <= mean <= max(row[1] for row in table),
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
    Rule(
        (_DEPTH, "strip.penetration_percentiles"),
        lambda depth, levels: depth == 50 or levels[0] <= depth <= levels[-1],
        "between the first and the last of strip.penetration_percentiles = {1}",
    ),
    Rule(
        (_DEPTH, "ensemble.marginal"),
        lambda depth, marginal: depth == 50 or marginal != "empirical",
        "50 where ensemble.marginal is {1}: quantiles of the windows are kept at 50 alone",
    ),
    *(
        Rule(
            (_DEPTH, form),
            lambda depth, _: depth == 50,
            f"one of {_DEPTH} and {form}, which replaces the windows",
        )
        for form in (STATISTICS, RECORD)
    ),
)


def mistakes(scene: Values) -> Iterator[Mistake]:
    """The spring is given by the natural frequency or by its stiffness, and a friction table with its law alone."""
    values = scene.get("oscillator")
    if not isinstance(values, dict):
        return
    law, table = values.get("law", "stribeck"), values.get("friction_table")
    if law == "table" and table is None:
        yield missing(f"{_LAW} = table needs it", _TABLE, _LAW)
    elif law not in ("table", None) and table is not None:
        yield not_together(_TABLE, table, _LAW, law, allowed="only table takes it")
    if _FREQUENCY in values and _STIFFNESS in values:
        yield not_together(f"oscillator.{_STIFFNESS}", values[_STIFFNESS], f"oscillator.{_FREQUENCY}")
    elif _FREQUENCY not in values and _STIFFNESS not in values:
        yield missing(f"give it, or oscillator.{_STIFFNESS}", f"oscillator.{_FREQUENCY}")


def with_frequency(scene: Values) -> Values:
    """The scene with the natural frequency that follows from stiffness and mass, where it gives these instead."""
    values = scene.get("oscillator")
    if isinstance(values, dict) and _FREQUENCY not in values:
        stiffness, mass = values.get(_STIFFNESS), values.get(_MASS)
        if isinstance(stiffness, int | float) and isinstance(mass, int | float) and min(stiffness, mass) > 0:
            return scene | {"oscillator": values | {_FREQUENCY: math.sqrt(stiffness / mass)}}
    return scene
