"""Warnings on scenes that are allowed but implausible: each rule at both sides of its threshold."""

import copy
import math

import pytest

from roughslip.scene.loader import load
from roughslip.surface.plausibility import rms_slope
from tests.scene.shipped import shipped_scene
from workflow.study.plausibility import inherited, motion_warnings, scene_warnings, surface_mistake, surface_of

SQ, LENGTH = 5e-8, 1.416e-5  # of the scene `resolved`, which has no warning
GAUSSIAN = {"covariance": "gaussian", "hurst": None, "bandwidth": None}


def changed(name="resolved", **sections):
    scene = copy.deepcopy(shipped_scene(name))
    for section, values in sections.items():
        scene[section] = {**scene[section], **values} if isinstance(values, dict) else values
    return scene


def rms(slope: float, cell: float = 1.25e-6) -> dict:
    """Gaussian heights of that rms slope between nodes: slope^2 = 4 Sq^2 (1 - exp(-(h/l)^2)) / h^2."""
    height = slope * cell / math.sqrt(-4 * math.expm1(-((cell / LENGTH) ** 2)))
    return {**GAUSSIAN, "correlation_length_m": LENGTH, "rms_height_m": height}


SELF_AFFINE = {"covariance": "self_affine", "hurst": 0.5, "correlation_length_m": 1.37e-5}

# By key the values on either side of a threshold, the plausible one first, and what the warning says.
SIDES = [
    ("roughness", rms(0.499), rms(0.501), "rms slope 0.501 between neighbouring nodes"),
    # rubber of 0.1 MPa is soft, but there is such
    ("material.young_modulus_pa", 1.0e5, 0.99e5, "material.young_modulus_pa = 9.9e+04 Pa is below the 100000 Pa of"),
    ("material.young_modulus_pa", 1.3e12, 1.31e12, "material.young_modulus_pa = 1.31e+12 Pa is above the 1.3e+12 Pa"),
    ("material.hardness_pa", 1.0e6, 0.99e6, "material.hardness_pa = 9.9e+05 Pa is below the 1e+06 Pa of rubber"),
    ("roughness.correlation_length_m", 5.0e-6, 4.99e-6, "strip.cell_m = 1.25e-06 m above a quarter of the corr"),
    ("square.edge_m", LENGTH * 16, LENGTH * 16.16, "square.edge_m / square.nodes = 3.58e-06 m above a quarter of"),
    # of 60 µm over 11, and over 14
    ("roughness", SELF_AFFINE | {"bandwidth": 11}, SELF_AFFINE | {"bandwidth": 14}, "cells of 1.25e-06 m above a qu"),
    ("roughness.correlation_length_m", 6.0e-5, 6.1e-5, "correlation length 6.1e-05 m along the belt (roughness.corr"),
    # C(8 + 3, 3) = 165
    ("expansion.samples", 330, 329, "expansion.samples = 329 are fewer than 2 for each of the 165 terms"),
]
OF_STRIPS = {"targets": ["figure3"]}  # else the square of `resolved` would be warned of as well


@pytest.mark.parametrize(("key", "plausible", "implausible", "text"), SIDES)
def test_a_rule_warns_on_one_side_of_its_threshold(key, plausible, implausible, text):
    section, _, name = key.partition(".")
    others = OF_STRIPS if text.startswith(("strip.cell_m", "cells of")) else {}

    def warned(value):
        part = {name: value} if name else value
        return scene_warnings(changed(**{**others, section: {**others.get(section, {}), **part}}))

    assert warned(plausible) == []
    (line,) = warned(implausible)
    assert line.startswith(text)


CURVE, MACHINE = "the friction curve of scene paper", "the machine of scene %s"
OWN = "oscillator: {mass_kg: 5, stiffness_n_per_m: 1.0e+5, law: table, friction_table: [[0, 0.4], [1, 0.3]]}\n"
HEIGHTS = "roughness: {rms_height_m: 1.0e-6}\n"
LOADED = "extends: %s\nload: {force_n: 2000, nominal_pressure_pa: 2.0e+6}\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (LOADED % "quick", f"the surface of scene paper and resolved, {CURVE}, {MACHINE % 'paper'}: "),
        (LOADED % "quick" + HEIGHTS, f"load of this scene meets {CURVE}, {MACHINE % 'paper'}: give your own"),
        (LOADED % "quick" + HEIGHTS + OWN, ""),
        (LOADED % "slideway" + HEIGHTS, f"the friction curve of scene slideway, {MACHINE % 'slideway'}: "),
        (LOADED % "base", ""),
        ("extends: given\ntargets: [answer]\nfriction: {record: a.csv}\n", f"this scene meets {MACHINE % 'given'}: "),
        ("extends: given\noscillator: {damping_ratio: 0.1}\n", ""),
    ],
)
def test_what_a_scene_of_a_user_has_of_a_shipped_one_is_warned_of(tmp_path, text, said):
    """A load, a modulus or a record of a user on curve, machine and surface of shipped scenes, until the user, or a
    base of the user, gives them."""
    for name, content in {"base": f"extends: quick\n{HEIGHTS}{OWN}", "mine": text}.items():
        (tmp_path / f"{name}.yaml").write_text(content, encoding="utf-8")
    lines = inherited("mine", load("mine", tmp_path))
    assert len(lines) == bool(said)
    assert said in "".join(lines)
    assert [inherited(name, shipped_scene(name)) for name in ("paper", "resolved", "disc_brake", "clutch")] == [[]] * 4


@pytest.mark.parametrize("hardness", [None, 1.0e8])
def test_a_load_of_full_contact_and_one_of_few_contacts_are_named_before_a_cell_is_solved(hardness):
    """`disc_brake` has E* = 2 GPa / (1 - 0.25^2).

    Contact is full from 2 E* h' or H on. There are few where sqrt(2 pi) p / (E* h'), or p / H, of 2^21 cells are fewer
    than four correlation areas.
    """
    scene = shipped_scene("disc_brake")
    cell, (covariance, lengths, _) = scene["strip"]["cell_m"], surface_of(scene)
    scale = 2.0e9 / (1 - 0.25**2) * rms_slope(covariance, cell)
    hard = hardness or math.inf

    def said(pressure):
        load = {"nominal_pressure_pa": pressure}
        return surface_mistake(changed("disc_brake", load=load, material={"hardness_pa": hardness}))[1]

    share = 4 * math.prod(lengths) / (2**21 * cell**2)
    most, least = min(2 * scale, hard), share * min(scale / math.sqrt(2 * math.pi), hard)
    assert said(0.999 * most) == said(1.001 * least) == said(5e5) == ""
    assert "full contact" in said(1.001 * most)
    assert "is nearly no contact" in said(0.999 * least)


@pytest.mark.parametrize(
    ("covariance", "shapes", "has_slope"),
    [
        ("exponential", {}, False),
        ("matern", {"smoothness": 1.0}, False),
        ("matern", {"smoothness": 1.2}, True),
        ("self_affine", {"hurst": 0.3, "bandwidth": 1e3}, True),
    ],
)
def test_a_load_on_heights_without_slope_is_refused(covariance, shapes, has_slope):
    """Matern has a slope above nu = 1. Every self_affine one ends at its cut-off. Without a load all are allowed."""
    roughness = {**GAUSSIAN, "covariance": covariance, **shapes}
    text = surface_mistake(changed("disc_brake", roughness=roughness))[1]
    assert text == "" if has_slope else text.startswith(f"{covariance} is not allowed with load: its rms slope is inf")
    assert surface_mistake(changed(roughness=roughness))[1] == ""


@pytest.mark.parametrize(("young", "ratio"), [(1e8, 0.3), (9.9e9, 0.3), (1e10, 0.04), (2.1e11, 0.04)])
def test_elastic_contact_that_the_hardest_solid_would_not_bear_is_warned_of(young, ratio):
    """E* h' / H = 0.3 with H = 0.3 E of polymers and 0.04 E of metals; rubber, and a hardness, are not warned of."""
    cell = shipped_scene("disc_brake")["strip"]["cell_m"]

    def warned(slope, **material):
        solid = {"young_modulus_pa": young, "poisson_ratio": 0.25, "hardness_pa": None, **material}
        return scene_warnings(changed("disc_brake", material=solid, roughness=rms(slope, cell)))

    limit = 0.3 * ratio * (1 - 0.25**2)
    assert warned(0.999 * limit) == []
    (line,) = warned(1.001 * limit)
    assert line.startswith("material.hardness_pa is not given: elastic contact here has E* h' / H = 0.3 with the")
    assert warned(1.001 * limit, hardness_pa=1e9) == []
    assert warned(0.49, young_modulus_pa=0.99e8) == []


def test_a_length_far_below_a_cell_is_refused_with_the_nodes_that_it_would_take():
    """Heights of independent nodes are allowed, and four windows of 0.6 mm at 4 nodes a nanometre are 9.6 million."""
    strip = {"cell_m": 2.5e-6}
    assert surface_mistake(changed(strip=strip, roughness={"correlation_length_m": 2.6e-8}))[1] == ""
    far = {"strip": strip, "roughness": {"correlation_length_m": 1e-9}}
    assert "9.6e+06 nodes" in surface_mistake(changed(**far))[1]
    given = {"mean": 0.3, "statistics": {"standard_deviation": 0.02, "correlation_length_m": 2e-3}}
    assert (
        "nodes" in surface_mistake(changed(**far, friction=given, targets=["figure_chain"]))[1]
    )  # it draws the surface


@pytest.mark.parametrize(
    ("key", "usual", "unusual", "text"),
    [
        # sqrt(k / 1 kg) / 2 pi with k = 0.395 N/m is 0.1 Hz, with 3.948e+9 N/m 10 kHz
        ("stiffness_n_per_m", 0.3949, 0.3946, "have a natural frequency of 0.1 Hz; usual are 0.1 to 10000 Hz"),
        ("stiffness_n_per_m", 3.947e9, 3.949e9, "have a natural frequency of 1e+04 Hz"),
        # 0.4 N over 9.9856e+4 N/m is 0.1 m with N = 24964 N, 1 nm with 2.496e-4 N
        ("normal_force_n", 24960.0, 24970.0, "friction of 9.99e+03 N pulls the spring by 0.1 m; usual are"),
        ("normal_force_n", 2.497e-4, 2.496e-4, "friction of 9.98e-05 N pulls the spring by 1e-09 m"),
    ],
)
def test_an_unusual_frequency_or_deflection_is_warned_of(key, usual, unusual, text):
    """Friction is the static one, 0.4."""

    def warned(value):
        return [line for line in motion_warnings(changed("given", oscillator={key: value})) if text[:9] in line]

    assert warned(usual) == []
    (line,) = warned(unusual)
    assert text in line
