"""An answer in words, in units and digits that a reader takes in: one set for the page and the terminal."""

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
CERTAIN, EXCLUDED = 0.95, 0.05  # probabilities from which a state is said to occur, or not to
VIBRATES = "No, but it vibrates"
DECIDES = {"mean curve": "The mean friction curve decides", "scatter": "The scatter of friction decides"}
DOES = {"stick_slip": "stick-slips", "vibration": "vibrates without sticking", "sliding": "slides steadily"}
GOES_ON = {"stick_slip": "begins to stick-slip", "vibration": "vibrates without sticking", "sliding": "goes on sliding"}
SURE = 2  # digits of amplitude, frequency and times, which are as sure as the inputs
CHANGES = {  # downwards, upwards
    "damping": ("less damping, D", "more damping, D"),
    "belt_velocity": ("slower belt", "faster belt"),
    "mass": ("lighter mass", "heavier mass"),
    "stiffness": ("softer spring", "stiffer spring"),
    "load": ("less normal force", "more normal force"),
    "memory_length": ("shorter memory", "longer memory"),
    "direct_effect": ("less direct effect, a", "more direct effect, a"),
    "ageing_effect": ("less ageing, b", "more ageing, b"),
}
SAME = 1e-3  # relative, of two limits that are one
REACH = 100.0  # factor up to which limits are searched: the full length of a bar
NEAR = 0.02  # relative, of a limit to that of steady sliding, which it then is
WIDE = 1.5  # factor from which a change is given as one, not in per cent


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
    rows = [row for row in change_rows(answer) if row.needed and not row.is_smallest]
    others = "; ".join(f"{row.name}, {row.change}, to {row.there}" for row in rows)
    said = " ".join(part for part in (found["text"], other_chances(answer)) if part)
    return [
        f"Stick-slip: {found['word'].lower()}, {chance(answer)}. {said} {moves[0].upper()}{moves[1:]}.",
        f"{smallest_change(answer)}{f' Others: {others}.' if others else ''}",
        decision(answer["decides"]),
    ]


def chance(answer: Mapping[str, Any]) -> str:
    """The probability of stick-slip, of runs from rest where the start matters."""
    text = percent(answer["shares"]["from_rest"]["stick_slip"])
    text += " from rest" if answer["starts_differ"] else ""
    return f"{text}, outside the measured speeds" if answer.get("outside_measured_speeds") else text


def other_chances(answer: Mapping[str, Any]) -> str:
    """Shares of runs below the probability in the head, of vibration and from sliding."""
    lines, vibrates = [], any(shares["vibration"]["value"] > 0.0 for shares in answer["shares"].values())
    for start, shares in answer["shares"].items():
        differs = start == "from_sliding" and answer["starts_differ"]
        parts = [f"{percent(shares['stick_slip'])} of the runs stick-slip"] if differs else []
        if vibrates and (start == "from_rest" or differs):
            parts.append(f"{percent(shares['vibration'])} {'' if differs else 'of the runs '}vibrate without sticking")
        lines += [f"{start.replace('_', ' ').capitalize()}, {joined(parts)}."] if parts else []
    return " ".join(lines)


def aim(answer: Mapping[str, Any]) -> tuple[str, str]:
    """What a change would do, `ends` or `begins`, and to which state: it ends what is likely, or begins stick-slip."""
    shares = answer["shares"]["from_rest"]
    state = "vibration" if shares["vibration"]["value"] > 0.5 else "stick-slip"
    return "ends" if max(shares["stick_slip"]["value"], shares["vibration"]["value"]) > 0.5 else "begins", state


def smallest_change(answer: Mapping[str, Any]) -> str:
    """The smallest change of one parameter that ends stick-slip or the vibration, or begins stick-slip.

    Near the Hopf limit D / N alone counts, so that damping and normal force are one change there.
    """
    verb, state = aim(answer)
    state = "the vibration" if state == "vibration" else "it"
    shown = [
        f"{row.name}, {row.change}, from {row.now} to {row.there}" for row in change_rows(answer) if row.is_smallest
    ]
    if not shown:
        where = "in its range" if answer.get("can_change") else "within a factor of 100"
        return f"No change of one parameter {where} {verb} {state}."
    if len(shown) == 1:
        return f"The smallest change that {verb} {state}: {shown[0]}."
    text = f"The smallest changes that {verb[:-1]} {state}, of the same factor: {joined(shown, '; or ')}."
    names, hopf = {change["parameter"] for change in answer["smallest_changes"]}, answer["decides"]["hopf_damping"]
    limit = nearest_limit(answer, "damping") if {"damping", "load"} <= names else None
    if limit is not None and hopf["value"] > 0.0 and abs(math.log(limit["value"] / hopf["value"])) < NEAR:
        text += (
            " Damping and normal force are one change there: D / N decides where steady sliding loses its stability."
        )
    return text


def decision(decides: Mapping[str, Any]) -> str:
    """What decides, up to which damping the cycle exists without scatter, and how much scatter blurs that limit."""
    line = DECIDES.get(decides["by"], "The mean friction curve and its scatter decide together")
    limit, vibration, width = (
        decides[name]["value"] for name in ("existence_limit", "vibration_limit", "band_over_distance")
    )
    found = "no existence limit is found" if limit is None else f"the cycle exists up to D = {digits(limit)}"
    line += f": without scatter {found}"
    if vibration:
        above = "; the mass" if limit is None else ", and above that the mass"
        line += f"{above} vibrates without sticking up to D = {digits(vibration)}"
    return f"{line}." if width is None else f"{line}. Scatter blurs the limit by {digits(100 * width, SURE)} %."


def joined(parts: Sequence[str], last: str = " and ") -> str:
    """`a, b and c`."""
    return last.join([part for part in (", ".join(parts[:-1]), *parts[-1:]) if part])


@dataclass(frozen=True)
class Row:
    """A parameter in the table of what would end or begin stick-slip.

    name, now : the change in words, the scene's value
    needed : the value at which stick-slip ends or begins; empty without a limit
    notes : its interval; that it lies beyond the measured speeds; where the mass vibrates on the way; that the machine
        does not allow it
    change : factor or per cent
    far : logarithm of the change [% of the search]
    is_smallest : of all relative changes
    """

    name: str
    now: str
    needed: str = ""
    notes: Sequence[str] = ()
    change: str = ""
    far: float = 0.0
    is_smallest: bool = False

    @property
    def there(self) -> str:
        """The needed value with its notes."""
        return f"{self.needed} ({', '.join(self.notes)})" if self.notes else self.needed


def barred(answer: Mapping[str, Any], name: str, value: float) -> str:
    """Why a parameter cannot take a value, by what the scene says; empty where it can."""
    ranges = answer.get("can_change")
    if ranges is None:
        return ""
    if name not in ranges:
        return "cannot change"
    return "" if ranges[name][0] <= value <= ranges[name][1] else "beyond its range"


def nearest_limit(answer: Mapping[str, Any], name: str) -> Mapping[str, Any] | None:
    """Where along a parameter the likely state ends, or else stick-slip begins: the nearest that the machine allows."""
    parameter, (verb, state) = answer["limits"][name], aim(answer)
    label = "unsteady_0.05" if state == "vibration" else "0.05" if verb == "ends" else "0.95"
    near = [limit for side in SIDES if (limit := parameter[side][label]) and limit["value"] is not None]

    def far(limit: Mapping[str, Any]) -> tuple[str, float]:
        change = abs(math.log(limit["value"] / (parameter["value"] or 1.0)))
        return barred(answer, name, limit["value"]), change

    return min(near, key=far, default=None)


def vibrates_on_the_way(answer: Mapping[str, Any], parameter: Mapping[str, Any], side: str) -> str:
    """Where the mass vibrates without sticking after stick-slip ends, or before it begins; empty where it does not."""
    (verb, state), unit = aim(answer), parameter["unit"]
    cycle, steady = (parameter[side][name]["value"] for name in ("without_scatter", "steady_without_scatter"))
    if state == "vibration" or cycle is None or (steady is not None and abs(math.log(steady / cycle)) < SAME):
        return ""
    shown = "" if steady is None else amount(steady, unit, like=parameter["value"] or steady)
    if verb == "ends":
        return f"then it vibrates without sticking{f' as far as {shown}' if shown else ''}"
    return f"it vibrates without sticking from {shown} on" if shown else ""


def change_rows(answer: Mapping[str, Any]) -> list[Row]:
    """A row a parameter, the smallest changes first; without a limit it has no change."""
    smallest, ranked = {change["parameter"] for change in answer["smallest_changes"]}, []
    for name, parameter in answer["limits"].items():
        own, unit = parameter["value"], parameter["unit"]
        title = parameter["title"] if name == "damping" else parameter["title"].rpartition(" ")[0]
        limit = nearest_limit(answer, name)
        if limit is None or not own:
            ranked.append((math.inf, Row(title, amount(own, unit))))
            continue
        way = math.log(limit["value"] / own)
        notes = (
            ends(limit, own),
            "beyond the measured speeds" if limit.get("outside_measured_speeds") else "",
            vibrates_on_the_way(answer, parameter, SIDES[way > 0.0]),
            barred(answer, name, limit["value"]),
        )
        row = Row(
            CHANGES[name][way > 0.0],
            amount(own, unit),
            amount(limit["value"], unit, like=own),
            [note for note in notes if note],
            factor(limit["value"] / own),
            100.0 * min(abs(way) / math.log(REACH), 1.0),
            name in smallest,
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
    rest, sliding = ({state: part["value"] for state, part in one.items()} for one in answer["shares"].values())
    likely, other = max(rest, key=lambda state: rest[state]), max(sliding, key=lambda state: sliding[state])
    stuck, vibrating = rest["stick_slip"], rest["vibration"]
    if answer["starts_differ"] and not answer["decided"]:
        needed = answer["needs"]["value"]
        do = f"Set answer.duration_periods to {digits(needed or 0.0)}, the time of its {answer['needs']['scale']}."
        word, kind, text = "Not decided", "odd", "The runs are too short to tell: they still depend on how they start."
        text += f" {do if needed else 'No damping ends its transients.'}"
    elif answer["starts_differ"] and likely != other:
        word, kind = "After a stop", "bad" if stuck >= CERTAIN else "odd"
        text = f"It {DOES[likely]} once it has been at rest, and {GOES_ON[other]} where it slides at first."
    elif max(rest.values()) >= CERTAIN and not answer["starts_differ"]:
        word, kind = {"stick_slip": ("Yes", "bad"), "vibration": (VIBRATES, "odd"), "sliding": ("No", "good")}[likely]
        text = f"It {DOES[likely]}, whether it starts from rest or from sliding."
        if likely == "sliding" and answer["without_scatter"]["from_rest"]["state"] == "vibration":
            kind, text = "odd", "It slides without sticking; its scatter hides the vibration that it has without it."
    elif stuck <= EXCLUDED < vibrating:
        word, kind = f"{VIBRATES} at times", "odd"
        text = (
            f"It slides without sticking, and vibrates {'more' if vibrating > 0.5 else 'less'} than half of the time."
        )
    else:
        word, kind, most = "At times", "odd", min(stuck, sliding["stick_slip"]) > 0.5
        text = f"Stick-slip ends and begins again: it takes {'more' if most else 'less'} than half of the time."
        if vibrating > EXCLUDED:
            text += f" Without sticking it vibrates {100 * vibrating:.0f} % of the time."
    return {"word": word, "kind": kind, "text": text}


def along_load(answer: Mapping[str, Any]) -> str:
    """What friction does along the load."""
    found = answer.get("friction_over_load")
    if found is None:
        return "Along the load the friction coefficient is held."
    (first, *_, last), forces = found["loads"], found["forces"]
    factors = [digits(force / load, SURE) for load, force in zip(found["loads"], forces, strict=True)]
    return (
        f"Along the load the friction coefficient is that of solved contacts, {factors[0]} times today's at "
        f"{amount(first, 'N', SURE)} and {factors[-1]} times at {amount(last, 'N', SURE)}; its scatter is held "
        "in proportion."
    )


def facts(answer: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Title, number and a note on it: how the mass moves, how long its states last, its friction."""
    stiffness, mass = (answer["limits"][name]["value"] for name in ("stiffness", "mass"))
    own = amount(math.sqrt(stiffness / mass) / (2 * math.pi), "Hz", SURE)
    lines = []
    for of_state, found in (("", answer), ("vibration, ", answer["vibration"])):
        if found["amplitude"]["value"] is None:
            continue
        for title, name in (("half of peak to peak", "amplitude"), ("frequency", "frequency")):
            size, part = found[name], found[f"{name}_scatter"]["value"] / found[name]["value"]
            more = f"; own frequency {own}" if name == "frequency" else ""
            note = f"scatters by {digits(100 * part, 1)} %{more}"
            lines.append((f"{of_state}{title}", amount(size["value"], size["unit"], SURE), note))
    if not lines:
        lines.append(("own frequency", own, "there is no cycle of stick-slip"))
    lines += [_states(answer), ("mean friction", *_friction(answer)), _slope(answer)]
    return [*lines, *_memory(answer)]


def _memory(answer: Mapping[str, Any]) -> list[tuple[str, str, str]]:
    """Break-away friction after the usual stick, the memory length, and the critical stiffness."""
    if (memory := answer.get("memory")) is None:
        return []
    length, stiffness, stick = (memory[name]["value"] for name in ("length", "critical_stiffness", "stick"))
    limit = "unstable" if stiffness is None else "stable"
    limit = f"stable above k_c = {amount(stiffness, 'N m-1')}" if stiffness else f"{limit} for any spring"
    return [
        ("break-away friction", digits(memory["break_away"]["value"]), f"after a stick of {amount(stick, 's', SURE)}"),
        ("memory length D_c", amount(length, "m", SURE), f"steady sliding is {limit}"),
    ]


def _slope(answer: Mapping[str, Any]) -> tuple[str, str, str]:
    """Slope of friction at the belt's velocity, and the damping ratio below which it makes steady sliding unstable."""
    decides, own = answer["decides"], answer["limits"].get("damping")
    limit, lines = decides["hopf_damping"]["value"], decides["hopf_by_lines"]["interval"]
    does = f"unstable below D = {digits(limit)}" if limit > 0.0 else "stable at any D"
    note = f"at the belt's velocity: steady sliding is {does}"
    note += f", and D is {digits(own['value'])}" if own else ""
    shown = [] if lines is None else list(dict.fromkeys(digits(end) for end in lines))
    by_lines = f"; straight lines between the points of the curve give {' to '.join(shown)}" if shown else ""
    return "slope of friction", f"{digits(decides['friction_slope']['value'])} s/m", f"{note}{by_lines}"


def _friction(answer: Mapping[str, Any]) -> tuple[str, str]:
    mean, deviation = (answer[f"friction_{name}"]["value"] for name in ("mean", "deviation"))
    note = f"scatters by {digits(100 * deviation / mean, SURE)} %"
    if (windows := answer["windows"]["value"]) > 1:
        pad = answer["friction_pad_deviation"]["value"]
        note = f"scatters by {digits(100 * pad / mean, SURE)} %; each of its {windows:,.0f} contact windows {note}"
    return digits(mean), note


def _states(answer: Mapping[str, Any]) -> tuple[str, str, str]:
    """Time in stick-slip, of runs from rest where no state was seen to end, and mean durations of the states."""
    states, ended, lasting = answer["states"], [], []
    for word, name in (("stick-slip", "stick_slip"), ("vibration", "vibration"), ("sliding", "sliding")):
        mean, minimum, _ = states[f"mean_{name}_s"]
        if mean is not None:
            ended.append(f"{word} lasts {amount(mean, 's', SURE)}")
        elif minimum is not None:
            lasting.append(f"{word} lasts longer than {amount(minimum, 's', SURE)}")
    value, low, high = (None if part is None else 100 * part for part in states["share_of_time"])
    if value is None:
        number, notes = percent(answer["probability"]).partition(" [")[0], ["of runs from rest"]
    else:
        number = f"{value:.0f} %"
        is_wide = low is not None and high is not None and {f"{low:.0f} %", f"{high:.0f} %"} != {number}
        notes = [f"{low:.0f} to {high:.0f} %"] if is_wide else []
    notes += [f"in the mean {joined(lasting or ended)}"] if lasting or ended else []  # others lead to what lasts
    return "time in stick-slip", number, "; ".join(notes)
