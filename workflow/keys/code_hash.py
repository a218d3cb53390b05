"""Hash what a stage runs: the import closure of its module, the locked packages, and departures from the lock."""

from __future__ import annotations

import hashlib
import sys
from functools import cache
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from roughslip.compilation.source_hash import FRAME, closure_hash
from roughslip.errors import InputError
from roughslip.scene.mistakes import shown

_SHOWN = 3
_INFO = ".dist-info"


def code_hash(module_name: str, source_root: str | Path, lock: str | Path) -> str:
    """SHA-256 of what the closure of a module does, of the locked packages, and of packages that differ from the lock.

    Comments, docstrings and layout do not change it, nor do modules of FRAME. A file that moves changes it.
    """
    digest = hashlib.sha256(closure_hash(module_name, Path(source_root), without=FRAME).encode())
    locked = Path(lock).read_text(encoding="utf-8")
    digest.update("\n".join([*_pins(locked), *departures(locked)]).encode())
    return digest.hexdigest()


@cache
def _pins(lock: str) -> tuple[str, ...]:
    """The lines of a lock file without its comments."""
    lines = (line.strip() for line in lock.splitlines())
    return tuple(line for line in lines if line and not line.startswith("#"))


@cache
def departures(lock: str) -> tuple[str, ...]:
    """Return `numpy 2.4.6 in place of 2.5.0` for each package that differs from its pin in the text of a lock file.

    Pins for other systems or Python versions do not count.

    Raises InputError for a line that pins nothing.
    """
    there, differing = _installed(), []
    for line in lock.splitlines():
        if "==" in line and not line.startswith(("#", " ")):
            pinned = _requirement(line.rstrip(" \\"))
            version = there.get(canonicalize_name(pinned.name))
            if (pinned.marker is None or pinned.marker.evaluate()) and (
                version is None or version not in pinned.specifier
            ):
                wanted = str(pinned.specifier).lstrip("=")
                differing.append(f"{pinned.name} {version or 'missing'} in place of {wanted}")
    return tuple(differing)


def report(lock: str) -> list[str]:
    """Return a line about these packages for the user, or none."""
    differing = departures(lock)
    if not differing:
        return []
    more = f" and {len(differing) - _SHOWN} more" if len(differing) > _SHOWN else ""
    return [
        f"requirements.lock: installed are {', '.join(differing[:_SHOWN])}{more}; jobs of other versions run again; "
        "`make setup` installs the locked packages"
    ]


def _requirement(line: str) -> Requirement:
    try:
        return Requirement(line)
    except InvalidRequirement:
        raise InputError(
            f"requirements.lock: {shown(line)} pins no package; restore the file, for example with git"
        ) from None


def _installed() -> dict[str, str]:
    """Versions of installed packages by name, from the names of their folders: reading each takes ten times as long."""
    versions: dict[str, str] = {}
    for folder in map(Path, sys.path):
        for info in folder.glob(f"*{_INFO}"):
            name, _, version = info.name.removesuffix(_INFO).partition("-")
            versions.setdefault(canonicalize_name(name), version)
    return versions
