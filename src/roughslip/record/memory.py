"""The memory of a contact from a record with steps of speed or holds: a, b, D_c, and growth of static friction.

Steady friction S over the logarithm of the sliding speed v is a straight line between the drive's speeds. About it mu =
S(v) + b ln(theta v / D_c) with the age theta, far below the cut-off speed. At constant age the slope is a = dS / d ln v
+ b. The rig is a spring without mass, the instrument a low-pass. All are fitted at once, about scatter over the slipped
distance and noise; without these so do L. J. Reinen & J. D. Weeks, J. Geophys. Res. 98 (1993) 15937. Holds are those of
J. H. Dieterich, J. Geophys. Res. 77 (1972) 3690.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
import scipy

from roughslip.record.followed import Law, followed
from roughslip.record.likelihood import ProcessFit, SlidingSamples, fitted_process, through_instrument
from roughslip.record.reading import Trace
from roughslip.record.slips import LEAST_SPEED, Rig
from roughslip.results import described, result

STEP, FLAT, SAME, MOST_LEVELS = 0.3, 0.25, 0.1, 9  # of ln speed: a step, the spread of a level, levels that are one
GROWTH, FEWEST, CREEP = 0.03, 8, 10.0  # of the time since a step, over which samples are averaged; of a level; slower
B, LENGTH, SPRING, LAG, S = range(5)  # places in parameters p, see _Rows
LOW, HIGH = (-np.inf, -23.0, 0.0, 0.0), (np.inf, -2.0, np.inf, np.inf)
TIMING, CLOCK, MOST_LATE = 0.29, 0.29, 0.5  # deviations of the time of a step and of all times, and bound, in samples
CREEPS = 0.05  # deviation of S in creep
MOST_STEPS = 60  # with a time of their own; further ones share the last
SLOW = 2.0  # samples of a time constant to begin with, next to none
LONGER, DOUBT = (3.0, 10.0, 100.0), 1.0  # correlation lengths that are tried, and log likelihood that they may cost
FAR = 1e10  # a miss where nothing moves
LENGTHS, SPRINGS, SIZES = 9, (0.0, 0.03, 0.3, 3.0), (0.3, 1.0)  # starts; of D_c / b; of the range of friction
TRIED, BRIEF, ROUNDS = 6, 6, 3  # starts that are fitted, at first for so many steps; fits of scatter
START, SMALL = 0.05, 1e-4  # length over path, scatter and noise before they are fitted
SIGNIFICANT, WIDEST, RESOLVED = 1e-3, 0.7, 3.0  # p-value; half width of ln D_c; samples in D_c, and D_c in a level
TIMES, FACTOR, PEAK = 3, 10.0, 4  # least times of hold, last over first; samples of a peak above half its height
SLIPS = 0.02  # of the growth, which slip before the peak, and between samples, may take
NAN = np.full(3, np.nan)
Level = tuple[int, int, float]  # first sample, end, and speed [m/s]: 0 at rest, NaN where it changes


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


@dataclass(frozen=True, eq=False)
class _Rows:
    """Means of samples of all traces, of few after steps of speed.

    drive : (n,) all rows; used : (n,) whether they are fitted; seen : these, times root, the roots of their counts
    late : (n,) [m] of the drive more, where the step in the row is a sample later; step : (n,) its number, or the last
    interval : [s] between samples
    levels : (L,) [m/s] of the drive; single : whether all but the first are one; reach : [m] of the longest
    drift : (n, d) columns; inertia : [s^2/m] mass of the rig over load; digital : whether the low-pass is of samples

    Parameters p : b, ln(D_c / m), flexibility [um], time constant [samples], S at levels, times of steps, of drift.
    """

    drive: SlidingSamples
    used: np.ndarray
    seen: SlidingSamples
    root: np.ndarray
    late: np.ndarray
    step: np.ndarray
    interval: float
    levels: np.ndarray
    single: bool
    reach: float
    drift: np.ndarray
    inertia: float = 0.0
    digital: bool = False

    @property
    def ends(self) -> tuple[int, int]:
        """Places behind S and behind times of steps in p."""
        return S + self.levels.size, S + self.levels.size + int(self.step.max()) + 1

    def friction(self, p: np.ndarray) -> np.ndarray:
        """(n,) by parameters."""
        return np.asarray(self.shown(p, self.followed(p[None])[0]) + self.drift @ p[self.ends[1] :])

    def followed(self, some: np.ndarray) -> np.ndarray:
        """(m, n) friction before the instrument, by several parameters (m, p)."""
        rows, (end, last) = self.drive, self.ends
        numbers = some[:, B].copy(), np.exp(some[:, LENGTH]), 1e-6 * some[:, SPRING]
        laws = Law(np.log(self.levels), some[:, S:end].copy(), *numbers, self.inertia)
        later = np.maximum(rows.step + some[:, end:last][:, self.step] * self.late, 0.0)
        steps = np.where(rows.step < 0.0, rows.step, later)
        return followed(steps, rows.seconds, rows.speed, LEAST_SPEED * float(self.levels[-1]), laws)

    def shown(self, p: np.ndarray, mean: np.ndarray) -> np.ndarray:
        """(n,), or columns (n, k), as the instrument shows them."""
        lag = p[LAG] * self.interval
        shown = through_instrument(mean, self.drive.response(lag, False))
        if not self.digital:
            return shown
        ahead = shown + 0.5 * self.interval * np.gradient(shown, np.cumsum(self.drive.seconds), axis=0)
        digital = through_instrument(mean, self.drive.response(lag, True))
        is_sample = self.drive.seconds < 1.25 * self.interval  # else a row is a mean, half a sample ahead
        return np.where(is_sample.reshape(-1, *[1] * (mean.ndim - 1)), digital, ahead)

    def prior(self) -> np.ndarray:
        """(k, p) what is known of times of steps, and of S in creep below a single speed, over deviations."""
        end, last = self.ends
        known = np.zeros((1 + last - end, last + self.drift.shape[1]))
        known[0, S : S + 2] = np.array([-1.0, 1.0]) * self.single / CREEPS
        covariance = TIMING**2 * np.eye(last - end) + CLOCK**2
        known[1:, end:last] = np.linalg.inv(np.linalg.cholesky(covariance))
        return known

    def slopes(self, p: np.ndarray, free: np.ndarray) -> np.ndarray:
        """(n, free) derivatives of friction by parameters. The time of a step acts up to the next one."""
        change, (end, last), places = 1e-6 * np.maximum(np.abs(p), 1.0), self.ends, np.arange(p.size)
        change[end:last] = 1e-6
        moves = np.vstack([np.zeros(p.size), np.diag(change)[:end], change * ((places >= end) & (places < last))])
        means, columns = self.followed(p + moves), np.zeros((self.late.size, p.size))
        shown = self.shown(p, np.ascontiguousarray((means[1:] - means[0]).T))
        columns[:, :end] = shown[:, :end]
        columns[np.arange(self.late.size), end + self.step] = shown[:, end]
        columns[:, LAG] = self.shown(p + moves[1 + LAG], means[0]) - self.shown(p, means[0])
        columns[:, :last] /= change[:last]
        columns[:, last:] = self.drift
        return np.nan_to_num(columns[:, free])

    def white(self, process: ProcessFit, columns: np.ndarray) -> np.ndarray:
        """Used rows of columns : (n, k) with unit errors."""
        return process.whiten(self.seen, columns[self.used] * self.root[:, None])[1]

    def process(self, p: np.ndarray, free: np.ndarray) -> ProcessFit:
        """Scatter and noise about all that free parameters explain.

        Of correlation lengths that are nearly as likely it is the longest: a short one hides how far means wander.
        """
        columns = self.slopes(p, free)[self.used] * self.root[:, None]
        columns = columns[:, np.any(columns != 0.0, axis=0)]
        left = self.seen.friction - self.friction(p)[self.used] * self.root
        seen = replace(self.seen, friction=left)
        found = fitted_process(seen, columns, 0.0, self.root, needs_scatter=False)
        longest = found
        for shortest in np.minimum(found.length * np.array(LONGER), seen.slipped[-1]):
            other = fitted_process(seen, columns, 0.0, self.root, found, needs_scatter=False, shortest_m=shortest)
            longest = other if other.log_likelihood > found.log_likelihood - DOUBT else longest
        return longest


def _levels(speed: np.ndarray) -> list[Level]:
    """Parts of a speed : (n,) between steps; a step that lasts is a part of its own."""
    half, least = max(2, speed.size // 1000), LEAST_SPEED * float(speed.max())
    log = np.log(np.maximum(speed, least))
    noise = float(scipy.stats.median_abs_deviation(np.diff(log), scale="normal"))
    far = np.abs(log[2 * half :] - log[: -2 * half]) > max(STEP, 6.0 * noise)
    first, last = np.flatnonzero(np.diff(np.concatenate([[False], far, [False]]).astype(int))).reshape(-1, 2).T
    first = first + 2 * half
    parts: list[Level] = []
    for a, b, end in zip([0, *first], [0, *np.maximum(last, first)], [*first, speed.size], strict=True):
        spread = np.ptp(np.quantile(log[b:end], [0.05, 0.95])) if end - b >= FEWEST else np.inf
        level = float(np.mean(speed[b:end])) if spread < FLAT + 4.0 * noise else np.nan
        parts += [(int(a), int(b), np.nan)] * int(b > a) + [(int(b), int(end), 0.0 if level < 2.0 * least else level)]
    return parts


def _rows(traces: list[Trace], levels: list[list[Level]]) -> _Rows:
    """Rows of all traces. A first level counts from its middle on: how it began is not known."""
    tables, drifts, reach = [], [], 0.0
    for number, (trace, parts) in enumerate(zip(traces, levels, strict=True)):
        speed, dt, cuts = np.abs(trace.speed), trace.interval, [0]
        for a, b, level in parts:
            cuts.append(a)
            while cuts[-1] < b:
                cuts.append(cuts[-1] + 1 + int(GROWTH * (cuts[-1] - a)))
            cuts[-1:] = [b - 1, b]
            speed[a:b] = level if np.isfinite(level) else speed[a:b]
        cut = np.unique(cuts)[:-1]
        count = np.diff(cut, append=speed.size)
        slipped = np.append(0.0, np.cumsum(0.5 * (speed[1:] + speed[:-1]) * dt))
        columns = trace.friction, speed, slipped, dt * np.arange(speed.size)
        friction, drive, place, time = (np.add.reduceat(column, cut) / count for column in columns)
        used, late = (drive > LEAST_SPEED * speed.max()) & (cut >= parts[0][1] // 2), np.zeros((2, cut.size))
        for a, b, level in parts[1:]:
            last = a if np.isfinite(level) else min(b, speed.size - 1)
            used &= (cut < a - 1) | (cut > last)
            late[:, np.searchsorted(cut, a)] += dt * (speed[a - 1] - speed[last]), 1.0
        reach = max(reach, *(float(slipped[b - 1] - slipped[a]) for a, b, _ in parts))
        step, seconds = (np.maximum(np.diff(column, prepend=column[0]), 0.0) for column in (place, time))
        step[0], seconds[0] = -1.0, dt
        tables.append(np.column_stack([friction, drive, step, seconds, used, *late, np.sqrt(count)]))
        drift, u = np.zeros((cut.size, len(traces), 3)), 2.0 * time / time[-1] - 1.0
        drift[:, number] = np.column_stack([np.ones(u.size), u, 1.5 * u**2 - 0.5])
        drifts.append(drift.reshape(cut.size, -1)[:, 1:])
    friction, drive, step, seconds, used, late, begins, root = np.concatenate(tables).T
    rows, used = SlidingSamples(friction, drive, step, seconds, 0.0 * step), used > 0.0
    places, first = rows.slipped[used], np.diff(np.cumsum(step < 0.0)[used], prepend=0) > 0
    apart = np.where(first, -1.0, np.diff(places, prepend=0.0))
    seen = SlidingSamples((friction * root)[used], drive[used], apart, seconds[used], 0.0 * apart)
    speeds = _merged([level for parts in levels for *_, level in parts if level > 0.0])
    single = bool(speeds.size == 1)
    speeds = np.append(speeds / CREEP, speeds) if single else speeds
    number = np.minimum(np.cumsum(begins > 0.0), MOST_STEPS)
    return _Rows(
        *(rows, used, seen, root[used], late, number),
        *(traces[0].interval, speeds, single, reach, np.concatenate(drifts)),
    )


def _merged(speeds: list[float]) -> np.ndarray:
    """Levels of speed, of which those nearest to each other are one."""
    logs = np.sort(np.log(speeds))
    while logs.size > MOST_LEVELS or (logs.size > 1 and np.diff(logs).min() < SAME):
        i = int(np.argmin(np.diff(logs)))
        logs = np.concatenate([logs[:i], [np.mean(logs[i : i + 2])], logs[i + 2 :]])
    return np.exp(logs)


def contact_memory(
    traces: list[Trace], rig: Rig | None = None, time_constant_s: float | None = None
) -> ContactMemory | None:
    """The memory of the contact from steps of speed and holds of all traces; None where the drive has none.

    rig : its stiffness and mass, with column load; not given, the flexibility is fitted, and the mass is zero
    time_constant_s : [s] of the instrument; not given, it is fitted
    """
    levels = [_levels(np.abs(trace.speed)) for trace in traces]
    flat = [[part for part in parts if np.isfinite(part[2])] for parts in levels]
    if not any(b[0] - a[1] < min(a[1] - a[0], b[1] - b[0]) for parts in flat for a, b in pairwise(parts)):
        return None
    rows = _rows(traces, levels)
    given = np.full(rows.ends[1] + rows.drift.shape[1], np.nan)
    if rig is not None:
        load = float(np.mean([np.mean(trace.load) for trace in traces if trace.load is not None]))
        given[SPRING], rows = 1e6 * load / rig.stiffness_n_per_m, replace(rows, inertia=rig.mass_kg / load)
    if time_constant_s is not None:
        given[LAG] = time_constant_s / rows.interval
    p, root, chance = _fitted(rows, given)
    of, width, last = np.eye(p.size)[[B, B, LENGTH]], np.log(rows.levels[-1] / rows.levels[0]), S + rows.levels.size - 1
    of[0, [S, last]] += -1.0 / width, 1.0 / width
    factor = scipy.stats.t.ppf(0.975, rows.root.size - p.size)
    half = factor * np.linalg.norm(of @ root, axis=1)
    direct, ageing, log_length = (of @ p)[:, None] + half[:, None] * np.array([0.0, -1.0, 1.0])
    why = _what_hides(rows, p, half, chance)
    direct, ageing, length = (NAN, NAN, NAN) if why else (NAN if rows.single else direct, ageing, np.exp(log_length))
    growth, more = _growth(traces, flat, float(length[0]))
    shown = ("a", direct, ""), ("b", ageing, ""), ("D_c", length, " m"), ("growth with ln(hold)", growth, "")
    text = ", ".join(f"{name} {x:.3g} ({low:.3g} to {high:.3g}){unit}" for name, (x, low, high), unit in shown if x > 0)
    notes = [f"the contact has a memory: {text}"] * bool(text) + why + more
    transients = () if why else _transients(traces, rows, p)
    return ContactMemory(direct, ageing, length, growth, chance, 1e-6 * float(p[SPRING]), transients, tuple(notes))


def _transients(traces: list[Trace], rows: _Rows, p: np.ndarray) -> tuple[np.ndarray, ...]:
    """What memory and rig add to the friction of each trace."""
    without = np.where((np.arange(p.size) == B) | (np.arange(p.size) == SPRING), 0.0, p)
    more, elapsed = rows.friction(p) - rows.friction(without), rows.drive.elapsed
    return tuple(
        np.interp(trace.time - trace.time[0], elapsed[part] - elapsed[part[0]], more[part])
        for trace, part in zip(traces, rows.drive.records, strict=True)
    )


def _fit(
    rows: _Rows, start: np.ndarray, free: np.ndarray, process: ProcessFit, most: int = 60
) -> tuple[float, np.ndarray]:
    """Half the sum of squares and parameters of least squares from a start. most : steps"""
    bounds = np.tile([[-np.inf], [np.inf]], start.size)
    bounds[:, :S] = LOW, HIGH
    bounds[:, slice(*rows.ends)] = [[-MOST_LATE], [MOST_LATE]]

    def whole(some: np.ndarray) -> np.ndarray:
        p = start.copy()
        p[free] = some
        return p

    def left(some: np.ndarray) -> np.ndarray:
        p = whole(some)
        miss = np.nan_to_num(rows.drive.friction - rows.friction(p), nan=FAR)
        return np.append(rows.white(process, miss[:, None]), rows.prior() @ p)

    def slopes(some: np.ndarray) -> np.ndarray:
        return np.vstack([-rows.white(process, rows.slopes(whole(some), free)), rows.prior()[:, free]])

    at = np.clip(start, *bounds)[free]
    found = scipy.optimize.least_squares(left, at, slopes, bounds[:, free], x_scale="jac", max_nfev=most)
    return float(found.cost), whole(found.x)


def _first(rows: _Rows, start: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Parameters from which a fit goes to the least squares: of many lengths, springs and sizes the best ones."""
    linear, friction = np.arange(start.size) >= S, rows.drive.friction
    process = ProcessFit(START * rows.drive.slipped[-1], SMALL, SMALL, 0.0, False, NAN, np.nan, rows.root)
    start[LENGTH] = np.log(rows.reach)
    white = rows.white(process, np.column_stack([rows.slopes(start, linear), friction]))
    start[linear] = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
    start[slice(*rows.ends)] = 0.0
    start[S] = start[S + 1] if rows.single else start[S]
    of_b = np.ptp(np.quantile(friction[rows.used], [0.01, 0.99])) / np.log(rows.levels[-1] / rows.levels[0])
    tried = []
    for length, share, size in product(
        np.geomspace(rows.interval * rows.levels[0], rows.reach, LENGTHS),
        SPRINGS if free[SPRING] else (0.0,),
        SIZES,
    ):
        one = start.copy()
        one[:SPRING] = size * of_b, np.log(length)
        one[SPRING] += 1e6 * share * length / (size * of_b)
        tried.append(one)
    miss = friction[:, None] - np.stack([rows.friction(p) for p in tried], axis=1)
    squares = np.sum(rows.white(process, np.nan_to_num(miss, nan=FAR)) ** 2, axis=0)
    some = free & (np.arange(free.size) != LAG)  # which hides others from afar
    brief = [_fit(rows, tried[i], some, process, BRIEF) for i in np.argsort(squares)[:TRIED]]
    return _fit(rows, min(brief, key=lambda one: one[0])[1], some, process)[1]


def _fitted(rows: _Rows, given: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Parameters, a root of their covariance, and the p-value of no memory. given : parameters, NaN where free"""
    free = np.isnan(given)
    p = _first(rows, np.nan_to_num(given), free)
    process = rows.process(p, free)
    starts = p, np.where(free & (np.arange(p.size) == LAG), SLOW, p)
    kinds = rows, replace(rows, digital=True)
    fits = [(*_fit(one, start, free, process), one) for one, start in product(kinds, starts)]
    cost, p, rows = min(fits, key=lambda one: one[0])
    for _ in range(ROUNDS - 1):
        process = rows.process(p, free)
        cost, p = _fit(rows, p, free, process)
    none, without = free & (np.arange(p.size) > LENGTH), np.where(np.arange(p.size) == B, 0.0, p)
    stiff = np.where(np.arange(p.size) == SPRING, 0.0, without)
    freedom = rows.root.size - np.count_nonzero(free)
    better = min(_fit(rows, one, none, process)[0] for one in (without, stiff)) / cost - 1.0
    chance = float(scipy.stats.f.sf(0.5 * freedom * better, 2, freedom)) if p[B] > 0.0 else 1.0
    return p, _root(rows, p, free, process) * np.sqrt(2.0 * cost / freedom), chance


def _root(rows: _Rows, p: np.ndarray, free: np.ndarray, process: ProcessFit) -> np.ndarray:
    """R with R R' the covariance of least squares."""
    columns = np.vstack([rows.white(process, rows.slopes(p, free)), rows.prior()[:, free]])
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
    root = np.zeros((p.size, len(columns)))
    root[free] = np.linalg.pinv(columns / norms) / norms[:, None]
    return root


def _what_hides(rows: _Rows, p: np.ndarray, half: np.ndarray, chance: float) -> list[str]:
    """Why the record cannot tell the memory, in one note; none where it can."""
    length, slowest = float(np.exp(p[LENGTH])), rows.interval * float(rows.levels[int(rows.single)])
    least, most = RESOLVED * slowest, rows.reach / RESOLVED
    if chance > SIGNIFICANT:
        text = f"lengths from {least:.2g} to {most:.2g} m would show, where rig and scatter hide none"
        return [f"steps of speed show no memory of the contact; {text}"]
    if half[2] < WIDEST and least < length < most:
        return []
    reasons = {
        "levels of speed are too short for it; slide farther at each": length > most,
        "the rig is too soft for it; give its stiffness, or use a stiffer one": 1e-6 * p[SPRING] * p[B] > length,
        "the instrument smooths it; give time_constant_s, or use slower speeds": p[LAG] * slowest > length,
        "it passes between samples; take more samples a second, or slower speeds": length < least,
        "scatter and noise hide it; take more steps": True,
    }
    why = next(text for text, is_so in reasons.items() if is_so)
    return [f"cannot tell the memory of the contact, a length of about {length:.2g} m: {why}"]


def _growth(traces: list[Trace], flat: list[list[Level]], length: float) -> tuple[np.ndarray, list[str]]:
    """Slope of peaks of friction after holds over ln(time), and notes. length : [m] D_c, or NaN"""
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
                found.append((time, after[top], width, -np.min(after[top:])))
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
