"""A friction law measured at some speeds, or given as a function of speed; and the law that a scene names."""

from __future__ import annotations

import importlib.util
import math
import numbers
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
import scipy

from roughslip.compilation.cache import compiled
from roughslip.errors import ParameterError, real
from roughslip.oscillator.laws import OPTIONS, CoulombLaw, FrictionLaw, StribeckLaw
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.validation import gate, not_negative

LEFT_OUT = 1e-6  # of the largest value up to there: knots that a cubic between others meets within that end no rows
LEFT_OUT_SMOOTH = 1e-8  # the same of a function
NEAR = 0.1  # relative distance of a speed from a knot, within which the lines on both sides of it are compared
SPEEDS = np.append(0.0, np.geomspace(1e-9, 1e4, 1301))  # [m/s] at which a function is a table: 100 a decade
HALVINGS = 24  # at most, of an interval of speeds in whose middle the spline errs: enough for a kink


class TableParameters(NamedTuple):
    """Rows of cubics between the knots; static and rest as in `FrictionLaw`.

    table : (rows, 5) speed of the knot [m/s] where a row begins, and the coefficients of its cubic from there
    """

    static: float
    rest: float
    table: np.ndarray


@compiled(**OPTIONS)
def _row_at(speed: float, table: np.ndarray) -> int:
    """The row that holds a speed; the first continues below its knot, the last, a constant, above it."""
    low, high = 0, table.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if speed >= table[middle, 0]:
            low = middle
        else:
            high = middle
    return low


@lru_cache(maxsize=64)
def _rows(speeds: tuple[float, ...], values: tuple[float, ...], is_smooth: bool) -> np.ndarray:
    """The table of `TableParameters`."""
    x, mu = np.array(speeds), np.array(values)
    curve = (scipy.interpolate.CubicSpline if is_smooth else scipy.interpolate.PchipInterpolator)(x, mu)
    slopes = curve.derivative()(x)
    kept = _needed(curve, slopes, (LEFT_OUT_SMOOTH if is_smooth else LEFT_OUT) * np.maximum.accumulate(mu))
    table = np.zeros((len(kept), 5))
    table[:, 0], table[:, 1] = x[kept], mu[kept]
    table[:-1, 1:] = scipy.interpolate.CubicHermiteSpline(x[kept], mu[kept], slopes[kept]).c[::-1].T
    return table


def _needed(curve: Any, slopes: np.ndarray, allowed: np.ndarray) -> list[int]:
    """Knots, from the first to the last, between which cubics of the same slopes are near a curve of cubics.

    slopes : (knots,) of the curve
    allowed : (knots,) largest difference, at the knots that are left out and in the middle from there to the next
    """
    speeds, kept = curve.x, [0]

    def is_near(last: int) -> bool:
        ends, span = [kept[-1], last], slice(kept[-1], last + 1)
        inside = speeds[span]
        tried = np.concatenate([inside, 0.5 * (inside[1:] + inside[:-1])])
        cubic = scipy.interpolate.CubicHermiteSpline(speeds[ends], curve(speeds[ends]), slopes[ends])
        return bool(np.all(np.abs(cubic(tried) - curve(tried)) <= np.append(allowed[span], allowed[span][:-1])))

    while kept[-1] < speeds.size - 1:
        low, step = kept[-1] + 1, 1
        while low + step < speeds.size and is_near(low + step):
            low, step = low + step, 2 * step
        while step > 1:
            step //= 2
            if low + step < speeds.size and is_near(low + step):
                low += step
        kept.append(low)
    return kept


@gate
@dataclass(frozen=True)
class TableLaw(FrictionLaw, parameters=TableParameters):
    """mu_D as measured at some speeds.

    speeds_m_per_s : (knots,) [m/s] from 0 on, strictly increasing, at least two
    values : (knots,) [-] mu_D at the speeds; constant beyond the last speed
    static : [-] limit of stick, at least the first value; the first value where not given
    measured_from_m_per_s : [m/s] the slowest speed of the measurement; below it the table is a guess
    is_smooth : whether the values are those of a smooth function at close speeds

    Between the speeds it is a monotone cubic, with a continuous slope and no extremes of its own (F. N. Fritsch & R. E.
    Carlson, SIAM J. Numer. Anal. 17 (1980) 238); of a smooth function a cubic spline. A step of the motion ends at each
    knot, where the curvature jumps. So knots are left out where the cubic between their neighbours, of the same slopes,
    differs by less than LEFT_OUT: of a smooth curve, most.
    """

    speeds_m_per_s: tuple[float, ...]
    values: tuple[float, ...]
    static: float = math.nan
    measured_from_m_per_s: float = 0.0
    is_smooth: bool = False

    def __post_init__(self) -> None:
        speeds = tuple(real("TableLaw.speeds_m_per_s", speed) for speed in self.speeds_m_per_s)
        values = tuple(real("TableLaw.values", value) for value in self.values)
        if len(speeds) < 2 or len(speeds) != len(values) or not np.isfinite((speeds, values)).all():
            raise ParameterError(
                f"TableLaw.values must be finite, one for each of at least two finite speeds_m_per_s: {len(values)} "
                f"for {len(speeds)} speeds"
            )
        if speeds[0] != 0.0 or not np.all(np.diff(speeds) > 0.0):
            raise ParameterError(f"TableLaw.speeds_m_per_s must increase strictly from 0, not {speeds}")
        if min(values) < 0.0:
            raise ParameterError(f"TableLaw.values must not be negative, not {min(values)}")
        not_negative("TableLaw.measured_from_m_per_s", self.measured_from_m_per_s)
        object.__setattr__(self, "speeds_m_per_s", speeds)
        object.__setattr__(self, "values", values)
        if math.isnan(real("TableLaw.static", self.static)):
            object.__setattr__(self, "static", values[0])
        if not (math.isfinite(self.static) and self.static >= values[0]):
            raise ParameterError(f"TableLaw.static must be at least the first value, {values[0]}, not {self.static}")

    @property
    def fastest_known(self) -> float:  # type: ignore[override]
        """The last speed of the table [m/s]."""
        return self.speeds_m_per_s[-1]

    @property
    def slowest_known(self) -> float:  # type: ignore[override]
        """The slowest speed of the measurement [m/s]."""
        return self.measured_from_m_per_s

    @gate
    def times(self, factor: float) -> Self:
        """The law of friction that is this factor larger at every speed."""
        values = tuple(factor * value for value in self.values)
        return replace(self, values=values, static=factor * self.static)

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> Self:
        """The table of the scene, which takes the place of the mean friction coefficient."""
        speeds, values = zip(*section.friction_table, strict=True)
        return cls(speeds, values, math.nan if section.static_friction is None else section.static_friction)

    @lru_cache(maxsize=64)  # noqa: B019 (laws are small; searches of limits ask for the same one again and again)
    def parameters(self) -> TableParameters:
        table = _rows(self.speeds_m_per_s, self.values, self.is_smooth)
        return TableParameters(float(self.static), self.values[0], table)

    def slopes_by_lines(self, speed_m_per_s: float) -> tuple[float, ...]:
        """Slopes [s/m] of the straight lines between knots that come within NEAR of a speed: one far from the knots."""
        if self.is_smooth:
            return ()
        speeds, near = np.array(self.speeds_m_per_s), speed_m_per_s * np.array([1.0 - NEAR, 1.0 + NEAR])
        touches = (speeds[:-1] < near[1]) & (speeds[1:] > near[0])
        slopes = [*(np.diff(self.values) / np.diff(speeds))[touches].tolist()]
        return tuple(slopes if near[1] <= speeds[-1] else [*slopes, 0.0])

    @staticmethod
    def friction(speed: float, law: TableParameters) -> float:
        row = law.table[_row_at(speed, law.table)]
        d = speed - row[0]
        return row[1] + d * (row[2] + d * (row[3] + d * row[4]))

    @staticmethod
    def slope_of_friction(speed: float, law: TableParameters) -> float:
        row = law.table[_row_at(speed, law.table)]
        d = speed - row[0]
        return row[2] + d * (2.0 * row[3] + d * 3.0 * row[4])

    @staticmethod
    def row_at(speed: float, law: TableParameters) -> int:
        return _row_at(speed, law.table)

    @staticmethod
    def row_ends(row: int, law: TableParameters) -> tuple[float, float]:
        return law.table[row, 0], law.table[row + 1, 0] if row + 1 < law.table.shape[0] else np.inf

    @staticmethod
    def only_row(row: int, law: TableParameters) -> TableParameters:
        return TableParameters(law.static, law.rest, law.table[row : row + 1])


@gate
def friction_law(function: Callable[[float], float], *, static: float | None = None) -> TableLaw:
    """A law from a function of speed, for example `friction_law(lambda v: 0.3 + 0.1 * np.exp(-v / 0.02))`.

    function : mu_D [-] at a speed |v_rel| >= 0 [m/s], a number, smooth
    static : [-] limit of stick, at least the function at 0, which it is where not given

    The law is the table of its values at SPEEDS, and closer where its spline errs by more than 1e-8 of the largest
    value up to there. A motion takes two to three times as long as with the formula of `StribeckLaw`. Raises
    ParameterError for a function that fails or is not finite at a speed from 0 to 1e4 m/s, is negative, jumps, or
    exceeds static at 0.
    """
    speeds, middles = np.zeros(0), SPEEDS
    for _ in range(HALVINGS):
        speeds = np.union1d(speeds, middles)
        values = np.array([_tried(function, speed) for speed in speeds.tolist()])
        middles = 0.5 * (speeds[1:] + speeds[:-1])
        error = scipy.interpolate.CubicSpline(speeds, values)(middles)
        error -= [_tried(function, speed) for speed in middles.tolist()]
        middles = middles[np.abs(error) > LEFT_OUT_SMOOTH * np.maximum.accumulate(values)[1:]]
        if not 0 < middles.size < SPEEDS.size:
            break
    if middles.size > 0:
        raise ParameterError(
            f"the friction law jumps or is rough near {middles[0]:g} m/s: give a TableLaw of its values"
        )
    limit = math.nan if static is None else static
    return TableLaw(tuple(speeds.tolist()), tuple(values.tolist()), limit, is_smooth=True)


def _tried(function: Callable[[float], float], speed: float) -> float:
    """The function at a speed, or an error that says what is wrong with it."""
    try:
        value = function(speed)
    except (ArithmeticError, ValueError, TypeError) as error:
        raise ParameterError(f"the friction law fails at {speed:g} m/s: {error}") from error
    if not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise ParameterError(f"the friction law must give a finite number at {speed:g} m/s, not {value!r}")
    return float(value)


def law_from_scene(section: Any, mean: float) -> FrictionLaw:
    """The law that the section `oscillator` of a scene names, with the mean friction coefficient and with its memory.

    `my_laws.py:falling` is a function of speed in a file of the user, in place of the mean. Raises ParameterError where
    there is none.
    """
    laws = {"stribeck": StribeckLaw.from_scene, "coulomb": CoulombLaw.from_scene, "table": TableLaw.from_scene}
    curve = laws.get(section.law, _law_of_a_file)(section, mean)
    return curve if section.memory is None else MemoryLaw(curve, **vars(section.memory))


def _law_of_a_file(section: Any, _: float) -> FrictionLaw:
    file, _, name = section.law.rpartition(":")
    spec = importlib.util.spec_from_file_location(Path(file).stem, file)
    if spec is None or spec.loader is None or not Path(file).is_file():
        raise ParameterError(f"there is no file {file!r} with a friction law", scene_keys="oscillator.law")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    function = getattr(module, name, None)
    if not callable(function):
        raise ParameterError(f"{section.law} is no function of speed", scene_keys="oscillator.law")
    return friction_law(function, static=section.static_friction)
