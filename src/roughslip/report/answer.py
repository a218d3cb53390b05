"""The answer on stick-slip in words and as the parts of a page, in units and digits that a reader takes in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

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
LABELS = {"0.05": "It is below 5 %", "0.95": "above 95 %"}
OUTSIDE = " (outside the measured speeds)"
WORDS = {"mean curve": "The mean friction curve decides", "scatter": "The scatter of friction decides"}
CHANGES = {  # downwards, upwards
    "damping": ("less damping, D", "more damping, D"),
    "belt_velocity": ("slower belt", "faster belt"),
    "mass": ("lighter mass", "heavier mass"),
    "stiffness": ("softer spring", "stiffer spring"),
    "load": ("less normal force", "more normal force"),
}
REACH = 100.0  # factor up to which limits are searched: the full length of a bar
SURE = 2  # digits of amplitude, frequency and times, which are as sure as the inputs
WIDE = 1.5  # factor from which a change is given as one, not in per cent


def digits(value: float, places: int = 3) -> str:
    """Three significant digits at most, without an exponent."""
    first = math.floor(math.log10(abs(value))) if value and math.isfinite(value) else 0
    return f"{round(value, places - 1 - first) if math.isfinite(value) else value:,.12g}"


def scale(value: float, unit: str) -> tuple[float, str]:
    """The unit for readers of a value in SI, and its size in SI."""
    scales = SCALES.get(unit, ((1.0, f" {unit}"),))
    fitting = (one for one in scales if abs(value) >= one[0] * (0.1 if one[0] <= 1.0 else 1.0))
    return (1.0, scales[[one[0] for one in scales].index(1.0)][1]) if value == 0.0 else next(fitting, scales[-1])


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


def shown(number: Number) -> str:
    """`20 mm/s [19, 21]` in three digits at most; the word `open` for an end of the interval beyond the search."""
    interval = ends(number, number["value"]).replace(" to ", ", ")
    return f"{amount(number['value'], number['unit'])}{f' [{interval}]' if interval else ''}"


def percent(number: Number) -> str:
    """A probability or a relative change as `98 % [93, 99]`."""
    inner = ["open" if end is None else f"{100 * end:.0f}" for end in number["interval"]]
    value = f"{100 * number['value']:.0f}"
    return f"{value} %" if set(inner) == {value} else f"{value} % [{', '.join(inner)}]"


def symbol(limits: Mapping[str, Any], name: str) -> str:
    """The last word of a parameter's title."""
    return str(limits[name]["title"].rpartition(" ")[2])


def regions(parameter: Mapping[str, Any], label: str) -> list[str]:
    """Where, along one parameter, the probability lies below 5 % (label 0.05) or above 95 % (label 0.95)."""
    limits = []
    for side in SIDES:
        if (limit := parameter[side][label]) is not None:
            beyond = limit["change"] == ("falls below" if label == "0.05" else "rises above")
            word = side if beyond else {"above": "up to", "below": "down to"}[side]
            outside = OUTSIDE if limit.get("outside_measured_speeds") else ""
            limits.append(f"{word} {shown(limit)}{outside}")
    return limits


def summary(answer: Mapping[str, Any]) -> list[str]:
    """Three lines: how likely stick-slip is, how the mass moves; its limits; the smallest change and what decides."""
    return [_probability(answer), _limits(answer), f"{_change(answer)} {decision(answer['decides'])}"]


def _probability(answer: Mapping[str, Any]) -> str:
    number = answer["probability"]
    certain, excluded = number["value"] >= 0.95, number["value"] <= 0.05
    word = "practically certain" if certain else "practically excluded" if excluded else "possible"
    values = [f"{symbol(answer['limits'], name)} = {shown(parameter)}" for name, parameter in answer["limits"].items()]
    line = f"Stick-slip is {word} ({percent(number)}) at {_joined(values)}"
    slid = percent(answer["probability_from_sliding"])
    line += OUTSIDE if answer.get("outside_measured_speeds") else ""
    line += f"; {slid} if the mass slides steadily at first.{_memory_of_the_start(answer)}"
    if answer["amplitude"]["value"] is None:
        return line
    size, rate = (amount(answer[name]["value"], answer[name]["unit"], SURE) for name in ("amplitude", "frequency"))
    spread = f"{scatter(answer, 'amplitude')} and {scatter(answer, 'frequency')}"
    return (
        f"{line} Its cycle has an amplitude, half of peak to peak, of {size} and a frequency of {rate}; these scatter "
        f"by {spread}."
    )


def scatter(answer: Mapping[str, Any], name: str) -> str:
    """Standard deviation of amplitude or frequency over its mean: `0.3 %`."""
    return f"{digits(100 * answer[f'{name}_scatter']['value'] / answer[name]['value'], 1)} %"


def _memory_of_the_start(answer: Mapping[str, Any]) -> str:
    """What a difference between runs from rest and from steady sliding says."""
    if not answer["starts_differ"]:
        return ""
    if not answer["decided"]:
        needed = answer["needs"]["value"]
        time = (
            f"set answer.duration_periods to {digits(needed)}, the time of its {answer['needs']['scale']}"
            if needed
            else ""
        )
        longer = time or "no damping ends its transients"
        periods = digits(answer["periods"]["value"])
        return f" Not decided: a run of {periods} natural periods still depends on its start; {longer}."
    minimum = {
        word: answer[name]["interval"][0]
        for word, name in (("stick-slip", "stick_slip_lifetime"), ("steady sliding", "sliding_lifetime"))
        if answer[name]["value"] is not None or answer[name]["interval"] is not None
    }
    bounds = _joined([f"{word} at least {digits(round(value))}" for word, value in minimum.items()])
    return f" The start decides, because both states live longer than a run: {bounds} natural periods in the mean."


def _holds(answer: Mapping[str, Any], label: str) -> bool:
    """Whether the probability at the scene's point is below 5 % (label 0.05) or above 95 % (label 0.95)."""
    value = float(answer["probability"]["value"])
    return value <= 0.05 if label == "0.05" else value > 0.95


def _limits(answer: Mapping[str, Any]) -> str:
    limits, parts = answer["limits"], []
    for label, text in LABELS.items():
        ranges = [f"{symbol(limits, name)} {region}" for name in limits for region in regions(limits[name], label)]
        none = [symbol(limits, name) for name in limits if not regions(limits[name], label)]
        if not ranges:
            parts.append(f"{text} {'everywhere' if _holds(answer, label) else 'nowhere'} in the search")
            continue
        rest = f" (no limit of {_joined(none, ' or ')} within the search)" if none else ""
        parts.append(f"{text} for {_joined(ranges, ' or ')}{rest}")
    return f"{'; '.join(parts)}."


def _change(answer: Mapping[str, Any]) -> str:
    change = answer["smallest_change"]
    if change is None:
        aim = "ends" if answer["probability"]["value"] > 0.5 else "begins"
        return f"No change of one parameter within the search {aim} stick-slip."
    title = answer["limits"][change["parameter"]]["title"]
    sign = "+" if change["value"] > 0 else ""
    return f"The smallest relative change that {change['aim']}s stick-slip is {sign}{percent(change)} of the {title}."


def decision(decides: Mapping[str, Any]) -> str:
    """What decides, up to which damping the cycle exists without scatter, and how much scatter blurs that limit."""
    line = WORDS.get(decides["by"], "The mean friction curve and its scatter decide together")
    limit, width = decides["existence_limit"]["value"], decides["band_over_distance"]["value"]
    if limit is None:
        return f"{line}: without scatter no existence limit is found."
    line += f": without scatter the cycle exists up to D = {digits(limit)}"
    return f"{line}." if width is None else f"{line}. Scatter blurs the limit by {digits(100 * width, SURE)} %."


def _joined(parts: Sequence[str], last: str = " and ") -> str:
    return last.join([part for part in (", ".join(parts[:-1]), *parts[-1:]) if part])


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
    return min(near, key=lambda one: abs(math.log(one["value"] / own)), default=None)


def change_rows(answer: Mapping[str, Any]) -> list[Row]:
    """A row a parameter, the smallest change first; without a limit it has no change."""
    smallest, found = answer["smallest_change"] or {"parameter": None}, []
    for name, parameter in answer["limits"].items():
        own, unit = parameter["value"], parameter["unit"]
        sign = symbol(answer["limits"], name)
        title = parameter["title"] if name == "damping" else parameter["title"].rpartition(" ")[0]
        limit = nearest_limit(answer, parameter)
        if limit is None or not own:
            found.append((math.inf, Row(title, sign, amount(own, unit))))
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
        found.append((0.0 if row.is_smallest else abs(way), row))
    return [row for _, row in sorted(found, key=lambda one: one[0])]


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
    period = 2 * math.pi * math.sqrt(mass / stiffness)
    own = amount(1 / period, "Hz", SURE)
    found = []
    if answer["amplitude"]["value"] is not None:
        sizes = {name: amount(answer[name]["value"], answer[name]["unit"], SURE) for name in ("amplitude", "frequency")}
        found.append(("half of peak to peak", sizes["amplitude"], f"scatters by {scatter(answer, 'amplitude')}"))
        found.append(
            ("frequency", sizes["frequency"], f"scatters by {scatter(answer, 'frequency')}; own frequency {own}")
        )
    else:
        found.append(("own frequency", own, "there is no cycle of stick-slip"))
    return [*found, *_states(answer, period), ("mean friction", *_friction(answer))]


def _friction(answer: Mapping[str, Any]) -> tuple[str, str]:
    mean, deviation = (answer[f"friction_{name}"]["value"] for name in ("mean", "deviation"))
    return digits(mean), f"one contact window scatters by {digits(100 * deviation / mean, SURE)} %"


def _states(answer: Mapping[str, Any], period: float) -> list[tuple[str, str, str]]:
    """Time in stick-slip, and the mean duration of each state; of runs where no states were computed."""
    if states := answer.get("states"):
        value, low, high = (100 * one for one in states["share_of_time"])
        spells = [
            f"{word} lasts {amount(states[name], 's', SURE)}"
            for word, name in (("stick-slip", "mean_stick_slip_s"), ("sliding", "mean_sliding_s"))
            if states.get(name) is not None
        ]
        note = f"{low:.0f} to {high:.0f} %" + (f"; in the mean {_joined(spells)}" if spells else "")
        return [("time in stick-slip", f"{value:.0f} %", note)]
    bounds = [
        f"{word} lasts at least {amount(answer[name]['interval'][0] * period, 's', SURE)}"
        for word, name in (("stick-slip", "stick_slip_lifetime"), ("sliding", "sliding_lifetime"))
        if answer[name]["interval"] is not None
    ]
    number = percent(answer["probability"]).partition(" [")[0]
    return [("time in stick-slip", number, f"in the mean {_joined(bounds)}" if bounds else "of runs from rest")]


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


def friction_curve(oscillator: Mapping[str, Any]) -> str:
    """The friction curve of a scene in a sentence. oscillator : its section"""
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
