"""Packages that are installed otherwise than the lock file pins them: what they compute is kept apart."""

from __future__ import annotations

import sys
from functools import cache
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from roughslip.errors import InputError
from roughslip.scene.strict_yaml import shown

_SHOWN = 3
_INFO = ".dist-info"


@cache
def departures(lock: str) -> tuple[str, ...]:
    """`numpy 2.4.6 in place of 2.5.0`, of each package that the text of a lock file pins for this Python.

    Raises InputError for a line that pins nothing.
    """
    there, found = _installed(), []
    for line in lock.splitlines():
        if "==" in line and not line.startswith(("#", " ")):
            pinned = _requirement(line.rstrip(" \\"))
            version = there.get(canonicalize_name(pinned.name))
            if (pinned.marker is None or pinned.marker.evaluate()) and (
                version is None or version not in pinned.specifier
            ):
                found.append(f"{pinned.name} {version or 'missing'} in place of {str(pinned.specifier).lstrip('=')}")
    return tuple(found)


def told(lock: str) -> list[str]:
    """A line for whoever starts a run, where there is something to tell."""
    found = departures(lock)
    if not found:
        return []
    more = f" and {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    return [
        f"requirements.lock: installed are {', '.join(found[:_SHOWN])}{more}; results are kept apart from those of the "
        "locked packages, which `make setup` installs"
    ]


def _requirement(line: str) -> Requirement:
    try:
        return Requirement(line)
    except InvalidRequirement:
        raise InputError(f"requirements.lock: {shown(line)} pins no package; put the file back as it was") from None


def _installed() -> dict[str, str]:
    """Versions of installed packages by name, as their folders have them: to read each takes ten times as long."""
    found: dict[str, str] = {}
    for folder in map(Path, sys.path):
        for info in folder.glob(f"*{_INFO}"):
            name, _, version = info.name.removesuffix(_INFO).partition("-")
            found.setdefault(canonicalize_name(name), version)
    return found
