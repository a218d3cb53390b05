"""One page, readable without a network, of what scenes found: figures, verdicts, costs and how to repeat the run."""

import base64
import json
import math
import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from html import escape
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from roughslip.report import budget_words, words
from roughslip.report.sections import (
    MARKS,
    SECTIONS,
    answers,
    by_chance,
    holding,
    in_brackets,
    our_number,
    rows,
    section,
)

OPEN = ("figure_record", "figure_map", "friction_against_load")  # figures that the page of a machine does not fold
READINGS = ("paper", "resolved")  # scenes that read the paper
# Statements on numbers that the paper gives for its own surfaces, or on numbers that follow from them alone.
OF_ITS_NUMBERS = ("mu-correlation-250um", "mu-leptokurtic", "mu-beta-2.1-5", "mu-beta-any-depth")
READABLE = 1.15  # pixels a point on a narrow screen: text of 9 points has 10 pixels; a wider picture then scrolls


@dataclass(frozen=True)
class SceneReport:
    """What the page shows of a scene.

    name, description : of the scene
    figures : bytes of an SVG by the name of the figure
    captions : by the name of the figure
    surfaces : how the surface behind a figure is represented and why, in sentences, by the name of the figure
    claims, costs : contents of claims.json and costs.json
    configuration : what the stages read of the scene, as JSON
    origins : by dotted key, the scene that gives the value: itself or one that it extends
    answer, budget : contents of answer.json and budget.json; None where no such stage runs
    folder : of its files, from the folder of the page: empty, or ending in a slash
    file : the scene file, from the folder of the page; empty for a scene without one
    """

    name: str
    description: str
    figures: Mapping[str, bytes]
    captions: Mapping[str, str]
    surfaces: Mapping[str, Sequence[str]]
    claims: Sequence[Mapping[str, Any]]
    costs: Sequence[Mapping[str, Any]]
    configuration: str
    origins: Mapping[str, str] = field(default_factory=dict)
    answer: Mapping[str, Any] | None = None
    budget: Mapping[str, Any] | None = None
    folder: str = ""
    file: str = ""

    @property
    def is_reading(self) -> bool:
        """Whether the scene is one of the two readings of the paper, on which every statement appears."""
        return self.name in READINGS

    @property
    def has_answer(self) -> bool:
        """Whether the scene has an answer on stick-slip."""
        return self.answer is not None and bool(self.answer["given"])

    @property
    def is_machine(self) -> bool:
        """Whether the scene has an answer and is no reading of the paper: its page shows the machine first."""
        return not self.is_reading and self.has_answer

    @property
    def tested(self) -> list[Mapping[str, Any]]:
        """Statements that are tested and not on the paper's own numbers."""
        return [one for one in self.claims if one["verdict"] != "not tested" and one["id"] not in OF_ITS_NUMBERS]

    @property
    def warnings(self) -> Sequence[str]:
        """On the scene and of its stages; the last row of the costs holds them."""
        return self.costs[-1].get("warnings", ()) if self.costs else ()


def page(scenes: Sequence[SceneReport], versions: Mapping[str, str]) -> str:
    """The page as HTML, with its pictures inside. versions : of the packages that made the results"""
    readings = {scene.name: scene.claims for scene in scenes if scene.is_reading}
    shown = {name for scene in scenes for name in scene.figures}
    shown |= {"figure2", "figure3", "figure3_law", "figure5"} if readings else set()
    sections = [name for name in dict.fromkeys([*SECTIONS, *sorted(shown)]) if name in shown]
    is_machine = len(scenes) == 1 and scenes[0].is_machine
    opened = [name for name in sections if name in OPEN or not is_machine]
    template = environment().get_template("page.html.j2")
    return template.render(
        scenes=scenes,
        readings=readings,
        own=scenes[0] if is_machine else None,
        opened=opened,
        folded=[name for name in sections if name not in opened],
        answers=answers(readings),
        marks=MARKS,
        versions=versions,
    )


@cache
def environment() -> Environment:
    """The templates with their filters, compiled once in a process."""
    environment = Environment(
        loader=PackageLoader("roughslip.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    environment.filters |= {
        "digits": words.digits,
        "share": lambda row, costs: f"{100 * row['cpu_seconds'] / max(costs[-1]['cpu_seconds'], 1e-9):.3g}",
        "amount": words.amount,
        "aim": words.aim,
        "along_load": words.along_load,
        "bars": budget_words.bars,
        "chance": words.chance,
        "change_rows": words.change_rows,
        "curve": lambda scene: friction_curve(json.loads(scene.configuration), scene.origins, scene.name),
        "numbers": numbers,
        "decision": words.decision,
        "facts": words.facts,
        "smallest_change": words.smallest_change,
        "other_chances": words.other_chances,
        "plots": plots,
        "verdict": words.verdict,
        "counts": _counts,
        "verdicts": lambda claims: Counter(claim["verdict"] for claim in claims).most_common(),
        "section": section,
        "in_brackets": in_brackets,
        "number": our_number,
        "holding": holding,
        "by_chance": by_chance,
        "rows": rows,
        "element": element,
        "thumbnail": thumbnail,
    }
    return environment


def numbers(scene: SceneReport) -> str:
    """A line a key that the stages read: its value, and which scene gives it; others are defaults, or follow."""
    rows = ((key, json.dumps(value, ensure_ascii=False)) for key, value in _leaves(json.loads(scene.configuration)))
    origins = {key: f"scene {origin}" for key, origin in scene.origins.items()}
    return "\n".join(f"{f'{key}: {value}':<60}  # {origins.get(key, 'default, or follows')}" for key, value in rows)


def friction_curve(scene: Mapping[str, Any], origins: Mapping[str, str], name: str) -> str:
    """The friction curve of a scene of that name in a sentence. origins : the scene of each value, by dotted key"""
    oscillator, record = scene["oscillator"], (scene.get("friction") or {}).get("record")
    if record:
        several = len(record["file"]) > 1
        return f"The curve is that of the record{'s' if several else ''} {', '.join(record['file'])}."
    law, static, table = (oscillator.get(name) for name in ("law", "static_friction", "friction_table"))
    key = {"table": "friction_table", "stribeck": "stribeck_decay_s_per_m", "coulomb": "static_friction"}.get(
        law, "law"
    )
    of = f"scene {base}" if (base := origins.get(f"oscillator.{key}", name)) != name else "the scene"
    if law == "table":
        static, (speed, last) = table[0][1] if static is None else static, table[-1]
        ends = f"{words.digits(static)} at rest, {words.digits(last)} at {words.amount(speed, 'm s-1')}"
        return f"The curve is the friction_table of {of}: {ends}."
    return f"The curve is the law {law} of {of}{'' if static is None else f': {words.digits(static)} at rest'}."


def _leaves(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted keys with values that are no groups of keys."""
    for name, value in sorted(values.items()):
        yield from _leaves(value, f"{before}{name}.") if isinstance(value, Mapping) else [(before + name, value)]


def _counts(counts: Mapping[str, int]) -> str:
    """`80,400 convolutions, 3 field fits`, without zeros."""
    return ", ".join(f"{count:,} {name.replace('_', ' ')}" for name, count in counts.items() if count)


def box(svg: bytes) -> tuple[float, float]:
    """Width and height of a drawing [points]."""
    found = re.search(rb'viewBox="0 0 ([\d.]+) ([\d.]+)"', svg)
    if found is None:
        raise ValueError("a drawing has no viewBox at the origin; write it with roughslip.figures.style.save")
    return float(found[1]), float(found[2])


def element(svg: bytes, name: str, seen: str) -> str:
    """The drawing as an element. name : of its id, unique on the page; seen : in words"""
    width, height = box(svg)
    picture = f"data:image/svg+xml;base64,{base64.b64encode(svg).decode()}"
    look = f'class="drawing" style="--readable: {READABLE * width:.0f}px" viewBox="0 0 {width:g} {height:g}"'
    return (
        f'<div class="wide" tabindex="0"><svg {look} role="img" aria-label="{escape(seen)}"><g id="{name}-drawing">'
        f'<image href="{picture}" width="{width:g}" height="{height:g}"/></g></svg></div>'
    )


def thumbnail(svg: bytes, name: str) -> str:
    """The drawing again, small; the link around it says what it is."""
    width, height = box(svg)
    size = f'class="drawing" viewBox="0 0 {width:g} {height:g}"'
    return f'<svg {size} aria-hidden="true"><use href="#{name}-drawing"/></svg>'


def _round_step(length: float) -> float:
    """The distance of ticks, of which four to ten lie on an axis: 1, 2 or 5 times a power of ten."""
    power = 10.0 ** math.floor(math.log10(length))
    return next(step * power for step in (0.1, 0.2, 0.5, 1.0) if length <= 10.000001 * step * power)


def _marks(low: float, length: float, step: float) -> list[float]:
    """Places of the multiples of a step on an axis, in percent of its length."""
    first, last = math.ceil(low / step - 1e-9), math.floor((low + length) / step + 1e-9)
    return [100 * (number * step - low) / length for number in range(first, last + 1)]


def plots(motion: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Displacement and speed against time, and the cycle: speed against displacement.

    Each has the curves with and without scatter as points of SVG in a box of 100 by 100, and the lengths of its axes.
    """
    units, ends = {"time_s": "s", "displacement_m": "m", "velocity_m_per_s": "m s-1"}, {}
    for name in units:
        values = [value for curve in motion.values() for value in curve[name]]
        ends[name] = min(values), max(max(values) - min(values), 1e-300)
    axes = {"displacement": ("time_s", "displacement_m"), "speed": ("time_s", "velocity_m_per_s")}
    drawn = {}
    for title, (x, y) in (axes | {"cycle": ("displacement_m", "velocity_m_per_s")}).items():
        across, along = (words.amount(ends[axis][1], units[axis], words.SURE) for axis in (x, y))
        steps = [_round_step(ends[axis][1]) for axis in (x, y)]
        each = [words.amount(step, units[axis], words.SURE) for step, axis in zip(steps, (x, y), strict=True)]
        marks = [_marks(*ends[axis], step) for step, axis in zip(steps, (x, y), strict=True)]
        ticks = " ".join([*(f"M{place:.4g} 100v-4" for place in marks[0]), *(f"M0 {100 - p:.4g}h1" for p in marks[1])])
        drawn[title] = {"across": across, "along": along, "ticks": ticks, "each": each} | {
            kind: " ".join(
                f"{100 * (a - ends[x][0]) / ends[x][1]:.4g},{100 - 100 * (b - ends[y][0]) / ends[y][1]:.4g}"
                for a, b in zip(curve[x], curve[y], strict=True)
            )
            for kind, curve in motion.items()
        }
    return drawn
