"""From traces to samples of sliding: stick phases, friction in slip by the balance of forces, and thinning.

The specimen of mass m is held by a spring k and a damper d. What is measured, F, is the force in spring and damper,
and friction is R = F + m a with the acceleration a of the specimen. Its sliding speed is that of the belt less its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from roughslip.errors import IllPosedError, ParameterError
from roughslip.record.likelihood import SlidingSamples
from roughslip.record.reading import Trace

MOST_SAMPLES = 6000  # of a fit; means of neighbours take their place
WINDOW, DEGREE = 5, 2  # of the smoothing that differentiates the deflection
STICKS = 0.15  # of the belt's speed: slower sliding is stick
STRETCHES, FEWEST_IN_STRETCH = 60, 20  # of a trace, in which stick-slip is looked for without a rig; samples in one
SAWTOOTH = 6.0  # standard errors of the skewness of increments, from which a stretch is a saw of stick and slip
JUMP = 0.5  # of a speed, from which a stretch of two speeds is not judged
MARGIN = 1.25  # on the fastest speed with stick-slip
WIDE = 3.0  # times the swing at the fastest speeds, a quarter of the stretches: a stretch that swings too much
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
    stick : of each trace (n,) whether it is in stick; without a rig, in stick-slip
    notes : what is left out and why
    from_slips : whether samples are of slips between sticks
    """

    samples: SlidingSamples
    stick: list[np.ndarray]
    notes: tuple[str, ...]
    from_slips: bool


def sliding(traces: list[Trace], rig: Rig | None = None) -> Sliding:
    """Samples of sliding of all traces, at most MOST_SAMPLES.

    rig : needed to use slip phases of stick-slip. Without it they are left out. Raises IllPosedError where nothing
    slides.
    """
    parts = [_of_rig(trace, rig) if rig is not None and trace.load is not None else _alone(trace) for trace in traces]
    slowest = LEAST_SPEED * max(float(np.max(np.abs(trace.speed))) for trace in traces)
    used = [
        ~stick & (np.abs(trace.speed) > slowest) & (speed > slowest)
        for trace, (_, speed, stick) in zip(traces, parts, strict=True)
    ]
    count = sum(map(np.count_nonzero, used))
    if count == 0:
        raise IllPosedError(
            "no sample of the record is in steady sliding; give the rig", scene_keys="friction.record.rig_mass_kg"
        )
    sticks, notes = [stick for _, _, stick in parts], []
    lost = float(np.mean(np.concatenate(sticks)))
    if lost and rig is None:
        notes.append(
            f"{lost:.0%} of the record is stick-slip and not used, as mass, stiffness and damping of the rig "
            "are not given; so the curve is open at the speeds of these slips, where its slope decides"
        )
    block = max(1, -(-count // MOST_SAMPLES))
    pieces = [
        _thinned(trace, friction, speed, keep, block)
        for trace, (friction, speed, _), keep in zip(traces, parts, used, strict=True)
    ]
    samples = SlidingSamples(*np.concatenate(pieces).T)
    return Sliding(samples, sticks, tuple(notes), bool(lost and rig))


def _of_rig(trace: Trace, rig: Rig) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Friction [-], sliding speed [m/s] and stick of a trace by the balance of forces."""
    load, dt = trace.load, trace.interval
    assert load is not None
    force = trace.friction * load
    place = trace.position if trace.position is not None else _deflection(force, rig, dt)
    velocity, acceleration = (
        scipy.signal.savgol_filter(place, WINDOW, DEGREE, deriv=order, delta=dt) for order in (1, 2)
    )
    friction = (scipy.signal.savgol_filter(force, WINDOW, DEGREE) + rig.mass_kg * acceleration) / load
    speed = np.sign(np.mean(trace.speed)) * (trace.speed - velocity)
    stick = speed < STICKS * np.abs(trace.speed)
    stick = scipy.ndimage.binary_dilation(stick, iterations=WINDOW // 2)  # ends of slip are smoothed over stick
    return friction, speed, stick


def _deflection(force: np.ndarray, rig: Rig, dt: float) -> np.ndarray:
    """(n,) [m] where spring and damper bear the force: k x + d x' = F, exactly for forces straight between samples."""
    if rig.damping_n_s_per_m == 0.0:
        return force / rig.stiffness_n_per_m
    tau = rig.damping_n_s_per_m / rig.stiffness_n_per_m
    keep = np.exp(-dt / tau)
    slope = 1.0 - tau / dt * (1.0 - keep)
    forced = (slope * force[1:] + (1.0 - keep - slope) * force[:-1]) / rig.stiffness_n_per_m
    start = force[0] / rig.stiffness_n_per_m
    return np.concatenate([[start], scipy.signal.lfilter([1.0], [1.0, -keep], forced, zi=[keep * start])[0]])


def _alone(trace: Trace) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Friction, speed of the belt, and where the specimen may stick and slip.

    Slow rises and fast falls skew the increments of friction, and make it swing. Where stretches do so, all slower
    speeds are left out too: there stick-slip is stronger.
    """
    speed, values = np.abs(trace.speed), trace.friction
    parts = np.array_split(np.arange(values.size), max(1, min(STRETCHES, values.size // FEWEST_IN_STRETCH)))
    swing, saw = np.empty(len(parts)), np.zeros(len(parts), dtype=bool)
    for number, part in enumerate(parts):
        swing[number] = np.std(scipy.signal.detrend(values[part]))
        rises = np.diff(values[part])
        saw[number] = scipy.stats.skew(rises) < -SAWTOOTH * np.sqrt(6.0 / rises.size)
    middle = np.array([np.median(speed[part]) for part in parts])
    saw |= swing > WIDE * np.median(swing[middle >= np.quantile(middle, 0.75)])
    saw &= np.array([np.ptp(speed[part]) for part in parts]) < JUMP * middle
    if trace.position is not None:  # the specimen moves with the belt in stick
        velocity = scipy.signal.savgol_filter(trace.position, WINDOW, DEGREE, deriv=1, delta=trace.interval)
        stick = np.abs(trace.speed - velocity) < STICKS * speed
        saw |= np.array([np.mean(stick[part]) > STICKS for part in parts])
    return values, speed, speed <= MARGIN * float(np.max(middle[saw], initial=0.0))


def _thinned(trace: Trace, friction: np.ndarray, speed: np.ndarray, keep: np.ndarray, block: int) -> np.ndarray:
    """(blocks, 5) friction, speed, step, seconds, change: means of up to `block` samples in sliding.

    The slipped distance goes on through what is left out, so that the scatter is remembered across stick.
    """
    dt, change = trace.interval, np.gradient(np.abs(trace.speed), trace.interval)
    slipped = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]).clip(0.0) * dt)])
    edges = np.flatnonzero(np.diff(np.concatenate([[False], keep, [False]]).astype(int)))
    rows = []
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        for start in range(first, last, block):
            part = slice(start, min(start + block, last))
            if part.stop - start >= min(block, FEWEST_IN_SLIP):
                middle = 0.5 * (start + part.stop - 1)
                means = (np.mean(values[part]) for values in (friction, speed, slipped))
                rows.append((*means, middle * dt, np.mean(change[part])))
    if not rows:
        return np.empty((0, 5))
    table = np.array(rows)
    table[:, 2:4] = np.diff(table[:, 2:4], axis=0, prepend=table[:1, 2:4])
    table[0, 2:4] = -1.0, block * dt
    table[1:, 2] = np.maximum(table[1:, 2], 0.0)
    return table
