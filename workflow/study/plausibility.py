"""Look at a scene that is allowed before its first job: is it plausible, and has any surface its numbers?

A warning says what, its number, the key, and what to do. Those on surfaces stand in `roughslip.surface.plausibility`.
Libraries of numbers are imported for scenes that need them alone, and the warnings of a checked scene are kept.
"""

import hashlib
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from roughslip.atomic_write import replacing
from roughslip.compilation.source_hash import closure_hash
from roughslip.errors import RoughslipError
from roughslip.limits import WINDOWS
from roughslip.scene.contact import terms
from roughslip.scene.friction import RECORD
from roughslip.scene.mistakes import Mistake
from roughslip.scene.oscillator import OF_LAW
from roughslip.scene.roughness import BETA, FIELD, FIELD_OPTIONS
from roughslip.scene.schema import own_code
from roughslip.scene.types import get, scene_of
from roughslip.study import checksum
from roughslip.study.plan import SHIPPED_SCENES, stages_needed

Scene = dict[str, Any]
SOLIDS = {  # [Pa] the softest and the stiffest or hardest solids; beyond, a unit is wrong
    "young_modulus_pa": (1e5, "soft rubber", 1.3e12, "diamond"),
    "hardness_pa": (1e6, "rubber", 1.5e11, "diamond"),
}
SURFACE = ("targets", "material", "roughness", "square", "expansion", "strip", "load", "numerics")  # what contact reads
SAMPLES_PER_TERM = 2  # least oversampling of regressions, Hosder, Walters & Balch, AIAA 2007-1939
FINEST = 100.0  # cells hold at most so many correlation lengths: heights are independent long before
SOURCE = Path(__file__).resolve().parents[2] / "src"
_CHECKS = (
    "roughslip.scene.loader roughslip.oscillator.table_law roughslip.scan.topography roughslip.surface.plausibility "
    "roughslip.record.fit roughslip.record.slips"
)
MOST_READ = 4_000_000  # bytes of records that are read before a run, in less than a second
FREQUENCIES, DEFLECTIONS = (0.1, 1e4), (1e-9, 0.1)  # [Hz], [m] of machines; beyond, a number or its unit is wrong
UNKNOWN_FRICTION = 0.3  # static friction of a record before it is read
_OF_MOTION = (
    *("oscillator.mass_kg", "oscillator.stiffness_n_per_m", "oscillator.normal_force_n"),
    *("oscillator.static_friction", "friction.mean"),
)
_OF_A_CASE = ("load", "material.young_modulus_pa", "friction.record")  # what a scene of a machine of one's own gives


def check_scene(scene: Scene, files: dict[str, list[Path]], marks: Path | None) -> tuple[list[Mistake], list[str]]:
    """Mistakes of the surface of a scene and of its records, and what is implausible in the scene.

    A mistake: no surface has its numbers, none takes its load, the scan cannot be read or is form alone, a law is none,
    nothing slides in the records.
    files : those to read of a scan or of records, by key
    marks : folder of files with the warnings of scenes that were checked. Imports and reading a scan take a second
    """
    law = ("oscillator",) if "oscillator.law" in own_code(scene) else ()
    part = {key: scene[key] for key in (*SURFACE, *law, "friction") if key in scene}
    own = [checksum(Path(code.rpartition(":")[0])) for code in own_code(part).values()]
    checks = [checksum(Path(__file__)), closure_hash(_CHECKS, SOURCE)] if marks else []
    own += [checksum(file) for some in files.values() for file in some]
    made_of = json.dumps([part, sorted(stages_needed(scene)), own, checks])
    made_of = json.dumps(json.loads(made_of, parse_int=float), sort_keys=True)  # before and after numbers are floats
    mark = (marks or Path()) / f"{hashlib.sha256(made_of.encode()).hexdigest()}.json"
    if marks and mark.is_file():
        return [], json.loads(mark.read_text(encoding="utf-8"))
    section = "roughness"
    try:
        section, text = surface_mistake(scene)
        if text:
            return [Mistake((section, *SURFACE), text)], []
        warnings = scene_warnings(scene)
        section = "oscillator.law"
        if law:
            from roughslip.oscillator.table_law import law_from_scene  # with scipy

            law_from_scene(scene_of(scene).oscillator, 0.0)
        for section, some in files.items():
            warnings += _record_warnings(scene, some) if section.startswith(RECORD) else _scan_warnings(scene, *some)
    except RoughslipError as error:
        return [Mistake((section, *SURFACE), text) for text in error.in_scene.splitlines()], []
    if marks:
        with replacing(mark) as temporary:
            temporary.write_text(json.dumps(warnings), encoding="utf-8")
    return [], warnings


def _scan_warnings(scene: Scene, file: Path) -> list[str]:
    """Warnings of a scan. Raises InputError, ParameterError or IllPosedError where it has no model."""
    from roughslip.scan.autocorrelation import sub_areas_for
    from roughslip.scan.topography import slope_warnings
    from roughslip.study.scan import endless_axis, prepared  # with SurfaceTopography

    wanted = scene_of(scene).roughness.scan
    scan, _, _ = prepared(wanted, file)
    sub_areas_for(scan, endless_axis(wanted))
    return list(slope_warnings(scan))


def _record_warnings(scene: Scene, files: list[Path]) -> list[str]:
    """That records are too long to be read before a run. Raises as `study.record.slid_in`."""
    from roughslip.study.record import slid_in  # with scipy

    if (size := sum(file.stat().st_size for file in files)) > MOST_READ:
        why = "a row is no number, or where no part of the record slides without stick-slip"
        return [f"{RECORD} has {size / 1e6:.0f} MB and is read in the run alone, which ends early where {why}"]
    slid_in(scene_of(scene).friction.record, files)
    return []


def cells_of(scene: Scene) -> dict[str, float]:
    """[m] edge of the cells of strip and square, by key, of those that the scene solves, or draws under a plane."""
    stages, cells = stages_needed(scene), {}
    if "contact" in stages or "figure_chain" in scene["targets"]:
        cells["strip.cell_m"] = get(scene, "strip.cell_m")
    if "karhunen_loeve" in stages:
        cells["square.edge_m / square.nodes"] = get(scene, "square.edge_m") / get(scene, "square.nodes")
    return cells


def surface_of(scene: Scene) -> tuple[Any, tuple[float, float], str] | None:
    """Covariance of the heights, its 1/e lengths [m] along x and y, and the key that gives them.

    None where no contact is solved, or where they follow from a scan. Raises ParameterError or IllPosedError where no
    surface has the numbers of the scene.
    """
    section = get(scene, "roughness")
    if not cells_of(scene) or section["scan"] is not None:
        return None
    if section["wavelengths_m"] is not None:
        from roughslip.study.from_scene.surface_model import fractal_law  # with scipy

        law = fractal_law(scene_of(scene).roughness)
        return law, (law.correlation_length(0.0), law.correlation_length(math.pi / 2)), "roughness.wavelengths_m"
    from roughslip.surface.models import covariance_of  # with scipy.special

    if section["correct_correlation"]:
        from roughslip.study.from_scene.surface_model import gaussian_model  # with scipy

        gaussian_model(scene_of(scene))
    options = {key: section[key] for key in FIELD_OPTIONS if key != BETA and section[key] is not None}
    field = covariance_of(*(section[key] for key in FIELD), **options)
    return field, field.axis_lengths_m, "roughness.correlation_length_m"


def surface_mistake(scene: Scene) -> tuple[str, str]:
    """A section of the scene and what is wrong with it, before any strip is solved; "" where nothing is.

    Correlation lengths may not be far below the cells; a load takes heights with slope, and contact that is neither
    full nor of too few nodes. Raises as `surface_of`.
    """
    cell, surface = cells_of(scene).get("strip.cell_m"), surface_of(scene)
    if cell is None or surface is None:
        return "roughness", ""
    covariance, lengths, key = surface
    if (length := min(lengths)) * FINEST < cell:
        nodes = 4 * WINDOWS * get(scene, "strip.window_m") / max(length, sys.float_info.min)  # a tiny one rounds to 0
        return "roughness", (
            f"a correlation length of {length:.3g} m ({key}) is below a hundredth of strip.cell_m = {cell:.3g} m: "
            f"to resolve it a strip would take {nodes:.2g} nodes along the belt. For heights independent from node to "
            f"node, give {cell / 10:.2g} m"
        )
    if scene.get("load") is None:
        return "load", ""
    from roughslip.surface.plausibility import CELL_CONTACT, MOST_CELL_NODES, contact_mistake, rms_slope, slope_mistake

    if text := slope_mistake(covariance):
        return "roughness.covariance", text
    hardness = get(scene, "material.hardness_pa") or math.inf
    share = CELL_CONTACT * math.prod(lengths) / (MOST_CELL_NODES * cell**2)
    pressure, slope = scene["load"]["nominal_pressure_pa"], rms_slope(covariance, cell)
    return "load", contact_mistake(pressure, _modulus(scene), slope, hardness, share)


def _modulus(scene: Scene) -> float:
    """E* [Pa]."""
    from roughslip.contact.influence import Material  # with numpy

    return Material(
        *(get(scene, f"material.{key}") for key in ("young_modulus_pa", "poisson_ratio"))
    ).plane_strain_modulus_pa


def scene_warnings(scene: Scene) -> list[str]:
    """What is implausible in a scene and its surface, before anything is solved; raises as `surface_of`."""
    surface, cells = surface_of(scene), cells_of(scene)
    if surface is None:
        return [*_materials(scene), *_training(scene)]
    from roughslip.surface.plausibility import rms_slope, warnings, yield_warning

    window = get(scene, "strip.window_m") if "strip.cell_m" in cells else None
    lines = [*_materials(scene), *_training(scene), *warnings(*surface, cells, window)]
    if scene.get("load") is not None and get(scene, "material.hardness_pa") is None and "strip.cell_m" in cells:
        slope = rms_slope(surface[0], cells["strip.cell_m"])
        lines.append(yield_warning(get(scene, "material.young_modulus_pa"), _modulus(scene), slope))
    return list(filter(None, lines))


def _materials(scene: Scene) -> Iterator[str]:
    for key, (low, softest, high, hardest) in SOLIDS.items() if cells_of(scene) else ():
        value = get(scene, f"material.{key}")
        if value is not None and not low <= value <= high:
            which = f"below the {low:g} Pa of {softest}" if value < low else f"above the {high:g} Pa of {hardest}"
            yield f"material.{key} = {value:.3g} Pa is {which}: check the unit, Pa"


def _training(scene: Scene) -> Iterator[str]:
    """Few samples for the terms of the expansion of the square."""
    degree, samples = get(scene, "expansion.degree"), get(scene, "expansion.samples")
    if "chaos_square" in stages_needed(scene) and samples < (needed := SAMPLES_PER_TERM * terms(degree)):
        few = f"fewer than {SAMPLES_PER_TERM} for each of the {terms(degree)} terms of expansion.degree = {degree}"
        yield f"expansion.samples = {samples} are {few}. Take at least {needed}, or a lower degree"


def motion_warnings(scene: Scene) -> Iterator[str]:
    """What is unusual in the machine: its frequency, how far friction pulls the spring."""
    mass, stiffness, force, static, mean = (get(scene, key) for key in _OF_MOTION)
    frequency = math.sqrt(stiffness / mass) / (2.0 * math.pi)
    if not FREQUENCIES[0] <= frequency <= FREQUENCIES[1]:
        yield (
            f"oscillator: mass_kg = {mass:g} and stiffness_n_per_m = {stiffness:g} have a natural frequency of "
            f"{frequency:.3g} Hz; usual are {FREQUENCIES[0]:g} to {FREQUENCIES[1]:g} Hz: check both and their units"
        )
    table = get(scene, "oscillator.friction_table")
    friction = static or (table[0][1] if table else mean) or UNKNOWN_FRICTION
    deflection = friction * force / stiffness
    if not DEFLECTIONS[0] <= deflection <= DEFLECTIONS[1]:
        yield (
            f"oscillator: friction of {friction * force:.3g} N pulls the spring by {deflection:.3g} m; usual are "
            f"{DEFLECTIONS[0]:g} to {DEFLECTIONS[1]:g} m: check stiffness_n_per_m = {stiffness:g} and the normal force"
        )


def inherited(name: str, scene: Scene) -> list[str]:
    """A warning on what a scene of a user takes from shipped ones and hardly means."""

    def origins(*keys: str) -> list[str]:
        """The scenes that give some keys, or what is in them."""
        given = ((f"{key}.", origin) for key, origin in scene["origins"].items())
        return sorted({origin for one, origin in given if one.startswith(tuple(f"{key}." for key in keys))})

    law = [f"oscillator.{key}" for key in ("law", *OF_LAW.get(get(scene, "oscillator.law"), ()))]
    subjects = {
        "the surface": ["roughness"] if cells_of(scene) else [],
        "the friction curve": law if get(scene, RECORD) is None else [RECORD],
        "the machine": ["oscillator.mass_kg", "oscillator.stiffness_n_per_m"],
    }
    own = [key for key in _OF_A_CASE if {*origins(key)} - SHIPPED_SCENES]
    if name in SHIPPED_SCENES or not own:
        return []
    bases = {subject: origins(*keys) for subject, keys in subjects.items()}
    others = [f"{one} of scene {' and '.join(of)}" for one, of in bases.items() if of and SHIPPED_SCENES.issuperset(of)]
    text = f"{' and '.join(own)} of this scene meet{'' if own[1:] else 's'} {', '.join(others)}"
    return [f"{text}: give your own, as that decides whether the scene stick-slips"] if others else []
