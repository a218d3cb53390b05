"""What is given to the package must be, and the one gate of its public functions."""

from __future__ import annotations

import collections.abc
import dataclasses
import functools
import inspect
import itertools
import math
import operator
import re
import sys
import types
import typing
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from roughslip.errors import ParameterError, real, whole

if TYPE_CHECKING:
    import xarray as xr

    Field = np.ndarray | xr.DataArray
else:
    Field = np.ndarray  # the gate makes one of a DataArray

Public = TypeVar("Public", bound=Callable[..., Any])
Check = Callable[[str, Any], Any]  # takes a name and a value; returns the value as the function wants it

# An array in a docstring: its names, its shape, its unit if it has one, what it is.
_ARRAY = re.compile(r"^ +(\w+(?:, \w+)*) : \(([^()]*)\)(?: (\[[^\]]*\]))?(.*)$", re.MULTILINE)


def gate(public: Public) -> Public:
    """Decorate a public function, or a class that users make, so that its arguments are checked first.

    The annotations say what an argument must be. The docstring says the shape of an array, as `mu, valid : (S, W)`: its
    dimensions are counted, and equal letters are equal numbers. An array with a unit is finite and becomes one of
    doubles. Lists, DataArrays and all else that numpy reads are arrays. Results of the shape of a DataArray of two
    dimensions have its coordinates.

    Arguments raise ParameterError, in a line that names the argument. They do so where they are of another type or of
    other dimensions, have masked entries, or are text or None in place of a number.
    """
    inner: Any = public.__init__ if isinstance(public, type) else public  # type: ignore[misc]
    own = int(inner is not public)  # self

    @functools.cache
    def checks() -> tuple[dict[str, Check], list[tuple[str, Check]], list[tuple[int, str, tuple[str, ...]]]]:
        own_hints = {name: hint for name, hint in inner.__annotations__.items() if name != "return"}
        hints = typing.get_type_hints(types.SimpleNamespace(__annotations__=own_hints), inner.__globals__)
        shapes = _shapes(public.__doc__ or "")
        names = [p.name for p in inspect.signature(inner).parameters.values() if p.kind != p.VAR_KEYWORD][own:]
        letters = {name: shape.dimensions for name, shape in shapes.items() if name in names and shape.dimensions}
        often = Counter(itertools.chain.from_iterable(letters.values()))
        compared = [
            (names.index(name) + own, name, row)
            for name, row in letters.items()
            if any(often[letter] > 1 or letter.isdigit() for letter in row)
        ]
        by_name = {name: _check(hints.get(name, Any), shapes.get(name)) for name in names}
        return by_name, list(by_name.items()), compared

    @functools.wraps(inner)
    def checked(*args: Any, **keywords: Any) -> Any:
        by_name, in_order, compared = checks()
        given = list(args)
        labelled = _labelled(given, keywords) if "xarray" in sys.modules else None
        for place, (name, check) in zip(range(own, len(given)), in_order, strict=False):
            given[place] = check(name, given[place])
        for name, value in keywords.items():
            if name in by_name:
                keywords[name] = by_name[name](name, value)
        if len(compared) > 1:
            _agree(
                [
                    (name, row, value)
                    for place, name, row in compared
                    if isinstance(value := given[place] if place < len(given) else keywords.get(name), np.ndarray)
                ]
            )
        result = inner(*given, **keywords)
        return result if labelled is None else _labelled_as(labelled, result)

    if own:
        public.__init__ = checked  # type: ignore[method-assign]
        return public
    return typing.cast(Public, checked)


def _labelled(given: list[Any], keywords: dict[str, Any]) -> xr.DataArray | None:
    """The first DataArray of two dimensions among the arguments.

    Raises ParameterError where the steps of its coordinates are not those of a mesh among them.
    """
    kind, arguments = sys.modules["xarray"].DataArray, (*given, *keywords.values())
    field = next((value for value in arguments if isinstance(value, kind) and value.ndim == 2), None)
    grid = next((value.grid for value in arguments if hasattr(value, "grid")), None)
    if field is None or grid is None:
        return field
    for axis, edge in (("x", grid.dx), ("y", grid.dy)):
        if axis in field.coords and field.sizes.get(axis, 1) > 1:
            step = float(abs(field[axis].diff(axis)).mean())
            if abs(step - edge) > 1e-3 * edge:
                line = f"{axis} of the heights has steps of {step:.6g} m, the mesh has cells of {edge:.6g} m"
                raise ParameterError(f"{line}: take Grid.of(heights)")
    return field


def _labelled_as(field: xr.DataArray, result: Any, name: str | None = None) -> Any:
    """A result whose arrays of the shape of the field, also in parts of it, have the coordinates of the field."""
    if isinstance(result, np.ndarray) and result.shape == field.shape:
        return type(field)(result, field.coords, field.dims, name)
    if type(result) in (list, tuple):
        return type(result)(_labelled_as(field, part) for part in result)
    if not dataclasses.is_dataclass(result) or isinstance(result, type):
        return result
    parts = {field.name: getattr(result, field.name) for field in dataclasses.fields(result)}
    made = {name: _labelled_as(field, part, name) for name, part in parts.items()}
    changed = {name: part for name, part in made.items() if part is not parts[name]}
    return dataclasses.replace(result, **changed) if changed else result


class _Shape(typing.NamedTuple):
    """dimensions : their letters or numbers, None for any; real : it has a unit; truth : it may be of bool"""

    dimensions: tuple[str, ...] | None
    real: bool
    truth: bool


_ROW = _Shape(("entries",), False, False)
_ROWS = (tuple, list, collections.abc.Sequence, collections.abc.Iterable)


@functools.cache
def _shapes(docstring: str) -> dict[str, _Shape]:
    """The arrays of a docstring by name."""
    arrays = {}
    for names, shape, unit, text in _ARRAY.findall(docstring):
        letters = tuple(part.strip() for part in shape.split(",") if part.strip())
        known = None if {"...", "any shape"} & set(letters) else letters
        arrays.update(dict.fromkeys(names.split(", "), _Shape(known, bool(unit), "bool" in text)))
    return arrays


def _agree(arrays: list[tuple[str, tuple[str, ...], np.ndarray]]) -> None:
    """Raise ParameterError where two arrays differ in a dimension of one letter, or one from its number.

    arrays : name, letters of the dimensions, and values
    """
    sizes: dict[str, tuple[str, int]] = {}
    for name, row, value in arrays if len(arrays) > 1 else ():
        if not value.size:
            continue
        for letter, size in zip(row, value.shape, strict=False):
            if letter.isdigit() and int(letter) != size:
                raise ParameterError(f"{name} {value.shape} must have {letter} entries in a dimension, not {size}")
            other, expected = sizes.setdefault(letter, (name, size)) if letter.isidentifier() else ("", size)
            if size != expected:
                raise ParameterError(f"{name} has {size} {letter}, {other} has {expected}; they must be the same")


def _check(hint: Any, shape: _Shape | None) -> Check:
    """The check of an annotation, for the kinds that the package has."""
    kind, parts = typing.get_origin(hint), typing.get_args(hint)
    if kind in (typing.Union, types.UnionType):
        classes = tuple(part for part in parts if isinstance(part, type) and _is_class(part))
        if classes == parts:
            return functools.partial(_instance, classes, " or ".join(map(_article, classes)))
        row = any(typing.get_origin(part) in _ROWS for part in parts)  # an array in place of a sequence
        of_array = _check(np.ndarray, shape or (_ROW if row else None)) if np.ndarray in parts else None
        others = [_check(part, shape) for part in parts if part not in (types.NoneType, np.ndarray)]
        return functools.partial(_one_of, of_array, others, types.NoneType in parts)
    if hint is np.ndarray:
        return functools.partial(_shaped, shape or _Shape(None, False, True))
    if hint in (float, int):
        return real if hint is float else whole
    if kind is typing.Literal:
        return functools.partial(_word, parts)
    if kind in _ROWS[:3]:
        return functools.partial(_items, kind, [_check(part, _ROW) for part in parts if part is not Ellipsis], parts)
    if kind is collections.abc.Mapping:
        return functools.partial(_instance, collections.abc.Mapping, "a mapping")
    if kind is collections.abc.Iterable:
        return _rows
    if kind is collections.abc.Callable:
        return functools.partial(_instance, collections.abc.Callable, "a function")
    if hint is Path:
        return lambda name, value: Path(_instance((str, Path), "a path", name, value))
    if getattr(hint, "_is_protocol", False):
        return functools.partial(_follows, hint)
    if isinstance(hint, type) and hint is not Any:
        return functools.partial(_instance, (bool, np.bool_) if hint is bool else hint, _article(hint))
    return lambda name, value: value


def _one_of(of_array: Check | None, checks: list[Check], optional: bool, name: str, value: Any) -> Any:
    """One kind of a union: an array where the value is one, else the first whose check it passes."""
    if value is None and optional:
        return value
    if of_array and hasattr(value, "__array__") and np.ndim(value):
        return of_array(name, value)
    errors = []
    for check in [*checks, of_array] if of_array else checks:
        try:
            return check(name, value)
        except ParameterError as error:
            errors.append(error)
    raise errors[0]


def _items(kind: type, checks: list[Check], parts: tuple[Any, ...], name: str, values: Any) -> Any:
    """A tuple, list or sequence: each of its items is checked; arrays will do."""
    if hasattr(values, "__array__"):
        values = tuple(array(name, values))
    if not isinstance(values, (tuple, list, range)):
        raise ParameterError(f"{name} must be a sequence, not {_named(values)}")
    fixed = kind is tuple and Ellipsis not in parts
    if fixed and len(values) != len(checks):
        raise ParameterError(f"{name} must have {len(checks)} entries, not {len(values)}")
    each = checks if fixed else checks * len(values)
    return (list if kind is list else tuple)(check(name, value) for check, value in zip(each, values, strict=True))


def _rows(name: str, values: Any) -> Any:
    """An iterable of arrays, which may have no end; what it gives is checked when it comes."""
    if hasattr(values, "__array__"):
        return _shaped(_Shape(("rows", "entries"), True, False), name, values)
    if isinstance(values, str) or not isinstance(values, collections.abc.Iterable):
        raise ParameterError(f"{name} must be an array or an iterable of arrays, not {_named(values)}")
    return values


def _shaped(shape: _Shape, name: str, values: Any) -> np.ndarray:
    checked = array(name, values)
    if checked.dtype.kind == "b" and shape.real and not shape.truth:
        raise ParameterError(f"{name} must be real numbers, not {checked.dtype}")
    if shape.dimensions is not None and checked.ndim != len(shape.dimensions):
        wanted = ", ".join(shape.dimensions) + ("," if len(shape.dimensions) == 1 else "")
        raise ParameterError(f"{name} must have the dimensions ({wanted}), not the shape {checked.shape}")
    if not shape.real or checked.dtype.kind == "b":
        return checked
    checked = np.asarray(checked, np.float64)
    if not np.logical_and.reduce(np.isfinite(checked), axis=None):  # what `all` does after some microseconds
        raise ParameterError(_not_finite(name, checked))
    return checked


def _not_finite(name: str, values: np.ndarray) -> str:
    return f"{name} must be finite, not {np.count_nonzero(~np.isfinite(values))} of its {values.size} numbers"


def _instance(accepted: type | tuple[type, ...], wanted: str, name: str, value: Any) -> Any:
    if not isinstance(value, accepted):
        raise ParameterError(f"{name} must be {wanted}, not {_named(value)}")
    return value


def _word(words: tuple[Any, ...], name: str, value: Any) -> Any:
    if not (isinstance(value, str) and value in words):
        raise ParameterError(f"{name} must be {', '.join(words[:-1])} or {words[-1]}, not {_named(value)}")
    return value


def _follows(protocol: type, name: str, value: Any) -> Any:
    members = (member for member in vars(protocol) if not member.startswith("_"))
    if any(inspect.getattr_static(value, member, None) is None for member in members):
        raise ParameterError(f"{name} must be {_article(protocol)}, not {_named(value)}")
    return value


def _is_class(hint: type) -> bool:
    return hint not in (np.ndarray, float, int, Path, types.NoneType) and not getattr(hint, "_is_protocol", False)


def _article(kind: type) -> str:
    name = {"str": "text", "bool": "True or False"}.get(kind.__name__, kind.__name__)
    return name if name != kind.__name__ else f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _named(value: Any) -> str:
    """What a value is, in a message: short ones themselves."""
    return repr(value) if value is None or isinstance(value, (str, int, float)) else type(value).__name__


def array(name: str, values: object) -> np.ndarray:
    """The values as an array of numbers or truths, floats as doubles.

    Raises ParameterError where they are none, or an entry is masked.
    """
    if type(values) is np.ndarray and values.dtype == np.float64:  # at once: the other checks take microseconds
        return values
    if any(np.ma.is_masked(part) for part in (values if isinstance(values, (list, tuple)) else (values,))):
        raise ParameterError(f"{name} has masked entries: give values for them, or leave them out")
    try:
        numbers = np.asarray(values)
    except ValueError:
        raise ParameterError(f"{name} must be an array: its rows differ in length") from None
    if numbers.dtype.kind not in "fiub":
        what = numbers.dtype if isinstance(values, np.ndarray) else _named(values)
        raise ParameterError(f"{name} must be an array of real numbers, not {what}")
    return np.asarray(numbers, np.float64 if numbers.dtype.kind == "f" else numbers.dtype.newbyteorder("="))


def reals(name: str, values: object) -> np.ndarray:
    """The values as an array of floats; ParameterError where they are no real numbers, or masked."""
    numbers = array(name, values)
    if numbers.dtype.kind == "b":
        raise ParameterError(f"{name} must be real numbers, not {numbers.dtype}")
    return numbers.astype(float, copy=False)


def finite(name: str, values: Any, dimensions: int | None = None) -> np.ndarray:
    """The values as doubles.

    values : real numbers
    dimensions : number of their dimensions; any if not given

    Raises ParameterError where they are no such array, or a value is masked or not finite.
    """
    numbers = reals(name, values)
    if dimensions is not None and numbers.ndim != dimensions:
        raise ParameterError(f"{name} {numbers.shape} must have {dimensions} dimensions")
    if not np.isfinite(numbers).all():
        raise ParameterError(_not_finite(name, numbers))
    return numbers


def positive(name: str, value: Any, unit: str = "") -> float:
    """The value as a float; ParameterError where it is not positive and finite. unit : of the value, for the error"""
    number = real(name, value)
    if not 0.0 < number < math.inf:
        raise ParameterError(f"{name} must be positive and finite, not {f'{value} {unit}'.rstrip()}")
    return number


def not_negative(name: str, value: Any, unit: str = "") -> float:
    """The value as a float; ParameterError where it is negative or not finite. unit : of the value, for the error"""
    number = real(name, value)
    if not 0.0 <= number < math.inf:
        raise ParameterError(f"{name} must be finite and not negative, not {f'{value} {unit}'.rstrip()}")
    return number


def whole_at_least(name: str, value: Any, minimum: int) -> int:
    """The value as a whole number; ParameterError where it is none, or below the least."""
    try:
        number = operator.index(value)
    except TypeError as error:
        raise ParameterError(f"{name} must be a whole number, not {value!r}") from error
    if number < minimum:
        raise ParameterError(f"{name} must be at least {minimum}, not {number}")
    return number
