"""Shipped scenes are valid, say where each number comes from, and overlays exercise every option that is offered."""

import re

import pytest
import yaml

from roughslip.scene.loader import load, scene_names
from roughslip.scene.plan import slice_for, stages_needed
from tests.scene.shipped import CONFIG, SCAN, SCENES, SCHEMA, STATISTICS, TABLE, properties, shipped_scene

# Overlays that validate and plan: the options that README.md offers and no shipped scene sets.
OPTIONS = (
    "expansion: {samples: auto, cdf_error: 0.01, design: sobol}",
    "expansion: {samples: auto, cdf_error: 0.01, design: monte_carlo, variables: best, rotation: regression}",
    "expansion: {design: latin_hypercube, rotation: none}",
    "expansion: {rotation: local, target: best}",
    "targets: [figure2]\nexpansion: {target: censored}",
    "square: {variance_share: 0.95}",
    f"oscillator: {{law: table, friction_table: {TABLE[:-1]}, interpolation: linear}}}}",
    f"oscillator: {{law: table, friction_table: {TABLE[:-1]}, interpolation: monotone_cubic}}}}",
    "oscillator: {law: stribeck, friction_follows: time, correlation_time_s: 1.0e-4, negative_friction: refuse}",
    "oscillator: {friction_follows: belt, negative_friction: clip, integrator: dormand_prince853}",
    "oscillator: {friction_follows: slip, integrator: fehlberg45, penetration_percentile: 30}",
    "oscillator: {windows_in_parallel: 100}",
    "ensemble: {nodes_per_correlation_length: auto, count_error: 0.05, process: embedding}",
    "ensemble: {process: spectral, marginal: paper, interpolation: linear}",
    "ensemble: {process: recursion, marginal: empirical, interpolation: cubic}",
    "ensemble: {marginal: beta, count_by_period: true}",
    "roughness: {correlation_length_across_m: 2.0e-6, lay_rad: 0.5}",
    "roughness: {covariance: self_affine, hurst: 0.8, bandwidth: 100}",
    "roughness: {covariance: matern, smoothness: 1.5}",
    "roughness: {covariance: exponential}",
    "roughness: {covariance: separable_exponential}",
    "roughness: {marginal: {family: weibull, shapes: [2], mirrored: true, correct_correlation: true}}",
    "roughness: {marginal: {family: lognormal, shapes: [0.4]}}",
    "roughness: {covariance: gaussian, marginal: {family: beta, shapes: [2.1, 5]}}",
    *(
        f"roughness: {{scan: {{file: a.txt, spacing_x_m: 1.0e-6, spacing_y_m: 1.0e-6, height_unit: {unit}, form: {form}"
        f", covariance: {covariance}, marginal: {marginal}}}}}"
        for unit, form, covariance, marginal in (
            ("m", "mean", "measured", "beta"),
            ("mm", "plane", "best", "weibull"),
            ("um", "quadratic", "gaussian", "lognormal"),
            ("nm", "plane", "exponential", "empirical"),
            ("pm", "plane", "separable_exponential", "gaussian"),
            ("nm", "plane", "matern", "gaussian"),
            ("nm", "plane", "self_affine", "gaussian"),
        )
    ),
    f"targets: [figure_scan]\nroughness: {{scan: {SCAN}}}",
    "extends: fractal\n"
    "roughness: {fractal: {longest_wavelength_m: 1.0e-3, shortest_wavelength_m: 2.0e-5}}\ntargets: [figure3]",
    f"targets: [figure5, figure_map]\nfriction: {{statistics: {STATISTICS}}}",
)


def leaves(values: dict, prefix: str = ""):
    """The dotted keys of a scene file, with their values."""
    for key, value in values.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield prefix + key, value


@pytest.mark.parametrize("text", OPTIONS)
def test_an_option_validates_and_plans(mine, text):
    scene = mine(text if "extends:" in text else f"extends: paper\n{text}")
    assert all(slice_for(scene, stage) for stage in stages_needed(scene))


def test_every_key_and_word_is_set_by_a_shipped_scene_or_an_option():
    texts = [*OPTIONS, *((CONFIG / "scenes" / f"{name}.yaml").read_text() for name in SCENES)]
    given = [pair for text in texts for pair in leaves(yaml.safe_load(text))]
    keys, words = {key for key, _ in given}, {(key, value) for key, value in given if isinstance(value, str)}
    for key, part in properties(SCHEMA).items():
        assert part["type"] == "object" or key in keys, key
        assert all((key, word) in words for word in part.get("enum", ())), (key, part["enum"])


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_are_valid(name):
    scene = shipped_scene(name)
    assert "extends" not in scene
    assert scene == load(CONFIG / "scenes" / f"{name}.yaml", CONFIG / "scenes")


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
    assert path.stem in SCENES
    assert scene_names(path.parent) == sorted(SCENES)
