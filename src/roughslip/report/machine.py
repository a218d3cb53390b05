"""The parts of the page of a machine: verdict, what would change it, facts, drawn motion, its place on the map."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from roughslip.report.answer import SIDES, SURE, amount, digits, ends, joined, percent, scatter, symbol

CHANGES = {  # downwards, upwards
    "damping": ("less damping, D", "more damping, D"),
    "belt_velocity": ("slower belt", "faster belt"),
    "mass": ("lighter mass", "heavier mass"),
    "stiffness": ("softer spring", "stiffer spring"),
    "load": ("less normal force", "more normal force"),
}
REACH = 100.0  # factor up to which limits are searched: the full length of a bar
WIDE = 1.5  # factor from which a change is given as one, not in per cent


@dataclass(frozen=True)
class Row:
    """A parameter in the table of what would end or begin stick-slip.

    name, symbol, now : the change in words, the parameter's symbol, the scene's value
    needed, interval : the value at which stick-slip ends or begins, and its interval; empty without a limit
    change : factor or per cent
    way : logarithm of the change [% of the search], negative downwards
    is_smallest : of all relative changes
    outside : whether the limit lies beyond the measured speeds
    """

    name: str
    symbol: str
    now: str
    needed: str = ""
    interval: str = ""
    change: str = ""
    way: float = 0.0
    is_smallest: bool = False
    outside: bool = False


def nearest_limit(answer: Mapping[str, Any], parameter: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Where along a parameter stick-slip ends, where it is likely, or else begins, nearest to the scene's value."""
    label = "0.05" if answer["probability"]["value"] > 0.5 else "0.95"
    near = [parameter[side][label] for side in SIDES if parameter[side][label] is not None]
    own = parameter["value"] or 1.0
    return min(near, key=lambda limit: abs(math.log(limit["value"] / own)), default=None)


def change_rows(answer: Mapping[str, Any]) -> list[Row]:
    """A row a parameter, the smallest change first; without a limit it has no change."""
    smallest, ranked = answer["smallest_change"] or {"parameter": None}, []
    for name, parameter in answer["limits"].items():
        own, unit = parameter["value"], parameter["unit"]
        sign = symbol(answer["limits"], name)
        title = parameter["title"] if name == "damping" else parameter["title"].rpartition(" ")[0]
        limit = nearest_limit(answer, parameter)
        if limit is None or not own:
            ranked.append((math.inf, Row(title, sign, amount(own, unit))))
            continue
        way = math.log(limit["value"] / own)
        row = Row(
            CHANGES[name][way > 0.0],
            sign,
            amount(own, unit),
            amount(limit["value"], unit, like=own),
            ends(limit, own),
            factor(limit["value"] / own),
            100.0 * max(min(way / math.log(REACH), 1.0), -1.0),
            name == smallest["parameter"],
            bool(limit.get("outside_measured_speeds")),
        )
        ranked.append((0.0 if row.is_smallest else abs(way), row))
    return [row for _, row in sorted(ranked, key=lambda pair: pair[0])]


def factor(ratio: float) -> str:
    """`+12 %`, or `× 6.5` and `÷ 6.5` where that reads better."""
    if 1.0 / WIDE < ratio < WIDE:
        return f"{'+' if ratio > 1.0 else '−'}{digits(100 * abs(ratio - 1.0), SURE)} %"
    return f"× {digits(ratio, SURE)}" if ratio > 1.0 else f"÷ {digits(1.0 / ratio, SURE)}"


def verdict(answer: Mapping[str, Any]) -> dict[str, str]:
    """The verdict as a word, its kind (bad, good or odd), and a sentence."""
    rest, sliding = (answer[name]["value"] for name in ("probability", "probability_from_sliding"))
    if answer["starts_differ"] and not answer["decided"]:
        text = "The runs are too short to tell: they still depend on how they start."
        return {"word": "Not decided", "kind": "odd", "text": text}
    if answer["starts_differ"]:
        text = "It stick-slips once it has been at rest, and goes on sliding where it slides at first."
        return {"word": "After a stop", "kind": "bad" if rest >= 0.95 else "odd", "text": text}
    begun = ", whether it starts from rest or from sliding."
    if rest >= 0.95:
        return {"word": "Yes", "kind": "bad", "text": f"It stick-slips{begun}"}
    if rest <= 0.05:
        return {"word": "No", "kind": "good", "text": f"It slides steadily{begun}"}
    share = "more" if min(rest, sliding) > 0.5 else "less"
    text = f"Stick-slip ends and begins again: it takes {share} than half of the time."
    return {"word": "At times", "kind": "odd", "text": text}


def facts(answer: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Title, number and a note on it: how the mass moves, how long its states last, its friction."""
    stiffness, mass = (answer["limits"][name]["value"] for name in ("stiffness", "mass"))
    own = amount(math.sqrt(stiffness / mass) / (2 * math.pi), "Hz", SURE)
    lines = []
    if answer["amplitude"]["value"] is not None:
        sizes = {name: amount(answer[name]["value"], answer[name]["unit"], SURE) for name in ("amplitude", "frequency")}
        lines.append(("half of peak to peak", sizes["amplitude"], f"scatters by {scatter(answer, 'amplitude')}"))
        lines.append(
            ("frequency", sizes["frequency"], f"scatters by {scatter(answer, 'frequency')}; own frequency {own}")
        )
    else:
        lines.append(("own frequency", own, "there is no cycle of stick-slip"))
    return [*lines, _states(answer), ("mean friction", *_friction(answer))]


def _friction(answer: Mapping[str, Any]) -> tuple[str, str]:
    mean, deviation = (answer[f"friction_{name}"]["value"] for name in ("mean", "deviation"))
    note = f"scatters by {digits(100 * deviation / mean, SURE)} %"
    if (windows := answer["windows"]["value"]) > 1:
        pad = answer["friction_pad_deviation"]["value"]
        note = f"scatters by {digits(100 * pad / mean, SURE)} %; one contact window {note}, of {windows:.0f}"
    return digits(mean), note


def _states(answer: Mapping[str, Any]) -> tuple[str, str, str]:
    """Time in stick-slip, of runs from rest where no state was seen to end, and mean durations of the states."""
    states, durations = answer["states"], []
    for word, name in (("stick-slip", "mean_stick_slip_s"), ("sliding", "mean_sliding_s")):
        mean, minimum, _ = states[name]
        if mean is not None or minimum is not None:
            known = amount(minimum, "s", SURE) if mean is None else amount(mean, "s", SURE)
            durations.append(f"{word} lasts {'at least ' if mean is None else ''}{known}")
    value, low, high = (None if part is None else 100 * part for part in states["share_of_time"])
    if value is None:
        number, notes = percent(answer["probability"]).partition(" [")[0], ["of runs from rest"]
    else:
        number, notes = f"{value:.0f} %", [] if low is None or high is None else [f"{low:.0f} to {high:.0f} %"]
    notes += [f"in the mean {joined(durations)}"] if durations else []
    return "time in stick-slip", number, "; ".join(notes)


@dataclass(frozen=True)
class Plot:
    """Curves in a box of 100 by 100, as points of SVG, by `with_scatter` and `without_scatter`.

    across, along : lengths of the axes in words
    """

    lines: Mapping[str, str]
    across: str
    along: str


def plots(motion: Mapping[str, Any]) -> dict[str, Plot]:
    """Displacement and speed against time, and the cycle: speed against displacement."""
    units = {"time_s": "s", "displacement_m": "m", "velocity_m_per_s": "m s-1"}
    box = {}
    for name in units:
        values = [value for curve in motion.values() for value in curve[name]]
        box[name] = min(values), max(max(values) - min(values), 1e-300)
    drawn = {}
    for title, x, y in (
        ("displacement", "time_s", "displacement_m"),
        ("speed", "time_s", "velocity_m_per_s"),
        ("cycle", "displacement_m", "velocity_m_per_s"),
    ):
        lines = {
            kind: " ".join(
                f"{100 * (a - box[x][0]) / box[x][1]:.4g},{100 - 100 * (b - box[y][0]) / box[y][1]:.4g}"
                for a, b in zip(curve[x], curve[y], strict=True)
            )
            for kind, curve in motion.items()
        }
        drawn[title] = Plot(lines, *(amount(box[axis][1], units[axis], SURE) for axis in (x, y)))
    return drawn


def friction_curve(scene: Mapping[str, Any]) -> str:
    """The friction curve of a scene in a sentence."""
    oscillator, record = scene["oscillator"], (scene.get("friction") or {}).get("record")
    if record:
        several = len(record["file"]) > 1
        return f"The curve is that of the record{'s' if several else ''} {', '.join(record['file'])}."
    static = f"{digits(oscillator['static_friction'])} at rest"
    if oscillator["law"] == "table":
        speed, last = oscillator["friction_table"][-1]
        return f"The curve is the friction_table of the scene: {static}, {digits(last)} at {amount(speed, 'm s-1')}."
    return f"The curve is the law {oscillator['law']}: {static}."


def on_the_map(answer: Mapping[str, Any], ranges: Mapping[str, tuple[float, float]]) -> str:
    """Where the scene and its limits lie on the map. ranges : first and last value by the parameter of an axis"""
    sentences = []
    for name, (first, last) in ranges.items():
        if name not in answer["limits"]:
            continue
        parameter, sign = answer["limits"][name], symbol(answer["limits"], name)
        own, unit = parameter["value"], parameter["unit"]
        edges = f"{amount(first, unit, like=own or last)} to {amount(last, unit, like=own or last)}"
        limit = nearest_limit(answer, parameter)
        text = f"Along {sign} the scene lies at {amount(own, unit)} of {edges}"
        if limit is None:
            sentences.append(f"{text}, and stick-slip has no limit within a factor of 100.")
            continue
        inside = "inside" if first <= limit["value"] <= last else "beyond the edge of"
        verb = "ends" if answer["probability"]["value"] > 0.5 else "begins"
        at = amount(limit["value"], unit, like=own or last)
        sentences.append(f"{text}, and stick-slip {verb} at {at}, {inside} the map.")
    return " ".join(sentences)
