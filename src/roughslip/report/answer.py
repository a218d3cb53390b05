"""The answer on stick-slip in plain sentences and as rows of a table, for the page and the terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

Number = Mapping[str, Any]
UNITS = {"1": "", "m s-1": " m/s", "N m-1": " N/m"}
SMALL = {"m": ((1e-3, " mm"), (1e-6, " µm"), (1e-9, " nm"))}  # units for readers, by the SI unit
SIDES = ("below", "above")
LABELS = {"0.05": "It is below 5 %", "0.95": "above 95 %"}
OUTSIDE = " (outside the measured speeds)"
WORDS = {"mean curve": "The mean friction curve decides", "scatter": "The scatter of friction decides"}


def digits(value: float, width: float = 0.0) -> str:
    """Three significant digits, or as many as show two of the width of an interval, without an exponent."""
    places = 2 - math.floor(math.log10(abs(value))) if value else 0
    if width > 0.0:
        places = max(places, 1 - math.floor(math.log10(width)))
    return f"{round(value, places):,.{max(places, 0)}f}" if width else f"{round(value, places):,.12g}"


def shown(number: Number) -> str:
    """`0.199 [0.190, 0.210]` with its unit; the word `open` for an end of the interval beyond the search."""
    value, unit = number["value"], UNITS.get(number["unit"], f" {number['unit']}")
    factor = 1.0
    for scale, name in SMALL.get(number["unit"], ()):
        if abs(value) < 1000 * scale:
            factor, unit = 1.0 / scale, name
    if number["interval"] is None:
        return f"{digits(factor * value)}{unit}"
    known = [end for end in number["interval"] if end is not None] or [value]
    width = factor * (max(*known, value) - min(*known, value))
    ends = ("open" if end is None else digits(factor * end, width) for end in number["interval"])
    return f"{digits(factor * value, width)}{unit} [{', '.join(ends)}]"


def percent(number: Number) -> str:
    """A probability or a relative change as `98 % [93, 99]`."""
    ends = ", ".join("open" if end is None else f"{100 * end:.0f}" for end in number["interval"])
    return f"{100 * number['value']:.0f} % [{ends}]"


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


def limit_rows(answer: Mapping[str, Any]) -> list[dict[str, str]]:
    """A row a parameter: its value in the scene, where stick-slip is practically excluded or certain, and the limits
    without scatter."""
    rows = []
    for parameter in answer["limits"].values():
        ends = [parameter[side]["without_scatter"] for side in SIDES]
        low, high = (digits(end) for end in parameter["searched"]["interval"])
        whole = {label: f"{'all' if _holds(answer, label) else 'none'} from {low} to {high}" for label in LABELS}
        rows.append(
            {
                "parameter": parameter["title"],
                "scene": shown(parameter),
                "excluded": " and ".join(regions(parameter, "0.05")) or whole["0.05"],
                "certain": " and ".join(regions(parameter, "0.95")) or whole["0.95"],
                "without_scatter": " and ".join(shown(end) for end in ends if end["value"] is not None) or "none",
            }
        )
    return rows


def summary(answer: Mapping[str, Any]) -> list[str]:
    """Three lines: how likely stick-slip is, how the mass moves; its limits; the smallest change and what decides."""
    return [_probability(answer), _limits(answer), f"{_change(answer)} {_decision(answer['decides'])}"]


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
        return f"{line} Too few runs show a cycle to give its amplitude and frequency."
    scatter = [shown(answer[f"{name}_scatter"] | {"interval": None}) for name in ("amplitude", "frequency")]
    return (
        f"{line} Its cycle has an amplitude of {shown(answer['amplitude'])}, scattering by {scatter[0]}, and a "
        f"frequency of {shown(answer['frequency'])}, scattering by {scatter[1]}."
    )


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


def _decision(decides: Mapping[str, Any]) -> str:
    line = WORDS.get(decides["by"], "The mean friction curve and its scatter decide together")
    limit, width = decides["existence_limit"]["value"], decides["band_over_distance"]["value"]
    if limit is None:
        return f"{line}: without scatter no existence limit is found."
    line += f": without scatter the cycle exists up to D = {digits(limit)}"
    if width is None:
        return f"{line}."
    return f"{line}; from 95 to 5 % it is {digits(width)} times as far as from the scene to that limit."


def _joined(parts: Sequence[str], last: str = " and ") -> str:
    return last.join([part for part in (", ".join(parts[:-1]), *parts[-1:]) if part])
