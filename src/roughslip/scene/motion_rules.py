"""Rules that tie keys of the oscillator, its friction and its runs together."""

from __future__ import annotations

import math

from roughslip.limits import MOST_NUMBERS
from roughslip.scene import friction
from roughslip.scene.mistakes import Rule, strictly_increasing
from roughslip.scene.plan import FREE

_STATIC, _LAW, _TABLE = "oscillator.static_friction", "oscillator.law", "oscillator.friction_table"
_FORCE, _DEPTH = "oscillator.excitation_force_n", "oscillator.penetration_percentile"
_VELOCITY, _OMEGA = "oscillator.belt_velocity_m_per_s", "oscillator.natural_frequency_rad_per_s"
MOST_FRICTION = 10  # as of other coefficients
MOST_STEP = 2.0  # of static friction over that at vanishing speed
PATH_NODES, MOST_NODES = 4, 4_000_000  # of a friction path: a correlation length; a run, which takes seconds then
LENGTH_OF_WINDOW = 0.4  # correlation length of the friction over the window, as solved
_LENGTH, _PROCESS = "friction.statistics.correlation_length_m", "ensemble.process"
_MARGINAL = "ensemble.marginal"
_MEMORY = f"{MOST_NUMBERS} (0.8 GB of memory)"


def path_nodes(length: float, velocity: float, omega: float, periods: float) -> float:
    """Nodes of the friction path on the way of the belt in a number of natural periods."""
    return PATH_NODES * velocity * periods * 2 * math.pi / omega / length


def _path_fits(length: float, process: str, velocity: float, omega: float, periods: float, nodes: int) -> bool:
    """Whether a friction path over the distance that the belt moves in a run fits into memory, where it is kept."""
    if process == "recursion" or path_nodes(length, velocity, omega, periods) > MOST_NODES:
        return True
    return velocity * periods * 2 * math.pi / omega / length * nodes <= MOST_NUMBERS


RULES = (
    Rule(
        ("oscillator.excitation_frequency_rad_per_s", _FORCE),
        lambda frequency, force: frequency > 0 or force == 0,
        f"a number > 0 [rad/s] where {_FORCE} is not 0",
    ),
    Rule(
        ("ensemble.count_by_period", _FORCE),
        lambda by_period, force: not by_period or force == 0,
        f"false where {_FORCE} is not 0, because no cycle repeats the last there",
    ),
    Rule(
        ("targets", _FORCE),
        lambda targets, force: not FREE.intersection(targets) or force == 0,
        f"{', '.join(sorted(FREE))} are for the free oscillator, and {_FORCE} is not 0",
    ),
    *(
        Rule(
            (_STATIC, mean, _LAW),
            lambda static, mean, law: law == "table" or static >= mean,
            f"at least {mean} = {{1}}; below it friction turns negative at high speed, or stick holds less than slip",
        )
        for mean in ("friction.mean_at_median", "load.mean_friction", f"{friction.STATISTICS}.mean")
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
        (_MARGINAL, friction.STATISTICS),
        lambda marginal, _: marginal != "empirical",
        f"beta or paper where {friction.STATISTICS} replaces the windows",
    ),
    Rule(
        ("oscillator.windows_in_parallel", _MARGINAL),
        lambda windows, marginal: windows == 1 or marginal != "empirical",
        f"1 where {_MARGINAL} is {{1}}",
    ),
    Rule(
        (_DEPTH, "strip.penetration_percentiles"),
        lambda depth, levels: depth == 50 or levels[0] <= depth <= levels[-1],
        "between the first and the last of strip.penetration_percentiles = {1}",
    ),
    Rule(
        (_DEPTH, _MARGINAL),
        lambda depth, marginal: depth == 50 or marginal != "empirical",
        f"50 where {_MARGINAL} is {{1}}: quantiles of the windows are kept at 50 alone",
    ),
    Rule(
        (_DEPTH, friction.STATISTICS),
        lambda depth, _: depth == 50,
        f"one of {_DEPTH} and {friction.STATISTICS}, which replaces the windows",
    ),
    Rule(
        (
            *(_LENGTH, _PROCESS, "oscillator.belt_velocity_m_per_s", "oscillator.natural_frequency_rad_per_s"),
            *("ensemble.duration_periods", "ensemble.nodes_per_correlation_length"),
        ),
        _path_fits,
        f"long enough for at most {MOST_NUMBERS} nodes (0.8 GB of memory) over the belt's way in a run, "
        f"or {_PROCESS}: recursion",
    ),
)
