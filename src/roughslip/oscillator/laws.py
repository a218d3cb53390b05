"""Friction laws by a formula, and the functions that compiled code calls for whichever law it is compiled for.

A law is a frozen dataclass with its parameters, and its formula mu_D(|v_rel|) with its slope, written once
for plain and for compiled code. Compiled code reads the parameters as a named tuple, whose type selects the formula
when the code is compiled: a law costs only what its own formula costs.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numba.extending import overload

from roughslip.errors import ParameterError
from roughslip.validation import gate, not_negative

CONTRACTED = {"contract"}  # a product and the sum behind it are one instruction, rounded once: a fifth faster
OPTIONS: Any = {"error_model": "numpy", "fastmath": CONTRACTED, "forceinline": False}  # of the compiled formulas
OF_COMPILED: Any = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # of those that Python never calls
NO_POLE = 0.5  # steps that end at the belt try speeds below 0, down to which the quotient may have its pole
_LAW_OF: dict[type, Any] = {}  # what has the formulas, by the type of the compiled parameters


class FrictionLaw(ABC):
    """Friction against relative velocity: a limit of stick, `static`, and a sliding coefficient mu_D(|v_rel|).

    A law that scenes can name has `from_scene` too. A subclass gives `parameters`, the named tuple that
    compiled code reads. The tuple begins with static and rest (mu_D at vanishing speed, at most static). The static
    methods take a speed |v_rel| >= 0 [m/s] and this tuple, and continue smoothly below 0. A law of any function of
    speed is a table: `friction_law`.
    """

    static: float
    fastest_known: float = math.inf  # [m/s] ends of the speeds at which the law was measured; all of a formula
    slowest_known: float = 0.0

    def __init_subclass__(cls, parameters: type) -> None:
        _LAW_OF.setdefault(parameters, cls)

    @abstractmethod
    def parameters(self) -> Any:
        """The named tuple for compiled code; a law that uses the type of another law has the formula of that law."""

    @abstractmethod
    def times(self, factor: float) -> Self:
        """The law of a mean friction coefficient of the contacts that is this factor larger."""

    @staticmethod
    def friction(speed: Any, law: Any) -> Any:
        """mu_D at a speed."""
        raise NotImplementedError

    @staticmethod
    def slope_of_friction(speed: Any, law: Any) -> Any:
        """d mu_D / d|v_rel| [s/m] at a speed."""
        raise NotImplementedError

    # A law with kinks consists of rows, each smooth between two speeds; without kinks it is one row.

    @staticmethod
    def row_at(speed: float, law: Any) -> int:
        """The row that holds a speed."""
        return 0

    @staticmethod
    def row_ends(row: int, law: Any) -> tuple[float, float]:
        """The two speeds [m/s] between which a row holds."""
        return 0.0, np.inf

    @staticmethod
    def only_row(row: int, law: Any) -> Any:
        """The law with one row alone, continued to all speeds."""
        return law

    @gate
    def mu(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """mu_D at a relative velocity [m/s] of either sign; at 0 the limit from sliding."""
        return np.vectorize(friction, excluded=(1,))(np.abs(velocity_m_per_s), self.parameters())

    @gate
    def slope(self, velocity_m_per_s: float | np.ndarray) -> np.ndarray:
        """d mu_D / d|v| [s/m] at a relative velocity [m/s] of either sign; at a kink that of the row above it."""
        return np.vectorize(friction_slope, excluded=(1,))(np.abs(velocity_m_per_s), self.parameters())

    def slopes_by_lines(self, speed_m_per_s: float) -> tuple[float, ...]:
        """Slopes [s/m] that straight lines between measured points would have near a speed; none of a formula."""
        return ()

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            not_negative(f"{type(self).__name__}.{name}", value)


def _of_any_law(name: str) -> Callable[[Any, Any], Any]:
    """The static method of that name, of the law that the parameters belong to, for plain and for compiled code."""

    def of_law(at: Any, law: Any) -> Any:
        return getattr(_LAW_OF[type(law)], name)(at, law)

    @overload(of_law, jit_options=OF_COMPILED, strict=False)
    def _compiled(at: Any, law: Any) -> Any:
        return getattr(_LAW_OF[law.instance_class], name)

    return of_law


friction = _of_any_law("friction")
friction_slope = _of_any_law("slope_of_friction")
row_at = _of_any_law("row_at")
row_ends = _of_any_law("row_ends")
only_row = _of_any_law("only_row")


class StribeckParameters(NamedTuple):
    """mu_D(v) = fit / (1 + decay v) + rest - fit + quadratic v^2; static and rest as in `FrictionLaw`."""

    static: float
    rest: float
    fit: float
    decay: float
    quadratic: float


@gate
@dataclass(frozen=True)
class StribeckLaw(FrictionLaw, parameters=StribeckParameters):
    """mu_D(v) = fit / (1 + decay |v|) + static - fit + quadratic v^2, eq. (13).

    fit : [-] part of the friction that decays with speed
    static : [-] coefficient at vanishing speed, and limit of stick
    decay_s_per_m : [s/m]
    quadratic_s2_per_m2 : [s^2/m^2]

    A friction coefficient is never negative: the motion uses max(mu_D + mu_S, 0), in slip and as the limit of stick.
    This matters with fit above static, or with a low stochastic part.
    """

    fit: float
    static: float = 0.4
    decay_s_per_m: float = 1.42
    quadratic_s2_per_m2: float = 0.01

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> Self:
        """Eq. (13) with the mean friction coefficient as mu_fit, and a limit of stick of at least that."""
        decay, quadratic = section.stribeck_decay_s_per_m, section.stribeck_quadratic_s2_per_m2
        return cls(mean, max(section.static_friction, mean), decay, quadratic)

    @gate
    def times(self, factor: float) -> Self:
        """The limit of stick stays, or rises to the mean: below it friction would turn negative at high speed."""
        return replace(self, fit=factor * self.fit, static=max(self.static, factor * self.fit))

    def parameters(self) -> StribeckParameters:
        rest, fit = float(self.static), float(self.fit)
        return StribeckParameters(rest, rest, fit, float(self.decay_s_per_m), float(self.quadratic_s2_per_m2))

    @staticmethod
    def friction(speed: Any, law: StribeckParameters) -> Any:
        return law.fit / np.maximum(1.0 + law.decay * speed, NO_POLE) + (
            law.rest - law.fit + law.quadratic * speed * speed
        )

    @staticmethod
    def slope_of_friction(speed: Any, law: StribeckParameters) -> Any:
        return -law.fit * law.decay / (1.0 + law.decay * speed) ** 2 + 2.0 * law.quadratic * speed


@gate
@dataclass(frozen=True)
class CoulombLaw(FrictionLaw, parameters=StribeckParameters):
    """One value at rest and one in slip: eq. (13) without decay, so compiled code needs no formula for it.

    kinetic : [-] mu_D at every speed
    static : [-] limit of stick, at least kinetic
    """

    kinetic: float
    static: float

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.static < self.kinetic:
            raise ParameterError(f"CoulombLaw.static must be at least kinetic = {self.kinetic}, not {self.static}")

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> Self:
        """The mean friction coefficient in slip, and a limit of stick of at least that; with a memory, just that."""
        given = None if section.memory else section.static_friction
        return cls(kinetic=mean, static=max(given or 0.0, mean))

    @gate
    def times(self, factor: float) -> Self:
        """The limit of stick stays, or rises to what slip holds; that of slip stays that."""
        kinetic, static = factor * self.kinetic, self.static if self.static > self.kinetic else 0.0
        return replace(self, kinetic=kinetic, static=max(static, kinetic))

    def parameters(self) -> StribeckParameters:
        kinetic = float(self.kinetic)
        return StribeckParameters(float(self.static), kinetic, 0.0, 0.0, 0.0)
