"""Scene files: what is refused, with which line; what is merged; what a stage reads of a scene."""

import copy
import math
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator

from roughslip.chaos.functionals import NAMES
from roughslip.errors import InputError
from roughslip.scene import RESERVED, describe_allowed, load, scene_names, slice_for, stages_needed
from roughslip.scene_rules import SLICES, figures

CONFIG = Path(__file__).parents[1] / "config"
SCHEMA_PATH = CONFIG / "scene.schema.yaml"
SCHEMA = yaml.safe_load(SCHEMA_PATH.read_text())
SCENES = ("fractal", "given", "measured", "nongaussian", "paper", "resolved", "smoke")
PAPER_TEXT = (CONFIG / "scenes" / "paper.yaml").read_text()
PAPER = yaml.safe_load(PAPER_TEXT)
BESIDE = ", ".join(sorted((*SCENES, "mine")))
KINDS = "gaussian, exponential, separable_exponential, matern, self_affine"
FIGURES = "figure2, figure3, figure5, figure_scan"
FRACTAL = "{hurst: 0.8, azimuths: 8, gamma: 1.5}"
SCAN = "{file: a.x3p, form: plane, covariance: best, marginal: gaussian}"
STATISTICS = "{mean: 0.3, standard_deviation: 0.05, correlation_length_m: 2.5e-4, beta_a: 2.1, beta_b: 5}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A working folder with the shipped scenes in `scenes/`; a test writes its own beside them."""
    root = tmp_path_factory.mktemp("work")
    (root / "scenes").mkdir()
    for name in SCENES:
        (root / "scenes" / f"{name}.yaml").write_bytes((CONFIG / "scenes" / f"{name}.yaml").read_bytes())
    return root


@pytest.fixture
def mine(folder: Path, monkeypatch: pytest.MonkeyPatch):
    """Loads `mine`, a scene of the given text, with further files beside it; they are gone after the test."""
    monkeypatch.chdir(folder)
    written = set()

    def load_mine(content: str | bytes, **others: str) -> dict:
        for name, text in {"mine": content, **others}.items():
            path = folder / "scenes" / f"{name}.yaml"
            path.write_bytes(text if isinstance(text, bytes) else text.encode())
            written.add(path)
        return load("mine", folder / "scenes", SCHEMA_PATH)

    yield load_mine
    for path in written:
        path.unlink()


def lines_of(call, *args, **kwargs) -> list[str]:
    with pytest.raises(InputError) as caught:
        call(*args, **kwargs)
    return list(caught.value.lines)


def properties(schema: dict, prefix: str = "") -> dict[str, dict]:
    """Every property of the schema by its dotted key, sections among them."""
    found = {}
    for key, part in schema.get("properties", {}).items():
        found[prefix + key] = part
        found |= properties(part, f"{prefix}{key}.")
    return found


def leaves(value: object, path: tuple = ()) -> list[tuple]:
    if isinstance(value, dict | list) and value:
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return [leaf for key, item in items for leaf in leaves(item, (*path, key))]
    return [path]


# --- the shipped scenes ---


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_are_valid(name):
    scene = load(name, CONFIG / "scenes", SCHEMA_PATH)
    assert "extends" not in scene
    assert scene == load(CONFIG / "scenes" / f"{name}.yaml", CONFIG / "scenes", SCHEMA_PATH)


def test_shipped_scenes_are_all_tested():
    assert set(scene_names(CONFIG / "scenes")) >= set(SCENES)


def numbers(node: yaml.Node):
    """The lines (from 0) on which a mapping gives a number, or a list that holds one."""
    for key, value in node.value:
        items = value.value if isinstance(value, yaml.SequenceNode) else [value]
        if isinstance(value, yaml.MappingNode):
            yield from numbers(value)
        elif any(item.tag in ("tag:yaml.org,2002:int", "tag:yaml.org,2002:float") for item in items):
            yield key.start_mark.line


@pytest.mark.parametrize("path", sorted((CONFIG / "scenes").glob("*.yaml")), ids=lambda path: path.stem)
def test_every_number_says_where_it_comes_from(path):
    text = path.read_text()
    lines = text.splitlines()
    bare = [lines[n] for n in numbers(yaml.compose(text)) if not re.search(r"# (paper|assumed): \S+ \S+", lines[n])]
    assert not bare


# --- the schema ---


def test_schema_is_closed_and_described():
    Draft202012Validator.check_schema(SCHEMA)
    for key, part in {"": SCHEMA, **properties(SCHEMA)}.items():
        if part["type"] == "object":
            assert part["additionalProperties"] is False, key
            assert set(part.get("required", [])) <= set(part["properties"]), key
        if key:
            assert len(part["description"].split()) >= 2, key
        if part["type"] in ("number", "integer"):
            assert {"minimum", "exclusiveMinimum"} & set(part), key


def test_units_end_the_name_and_the_description():
    units = {"m": "m", "pa": "Pa", "kg": "kg", "n": "N", "rad_per_s": "rad/s", "m_per_s": "m/s", "s_per_m": "s/m"}
    units |= {"s2_per_m2": "s^2/m^2", "per_m2": "1/m^2", "rad": "rad", "percentile": "%"}
    for key, part in properties(SCHEMA).items():
        if part["type"] in ("number", "integer"):
            endings = [ending for ending in units if key.endswith(f"_{ending}")]
            unit = units[max(endings, key=len)] if endings else "-"
            assert part["description"].endswith(f" [{unit}]"), key


def test_what_is_allowed_is_told_from_the_schema():
    allowed = {key: describe_allowed(part) for key, part in properties(SCHEMA).items()}
    assert allowed["strip.cell_m"] == "a number > 0 [m]"
    assert allowed["square.nodes"] == "a whole number >= 2 and <= 512"
    assert allowed["material.poisson_ratio"] == "a number > -1 and <= 0.5"
    assert allowed["roughness.covariance"] == f"one of {KINDS}"
    assert allowed["oscillator.stochastic_static_limit"] == "true or false"
    assert allowed["numerics"] == "a group of the keys contact_tolerance, oscillator_tolerance"
    assert allowed["targets"] == f"a list of at least 1, each once, of one of {FIGURES}"
    assert allowed["strip.penetration_percentiles"] == "a list of 1 to 99, of a number > 0 and < 100 [%]"
    assert allowed["description"] == "text on one line, 1 to 200 characters"


# --- mistakes, each with its line ---

# What follows `extends: paper` in a scene file, and the line that it earns, without the name of the file.
MISTAKES = {
    # the schema
    "strip: {cell_m: 0}": "strip.cell_m: 0 is not allowed; a number > 0 [m]",
    "material: {poisson_ratio: 0.6}": "material.poisson_ratio: 0.6 is not allowed; a number > -1 and <= 0.5",
    "material: {young_modulus_pa: 210}": "material.young_modulus_pa: 210 is not allowed; "
    "a number >= 1000 and <= 1e+13 [Pa]",
    "square: {nodes: 513}": "square.nodes: 513 is not allowed; a whole number >= 2 and <= 512",
    "square: {nodes: 10.0}": "square.nodes: 10.0 is not allowed; a whole number >= 2 and <= 512",
    "square: {nodes: true}": "square.nodes: true is not allowed; a whole number >= 2 and <= 512",
    "square: {penetration_percentile: 100}": "square.penetration_percentile: 100 is not allowed; "
    "a number > 0 and < 100 [%]",
    "square: {latin_hypercube_samples: 3999}": "square.latin_hypercube_samples: 3999 is not allowed; "
    "a whole number >= 4000 and <= 1000000",
    "oscillator: {mass_kg: true}": "oscillator.mass_kg: true is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg:}": "oscillator.mass_kg: no value is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: 1.0e+999}": "oscillator.mass_kg: inf is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: .nan}": "oscillator.mass_kg: '.nan' is text, not a number; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: [1]}": "oscillator.mass_kg: [1] is not allowed; a number > 0 and <= 1000000 [kg]",
    "oscillator: {mass_kg: 2 kg}": "oscillator.mass_kg: '2 kg' is text, not a number; a number > 0 and <= 1000000 [kg]",
    "oscillator: {stochastic_static_limit: yes}": "oscillator.stochastic_static_limit: 'yes' is not allowed; "
    "true or false",
    "roughness: {covariance: gauss}": f"roughness.covariance: 'gauss' is not allowed; one of {KINDS}",
    "strip: {cell_m: 1.0e+999}": "strip.cell_m: inf is not allowed; a number > 0 [m]",
    "strip: {samples: 7, training_samples: 2}": "strip.samples: 7 is not allowed; a whole number >= 8 and <= 100000",
    "strip: {penetration_percentiles: [0, 50]}": "strip.penetration_percentiles[0]: 0 is not allowed; "
    "a number > 0 and < 100 [%]",
    "ensemble: {damping_ratios: []}": "ensemble.damping_ratios: [] is not allowed; "
    "a list of 1 to 200, of a number >= 0 and <= 10",
    "ensemble: {damping_ratios: [-0.1, 0.1]}": "ensemble.damping_ratios[0]: -0.1 is not allowed; "
    "a number >= 0 and <= 10",
    "targets: [figure2, figure4]": f"targets[1]: 'figure4' is not allowed; one of {FIGURES}",
    "targets: [figure2, figure2]": "targets: ['figure2', 'figure2'] is not allowed; "
    f"a list of at least 1, each once, of one of {FIGURES}",
    "numerics: 1.0e-8": "numerics: 1e-08 is not allowed; a group of the keys contact_tolerance, oscillator_tolerance",
    r'description: "two\nlines"': r"description: 'two\nlines' is not allowed; text on one line, 1 to 200 characters",
    "description: ''": "description: '' is not allowed; text on one line, 1 to 200 characters",
    "seed: -1": "seed: -1 is not allowed; a whole number >= 0 and <= 4294967295",
    "friction: {mean_at_median: 0}": "friction.mean_at_median: 0 is not allowed; a number > 0 and <= 10",
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS.replace('2.1', '0')}}}": "friction.statistics.beta_a: "
    "0 is not allowed; a number > 0 and <= 1000",
    # keys
    "strip: {cel_m: 1.0e-6}": "strip.cel_m: unknown key; did you mean cell_m? allowed: "
    "length_m, margin_m, width_m, cell_m, window_m, window_spacing_m, penetration_percentiles, samples, "
    "training_samples, expansion_samples",
    "material: {young_modulus_gpa: 210}": "material.young_modulus_gpa: unknown key; "
    "did you mean young_modulus_pa? allowed: young_modulus_pa, poisson_ratio",
    "numerics: {normal_force_n: 1}": "numerics.normal_force_n: unknown key; did you mean oscillator.normal_force_n? "
    "allowed: contact_tolerance, oscillator_tolerance",
    "numerics: {xyz: 1}": "numerics.xyz: unknown key; allowed: contact_tolerance, oscillator_tolerance",
    r'numerics: {"x\ny": 1}': r"numerics.'x\ny': unknown key; allowed: contact_tolerance, oscillator_tolerance",
    "targets: [figure5]\nfriction: {statistics: {mean: 0.3, standard_deviation: 0.05, beta_a: 2, beta_b: 5}}": (
        "friction.statistics.correlation_length_m: missing; a number > 0 and <= 1 [m]"
    ),
    # YAML
    "material: {young_modulus_pa: 1e9}": "material.young_modulus_pa: '1e9' is text, not a number; "
    "write 1.0e+9, a number >= 1000 and <= 1e+13 [Pa]",
    "material: {young_modulus_pa: 1.0e9}": "material.young_modulus_pa: '1.0e9' is text, not a number; "
    "write 1.0e+9, a number >= 1000 and <= 1e+13 [Pa]",
    "roughness: {rms_height_m: 5E-8}": "roughness.rms_height_m: '5E-8' is text, not a number; "
    "write 5.0e-8, a number > 0 and <= 0.01 [m]",
    "oscillator: {mass_kg: '2.5'}": "oscillator.mass_kg: '2.5' is text, not a number; "
    "write 2.5, a number > 0 and <= 1000000 [kg]",
    "square: {monte_carlo_samples: 4e5}": "square.monte_carlo_samples: '4e5' is text, not a number; "
    "write 400000, a whole number >= 100 and <= 100000000",
    "square: {monte_carlo_samples: 400_000}": "square.monte_carlo_samples: '400_000' is text, not a number; "
    "write 400000, a whole number >= 100 and <= 100000000",
    "seed: 010": "seed: '010' is text, not a number; a whole number >= 0 and <= 4294967295",
    "seed: 1:30": "seed: '1:30' is text, not a number; a whole number >= 0 and <= 4294967295",
    "seed: 1\nseed: 2": "seed: 2 in line 3 repeats the key; give it once",
    "strip:\n  cell_m: 2.5e-6\n  cell_m: 0": "strip.cell_m: 0 in line 4 repeats the key; give it once",
    "seed: &base 1": "seed: &base is not allowed; write the value out (no anchor, alias or tag)",
    "seed: !!python/name:os.system 1": "seed: tag:yaml.org,2002:python/name:os.system is not allowed; "
    "write the value out (no anchor, alias or tag)",
    "seed: *base": "seed: *base is not allowed; write the value out (no anchor, alias or tag)",
    "strip: {penetration_percentiles: [*base, 50]}": "strip.penetration_percentiles[0]: *base is not allowed; "
    "write the value out (no anchor, alias or tag)",
    "&base seed: 1": "the key in line 2 is not allowed; a key is a plain word",
    "? [a, b]\n: 1": "the key in line 2 is not allowed; a key is a plain word",
    # across keys
    "square: {modes: 101, nodes: 10}": "square.modes: 101 is not allowed; at most square.nodes^2 = 10^2",
    "square: {modes: 20000, nodes: 200}": "square.modes: 20000 is not allowed; modes times nodes^2 at most 100000000 "
    "(0.8 GB of memory), here with 200 nodes",
    "square: {latin_hypercube_samples: 300000, modes: 400, nodes: 20}": "square.latin_hypercube_samples: 300000 is "
    "not allowed; samples times square.modes = 400 at most 100000000 (0.8 GB of memory)",
    "square: {modes: 6}\nexpansion: {variables: 7}": "expansion.variables: 7 is not allowed; at most square.modes = 6",
    "expansion: {variables: 8, degree: 3, samples: 165}": "expansion.samples: 165 is not allowed; "
    "more than the terms of the expansion, C(8 + 3, 3)",
    "expansion: {variables: 9, degree: 6, samples: 9000}\nsquare: {latin_hypercube_samples: 5005}\n"
    "strip: {training_samples: 40}": (
        "square.latin_hypercube_samples: 5005 is not allowed; more than the terms of the expansion, C(9 + 6, 6)"
    ),
    "expansion: {variables: 8, degree: 3, samples: 700000}\nsquare: {modes: 99}": "expansion.samples: 700000 is not "
    "allowed; samples times terms, C(8 + 3, 3), at most 100000000 (0.8 GB of memory)",
    "strip: {length_m: 2.401e-3, cell_m: 2.5e-6}": "strip.length_m: 0.002401 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {width_m: 1.0e-6, cell_m: 2.5e-6}": "strip.width_m: 1e-06 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {window_m: 5.99e-4, cell_m: 2.5e-6}": "strip.window_m: 0.000599 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {window_spacing_m: 1.6e-5, cell_m: 2.5e-6}": "strip.window_spacing_m: 1.6e-05 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {window_spacing_m: 6.25e-4, window_m: 6.0e-4}": "strip.window_spacing_m: 0.000625 is not allowed; "
    "at most half of strip.window_m = 0.0006 [m], for lags within the window",
    "strip: {width_m: 5.0e-6, cell_m: 2.5e-6}": "strip.width_m: 5e-06 is not allowed; "
    "at least 3 times strip.cell_m = 2.5e-06 [m], for slope and curvature across the strip",
    "strip: {training_samples: 1, cell_m: 2.5e-6}": "strip.training_samples: 1 is not allowed; "
    "enough that every 8th column gives more samples than C(8 + 3, 3)",
    "strip: {length_m: 2.3e-3, window_m: 6.0e-4}": "strip.length_m: 0.0023 is not allowed; "
    "at least four times strip.window_m = 0.0006 [m], for lags of three windows",
    "strip: {length_m: 2.4e-3}\nroughness: {correlation_length_m: 3.1e-4}": "strip.length_m: 0.0024 is not allowed; "
    "at least eight times roughness.correlation_length_m = 0.00031 [m]",
    "strip: {length_m: 2.4e-3, margin_m: 0, width_m: 2.5e-5, cell_m: 1.0e-7}": "strip.cell_m: 1e-07 is not allowed; "
    "at most 4000000 cells on the strip of 0.0024 + 2 x 0 by 2.5e-05 m",
    "strip: {margin_m: 3.01e-4, cell_m: 2.5e-6}": "strip.margin_m: 0.000301 is not allowed; "
    "a whole multiple of strip.cell_m = 2.5e-06 [m]",
    "strip: {penetration_percentiles: [10, 50, 50]}": "strip.penetration_percentiles: [10, 50, 50] is not allowed; "
    "strictly increasing percentiles",
    "strip: {penetration_percentiles: [10, 90]}": "strip.penetration_percentiles: [10, 90] is not allowed; "
    "50 among them: friction.mean_at_median sets the shear strength there",
    "strip: {samples: 12, training_samples: 13}": "strip.training_samples: 13 is not allowed; "
    "at most strip.samples = 12",
    "strip: {samples: 12, training_samples: 4, expansion_samples: 11}": "strip.expansion_samples: 11 is not allowed; "
    "at least twice strip.samples = 12",
    "oscillator: {excitation_force_n: 1, excitation_frequency_rad_per_s: 0}": "oscillator."
    "excitation_frequency_rad_per_s: 0 is not allowed; a number > 0 [rad/s] "
    "where oscillator.excitation_force_n is not 0",
    "oscillator: {static_friction: 0.2}\nfriction: {mean_at_median: 0.3}": "oscillator.static_friction: 0.2 is not "
    "allowed; at least friction.mean_at_median = 0.3, or eq. (13) turns negative at high speed",
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS}}}\noscillator: {{static_friction: 0.2}}": (
        "oscillator.static_friction: 0.2 is not allowed; at least friction.statistics.mean = 0.3, "
        "or eq. (13) turns negative at high speed"
    ),
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS.replace('e-4', 'e-10')}}}": "friction.statistics."
    "correlation_length_m: 2.5e-10 is not allowed; long enough for at most 100000000 nodes (0.8 GB of memory) "
    "over the belt's way in a run",
    "ensemble: {discarded_periods: 100, duration_periods: 100}": "ensemble.discarded_periods: 100 is not allowed; "
    "less than ensemble.duration_periods = 100",
    "ensemble: {drawn_realisations: 17, realisations: 16}": "ensemble.drawn_realisations: 17 is not allowed; "
    "at most ensemble.realisations = 16",
    "ensemble: {damping_ratios: [0.2, 0.1]}": "ensemble.damping_ratios: [0.2, 0.1] is not allowed; "
    "strictly increasing damping ratios",
    # the two ways to truncate the square
    "square: {modes: 20, variance_share: 0.9}": "square.variance_share: 0.9 is not allowed beside square.modes; "
    "give one",
    "square: {modes: 0, variance_share: 0.9}": "square.modes: 0 is not allowed; a whole number >= 1 and <= 262144",
    "square: {variance_share: 0}": "square.variance_share: 0 is not allowed; a number > 0 and <= 1",
    "square: {variance_share: 1.01}": "square.variance_share: 1.01 is not allowed; a number > 0 and <= 1",
    # the two forms of the samples of the expansion
    "expansion: {samples: automatic, cdf_error: 0.01}": "expansion.samples: 'automatic' is not allowed; "
    "a whole number >= 10 and <= 1000000, or auto",
    "expansion: {samples: 9}": "expansion.samples: 9 is not allowed; a whole number >= 10 and <= 1000000, or auto",
    "expansion: {samples: auto}": "expansion.cdf_error: missing; expansion.samples = auto needs it",
    "expansion: {cdf_error: 0.01}": "expansion.cdf_error: 0.01 is not allowed beside expansion.samples = 1000; "
    "only auto takes it",
    "expansion: {samples: auto, cdf_error: 0}": "expansion.cdf_error: 0 is not allowed; a number >= 0.0005 and <= 0.2",
    "expansion: {samples: auto, cdf_error: 0.01, design: latin_hypercube}": "expansion.design: 'latin_hypercube' is "
    "not allowed; sobol or monte_carlo with expansion.samples = auto, to be extended",
    "expansion: {samples: auto, cdf_error: 0.005, draws: 399999}": "expansion.draws: 399999 is not allowed; "
    "at least 10 / expansion.cdf_error^2, or the draws alone err by as much as 0.005",
    "expansion: {samples: auto, cdf_error: 0.01, degree: 7}\nstrip: {training_samples: 100}\n"
    "square: {latin_hypercube_samples: 8000}": "expansion.samples: 'auto' is not allowed; with more samples than the "
    "C(8 + 7, 7) terms, at 16 nodes of each, samples times terms exceed 100000000 (0.8 GB of memory): take a lower "
    "expansion.degree",
    # the two forms of friction
    "friction: {}\nextends: given\ntargets: [figure3]": "friction.mean_at_median: missing; needed for figure3, "
    "for which friction.statistics cannot stand in",
    "extends: given\nfriction: {mean_at_median: 0.3}\ntargets: [figure3]": "friction.least_contact_fraction: missing; "
    "goes with friction.mean_at_median",
    f"targets: [figure5]\nfriction: {{statistics: {STATISTICS}, mean_at_median: 0.3}}": (
        "friction.mean_at_median: 0.3 is not allowed beside friction.statistics; give one"
    ),
    # the three forms of roughness
    "roughness: {covariance: matern}": "roughness.smoothness: missing; roughness.covariance = matern needs it",
    "roughness: {smoothness: 1.0}": "roughness.smoothness: 1.0 is not allowed; "
    "roughness.covariance = gaussian has none",
    "roughness: {lay_rad: 0.5}": "roughness.correlation_length_across_m: missing; goes with roughness.lay_rad",
    "roughness: {marginal: {family: beta, shapes: [2.1]}}": "roughness.marginal.shapes: [2.1] is not allowed; "
    "[a, b] of beta, each 0.02 to 10000",
    "roughness: {marginal: {family: lognormal, shapes: [1.6]}}": "roughness.marginal.shapes: [1.6] is not allowed; "
    "[s] of lognormal, each 0.02 to 1.5",
    f"targets: [figure3]\nroughness: {{fractal: {FRACTAL}, hurst: 0.8}}": (
        "roughness.hurst: 0.8 is not allowed beside roughness.fractal; give one"
    ),
    f"roughness: {{fractal: {FRACTAL}}}": "targets: ['figure2', 'figure3', 'figure5'] is not allowed; figure2 expands "
    "the pressure in a few Gaussian variables, and roughness.fractal has a phase a wave",
    f"targets: [figure3]\nroughness: {{fractal: {FRACTAL[:-1]}, shortest_wavelength_m: 5.0e-6}}}}": (
        "roughness.fractal.shortest_wavelength_m: 5e-06 is not allowed; more than two cells, strip.cell_m = 2.5e-06 [m]"
    ),
    "roughness: {scan: {form: plane, covariance: best, marginal: gaussian}}": "roughness.scan.file: missing; "
    "give the file of a scan, or grinding to have one made",
    f"roughness: {{scan: {SCAN[:-1]}, spacing_x_m: 1.0e-6}}}}": "roughness.scan.spacing_y_m: missing; "
    "goes with roughness.scan.spacing_x_m",
    f"roughness: {{scan: {SCAN[:-1]}, correct_correlation: true}}}}": "roughness.scan.correct_correlation: true is not "
    "allowed; a gaussian marginal changes no correlation",
    f"roughness: {{scan: {SCAN}, rms_height_m: 1.0e-7}}": "roughness.rms_height_m: 1e-07 is not allowed beside "
    "roughness.scan; give one",
    "targets: [figure_scan]": "roughness.scan: missing; needed for figure_scan",
    # overlays
    "extends: 3": f"extends: 3 is not allowed; scenes: {BESIDE}",
    "extends: *base": "extends: *base is not allowed; write the value out (no anchor, alias or tag)",
    "extends: papr": f"extends: 'papr' is not allowed; did you mean paper? scenes: {BESIDE}",
    "extends: mine": "extends: 'mine' is not allowed; overlays run in a circle: mine -> mine",
}


@pytest.mark.parametrize("text", MISTAKES)
def test_a_mistake_has_its_line(mine, text):
    text_with_base = text if "extends:" in text else f"extends: paper\n{text}"
    assert lines_of(mine, text_with_base) == [f"scenes/mine.yaml: {MISTAKES[text]}"]


@pytest.mark.parametrize(
    ("content", "line"),
    [
        ("", "empty; a scene file holds keys and values"),
        ("# nothing\n", "empty; a scene file holds keys and values"),
        ("- 1\n- 2\n", "[1, 2] is not allowed; a scene file holds keys and values"),
        ("text\n", "'text' is not allowed; a scene file holds keys and values"),
        (b"seed: 1  # \xb5m\n", "not UTF-8 text; byte 11 is 0xb5"),
        (
            b"a: \x00\n",
            "not valid YAML: unacceptable character #x0000: special characters are not allowed in "
            '"<unicode string>", position 3',
        ),
        ("a: 'b\n", "line 2, column 1: not valid YAML: found unexpected end of stream"),
        ("a:\n\tb: 1\n", "line 2, column 1: not valid YAML: found character '\\t' that cannot start any token"),
        ("a: 1\n---\na: 1\n", "line 2, column 1: not valid YAML: but found another document"),
        ('a: "\\Uffffffff"\n', "not valid YAML: "),
        ("a: " + "[" * 5000, "line 1, column 15: not valid YAML: nested deeper than 12"),
        ("# " + "x" * 1_000_000, "larger than 1000000 bytes, which no scene needs"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_a_file_that_is_no_scene(mine, content, line):
    (told,) = lines_of(mine, content)
    assert told.startswith(f"scenes/mine.yaml: {line}")
    assert "\n" not in told


def test_aliases_cannot_make_a_small_file_endless(mine):
    laughs = "".join(f"a{n + 1}: &a{n + 1} [{', '.join([f'*a{n}'] * 9)}]\n" for n in range(60))
    lines = lines_of(mine, f"a0: &a0 1\n{laughs}")
    assert all(line.startswith("scenes/mine.yaml: ") for line in lines)


def test_names_and_files(folder, monkeypatch):
    monkeypatch.chdir(folder)

    def lines(name):
        return lines_of(load, name, Path("scenes"), SCHEMA_PATH)

    rule = "a small letter, then at most 39 small letters, digits, _ or -"
    assert lines("papr") == [
        "scenes/papr.yaml: no such file; did you mean paper? scenes: fractal, given, measured, nongaussian, "
        "paper, resolved, smoke"
    ]
    for name in ("Paper", "", "2d", "a" * 41, "a.b"):
        assert lines(name) == [f"scenes: {name!r} is not allowed as the name of a scene; {rule}"]
    for name in RESERVED:
        assert lines(name) == [f"scenes: {name!r} is not allowed as the name of a scene; it is reserved"]
    assert lines("../scenes/absent.yaml") == ["../scenes/absent.yaml: no such file"]
    assert lines(folder / "scenes" / "absent.yaml") == ["scenes/absent.yaml: no such file"]
    assert lines("scenes/My Scene.yaml") == [
        f"scenes/My Scene.yaml: 'My Scene' is not allowed as the name of a scene; {rule}"
    ]
    (folder / "folder.yaml").mkdir()
    assert lines(Path("folder.yaml")) == ["folder.yaml: no such file"]


def test_all_mistakes_at_once(mine):
    text = """extends: base
seed: 1
seed: 2
strip: {cell_m: 0, length_m: 1, widht_m: 2.5e-5}
material: {young_modulus_pa: 2.1e11}
square: {modes: 101, nodes: 10}
oscillator:
ensemble: {discarded_periods: 200}
"""
    base = "extends: paper\nroughness: {covariance: cubic}\nensemble: {duration_periods: 150, realisations: 2.5}\n"
    assert sorted(lines_of(mine, text, base=base)) == [
        "scenes/base.yaml: ensemble.realisations: 2.5 is not allowed; a whole number >= 8 and <= 1000000",
        f"scenes/base.yaml: roughness.covariance: 'cubic' is not allowed; one of {KINDS}",
        "scenes/mine.yaml: ensemble.discarded_periods: 200 is not allowed; less than ensemble.duration_periods = 150",
        "scenes/mine.yaml: material.young_modulus_pa: '2.1e11' is text, not a number; "
        "write 2.1e+11, a number >= 1000 and <= 1e+13 [Pa]",
        "scenes/mine.yaml: oscillator: no value is not allowed; "
        + describe_allowed(SCHEMA["properties"]["oscillator"]),
        "scenes/mine.yaml: seed: 2 in line 3 repeats the key; give it once",
        "scenes/mine.yaml: square.modes: 101 is not allowed; at most square.nodes^2 = 10^2",
        "scenes/mine.yaml: strip.cell_m: 0 is not allowed; a number > 0 [m]",
        "scenes/mine.yaml: strip.widht_m: unknown key; did you mean width_m? allowed: "
        + ", ".join(SCHEMA["properties"]["strip"]["properties"]),
    ]


def test_what_no_target_reads_may_not_fit(mine):
    """A square of its own, with a correlation length too long for the strip that it inherits and does not use."""
    text = "extends: resolved\ntargets: [figure2]\nroughness: {correlation_length_m: 5.0e-4}\n"
    assert mine(text)["roughness"]["correlation_length_m"] == 5e-4
    assert len(lines_of(mine, text.replace("figure2", "figure3"))) == 1


def test_the_rule_on_training_strips_counts_the_columns_that_the_stages_take():
    from roughslip.scene_rules import _FUNCTIONALS, _training_columns
    from roughslip.stages.training import training_columns

    assert [_training_columns(n) for n in range(4, 60)] == [
        len(training_columns(slice(7, 7 + n))) for n in range(4, 60)
    ]
    assert len(NAMES) == _FUNCTIONALS


def test_lengths_at_the_edge_of_the_numbers(mine):
    """length / cell overflows to infinity, which is no whole multiple of anything."""
    lines = lines_of(mine, "extends: paper\nstrip: {cell_m: 1.0e-320}")
    keys = [line.split(": ")[1] for line in lines]
    lengths = ("cell", "length", "margin", "width", "window", "window_spacing")
    assert sorted(keys) == [f"strip.{key}_m" for key in lengths]


def test_friction_has_one_of_its_forms(mine):
    forms = {
        "{}": "friction: empty; give statistics, or mean_at_median with least_contact_fraction",
        "{mean_at_median: 0.3}": "friction.least_contact_fraction: missing; goes with friction.mean_at_median",
        "{least_contact_fraction: 0.1}": "friction.mean_at_median: missing; goes with friction.least_contact_fraction",
    }
    others = yaml.safe_dump({key: value for key, value in PAPER.items() if key != "friction"})
    for friction, line in forms.items():
        assert lines_of(mine, f"{others}friction: {friction}\n") == [f"scenes/mine.yaml: {line}"]


def test_the_square_is_truncated_by_number_or_by_share(mine):
    """What an overlay gives takes the place of what it inherits, either way; rules of the number need one."""
    text = "extends: paper\nsquare: {variance_share: 1, nodes: 5}\nexpansion: {samples: 1000000, degree: 1}\n"
    scene = mine(text)
    assert scene["square"]["variance_share"] == 1.0
    assert "modes" not in scene["square"]
    assert slice_for(scene, "surface")["square"].keys() == {"edge_m", "nodes", "variance_share"}
    back = mine("extends: base\nsquare: {modes: 20}\n", base=text)
    assert back["square"]["modes"] == 20
    assert "variance_share" not in back["square"]
    others = PAPER | {"square": {key: value for key, value in PAPER["square"].items() if key != "modes"}}
    assert lines_of(mine, yaml.safe_dump(others)) == [
        "scenes/mine.yaml: square.modes: missing; give it, or square.variance_share"
    ]


def test_a_scene_that_lacks_what_its_targets_need(mine):
    needed = {
        "figure2": {"material", "roughness", "square", "expansion", "numerics", "batches"},
        "figure3": {"material", "roughness", "strip", "expansion", "friction", "numerics", "batches"},
        "figure5": {"oscillator", "ensemble", "friction", "numerics", "batches"},
    }
    for target, sections in needed.items():
        all_sections = sections | needed["figure3"] if target == "figure5" else sections
        lines = lines_of(mine, f"description: own\nseed: 1\ntargets: [{target}]\n")
        assert sorted(lines) == sorted(f"scenes/mine.yaml: {key}: missing; needed for {target}" for key in all_sections)
    assert lines_of(mine, "numerics: {}\n") == [
        "scenes/mine.yaml: description: missing; text on one line, 1 to 200 characters",
        "scenes/mine.yaml: seed: missing; a whole number >= 0 and <= 4294967295",
        f"scenes/mine.yaml: targets: missing; a list of at least 1, each once, of one of {FIGURES}",
    ]


# --- overlays ---


def test_overlays_merge_to_any_depth(mine):
    scene = mine(
        "extends: a\nstrip: {samples: 20}",
        a="extends: b\nstrip: {samples: 30, training_samples: 9}",
        b="extends: paper\nensemble: {damping_ratios: [0.2]}\nseed: 7",
    )
    paper = load("paper", CONFIG / "scenes", SCHEMA_PATH)
    expected = copy.deepcopy(paper) | {"seed": 7}
    expected["strip"] |= {"samples": 20, "training_samples": 9}
    expected["ensemble"]["damping_ratios"] = [0.2]
    assert scene == expected


def test_a_byte_order_mark_is_read_over(mine):
    assert mine(b"\xef\xbb\xbfextends: paper\nseed: 5\n")["seed"] == 5


def test_overlays_in_a_circle(mine):
    assert lines_of(mine, "extends: a", a="extends: b", b="extends: a") == [
        "scenes/b.yaml: extends: 'a' is not allowed; overlays run in a circle: mine -> a -> b -> a"
    ]


def test_a_file_elsewhere_may_overlay_a_scene_of_its_own_name(folder, monkeypatch):
    monkeypatch.chdir(folder)
    Path("paper.yaml").write_text("extends: paper\nseed: 3\n")
    assert load("./paper.yaml", Path("scenes"), SCHEMA_PATH)["seed"] == 3


def test_one_form_of_friction_replaces_the_other(mine):
    scene = mine("extends: given\nfriction: {mean_at_median: 0.25, least_contact_fraction: 0.002}")
    assert scene["friction"] == {"mean_at_median": 0.25, "least_contact_fraction": 0.002}
    given = load("given", CONFIG / "scenes", SCHEMA_PATH)
    assert set(given["friction"]) == {"statistics"}
    narrower = mine("extends: given\nfriction: {statistics: {standard_deviation: 0.02}}")
    assert narrower["friction"]["statistics"] == given["friction"]["statistics"] | {"standard_deviation": 0.02}


def test_one_form_of_roughness_replaces_another(mine):
    scan = {"file": "a.x3p", "form": "plane", "covariance": "best", "marginal": "gaussian"}
    assert mine(f"extends: paper\nroughness: {{scan: {SCAN}}}")["roughness"] == {"scan": scan}
    fractal = mine(f"extends: paper\ntargets: [figure3]\nroughness: {{fractal: {FRACTAL}}}")["roughness"]
    assert fractal == {"rms_height_m": 5e-8, "fractal": {"hurst": 0.8, "azimuths": 8, "gamma": 1.5}}
    field = "roughness: {covariance: exponential, rms_height_m: 1.0e-7, correlation_length_m: 2.0e-5}"
    base = f"extends: paper\nroughness: {{scan: {SCAN}}}"
    assert set(mine(f"extends: base\n{field}", base=base)["roughness"]) == {
        *("covariance", "rms_height_m", "correlation_length_m")
    }
    matern = "extends: paper\nroughness: {covariance: matern, smoothness: 1.0}"
    assert "smoothness" not in mine("extends: base\nroughness: {covariance: gaussian}", base=matern)["roughness"]


def test_a_surface_after_a_scan_needs_the_scan_and_draws_it(mine):
    scene = mine(f"extends: paper\nroughness: {{scan: {SCAN}}}")
    for target in ("figure2", "figure3", "figure5", "figure_scan"):
        assert SCAN_STAGES - {"grinding"} <= stages_needed(scene | {"targets": [target]})
        assert figures(scene | {"targets": [target]}) == list(dict.fromkeys(["figure_scan", target]))
    assert stages_needed(scene | {"targets": ["figure_scan"]}) == (SCAN_STAGES - {"grinding"}) | ALWAYS
    given = mine(f"extends: given\nroughness: {{scan: {SCAN}}}")
    assert stages_needed(given) == OSCILLATOR | ALWAYS


def test_a_number_is_a_float_however_written(mine):
    as_integer = mine("extends: paper\noscillator: {mass_kg: 2}\nensemble: {damping_ratios: [0, 1]}")
    as_float = mine("extends: paper\noscillator: {mass_kg: 2.0}\nensemble: {damping_ratios: [0.0, 1.0e+0]}")
    assert repr(as_integer) == repr(as_float)
    assert isinstance(as_integer["square"]["nodes"], int)


# --- any change at all ---

ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.sampled_from([0, 1, 49, 50, 4000, 1e-320, 1e308, 10**400, "1e9", "gaussian", "paper", "\ud800", "\x85"]),
    st.text(max_size=8),
    st.lists(st.one_of(st.integers(), st.floats(), st.text(max_size=3), st.none()), max_size=4),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
)
FUZZ = settings(
    derandomize=True, deadline=None, max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def loads_or_tells(mine, content: str | bytes) -> None:
    try:
        scene = mine(content)
    except InputError as error:
        lines = error.lines
    else:
        assert all(math.isfinite(value) for value in numbers_in(scene))
        return
    assert lines
    assert all(re.match(r"scenes/mine\.yaml: \S", line) and len(line.splitlines()) == 1 for line in lines)


def numbers_in(value: object):
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for item in items:
        yield from numbers_in(item)
    if isinstance(value, int | float):
        yield value


@FUZZ
@given(st.sampled_from(leaves(PAPER)), st.one_of(st.just(...), ANYTHING))
def test_any_changed_value_loads_or_is_told(mine, path, value):
    scene = copy.deepcopy(PAPER)
    inner = scene
    for key in path[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    loads_or_tells(mine, yaml.safe_dump(scene))


@settings(FUZZ)
@given(
    st.integers(0, len(PAPER_TEXT)),
    st.one_of(st.binary(max_size=6), st.text(":{}[]&*!'\"\\#\n\t -?|>%@0e", max_size=6)),
)
def test_any_text_loads_or_is_told(mine, place, text):
    inserted = text if isinstance(text, bytes) else text.encode()
    loads_or_tells(mine, PAPER_TEXT[:place].encode() + inserted + PAPER_TEXT[place:].encode())


# --- stages ---


ALWAYS = {"claims", "costs", "report"}
OSCILLATOR = {"deterministic", "oscillator", "cycles", "figure5"}
SCAN_STAGES = {"grinding", "scan", "twins", "figure_scan"}


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(properties(SCHEMA))
    read = {key for slices in SLICES.values() for key in slices}
    assert read <= keys
    unread = {key for key in keys if not any(f"{key}.".startswith(f"{r}.") or r.startswith(f"{key}.") for r in read)}
    # the rules turn this number of samples into jobs, and no stage reads it
    assert {key for key in unread if not key.startswith("batches")} == {"extends", "square.monte_carlo_samples"}


def test_a_slice_has_the_shape_of_the_scene():
    scene = load("paper", CONFIG / "scenes", SCHEMA_PATH)
    square = scene["square"]
    assert slice_for(scene, "surface") == {
        "roughness": scene["roughness"],
        "square": {key: square[key] for key in ("edge_m", "nodes", "modes")},
    }
    assert slice_for(load("given", CONFIG / "scenes", SCHEMA_PATH), "oscillator")["friction"]["statistics"]["mean"] > 0
    assert "friction" not in slice_for(scene, "oscillator")
    slice_for(scene, "friction")["strip"]["penetration_percentiles"].clear()
    assert scene["strip"]["penetration_percentiles"]


@pytest.mark.parametrize(
    ("key", "value", "stages"),
    [
        ("ensemble.damping_ratios", [0.1, 0.2], {"deterministic", "oscillator"}),
        ("batches.strip_samples", 7, set()),
        ("numerics.contact_tolerance", 1e-9, {"contact_square", "training_square", "contact_strip"}),
        ("strip.samples", 99, {"friction"}),
        ("friction.mean_at_median", 0.2, {"friction"}),
        ("square.monte_carlo_samples", 999, set()),
        ("expansion.draws", 9999, {"chaos_square"}),
        ("description", "other", {"figure2", "figure3", "figure5", "figure_scan", *ALWAYS, "reference"}),
    ],
)
def test_a_change_reaches_only_the_stages_that_read_it(key, value, stages):
    scene = load("paper", CONFIG / "scenes", SCHEMA_PATH)
    changed = copy.deepcopy(scene)
    inner = changed
    for part in key.split(".")[:-1]:
        inner = inner[part]
    assert inner[key.split(".")[-1]] != value
    inner[key.split(".")[-1]] = value
    assert {stage for stage in SLICES if slice_for(scene, stage) != slice_for(changed, stage)} == stages


def test_only_stages_that_the_targets_need():
    paper = load("paper", CONFIG / "scenes", SCHEMA_PATH)
    square = {"surface", "design", "contact_square", "chaos_square", "figure2"}
    strip = {"contact_strip", "chaos_strip", "expansion_strip", "friction"}
    assert stages_needed(paper) == set(SLICES) - {"reference", "training_square"} - SCAN_STAGES
    assert stages_needed(paper | {"targets": ["figure2"]}) == square | ALWAYS
    assert stages_needed(paper | {"targets": ["figure3"]}) == strip | {"figure3"} | ALWAYS
    found = paper | {"expansion": paper["expansion"] | {"samples": "auto", "cdf_error": 0.01}}
    assert stages_needed(found | {"targets": ["figure2"]}) == square | {"training_square"} | ALWAYS
    assert stages_needed(found | {"targets": ["figure3"]}) == strip | {"figure3"} | ALWAYS
    assert stages_needed(paper | {"targets": ["figure5"]}) == strip | OSCILLATOR | ALWAYS


def test_given_statistics_need_no_contact():
    assert stages_needed(load("given", CONFIG / "scenes", SCHEMA_PATH)) == OSCILLATOR | ALWAYS


def test_given_statistics_need_nothing_but_an_oscillator(mine):
    paper = load("paper", CONFIG / "scenes", SCHEMA_PATH)
    own = {key: paper[key] for key in ("description", "seed", "oscillator", "ensemble")}
    own |= {"targets": ["figure5"], "friction": load("given", CONFIG / "scenes", SCHEMA_PATH)["friction"]}
    own |= {"numerics": {"oscillator_tolerance": 1e-8}, "batches": {"realisations": 50}}
    assert stages_needed(mine(yaml.safe_dump(own))) == OSCILLATOR | ALWAYS
