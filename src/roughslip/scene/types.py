"""The scene: a section for each subject, read by the stages as `job.scene`."""

from collections.abc import Iterable
from copy import deepcopy
from typing import Annotated, Any

from pydantic import Field

from roughslip.scene.contact import Expansion, Material, Numerics, Square, Strip
from roughslip.scene.friction import Friction, Load
from roughslip.scene.mistakes import Values
from roughslip.scene.oscillator import Answer, Ensemble, Oscillator, StickSlipMap
from roughslip.scene.part import part
from roughslip.scene.roughness import Roughness
from roughslip.scene.section import EachOnce, Line, Section, completed, key, kind_of, many, word
from roughslip.study.graph import targets

Target = Annotated[str, word(targets())]


class File(Section):
    """Scene of roughslip; the unit of a number ends its name."""

    description: Line = key(max_length=200)
    """Purpose of the scene in one line, for captions and the report."""
    seed: int = key(ge=0, le=4294967295)
    """Fixes every random number of the scene."""
    targets: Annotated[tuple[Target, ...], EachOnce] = many(unique=True, min_length=1)
    """The figures to make; only the stages that they need run. In figure_scan, a scan is compared with the model
    fitted to it. In figure_map, the probability of stick-slip is shown over two parameters. answer has no figure: it
    is that probability and its limits, and comes with figure5 and figure_map."""
    material: Material = key(default=None)
    roughness: Roughness = key(default=None)
    square: Square = key(default=None)
    expansion: Expansion = key(default=None)
    strip: Strip = key(default=None)
    friction: Friction = key(default=None)
    load: Load = key(default=None)
    oscillator: Oscillator = key(default=None)
    ensemble: Ensemble = key(default=None)
    map: StickSlipMap = key(default=None)
    answer: Answer = key(default=None)
    numerics: Numerics = key(default=None)
    jobs: int = key(default=2, ge=1, le=2000)
    """Jobs that share the samples of a stage, at least one for each of its designs; no result depends on it."""


class Scene(File):
    """Everything that a study may be asked to do: what a file holds, and what the loader finds in it."""

    standard_uncertainties: tuple[tuple[str, float], ...] = ()  # by dotted key, of the numbers that are given with one
    origins: dict[str, str] = Field({})  # by dotted key, the scene that gives the value: itself or one that it extends


def part_of(scene: Values, names: Iterable[str]) -> Values:
    """The part of a scene under some dotted keys, nested as in the scene; absent optional keys have their defaults."""
    whole: Values = {}
    for name in names:
        *sections, last = name.split(".")
        inner = whole
        for place in sections:
            inner = inner.setdefault(place, {})
        inner[last] = deepcopy(get(scene, name))
    return whole


def scene_of(values: Values, reads: Iterable[str] | None = None) -> Scene:
    """The scene as an object, from nested dicts; absent optional keys and sections get their defaults.

    reads : dotted keys that a stage declares; the object then holds these alone
    """
    if reads is not None:
        return part(part_of(values, reads))
    sections: Values = {name: {} for name, field in Scene.model_fields.items() if kind_of(field) is not None}
    del sections["load"]  # without numbers there is none
    return part(completed(Scene, sections | values))


def get(scene: Values, path: str) -> Any:
    """The value of a scene under a dotted key: as given, else its default, None where it has none.

    A section is returned with the defaults of its absent keys. Raises KeyError for a key that no scene has.
    """
    value: Any = scene
    kind: type[Section] | None = Scene
    for depth, name in enumerate(path.split(".")):
        field = None if kind is None else kind.model_fields.get(name)
        if field is None:
            raise KeyError(f"{path} is no key of a scene")
        within = isinstance(value, dict) or depth <= 1  # an absent section of the scene has defaults, no deeper one
        default = field.get_default() if within and not field.is_required() else None
        value = value.get(name, default) if isinstance(value, dict) else default
        kind = kind_of(field)
    return completed(kind, value) if kind is not None and isinstance(value, dict) else value
