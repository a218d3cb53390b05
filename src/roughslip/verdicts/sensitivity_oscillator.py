"""Sensitivity of the verdicts on Figure 5, from the oscillator without scatter and the ensemble at other dampings.

Below the Hopf point steady sliding is unstable, so that the cycle is the only attractor. Above the limit of existence
there is no cycle. Stage deterministic searches how far mass and belt velocity may change until either holds at the
scene's damping. Between the two limits the scatter decides, and neither gives the verdict. An end that lies there has
two numbers: up to where the verdict is known to stay, and from where it is known to differ.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

import numpy as np

from roughslip.chaos.sampling import wilson_interval
from roughslip.verdicts.finding import CONTRADICTED, NOT_TESTED, REPRODUCED, Arrays
from roughslip.verdicts.rules import claims
from roughslip.verdicts.sensitivity import (
    FEWEST,
    ROOT_N,
    STRIP,
    At,
    Range,
    Scene,
    Sensitivity,
    judged,
    present,
    range_of,
    surface_inputs,
)
from roughslip.verdicts.strips import narrowed
from roughslip.verdicts.thresholds import CYCLING

CYCLE, SHARP, BEYOND, REATTACHMENT = (
    f"fig5-{name}" for name in ("limit-cycle", "sharp-limit", "range-beyond-limit", "reattachment-nonnormal")
)
UNDER_LOAD = "own-fig5-under-load"
DAMPING, PARALLEL, FORCE = (
    f"oscillator.{key}" for key in ("damping_ratio", "windows_in_parallel", "excitation_force_n")
)
SEARCHED = ("mass_kg", "belt_velocity_m_per_s")
DAMPINGS, DISCARDED, RUNS = (f"ensemble.{key}" for key in ("damping_ratios", "discarded_periods", "realisations"))
SCATTER = "friction.statistics.standard_deviation"
INPUTS = (
    *(f"oscillator.{key}" for key in SEARCHED),
    *(DAMPING, PARALLEL, FORCE, SCATTER, DAMPINGS, "ensemble.duration_periods", DISCARDED, RUNS),
)
NOT_READ = {  # of these, by a statement and its rule
    CYCLE: (DAMPINGS, DISCARDED),
    SHARP: (DAMPING, PARALLEL, SCATTER, DISCARDED, RUNS),
    BEYOND: (DAMPING, DISCARDED),
    REATTACHMENT: (DAMPINGS,),
}
MEDIAN = 50.0


def of_the_oscillator(
    tested: Mapping[str, str], oscillator: Arrays, skeleton: Arrays, scenes: Mapping[str, Scene]
) -> dict[str, Sensitivity]:
    """Of each statement on Figure 5 that was tested.

    oscillator, skeleton : contents of oscillator/statistics.nc and of deterministic.nc
    scenes : slices of the scene, that of friction among them where a surface gives it
    """
    more = judged(lambda factor: claims(None, None, with_runs(oscillator, factor)))
    inputs = [key for key in INPUTS if key != SCATTER or "friction" not in scenes]
    sensitivities = {}
    for name, verdict in tested.items():
        if name == UNDER_LOAD:
            _, solves = _of_the_surface(name, scenes)
            sensitivities[name] = Sensitivity(new_runs=tuple(inputs), new_solves=solves)
        if not name.startswith("fig5-"):
            continue
        found = list(_ranges(name, verdict, oscillator, skeleton, scenes["deterministic"]))
        if RUNS not in NOT_READ[name]:
            found.append(range_of(RUNS, int(oscillator["realisations"]), verdict, more(name), ROOT_N, FEWEST))
        ranges = tuple(one for one in found if one is not None)
        by_surface, solves = _of_the_surface(name, scenes)
        free = (*(key for key in NOT_READ[name] if key in inputs), *_scales(scenes["deterministic"]), *by_surface)
        if name == CYCLE and all(_repelled_and_sure(oscillator, verdict)):  # less scatter comes closer to the cycle
            free = (*free, f"{PARALLEL} from {scenes['deterministic']['oscillator']['windows_in_parallel']} on")
        if name == SHARP:
            free = (*free, f"{DAMPINGS} on both sides of {float(oscillator['deterministic_existence_limit']):.4f}")
        known = {*(one.input for one in ranges), *(entry.partition(" ")[0] for entry in free)}
        runs = tuple(key for key in inputs if key not in known)
        sensitivities[name] = Sensitivity(any_value=free, ranges=ranges, new_runs=runs, new_solves=solves)
    return sensitivities


def with_runs(oscillator: Arrays, factor: float) -> dict[str, np.ndarray]:
    """Statistics of so many times the runs: the same moments and shares, with the intervals that these would have."""
    found = narrowed(oscillator, factor)
    runs = factor * float(oscillator["realisations"])
    for name in ("still_cycling", "cycling_share"):
        found[f"{name}_low"], found[f"{name}_high"] = wilson_interval(np.minimum(oscillator[name] * runs, runs), runs)
    return found


def _scales(scene: Scene) -> Iterator[str]:
    """What the scaled equation has as a ratio alone, or not at all."""
    excited = scene["oscillator"]["excitation_force_n"] > 0.0
    yield f"oscillator.normal_force_n with mass{' and excitation force' if excited else ''} in proportion"
    if not excited:
        yield "oscillator.excitation_frequency_rad_per_s while its force is 0"


def _of_the_surface(name: str, scenes: Mapping[str, Scene]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Inputs of the surface that may have any value, and those that need solves."""
    if "friction" not in scenes:
        return (), ()
    section, (scale, solves) = scenes["deterministic"]["oscillator"], surface_inputs(scenes, "friction")
    if name == UNDER_LOAD or section["penetration_percentile"] is None:  # forces have the scale of the modulus
        return (), (*scale, *solves, *present(scenes["friction"], STRIP))
    if name == SHARP and (section["penetration_percentile"] == MEDIAN or section["law"] == "table"):
        return (*scale, "the whole surface (no scatter enters, and the mean friction is calibrated)"), ()
    return scale, (*solves, *present(scenes["friction"], STRIP))


def _ranges(name: str, verdict: str, oscillator: Arrays, skeleton: Arrays, scene: Scene) -> Iterator[Range | None]:
    """Ranges of damping, mass and belt velocity."""
    section = scene["oscillator"]
    if name == CYCLE:
        yield _over_damping(oscillator, verdict)
    if name in (CYCLE, SHARP):
        for row, key in enumerate(str(parameter) for parameter in skeleton["parameter"]):
            ends = {kind: skeleton[f"{kind}_range"][row] for kind in ("cycle", "unstable", "sides")}
            at = _cycle_at(oscillator, verdict, ends) if name == CYCLE else _sharp_at(verdict, ends["sides"])
            yield range_of(f"oscillator.{key}", section[key], verdict, at, "the cycle without scatter")


def _over_damping(oscillator: Arrays, verdict: str) -> Range:
    """From the runs at the listed damping ratios, judged as those at the scene's own."""
    nominal = float(oscillator["nominal_damping"])
    listed = {nominal: verdict}
    for row, damping in enumerate(oscillator["damping_ratio"]):
        share = {f"cycling_share{end}": oscillator[f"still_cycling{end}"][row] for end in ("", "_low", "_high")}
        there = claims(None, None, {**oscillator, **share, "nominal_damping": damping})
        listed.setdefault(float(damping), next(claim["verdict"] for claim in there if claim["id"] == CYCLE))
    low, low_changes = _last_and_first(listed, verdict, sorted((d for d in listed if d <= nominal), reverse=True))
    high, high_changes = _last_and_first(listed, verdict, sorted(d for d in listed if d >= nominal))
    return Range(DAMPING, nominal, low, low_changes, high, high_changes, "runs at the listed damping ratios")


def _last_and_first(listed: Mapping[float, str], verdict: str, outwards: Sequence[float]) -> tuple[float, float | None]:
    """The last damping ratio up to which the verdict stays, and the first at which it is another, if there is one."""
    for last, first in pairwise(outwards):
        if listed[first] != verdict:
            return last, first
    return outwards[-1], None


def _is_within(ends: np.ndarray, factor: float) -> bool | None:
    """Whether a factor lies within the ends (2, 2) that stage deterministic found; None between the two."""
    (low, below), (high, above) = ends
    if low <= factor <= high:
        return True
    return False if factor <= below or factor >= above else None


def _repelled_and_sure(oscillator: Arrays, verdict: str) -> tuple[bool, bool]:
    """Whether steady sliding repels at the scene's damping, and whether at all dampings where it does every run cycles
    so surely that the verdict is this one."""
    hopf, nominal = float(oscillator["deterministic_hopf_damping"]), float(oscillator["nominal_damping"])
    low = oscillator["still_cycling_low"][oscillator["damping_ratio"] < hopf]
    sure = bool(np.all(low > CYCLING)) and (nominal >= hopf or float(oscillator["cycling_share_low"]) > CYCLING)
    return nominal < hopf, sure and verdict == REPRODUCED


def _cycle_at(oscillator: Arrays, verdict: str, ends: Mapping[str, np.ndarray]) -> At:
    """The verdict on the cycle at a factor of an input."""
    repelled, sure = _repelled_and_sure(oscillator, verdict)
    exists = float(oscillator["nominal_damping"]) < float(oscillator["deterministic_existence_limit"])

    def at(factor: float) -> str | None:
        as_here, as_stable = _is_within(ends["cycle"], factor), _is_within(ends["unstable"], factor)
        if as_here is None:
            return None
        if as_here != exists:  # there is no cycle there
            return CONTRADICTED
        return verdict if repelled and as_stable and sure else None

    return at


def _sharp_at(verdict: str, sides: np.ndarray) -> At:
    """The verdict on the sharp limit at a factor of an input that moves it.

    Without scatter every departure is the same point: below the limit every cycle is the first again, above it there
    is none. So a limit within the list is as sharp as before, and one beyond an end of it is not tested.
    """

    def at(factor: float) -> str | None:
        both = _is_within(sides, factor)
        if both is None or verdict != REPRODUCED:
            return None
        return verdict if both else NOT_TESTED

    return at
