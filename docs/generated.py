"""Parts of the manual that follow from the source: what a key affects, results, verdicts, messages.

A comment `<!-- generated: part argument -->` on a page stands for the text that the function of that name returns.
"""

from __future__ import annotations

import ast
import inspect
import re
from functools import cache
from pathlib import Path

import api_pages
from sphinx.application import Sphinx

from roughslip import errors
from roughslip.scene.schema import keys
from roughslip.scene.types import File
from roughslip.study.graph import EVERY_SCENE, STAGES, Stage, targets
from roughslip.verdicts.statements import STATEMENTS

ROOT = Path(__file__).resolve().parents[1]
STUDY = ROOT / "src/roughslip/study"
PLACE = re.compile(r"^<!-- generated: (\w+) ?(\S*) -->$", re.MULTILINE)
# Keys that no stage reads: they say what runs and in how large jobs, or stand for others.
OF_THE_PLAN = {
    "extends": "which values the file changes",
    "jobs": "how many jobs take the samples of a stage",
    "targets": "which stages run",
}


def fill(app: Sphinx, page: str, text: list[str]) -> None:
    """Put the generated parts into a page before it is read."""
    text[0] = PLACE.sub(lambda found: globals()[found[1]](*filter(None, [found[2]])), text[0])


def reads(stage: Stage) -> tuple[str, ...]:
    """Keys and sections that a stage reads, with those that set the number of its samples and name its files."""
    return (*stage.keys, *stage.batches.values(), *stage.user_files.values())


@cache
def affected(key: str) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The stages that read a key, and the figures and answers that follow from them."""
    stages = {name: one for name, one in STAGES.items() if one.target != EVERY_SCENE}
    first = [
        name for name, stage in stages.items() if any(key == one or key.startswith(f"{one}.") for one in reads(stage))
    ]
    found, pending = set(first), list(first)
    while pending:
        last = pending.pop()
        for name, stage in stages.items():
            if name not in found and last in stage.makers:
                found.add(name)
                pending.append(name)
    shown = (name for name in found if stages[name].target not in ("", EVERY_SCENE))
    return tuple(first), tuple(sorted(shown))


def key_effects() -> str:
    """A table with a row for keys of a section that change the same figures, and a column for each figure."""
    columns = [name for name in targets() if name != "answer"] + ["answer"]
    heads = [name.removeprefix("figure_").removeprefix("figure") for name in columns]
    text = [f"| key | {' | '.join(heads)} |", "|---|" + ":-:|" * len(columns)]
    for section in File.model_fields:
        rows: dict[tuple[str, ...], list[str]] = {}
        for key, part in keys():
            if key.partition(".")[0] == section and "properties" not in part and key not in OF_THE_PLAN:
                rows.setdefault(affected(key)[1], []).append(key.removeprefix(f"{section}."))
        for shown, names in rows.items():
            same = ", ".join(f"`{name}`" for name in names)
            marks = ["●" if column in shown else "" for column in columns]
            text.append(f"| {'' if section in names else f'**{section}** '}{same} | {' | '.join(marks)} |")
    return "\n".join(text)


def results() -> str:
    """By stage: what it does, and its files."""
    rows = ["| stage | what it does | files |", "|---|---|---|"]
    for name, stage in STAGES.items():
        files = ", ".join(f"`{file}`" for file in stage.results.values() if file)
        rows.append(f"| {name} | {stage.caption or _summary(STUDY / f'{stage.module or name}.py')} | {files} |")
    return "\n".join(rows)


def _summary(file: Path) -> str:
    """What a module says of itself in its first line."""
    line = str(ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))).splitlines()[0]
    line = line.partition(": ")[2] if line.startswith("Stage ") else line
    return line[0].upper() + line[1:]


def verdict_rules() -> str:
    """Every statement with the paper's words and its readings: what is taken, where it comes from, and the rule."""
    rows = []
    for one in STATEMENTS:
        rows.append(f"`{one.id}`\n: **{one.text}.** In the paper: {one.paper}.\n")
        for reading in one.readings:
            why = f" *Natural*: {reading.natural}." if reading.natural else ""
            why += f" *Apart*: {reading.apart}." if reading.apart else ""
            rows.append(f"  - `{reading.id}`: {reading.rule}. From {reading.place}.{why}\n")
    return "\n".join(rows)


def error_types() -> str:
    """The typed errors with what they mean."""
    kinds = (kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, Exception))
    return "\n".join(f"`{kind.__name__}`\n: {str(kind.__doc__).splitlines()[0]}\n" for kind in kinds)


def scene_messages() -> str:
    """What a scene file says and the line that refuses it, from the list that the tests of scenes run through."""
    text = (ROOT / "tests/scene/mistakes.txt").read_text(encoding="utf-8")
    blocks = [block for block in text.split("\n\n") if "\n-> " in block or block.startswith("-> ")]
    cases = (block.partition("\n-> ") for block in blocks)
    return "\n".join(f"```text\n{given}\n\n→ {line.strip()}\n```\n" for given, _, line in cases)


def packages() -> str:
    """The table of the library's packages."""
    return api_pages.packages()


def examples() -> str:
    """A section for each example, with a cell that runs it. The whole study takes minutes, so it is only named."""
    text = []
    for file in sorted(api_pages.EXAMPLES.glob("*.py")):
        summary = str(ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))).partition("\n\n")[0]
        text.append(f"## {file.stem}\n\n{summary} {{download}}`{file.name} <../examples/{file.name}>`\n")
        if file.stem != "whole_study":
            cell = f'import runpy\n\nnames = runpy.run_path("../examples/{file.name}")'
            text.append(f"```{{code-cell}}\n:tags: [remove-input]\n{cell}\n```\n")
    return "\n".join(text)


missing = sorted(key for key, part in keys() if "properties" not in part and not affected(key)[0])
if not set(missing) <= set(OF_THE_PLAN):
    raise ValueError(f"keys that no stage reads: {missing}; say in OF_THE_PLAN what they do")
