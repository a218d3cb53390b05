"""Named tuples for the parameters of friction laws of users, by names that change with the code of the law.

Compiled code is kept on disk by the types of its arguments, which are written as names of a module. A process that
reads what is kept may know nothing of the file of a law. So these types are names of this module, and each name tells
the fields: the module makes the type when it is asked for the name.
"""

from __future__ import annotations

import hashlib
from collections import namedtuple
from collections.abc import Iterable
from functools import cache

PREFIX, BETWEEN = "Parameters_", "__"


def named(key: str, fields: Iterable[str]) -> type:
    """The type of some fields. key : text that changes with the code of the law"""
    return __getattr__(BETWEEN.join([f"{PREFIX}{hashlib.sha256(key.encode()).hexdigest()[:24]}", *fields]))


def __getattr__(name: str) -> type:
    if name.startswith(PREFIX):
        return _made(name)
    raise AttributeError(f"module {__name__} has no attribute {name!r}")


@cache
def _made(name: str) -> type:
    """One type for each name, in each process the same."""
    kind = namedtuple(name, name.split(BETWEEN)[1:])  # type: ignore[misc]
    kind.__module__ = __name__
    return kind
