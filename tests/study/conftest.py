"""The work of a stage in this process, from a slice of a scene and files to the result that it writes; small scenes.

Seeds of random numbers are [seed of the scene, number of the stream, number of the sample], in tests as in stages.
"""

import copy
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from roughslip import store
from roughslip.scene.types import scene_of
from roughslip.study.graph import STAGES
from roughslip.study.job import Job

KEY = store.Key({}, "code")
MODULUS = 2.1e11 / (1 - 0.3**2)  # E* of CONTACT
SQ = 2e-7
CONTACT = {
    "seed": 7,
    "roughness": {"covariance": "gaussian", "rms_height_m": SQ, "correlation_length_m": 1.5e-5},
    "material": {"young_modulus_pa": 2.1e11, "poisson_ratio": 0.3},
    "square": {"edge_m": 6e-5, "nodes": 6, "modes": 36},
    "strip": {
        "width_m": 2.5e-5,
        "cell_m": 5e-6,
        "window_m": 1e-4,
        "window_spacing_m": 2e-5,
        "penetration_percentiles": [30.0, 50.0],
        "expansion_samples": 40,
    },
    "expansion": {},
    "numerics": {"contact_tolerance": 1e-10},
}
OSCILLATOR = {
    "mass_kg": 1.0,
    "stiffness_n_per_m": 316.0**2,
    "damping_ratio": 0.17,
    "belt_velocity_m_per_s": 0.948,
    "normal_force_n": 2500.0,
    "excitation_force_n": 0.0,
    "excitation_frequency_rad_per_s": 316.0,
    "static_friction": 0.4,
    "stribeck_decay_s_per_m": 1.42,
    "stribeck_quadratic_s2_per_m2": 0.01,
}


def changed(scene: dict, **sections: dict) -> dict:
    """A copy of the scene with other values in some of its sections."""
    new = copy.deepcopy(scene)
    for section, values in sections.items():
        new[section] = new.get(section, {}) | values
    return new


def job_of(name: str, configuration: dict, output: Path, **given: Any) -> Job:
    """A job of a stage. given : first, last, design, paths of files by name, and in `also` further outputs"""
    key, row = store.Key(configuration, "code"), STAGES[name]
    numbers, design = range(given.pop("first", 0), given.pop("last", 0)), given.pop("design", "")
    outputs = {"output": output, **given.pop("also", {})}
    inputs = {name: paths if isinstance(paths, list) else [paths] for name, paths in given.items() if paths is not None}
    return Job(name, scene_of(configuration, row.keys), key, inputs, outputs, numbers, design)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("stages")


@pytest.fixture(scope="module")
def run(folder: Path) -> Callable[..., store.Result]:
    """run(stage, configuration, name, constants, **files) is the result, which stays in the module's folder under that
    name. constants : of the module of the stage; run.warnings are those of the last stage"""

    def run_stage(stage: str, configuration: dict, name: str = "", constants: dict | None = None, **arguments):
        module, name = import_module(f"roughslip.study.{stage}"), name or stage
        further = {"text": "text.json", "deterministic": "plain.nc", "ensemble": "runs.nc", "summary": "summary.csv"}
        also = {kind: folder / f"{name}-{file}" for kind, file in further.items()}
        job = job_of(stage, configuration, folder / f"{name}.nc", also=also, **arguments)
        with pytest.MonkeyPatch.context() as patch:
            for constant, value in (constants or {}).items():
                patch.setattr(module, constant, value)
            module.work(job.scene, job)
        run_stage.warnings = job.warnings
        return store.read(job.output)

    return run_stage


@pytest.fixture(scope="module")
def stored(folder: Path) -> Callable[..., Path]:
    """stored(name, attributes, array=(dimensions, values), ...) is the path of a result of these arrays."""

    def write(name: str, attributes: dict | None = None, **arrays: tuple) -> Path:
        variables = {key: store.Variable(dimensions, values, "1", key) for key, (dimensions, values) in arrays.items()}
        store.write(folder / name, variables, KEY, attributes)
        return folder / name

    return write
