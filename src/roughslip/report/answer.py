"""The answer on stick-slip in words, in units and digits that a reader takes in."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
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
OUTSIDE = " (not identified: outside the measured speeds)"
WORDS = {"mean curve": "The mean friction curve decides", "scatter": "The scatter of friction decides"}
STATES = {"stick-slip": "stick_slip", "steady sliding": "sliding"}
SURE = 2  # digits of amplitude, frequency and times, which are as sure as the inputs


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
    line = f"Stick-slip is {word} ({percent(number)}) at {joined(values)}"
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
    minimum = {word: answer["states"][f"mean_{name}_s"][1] for word, name in STATES.items()}
    bounds = joined(
        [f"{word} at least {amount(time, 's', SURE)}" for word, time in minimum.items() if time is not None]
    )
    return f" The start decides, because both states live longer than a run: {bounds} in the mean."


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
        rest = f" (no limit of {joined(none, ' or ')} within the search)" if none else ""
        parts.append(f"{text} for {joined(ranges, ' or ')}{rest}")
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


def joined(parts: Sequence[str], last: str = " and ") -> str:
    """`a, b and c`."""
    return last.join([part for part in (", ".join(parts[:-1]), *parts[-1:]) if part])
