"""Scene files: overlays, a check of each section and rules across keys; all mistakes come at once, a line each.

A line reads `file: key: what was given and what is allowed`. No stage imports this module.
"""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from roughslip.errors import InputError
from roughslip.scene import contact, friction, oscillator, roughness
from roughslip.scene.files import locate, read_chain
from roughslip.scene.mistakes import (
    Exclusion,
    KeyPath,
    Mistake,
    Values,
    dotted,
    given,
    is_increasing,
    line,
    missing,
    refused,
    shown,
)
from roughslip.scene.schema import Refusal, inner, refusals, scene_schema
from roughslip.scene.types import File, get
from roughslip.study import plan

_RULES = (*contact.RULES, *roughness.RULES, *oscillator.RULES)
Check = Callable[[Values, Callable[[str], bool]], Iterator[Mistake]]
_ORDERED = (oscillator.TABLE, contact.LEVELS, oscillator.RATIOS)
VALUE, UNCERTAINTY = "value", "standard_uncertainty"


def load(name: str, scenes_folder: Path, more: Check | None = None) -> Values:
    """The scene of a name, with its overlays merged and every rule checked.

    scenes_folder : folder of the names; a name after `extends` may also be that of a shipped scene
    more : further mistakes, as of files. It takes the merged scene, with None for every refused value, and a function
        that says whether a key, with all in it, has no mistake so far

    Returns the scene as nested dicts, without `extends`, with what follows from its load and where each value comes
    from; a key that takes a real number holds a float. `types.scene_of` makes an object of it. Raises InputError with
    a line per mistake.
    """
    chain, merged = read_chain(locate(name, scenes_folder), scenes_folder)
    values, uncertainties, wrong = _taken_apart(merged.values, scene_schema(), ())
    if merged.file_of(("targets",)) != chain[0] and isinstance(values.get("targets"), list):
        values["targets"] = plan.default_targets(values, bool(uncertainties))
    if values.get("load") is not None and isinstance(values.get("targets"), list):
        renamed = ("friction_against_load" if target == "figure3" else target for target in values["targets"])
        values["targets"] = list(dict.fromkeys(renamed))
    in_yaml = {dotted(path) for _, path, _ in merged.wrong if path}
    found = [*(Refusal(path, text) for path, text in wrong), *_refusals(values)]
    faulty = {one.key for one in found if one.key} | in_yaml
    found = [one for one in found if not (dotted(one.path) in in_yaml and given(values, dotted(one.path)) is None)]
    is_open = faulty if not merged.unread else {dotted(one.path) for one in found}
    found = [one for one in found if not (one.is_missing and dotted(one.path) in is_open)]
    if merged.unread or any(f"{one}.".startswith(f"{key}.") for one in plan.CONDITIONS for key in faulty):
        faulty.add("targets")  # which stages they need is not known
    lines = [*merged.unread, *(line(*one) for one in merged.wrong)]
    lines += [line(merged.file_of(one.path), one.path, one.text) for one in found]
    sound_values, broken = _without(faulty, values), faulty | {dotted(one.path) for one in found}

    def mistakes() -> Iterator[Mistake]:
        yield from _mistakes(sound_values, values, faulty, {key for key, _ in uncertainties})
        yield from more(sound_values, lambda key: _is_sound(key, broken)) if more else ()

    for keys, text in mistakes():
        if merged.unread and any(given(values, key) is None for key in keys):
            continue  # the base may give it
        broken.add(keys[0])
        paths: list[KeyPath] = [tuple(key.split(".")) for key in keys]
        topmost, own = min(map(merged.file_of, paths), key=chain.index), merged.file_of(paths[0])
        if topmost != own:  # the file that the user most likely edits does not give the value
            text = text.replace(" is not allowed", f" of scene {own.stem} is not allowed", 1)
        lines.append(line(topmost, paths[0], text))
    if lines:
        raise InputError(list(dict.fromkeys(lines)))
    whole = File.model_validate(values).model_dump(mode="json", exclude_unset=True)
    whole = friction.with_load(whole) | {"origins": merged.origins(values)}
    return whole | ({"standard_uncertainties": sorted(uncertainties)} if uncertainties else {})


def _taken_apart(value: Any, part: Values, path: KeyPath) -> tuple[Any, list[list[Any]], list[tuple[KeyPath, str]]]:
    """A part of a scene with values in the place of numbers with a standard uncertainty, where the schema allows one.

    Such a number is `mass_kg: {value: 10, standard_uncertainty: 1}`. Stages read the value in its place, and those that
    ask for uncertainties read them as the key `standard_uncertainties`: results of the others keep their names.
    Returns also the uncertainties, [dotted key, number] each, and mistakes, by path.
    """
    if isinstance(value, dict) and part.get("uncertain"):
        number, error = value.get(VALUE), value.get(UNCERTAINTY)
        key, is_whole = dotted(path), value.keys() == {VALUE, UNCERTAINTY}
        if is_whole and isinstance(number, int | float) and isinstance(error, int | float) and 0.0 < error <= number:
            return number, [[key, float(error)]], []
        form = f"{{{VALUE}: 10, {UNCERTAINTY}: 1}}, with an uncertainty > 0 and <= the value"
        return number, [], [(path, f"{shown(value)} is not allowed; write a number, or {form}")]
    if not isinstance(value, dict | list):
        return value, [], []
    names = list(value) if isinstance(value, dict) else range(len(value))
    found = {name: _taken_apart(value[name], inner(part, name), (*path, name)) for name in names}
    numbers = {name: number for name, (number, _, _) in found.items()}
    return (
        numbers if isinstance(value, dict) else list(numbers.values()),
        [one for _, some, _ in found.values() for one in some],
        [one for _, _, some in found.values() for one in some],
    )


def _refusals(values: Values) -> list[Refusal]:
    """What the sections refuse."""
    errors: list[Any] = [{"type": "null", "loc": path} for path in _nulls(values)]
    try:
        File.model_validate(values)
    except ValidationError as error:
        errors += error.errors(include_url=False, include_context=False)
    return list(refusals(errors, values))


def _nulls(values: Any, path: KeyPath = ()) -> Iterator[KeyPath]:
    """Where a mapping holds no value."""
    for key, value in values.items() if isinstance(values, dict) else ():
        if value is None:
            yield (*path, key)
        yield from _nulls(value, (*path, key))


def _mistakes(scene: Values, whole: Values, faulty: set[str], uncertain: set[str]) -> Iterator[Mistake]:
    """What the targets lack, forms that exclude each other, and every rule across keys that the scene breaks.

    scene, whole : the merged scene, with None for every value that was refused, and with these
    faulty : dotted keys that were refused; rules that read them, or anything in or around them, are left out
    uncertain : dotted keys of the numbers that have a standard uncertainty
    """

    def sound(key: str) -> bool:
        return _is_sound(key, faulty)

    absent = plan.lacking(scene) if sound("targets") else {}
    for key, targets in ((key, targets) for key, targets in absent.items() if sound(key)):
        if key != friction.MEAN or given(scene, friction.RECORD) is not None:  # else the rules of friction report it
            yield missing(f"needed for {', '.join(targets)}", key, "targets")
    for key in _ORDERED:  # where an item is refused, the others still have to rise
        items = given(whole, key)
        if isinstance(items, list) and not sound(key):
            firsts = [item[0] if isinstance(item, list) and item else item for item in items]
            if not is_increasing([first for first in firsts if isinstance(first, int | float)]):
                yield refused(items, "strictly increasing", key)
    for part in (friction, roughness, oscillator):
        for one in part.mistakes(scene):
            if all(map(sound, one.keys[:1] if isinstance(one, Exclusion) else one.keys)):
                yield one
    is_smooth = scene.get("load") is not None and given(scene, "roughness.covariance") != "exponential"
    for key in uncertain if not is_smooth else ():
        if key.startswith("roughness."):
            yield Mistake(
                (key,), "an uncertainty is not allowed; the law of scatter takes load and heights with a slope"
            )
    unread = plan.sections_not_read(scene) if scene.get("targets") and sound("targets") else set()
    for keys, holds, allowed in _RULES:
        if not (unread.isdisjoint(key.partition(".")[0] for key in keys) and all(map(sound, keys))):
            continue
        values = [get(scene, key) for key in keys]
        if None not in values and not holds(*values):
            words = (shown(value) if isinstance(value, list) else value for value in values)
            yield refused(values[0], allowed.format(*words), *keys)


def _is_sound(key: str, faulty: set[str]) -> bool:
    """Whether neither a key, nor anything in it or around it, is faulty."""
    return not any(f"{bad}.".startswith(f"{key}.") or f"{key}.".startswith(f"{bad}.") for bad in faulty)


def _without(faulty: set[str], value: Any, path: str = "") -> Any:
    """The scene with None for every value that was refused, and for lists with a refused item."""
    if path in faulty or (isinstance(value, list) and any(bad.startswith(f"{path}.") for bad in faulty)):
        return None
    if isinstance(value, dict):
        return {key: _without(faulty, item, f"{path}.{key}" if path else key) for key, item in value.items()}
    return value
