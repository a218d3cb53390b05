"""A budget in words, as `words` has an answer."""

from collections.abc import Mapping
from typing import Any

from roughslip.probability.estimate import TAILS
from roughslip.report.words import CERTAIN, SURE, amount, digits, ends, joined

SCATTER = "scatter of friction"  # as a source in the budget


def budget_summary(budget: Mapping[str, Any]) -> list[str]:
    """Sentences: the averaged probability, limits with their intervals, what to measure next."""
    given, mean = budget["answer"]["value"], budget["probability"]["mean"]
    first = f"Stick-slip has a probability of {100 * given:.0f} % at the given values, and of {100 * mean:.0f} % "
    shown, symbols = {}, {"damping": "D", "belt_velocity": "v0", "mass": "m", "stiffness": "k", "load": "N"}
    for name, limit in budget["limits"].items():
        number = {**limit, "unit": budget["units"][name]}
        beyond = f", {100 * limit['beyond']:.0f} % of them beyond a factor of ten" if limit["beyond"] > TAILS[0] else ""
        value, interval = limit["value"], f"{ends(number, limit['value'])}{beyond}".removeprefix(", ")
        symbol, bracket = symbols.get(name, "D"), f" ({interval})" if interval else ""
        shown[name] = f"{symbol} = {amount(value, number['unit'])}{bracket}"
    vibration = shown.pop("vibration", "")
    limits = [*shown.values()]
    second = f"The limits of the cycle without scatter, with 95 % intervals of what is uncertain: {joined(limits)}."
    if not limits:
        second = "The stick-slip cycle without scatter has no limit near the given values."
    if vibration:
        second += f" A mass that does not stick vibrates without scatter up to {vibration}."
    return [
        f"{first}averaged over what is uncertain.",
        second,
        next_to_measure(budget),
    ]


def is_sure(budget: Mapping[str, Any]) -> bool:
    """Whether the averaged probability is so near 0 or 1 that the margin is what is left to know."""
    mean = float(budget["probability"]["mean"])
    return max(mean, 1.0 - mean) > CERTAIN


def bars(budget: Mapping[str, Any]) -> list[tuple[str, float, str]]:
    """Source, its part [%] and its interval in words: of the outcome, or of the limit in damping where that is sure.

    The largest first.
    """
    if is_sure(budget) and "damping" in budget["limits"]:
        parts = budget["limits"]["damping"]["first"]
    else:
        parts = {**budget["outcome"], SCATTER: [budget["scatter"]]}
    found = []
    for name, values in parts.items():
        part, *ends = (100.0 * min(max(value, 0.0), 1.0) for value in values)
        is_wide = {f"{end:.0f}" for end in ends} != {f"{part:.0f}"}
        found.append((name, round(part, 1), " to ".join(f"{end:.0f}" for end in ends) if is_wide else ""))
    return sorted(found, key=lambda one: -one[1])


def next_to_measure(budget: Mapping[str, Any]) -> str:
    """The source whose exact knowledge takes away most, and how much."""
    known = [row for row in bars(budget) if row[0] != SCATTER and row[1] > 0.0]
    if not known:
        return "No number that the scene gives with an uncertainty matters here."
    (name, part, ends), word = known[0], "the limit in damping" if is_sure(budget) else "whether it stick-slips"
    sentence = f"Measure the {name} next: known exactly, it takes away {digits(part, SURE)} %"
    sentence += f"{f' ({ends} %)' if ends else ''} of the variance of {word}"
    if is_sure(budget):
        return f"That is sure enough. {sentence}."
    kept = "less than 0.1" if budget["scatter"] < 1e-3 else digits(100 * budget["scatter"], SURE)
    return f"{sentence}; the scatter of friction keeps {kept} %, and no measurement takes that away."
