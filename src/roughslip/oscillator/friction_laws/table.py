"""A friction law measured at some speeds."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import scipy

from roughslip.compilation.cache import compiled
from roughslip.errors import ParameterError, real
from roughslip.oscillator.base_law import OPTIONS, FrictionLaw
from roughslip.validation import gate, not_negative

LEFT_OUT = 1e-6  # of the largest value: knots that the cubic between others meets within that are no ends of rows
INTERPOLATIONS = ("monotone_cubic", "linear")
NEAREST = 1e-9  # of their speed: knots nearer than that ask for steps that rounding loses
SMOOTHED = 1e-4  # of the last speed: friction that grows from nothing within less is stick made smooth


class TableParameters(NamedTuple):
    """Rows of cubics between the knots; static, rest and least as in `FrictionLaw`.

    table : (rows, 5) speed of the knot [m/s] where a row begins, and the coefficients of its cubic from there
    """

    static: float
    rest: float
    least: float
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


@compiled(**OPTIONS)
def _friction(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    d = speed - row[0]
    return row[1] + d * (row[2] + d * (row[3] + d * row[4]))


@compiled(**OPTIONS)
def _slope(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    d = speed - row[0]
    return row[2] + d * (2.0 * row[3] + d * 3.0 * row[4])


@compiled(**OPTIONS)
def _curvature(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    return 2.0 * row[3] + 6.0 * row[4] * (speed - row[0])


@compiled(**OPTIONS)
def _row_ends(row: int, table: np.ndarray) -> tuple[float, float]:
    return table[row, 0], table[row + 1, 0] if row + 1 < table.shape[0] else np.inf


@lru_cache(maxsize=64)
def _rows(speeds: tuple[float, ...], values: tuple[float, ...], interpolation: str) -> np.ndarray:
    """The table of `TableParameters`."""
    x, mu = np.array(speeds), np.array(values)
    kept = list(range(x.size))
    if interpolation == "linear":
        curve = scipy.interpolate.PPoly(np.stack([np.diff(mu) / np.diff(x), mu[:-1]]), x)
    else:
        curve = scipy.interpolate.PchipInterpolator(x, mu)
        slopes = curve.derivative()(x)
        kept = _needed(curve, slopes, LEFT_OUT * mu.max())
        curve = scipy.interpolate.CubicHermiteSpline(x[kept], mu[kept], slopes[kept])
    table = np.zeros((len(kept), 5))
    table[:, 0], table[:, 1] = x[kept], mu[kept]
    table[:-1, 1 : 1 + len(curve.c)] = curve.c[::-1].T
    return table


def _needed(curve: Any, slopes: np.ndarray, allowed: float) -> list[int]:
    """Knots, from the first to the last, between which cubics of the same slopes are near a monotone cubic curve.

    slopes : (knots,) of the curve
    allowed : largest difference, at the knots that are left out and in the middle between knots
    """
    speeds, kept = curve.x, [0]

    def is_near(last: int) -> bool:
        ends = [kept[-1], last]
        inside = speeds[kept[-1] : last + 1]
        tried = np.concatenate([inside, 0.5 * (inside[1:] + inside[:-1])])
        cubic = scipy.interpolate.CubicHermiteSpline(speeds[ends], curve(speeds[ends]), slopes[ends])
        return bool(np.abs(cubic(tried) - curve(tried)).max() <= allowed)

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
class TableLaw(FrictionLaw, name="table", parameters=TableParameters):
    """mu_D as measured at some speeds.

    speeds_m_per_s : (knots,) [m/s] from 0 on, strictly increasing, at least two; no nearer than 1e-9 of their speed
    values : (knots,) [-] mu_D at the speeds; constant beyond the last speed
    static : [-] limit of stick, at least the first value; the first value where not given
    interpolation : monotone_cubic, with a continuous slope and no extremes of its own (F. N. Fritsch & R. E. Carlson,
        SIAM J. Numer. Anal. 17 (1980) 238), or linear
    measured_from_m_per_s : [m/s] the slowest speed of the measurement; below it the table is a guess

    A step of the motion ends at each knot, where the curvature jumps. So of a monotone cubic, knots are left out where
    the cubic between their neighbours, of the same slopes, differs by less than LEFT_OUT: of a smooth curve, most.
    """

    speeds_m_per_s: tuple[float, ...]
    values: tuple[float, ...]
    static: float = math.nan
    interpolation: str = "monotone_cubic"
    measured_from_m_per_s: float = 0.0

    def __post_init__(self) -> None:
        speeds = tuple(real("TableLaw.speeds_m_per_s", speed) for speed in self.speeds_m_per_s)
        values = tuple(real("TableLaw.values", value) for value in self.values)
        if len(speeds) < 2 or len(speeds) != len(values) or not np.isfinite((speeds, values)).all():
            raise ParameterError(
                f"TableLaw.values must be finite, one for each of at least two finite speeds: {len(values)} values for "
                f"{len(speeds)} speeds"
            )
        if speeds[0] != 0.0 or not np.all(np.diff(speeds) > 0.0):
            raise ParameterError(f"TableLaw.speeds_m_per_s must increase strictly from 0, not {speeds}")
        if min(values) < 0.0:
            raise ParameterError(f"TableLaw.values must not be negative, not {min(values)}")
        near = np.flatnonzero(np.diff(speeds) < NEAREST * np.array(speeds[1:]))
        if near.size:
            raise ParameterError(
                f"TableLaw.speeds_m_per_s {speeds[near[0]]} and {speeds[near[0] + 1]} are nearer than {NEAREST:g} of "
                "their speed, which no step resolves: space them further, as hardly changes the motion; scene key: "
                "oscillator.friction_table"
            )
        if values[0] < 0.5 * values[1] and speeds[1] < SMOOTHED * speeds[-1]:
            raise ParameterError(
                f"TableLaw.values rise from {values[0]} to {values[1]} within {speeds[1]} m/s: stick needs no such "
                f"approximation here, and steps as short; start the table at 0 m/s with {values[1]} and give static; "
                "scene keys: oscillator.friction_table, oscillator.static_friction"
            )
        if self.interpolation not in INTERPOLATIONS:
            raise ParameterError(
                f"TableLaw.interpolation must be {' or '.join(INTERPOLATIONS)}, not {self.interpolation!r}"
            )
        not_negative("TableLaw.measured_from_m_per_s", self.measured_from_m_per_s)
        object.__setattr__(self, "speeds_m_per_s", speeds)
        object.__setattr__(self, "values", values)
        if math.isnan(real("TableLaw.static", self.static)):
            object.__setattr__(self, "static", values[0])
        if not (math.isfinite(self.static) and self.static >= values[0]):
            raise ParameterError(f"TableLaw.static must be at least the first value, {values[0]}, not {self.static}")

    @property
    def fastest_known(self) -> float:
        """The last speed of the table [m/s]."""
        return self.speeds_m_per_s[-1]

    @property
    def slowest_known(self) -> float:
        """The slowest speed of the measurement [m/s]."""
        return self.measured_from_m_per_s

    @gate
    def times(self, factor: float) -> TableLaw:
        """The law of friction that is this factor larger at every speed."""
        values = tuple(factor * value for value in self.values)
        return replace(self, values=values, static=factor * self.static)

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> TableLaw:
        """The table of the scene, which takes the place of the mean friction coefficient."""
        speeds, values = zip(*section.friction_table, strict=True)
        return cls(speeds, values, section.static_friction)

    @classmethod
    def example(cls, generator: np.random.Generator, static: float, speed: float) -> TableLaw:
        """Seven knots within some of the speeds, and values that rise and fall."""
        knots = np.concatenate(([0.0], np.cumsum(generator.uniform(0.05, 0.5, 6)))) * speed
        values = static * generator.uniform(0.2, 1.0, 7)
        interpolation = INTERPOLATIONS[int(generator.choice(len(INTERPOLATIONS)))]
        return cls(tuple(knots), tuple(values), float(max(values[0], static)), interpolation)

    @lru_cache(maxsize=64)  # noqa: B019 (laws are small; searches of limits ask for the same one again and again)
    def parameters(self) -> TableParameters:
        table = _rows(self.speeds_m_per_s, self.values, self.interpolation)
        allowed = 0.0 if self.interpolation == "linear" else LEFT_OUT * max(self.values)
        least = max(min(self.values) - allowed, 0.0)
        return TableParameters(float(self.static), self.values[0], least, table)

    def steeper_than(self, maximum: float) -> str:
        slopes = np.diff(self.values) / np.diff(self.speeds_m_per_s)
        row = int(np.argmax(np.abs(slopes)))
        if abs(slopes[row]) <= maximum:
            return ""
        (low, high), (first, last) = self.speeds_m_per_s[row : row + 2], self.values[row : row + 2]
        return (
            f"friction goes from {first:g} to {last:g} between the knots {low:.9g} and {high:.9g} m/s of the table, "
            f"nearer than the integrator resolves: put them at least {abs(last - first) / maximum:.2g} m/s apart"
        )

    @staticmethod
    def friction(speed: float, law: TableParameters) -> float:
        return _friction(speed, law.table)

    @staticmethod
    def slope_of_friction(speed: float, law: TableParameters) -> float:
        return _slope(speed, law.table)

    @staticmethod
    def curvature_of_friction(speed: float, law: TableParameters) -> float:
        return _curvature(speed, law.table)

    @staticmethod
    def row_at(speed: float, law: TableParameters) -> int:
        return _row_at(speed, law.table)

    @staticmethod
    def row_ends(row: int, law: TableParameters) -> tuple[float, float]:
        return _row_ends(row, law.table)

    @staticmethod
    def row_spacing(row: int, law: TableParameters) -> float:
        below, above = _row_ends(row, law.table)
        return min(below - law.table[row - 1, 0], above - below)

    @staticmethod
    def only_row(row: int, law: TableParameters) -> TableParameters:
        return TableParameters(law.static, law.rest, law.least, law.table[row : row + 1])
