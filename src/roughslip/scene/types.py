"""The scene: a section for each subject, read by the stages as `job.scene`.

A new section is a dataclass in a module of its subject, and a field of `Scene`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from typing import Any, Literal

from roughslip.scene.contact import Material, Square, Strip
from roughslip.scene.declarations import declarations
from roughslip.scene.ensemble import Answer, Ensemble, StickSlipMap
from roughslip.scene.expansion import Expansion
from roughslip.scene.fields import (
    Section,
    build,
    choice,
    completed,
    default_of,
    fields_of,
    flag,
    group,
    integer,
    many,
    number,
    section,
    text,
)
from roughslip.scene.friction import Friction, Load
from roughslip.scene.mistakes import Values
from roughslip.scene.oscillator import Oscillator
from roughslip.scene.roughness import Roughness

ContactArea = Literal["corrected", "nodes"]


@section
class Numerics(Section):
    """Tolerances of the solvers, and what counts as contact."""

    contact_tolerance: float = number(
        "Relative residual to which a contact problem is solved",
        minimum=1e-14,
        maximum=0.001,
        default=None,
    )
    contact_area: ContactArea = choice(
        "corrected: a cell at the edge of a contact counts by its covered share, and the pressure at the centre of the "
        "square by its distance from the edge. With nodes, each node in contact counts as a whole cell, too much by a "
        "share of the perimeter",
        ContactArea,
        default="corrected",
    )
    extrapolate_mesh: bool = flag(
        "Whether strips are also solved on cells of twice the edge, from which friction is extrapolated to cells of no "
        "size. It takes a quarter more time; the heights must be smooth over four cells",
        default=False,
    )


@section
class Scene(Section):
    """Everything that a study may be asked to do."""

    description: str = text("Purpose of the scene in one line, for captions and the report", longest=200)
    seed: int = integer("Fixes every random number of the scene", minimum=0, maximum=4294967295)
    targets: tuple[str, ...] = many(
        "The figures to make; only the stages that they need run",
        text(
            "A figure of the paper, or one of two others. In figure_scan, a scan is compared with surfaces sampled "
            "from its models. In figure_map, the probability of stick-slip is shown over two parameters. "
            "answer has no figure: it is that probability and its limits, and comes with figure5 and figure_map",
            longest=40,
        ),
        unique=True,
    )
    material: Material = group(Material)
    roughness: Roughness = group(Roughness)
    square: Square = group(Square)
    expansion: Expansion = group(Expansion)
    strip: Strip = group(Strip)
    friction: Friction = group(Friction)
    load: Load = group(Load)
    oscillator: Oscillator = group(Oscillator)
    ensemble: Ensemble = group(Ensemble)
    map: StickSlipMap = group(StickSlipMap)
    answer: Answer = group(Answer)
    numerics: Numerics = group(Numerics)
    standard_uncertainties: tuple[tuple[str, float], ...] = many(
        "Of the numbers that are given with one, by dotted key: the loader finds them, no scene file holds this",
        many("Key and standard uncertainty", text("A key", longest=80)),
        default=(),
    )
    jobs: int = integer(
        "Jobs that take equal parts of the samples of a stage, or of one of its designs; no result depends on it",
        minimum=1,
        maximum=2000,
        default=2,
    )


def slice_for(scene: Values, stage: str) -> Values:
    """The part of the scene that a stage reads: every key that it declares, with the default of a key not given."""
    return part_of(scene, declarations()[stage].keys)


def part_of(scene: Values, keys: Iterable[str]) -> Values:
    """The part of a scene under some dotted keys, nested as in the scene; absent optional keys have their defaults."""
    return nested({key: deepcopy(get(scene, key)) for key in keys})


def nested(values: Values) -> Values:
    """Values by dotted key as the sections of a scene."""
    whole: Values = {}
    for key, value in values.items():
        *sections, last = key.split(".")
        inner = whole
        for place in sections:
            inner = inner.setdefault(place, {})
        inner[last] = value
    return whole


def without_nulls(values: Any) -> Any:
    """Nested dicts without the keys that have no value."""
    if not isinstance(values, dict):
        return values
    return {key: without_nulls(value) for key, value in values.items() if value is not None}


def scene_of(values: Values, reads: Iterable[str] | None = None) -> Scene:
    """The scene as an object, from nested dicts; absent optional keys get their defaults.

    reads : dotted keys that a stage declares; the object then holds these alone
    """
    if reads is None:
        return build(Scene, values)
    return build(Scene, part_of(values, reads), defaults=False)


def get(scene: Values, key: str) -> Any:
    """The value of a scene under a dotted key: as given, else its default, None where it has none.

    A section is returned with the defaults of its absent keys. Raises KeyError for a key that no scene has.
    """
    value: Any = scene
    kind: type[Section] | None = Scene
    for depth, part in enumerate(key.split(".")):
        if kind is None or (field := fields_of(kind).get(part)) is None:
            raise KeyError(f"{key} is no key of a scene")
        within = isinstance(value, Mapping) or depth <= 1  # an absent section of the scene has defaults, no deeper one
        given = isinstance(value, Mapping) and part in value
        value = value[part] if given else default_of(field) if within else None
        kind = field.metadata["kind"]
    return completed(kind, value) if kind is not None and isinstance(value, Mapping) else value
