"""What the rules ask of the scenes: which exist, which files a stage of one reads, and its key file."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from roughslip import scene_rules
from roughslip.errors import InputError
from roughslip.scene import load
from workflow.lib.keys import write_key

DESIGNS = {
    "monte_carlo": "square.monte_carlo_samples",
    "latin_hypercube": "square.latin_hypercube_samples",
    "expansion": "expansion.samples",
}


class Scenes:
    """All scene files of the project, checked; those that this run asks for must be without mistake.

    root : the project's folder
    words : the command line; the scenes that it names are asked for, or else those of config/config.yaml
    Raises InputError with every mistake of every scene asked for. A mistake in a scene that is not harms nobody.
    """

    def __init__(self, root: Path, words: list[str]) -> None:
        self.root = root
        folder = root / "config" / "scenes"
        self.default = _default_scenes(root / "config" / "config.yaml", folder)
        named = {_scene_of(word) for word in words} & {path.stem for path in folder.glob("*.yaml")}
        asked = named or set(self.default)
        self.valid: dict[str, dict[str, Any]] = {}
        mistakes: list[str] = []
        for path in sorted(folder.glob("*.yaml")):
            try:
                self.valid[path.stem] = load(path.stem, folder, root / "config" / "scene.schema.yaml")
            except InputError as error:
                if path.stem in asked:
                    mistakes += error.lines
        if mistakes:
            raise InputError(mistakes)

    def __getitem__(self, name: str) -> dict[str, Any]:
        return self.valid[name]

    @cache  # noqa: B019 (one instance lives as long as the run)
    def stages(self, name: str) -> frozenset[str]:
        """Stages that the targets of the scene need."""
        return frozenset(scene_rules.stages_needed(self.valid[name]))

    @cache  # noqa: B019
    def key_file(self, name: str, stage: str) -> str:
        """Path of a stage's key file, which is written if the scene, the stage's code or the lock file changed."""
        path = f"results/{name}/keys/{stage}.json"
        configuration = scene_rules.slice_for(self.valid[name], stage)
        module = f"roughslip.stages.{stage}"
        write_key(path, configuration, module, self.root / "src", self.root / "requirements.lock")
        return path

    def key(self, stage: str) -> Callable[[Any], str]:
        """An input function: the stage's key file for the scene of the wildcards."""
        return lambda wildcards: self.key_file(wildcards.scene, stage)

    def batches(self, name: str, total: str, size: str) -> list[tuple[int, int]]:
        """Ranges [first, last) of sample numbers, from the dotted keys of their total and of the batch size."""
        count, step = scene_rules.get(self.valid[name], total), scene_rules.get(self.valid[name], size)
        return [(first, min(first + step, count)) for first in range(0, count, step)]

    def square_contacts(self, name: str) -> list[str]:
        """Contact results of every design on the square."""
        return [
            f"results/{name}/contact/square-{design}-{first}-{last}.nc"
            for design, total in DESIGNS.items()
            for first, last in self.batches(name, total, "batches.square_samples")
        ]

    def strip_contacts(self, name: str, below: int | None = None) -> list[str]:
        """Contact results of the strips, all or those of batches that begin below a sample number."""
        return [
            f"results/{name}/contact/strip-{first}-{last}.nc"
            for first, last in self.batches(name, "strip.samples", "batches.strip_samples")
            if below is None or first < below
        ]

    def training_contacts(self, name: str) -> list[str]:
        """Contact results of the strips that train the expansion."""
        return self.strip_contacts(name, below=self.valid[name]["strip"]["training_samples"])

    def expansion_strips(self, name: str) -> list[str]:
        """Window sums from the expansion."""
        return [
            f"results/{name}/friction/expansion-{first}-{last}.nc"
            for first, last in self.batches(name, "strip.expansion_samples", "batches.expansion_samples")
        ]

    def oscillator_runs(self, name: str) -> list[str]:
        """Events and counts of the ensemble."""
        return [
            f"results/{name}/oscillator/ensemble-{first}-{last}.nc"
            for first, last in self.batches(name, "ensemble.realisations", "batches.realisations")
        ]

    def results(self, name: str) -> dict[str, str]:
        """The result that sums up each branch that the scene's targets need, by the option that takes it."""
        found = {
            "square": ("chaos_square", "chaos/square.nc"),
            "friction": ("friction", "friction/statistics.nc"),
            "oscillator": ("cycles", "oscillator/statistics.nc"),
        }
        return {
            option: f"results/{name}/{path}" for option, (stage, path) in found.items() if stage in self.stages(name)
        }

    def figures(self, name: str) -> list[str]:
        """The figures that are the scene's targets."""
        return [f"results/{name}/{figure}.png" for figure in self.valid[name]["targets"]]

    def usage_records(self, name: str) -> list[str]:
        """The records of cost of every job up to figures and claims."""
        batched = {
            "contact_square": self.square_contacts,
            "contact_strip": self.strip_contacts,
            "expansion_strip": self.expansion_strips,
            "oscillator": self.oscillator_runs,
        }
        records = []
        for stage in sorted(self.stages(name) - {"costs", "report"}):
            if stage in batched:
                tails = [Path(result).stem.partition("-")[2] for result in batched[stage](name)]
                records += [f"results/{name}/usage/{stage}-{tail}.json" for tail in tails]
            else:
                records.append(f"results/{name}/usage/{stage}.json")
        return records


def _scene_of(word: str) -> str:
    """The scene that a target of the command line belongs to: its name, or the folder of a result."""
    parts = Path(word).parts
    return parts[1] if len(parts) > 1 and parts[0] == "results" else word


def _default_scenes(path: Path, folder: Path) -> list[str]:
    allowed = sorted(file.stem for file in folder.glob("*.yaml"))
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, yaml.YAMLError) as error:
        raise InputError(f"{path}: not readable ({error})") from error
    names = content.get("scenes") if isinstance(content, dict) else None
    if set(content or {}) != {"scenes"} or not isinstance(names, list) or not names:
        raise InputError(f"{path}: scenes: must be its only key, a list of some of: {', '.join(allowed)}")
    wrong = [name for name in names if name not in allowed]
    if wrong:
        raise InputError([f"{path}: scenes: {name!r} is not allowed; one of: {', '.join(allowed)}" for name in wrong])
    return names
