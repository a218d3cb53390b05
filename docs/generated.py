"""Parts of the manual that follow from the source: results, verdicts, messages, examples.

A comment `<!-- generated: part argument -->` on a page stands for the text that the function of that name returns.
"""

import ast
import inspect
import re
from pathlib import Path

from api_pages import packages  # noqa: F401  a part of the manual too
from sphinx.application import Sphinx

from roughslip import errors
from roughslip.study.graph import STAGES
from roughslip.verdicts.statements import STATEMENTS

ROOT = Path(__file__).resolve().parents[1]
STUDY = ROOT / "src/roughslip/study"
PLACE = re.compile(r"^<!-- generated: (\w+) ?(\S*) -->$", re.MULTILINE)


def fill(app: Sphinx, page: str, text: list[str]) -> None:
    """Put the generated parts into a page before it is read."""
    text[0] = PLACE.sub(lambda found: globals()[found[1]](*filter(None, [found[2]])), text[0])


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
            rows.append(f"  - `{reading.id}`: {reading.rule.text}. From {reading.place}.{why}\n")
    return "\n".join(rows)


def error_types() -> str:
    """The typed errors with what they mean."""
    kinds = (kind for _, kind in inspect.getmembers(errors, inspect.isclass) if issubclass(kind, Exception))
    return "\n".join(f"`{kind.__name__}`\n: {str(kind.__doc__).splitlines()[0]}\n" for kind in kinds)


def scene_messages() -> str:
    """What a scene file says and the line that refuses it, from the list that the tests of scenes run through."""
    text = (ROOT / "tests/scene/mistakes.txt").read_text(encoding="utf-8")
    blocks = [block for block in text.split("\n\n") if "\n-> " in block or block.startswith("-> ")]
    cases = (block.strip().replace("\n-> ", "\n\n→ ", 1).replace("\n-> ", "\n→ ") for block in blocks)
    return "\n".join(f"```text\n{case}\n```\n" for case in cases)


def examples() -> str:
    """A section for each example, with a cell that runs it."""
    text = []
    for file in sorted((ROOT / "examples").glob("*.py")):
        summary = str(ast.get_docstring(ast.parse(file.read_text(encoding="utf-8")))).partition("\n\n")[0]
        text.append(f"## {file.stem}\n\n{summary} {{download}}`{file.name} <../examples/{file.name}>`\n")
        cell = f'import runpy\n\nnames = runpy.run_path("../examples/{file.name}")'
        text.append(f"```{{code-cell}}\n:tags: [remove-input]\n{cell}\n```\n")
    return "\n".join(text)
