"""The base of all friction laws, and the functions that compiled code calls for whichever law it is compiled for.

A law is a frozen dataclass with its parameters, and its formula mu_D(|v_rel|) with slope and curvature, written once
for plain and for compiled code. Compiled code reads the parameters as a named tuple, whose type selects the formula
when the code is compiled: a law costs only what its own formula costs.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
from numba.extending import overload

from roughslip.compilation.cache import file_key
from roughslip.errors import InputError, ParameterError
from roughslip.oscillator import law_parameters
from roughslip.validation import gate, not_negative

CONTRACTED = {"contract"}  # a product and the sum behind it are one instruction, rounded once: a fifth faster
OPTIONS: Any = {"error_model": "numpy", "fastmath": CONTRACTED, "forceinline": False}  # of the compiled formulas
OF_COMPILED: Any = {**OPTIONS, "no_cpython_wrapper": True, "no_cfunc_wrapper": True}  # of those that Python never calls
LAWS: dict[str, type[FrictionLaw]] = {}
_LAW_OF: dict[type, Any] = {}  # what has the formulas, by the type of the compiled parameters


class FrictionLaw(ABC):
    """Friction against relative velocity: a limit of stick, `static`, and a sliding coefficient mu_D(|v_rel|).

    For a law of one function see `friction_law`. A law that scenes can name has a `name`, or stands in a file of the
    user, and gives `from_scene`. A subclass gives `parameters`, the named tuple that compiled code
    reads. The tuple begins with static, rest (mu_D at vanishing speed, at most static) and least (a number that mu_D
    does not fall below at any speed). The static methods take a speed |v_rel| >= 0 [m/s] and this tuple, and continue
    smoothly below 0.
    """

    static: float

    def __init_subclass__(cls, name: str = "", parameters: type | None = None) -> None:
        if name:
            LAWS[name] = cls
        if parameters is None:
            return
        if not parameters.__module__.startswith("roughslip."):  # a type that every process can read
            own, of_law = cls.parameters, f"{file_key(cls)} {cls.__qualname__}"
            parameters = kind = law_parameters.named(of_law, parameters._fields)  # type: ignore[attr-defined]
            cls.parameters = lambda self: kind(*own(self))  # type: ignore[method-assign]
        _LAW_OF[parameters] = cls

    @abstractmethod
    def parameters(self) -> Any:
        """The named tuple for compiled code; a law that uses the type of another law has the formula of that law."""

    @classmethod
    def from_scene(cls, section: Any, mean: float) -> FrictionLaw:
        """The law of the section `oscillator` of a scene, with the mean friction coefficient of the windows."""
        raise ParameterError(f"{cls.__name__} has no from_scene, by which a scene makes it; scene key: oscillator.law")

    @classmethod
    def example(cls, generator: np.random.Generator, static: float, speed: float) -> FrictionLaw:
        """A law drawn at random for tests, with features at some speeds [m/s]; of the laws of this package."""
        raise NotImplementedError

    @property
    def fastest_known(self) -> float:
        """The largest speed [m/s] at which the law was measured; infinite for a formula."""
        return math.inf

    @property
    def slowest_known(self) -> float:
        """The smallest speed [m/s] at which the law was measured; 0 for a formula."""
        return 0.0

    @staticmethod
    def friction(speed: Any, law: Any) -> Any:
        """mu_D at a speed."""
        raise NotImplementedError

    @staticmethod
    def slope_of_friction(speed: Any, law: Any) -> Any:
        """d mu_D / d|v_rel| [s/m] at a speed."""
        raise NotImplementedError

    @staticmethod
    def curvature_of_friction(speed: Any, law: Any) -> Any:
        """d^2 mu_D / d|v_rel|^2 [s^2/m^2] at a speed."""
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
    def row_spacing(row: int, law: Any) -> float:
        """The length [m/s] of the shorter of a row and the one below it."""
        return 0.0

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

    @gate
    def times(self, factor: float) -> FrictionLaw:
        """The law of a mean friction coefficient of the contacts that is this factor larger."""
        raise ParameterError(f"{type(self).__name__} does not follow from a mean friction coefficient: change the law")

    def steeper_than(self, maximum: float) -> str:
        """What to change where |slope| exceeds `maximum` [s/m], a step for each change of friction; empty elsewhere."""
        slope = float(friction_slope(0.0, self.parameters()))  # `slope` takes a tenth of a short run
        if abs(slope) <= maximum:
            return ""
        return (
            f"the slope of friction at rest, {slope:.3g} s/m, is more than the {maximum:.3g} s/m that the integrator "
            "resolves: let friction change over a wider range of speeds"
        )

    def check_not_negative(self, *names: str) -> None:
        """Raise ParameterError for an attribute that is not finite or is negative."""
        for name in names:
            not_negative(f"{type(self).__name__}.{name}", getattr(self, name))


def formulas_of(parameters: type, made: Callable[[], Any]) -> Any:
    """What has the formulas of parameters of that type; made at the first call."""
    if parameters not in _LAW_OF:
        _LAW_OF[parameters] = made()
    return _LAW_OF[parameters]


def check_static(static: float, mean: float, reason: str) -> None:
    """Raise InputError where the mean friction coefficient exceeds the static one of a scene."""
    if mean > static:
        raise InputError(
            f"oscillator.static_friction: {static:g} is less than the mean friction coefficient {mean:.3g} at the "
            f"penetration of the oscillator, so that {reason}: raise it"
        )


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
friction_curvature = _of_any_law("curvature_of_friction")
row_at = _of_any_law("row_at")
row_ends = _of_any_law("row_ends")
row_spacing = _of_any_law("row_spacing")
only_row = _of_any_law("only_row")


def excess_force(normal: float, speed: float, more: float, held: float, law: Any) -> float:
    """normal (mu_D + more) - held at a speed |v_rel| >= 0, for which the stages of a step wait one by one.

    A law may have a static method `excess_force` of its own, where the formula is faster in another order.
    """
    return normal * (friction(speed, law) + more) - held


@overload(excess_force, jit_options=OF_COMPILED, strict=False)
def _compiled_excess_force(normal: Any, speed: Any, more: Any, held: Any, law: Any) -> Any:
    own = getattr(_LAW_OF[law.instance_class], "excess_force", None)
    return own or (lambda normal, speed, more, held, law: normal * (friction(speed, law) + more) - held)
