"""Friction with a memory at the samples of a record with steps of speed: means of samples, and a model of these.

Steady friction S over the logarithm of the sliding speed v is a straight line between the drive's speeds. About it mu =
S(v) + b ln(theta v / D_c) with the age theta, far below the cut-off speed. The rig is a spring with a mass, the
instrument a low-pass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from roughslip.errors import IllPosedError
from roughslip.record.followed import Law, followed
from roughslip.record.likelihood import ProcessFit, SlidingSamples, fitted_process, through_instrument
from roughslip.record.reading import Trace
from roughslip.record.slips import LEAST_SPEED

STEP, FLAT, SAME, MOST_LEVELS = 0.3, 0.25, 0.1, 9  # of ln speed: a step, the spread of a level, levels that are one
GROWTH, FEWEST, CREEP = 0.03, 8, 10.0  # of the time since a step, over which samples are averaged; of a level; slower
B, LENGTH, SPRING, MASS, LAG, S = range(6)  # places in parameters p, see Rows
TIMING, CLOCK = 0.29, 0.29  # deviations of the time of a step, and of all times, in samples
CREEPS = 0.05  # deviation of S in creep
MOST_STEPS = 60  # with a time of their own; further ones share the last
LONGER, DOUBT = (3.0, 10.0, 100.0), 1.0  # correlation lengths that are tried, and log likelihood that they may cost
Level = tuple[int, int, float]  # first sample, end, and speed [m/s]: 0 at rest, NaN where it changes


@dataclass(frozen=True, eq=False)
class Rows:
    """Means of samples of all traces, of few after steps of speed.

    drive : (n,) all rows; used : (n,) whether they are fitted; seen : these, times root, the roots of their counts
    late : (n,) [m] of the drive more, where the step in the row is a sample later; step : (n,) its number, or the last
    interval : [s] between samples
    levels : (L,) [m/s] of the drive; single : whether all but the first are one; reach : [m] of the longest
    drift : (n, d) columns; digital : whether the low-pass is of samples

    Parameters p : b, ln(D_c / m), flexibility [um], mass over load [mg/N], time constant [samples], S at levels,
        times of steps [samples], of drift.
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
        numbers = some[:, B].copy(), np.exp(some[:, LENGTH]), 1e-6 * some[:, SPRING], 1e-6 * some[:, MASS]
        laws = Law(np.log(self.levels), some[:, S:end].copy(), *numbers)
        later = np.maximum(rows.step + some[:, end:last][:, self.step] * self.late, 0.0)
        steps = np.where(rows.step < 0.0, rows.step, later)
        return followed(steps, rows.seconds, rows.speed, LEAST_SPEED * float(self.levels[-1]), laws)

    def shown(self, p: np.ndarray, mean: np.ndarray) -> np.ndarray:
        """(n,), or columns (n, k), as the instrument shows them."""
        lag = p[LAG] * self.interval
        shown = through_instrument(mean, self.drive.response(lag, False))
        if not self.digital:
            return shown
        rates = np.diff(shown, axis=0, prepend=shown[:1]).T / self.drive.seconds  # not beyond a step that follows
        ahead = shown + 0.5 * self.interval * rates.T
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

        Raises IllPosedError where no contact moves with these parameters, or where they leave nothing.
        """
        columns = self.slopes(p, free)[self.used] * self.root[:, None]
        columns = columns[:, np.any(columns != 0.0, axis=0)]
        left = self.seen.friction - self.friction(p)[self.used] * self.root
        if not np.any(left):
            raise IllPosedError("friction without scatter and noise has no errors")
        if not np.all(np.isfinite(left)):
            raise IllPosedError("no contact on this rig slides as the record does")
        seen = replace(self.seen, friction=left)
        found = fitted_process(seen, columns, 0.0, self.root, needs_scatter=False)
        longest = found
        for shortest in np.minimum(found.length * np.array(LONGER), 0.5 * seen.slipped[-1]):
            other = fitted_process(seen, columns, 0.0, self.root, found, needs_scatter=False, shortest_m=shortest)
            longest = other if other.log_likelihood > found.log_likelihood - DOUBT else longest
        return longest


def levels_of(speed: np.ndarray) -> list[Level]:
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


def rows_of(traces: list[Trace], levels: list[list[Level]]) -> Rows:
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
    return Rows(
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
