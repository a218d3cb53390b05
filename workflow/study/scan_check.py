"""Read the scan of a scene before the first job, so that its mistakes are found at the start."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from roughslip.errors import InputError
from roughslip.scene.strict_yaml import line
from roughslip.scene.types import get


def scan_mistakes(scene_file: Path, scan_file: Path, scene: dict[str, Any], checked: Path) -> list[str]:
    """Return a line that names the key of the scene if the scan cannot be read as the scene states.

    checked : folder of marks for scans that were read; reading one takes some seconds
    """
    stated = tuple(get(scene, f"roughness.scan.{key}") for key in ("spacing_x_m", "spacing_y_m", "height_unit"))
    mark = checked / hashlib.sha256(scan_file.read_bytes() + repr(stated).encode()).hexdigest()
    if mark.is_file():
        return []
    from roughslip.scan.instrument_file import read_scan  # with numpy and SurfaceTopography, for such scenes alone

    spacing = None if None in stated[:2] else (stated[0], stated[1])
    try:
        read_scan(scan_file, spacing, stated[2])
    except InputError as error:
        return [line(scene_file, ("roughness", "scan", "file"), text) for text in error.lines]
    mark.parent.mkdir(parents=True, exist_ok=True)
    mark.touch()
    return []
