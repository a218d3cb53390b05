"""Whole scenes: random ones of tiny size that the check accepts, each run to its end in this process.

Surfaces, laws, loads, records, scans and targets are drawn from all that a scene can name; loads go over two decades
from the least that the check accepts. A scene that is refused is drawn again. Any exception of a run is a failure.
"""

from __future__ import annotations

import json
import math
from contextlib import chdir, redirect_stderr, suppress
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml

from roughslip.errors import InputError
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import CoulombLaw, StribeckLaw
from roughslip.oscillator.limits import limits_or_nan
from roughslip.study.graph import STAGES, targets
from roughslip.study.job import run
from tests.properties.campaign import Trial, choose, log_uniform
from workflow.keys import Names
from workflow.study.scenes import Scenes

ROOT = Path(__file__).resolve().parents[2]
NAME, DRAWS = "drawn", 200
CONTACTS = ("given", "record", "strips", "load", "scan", "load")
COVARIANCES = ("gaussian", "exponential", "matern", "self_affine", "own.py:Own", "wavelengths_m")
OWN = """import math
import numpy as np
from roughslip.surface import Covariance

class Own(Covariance):
    def profile(self, u):
        return (1 + u) * np.exp(-u)

    def transform(self, k):
        return 6 * math.pi / (1 + k**2) ** 2.5

def hump(v):
    return {rest} * (0.6 + 0.4 * np.exp(-v / {speed})) + {rise} * np.exp(-((v / {speed} - 1.5) ** 2))
"""
Values = dict[str, Any]


def attempt(trial: Trial) -> None:
    """Draw a scene that is accepted, run its stages in order, and check what they wrote."""
    with TemporaryDirectory() as folder, chdir(folder), redirect_stderr(StringIO()):
        scenes = accepted(trial)
        names, stages = Names(scenes, ROOT, writes=True), scenes.stages(NAME)
        trial.case["targets"] = "+".join(scenes[NAME]["targets"])
        for stage in (stage for stage in STAGES if stage in stages):
            for job in scenes.jobs(NAME, stage):
                run(Path(names.entry(NAME, stage).folder, "key.json"), job)
        for name, file in names.published(NAME).items():
            assert Path(file).is_file(), f"{name} was not made"
        if "answer" in stages:
            check_answer(trial, json.loads(Path(names.entry(NAME, "answer").folder, "answer.json").read_text()))


def check_answer(trial: Trial, answer: Values) -> None:
    """Check that an answer has a probability with an interval about it, or says why it has none."""
    assert answer["summary"], "an answer without a summary"
    if not answer["given"]:
        return
    low, high = answer["probability"]["interval"]
    trial.check("probability", abs(answer["probability"]["value"] - 0.5), 0.5)
    trial.check("interval", max(low - answer["probability"]["value"], answer["probability"]["value"] - high), 1e-12)


def accepted(trial: Trial) -> Scenes:
    """The scene of the first draw that the check accepts; it stands in the folder scenes."""
    own = Path("scenes")
    own.mkdir()
    for _ in range(DRAWS):
        plain = json.loads(json.dumps(draw(trial), default=lambda number: number.item()))  # without numbers of numpy
        (own / f"{NAME}.yaml").write_text(yaml.safe_dump(plain, default_flow_style=None), encoding="utf-8")
        with suppress(InputError):
            return Scenes(ROOT, [NAME], marks=Path("marks"), own=str(own))
    raise ValueError(f"none of {DRAWS} scenes is accepted")


def draw(trial: Trial) -> Values:
    """A scene, with its files."""
    rng = trial.rng
    kind = choose(rng, CONTACTS)
    trial.case["friction"] = kind
    wanted = set(rng.choice(targets(), int(rng.integers(1, 4)), replace=False))
    mean = log_uniform(rng, -2, 0)
    scene: Values = {"description": "drawn", "seed": int(rng.integers(1 << 31)), "friction": {"mean": mean}}
    scene |= surfaces(trial, kind)
    length = 0.4 * scene["strip"]["window_m"]
    if kind in ("given", "record"):
        length = log_uniform(rng, -5, -2)
    if kind == "given":
        statistics = {"standard_deviation": mean * log_uniform(rng, -3, 0), "correlation_length_m": length}
        scene["friction"]["statistics"] = statistics
    if rng.random() < 0.3:
        scene["friction"]["scatter"] = choose(rng, ("additive", "multiplicative"))
    scene |= machine(trial, mean, length)
    if kind == "load":
        pressure, force = scene["load"]["nominal_pressure_pa"], scene["oscillator"].pop("normal_force_n")
        del scene["oscillator"]["windows_in_parallel"]
        window = scene["strip"]["window_m"] * scene["strip"]["width_m"]
        scene["load"]["force_n"] = max(force, pressure * window)
        scene["oscillator"]["stiffness_n_per_m"] *= scene["load"]["force_n"] / force
    if kind == "record":
        write_record(rng, length, mean, scene["oscillator"]["belt_velocity_m_per_s"])
        scene["friction"] = {"record": {"file": ["record.csv"]}}
    elif scene["oscillator"]["excitation_force_n"] > 0.0:
        wanted -= {"figure_budget", "figure_map"}
    elif rng.random() < 0.4:
        wanted |= {"figure_budget"}
        make_uncertain(rng, scene)
    scene["targets"] = sorted(wanted or {"answer"})
    return scene


def surfaces(trial: Trial, kind: str) -> Values:
    """Sections of surfaces and contact, and a load."""
    rng = trial.rng
    length, modulus, hard = log_uniform(rng, -6, -4), log_uniform(rng, 6, 12), rng.random() < 0.4
    cell = length / rng.uniform(0.5, 4)
    spacing, steps = int(rng.integers(1, 5)), 2 * int(rng.integers(3, 7))
    window, slope = spacing * steps * cell, log_uniform(rng, -3, 0)
    material: Values = {"young_modulus_pa": modulus, "poisson_ratio": rng.uniform(0, 0.5)}
    material |= {"hardness_pa": modulus * log_uniform(rng, -3, -1)} if hard else {}
    nodes, degree = int(rng.integers(3, 7)), int(rng.integers(1, 3))
    sections: Values = {
        "material": material,
        "roughness": roughness(trial, kind, length, slope, cell, window),
        "square": {"edge_m": nodes * cell, "nodes": nodes, "modes": int(rng.integers(8, nodes**2 + 1))}
        | {"monte_carlo_samples": 200, "latin_hypercube_samples": 8000},
        "expansion": {"degree": degree, "target": choose(rng, ("trial_pressure", "squared_pressure")), "samples": 60},
        "strip": {"width_m": int(rng.integers(3, 9)) * cell, "cell_m": cell, "window_m": window}
        | {"window_spacing_m": spacing * cell, "samples": int(rng.integers(8, 20)), "training_samples": 8}
        | {"expansion_samples": 40, "penetration_percentiles": sorted({50, *rng.integers(2, 99, 2).tolist()})},
        "numerics": {"contact_area": choose(rng, ("corrected", "nodes"))},
        "jobs": int(rng.integers(1, 3)),
    }
    if kind == "load":
        sections["load"] = {"nominal_pressure_pa": modulus * slope * log_uniform(rng, -5, 0)}
    return sections


def roughness(trial: Trial, kind: str, length: float, slope: float, cell: float, window: float) -> Values:
    """The section of that name; a scan is written for it."""
    rng = trial.rng
    height = length * slope
    if kind == "scan":
        n = int(rng.integers(24, 64))
        amplitudes = np.hypot(*np.ogrid[1 : n + 1, 1 : n // 2 + 2]) ** -1.5
        waves = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((n, n))) * amplitudes, (n, n))
        np.savetxt("scenes/scan.txt", height * waves / waves.std() * 1e6)
        scan: Values = {"file": "scan.txt", "spacing_m": [cell, cell], "height_unit": "um"}
        scan |= {"form": choose(rng, ("mean", "plane"))}
        scan |= {"covariance": choose(rng, ("best", "measured", "gaussian", "exponential", "matern", "self_affine"))}
        return {"scan": scan | {"marginal": choose(rng, ("gaussian", "empirical"))}}
    covariance = choose(rng, COVARIANCES)
    trial.case["covariance"] = covariance
    if covariance == "wavelengths_m":
        waves = [cell * rng.uniform(2.1, 4), min(cell * rng.uniform(4, 40), 4 * window)]
        return {"wavelengths_m": waves, "hurst": rng.uniform(0.1, 0.9), "rms_height_m": height}
    own = {"covariance": covariance, "rms_height_m": height, "correlation_length_m": length}
    own |= {"smoothness": log_uniform(rng, -0.5, 1)} if covariance == "matern" else {}
    own |= {"hurst": rng.uniform(0.05, 1), "bandwidth": log_uniform(rng, 0.1, 2)} if covariance == "self_affine" else {}
    if rng.random() < 0.3:
        own |= {"correlation_length_across_m": length * log_uniform(rng, -0.7, 0.7), "lay_rad": rng.uniform(-1.5, 1.5)}
    if rng.random() < 0.3:
        own |= {"beta_shapes": [log_uniform(rng, -0.5, 2), log_uniform(rng, -0.5, 2)]}
        own |= {"correct_correlation": True} if rng.random() < 0.5 else {}
    return own


def machine(trial: Trial, mean: float, length: float) -> Values:
    """Sections of the oscillator and its runs, on a belt that passes the correlation length at a modest rate."""
    rng = trial.rng
    omega, mass = log_uniform(rng, 0, 4), log_uniform(rng, -3, 3)
    belt = length * log_uniform(rng, -1, 2) / (2 * math.pi)  # V [m]
    deflection, speed = belt * log_uniform(rng, -1, 3), belt * omega  # F [m] and v0
    law, static = choose(rng, ("stribeck", "coulomb", "table", "own")), mean * rng.uniform(1, 2)
    knee = speed * log_uniform(rng, -1.5, 1.5)
    section: Values = {"mass_kg": mass, "stiffness_n_per_m": mass * omega**2, "belt_velocity_m_per_s": speed}
    section |= {"normal_force_n": deflection * mass * omega**2, "static_friction": static, "law": law}
    section |= {"stribeck_decay_s_per_m": min(1 / knee, 1e5), "stribeck_quadratic_s2_per_m2": 0.0}
    excited = rng.random() < 0.1
    section |= {"excitation_force_n": section["normal_force_n"] * mean if excited else 0.0}
    section |= {"excitation_frequency_rad_per_s": omega * log_uniform(rng, -1, 1)}
    section["windows_in_parallel"] = int(choose(rng, (1, 1, 7, 100)))
    if law == "table":
        speeds = np.append(0.0, np.sort(knee * 10 ** rng.uniform(-1, 1, 4)))
        values = np.append(mean * rng.uniform(1, 1.5), mean * rng.uniform(0.5, 1.5, 4))
        values[rng.integers(1, 5)] = mean * 0.9
        section["friction_table"] = np.stack([speeds, values], 1).tolist()
        section["static_friction"] = values[0] * rng.uniform(1, 2)
    Path("scenes/own.py").write_text(OWN.format(rest=mean, speed=knee, rise=mean * rng.uniform(-0.1, 0.2)))
    if law == "own":
        section |= {"law": "own.py:hump", "static_friction": 2 * mean}
    if law in ("table", "own") and rng.random() < 0.3:
        del section["static_friction"]  # the first value of the curve
    section["damping_ratio"] = min(damping(trial, section, mean, omega), 1.0)
    trial.case["law"] = law
    more: Values = {"ensemble": {"realisations": 8, "duration_periods": 20}}
    more["ensemble"] |= {"process": choose(rng, ("recursion", "spectral")), "marginal": choose(rng, ("beta", "paper"))}
    more |= {"answer": {"realisations": 72, "duration_periods": 20}}
    both = rng.choice(["damping", "belt_velocity", "mass", "load", "windows", "mean_friction"], 2, replace=False)
    return {"oscillator": section, **more, "map": {"parameters": both.tolist(), "points": 8}}


def damping(trial: Trial, section: Values, mean: float, omega: float) -> float:
    """A damping ratio: any, or near a limit of the law."""
    rng = trial.rng
    belt = Oscillator(section["mass_kg"], omega, 0.1, section["belt_velocity_m_per_s"], section["normal_force_n"])
    law = CoulombLaw(mean, max(section.get("static_friction", mean), mean))
    if section["law"] == "stribeck":
        law = StribeckLaw(mean, section["static_friction"], section["stribeck_decay_s_per_m"], 0.0)
    near = [limit for limit in limits_or_nan(belt, law) if limit > 0.0]
    if section["law"] not in ("stribeck", "coulomb") or rng.random() < 0.5 or not near:
        return choose(rng, (0.0, log_uniform(rng, -4, 0), rng.uniform(0, 1)))
    return choose(rng, near) * choose(rng, (rng.uniform(0.9, 1.1), 1 + 1e-6 * rng.uniform(-1, 1)))


def write_record(rng: np.random.Generator, length: float, mean: float, speed: float) -> None:
    """A record of sliding with exponential scatter, at one speed or over a range of speeds."""
    rows = int(rng.integers(1500, 4000))
    share = np.abs(np.linspace(0, 4, rows) % 2 - 1) if rng.random() < 0.7 else np.zeros(rows)
    speeds = speed * 10 ** (2 * share - 1.5 * float(np.any(share)))
    step = length * log_uniform(rng, -1.5, 0) / np.median(speeds)
    kicks, scatter, z = rng.standard_normal(rows), np.empty(rows), 0.0
    for row, keep in enumerate(np.exp(-speeds * step / length)):
        z = scatter[row] = keep * z + math.sqrt(1 - keep**2) * kicks[row]
    mu = mean * (0.7 + 0.6 * np.exp(-speeds / speed) + log_uniform(rng, -3, -0.5) * scatter)
    table = np.stack([step * np.arange(rows), speeds, mu], 1)
    np.savetxt("scenes/record.csv", table, "%.9g", ",", header="time [s],speed [m/s],friction [1]", comments="")


def make_uncertain(rng: np.random.Generator, scene: Values) -> None:
    """Give some numbers a standard uncertainty."""
    section = scene["oscillator"]
    for key in ("mass_kg", "damping_ratio", "belt_velocity_m_per_s", "stribeck_decay_s_per_m"):
        if rng.random() < 0.6 and section[key] > 0.0:
            section[key] = {"value": section[key], "standard_uncertainty": section[key] * log_uniform(rng, -2, -0.3)}
