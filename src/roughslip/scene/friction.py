"""Sections `friction` and `load` of a scene: friction from solved pressures or given, and the load of the pad."""

from collections.abc import Iterator
from typing import Annotated, Literal

from roughslip.scene.mistakes import Mistake, Values, given, missing, not_together, refused
from roughslip.scene.section import EachOnce, Line, Section, key, many

MOST_WINDOWS = 1_000_000_000


class FrictionStatistics(Section):
    """Scatter of friction as numbers, in place of surfaces and contact; the marginal is Beta(2.1, 5) of the paper."""

    standard_deviation: float = key(uncertain="friction process", gt=0, le=10)
    """Standard deviation of the friction coefficient."""
    correlation_length_m: float = key("m", uncertain="friction process", gt=0, le=1)
    """Length of the exponential autocorrelation along the belt."""


class Record(Section):
    """Friction as measured on a tribometer: mean curve and scatter are fitted to it. A path alone is its `file`."""

    file: Annotated[tuple[Line, ...], EachOnce] = many(min_length=1, max_length=100, unique=True)
    """Text files that are fitted together, each with a header of `name [unit]`: time, speed, friction or force and
    load, perhaps displacement. Paths start at the folder of the scene file or of the project. A time that falls begins
    a new record."""
    radius_m: float | None = key("m", gt=0, le=100, default=None)
    """Radius of the track of a turning disc, for a speed in rpm and the period of a revolution."""
    rig_mass_kg: float | None = key("kg", gt=0, le=1e6, default=None)
    """Mass of the held specimen, with which friction in the slips of stick-slip follows from the balance of forces."""
    rig_stiffness_n_per_m: float | None = key("N/m", gt=0, le=1e15, default=None)
    """Stiffness of the support of the specimen."""
    rig_damping_n_s_per_m: float | None = key("N s/m", ge=0, le=1e12, default=None)
    """Damping of the support of the specimen; 0 where not given."""
    time_constant_s: float | None = key("s", ge=0, le=100, default=None)
    """Time constant of the instrument, a first-order low-pass. It is fitted where not given, and with a rig, whose
    balance of forces takes derivatives."""


Scatter = Literal["additive", "multiplicative"]


class Friction(Section):
    """Friction as a mean with the scatter of solved contacts, or with given statistics; or as a record."""

    mean: float = key(uncertain="friction curve", gt=0, le=10, default=None)
    """Mean friction coefficient, mu_fit of eq. (13), at median penetration or with a load as measured under it. It sets
    the shear strength, so the scatter of contacts changes in proportion."""
    statistics: FrictionStatistics | None = None
    record: Record | None = None
    scatter: Scatter = key(default="additive")
    """How the stochastic part enters: additive, mu_D + mu_S, as in eq. (12); multiplicative, mu_D (1 + mu_S / mean) as
    the contact area over the force of a pad does. Not given, it is multiplicative with load."""


class Load(Section):
    """Load of the pad. Its apparent area is the force over the nominal pressure.

    Periodic cells of the surface are solved under the nominal pressure; the number of windows follows from the area.
    """

    force_n: float = key("N", uncertain="normal force", gt=0, le=1e9)
    """Normal force on the pad."""
    nominal_pressure_pa: float = key("Pa", gt=0, le=1e13)
    """Force over apparent area."""
    pad_length_m: float | None = key("m", gt=0, le=100, default=None)
    """Length of the pad along the belt; not given, the pad is a square. Friction is correlated over this length."""


STATISTICS, RECORD, MEAN = "friction.statistics", "friction.record", "friction.mean"
RIG = ("rig_mass_kg", "rig_stiffness_n_per_m", "rig_damping_n_s_per_m")
FORCE = "oscillator.normal_force_n"
NOT_WITH_LOAD = (FORCE, "oscillator.windows_in_parallel", STATISTICS, RECORD, "roughness.wavelengths_m")  # not periodic
# What a record says of the mean friction curve.
OF_CURVE = ("law", "friction_table", "static_friction", "stribeck_decay_s_per_m", "stribeck_quadratic_s2_per_m2")
REPLACES: dict[str, tuple[str, ...]] = {
    "load": (FORCE, "oscillator.windows_in_parallel", STATISTICS, RECORD),
    STATISTICS: (RECORD,),
    RECORD: (MEAN, STATISTICS, *(f"oscillator.{name}" for name in OF_CURVE)),
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
    friction = scene.get("friction")
    if isinstance(friction, dict) and "record" in friction:
        yield from _record_mistakes(scene, friction)
    elif isinstance(friction, dict) and "mean" not in friction:
        yield missing("give it, or friction.record", MEAN)
    if scene.get("load") is not None:
        yield from _load_mistakes(scene)
    elif isinstance(scene.get("oscillator"), dict) and "normal_force_n" not in scene["oscillator"]:
        yield missing("give it, or load", FORCE)


def _record_mistakes(scene: Values, friction: Values) -> Iterator[Mistake]:
    curve = (f"oscillator.{name}" for name in OF_CURVE if name != "static_friction")
    for form in (MEAN, STATISTICS, *curve):
        if given(scene, form) is not None:
            yield not_together(scene, form, RECORD)
    record = friction["record"] if isinstance(friction["record"], dict) else {}
    if any(key in record for key in RIG):
        for key in (key for key in RIG[:2] if key not in record):
            yield missing("mass and stiffness of the rig go together", f"{RECORD}.{key}", RECORD)
        if "time_constant_s" in record:
            yield not_together(scene, f"{RECORD}.time_constant_s", f"{RECORD}.{RIG[0]}")


def _load_mistakes(scene: Values) -> Iterator[Mistake]:
    """A load is on a pad of at least one window, and replaces what would be given by hand."""
    for other in NOT_WITH_LOAD:
        if given(scene, other) is not None:
            yield not_together(scene, other, "load")
    force, pressure, length, width = (
        given(scene, key) for key in ("load.force_n", "load.nominal_pressure_pa", "strip.window_m", "strip.width_m")
    )
    if None in (force, pressure, length, width):
        return
    area, window = force / pressure, length * width
    if not (1.0 - 1e-9) * window <= area <= MOST_WINDOWS * window:  # a window of tiny sides rounds to nothing
        least, most = f"{window:.3g} (one window)", f"{MOST_WINDOWS * window:.3g} [m^2] ({MOST_WINDOWS} windows)"
        text = f"an apparent area of {area:.3g} [m^2] is not allowed; from {least} to {most}"
        yield Mistake(("load", "strip.window_m"), text)
    pad = given(scene, "load.pad_length_m")
    if pad is not None and pad > area / width:
        yield refused(pad, f"at most {area / width:.3g} [m], where the pad is one window wide", "load.pad_length_m")


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
