"""Answer and budget in words, in units and digits that a reader takes in: one set for the page and the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from roughslip.probability.estimate import TAILS

Number = Mapping[str, Any]
# Units for readers, the largest first, by the SI unit. One below 1 is taken from a tenth of it on: 0.13 mm, not 130 µm.
SCALES = {
    "1": ((1.0, ""),),
    "m": ((1.0, " m"), (1e-3, " mm"), (1e-6, " µm"), (1e-9, " nm")),
    "m s-1": ((1.0, " m/s"), (1e-3, " mm/s"), (1e-6, " µm/s")),
    "N m-1": ((1e6, " kN/mm"), (1e3, " N/mm"), (1.0, " N/m")),
    "N": ((1e3, " kN"), (1.0, " N"), (1e-3, " mN")),
    "kg": ((1.0, " kg"), (1e-3, " g")),
    "Hz": ((1e3, " kHz"), (1.0, " Hz")),
    "s": ((86400.0, " days"), (3600.0, " h"), (60.0, " min"), (1.0, " s"), (1e-3, " ms")),
}
SIDES = ("below", "above")
CERTAIN, EXCLUDED = 0.95, 0.05  # probabilities from which stick-slip is said to occur, or not to
DECIDES = {"mean curve": "The mean friction curve decides", "scatter": "The scatter of friction decides"}
STATES = {"stick-slip": "stick_slip", "steady sliding": "sliding"}
SURE = 2  # digits of amplitude, frequency and times, which are as sure as the inputs
CHANGES = {  # downwards, upwards
    "damping": ("less damping, D", "more damping, D"),
    "belt_velocity": ("slower belt", "faster belt"),
    "mass": ("lighter mass", "heavier mass"),
    "stiffness": ("softer spring", "stiffer spring"),
    "load": ("less normal force", "more normal force"),
}
REACH = 100.0  # factor up to which limits are searched: the full length of a bar
WIDE = 1.5  # factor from which a change is given as one, not in per cent
SCATTER = "scatter of friction"  # as a source in the budget
NEVER = 1e-12  # [1/s] of a rate: once in thirty thousand years


def digits(value: float, places: int = 3) -> str:
    """Three significant digits at most, without an exponent."""
    first = math.floor(math.log10(abs(value))) if value and math.isfinite(value) else 0
    return f"{round(value, places - 1 - first) if math.isfinite(value) else value:,.12g}"


def scale(value: float, unit: str) -> tuple[float, str]:
    """The unit for readers of a value in SI, and its size in SI."""
    scales = SCALES.get(unit, ((1.0, f" {unit}"),))
    fitting = (pair for pair in scales if abs(value) >= pair[0] * (0.1 if pair[0] <= 1.0 else 1.0))
    return (1.0, scales[[size for size, _ in scales].index(1.0)][1]) if value == 0.0 else next(fitting, scales[-1])


def amount(value: float, unit: str, places: int = 3, like: float | None = None) -> str:
    """`0.308 kN`. like : the value whose unit for readers is taken"""
    size, name = scale(value if like is None else like, unit)
    return f"{digits(value / size, places)}{name}"


def ends(number: Number, like: float, places: int = 3) -> str:
    """`0.19 to 0.21`, without the unit; empty without an interval, or where its ends are written as the value is."""
    size, _ = scale(like, number["unit"])
    if number["interval"] is None:
        return ""
    shown = ["open" if end is None else digits(end / size, places) for end in number["interval"]]
    return "" if set(shown) == {digits(number["value"] / size, places)} else " to ".join(shown)


def percent(number: Number) -> str:
    """A probability or a relative change as `98 % [93, 99]`."""
    inner = ["open" if end is None else f"{100 * end:.0f}" for end in number["interval"]]
    value = f"{100 * number['value']:.0f}"
    return f"{value} %" if set(inner) == {value} else f"{value} % [{', '.join(inner)}]"


def answer_summary(answer: Mapping[str, Any]) -> list[str]:
    """Three lines: whether it stick-slips and how it moves; what would change that; what decides."""
    found = verdict(answer)
    moves = "; ".join(f"{title} {number}{f' ({note})' if note else ''}" for title, number, note in facts(answer))
    others = "; ".join(f"{row.name}, {row.change}, to {row.there}" for row in change_rows(answer)[1:] if row.needed)
    return [
        f"Stick-slip: {found['word'].lower()}, {chance(answer)}. {found['text']} {moves[0].upper()}{moves[1:]}.",
        f"{smallest_change(answer)}{f' Others: {others}.' if others else ''}",
        decision(answer["decides"]),
    ]


def chance(answer: Mapping[str, Any]) -> str:
    """The probability of stick-slip, of both starts where they differ."""
    text = percent(answer["probability"])
    if answer["starts_differ"]:
        text += f" from rest, {percent(answer['probability_from_sliding'])} from sliding"
    return f"{text}, outside the measured speeds" if answer.get("outside_measured_speeds") else text


def aim(answer: Mapping[str, Any]) -> str:
    """What a change would do to stick-slip: end it where it is likely, or else begin it."""
    return "ends" if answer["probability"]["value"] > 0.5 else "begins"


def smallest_change(answer: Mapping[str, Any]) -> str:
    """The smallest change of one parameter that ends stick-slip or begins it."""
    row = change_rows(answer)[0]
    if not row.needed:
        return f"No change of one parameter within a factor of 100 {aim(answer)} it."
    return f"The smallest change that {aim(answer)} it: {row.name}, {row.change}, from {row.now} to {row.there}."


def decision(decides: Mapping[str, Any]) -> str:
    """What decides, up to which damping the cycle exists without scatter, and how much scatter blurs that limit."""
    line = DECIDES.get(decides["by"], "The mean friction curve and its scatter decide together")
    limit, width = decides["existence_limit"]["value"], decides["band_over_distance"]["value"]
    if limit is None:
        return f"{line}: without scatter no existence limit is found."
    line += f": without scatter the cycle exists up to D = {digits(limit)}"
    return f"{line}." if width is None else f"{line}. Scatter blurs the limit by {digits(100 * width, SURE)} %."


def joined(parts: Sequence[str], last: str = " and ") -> str:
    """`a, b and c`."""
    return last.join([part for part in (", ".join(parts[:-1]), *parts[-1:]) if part])


@dataclass(frozen=True)
class Row:
    """A parameter in the table of what would end or begin stick-slip.

    name, now : the change in words, the scene's value
    needed, interval : the value at which stick-slip ends or begins, and its interval; empty without a limit
    change : factor or per cent
    far : logarithm of the change [% of the search]
    is_smallest : of all relative changes
    outside : whether the limit lies beyond the measured speeds
    """

    name: str
    now: str
    needed: str = ""
    interval: str = ""
    change: str = ""
    far: float = 0.0
    is_smallest: bool = False
    outside: bool = False

    @property
    def there(self) -> str:
        """The needed value with its interval."""
        notes = [part for part in (self.interval, "beyond the measured speeds" if self.outside else "") if part]
        return f"{self.needed} ({', '.join(notes)})" if notes else self.needed


def nearest_limit(answer: Mapping[str, Any], parameter: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Where along a parameter stick-slip ends, where it is likely, or else begins, nearest to the scene's value."""
    label = "0.05" if aim(answer) == "ends" else "0.95"
    near = [parameter[side][label] for side in SIDES if parameter[side][label] is not None]
    own = parameter["value"] or 1.0
    return min(near, key=lambda limit: abs(math.log(limit["value"] / own)), default=None)


def change_rows(answer: Mapping[str, Any]) -> list[Row]:
    """A row a parameter, the smallest change first; without a limit it has no change."""
    smallest, ranked = answer["smallest_change"] or {"parameter": None}, []
    for name, parameter in answer["limits"].items():
        own, unit = parameter["value"], parameter["unit"]
        title = parameter["title"] if name == "damping" else parameter["title"].rpartition(" ")[0]
        limit = nearest_limit(answer, parameter)
        if limit is None or not own:
            ranked.append((math.inf, Row(title, amount(own, unit))))
            continue
        way = math.log(limit["value"] / own)
        row = Row(
            CHANGES[name][way > 0.0],
            amount(own, unit),
            amount(limit["value"], unit, like=own),
            ends(limit, own),
            factor(limit["value"] / own),
            100.0 * min(abs(way) / math.log(REACH), 1.0),
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
        needed = answer["needs"]["value"]
        text = "The runs are too short to tell: they still depend on how they start. " + (
            f"Set answer.duration_periods to {digits(needed)}, the time of its {answer['needs']['scale']}."
            if needed
            else "No damping ends its transients."
        )
        return {"word": "Not decided", "kind": "odd", "text": text}
    if answer["starts_differ"]:
        text = "It stick-slips once it has been at rest, and goes on sliding where it slides at first."
        return {"word": "After a stop", "kind": "bad" if rest >= CERTAIN else "odd", "text": text}
    if rest >= CERTAIN:
        text = "It stick-slips, whether it starts from rest or from sliding."
        return {"word": "Yes", "kind": "bad", "text": text}
    if rest <= EXCLUDED:
        text = "It slides steadily, whether it starts from rest or from sliding."
        return {"word": "No", "kind": "good", "text": text}
    share = "more" if min(rest, sliding) > 0.5 else "less"
    text = f"Stick-slip ends and begins again: it takes {share} than half of the time."
    return {"word": "At times", "kind": "odd", "text": text}


def facts(answer: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Title, number and a note on it: how the mass moves, how long its states last, its friction."""
    stiffness, mass = (answer["limits"][name]["value"] for name in ("stiffness", "mass"))
    own = amount(math.sqrt(stiffness / mass) / (2 * math.pi), "Hz", SURE)
    lines = []
    if answer["amplitude"]["value"] is not None:
        for title, name in (("half of peak to peak", "amplitude"), ("frequency", "frequency")):
            size, part = answer[name], answer[f"{name}_scatter"]["value"] / answer[name]["value"]
            more = f"; own frequency {own}" if name == "frequency" else ""
            note = f"scatters by {digits(100 * part, 1)} %{more}"
            lines.append((title, amount(size["value"], size["unit"], SURE), note))
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
        number = f"{value:.0f} %"
        is_wide = low is not None and high is not None and {f"{low:.0f} %", f"{high:.0f} %"} != {number}
        notes = [f"{low:.0f} to {high:.0f} %"] if is_wide else []
    notes += [f"in the mean {joined(durations)}"] if durations else []
    return "time in stick-slip", number, "; ".join(notes)


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


def budget_summary(budget: Mapping[str, Any]) -> list[str]:
    """Sentences: the averaged probability, limits with their intervals, rates, what to measure next."""
    given, mean = budget["answer"]["value"], budget["probability"]["mean"]
    first = f"Stick-slip has a probability of {100 * given:.0f} % at the given values, and of {100 * mean:.0f} % "
    limits, symbols = [], {"damping": "D", "belt_velocity": "v0", "mass": "m", "stiffness": "k", "load": "N"}
    for name, limit in budget["limits"].items():
        number = {**limit, "unit": budget["units"][name]}
        beyond = f", {100 * limit['beyond']:.0f} % of them beyond a factor of ten" if limit["beyond"] > TAILS[0] else ""
        value, interval = limit["value"], f"{ends(number, limit['value'])}{beyond}".removeprefix(", ")
        limits.append(f"{symbols[name]} = {amount(value, number['unit'])}{f' ({interval})' if interval else ''}")
    second = f"The limits of the cycle without scatter, with 95 % intervals of what is uncertain: {joined(limits)}."
    return [
        f"{first}averaged over what is uncertain.",
        second,
        rates_in_words(budget["rates"]),
        next_to_measure(budget),
    ]


def rates_in_words(rates: Mapping[str, Any]) -> str:
    """How often stick-slip ends and begins."""
    if not rates:
        return "How often stick-slip ends and begins is not computed: slip makes no chain of loops here."
    words = {"death": ("ends", "a second"), "birth": ("begins", "a second of sliding")}
    shown = []
    for name, (verb, unit) in words.items():
        mean, (low, high) = rates[name]["mean"], rates[name]["interval"]
        often = f"{mean:.2g} times ({low:.2g} to {high:.2g}) {unit}" if mean > NEVER else "practically never"
        shown.append(f"{verb} {often}")
    return f"Averaged over what is uncertain, by theory, stick-slip {joined(shown)}."


def is_sure(budget: Mapping[str, Any]) -> bool:
    """Whether the averaged probability is so near 0 or 1 that the margin is what is left to know."""
    mean = float(budget["probability"]["mean"])
    return max(mean, 1.0 - mean) > CERTAIN


def bars(budget: Mapping[str, Any]) -> list[tuple[str, float]]:
    """Source and its part [%], the largest first: of the outcome, or of the limit in damping where that is sure."""
    if is_sure(budget):
        parts = {name: max(first[0], 0.0) for name, first in budget["limits"]["damping"]["first"].items()}
    else:
        parts = {**budget["outcome"], SCATTER: budget["scatter"]}
    return sorted(((name, 100.0 * min(part, 1.0)) for name, part in parts.items()), key=lambda one: -one[1])


def next_to_measure(budget: Mapping[str, Any]) -> str:
    """The source whose exact knowledge takes away most, and how much."""
    rows: Sequence[tuple[str, float]] = bars(budget)
    known = [row for row in rows if row[0] != SCATTER and row[1] > 0.0]
    if not known:
        return "No number that the scene gives with an uncertainty matters here."
    (name, part), word = known[0], "the limit in damping" if is_sure(budget) else "whether it stick-slips"
    sentence = f"Measure the {name} next: known exactly, it takes away {digits(part, SURE)} % of the variance of {word}"
    if is_sure(budget):
        return f"That is sure enough. {sentence}."
    kept = digits(100 * budget["scatter"], SURE)
    return f"{sentence}; the scatter of friction keeps {kept} %, and no measurement takes that away."
