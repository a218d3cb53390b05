"""Sensitivity of verdicts to assumptions: the range of an input over which a verdict stays, without new solves.

The chain depends on few dimensionless groups, so that most inputs change a verdict through one of them or not at all.

- Contact is linear in E* rms / length. Young's modulus, Poisson's ratio and rms height multiply the pressures and leave
  the contact unchanged. Distributions are compared by Kolmogorov distance. The calibrated shear strength fixes
  mu E*/tau. So no verdict depends on these three, unless the surface yields: then H / (E* rms / length) is one more
  group.
- All lengths of surface, strip and windows together are one scale. Only a length reported in metres changes with it.
- The oscillator without excitation has few groups. They are D, N / (m omega v0), the decay and rise of the friction law
  times v0 and v0^2, and mu_S with its length over v0 / omega. Normal force and mass in proportion change nothing
  (`sensitivity_oscillator`).
- More strips or runs narrow an interval by 1 / sqrt(n) about the number found, to first order. The part of a
  Kolmogorov distance that is sampling alone is kept.

Every verdict is judged by its own rule, on scaled results. Where scaling gives no answer, as for a correlation length
or a mesh, the input is listed among those that need a new run.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any

import numpy as np

from roughslip.verdicts.bracket import REACH, end
from roughslip.verdicts.finding import CONTRADICTS, NOT_TESTED, Arrays
from roughslip.verdicts.rules import claims
from roughslip.verdicts.strips import narrowed

Scene = Mapping[str, Any]
At = Callable[[float], str | None]  # the verdict at a factor of an input; None where it is unknown

MATERIAL = ("material.young_modulus_pa", "material.poisson_ratio")
HARDNESS, RMS, LENGTH = "material.hardness_pa", "roughness.rms_height_m", "roughness.correlation_length_m"
SHAPE = ("roughness.covariance", LENGTH, "roughness.marginal", "roughness.fractal", "roughness.scan")
STRIP = tuple(
    f"strip.{key}" for key in ("length_m", "margin_m", "cell_m", "window_spacing_m", "penetration_percentiles")
)
SQUARE = ("square.nodes", "square.modes or variance_share", "square.latin_hypercube_samples", "expansion.samples")
STRIPS, WINDOW = "strip.samples", "strip.window_m"
LEAST_CONTACT = "friction.least_contact_fraction"
ROOT_N = "interval over sqrt(n)"
PROPORTION = "all lengths of roughness and strip in proportion"
IN_METRES = "mu-correlation-250um"
AT_MEDIAN = ("mu-correlation-exponential", IN_METRES, "mu-right-skewed", "mu-leptokurtic", "mu-beta-2.1-5")  # alone
ACCURACY = 1e-4  # relative, of the ends of a range
FEWEST = 8  # samples or runs that a scene may have


@dataclass(frozen=True)
class Range:
    """The range of one input over which a verdict stays what it is, everything else as in the scene.

    input : key of the scene
    value : its value [SI]
    low, high : the verdict is known to stay between them
    low_changes, high_changes : the verdict is known to differ from there on; None if unknown, or not
        within a factor of ten
    by : source of the range
    """

    input: str
    value: float
    low: float
    low_changes: float | None
    high: float
    high_changes: float | None
    by: str


@dataclass(frozen=True)
class Sensitivity:
    """The inputs that a verdict depends on.

    always : the reason why it depends on none, else empty
    any_value : inputs that may have any value, alone or under the condition stated there
    ranges : inputs with a known range
    new_runs, new_solves : inputs that need a new run, of stages without contact solves or with them
    """

    always: str = ""
    any_value: tuple[str, ...] = ()
    ranges: tuple[Range, ...] = ()
    new_runs: tuple[str, ...] = ()
    new_solves: tuple[str, ...] = ()


def range_of(name: str, value: float, verdict: str, at: At, by: str, least: float = 0.0) -> Range | None:
    """The range of an input from the verdicts at factors of its value; None where only the value itself is known.

    value : of the scene, positive; the ends of a whole number are whole
    least : value below which the input is not allowed
    """
    low, high = (
        end(lambda factor: verdict if factor == 1.0 else at(factor), 1.0, reach, ACCURACY)
        for reach in (max(1.0 / REACH, least / value), REACH)
    )
    if low.stands == high.stands and low.changes is None and high.changes is None:
        return None
    up, down = (math.ceil, math.floor) if isinstance(value, int) else (float, float)
    return Range(
        input=name,
        value=value,
        low=up(value * low.stands),
        low_changes=None if low.changes is None else down(value * low.changes),
        high=down(value * high.stands),
        high_changes=None if high.changes is None else up(value * high.changes),
        by=by,
    )


def judged(again: Callable[[float], list[dict[str, Any]]]) -> Callable[[str], At]:
    """From claims at a factor to the verdict on each of them; what several ask of one factor is judged once."""

    @cache
    def at(factor: float) -> dict[str, str]:
        return {claim["id"]: claim["verdict"] for claim in again(factor)}

    return lambda name: lambda factor: at(factor)[name]


def lengthened(friction: Arrays, factor: float) -> dict[str, np.ndarray]:
    """Friction statistics of a chain whose lengths are all so many times as long."""
    longer = {name for name in friction if name == "lag" or "length" in name} - {"length_name"}
    return {name: factor * values if name in longer else values for name, values in friction.items()}


def present(scene: Scene, keys: Sequence[str]) -> tuple[str, ...]:
    """Those of dotted keys that a scene has."""
    found = []
    for key in keys:
        section, _, last = key.rpartition(".")
        inner: Any = scene
        for part in section.split("."):
            inner = inner.get(part) or {}
        if inner.get(last) is not None:
            found.append(key)
    return tuple(found)


def surface_inputs(scenes: Mapping[str, Scene], branch: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Inputs of surface and material that may have any value, and those that need solves, of square or friction."""
    scene = scenes[branch]
    scale, shape = (*MATERIAL, *present(scene, (RMS,))), present(scene, SHAPE)
    return ((), (HARDNESS, *scale, *shape)) if present(scenes["claims"], (HARDNESS,)) else (scale, shape)


def of_the_square(tested: Mapping[str, str], scenes: Mapping[str, Scene]) -> dict[str, Sensitivity]:
    """Of each statement on Figure 2 that was tested: its pressures have no other scale."""
    free, solves = surface_inputs(scenes, "square")
    lengths = (f"square.edge_m with {key} in proportion" for key in present(scenes["square"], (LENGTH,)))
    sensitivity = Sensitivity(any_value=(*free, *lengths), new_solves=(*solves, *SQUARE))
    return {name: sensitivity for name in tested if name.startswith("fig2-")}


def of_friction(tested: Mapping[str, str], friction: Arrays, scenes: Mapping[str, Scene]) -> dict[str, Sensitivity]:
    """Of each statement on the friction coefficient that was tested."""
    scene = scenes["friction"]
    strip, least = scene["strip"], scene["friction"]["least_contact_fraction"]
    free, solves = surface_inputs(scenes, "friction")
    more = judged(lambda factor: claims(None, narrowed(friction, factor), None))
    longer = judged(lambda factor: claims(None, lengthened(friction, factor), None))
    sensitivities = {}
    for name, verdict in tested.items():
        if not name.startswith(("fig3-", "mu-")):
            continue
        found = [range_of(STRIPS, strip["samples"], verdict, more(name), ROOT_N, FEWEST)]
        if name == IN_METRES:
            found.append(range_of(WINDOW, strip["window_m"], verdict, longer(name), f"with {PROPORTION}"))
        levels = friction["percentile"] == 50.0 if name in AT_MEDIAN else slice(None)
        enough = not np.any(friction["missing_share"][levels] > 0.0)
        if enough:  # then a lower bound drops no window either
            found.append(Range(LEAST_CONTACT, least, 0.0, None, least, None, "no window has less"))
        sensitivities[name] = Sensitivity(
            any_value=(*free, "friction.mean_at_median", *(() if name == IN_METRES else (PROPORTION,))),
            ranges=tuple(one for one in found if one is not None),
            new_runs=() if enough else (LEAST_CONTACT,),
            new_solves=(*solves, *present(scene, STRIP)),
        )
    return sensitivities


def with_sensitivity(
    found: Sequence[Mapping[str, Any]], sensitivities: Mapping[str, Sensitivity]
) -> list[dict[str, Any]]:
    """The claims with a field `stands` each: a Sensitivity as a mapping, None for what is not tested."""
    paper = Sensitivity(always="the paper contradicts itself under every assumption")
    of_verdict = {NOT_TESTED: None, CONTRADICTS: asdict(paper)}
    return [
        {
            **claim,
            "stands": of_verdict[claim["verdict"]]
            if claim["verdict"] in of_verdict
            else asdict(sensitivities[claim["id"]]),
        }
        for claim in found
    ]
