"""The memory of a contact from a record with steps of speed or holds: a, b, D_c, and growth of static friction.

At constant age friction rises by a = dS / d ln v + b for each e-folding of speed, with steady friction S. All is fitted
at once, with the rig and the instrument; without scatter and noise so do L. J. Reinen & J. D. Weeks, J. Geophys. Res.
98 (1993) 15937. Holds are those of J. H. Dieterich, J. Geophys. Res. 77 (1972) 3690.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import scipy

from roughslip.errors import IllPosedError
from roughslip.record.memory_fit import fitted_memory
from roughslip.record.reading import Trace
from roughslip.record.slips import Rig
from roughslip.record.steps_of_speed import (
    FEWEST,
    LAG,
    LENGTH,
    MASS,
    SPRING,
    STEP,
    B,
    Level,
    Rows,
    S,
    levels_of,
    rows_of,
)
from roughslip.results import described, result

SIGNIFICANT, WIDEST, RESOLVED = 1e-3, 0.7, 3.0  # p-value; half width of ln D_c; samples in D_c, and D_c in a level
TIMES, FACTOR, PEAK = 3, 10.0, 4  # least times of hold, last over first; samples of a peak above half its height
RADIAN = 0.5  # samples in a radian of a swing that is fitted
SLIPS = 0.03  # of the growth, which slip before the peak, the low-pass and short holds may take
NAN = np.full(3, np.nan)


@result
class ContactMemory:
    """What steps of speed and holds say, with the ends of 95 % intervals; NaN is "cannot tell"."""

    direct_effect: np.ndarray = described("a, mean over the speeds", "1", "end")
    ageing_effect: np.ndarray = described("b", "1", "end")
    length_m: np.ndarray = described("memory length D_c", "m", "end")
    growth: np.ndarray = described("of static friction with ln(time of hold)", "1", "end")
    chance: float = described("p-value that steps and holds show no memory")
    flexibility_m: float = described("normal force over the stiffness of the rig", "m")
    transients: tuple[np.ndarray, ...] = described("friction less that without memory and rig, of each trace", "1")
    notes: tuple[str, ...] = described("what the record says, and leaves open")


def contact_memory(
    traces: list[Trace], rig: Rig | None = None, time_constant_s: float | None = None
) -> ContactMemory | None:
    """The memory of the contact from steps of speed and holds of all traces; None where the drive has none.

    rig : its stiffness and mass, with column load; not given, both are fitted
    time_constant_s : [s] of the instrument; not given, it is fitted
    """
    levels = [levels_of(np.abs(trace.speed)) for trace in traces]
    flat = [[part for part in parts if np.isfinite(part[2])] for parts in levels]
    if not any(b[0] - a[1] < min(a[1] - a[0], b[1] - b[0]) for parts in flat for a, b in pairwise(parts)):
        return None
    rows = rows_of(traces, levels)
    given = np.full(rows.ends[1] + rows.drift.shape[1], np.nan)
    if rig is not None:
        load = float(np.mean([np.mean(trace.load) for trace in traces if trace.load is not None]))
        given[[SPRING, MASS]] = 1e6 * load / rig.stiffness_n_per_m, 1e6 * rig.mass_kg / load
    if time_constant_s is not None:
        given[LAG] = time_constant_s / rows.interval
    try:
        rows, p, root, chance = fitted_memory(rows, given)
    except IllPosedError as error:
        note = f"cannot tell the memory of the contact: {error}"
        return ContactMemory(NAN, NAN, NAN, NAN, np.nan, np.nan, (), (note,))
    of, width, last = np.eye(p.size)[[B, B, LENGTH]], np.log(rows.levels[-1] / rows.levels[0]), S + rows.levels.size - 1
    of[0, [S, last]] += -1.0 / width, 1.0 / width
    factor = scipy.stats.t.ppf(0.975, rows.root.size - p.size)
    half = factor * np.linalg.norm(of @ root, axis=1)
    direct, ageing, log_length = (of @ p)[:, None] + half[:, None] * np.array([0.0, -1.0, 1.0])
    why = _what_hides(rows, p, half, chance, rig is None)
    direct, ageing, length = (NAN, NAN, NAN) if why else (NAN if rows.single else direct, ageing, np.exp(log_length))
    growth, more = _growth(traces, flat, float(length[0]), rows.interval * float(p[LAG]))
    shown = ("a", direct, ""), ("b", ageing, ""), ("D_c", length, " m"), ("growth with ln(hold)", growth, "")
    text = ", ".join(f"{name} {x:.3g} ({low:.3g} to {high:.3g}){unit}" for name, (x, low, high), unit in shown if x > 0)
    transients = () if why else _transients(traces, rows, p)
    taken_out = "; what it adds after steps is taken out" if transients else ""
    notes = [f"the contact has a memory: {text}{taken_out}"] * bool(text) + why + more
    return ContactMemory(direct, ageing, length, growth, chance, 1e-6 * float(p[SPRING]), transients, tuple(notes))


def _transients(traces: list[Trace], rows: Rows, p: np.ndarray) -> tuple[np.ndarray, ...]:
    """What memory and rig add to the friction of each trace."""
    without = np.where((np.arange(p.size) == B) | (np.arange(p.size) == SPRING), 0.0, p)
    more, elapsed = rows.friction(p) - rows.friction(without), rows.drive.elapsed
    return tuple(
        np.interp(trace.time - trace.time[0], elapsed[part] - elapsed[part[0]], more[part])
        for trace, part in zip(traces, rows.drive.records, strict=True)
    )


def _what_hides(rows: Rows, p: np.ndarray, half: np.ndarray, chance: float, is_mass_fitted: bool) -> list[str]:
    """Why the record cannot tell the memory, in one note; none where it can."""
    length, slowest = float(np.exp(p[LENGTH])), rows.interval * float(rows.levels[int(rows.single)])
    least, most = RESOLVED * slowest, rows.reach / RESOLVED
    if chance > SIGNIFICANT:
        text = f"lengths from {least:.2g} to {most:.2g} m would show, where rig and scatter hide none"
        return [f"steps of speed show no memory of the contact; {text}"]
    swing = 1e-6 * float(np.sqrt(p[SPRING] * p[MASS])) if is_mass_fitted else 0.0  # [s] in a radian
    is_swing_hidden = 0.0 < swing < RADIAN * rows.interval
    if half[2] < WIDEST and least < length < most and not is_swing_hidden:
        return []
    reasons = {
        "the mass of the rig swings between samples; give its mass and stiffness, or slower speeds": is_swing_hidden,
        "levels of speed are too short for it; slide farther at each": length > most,
        "the rig is too soft for it; give its stiffness, or use a stiffer one": 1e-6 * p[SPRING] * p[B] > length,
        "the instrument smooths it; give time_constant_s, or use slower speeds": p[LAG] * slowest > length,
        "it passes between samples; take more samples a second, or slower speeds": length < least,
        "scatter and noise hide it; take more steps": True,
    }
    why = next(text for text, is_so in reasons.items() if is_so)
    return [f"cannot tell the memory of the contact, a length of about {length:.2g} m: {why}"]


def _growth(
    traces: list[Trace], flat: list[list[Level]], length: float, time_constant: float
) -> tuple[np.ndarray, list[str]]:
    """Slope of peaks of friction after holds over ln(time), and notes. length : [m] D_c, or NaN; time_constant : [s]"""
    found = []
    for trace, parts in zip(traces, flat, strict=True):
        for (a, before, v), (start, b, rest), (_, end, again) in zip(parts, parts[1:], parts[2:], strict=False):
            if rest == 0.0 and abs(again - v) < STEP * v:
                few = max(FEWEST, (before - a) // 20)
                after = trace.friction[b : min(end, b + before - a)] - np.mean(trace.friction[before - few : before])
                top = int(np.argmax(after))
                low = np.append(np.flatnonzero(after < 0.5 * after[top]), [-1, after.size])
                width = np.min(low[low > top]) - np.max(low[low < top]) - 1
                time = (b - start) * trace.interval + np.nan_to_num(length / v)
                lasts = np.nan_to_num(length / v, nan=np.inf) / (trace.interval + time_constant)
                found.append((time, after[top], min(width, 0.5 * lasts), -np.min(after[top:])))
    if not found:
        return NAN, []
    times, heights, widths, drops = np.transpose(found)
    few = np.unique(np.round(np.log(times), 1)).size < TIMES or times.max() < FACTOR * times.min()
    reasons = {
        f"it takes holds of {TIMES} times over a factor of {FACTOR:g}": few,
        "its peak passes between samples; take more a second": np.median(widths) < PEAK,
        "the rig sticks and slips after holds; use a stiffer one": np.median(drops) > 0.5 * np.median(heights),
    }
    if why := [f"cannot tell the growth of static friction: {text}" for text, is_so in reasons.items() if is_so]:
        return NAN, why[:1]
    line = scipy.stats.linregress(np.log(times), heights)
    half = np.hypot(scipy.stats.t.ppf(0.975, times.size - 2) * line.stderr, SLIPS * line.slope)
    return line.slope + half * np.array([0.0, -1.0, 1.0]), []
