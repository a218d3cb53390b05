"""Compile functions with numba, cached on disk under the hash of the code that is compiled.

numba compares the file of a function only: it does not see an edit of a compiled function that is called from another
file. Here the cache folder of a module carries the hash of its import closure. So no edit is missed, an edit of a
docstring compiles nothing, and equal code is compiled once. A process that compiles a module locks its folder, and
others wait. Each file ends with a checksum, because numba would run a damaged one; such a function is compiled again.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import io
import logging
import shutil
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any

import numba
from numba.core import caching
from numba.core.types import unliteral

from roughslip.compilation import source_hash

__all__ = ["compiled"]

_SOURCE = Path(__file__).resolve().parents[2]
_DAYS_KEPT = 30.0  # days that compiled functions of older code are kept
_DIGEST_BYTES = hashlib.sha256().digest_size
# numba would take an option that is not given from the caller for which it happens to compile a function first. The
# bits of a result then depended on the order of calls. A division by zero is inf or NaN, as in numpy.
_OPTIONS = {"error_model": "numpy", "fastmath": False, "forceinline": False, "no_cfunc_wrapper": True}


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function at its first call and caches it.

    options : those of numba's njit; where not given, those of the caller do not count

    Calls from compiled code have a form of their own, without the code that converts arguments of Python, which takes a
    third of the time of compiling. It is one for all values of arguments, where numba makes one a constant.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        outer = numba.njit(**{**_OPTIONS, **options})(function)
        inner = numba.njit(**{**_OPTIONS, **options, "no_cpython_wrapper": True})(function)
        # What `cache=True` does, with the folder and the lock of this module.
        outer._cache, inner._cache = _Cache(function, "outer"), _Cache(function, "inner")

        def call_template(args: Sequence[Any], kws: Mapping[str, Any]) -> Any:
            return inner.get_call_template([*map(unliteral, args)], {k: unliteral(kws[k]) for k in kws})

        outer.get_call_template, outer.get_overload = call_template, inner.get_overload
        return outer

    return decorate


@cache
def _module_folder(file: str) -> Path:
    """The cache folder of a module, which carries the hash of its closure."""
    module = ".".join(Path(file).resolve().relative_to(_SOURCE).with_suffix("").parts)
    digest = source_hash.closure_hash(module, _SOURCE)[:20]
    return source_hash.compiled_folder() / f"{module.removeprefix('roughslip.')}-{digest}"


class _Locator(caching._CacheLocator):
    """Where numba finds the compiled forms of one function."""

    def __init__(self, file: str) -> None:
        self._folder = _module_folder(file)

    def get_cache_path(self) -> str:
        """The folder of the compiled forms."""
        return str(self._folder)

    def get_source_stamp(self) -> str:
        """What numba compares to see that a compiled form is of the present code."""
        return self._folder.name

    def get_disambiguator(self) -> str:
        """What numba adds to the name of a file; names of functions are unique within a module."""
        return "0"

    @classmethod
    def from_function(cls, py_func: object, py_file: str) -> _Locator | None:
        """The locator of a function; None where its folder cannot be written to."""
        locator = cls(py_file)
        try:
            locator.ensure_cache_path()
        except OSError:
            return None
        return locator


class _Implementation(caching.CompileResultCacheImpl):
    """What a compiled form is stored as, in the folder of the project or, failing that, of the user."""

    _locator_classes: list[Any] = [_Locator, caching.UserWideCacheLocator]  # noqa: RUF012


class _CheckedFiles(caching.IndexDataCacheFile):
    """numba's files of one function, each with a checksum at its end, which unpickling ignores."""

    def _load_index(self) -> dict:
        return super()._load_index() if _is_whole(self._index_path) else {}

    def _load_data(self, name: str) -> Any:
        return super()._load_data(name) if _is_whole(self._data_path(name)) else None

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[io.BytesIO]:
        content = io.BytesIO()
        yield content
        with super()._open_for_write(filepath) as file:
            file.write(content.getvalue() + hashlib.sha256(content.getvalue()).digest())


def _is_whole(path: str) -> bool:
    """Whether a file exists and ends with its checksum."""
    try:
        content = Path(path).read_bytes()
    except OSError:
        return False
    return hashlib.sha256(content[:-_DIGEST_BYTES]).digest() == content[-_DIGEST_BYTES:]


class _Cache(caching.FunctionCache):
    """A cache of one function that is locked from a miss until the function is compiled."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any], form: str) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _CheckedFiles(self._cache_path, f"{self._impl.filename_base}.{form}", stamp)

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """The compiled form for these types of arguments; after a miss the folder is locked."""
        found = super().load_overload(sig, target_context)
        if found is None and self._enabled:
            _lock(self.cache_path)
            found = super().load_overload(sig, target_context)  # another process may have compiled it meanwhile
            if found is not None:
                _unlock(self.cache_path)
            else:
                _announce("compiling, once for this version of the code, about 10 s")
        return found

    def save_overload(self, sig: object, data: Any) -> None:
        """Store a compiled form, and release the folder."""
        try:
            super().save_overload(sig, data)
        finally:
            _unlock(self.cache_path)


_locks: dict[str, tuple[IO[str], int]] = {}  # by folder the lock, and how many functions of it are being compiled
_announced: set[str] = set()


def _lock(folder: str) -> None:
    """Hold the lock of a folder; a function that calls others of its module is compiled around them."""
    if folder in _locks:
        file, depth = _locks[folder]
        _locks[folder] = file, depth + 1
        return
    with contextlib.suppress(OSError):  # a file system without locks: compiled twice at worst
        file = (Path(folder) / "lock").open("a", encoding="utf-8")
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            _announce("waiting for functions that another process compiles")
            fcntl.flock(file, fcntl.LOCK_EX)
        _locks[folder] = file, 1
        _remove_old_versions(Path(folder))


def _unlock(folder: str) -> None:
    if folder in _locks:
        file, depth = _locks[folder]
        if depth > 1:
            _locks[folder] = file, depth - 1
            return
        del _locks[folder]
        file.close()


def _announce(message: str) -> None:
    """Log a message, once in a process; a program without handlers of its own has it on stderr."""
    if message not in _announced:
        _announced.add(message)
        source_hash.keep()
        logging.getLogger("roughslip").warning("roughslip: %s", message)


def _remove_old_versions(folder: Path) -> None:
    """Remove what was compiled from older code of the module of a cache folder, more than _DAYS_KEPT ago."""
    oldest = time.time() - 86400.0 * _DAYS_KEPT
    for other in folder.parent.glob(f"{folder.name.rpartition('-')[0]}-*"):
        if other != folder and other.stat().st_mtime < oldest:
            shutil.rmtree(other, ignore_errors=True)
