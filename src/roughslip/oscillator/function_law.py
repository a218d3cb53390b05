"""A friction law of any function of speed that numba compiles."""

from __future__ import annotations

import inspect
import math
import numbers
import os
from collections.abc import Callable
from dataclasses import dataclass
from types import FunctionType, ModuleType, SimpleNamespace
from typing import Any

import numba
import numpy as np

from roughslip.compilation.cache import file_key
from roughslip.errors import ParameterError
from roughslip.oscillator import law_parameters
from roughslip.oscillator.base_law import OPTIONS, FrictionLaw, formulas_of
from roughslip.validation import gate

Formula = Callable[[float], float]
SPEEDS = np.geomspace(1e-9, 1e4, 261)  # [m/s] at which a function is tried: twenty a decade
CHANGE = 1e-3  # of the friction at rest: the speed by which it changes so much is the scale of the formula near rest
STEPS = 0.1, 1e-3  # of differences for the slope: of that scale, and of the speed
WIDER = 5.0  # times those steps for the curvature, whose rounding error grows with the square of the steps
FIELDS = ("static", "rest", "least", "slope", "curvature", "scale")


@dataclass(frozen=True)
class FunctionLaw(FrictionLaw):
    """What `friction_law` returns.

    function : mu_D at a speed [m/s]
    static : [-] limit of stick
    of_compiled : the named tuple for compiled code
    """

    function: Formula
    static: float
    of_compiled: Any

    def parameters(self) -> Any:
        return self.of_compiled


@gate
def friction_law(function: Formula, *, static: float | None = None) -> FunctionLaw:
    """A law from a function of speed, for example `friction_law(lambda v: 0.3 + 0.1 * np.exp(-v / 0.02))`.

    function : mu_D [-] at a speed |v_rel| >= 0 [m/s], a number, smooth, in terms that numba compiles
    static : [-] limit of stick, at least the function at 0, which it is where not given

    Slope and curvature are central differences of fourth order, over a thousandth and a two hundredth of the speed, and
    near rest over less than the speed by which friction changes by a thousandth.

    Below speed 0 the law is continued by its tangent parabola. Numbers that the function takes from around it count as
    they are at this call. In a file, what is compiled for the law is kept; of a function typed at a prompt, a first run
    of each process compiles some 20 s.

    Raises ParameterError for a function that numba does not compile, is not finite at a speed from 0 to 1e4 m/s, or
    exceeds static at 0. A motion takes two to three times as long as with the formula of `StribeckLaw`.
    """
    rest = _tried(function, 0.0)
    values = np.array([_tried(function, speed) for speed in SPEEDS])
    if static is not None and not static >= rest:
        raise ParameterError(f"static must be at least the friction at rest, {rest:.6g}, not {static}")
    change = np.abs(values - rest)
    changed = np.flatnonzero(change > CHANGE * (abs(rest) or change.max()))
    scale = float(SPEEDS[changed[0]]) if changed.size else 1.0
    least = float(min(rest, values.min()) - np.abs(np.diff(values)).max())  # below all speeds between those tried
    kind = law_parameters.named(f"{file_key(_for_both)} {_code_key(function)}", FIELDS)
    _check_compiles(function)
    formulas = formulas_of(kind, lambda: _formulas(_for_both(function)))
    limit = rest if static is None else float(static)
    flat = kind(limit, rest, least, 0.0, 0.0, scale)
    tangent = formulas.slope_of_friction(0.0, flat), formulas.curvature_of_friction(0.0, flat)
    return FunctionLaw(function, limit, flat._replace(slope=float(tangent[0]), curvature=float(tangent[1])))


def _tried(function: Formula, speed: float) -> float:
    """The function at a speed, or an error that says what is wrong with it."""
    try:
        value = function(float(speed))
    except (ArithmeticError, ValueError, TypeError) as error:
        raise ParameterError(f"the friction law fails at {speed:g} m/s: {error}") from error
    if not isinstance(value, numbers.Real) or not math.isfinite(value):
        raise ParameterError(f"the friction law must give a finite number at {speed:g} m/s, not {value!r}")
    return float(value)


def _check_compiles(function: Formula) -> None:
    """Raise ParameterError, with numba's reason, for a function that compiled code cannot call with a number."""
    try:
        numba.njit(getattr(function, "py_func", function)).compile("float64(float64)")
    except numba.core.errors.NumbaError as error:
        reason = next((line for line in str(error).splitlines()[1:] if line.strip()), str(error))
        raise ParameterError(f"numba cannot compile the friction law: {reason.strip()}") from error


def _formulas(function: Any) -> SimpleNamespace:
    """The methods of a law, for plain and for compiled code, of its function."""

    @_for_both
    def friction(speed: Any, law: Any) -> Any:
        return function(speed) if speed >= 0.0 else law.rest + speed * (law.slope + 0.5 * law.curvature * speed)

    @_for_both
    def bend_about(v: Any, h: Any) -> Any:
        near, far = function(v + h) + function(v - h), function(v + 2.0 * h) + function(v - 2.0 * h)
        return (16.0 * near - far - 30.0 * function(v)) / (12.0 * h * h)

    @_for_both
    def bend(speed: Any, law: Any) -> Any:
        h = WIDER * max(STEPS[0] * law.scale, STEPS[1] * speed)
        v = max(speed, 2.0 * h)
        about = bend_about(v, h)
        return about if speed >= v else about + (speed - v) * (bend_about(v + h, h) - about) / h

    def rise(speed: Any, law: Any) -> Any:
        h = max(STEPS[0] * law.scale, STEPS[1] * speed)
        v = max(speed, 2.0 * h)
        near, far = function(v + h) - function(v - h), function(v + 2.0 * h) - function(v - 2.0 * h)
        about = (8.0 * near - far) / (12.0 * h)
        return about if speed >= v else about + 0.5 * (speed - v) * (bend(v, law) + bend(speed, law))

    return SimpleNamespace(
        **{name: getattr(FrictionLaw, name) for name in ("row_at", "row_ends", "row_spacing", "only_row")},
        friction=friction,
        slope_of_friction=rise,
        curvature_of_friction=bend,
    )


def _for_both(function: Any) -> Any:
    """The function itself, which compiled code may now call too."""
    if isinstance(function, numba.core.dispatcher.Dispatcher):
        return function
    return numba.extending.register_jitable(**OPTIONS)(function)


def _code_key(function: Formula) -> str:
    """What a compiled form of the function depends on: its file, its place there, and the numbers around it.

    Random, so that nothing is kept, for a function without a file or with anything but numbers, modules and functions
    around it.
    """
    plain = getattr(function, "py_func", function)
    if not isinstance(plain, FunctionType):
        return os.urandom(16).hex()
    around = inspect.getclosurevars(plain)
    key = [file_key(plain), plain.__qualname__, str(plain.__code__.co_firstlineno), repr(plain.__defaults__)]
    for name, value in sorted({**around.globals, **around.nonlocals}.items()):
        if isinstance(value, numbers.Number | str | tuple):
            key.append(f"{name}={value!r}")
        elif not isinstance(value, ModuleType):
            key.append(f"{name}={_code_key(value)}")
    return " ".join(key)
