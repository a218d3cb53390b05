"""Look at the surface of a scene before the first job, so that its mistakes are found at the start."""

from __future__ import annotations

import hashlib
import json
import math
import sys
from pathlib import Path
from typing import Any

from roughslip.atomic_write import replacing
from roughslip.compilation.source_hash import closure_hash
from roughslip.errors import InputError, ParameterError, RoughslipError
from roughslip.limits import WINDOWS
from roughslip.scene import plausibility
from roughslip.scene.mistakes import line
from roughslip.scene.roughness import BETA, FIELD, FIELD_OPTIONS, STATED
from roughslip.scene.schema import own_code
from roughslip.scene.types import get, scene_of
from roughslip.study.files import checksum

FINEST = 100.0  # cells hold at most so many correlation lengths: heights are independent long before


SOURCE = Path(__file__).resolve().parents[2] / "src"
_CHECKS = "roughslip.scene.plausibility roughslip.scan.topography roughslip.surface.plausibility"


def check_surface(
    scene_file: Path, scene: dict[str, Any], scan_file: Path | None, marks: Path | None
) -> tuple[list[str], list[str]]:
    """Mistakes of the surface of a scene, a line each with the key, and what is implausible in the scene.

    A mistake: no surface has its numbers, none takes its load, the scan cannot be read or is form alone.
    marks : folder of files with the warnings of scenes that were checked. Imports and reading a scan take a second
    """
    checks = closure_hash(_CHECKS, SOURCE) if marks else ""
    own = [checksum(Path(code.rpartition(":")[0])) for code in own_code(scene).values()]
    made_of = [scene, checksum(scan_file) if scan_file else "", own, checksum(Path(__file__)), checks]
    mark = (marks or Path()) / f"{hashlib.sha256(json.dumps(made_of, sort_keys=True).encode()).hexdigest()}.json"
    if marks and mark.is_file():
        return [], json.loads(mark.read_text(encoding="utf-8"))
    try:
        section, text = surface_mistake(scene)
        if text:
            return [line(scene_file, tuple(section.split(".")), text)], []
        warnings = scene_warnings(scene)
    except RoughslipError as error:
        return [line(scene_file, ("roughness",), str(error))], []
    if scan_file is not None:
        mistakes, more = _check_scan(scene_file, scan_file, scene)
        if mistakes:
            return mistakes, []
        warnings += more
    if marks:
        with replacing(mark) as temporary:
            temporary.write_text(json.dumps(warnings), encoding="utf-8")
    return [], warnings


def _check_scan(scene_file: Path, scan_file: Path, scene: dict[str, Any]) -> tuple[list[str], list[str]]:
    """Mistakes and warnings of a scan: it cannot be read as the scene states, or is form alone."""
    from roughslip.scan.instrument_file import read_scan  # with SurfaceTopography, for such scenes alone
    from roughslip.scan.topography import remove_form, slope_warnings

    *stated, form = (get(scene, f"roughness.scan.{key}") for key in (*STATED, "form"))
    try:
        scan = remove_form(read_scan(scan_file, tuple(stated[0]) if stated[0] else None, *stated[1:]), form)
    except InputError as error:
        return [line(scene_file, ("roughness", "scan", "file"), text) for text in error.lines], []
    except ParameterError as error:
        return [line(scene_file, ("roughness", "scan", "form"), str(error))], []
    return [], list(slope_warnings(scan))


def surface_of(scene: dict[str, Any]) -> tuple[Any, tuple[float, float], str] | None:
    """Covariance of the heights, its 1/e lengths [m] along x and y, and the key that gives them.

    None where no contact is solved, or where they follow from a scan. Raises ParameterError or IllPosedError where no
    surface has the numbers of the scene.
    """
    section = get(scene, "roughness")
    if not plausibility.cells_of(scene) or section["scan"] is not None:
        return None
    if section["wavelengths_m"] is not None:
        from roughslip.study.from_scene.surface_model import fractal_law  # with scipy, for such scenes alone

        law = fractal_law(scene_of(scene).roughness)
        return law, (law.correlation_length(0.0), law.correlation_length(math.pi / 2)), "roughness.wavelengths_m"
    from roughslip.surface.models import covariance_of  # with scipy.special

    given = {key: section[key] for key in FIELD_OPTIONS if key != BETA and section[key] is not None}
    field = covariance_of(*(section[key] for key in FIELD), **given)
    return field, field.axis_lengths_m, "roughness.correlation_length_m"


def surface_mistake(scene: dict[str, Any]) -> tuple[str, str]:
    """A section of the scene and what is wrong with it, before any strip is solved; "" where nothing is.

    Raises as `surface_of`.
    """
    cell, surface = plausibility.cells_of(scene).get("strip.cell_m"), surface_of(scene)
    if cell is None or surface is None:
        return "roughness", ""
    covariance, lengths, key = surface
    if min(lengths) * FINEST < cell:
        return "roughness", _length_mistake(scene, min(lengths), key, cell)
    if scene.get("load") is None:
        return "load", ""
    from roughslip.surface.plausibility import slope_mistake

    if text := slope_mistake(covariance):
        return "roughness.covariance", text
    return "load", _load_mistake(scene, covariance, lengths, cell)


def _length_mistake(scene: dict[str, Any], minimum: float, key: str, cell: float) -> str:
    """Of a correlation length that the cells of the strip leave far behind."""
    nodes = 4 * WINDOWS * get(scene, "strip.window_m") / max(minimum, sys.float_info.min)  # a tiny length rounds to 0
    return (
        f"a correlation length of {minimum:.3g} m ({key}) is below a hundredth of strip.cell_m = {cell:.3g} m: "
        f"to resolve it a strip would take {nodes:.2g} nodes along the belt. For heights independent from node to "
        f"node, give {cell / 10:.2g} m"
    )


def _load_mistake(scene: dict[str, Any], covariance: Any, lengths: tuple[float, float], cell: float) -> str:
    """Of a load that the surface bears in full contact, or with too few contacts."""
    from roughslip.study.from_scene.periodic_cell import CONTACT
    from roughslip.surface.plausibility import MOST_CELL_NODES, contact_mistake, rms_slope

    solid, modulus = get(scene, "material"), _modulus(scene)
    hardness = math.inf if solid["hardness_pa"] is None else solid["hardness_pa"]
    minimum = CONTACT * math.prod(lengths) / (MOST_CELL_NODES * cell**2)
    slope = rms_slope(covariance, cell)
    return contact_mistake(scene["load"]["nominal_pressure_pa"], modulus, slope, hardness, minimum)


def _modulus(scene: dict[str, Any]) -> float:
    """E* [Pa]."""
    from roughslip.contact.influence import Material  # with numpy, for such scenes alone

    solid = get(scene, "material")
    return Material(solid["young_modulus_pa"], solid["poisson_ratio"]).plane_strain_modulus_pa


def scene_warnings(scene: dict[str, Any]) -> list[str]:
    """What is implausible in a scene and its surface, before anything is solved; raises as `surface_of`."""
    surface, cells = surface_of(scene), plausibility.cells_of(scene)
    if surface is None:
        return plausibility.warnings(scene)
    from roughslip.surface.plausibility import rms_slope, warnings, yield_warning

    window = get(scene, "strip.window_m") if "strip.cell_m" in cells else None
    lines = [*plausibility.warnings(scene, surface[1][0]), *warnings(*surface, cells, window)]
    if scene.get("load") is not None and get(scene, "material.hardness_pa") is None and "strip.cell_m" in cells:
        slope = rms_slope(surface[0], cells["strip.cell_m"])
        lines.append(yield_warning(get(scene, "material.young_modulus_pa"), _modulus(scene), slope))
    return list(filter(None, lines))
