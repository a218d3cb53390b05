"""The decorator `compiled`: numba's njit with a cache named by the code that is compiled.

numba compares a function's own file only: a compiled function that calls one in another file would go stale without a
message. Here the folder of a module carries the hash of its import closure, so edits of a docstring or of other modules
compile nothing, and equal code is compiled once, whatever the folder that it lies in. A process that finds nothing in
the cache locks that folder: others wait and then load.
"""

from __future__ import annotations

import contextlib
import fcntl
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import IO, Any

import numba
from numba.core import caching

from roughslip import source_hash

__all__ = ["compiled"]

_SOURCE = Path(__file__).resolve().parents[1]


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """A decorator that compiles a function at its first call, cached on disk. options : those of numba's njit"""

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**options)(function)
        # What `cache=True` does, with the folder and the lock of this module.
        dispatcher._cache = _Cache(function)
        return dispatcher

    return decorate


@cache
def _module_folder(file: str) -> Path:
    """The folder of a module's compiled functions, which carries the hash of its closure."""
    module = ".".join(Path(file).resolve().relative_to(_SOURCE).with_suffix("").parts)
    digest = source_hash.closure_hash(module, _SOURCE)[:20]
    return source_hash.compiled_folder() / f"{module.removeprefix('roughslip.')}-{digest}"


class _Locator(caching._CacheLocator):
    """Tells numba where the compiled forms of one function are."""

    def __init__(self, file: str) -> None:
        self._folder = _module_folder(file)

    def get_cache_path(self) -> str:
        return str(self._folder)

    def get_source_stamp(self) -> str:
        return self._folder.name

    def get_disambiguator(self) -> str:
        return "0"  # names of functions are unique within a module

    @classmethod
    def from_function(cls, py_func: object, py_file: str) -> _Locator | None:
        locator = cls(py_file)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


class _Implementation(caching.CompileResultCacheImpl):
    _locator_classes: list[Any] = [_Locator, caching.UserWideCacheLocator]  # noqa: RUF012


class _Cache(caching.FunctionCache):
    """A cache of one function that is locked from a miss until the function is compiled."""

    _impl_class = _Implementation

    def load_overload(self, sig: object, target_context: Any) -> Any:
        found = super().load_overload(sig, target_context)
        if found is None and self._enabled:
            _lock(self.cache_path)
            found = super().load_overload(sig, target_context)  # another process may have compiled it meanwhile
            if found is not None:
                _unlock(self.cache_path)
        return found

    def save_overload(self, sig: object, data: Any) -> None:
        try:
            super().save_overload(sig, data)
        finally:
            _unlock(self.cache_path)


_locks: dict[str, tuple[IO[str], int]] = {}  # by folder the lock, and how many functions of it are being compiled
_announced: list[str] = []


def _lock(folder: str) -> None:
    """Hold the lock of a folder; a function that calls others of its module is compiled around them."""
    if folder in _locks:
        file, depth = _locks[folder]
        _locks[folder] = file, depth + 1
        return
    with contextlib.suppress(OSError):  # a file system without locks: compiled twice at worst
        file = (Path(folder) / "lock").open("a", encoding="utf-8")
        fcntl.flock(file, fcntl.LOCK_EX)
        _locks[folder] = file, 1
    if not _announced:
        _announced.append(folder)
        source_hash.keep()
        print("roughslip: compiling functions for the first time, up to a minute", file=sys.stderr, flush=True)


def _unlock(folder: str) -> None:
    if folder in _locks:
        file, depth = _locks[folder]
        if depth > 1:
            _locks[folder] = file, depth - 1
            return
        del _locks[folder]
        file.close()
