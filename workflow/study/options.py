"""Check the options of a run: config/config.yaml, --configfile, --config, and the targets of the command line."""

from __future__ import annotations

import difflib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

from roughslip.errors import InputError
from roughslip.scene.mistakes import shown

KEYS = ("scenes", "compare", "memory_mb")
LEAST_MB = 1000  # of a node: about what a stage declares
FOLDERS = ("store", "reference", "benchmarks", "stress", "evidence", "monte_carlo", "logs", "usage")  # of no scene
_FLAGS = {"--dry-run", "--dryrun", "--force", "--forceall", "--keep-going", "--touch", "--nolock", "--printshellcmds"}


def check_config(config: Mapping[str, Any], scenes: Sequence[str]) -> dict[str, Any]:
    """Return the options with `scenes` as a list, and None for `memory_mb` where it is not given.

    Scenes are a list, or names with commas between them.

    scenes : names of all scene files

    Raises InputError with a line for each mistake.
    """
    lines = [f"config: {shown(key)}: unknown key; {_guess(str(key), KEYS)}" for key in config if key not in KEYS]
    memory = config.get("memory_mb", LEAST_MB)
    if type(memory) is not int or memory < LEAST_MB:
        lines.append(f"config: memory_mb: {shown(memory)} is not allowed; a whole number from {LEAST_MB}")
    given = config.get("scenes")
    names = given.split(",") if isinstance(given, str) else given
    if not isinstance(names, list) or not names:
        lines.append(f"config: scenes: {shown(given)} is not allowed; a list of scenes, of: {', '.join(scenes)}")
        names = []
    for number, name in enumerate(names):
        if name not in scenes:
            lines.append(f"config: scenes: {shown(name)} is no scene; {_guess(str(name), scenes)}")
        elif name in names[:number]:
            lines.append(f"config: scenes: {shown(name)} is given twice; name each scene once")
    if lines:
        raise InputError(lines)
    return {"memory_mb": None, **config, "scenes": names}


def check_targets(words: Sequence[str], scenes: Collection[str], rules: Collection[str]) -> None:
    """Raise InputError for a word of the command line that is close to the name of a scene and no other target.

    words : the command line
    rules : names of rules, which are targets too
    """
    lines, known = [], {*scenes, *rules, *FOLDERS}
    for before, word in zip(("", *words), words, strict=False):
        name = scene_of(word)
        is_value = before.startswith("--") and "=" not in before and before not in _FLAGS
        is_target = not (is_value or name in known or name.startswith("-") or "=" in word or Path(word).exists())
        if is_target and difflib.get_close_matches(name, scenes):
            lines.append(f"{shown(word)} is no target: no scene {shown(name)}; {_guess(name, sorted(scenes))}")
    if lines:
        raise InputError(lines)


def scene_of(word: str) -> str:
    """The scene that a target of the command line belongs to: its name, or the folder of a result."""
    parts = Path(word).parts
    return parts[1] if len(parts) > 2 and parts[0] == "results" else word


def _guess(name: str, allowed: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, allowed, 1)
    return f"{f'did you mean {near[0]}? ' if near else ''}allowed: {', '.join(allowed)}"
