"""Section `load` of a scene: the nominal load of the pad, from which penetration and number of windows follow."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.fields import Section, number, section
from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused

MOST_WINDOWS = 1_000_000_000
LIGHT = (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1.0, 3.0)  # [%] penetrations that are solved for the load alone


@section
class Load(Section):
    """Load of the pad: two of force, nominal pressure and apparent area.

    Penetration follows from the nominal pressure by the solved strips, the number of windows from the apparent area.
    """

    force_n: float = number("Normal force on the pad", "N", above=0, at_most=1e9, default=None)
    nominal_pressure_pa: float = number("Force over apparent area", "Pa", above=0, at_most=1e13, default=None)
    apparent_area_m2: float = number("Apparent area of the pad", "m^2", above=0, at_most=1e4, default=None)
    mean_friction: float | None = number(
        "Mean friction coefficient of the pad as measured under this load, in place of the one that follows from "
        "friction.mean_at_median; the scatter changes in proportion",
        above=0,
        at_most=10,
        default=None,
    )


PARTS = ("force_n", "nominal_pressure_pa", "apparent_area_m2")
FORCE = "oscillator.normal_force_n"
BY_HAND = (FORCE, "oscillator.penetration_percentile", "oscillator.windows_in_parallel")
REPLACES: dict[str, dict[str, tuple[str, ...]]] = {"": {"load": BY_HAND}}
NOT_WITH = {"friction.statistics": None, "ensemble.marginal": "empirical"}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """A load has two of its three parts, on a pad of at least one window, and replaces what would be given by hand."""
    load = scene.get("load")
    if load is None:
        oscillator = scene.get("oscillator")
        if isinstance(oscillator, dict) and "normal_force_n" not in oscillator:
            yield missing("give it, or load", FORCE)
        return
    parts = [part for part in PARTS if part in load]
    if len(parts) != 2:
        yield Mistake(("load",), f"{len(parts)} of {', '.join(PARTS)} are given; give two: force = pressure x area")
    for key in (*BY_HAND, *NOT_WITH):
        value = given(scene, key)
        if value is not None and NOT_WITH.get(key) in (None, value):
            yield not_together(key, value, "load")
    strip = scene.get("strip") or {}
    sizes = [strip.get("window_m"), strip.get("width_m"), *(load[part] for part in parts)]
    if len(parts) == 2 and None not in sizes and 0.0 not in sizes:  # a zero is refused by its range
        area, window = complete(load)["apparent_area_m2"], sizes[0] * sizes[1]
        if not (1.0 - 1e-9) * window <= area <= MOST_WINDOWS * window:  # a window of tiny sides rounds to nothing
            least, most = f"{window:.3g} (one window)", f"{MOST_WINDOWS * window:.3g} [m^2] ({MOST_WINDOWS} windows)"
            yield refused(area, f"an apparent area from {least} to {most}", f"load.{parts[-1]}", "strip.window_m")


def complete(load: Values) -> Values:
    """The load with its third part: force = pressure x area."""
    force, pressure, area = (float(load.get(part, "nan")) for part in PARTS)
    third = {"force_n": pressure * area, "nominal_pressure_pa": force / area, "apparent_area_m2": force / pressure}
    return third | load


def derived(scene: Values) -> Values:
    """The scene with what follows from its load; the penetration, None, follows when the strips are solved."""
    if scene.get("load") is None:
        return scene
    load, strip = complete(scene["load"]), scene.get("strip", {})
    oscillator = {**scene.get("oscillator", {}), "normal_force_n": load["force_n"], "penetration_percentile": None}
    if strip:
        windows = load["apparent_area_m2"] / (strip["window_m"] * strip["width_m"])
        oscillator["windows_in_parallel"] = round(windows)
        light = [percentile for percentile in LIGHT if percentile < strip["penetration_percentiles"][0]]
        scene = {**scene, "strip": {**strip, "light_percentiles": strip.get("light_percentiles") or light or None}}
    return {**scene, "load": load, "oscillator": oscillator}
