"""From traces to samples of sliding: stick phases, friction in slip by the balance of forces, and thinning.

The specimen of mass m is held by a spring k and a damper d. What is measured, F, is the force in spring and damper,
and friction is R = F + m a with the acceleration a of the specimen. Its sliding speed is that of the belt less its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy

from roughslip.errors import IllPosedError, InputError, ParameterError
from roughslip.record.likelihood import SlidingSamples
from roughslip.record.motion import motion
from roughslip.record.reading import Trace

MOST_SAMPLES = 6000  # of a fit; means of neighbours take their place
WINDOW, DEGREE = 5, 2  # of the smoothing that differentiates the deflection
STICKS = 0.15  # of the belt's speed: slower sliding is stick
STRETCHES, FEWEST_IN_STRETCH = 60, 20  # of a trace, of which those of one speed are judged together; samples in one
JUMP, SAME_SPEED = 0.5, 1.5  # of a speed, in a stretch that is not judged; between stretches that are so together
MARGIN, SAME_SWING = 1.25, 0.7  # on the fastest speed with stick-slip; of its deviation: stick-slip goes on
WIDE, BUMPS = 4.0, 30  # times the median deviation at a speed: a stretch with a bump; one of so many is left out
HARMONICS = 4  # of a revolution, which are no swing
GIVE_RIG = "; give mass, stiffness and damping of the rig and column load, or radius_m for waves of a revolution"
LEAST_SPEED = 1e-4  # of the fastest: slower belts are at rest
FEWEST_IN_SLIP = 6  # samples of a slip phase


@dataclass(frozen=True)
class Rig:
    """The specimen's mass [kg], stiffness [N/m] and damping [N s/m] of its support."""

    mass_kg: float
    stiffness_n_per_m: float
    damping_n_s_per_m: float = 0.0

    def __post_init__(self) -> None:
        if not (self.mass_kg > 0.0 and self.stiffness_n_per_m > 0.0 and self.damping_n_s_per_m >= 0.0):
            raise ParameterError("mass and stiffness of a rig must be positive, and its damping not negative")


@dataclass(frozen=True, eq=False)
class Sliding:
    """What a fit takes from traces.

    samples : of sliding
    stick : of each trace (n,) whether it is in stick; without a rig, what else is left out
    notes : what is left out and why
    from_slips : whether samples are of slips between sticks
    """

    samples: SlidingSamples
    stick: list[np.ndarray]
    notes: tuple[str, ...]
    from_slips: bool


def sliding(traces: list[Trace], rig: Rig | None = None, radius_m: float | None = None) -> Sliding:
    """Samples of sliding of all traces, at most MOST_SAMPLES.

    rig : needed to use slip phases of stick-slip, and swings; without it they are left out
    radius_m : [m] of the track; a wave of each revolution is no swing

    Raises InputError where a rig comes without load, and IllPosedError where nothing slides.
    """
    if rig is not None and any(trace.load is None for trace in traces):
        raise InputError("column load: missing, which the balance of forces takes with the rig; give load [N]")
    left_out, motions, notes = _left_out(traces, radius_m)
    half = np.inf if rig is None else np.pi * np.sqrt(rig.mass_kg / rig.stiffness_n_per_m)  # [s] of a slip
    faster = f"; a slip of the rig lasts {half:.2g} s, and has to have {FEWEST_IN_SLIP} samples: record faster"
    by_forces = rig is not None and all(half >= FEWEST_IN_SLIP * trace.interval for trace in traces)
    parts = [
        _of_rig(trace, rig) if rig is not None and by_forces else (trace.friction, np.abs(trace.speed), out)
        for trace, out in zip(traces, left_out, strict=True)
    ]
    slowest = LEAST_SPEED * max(float(np.max(np.abs(trace.speed))) for trace in traces)
    pairs = [*zip(traces, parts, strict=True)]
    used = [~stick & (np.minimum(np.abs(one.speed), speed) > slowest) for one, (_, speed, stick) in pairs]
    count, sticks = sum(map(np.count_nonzero, used)), [stick for _, _, stick in parts]
    why = "; ".join(motions or ["the specimen moves with the belt"]) + (GIVE_RIG if rig is None else faster)
    if count == 0:
        raise IllPosedError(f"no sample of the record is in steady sliding: {why}", "friction.record.rig_mass_kg")
    lost = float(np.mean(np.concatenate(sticks)))
    notes = [*(note for trace in traces for note in trace.notes), *([] if by_forces else notes)]
    if motions and not by_forces:
        notes.append(f"{lost:.0%} of the record is not used: {why}; the curve is open there")
    if by_forces and any(np.std(part[0]) > np.std(one.friction) for one, part in pairs):
        notes.append("friction by the balance of forces varies more than the force: it is noisy, or of another rig")
    block = max(1, -(-count // MOST_SAMPLES))
    pieces = [_thinned(one, part[0], part[1], keep, block) for (one, part), keep in zip(pairs, used, strict=True)]
    samples = SlidingSamples(*np.concatenate(pieces).T)
    return Sliding(samples, sticks, tuple(dict.fromkeys(notes)), by_forces and bool(lost or motions))


def _of_rig(trace: Trace, rig: Rig) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Friction [-], sliding speed [m/s] and stick of a trace by the balance of forces."""
    load, dt = trace.load, trace.interval
    assert load is not None
    force = trace.friction * load
    place = trace.position if trace.position is not None else _deflection(force, rig, trace.time)
    velocity, acceleration = (
        scipy.signal.savgol_filter(place, WINDOW, DEGREE, deriv=order, delta=dt) for order in (1, 2)
    )
    friction = (scipy.signal.savgol_filter(force, WINDOW, DEGREE) + rig.mass_kg * acceleration) / load
    speed = np.sign(np.mean(trace.speed)) * (trace.speed - velocity)
    stick = speed < STICKS * np.abs(trace.speed)
    stick = scipy.ndimage.binary_dilation(stick, iterations=WINDOW // 2)  # ends of slip are smoothed over stick
    return friction, speed, stick


def _deflection(force: np.ndarray, rig: Rig, time: np.ndarray) -> np.ndarray:
    """(n,) [m] where spring and damper bear the force: k x + d x' = F, exactly for forces straight between samples."""
    k, d = rig.stiffness_n_per_m, rig.damping_n_s_per_m
    if d == 0.0:
        return force / k
    return np.asarray(scipy.signal.lsim(([1.0], [d, k]), force, time - time[0], force[0] * d / k)[1])


def _left_out(traces: list[Trace], radius_m: float | None) -> tuple[list[np.ndarray], list[str], list[str]]:
    """Of each trace (n,) what is no steady sliding; what it is; and notes on bumps.

    Stretches of one speed are judged together. Slower than stick-slip all is left out, as it is stronger there.
    """
    columns = [(_less_turns(one, radius_m), one.speed, one.time) for one in traces]
    values, belt, time = (np.concatenate(column) for column in zip(*columns, strict=True))
    speed = np.abs(belt)
    places = [(np.zeros(one.time.size) if one.position is None else one.position, one.interval) for one in traces]
    velocity = [scipy.signal.savgol_filter(place, WINDOW, DEGREE, 1, delta) for place, delta in places]
    held = np.abs(belt - np.concatenate(velocity)) < STICKS * speed  # the specimen moves with the belt
    of_trace = np.split(np.arange(time.size), np.cumsum([trace.time.size for trace in traces[:-1]]))
    counts = [max(1, min(STRETCHES, rows.size // FEWEST_IN_STRETCH)) for rows in of_trace]
    stretches = [part for rows, count in zip(of_trace, counts, strict=True) for part in np.array_split(rows, count)]
    out, motions, swing = np.zeros(values.size, dtype=bool), dict[str, str](), np.zeros(len(stretches))
    before = np.inf  # deviation of friction in stick-slip at the next slower speed
    for level in (levels := _levels(speed, stretches)):
        deviations = np.array([np.std(scipy.signal.detrend(values[stretches[i]])) for i in level])
        deviation = float(np.median(deviations))
        rows = np.concatenate([stretches[i] for i in level])
        begins = (np.diff(rows) > 1) | np.isin(rows[1:], [rows[0] for rows in of_trace])
        runs = np.split(values[rows], np.flatnonzero(begins) + 1)
        sticks, frequency = motion(runs, traces[0].interval, len(levels))
        sticks = sticks or float(np.mean(held[rows])) > STICKS or deviation > SAME_SWING * before
        before = deviation if sticks else np.inf
        middle = [float(np.median(speed[stretches[i]])) for i in level]
        if sticks or frequency:
            text = "stick-slip up to" if sticks else f"a swing at {frequency:.3g} Hz, at"
            motions["" if sticks else text] = f"{text} {max(middle):.3g} m/s"
            out[rows] = True
            out |= (speed <= MARGIN * max(middle)) & (speed >= (0.0 if sticks else min(middle) / MARGIN))
        else:
            swing[level] = deviations / (WIDE * max(deviation, 1e-300))
    worst = [stretches[i] for i in np.argsort(-swing)[: len(stretches) // BUMPS] if swing[i] > 1.0]
    out[np.concatenate([*worst, []]).astype(int)] = True
    bumps = [f"a bump from {time[rows[0]]:.4g} to {time[rows[-1]]:.4g} s is left out" for rows in worst]
    return [out[rows] for rows in of_trace], [*motions.values()], bumps


def _less_turns(trace: Trace, radius_m: float | None) -> np.ndarray:
    """(n,) friction less what repeats in each revolution of a track."""
    if radius_m is None:
        return trace.friction
    angles = np.outer(np.cumsum(trace.speed) * trace.interval / radius_m, np.arange(HARMONICS + 1))
    waves = np.hstack([np.cos(angles), np.sin(angles)])
    return np.asarray(trace.friction - waves @ np.linalg.lstsq(waves, trace.friction, rcond=None)[0])


def _levels(speed: np.ndarray, stretches: list[np.ndarray]) -> list[list[int]]:
    """Numbers of the stretches at one speed each, those at rest or across a jump in none."""
    low, middle, high = np.array([np.quantile(speed[rows], [0.05, 0.5, 0.95]) for rows in stretches]).T
    levels: list[list[int]] = []
    for i in np.argsort(middle, kind="stable"):
        if high[i] - low[i] < JUMP * middle[i] and middle[i] > LEAST_SPEED * middle.max():
            if not levels or middle[i] > SAME_SPEED * middle[levels[-1][0]]:
                levels.append([])
            levels[-1].append(int(i))
    return [sorted(level) for level in levels]


def _thinned(trace: Trace, friction: np.ndarray, speed: np.ndarray, keep: np.ndarray, block: int) -> np.ndarray:
    """(blocks, 5) friction, speed, step, seconds, change: means of up to `block` samples in sliding.

    The slipped distance goes on through what is left out, so that the scatter is remembered across stick.
    """
    dt, change = trace.interval, np.gradient(np.abs(trace.speed), trace.interval)
    slipped = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]).clip(0.0) * dt)])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], keep, [False]]).astype(int)))
    cuts = [[*range(first, last, block), last] for first, last in edges.reshape(-1, 2).tolist()]
    parts = [slice(*ends) for cut in cuts for ends in pairwise(cut) if ends[1] - ends[0] >= min(block, FEWEST_IN_SLIP)]
    if not parts:
        return np.empty((0, 5))
    columns = friction, speed, slipped, dt * np.arange(keep.size), change
    table = np.array([[np.mean(column[part]) for column in columns] for part in parts])
    table[:, 2:4] = np.diff(table[:, 2:4], axis=0, prepend=table[:1, 2:4])
    table[0, 2:4] = -1.0, block * dt
    table[1:, 2] = np.maximum(table[1:, 2], 0.0)
    return table
