"""What each stage declares of itself, read from its source: no stage is imported, and neither is numpy.

Below the imports of a stage module stands `STAGE = Stage(...)`, written with literal values alone. The plan of a run,
the slices of the scene, the rules, the memory of jobs and the options of the stage's command derive from it.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from string import Formatter
from typing import Any

STAGES_FOLDER = Path(__file__).resolve().parents[1] / "stages"
EVERY_SCENE = "every scene"  # as the target of a stage
RANGE = ("first", "last")  # in the name of a result: of the sample numbers of its batch, [first, last)


@dataclass(frozen=True)
class Batches:
    """How the samples of a stage are split into jobs, as many as the scene key `jobs` says.

    totals : by the name of a design, the scene key of its number of samples; {"": key} for a stage without designs
    """

    totals: Mapping[str, str]


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One stage of the study: what it reads, what it writes, and when it runs.

    name : name of its module, but for a figure of stages/figures.py
    draws : of such a figure, the module of roughslip.figures that draws it
    reads : scene keys that it reads, separated by spaces; the name of a section stands for all its keys
    reads_if_given : further keys, which a scene may leave out with their sections
    inputs : by option of the command, the stage whose result it takes. In place of a stage stands a scene key that
        holds a path, or nothing where the rule names the file
    optional : the same, of files that only some scenes have
    many : the same, for any number of files of one or several stages
    collects : the same as optional, for files that are taken if they exist; they never cause a run
    result : the file that it writes, below the folder of the scene; a range {first}-{last} is that of its batch
    outputs : further files, by option
    batches : how its samples are split into jobs
    target : the target of a scene that needs this stage, or EVERY_SCENE; other stages run as inputs of these
    comes_with : stages that this one accompanies, where its condition holds
    runs_if : condition on the scene for a stage that is not always needed: "key" (given), "not key", "key = value", or
        several of them with " and " between
    caption : of its figure; the stage then writes a PNG and an SVG file as well
    memory_mb : [MB] that a job asks for: a fifth above the peaks in costs.json; far larger scenes take more
    """

    name: str
    draws: str = ""
    reads: str = ""
    reads_if_given: str = ""
    inputs: Mapping[str, str] = field(default_factory=dict)
    optional: Mapping[str, str] = field(default_factory=dict)
    many: Mapping[str, str] = field(default_factory=dict)
    collects: Mapping[str, str] = field(default_factory=dict)
    result: str = ""
    outputs: Mapping[str, str] = field(default_factory=dict)
    batches: Batches | None = None
    target: str = ""
    comes_with: str = ""
    runs_if: str = ""
    caption: str = ""
    memory_mb: int = 420

    @property
    def keys(self) -> tuple[str, ...]:
        """Scene keys that the stage reads: its slice."""
        return (*self.reads.split(), *self.reads_if_given.split())

    @property
    def options(self) -> tuple[str, ...]:
        """Options of its command that name files to read."""
        return (*self.inputs, *self.optional, *self.many, *self.collects)

    @property
    def command(self) -> str:
        """The command that runs it, after `python -m`."""
        return f"roughslip.stages {'figures ' if self.draws else ''}{self.name}"

    @property
    def modules(self) -> str:
        """The modules whose import closure is its code, separated by spaces."""
        return f"roughslip.stages.{f'figures roughslip.figures.{self.draws}' if self.draws else self.name}"

    @property
    def placeholders(self) -> tuple[str, ...]:
        """What stands in braces in the name of its result; its command takes each as an option."""
        return tuple(name for _, name, _, _ in Formatter().parse(self.result) if name)

    def job_name(self, **values: object) -> str:
        """The name of a job, for its record of cost and its log: its stage, and the design and range of its samples.

        values : of the placeholders in the name of the result; without them they stay as they are
        """
        name = "-".join((self.name, *(f"{{{part}}}" for part in self.placeholders)))
        return name.format(**values) if values else name

    @property
    def results(self) -> dict[str, str]:
        """Every file that it writes, by option; "output" is the result."""
        pictures = {kind: str(Path(self.result).with_suffix(f".{kind}")) for kind in ("png", "svg") if self.caption}
        return {"output": self.result} | pictures | dict(self.outputs)


def figure(*, name: str, of: str, draws: str = "", target: str = "", reads: str = "", **others: Any) -> Stage:
    """A figure of the results of one stage, which computes nothing itself: a row of `STAGES` in stages/figures.py.

    Target and drawing module have its name by default.

    of : the stage whose results it draws
    reads : scene keys without which it cannot be drawn
    """
    others |= {"many": {"results": of}, "result": f"{name}.nc", "memory_mb": 320}
    return Stage(name=name, draws=draws or name, reads=f"description {reads}".strip(), target=target or name, **others)


@cache
def declarations() -> dict[str, Stage]:
    """All stages by name. Raises ValueError, with file and line, where a declaration is not written in literals."""
    files = (file for file in sorted(STAGES_FOLDER.glob("*.py")) if not file.name.startswith("__"))
    stages = (stage for file in files for stage in _declared(file))
    return {stage.name: stage for stage in sorted(stages, key=lambda stage: stage.name)}


@cache
def targets() -> tuple[str, ...]:
    """All that a scene may ask for."""
    return tuple(sorted({stage.target for stage in declarations().values()} - {"", EVERY_SCENE}))


def _declared(file: Path) -> list[Stage]:
    """The stages that a module declares: one of its name as STAGE, or several as STAGES."""
    head = re.split(r"\n(?=def |class |@)", file.read_text(encoding="utf-8"), maxsplit=1)[0]  # a third of the time
    for node in ast.parse(head, str(file)).body:
        name = ast.unparse(node.targets[0]) if isinstance(node, ast.Assign) else ""
        if isinstance(node, ast.Assign) and name in ("STAGE", "STAGES"):
            try:
                value = _value(node.value)
            except (TypeError, ValueError) as error:
                raise ValueError(f"{file}:{node.lineno}: {name} takes literal values only: {error}") from error
            if isinstance(value, list):
                return value
            if not isinstance(value, Stage) or value.name != file.stem:
                raise ValueError(f"{file}:{node.lineno}: STAGE must be a Stage with name={file.stem!r}")
            return [value]
    raise ValueError(f"{file}: no stage is declared; write STAGE = Stage(name={file.stem!r}, ...) below the imports")


def _value(node: ast.expr) -> Any:
    """The value of a literal, of a call of Stage, Batches or figure with literals as keywords, or of a list of them."""
    if isinstance(node, ast.List):
        return [_value(element) for element in node.elts]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and not node.args:
        known: dict[str, Any] = {"Stage": Stage, "Batches": Batches, "figure": figure}
        if node.func.id in known:
            return known[node.func.id](**{str(argument.arg): _value(argument.value) for argument in node.keywords})
    return ast.literal_eval(node)
