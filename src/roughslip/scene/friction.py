"""Sections `friction` and `load` of a scene: friction from solved pressures or given, and the load of the pad."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Any, Literal, get_args

from roughslip.scene.mistakes import Mistake, Rule, Values, given, missing, not_together, refused
from roughslip.scene.section import EachOnce, Line, Section, choice, many, number, part

MOST_WINDOWS = 1_000_000_000


class FrictionStatistics(Section):
    """Scatter of friction as numbers, in place of surfaces and contact; the marginal is Beta(2.1, 5) of the paper."""

    standard_deviation: float = number(
        "Standard deviation of the friction coefficient", uncertain="friction process", gt=0, le=10
    )
    correlation_length_m: float = number(
        "Length of the exponential autocorrelation along the belt", "m", uncertain="friction process", gt=0, le=1
    )


class Record(Section):
    """Friction as measured on a tribometer: mean curve and scatter are fitted to it. A path alone is its `file`."""

    file: Annotated[tuple[Line, ...], EachOnce] = many(
        "Text files that are fitted together, each with a header of `name [unit]`: time, speed, friction or force and "
        "load, perhaps position. Paths start at the folder of the scene file or of the project. A time that falls "
        "begins a new record",
        min_length=1,
        max_length=100,
        unique=True,
    )
    radius_m: float | None = number(
        "Radius of the track of a turning disc, for a speed in rpm and the period of a revolution",
        "m",
        gt=0,
        le=100,
        default=None,
    )
    rig_mass_kg: float | None = number(
        "Mass of the held specimen, with which friction in the slips of stick-slip follows from the balance of forces",
        "kg",
        gt=0,
        le=1e6,
        default=None,
    )
    rig_stiffness_n_per_m: float | None = number(
        "Stiffness of the support of the specimen", "N/m", gt=0, le=1e15, default=None
    )
    rig_damping_n_s_per_m: float | None = number(
        "Damping of the support of the specimen; 0 where not given", "N s/m", ge=0, le=1e12, default=None
    )
    time_constant_s: float | None = number(
        "Time constant of the instrument, a first-order low-pass. It is fitted where not given, and with a rig, whose "
        "balance of forces takes derivatives",
        "s",
        ge=0,
        le=100,
        default=None,
    )


Scatter = Literal["additive", "multiplicative"]
SCATTERS = get_args(Scatter)


class Friction(Section):
    """Friction as a mean with the scatter of solved contacts, or with given statistics; or as a record."""

    mean: float = number(
        "Mean friction coefficient, mu_fit of eq. (13), at median penetration or with a load as measured under it. It "
        "sets the shear strength, so the scatter of contacts changes in proportion",
        uncertain="friction curve",
        gt=0,
        le=10,
        default=None,
    )
    statistics: FrictionStatistics | None = part()
    record: Record | None = part()
    scatter: Scatter = choice(
        "How the stochastic part enters: additive, mu_D + mu_S, as in eq. (12); multiplicative, mu_D (1 + mu_S / mean) "
        "as the contact area over the force of a pad does. Not given, it is multiplicative with load",
        default="additive",
    )


class Load(Section):
    """Load of the pad. Its apparent area is the force over the nominal pressure.

    Periodic cells of the surface are solved under the nominal pressure; the number of windows follows from the area.
    """

    force_n: float = number("Normal force on the pad", "N", uncertain="normal force", gt=0, le=1e9)
    nominal_pressure_pa: float = number("Force over apparent area", "Pa", gt=0, le=1e13)
    pad_length_m: float | None = number(
        "Length of the pad along the belt; not given, the pad is a square. Friction is correlated over this length",
        "m",
        gt=0,
        le=100,
        default=None,
    )


STATISTICS, RECORD, MEAN = "friction.statistics", "friction.record", "friction.mean"
RIG = ("rig_mass_kg", "rig_stiffness_n_per_m", "rig_damping_n_s_per_m")
FORCE = "oscillator.normal_force_n"
NOT_WITH_LOAD = (FORCE, "oscillator.windows_in_parallel", STATISTICS, RECORD, "roughness.wavelengths_m")  # not periodic
RULES: tuple[Rule, ...] = ()
REPLACES: dict[str, tuple[str, ...]] = {
    "load": (FORCE, "oscillator.windows_in_parallel"),
    STATISTICS: (RECORD,),
    RECORD: (MEAN, STATISTICS),
    MEAN: (RECORD,),
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
    """Friction has a mean or is a record; a load is given, or else the force."""
    if isinstance(scene.get("friction"), dict):
        yield from _friction_mistakes(scene["friction"])
    if scene.get("load") is not None:
        yield from _load_mistakes(scene)
    elif isinstance(scene.get("oscillator"), dict) and "normal_force_n" not in scene["oscillator"]:
        yield missing("give it, or load", FORCE)


def _friction_mistakes(friction: Values) -> Iterator[Mistake]:
    if "record" in friction:
        for form in (form for form in (MEAN, STATISTICS) if form.partition(".")[2] in friction):
            yield not_together(form, friction[form.partition(".")[2]], RECORD)
    elif "mean" not in friction:
        yield missing("give it, or friction.record", MEAN)
    rig = friction["record"] if isinstance(friction.get("record"), dict) else {}
    if any(key in rig for key in RIG):
        for key in (key for key in RIG[:2] if key not in rig):
            yield missing("mass and stiffness of the rig go together", f"{RECORD}.{key}", RECORD)
        if "time_constant_s" in rig:
            yield not_together(f"{RECORD}.time_constant_s", rig["time_constant_s"], f"{RECORD}.{RIG[0]}")


def _load_mistakes(scene: Values) -> Iterator[Mistake]:
    """A load is on a pad of at least one window, and replaces what would be given by hand."""
    for key in NOT_WITH_LOAD:
        if (value := given(scene, key)) is not None:
            yield not_together(key, value, "load")
    if given(scene, "ensemble.marginal") == "empirical":
        yield not_together("ensemble.marginal", "empirical", "load")
    numbers: list[Any] = [given(scene, key) for key in ("load.force_n", "load.nominal_pressure_pa")]
    sizes: list[Any] = [given(scene, key) for key in ("strip.window_m", "strip.width_m")]
    if None in numbers or None in sizes:
        return
    area, window = numbers[0] / numbers[1], sizes[0] * sizes[1]
    if not (1.0 - 1e-9) * window <= area <= MOST_WINDOWS * window:  # a window of tiny sides rounds to nothing
        least, most = f"{window:.3g} (one window)", f"{MOST_WINDOWS * window:.3g} [m^2] ({MOST_WINDOWS} windows)"
        text = f"an apparent area of {area:.3g} [m^2] is not allowed; from {least} to {most}"
        yield Mistake(("load", "strip.window_m"), text)
    length, longest = given(scene, "load.pad_length_m"), area / sizes[1]
    if length is not None and length > longest:
        yield refused(length, f"at most {longest:.3g} [m], where the pad is one window wide", "load.pad_length_m")


def with_load(scene: Values) -> Values:
    """The scene with what follows from its load: force, windows in parallel, and scatter that multiplies."""
    if scene.get("load") is None:
        return scene
    force, pressure = (float(scene["load"][key]) for key in ("force_n", "nominal_pressure_pa"))
    oscillator, strip = {**scene.get("oscillator", {}), "normal_force_n": force}, scene.get("strip")
    if strip:
        oscillator["windows_in_parallel"] = round(force / pressure / (strip["window_m"] * strip["width_m"]))
    if isinstance(scene.get("friction"), dict):
        scene = {**scene, "friction": {"scatter": "multiplicative", **scene["friction"]}}
    return {**scene, "oscillator": oscillator}


def targets_under_load(targets: list[str]) -> list[str]:
    """Targets of a scene with a load: friction over penetration is that over loads."""
    return list(dict.fromkeys("friction_against_load" if target == "figure3" else target for target in targets))
