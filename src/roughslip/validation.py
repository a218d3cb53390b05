"""What is given to the package must be: the checks of single values, and the gate of public functions."""

import collections.abc
import functools
import inspect
import math
import types
import typing
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from roughslip.errors import ParameterError, real, whole

Public = TypeVar("Public", bound=Callable[..., Any])
Check = Callable[[str, Any], Any]  # takes a name and a value; returns the value as the function wants it


def gate(public: Public) -> Public:
    """Decorate a public function, or a class that users make, so that its arguments are what its annotations say.

    Lists, DataArrays and all else that numpy reads become arrays of numbers; whether these are finite, and their
    dimensions, the function itself checks (`finite`). Arguments of another type raise ParameterError, in a line that
    names the argument, as do masked entries, and text or None in place of a number.
    """
    inner: Any = public.__init__ if isinstance(public, type) else public  # type: ignore[misc]
    own = int(inner is not public)  # self

    @functools.cache
    def checks() -> dict[str, Check]:
        own_hints = {name: hint for name, hint in inner.__annotations__.items() if name != "return"}
        hints = typing.get_type_hints(types.SimpleNamespace(__annotations__=own_hints), inner.__globals__)
        names = [p.name for p in inspect.signature(inner).parameters.values() if p.kind != p.VAR_KEYWORD][own:]
        return {name: _check(hints.get(name, Any)) for name in names}

    @functools.wraps(inner)
    def checked(*args: Any, **keywords: Any) -> Any:
        by_name, given = checks(), list(args)
        for place, (name, check) in zip(range(own, len(given)), by_name.items(), strict=False):
            given[place] = check(name, given[place])
        for name in by_name.keys() & keywords.keys():
            keywords[name] = by_name[name](name, keywords[name])
        return inner(*given, **keywords)

    if own:
        public.__init__ = checked  # type: ignore[method-assign]
        return public
    return typing.cast(Public, checked)


def _check(hint: Any) -> Check:
    """The check of an annotation, for the kinds that the package has."""
    kind, parts = typing.get_origin(hint), typing.get_args(hint)
    if kind in (typing.Union, types.UnionType):
        others = [_check(part) for part in parts if part not in (types.NoneType, np.ndarray)]
        return functools.partial(_one_of, np.ndarray in parts, others, types.NoneType in parts)
    if hint is np.ndarray:
        return array
    if hint in (float, int):
        return real if hint is float else whole
    if kind is typing.Literal:
        return functools.partial(_word, parts)
    if kind in (tuple, collections.abc.Sequence):
        is_fixed = kind is tuple and Ellipsis not in parts
        return functools.partial(_items, is_fixed, [_check(part) for part in parts if part is not Ellipsis])
    if kind is collections.abc.Iterable:
        return _rows
    if getattr(hint, "_is_protocol", False):
        return functools.partial(_follows, hint)
    plain = kind or hint
    if isinstance(plain, type) and plain is not Any:
        return functools.partial(_instance, (bool, np.bool_) if plain is bool else plain, _article(plain))
    return lambda name, value: value


def _one_of(or_array: bool, checks: list[Check], optional: bool, name: str, value: Any) -> Any:
    """One kind of a union: an array where the value is one, else the first whose check it passes."""
    if value is None and optional:
        return value
    if or_array and hasattr(value, "__array__") and np.ndim(value):
        return array(name, value)
    errors = []
    for check in [*checks, array] if or_array else checks:
        try:
            return check(name, value)
        except ParameterError as error:
            errors.append(error)
    raise errors[0]


def _items(is_fixed: bool, checks: list[Check], name: str, values: Any) -> Any:
    """A tuple or sequence: each of its items is checked; arrays will do."""
    if hasattr(values, "__array__"):
        values = tuple(array(name, values))
    if not isinstance(values, (tuple, list, range)):
        raise ParameterError(f"{name} must be a sequence, not {_named(values)}")
    if is_fixed and len(values) != len(checks):
        raise ParameterError(f"{name} must have {len(checks)} entries, not {len(values)}")
    each = checks if is_fixed else checks * len(values)
    return tuple(check(name, value) for check, value in zip(each, values, strict=True))


def _rows(name: str, values: Any) -> Any:
    """An iterable of arrays, which may have no end; what it gives is checked when it comes."""
    if hasattr(values, "__array__"):
        return finite(name, values, 2)
    if isinstance(values, str) or not isinstance(values, collections.abc.Iterable):
        raise ParameterError(f"{name} must be an array or an iterable of arrays, not {_named(values)}")
    return values


def _instance(accepted: type | tuple[type, ...], wanted: str, name: str, value: Any) -> Any:
    if not isinstance(value, accepted):
        raise ParameterError(f"{name} must be {wanted}, not {_named(value)}")
    return value


def _word(words: tuple[Any, ...], name: str, value: Any) -> Any:
    if not (isinstance(value, str) and value in words):
        raise ParameterError(f"{name} must be {', '.join(words[:-1])} or {words[-1]}, not {_named(value)}")
    return value


def _follows(protocol: type, name: str, value: Any) -> Any:
    """Members are looked up without a call: a property may compute."""
    members = (member for member in vars(protocol) if not member.startswith("_"))
    if any(inspect.getattr_static(value, member, None) is None for member in members):
        raise ParameterError(f"{name} must be {_article(protocol)}, not {_named(value)}")
    return value


def _article(kind: type) -> str:
    name = kind.__name__
    words = {"str": "text", "bool": "True or False", "Mapping": "a mapping", "Callable": "a function"}
    return words.get(name, f"{'an' if name[0] in 'AEIOU' else 'a'} {name}")


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
        raise ParameterError(f"{name} must have {dimensions} dimensions, not the shape {numbers.shape}")
    if wrong := np.count_nonzero(~np.isfinite(numbers)):
        raise ParameterError(f"{name} must be finite, not {wrong} of its {numbers.size} numbers")
    return numbers


def positive(name: str, value: Any, unit: str = "", or_zero: bool = False) -> float:
    """The value as a float; ParameterError where it is not positive and finite. unit : of the value, for the error"""
    number = real(name, value)
    if not (0.0 < number < math.inf or (or_zero and number == 0.0)):
        wanted = "finite and not negative" if or_zero else "positive and finite"
        raise ParameterError(f"{name} must be {wanted}, not {f'{value} {unit}'.rstrip()}")
    return number


def not_negative(name: str, value: Any, unit: str = "") -> float:
    """The same with zero allowed."""
    return positive(name, value, unit, or_zero=True)


def whole_at_least(name: str, value: Any, minimum: int) -> int:
    """The value as a whole number; ParameterError where it is none, or below the least."""
    number = whole(name, value)
    if number < minimum:
        raise ParameterError(f"{name} must be at least {minimum}, not {number}")
    return number
