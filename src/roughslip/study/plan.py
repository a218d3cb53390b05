"""Which stages a scene needs, and what these lack: all from the rows of the graph."""

from functools import cache

from roughslip.scene.files import SHIPPED, scene_names
from roughslip.scene.mistakes import Values
from roughslip.scene.types import get, part_of
from roughslip.study.graph import EVERY_SCENE, STAGES, Stage

# The scenes that come with the project. What they give to a scene of a user is an assumption.
SHIPPED_SCENES = frozenset(scene_names(SHIPPED))

# Sections in which no key is required by itself: a stage that reads one of their keys needs this key.
_KEY_BY_KEY = ("roughness", "strip", "friction", "numerics")
CONDITIONS = {key for stage in STAGES.values() for key in stage.runs_if.split()} - {"not", "and"}
_ALWAYS_GIVEN = ("seed", "description", "targets")


def default_targets(scene: Values, is_uncertain: bool = False) -> list[str]:
    """Of a scene that names none itself: those it inherits, and with figure5 its map, and its budget if is_uncertain.

    Limits are those of the oscillator without excitation.
    """
    inherited, oscillator = list(scene["targets"]), scene.get("oscillator")
    if "figure5" not in inherited or not isinstance(oscillator, dict) or oscillator.get("excitation_force_n", 0) != 0:
        return inherited
    more = [*(["figure_map"] if "map" in scene else []), *(["figure_budget"] if is_uncertain else [])]
    return list(dict.fromkeys([*inherited, *more]))


def stages_needed(scene: Values) -> set[str]:
    """Names of the stages that the targets of the scene need. One of them, `figures`, draws all figures."""
    needed = _needed(scene, (EVERY_SCENE, *scene["targets"]))
    drawn = {name for name in needed if STAGES[name].caption}
    return needed - drawn | ({"figures"} if drawn else set())


def figures(scene: Values) -> list[str]:
    """The figures that the scene makes, in the order of the graph."""
    needed = _needed(scene, (EVERY_SCENE, *scene["targets"]))
    return [stage.name for stage in STAGES.values() if stage.caption and stage.name in needed]


def captions() -> dict[str, str]:
    """Captions of the figures that a scene can have."""
    return {stage.name: stage.caption for stage in STAGES.values() if stage.target and stage.caption}


def lacking(scene: Values) -> dict[str, list[str]]:
    """Sections, and keys of given sections, without which stages of targets cannot run, each with these targets."""
    absent: dict[str, list[str]] = {}
    for target in scene.get("targets", []):
        for key in dict.fromkeys(key for name in sorted(_needed(scene, (target,))) for key in _needs(STAGES[name])):
            name = key if (section := key.partition(".")[0]) in scene else section
            if get(scene, key) is None and target not in absent.setdefault(name, []):
                absent[name].append(target)
    return absent


def _needs(stage: Stage) -> list[str]:
    """Sections and keys without which a stage cannot run."""
    keys = [key for key in stage.reads.split() if key not in _ALWAYS_GIVEN and not key.endswith("?")]
    return [key if (section := key.partition(".")[0]) in _KEY_BY_KEY else section for key in keys]


def sections_not_read(scene: Values) -> set[str]:
    """Sections that no target reads; what an overlay inherits in them may break the rules without effect."""
    stages = stages_needed(scene)
    unread = set() if "friction" in stages else {"strip"}
    return unread if "chaos_square" in stages else unread | {"square"}


def slice_of(scene: Values, stage: Stage, name: str) -> Values:
    """The part of a scene that a stage reads. name : of the scene

    What a stage reads as the scene's own is absent where a shipped scene gives it, or a part of it, to one of a user.
    """
    part, origins = part_of(scene, stage.keys), scene.get("origins", {}) if name not in SHIPPED_SCENES else {}
    given = [key for key, origin in origins.items() if origin in SHIPPED_SCENES]
    for key in (key for key in stage.own.split() if any(f"{one}.".startswith(f"{key}.") for one in given)):
        section, _, last = key.rpartition(".")
        (part[section] if section else part)[last] = None
    return part


def makers(stage: Stage, stages: frozenset[str]) -> list[str]:
    """Those of the stages of a scene that make inputs of one of them."""
    return sorted({*stage.makers, *stage.collects.values()} & stages)


@cache
def stages_after(name: str, stages: frozenset[str]) -> int:
    """Of these stages those in the longest chain after one: the first of the longest chain start first."""
    takers = {"figures" if row.caption else row.name for row in STAGES.values() if name in row.makers} & stages
    return max((1 + stages_after(taker, stages) for taker in takers), default=0)


def _runs(scene: Values, stage: Stage) -> bool:
    """Whether all conditions of a stage hold in the scene."""
    conditions = filter(None, stage.runs_if.split(" and "))
    return all((get(scene, key.removeprefix("not ")) is None) == key.startswith("not ") for key in conditions)


def _needed(scene: Values, wanted: tuple[str, ...]) -> set[str]:
    """Stages that these targets need: their own, those that make the inputs of one, and companions.

    An input that nothing can replace is needed even if the condition of the stage that makes it does not hold.
    """
    needed: set[str] = set()
    pending = [stage.name for target in wanted for stage in STAGES.values() if stage.target == target]
    while pending:
        name = pending.pop()
        if name in needed:
            continue
        needed.add(name)
        others = STAGES[name].makers | {
            stage.name: False for stage in STAGES.values() if name in stage.comes_with.split()
        }
        pending += [other for other, is_always in others.items() if is_always or _runs(scene, STAGES[other])]
    return needed
