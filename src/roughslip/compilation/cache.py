"""Compile functions with numba, kept on disk in a folder that is named by the code that is compiled.

numba compares the file of a function only: it does not see an edit of a compiled function that is called from another
file. Here the folder of a module carries the hash of its import closure. So no edit is missed, an edit of a docstring
compiles nothing, and equal code has one folder.
"""

import contextlib
import fcntl
import hashlib
import logging
import time
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import IO, Any

import numba
from numba.core import caching
from numba.core.types import unliteral

from roughslip.compilation import source_hash

__all__ = ["compiled"]

LONGEST = 60.0  # [s] that another process is awaited, which compiles a function in a few seconds
_SOURCE = Path(__file__).resolve().parents[2]
# numba would take an option that is not given from the caller for which it happens to compile a function first. The
# bits of a result then depended on the order of calls. A division by zero is inf or NaN, as in numpy.
_OPTIONS = {"error_model": "numpy", "fastmath": False, "forceinline": False, "no_cfunc_wrapper": True}


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles a function at its first call and keeps it on disk.

    options : those of numba's njit; where not given, those of the caller do not count

    A call from compiled code has one form for all values of arguments, where numba makes one a constant.
    """

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = numba.njit(**{**_OPTIONS, **options})(function)
        with contextlib.suppress(OSError, RuntimeError):  # a function typed at a prompt is compiled in each process
            dispatcher._cache = _Cache(function)  # as `cache=True`, with the folder of the module
        of_types = dispatcher.get_call_template

        def call_template(args: Sequence[Any], kws: Mapping[str, Any]) -> Any:
            return of_types([*map(unliteral, args)], {k: unliteral(kws[k]) for k in kws})

        dispatcher.get_call_template = call_template
        return dispatcher

    return decorate


@cache
def _folder(file: Path) -> Path:
    """The folder of a file, named by the hash of its code: of a module of the package that of its import closure.

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


class _Cache(caching.FunctionCache):
    """The compiled forms of one function, by the types of its arguments."""

    _impl_class = _Implementation
    _turn: IO[str] | None = None  # held while this process compiles the function

    def load_overload(self, sig: object, target_context: Any) -> Any:
        """The compiled form for these types of arguments, None if it must be compiled.

        Where another process compiles the function, it is awaited, and its form is taken.
        """
        compiled_form = super().load_overload(sig, target_context)
        if compiled_form is None and self._turn is None:
            with contextlib.suppress(OSError):  # a folder that cannot be written to
                Path(self._cache_path).mkdir(parents=True, exist_ok=True)
                self._turn = Path(self._cache_path, f"{self._impl.filename_base}.lock").open("a")  # noqa: SIM115
                _lock(self._turn)
                compiled_form = super().load_overload(sig, target_context)
        if compiled_form is None:
            _announce("compiling, once for this version of the code, about 10 s")
        else:
            self._end_turn()
        return compiled_form

    def _load_overload(self, sig: object, target_context: Any) -> Any:
        try:
            return super()._load_overload(sig, target_context)
        except (ImportError, AttributeError):  # the index names a type of argument that has another name now
            self.flush()
            return None

    def save_overload(self, sig: object, data: Any) -> None:
        """Store a compiled form. Without the turn two processes could give one name to two forms."""
        try:
            super().save_overload(sig, data)
        except OSError as error:
            _announce(f"compiled code is not kept: {self._cache_path}: {error.strerror}")
        self._end_turn()

    def _end_turn(self) -> None:
        if self._turn is not None:
            self._turn.close()
            self._turn = None


def _lock(file: IO[str]) -> None:
    """Lock a file as soon as no other process holds it; go on without after LONGEST, or where there are no locks."""
    end = time.monotonic() + LONGEST
    while time.monotonic() < end:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            time.sleep(0.05)
        except OSError:
            return
        else:
            return


@cache
def _announce(message: str) -> None:
    """Log a message, once in a process; a program without handlers of its own has it on stderr."""
    source_hash.keep()
    logging.getLogger("roughslip").warning("roughslip: %s", message)
