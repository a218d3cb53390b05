"""Which stages a scene needs, why others are skipped, and what these lack: all from the declarations of the stages."""

from __future__ import annotations

from collections.abc import Set
from functools import cache

from roughslip.scene.declarations import EVERY_SCENE, Stage, declarations, targets
from roughslip.scene.mistakes import Values
from roughslip.scene.types import get

# Sections in which no key is required by itself: a stage that reads one of their keys needs this key.
_KEY_BY_KEY = ("roughness", "friction", "numerics")
_ALWAYS_GIVEN = ("seed", "description", "targets")
AFTER_COSTS = ("costs", "report")  # which the sum of costs of a scene cannot hold


def default_targets(scene: Values, is_uncertain: bool = False) -> list[str]:
    """Of a scene that names none itself: those it inherits, and with figure5 its map, and its budget if is_uncertain.

    Limits are those of the oscillator without excitation.
    """
    inherited, oscillator = list(scene["targets"]), scene.get("oscillator")
    if "figure5" not in inherited or not isinstance(oscillator, dict) or oscillator.get("excitation_force_n") != 0:
        return inherited
    more = [*(["figure_map"] if "map" in scene else []), *(["figure_budget"] if is_uncertain else [])]
    return list(dict.fromkeys([*inherited, *more]))


def stages_needed(scene: Values) -> set[str]:
    """Names of the stages that the targets of the scene need."""
    return _needed(scene, (EVERY_SCENE, *scene["targets"]))


def figures(scene: Values) -> list[str]:
    """The figures that the scene makes: those that accompany a stage that it needs, then those of its targets."""
    needed = stages_needed(scene)
    drawn = [stage for stage in declarations().values() if stage.caption and stage.name in needed]
    asked = [stage for target in scene["targets"] for stage in drawn if stage.target == target and not stage.comes_with]
    return [stage.name for stage in (*(stage for stage in drawn if stage.comes_with), *asked)]


def captions() -> dict[str, str]:
    """Captions of the figures that a scene can have."""
    return {stage.name: stage.caption for stage in declarations().values() if stage.target and stage.caption}


def lacking(scene: Values) -> dict[str, list[str]]:
    """Sections, and keys of given sections, without which stages of targets cannot run, each with these targets."""
    absent: dict[str, list[str]] = {}
    for target in scene.get("targets", []):
        for key in dict.fromkeys(key for name in sorted(_needed(scene, (target,))) for key in _needs(name)):
            name = key if (section := key.partition(".")[0]) in scene else section
            if get(scene, key) is None and target not in absent.setdefault(name, []):
                absent[name].append(target)
    return absent


def _needs(stage: str) -> list[str]:
    """Sections and keys without which a stage cannot run."""
    keys = [key for key in declarations()[stage].reads.split() if key not in _ALWAYS_GIVEN]
    return [key if (section := key.partition(".")[0]) in _KEY_BY_KEY else section for key in keys]


def sections_not_read(scene: Values) -> set[str]:
    """Sections that no target reads; what an overlay inherits in them may break the rules without effect."""
    stages = stages_needed(scene)
    unread = set() if stages & {"friction"} else {"strip"}
    return unread if "chaos_square" in stages else unread | {"square"}


def skip_reasons(scene: Values) -> dict[str, str]:
    """The stages of any target that do not run for those of the scene, each with the reason."""
    reached = _reached(scene, tuple(scene["targets"]))
    asking = {name: ", ".join(target for target in targets() if name in _all_of(target)) for name in _of_any_target()}
    return {
        name: reached.get(name) or f"not asked for: {asking[name]}"
        for name in sorted(_of_any_target() - stages_needed(scene))
    }


@cache
def stages_of_several_scenes() -> tuple[str, ...]:
    """Stages that no target needs: they are asked for by name and take the results of several scenes."""
    return tuple(sorted(declarations().keys() - _of_any_target() - {*_starts(EVERY_SCENE)}))


def runs(scene: Values, stage: Stage) -> bool:
    """Whether the conditions of a stage hold in the scene."""
    return not _failing(scene, stage)


def _failing(scene: Values, stage: Stage) -> str:
    """The first condition of a stage that does not hold in the scene; "" where all do."""
    for condition in filter(None, stage.runs_if.split(" and ")):
        key, _, value = condition.removeprefix("not ").partition(" = ")
        actual = get(scene, key)
        if not (actual == value if value else (actual is not None) != condition.startswith("not ")):
            return condition
    return ""


def _needed(scene: Values, wanted: tuple[str, ...]) -> set[str]:
    return {name for name, reason in _reached(scene, wanted).items() if not reason}


def _reached(scene: Values | None, wanted: tuple[str, ...]) -> dict[str, str]:
    """Stages that these targets may need: their own, those that make the inputs of one, and companions.

    Each has the first condition that fails on every way to it, as the reason why it does not run; "" where it is
    needed. An input that nothing can replace is needed even if the condition of the stage that makes it does not hold.
    Without a scene all conditions hold.
    """
    reached: dict[str, str] = {}
    pending = [(name, "") for target in wanted for name in _starts(target)]
    while pending:
        name, reason = pending.pop(0)
        if name in reached and (reason or not reached[name]):
            continue
        reached[name] = reason
        for other, is_always in (*_edges(name), *((companion, False) for companion in _companions(name))):
            stage = declarations()[other]
            failing = "" if is_always or scene is None else _failing(scene, stage)
            pending.append((other, reason or (_reason(failing) if failing else "")))
    return reached


def _reason(condition: str) -> str:
    """Why a stage does not run whose condition this is."""
    key, _, value = condition.removeprefix("not ").partition(" = ")
    return f"{key} is {'given' if value or condition.startswith('not ') else 'not given'}"


def makers(stage: str, stages: Set[str]) -> list[str]:
    """Those of the stages of a scene that make inputs of one of them."""
    collected = [name for names in declarations()[stage].collects.values() for name in names.split()]
    return sorted({*(name for name, _ in _edges(stage)), *collected} & stages)


@cache
def _edges(name: str) -> tuple[tuple[str, bool], ...]:
    """Stages that make the inputs of a stage, and whether nothing else can."""
    stage = declarations()[name]
    made_by = (
        (option, names.split()) for part in (stage.inputs, stage.optional, stage.many) for option, names in part.items()
    )
    return tuple(
        (maker, option not in stage.optional and len(names) == 1)
        for option, names in made_by
        for maker in names
        if maker in declarations()
    )


@cache
def _starts(target: str) -> tuple[str, ...]:
    return tuple(stage.name for stage in declarations().values() if stage.target == target)


@cache
def _companions(name: str) -> tuple[str, ...]:
    return tuple(stage.name for stage in declarations().values() if name in stage.comes_with.split())


@cache
def _all_of(target: str) -> frozenset[str]:
    """Every stage that a target may need, in any scene."""
    return frozenset(_reached(None, (target,)))


@cache
def _of_any_target() -> frozenset[str]:
    return frozenset().union(*(_all_of(target) for target in targets()))
