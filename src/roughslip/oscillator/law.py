"""Friction against relative velocity: Stribeck's curve of eq. (13), Coulomb's two values, or a measured table.

Every law has a static coefficient, the limit of stick, and a sliding coefficient mu_D(|v_rel|). Compiled functions
read a law in one of two forms: the closed form of eq. (13), of which Coulomb's law is the case without decay, or the
cubics of a table. They are compiled for each, so that the closed form pays nothing for the table.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy
from numba.extending import overload, register_jitable

from roughslip.compilation import compiled
from roughslip.errors import ParameterError, real

INTERPOLATIONS = ("monotone_cubic", "linear")
CONTRACTED = {"contract"}  # a product and the sum behind it are one instruction, rounded once: a fifth faster


class ClosedForm(NamedTuple):
    """mu_D(v) = fit / (1 + decay v) + rest - fit + quadratic v^2, as the compiled functions read it.

    static : the limit of stick, never less than rest
    rest : mu_D at vanishing speed
    least : what mu_D does not fall below at any speed
    """

    static: float
    rest: float
    least: float
    fit: float
    decay: float
    quadratic: float


class Cubics(NamedTuple):
    """A table as the compiled functions read it; static, rest and least as in `ClosedForm`.

    table : (knots, 5) speed [m/s] and the coefficients of the cubic in the distance from there
    """

    static: float
    rest: float
    least: float
    table: np.ndarray


SlidingLaw = ClosedForm | Cubics


class FrictionLaw(Protocol):
    """What motion and limits ask of a law."""

    @property
    def static(self) -> float:
        """The limit of stick [-]."""
        ...

    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign; at 0 the limit from sliding."""
        ...

    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| [s/m] at a relative velocity [m/s] of either sign."""
        ...

    def compiled(self) -> SlidingLaw:
        """The same law for compiled functions."""
        ...


@register_jitable(error_model="numpy", fastmath=CONTRACTED)
def stribeck(speed: Any, fit: float, rest: float, decay: float, quadratic: float) -> Any:
    """mu_D at a speed |v_rel| >= 0; scalars and arrays, also inside compiled code."""
    return fit / (1.0 + decay * speed) + (rest - fit + quadratic * speed * speed)  # the quotient comes last


@register_jitable(error_model="numpy", fastmath=CONTRACTED)
def stribeck_slope(speed: Any, fit: float, decay: float, quadratic: float) -> Any:
    """d mu_D / d|v_rel| [s/m] at a speed |v_rel| >= 0."""
    return -fit * decay / (1.0 + decay * speed) ** 2 + 2.0 * quadratic * speed


@register_jitable(error_model="numpy", fastmath=CONTRACTED)
def stribeck_curvature(speed: Any, fit: float, decay: float, quadratic: float) -> Any:
    """d^2 mu_D / d|v_rel|^2 [s^2/m^2] at a speed |v_rel| >= 0."""
    return 2.0 * (fit * decay * decay / (1.0 + decay * speed) ** 3 + quadratic)


@compiled()
def _row_at(speed: float, table: np.ndarray) -> int:
    """The row of a table that holds a speed; the first goes on below it, the last, a constant, above."""
    low, high = 0, table.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if speed >= table[middle, 0]:
            low = middle
        else:
            high = middle
    return low


@compiled()
def _tabulated(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    d = speed - row[0]
    return row[1] + d * (row[2] + d * (row[3] + d * row[4]))


@compiled()
def _tabulated_slope(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    d = speed - row[0]
    return row[2] + d * (2.0 * row[3] + d * 3.0 * row[4])


@compiled()
def _tabulated_curvature(speed: float, table: np.ndarray) -> float:
    row = table[_row_at(speed, table)]
    return 2.0 * row[3] + 6.0 * row[4] * (speed - row[0])


@compiled()
def _knots(table: np.ndarray, row: int) -> tuple[float, float]:
    return table[row, 0], table[row + 1, 0] if row + 1 < table.shape[0] else np.inf


@compiled()
def _spread(table: np.ndarray, row: int) -> float:
    below, above = _knots(table, row)
    return min(below - table[row - 1, 0], above - below)


def sliding(speed: float, law: SlidingLaw) -> float:
    """mu_D at a speed |v_rel| >= 0, continued smoothly below 0; in compiled code the form is known when it compiles."""
    if isinstance(law, ClosedForm):
        return stribeck(speed, law.fit, law.rest, law.decay, law.quadratic)
    return _tabulated(speed, law.table)


def sliding_slope(speed: float, law: SlidingLaw) -> float:
    """d mu_D / d|v_rel| [s/m] at a speed |v_rel| >= 0."""
    if isinstance(law, ClosedForm):
        return stribeck_slope(speed, law.fit, law.decay, law.quadratic)
    return _tabulated_slope(speed, law.table)


def excess_force(normal: float, speed: float, more: float, held: float, law: SlidingLaw) -> float:
    """normal (mu_D + more) - held at a speed |v_rel| >= 0, which is what the stages of a step wait for one by one."""
    return normal * (sliding(speed, law) + more) - held


@overload(sliding, jit_options={"error_model": "numpy"}, strict=False)
def _compiled_sliding(speed: Any, law: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda speed, law: stribeck(speed, law.fit, law.rest, law.decay, law.quadratic)
    return lambda speed, law: _tabulated(speed, law.table)


@overload(sliding_slope, jit_options={"error_model": "numpy"}, strict=False)
def _compiled_sliding_slope(speed: Any, law: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda speed, law: stribeck_slope(speed, law.fit, law.decay, law.quadratic)
    return lambda speed, law: _tabulated_slope(speed, law.table)


@overload(excess_force, jit_options={"error_model": "numpy", "fastmath": CONTRACTED}, strict=False)
def _compiled_excess_force(normal: Any, speed: Any, more: Any, held: Any, law: Any) -> Any:
    def closed(normal: Any, speed: Any, more: Any, held: Any, law: Any) -> Any:
        rest = normal * (law.rest - law.fit + more + law.quadratic * (speed * speed)) - held
        return normal * law.fit / (1.0 + law.decay * speed) + rest  # the quotient comes last: all else is there by then

    def table(normal: Any, speed: Any, more: Any, held: Any, law: Any) -> Any:
        return normal * (_tabulated(speed, law.table) + more) - held

    return closed if law.instance_class is ClosedForm else table


def sliding_curvature(speed: float, law: SlidingLaw) -> float:
    """d^2 mu_D / d|v_rel|^2 [s^2/m^2] at a speed |v_rel| >= 0."""
    if isinstance(law, ClosedForm):
        return stribeck_curvature(speed, law.fit, law.decay, law.quadratic)
    return _tabulated_curvature(speed, law.table)


def row_at(speed: float, law: SlidingLaw) -> int:
    """The row of a table that holds a speed, 0 for the closed form."""
    return 0 if isinstance(law, ClosedForm) else _row_at(speed, law.table)


def knots(law: SlidingLaw, row: int) -> tuple[float, float]:
    """Between which speeds [m/s] a row of a table holds; a closed form holds throughout."""
    return (0.0, math.inf) if isinstance(law, ClosedForm) else _knots(law.table, row)


def spread(law: SlidingLaw, row: int) -> float:
    """The shorter of the distances [m/s] from the knot where a row of a table begins to the knots beside it."""
    return 0.0 if isinstance(law, ClosedForm) else _spread(law.table, row)


def in_row(law: SlidingLaw, row: int) -> SlidingLaw:
    """A law whose table has this row alone, which goes on for ever; the closed form as it is."""
    return law if isinstance(law, ClosedForm) else Cubics(law.static, law.rest, law.least, law.table[row : row + 1])


@overload(sliding_curvature, jit_options={"error_model": "numpy"}, strict=False)
def _compiled_sliding_curvature(speed: Any, law: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda speed, law: stribeck_curvature(speed, law.fit, law.decay, law.quadratic)
    return lambda speed, law: _tabulated_curvature(speed, law.table)


@overload(row_at, strict=False)
def _compiled_row_at(speed: Any, law: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda speed, law: 0
    return lambda speed, law: _row_at(speed, law.table)


@overload(knots, strict=False)
def _compiled_knots(law: Any, row: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda law, row: (0.0, np.inf)
    return lambda law, row: _knots(law.table, row)


@overload(spread, strict=False)
def _compiled_spread(law: Any, row: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda law, row: 0.0
    return lambda law, row: _spread(law.table, row)


@overload(in_row, strict=False)
def _compiled_in_row(law: Any, row: Any) -> Any:
    if law.instance_class is ClosedForm:
        return lambda law, row: law
    return lambda law, row: Cubics(law.static, law.rest, law.least, law.table[row : row + 1])


def _check(law: object, *names: str) -> None:
    for name in names:
        value = real(f"{type(law).__name__}.{name}", getattr(law, name))
        if not (math.isfinite(value) and value >= 0.0):
            raise ParameterError(f"{type(law).__name__}.{name} must be finite and not negative, not {value}")


@dataclass(frozen=True)
class StribeckLaw:
    """mu_D(v) = fit / (1 + decay |v|) + static - fit + quadratic v^2, eq. (13).

    fit : [-] part of the friction that decays with speed
    static : [-] coefficient at vanishing speed, and limit of stick
    decay_s_per_m : [s/m]
    quadratic_s2_per_m2 : [s^2/m^2]

    A friction coefficient is never negative: with fit above static, or with a low stochastic part, the motion uses
    max(mu_D + mu_S, 0), in slip and as the limit of stick alike.
    """

    fit: float
    static: float = 0.4
    decay_s_per_m: float = 1.42
    quadratic_s2_per_m2: float = 0.01

    def __post_init__(self) -> None:
        _check(self, "fit", "static", "decay_s_per_m", "quadratic_s2_per_m2")

    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign."""
        speed = np.abs(velocity_m_per_s)
        return stribeck(speed, self.fit, self.static, self.decay_s_per_m, self.quadratic_s2_per_m2)

    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| [s/m] at a relative velocity [m/s] of either sign."""
        return stribeck_slope(np.abs(velocity_m_per_s), self.fit, self.decay_s_per_m, self.quadratic_s2_per_m2)

    def compiled(self) -> SlidingLaw:
        """The same law for compiled functions."""
        rest, fit = float(self.static), float(self.fit)
        return ClosedForm(rest, rest, rest - fit, fit, float(self.decay_s_per_m), float(self.quadratic_s2_per_m2))


@dataclass(frozen=True)
class CoulombLaw:
    """One value at rest and one in slip.

    kinetic : [-] mu_D at every speed
    static : [-] limit of stick, at least kinetic
    """

    kinetic: float
    static: float

    def __post_init__(self) -> None:
        _check(self, "kinetic", "static")
        if self.static < self.kinetic:
            raise ParameterError(f"CoulombLaw.static must be at least kinetic = {self.kinetic}, not {self.static}")

    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign."""
        return np.full(np.shape(velocity_m_per_s), float(self.kinetic))

    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| = 0 [s/m]."""
        return np.zeros(np.shape(velocity_m_per_s))

    def compiled(self) -> SlidingLaw:
        """The same law for compiled functions."""
        kinetic = float(self.kinetic)
        return ClosedForm(float(self.static), kinetic, kinetic, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class TableLaw:
    """mu_D as measured at some speeds.

    speeds_m_per_s : (knots,) [m/s] from 0 on, strictly increasing, at least two
    values : (knots,) [-] mu_D there; beyond the last speed it stays
    static : [-] limit of stick, at least the first value; the first value where not given
    interpolation : monotone_cubic, with a continuous slope and no extremes of its own (F. N. Fritsch & R. E. Carlson,
        SIAM J. Numer. Anal. 17 (1980) 238), or linear
    """

    speeds_m_per_s: tuple[float, ...]
    values: tuple[float, ...]
    static: float = math.nan
    interpolation: str = "monotone_cubic"

    def __post_init__(self) -> None:
        speeds = tuple(real("TableLaw.speeds_m_per_s", speed) for speed in self.speeds_m_per_s)
        values = tuple(real("TableLaw.values", value) for value in self.values)
        if len(speeds) < 2 or len(speeds) != len(values) or not np.isfinite((speeds, values)).all():
            raise ParameterError("TableLaw.values must be finite, one for each of at least two finite speeds")
        if speeds[0] != 0.0 or not np.all(np.diff(speeds) > 0.0):
            raise ParameterError(f"TableLaw.speeds_m_per_s must increase strictly from 0, not {speeds}")
        if min(values) < 0.0:
            raise ParameterError(f"TableLaw.values must not be negative, not {min(values)}")
        if self.interpolation not in INTERPOLATIONS:
            raise ParameterError(f"a table is interpolated {' or '.join(INTERPOLATIONS)}, not {self.interpolation!r}")
        object.__setattr__(self, "speeds_m_per_s", speeds)
        object.__setattr__(self, "values", values)
        if math.isnan(real("TableLaw.static", self.static)):
            object.__setattr__(self, "static", values[0])
        if not (math.isfinite(self.static) and self.static >= values[0]):
            raise ParameterError(f"TableLaw.static must be at least the first value, {values[0]}, not {self.static}")

    def _table(self) -> np.ndarray:
        """(knots, 5) as in SlidingLaw."""
        speeds, values = np.array(self.speeds_m_per_s), np.array(self.values)
        table = np.zeros((speeds.size, 5))
        table[:, 0], table[:, 1] = speeds, values
        if self.interpolation == "linear":
            table[:-1, 2] = np.diff(values) / np.diff(speeds)
        else:
            table[:-1, 1:] = scipy.interpolate.PchipInterpolator(speeds, values).c[::-1].T
        return table

    def _pieces(self, velocity: float | np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """(5, ...) rows of the table that hold the speeds, and how far beyond their knots these lie."""
        table, speed = self._table(), np.abs(velocity)
        rows = table[np.searchsorted(table[:, 0], speed, side="right") - 1]
        return np.moveaxis(rows, -1, 0), speed - rows[..., 0]

    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign."""
        (_, c0, c1, c2, c3), d = self._pieces(velocity_m_per_s)
        return c0 + d * (c1 + d * (c2 + d * c3))

    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| [s/m] at a relative velocity [m/s] of either sign; at a knot that of the piece above it."""
        (_, _, c1, c2, c3), d = self._pieces(velocity_m_per_s)
        return c1 + d * (2.0 * c2 + d * 3.0 * c3)

    def compiled(self) -> SlidingLaw:
        """The same law for compiled functions."""
        return Cubics(float(self.static), self.values[0], min(self.values), self._table())
