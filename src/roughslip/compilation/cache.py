"""Compile functions with numba, cached on disk under the hash of the code that is compiled.

numba compares the file of a function only: it does not see an edit of a compiled function that is called from another
file. Here the cache folder of a module carries the hash of its import closure. So no edit is missed, an edit of a
docstring compiles nothing, and equal code has one folder. A friction law in a file of the user is part of the key of
what is compiled for it. Each file ends with a checksum, because numba would run a damaged one.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import inspect
import io
import logging
import os
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

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
        try:  # what `cache=True` does, with the folder of the module
            outer._cache, inner._cache = _Cache(function, "outer"), _Cache(function, "inner")
        except (OSError, RuntimeError):
            _announce_not_kept()

        def call_template(args: Sequence[Any], kws: Mapping[str, Any]) -> Any:
            return inner.get_call_template([*map(unliteral, args)], {k: unliteral(kws[k]) for k in kws})

        outer.get_call_template, outer.get_overload = call_template, inner.get_overload
        return outer

    return decorate


@cache
def _folder(file: Path) -> Path:
    """The cache folder of a file, named by the hash of its code: of a module of the package that of its import closure.

    Of a file of the user its bytes count, and what it imports of the package. Raises OSError where there is no file.
    """
    if file.is_relative_to(_SOURCE):
        name = ".".join(file.relative_to(_SOURCE).with_suffix("").parts)
        digest = source_hash.closure_hash(name, _SOURCE)
    else:
        name, imported = file.stem, source_hash.imported_modules(file, file.stem, "roughslip", _SOURCE)
        code = source_hash.closure_hash(" ".join(imported), _SOURCE).encode()
        digest = hashlib.sha256(file.read_bytes() + code).hexdigest()
    return source_hash.compiled_folder() / f"{name.removeprefix('roughslip.')}-{digest[:20]}"


@cache
def _own_code(kind: type) -> str:
    """The hash of the file that defines a named tuple where that is of the user, as of a friction law; else nothing."""
    if kind.__module__.partition(".")[0] == "roughslip":
        return ""
    return file_key(kind)


def file_key(defined: Any) -> str:
    """The hash of the file that defines a class or function of the user, and of what it imports of the package."""
    try:
        return _folder(Path(inspect.getfile(defined)).resolve()).name
    except (TypeError, OSError):  # typed at a prompt: compiled in each process
        return os.urandom(16).hex()


def _named_tuples(kinds: Iterable[Any]) -> Iterator[type]:
    """The classes of named tuples among types of numba, also of those in tuples."""
    for kind in kinds:
        if isinstance(kind, numba.types.NamedTuple | numba.types.NamedUniTuple):
            yield kind.instance_class
        yield from _named_tuples(getattr(kind, "types", ()))


class _Locator(caching.InTreeCacheLocator):
    """Where numba finds the compiled forms of one function."""

    def __init__(self, _: object, file: str) -> None:
        self._py_file, self._lineno = file, 0  # names of functions are unique within a module
        self._cache_path = str(_folder(Path(file).resolve()))

    def get_source_stamp(self) -> str:
        """What numba compares to see that a compiled form is of the present code."""
        return Path(self._cache_path).name


class _Implementation(caching.CompileResultCacheImpl):
    _locator_classes: list[Any] = [_Locator]  # noqa: RUF012


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
    """A cache of one form of a function."""

    _impl_class = _Implementation

    def __init__(self, function: Callable[..., Any], form: str) -> None:
        super().__init__(function)
        stamp = self._impl.locator.get_source_stamp()
        self._cache_file = _CheckedFiles(self._cache_path, f"{self._impl.filename_base}.{form}", stamp)

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """The compiled form for these types of arguments, None if it must be compiled."""
        compiled_form = super().load_overload(sig, target_context)
        if compiled_form is None:
            _announce("compiling, once for this version of the code, about 10 s")
        return compiled_form

    def save_overload(self, sig: object, data: Any) -> None:
        """Store a compiled form. Without a lock two processes could give one name to two forms."""
        folder = Path(self._cache_path)
        try:
            with (folder / "lock").open("a", encoding="utf-8") as lock:
                with contextlib.suppress(OSError):  # a file system without locks
                    fcntl.flock(lock, fcntl.LOCK_EX)
                super().save_overload(sig, data)
        except OSError:
            _announce_not_kept()
        _remove_old_versions(folder)

    def _index_key(self, sig: Any, codegen: Any) -> tuple[Any, ...]:
        return (*super()._index_key(sig, codegen), *map(_own_code, _named_tuples(sig)))


@cache
def _announce(message: str) -> None:
    """Log a message, once in a process; a program without handlers of its own has it on stderr."""
    source_hash.keep()
    logging.getLogger("roughslip").warning("roughslip: %s", message)


def _announce_not_kept() -> None:
    _announce(f"compiled code is not kept: {source_hash.compiled_folder()} is full or cannot be written to")


@cache
def _remove_old_versions(folder: Path) -> None:
    """Remove what was compiled from older code of the module of a cache folder, more than _DAYS_KEPT ago."""
    oldest = time.time() - 86400.0 * _DAYS_KEPT
    for other in folder.parent.glob(f"{folder.name.rpartition('-')[0]}-*"):
        if other != folder and other.stat().st_mtime < oldest:
            shutil.rmtree(other, ignore_errors=True)
