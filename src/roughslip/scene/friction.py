"""Sections `friction` and `load` of a scene: friction from solved pressures or given, and the load of the pad."""

from __future__ import annotations

from collections.abc import Iterator

from roughslip.scene.fields import Section, choice, group, many, number, section, text
from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused

SCATTERS = ("additive", "multiplicative")
MOST_WINDOWS = 1_000_000_000


@section
class FrictionStatistics(Section):
    """Friction process as numbers, in place of surfaces and contact."""

    mean: float = number("Mean friction coefficient, mu_fit of eq. (13)", measured=True, above=0, maximum=10)
    standard_deviation: float = number(
        "Standard deviation of the friction coefficient", measured=True, above=0, maximum=10
    )
    correlation_length_m: float = number(
        "Length of the exponential autocorrelation along the belt", "m", measured=True, above=0, maximum=1
    )
    beta_shapes: tuple[float, float] = many(
        "Shapes of the Beta marginal", number("A shape", above=0, maximum=1000), minimum=2, maximum=2
    )


@section
class Record(Section):
    """Friction as measured on a tribometer: mean curve and scatter are fitted to it. A path alone is its `file`."""

    file: tuple[str, ...] = many(
        "Text files that are fitted together, each with a header of `name [unit]`: time, speed, friction or force and "
        "load, perhaps position. Paths start at the folder of the scene file or of the project. A time that falls "
        "begins a new record",
        text("A path", longest=500),
        maximum=100,
        unique=True,
    )
    radius_m: float | None = number(
        "Radius of the track of a turning disc, for a speed in rpm and the period of a revolution",
        "m",
        above=0,
        maximum=100,
        default=None,
    )
    rig_mass_kg: float | None = number(
        "Mass of the held specimen, with which friction in the slips of stick-slip follows from the balance of forces",
        "kg",
        above=0,
        maximum=1e6,
        default=None,
    )
    rig_stiffness_n_per_m: float | None = number(
        "Stiffness of the support of the specimen", "N/m", above=0, maximum=1e15, default=None
    )
    rig_damping_n_s_per_m: float | None = number(
        "Damping of the support of the specimen; 0 where not given", "N s/m", minimum=0, maximum=1e12, default=None
    )
    time_constant_s: float | None = number(
        "Time constant of the instrument, a first-order low-pass. It is fitted where not given, and with a rig, whose "
        "balance of forces takes derivatives",
        "s",
        minimum=0,
        maximum=100,
        default=None,
    )


@section
class Friction(Section):
    """Friction from solved pressures (mean_at_median, least_contact_fraction), or given: statistics, or a record."""

    mean_at_median: float = number(
        "Mean friction coefficient at median penetration, or of the pad with a load without load.mean_friction; sets "
        "the shear strength",
        measured=True,
        above=0,
        maximum=10,
        default=None,
    )
    least_contact_fraction: float = number(
        "A window with a smaller fraction of its area in contact has no friction coefficient",
        above=0,
        maximum=0.1,
        default=None,
    )
    statistics: FrictionStatistics | None = group(FrictionStatistics)
    record: Record | None = group(Record)
    scatter: str = choice(
        "How the stochastic part enters: additive, mu_D + mu_S, as in eq. (12); multiplicative, mu_D (1 + mu_S / mean) "
        "as the contact area over the force of a pad does. Not given, it is multiplicative with load",
        SCATTERS,
        default="additive",
    )


@section
class Load(Section):
    """Load of the pad: two of force, nominal pressure and apparent area.

    Periodic cells of the surface are solved under the nominal pressure; the number of windows follows from the area.
    """

    force_n: float = number("Normal force on the pad", "N", measured=True, above=0, maximum=1e9, default=None)
    nominal_pressure_pa: float = number("Force over apparent area", "Pa", above=0, maximum=1e13, default=None)
    apparent_area_m2: float = number("Apparent area of the pad", "m^2", above=0, maximum=1e4, default=None)
    mean_friction: float | None = number(
        "Mean friction coefficient of the pad as measured under this load, in place of friction.mean_at_median; sets "
        "the shear strength, so the scatter changes in proportion",
        measured=True,
        above=0,
        maximum=10,
        default=None,
    )
    pad_length_m: float | None = number(
        "Length of the pad along the belt; not given, the pad is a square. Friction is correlated over this length",
        "m",
        above=0,
        maximum=100,
        default=None,
    )


SOLVED = ("mean_at_median", "least_contact_fraction")
STATISTICS, RECORD = "friction.statistics", "friction.record"
RIG = ("rig_mass_kg", "rig_stiffness_n_per_m", "rig_damping_n_s_per_m")
PARTS = ("force_n", "nominal_pressure_pa", "apparent_area_m2")
FORCE = "oscillator.normal_force_n"
BY_HAND = (FORCE, "oscillator.penetration_percentile", "oscillator.windows_in_parallel")
NOT_WITH = {STATISTICS: None, RECORD: None, "ensemble.marginal": "empirical", "roughness.fractal": None}  # not periodic

REPLACES: dict[str, tuple[str, ...]] = {
    "load": BY_HAND,
    STATISTICS: (*(f"friction.{key}" for key in SOLVED), RECORD),
    RECORD: (*(f"friction.{key}" for key in SOLVED), STATISTICS),
    **{f"friction.{key}": (STATISTICS, RECORD) for key in SOLVED},
}


def with_listed_records(values: Values) -> Values:
    """What changes in the values of a scene file where a record is a path alone, or one path: a list of paths."""
    section = values.get("friction")
    if not isinstance(section, dict) or "record" not in section:
        return {}
    record = section["record"]
    if isinstance(record, str | list):
        record = {"file": record}
    if isinstance(record, dict) and isinstance(record.get("file"), str):
        record = {**record, "file": [record["file"]]}
    return {"friction": {**section, "record": record}}


def mistakes(scene: Values) -> Iterator[Mistake]:
    """Friction has exactly one of its three forms; a load is given, or else the force."""
    if isinstance(scene.get("friction"), dict):
        yield from _friction_mistakes(scene["friction"])
    if scene.get("load") is not None:
        yield from _load_mistakes(scene)
    elif isinstance(scene.get("oscillator"), dict) and "normal_force_n" not in scene["oscillator"]:
        yield missing("give it, or load", FORCE)


def _friction_mistakes(friction: Values) -> Iterator[Mistake]:
    solved = [key for key in SOLVED if key in friction]
    forms = [form for form in (STATISTICS, RECORD) if form.partition(".")[2] in friction]
    if forms:
        for key in (*solved, *(form.partition(".")[2] for form in forms[1:])):
            yield not_together(f"friction.{key}", friction[key], forms[0])
    elif not solved:
        yield Mistake(("friction",), f"empty; give statistics, record, or {' with '.join(SOLVED)}")
    elif len(solved) < len(SOLVED):
        (absent,) = set(SOLVED).difference(solved)
        yield missing(f"goes with friction.{solved[0]}", f"friction.{absent}", f"friction.{solved[0]}")
    rig = friction["record"] if isinstance(friction.get("record"), dict) else {}
    if any(key in rig for key in RIG):
        for key in (key for key in RIG[:2] if key not in rig):
            yield missing("mass and stiffness of the rig go together", f"{RECORD}.{key}", RECORD)
        if "time_constant_s" in rig:
            yield not_together(f"{RECORD}.time_constant_s", rig["time_constant_s"], f"{RECORD}.{RIG[0]}")


def _load_mistakes(scene: Values) -> Iterator[Mistake]:
    """A load has two of its three parts, on a pad of at least one window, and replaces what would be given by hand."""
    load = scene["load"]
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
            minimum, maximum = (
                f"{window:.3g} (one window)",
                f"{MOST_WINDOWS * window:.3g} [m^2] ({MOST_WINDOWS} windows)",
            )
            yield refused(area, f"an apparent area from {minimum} to {maximum}", f"load.{parts[-1]}", "strip.window_m")
        length, longest = load.get("pad_length_m"), area / sizes[1]
        if length is not None and length > longest:
            yield refused(length, f"at most {longest:.3g} [m], where the pad is one window wide", "load.pad_length_m")


def complete(load: Values) -> Values:
    """The load with its third part: force = pressure x area."""
    force, pressure, area = (float(load.get(part, "nan")) for part in PARTS)
    third = {"force_n": pressure * area, "nominal_pressure_pa": force / area, "apparent_area_m2": force / pressure}
    return third | load


def targets_under_load(targets: list[str]) -> list[str]:
    """Targets of a scene with a load: friction over penetration is that over loads."""
    return list(dict.fromkeys("friction_against_load" if target == "figure3" else target for target in targets))


def with_load(scene: Values) -> Values:
    """The scene with what follows from its load, which needs no penetration: None."""
    if scene.get("load") is None:
        return scene
    load, strip = complete(scene["load"]), scene.get("strip", {})
    oscillator = {**scene.get("oscillator", {}), "normal_force_n": load["force_n"], "penetration_percentile": None}
    if strip:
        windows = load["apparent_area_m2"] / (strip["window_m"] * strip["width_m"])
        oscillator["windows_in_parallel"] = round(windows)
    if isinstance(scene.get("friction"), dict):
        scene = {**scene, "friction": {"scatter": "multiplicative", **scene["friction"]}}
    return {**scene, "load": load, "oscillator": oscillator}
