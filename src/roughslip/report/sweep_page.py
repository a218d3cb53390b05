"""The page that compares the variants of a scene: a row a variant, with its values and its main numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from roughslip.report.page import environment

Number = tuple[float, float | None, float | None]  # with the ends of its 95 % interval, where it has one


@dataclass(frozen=True)
class Row:
    """scene : name; swept : its values by dotted key; numbers : its results by name; answer : answer.json, if given"""

    scene: str
    swept: Mapping[str, Any]
    numbers: Mapping[str, Number]
    answer: Mapping[str, Any] | None = None


def sweep_page(rows: Sequence[Row], description: str, titles: Mapping[str, tuple[str, str]]) -> str:
    """The page as HTML. titles : heading and unit by the name of a number, in their order"""
    names = [name for name in titles if any(name in row.numbers for row in rows)]
    template = environment().get_template("sweep.html.j2")
    return template.render(rows=rows, description=description, titles=titles, names=names, words=words)


def words(value: Any) -> str:
    """A value of a scene, as a reader would write it."""
    return "not given" if value is None else f"{value:g}" if isinstance(value, float) else str(value)


def sweep_table(rows: Sequence[Row], titles: Mapping[str, tuple[str, str]]) -> str:
    """The same as comma-separated values; _low and _high end the interval of a number."""
    names = [name for name in titles if any(name in row.numbers for row in rows)]
    parts = [f"{name}{end}" for name in names for end in ("", "_low", "_high")]
    lines = [",".join(["scene", *rows[0].swept, *parts])]
    for row in rows:
        values = [value for name in names for value in row.numbers.get(name, (None, None, None))]
        texts = ["" if value is None else f"{value:.6g}" for value in values]
        lines.append(",".join([row.scene, *(words(value).replace(",", "") for value in row.swept.values()), *texts]))
    return "\n".join(lines) + "\n"
