"""What overlays of scene files become, and scenes that are refused as a whole.

The spring by its stiffness, and what a scene with another oscillator no longer inherits.
"""

import copy
from pathlib import Path

import pytest
import yaml

from roughslip.chaos.functionals import NAMES
from roughslip.limits import FUNCTIONALS
from roughslip.scene import contact, friction
from roughslip.scene.declarations import declarations
from roughslip.scene.loader import RESERVED, load
from roughslip.scene.schema import describe_allowed
from roughslip.scene.types import slice_for
from roughslip.stages.from_scene.geometry import training_columns
from tests.scene.shipped import FIGURES, FRACTAL, KINDS, PAPER, SCAN, SCHEMA, TABLE, lines_of, shipped_scene


def test_overlays_merge_to_any_depth(mine):
    scene = mine(
        b"\xef\xbb\xbfextends: a\nstrip: {samples: 20}",  # a byte order mark is read over
        a="extends: b\nstrip: {samples: 30, training_samples: 9}",
        b="extends: paper\nensemble: {damping_ratios: [0.2]}\nseed: 7",
    )
    paper = shipped_scene("paper")
    expected = copy.deepcopy(paper) | {"seed": 7}
    expected["strip"] |= {"samples": 20, "training_samples": 9}
    expected["ensemble"]["damping_ratios"] = [0.2]
    expected["targets"].append("figure_map")  # none of the three names its own
    assert scene == expected


def test_overlays_in_a_circle(mine):
    assert lines_of(mine, "extends: a", a="extends: b", b="extends: a") == [
        "scenes/b.yaml: extends: 'a' is not allowed; overlays run in a circle: mine -> a -> b -> a"
    ]


SOLVED = "friction: {mean_at_median: 0.25, least_contact_fraction: 0.002}"
FIELD = "roughness: {covariance: exponential, rms_height_m: 1.0e-7, correlation_length_m: 2.0e-5}"
BY_TABLE = f"oscillator: {{law: table, friction_table: {TABLE}}}"
SCANNED = f"extends: paper\nroughness: {{scan: {SCAN}}}"
BY_SHARE = "extends: paper\nsquare: {variance_share: 1, nodes: 5}\nexpansion: {samples: 1000000, degree: 1}"
MATERN = "extends: paper\nroughness: {covariance: matern, smoothness: 1.0}"


@pytest.mark.parametrize(
    ("base", "overlay", "section", "kept", "replaced"),
    [
        ("extends: given", SOLVED, "friction", "mean_at_median least_contact_fraction", "statistics"),
        ("extends: paper", f"roughness: {{scan: {SCAN}}}", "roughness", "scan", "covariance rms_height_m"),
        ("extends: fractal", f"roughness: {{fractal: {FRACTAL}}}", "roughness", "rms_height_m fractal", "covariance"),
        (SCANNED, FIELD, "roughness", "covariance rms_height_m correlation_length_m", "scan"),
        (MATERN, "roughness: {covariance: gaussian}", "roughness", "rms_height_m", "smoothness"),
        (f"extends: given\n{BY_TABLE}", "seed: 4", "oscillator", "friction_table", ""),
        (f"extends: given\n{BY_TABLE}", "oscillator: {law: coulomb}", "oscillator", "law", "friction_table"),
        ("extends: paper", BY_SHARE.partition("\n")[2], "square", "variance_share", "modes"),
        ("extends: paper", "map: {parameters: [mass, load]}", "map", "parameters points", "ranges"),
        (BY_SHARE, "square: {modes: 20}", "square", "modes", "variance_share"),
    ],
)
def test_what_an_overlay_gives_takes_the_place_of_what_excludes_it(mine, base, overlay, section, kept, replaced):
    section_ = mine(f"extends: base\n{overlay}", base=base)[section]
    assert set(kept.split()) <= section_.keys()
    assert set(replaced.split()).isdisjoint(section_)


def test_forms_merge_and_a_share_of_the_variance_has_no_modes(mine):
    narrower = mine("extends: given\nfriction: {statistics: {standard_deviation: 0.02}}")
    expected = shipped_scene("given")["friction"]["statistics"] | {"standard_deviation": 0.02}
    assert narrower["friction"]["statistics"] == expected
    assert slice_for(mine(BY_SHARE), "karhunen_loeve")["square"]["modes"] is None
    others = PAPER | {"square": {key: value for key, value in PAPER["square"].items() if key != "modes"}}
    assert lines_of(mine, yaml.safe_dump(others)) == [
        "scenes/mine.yaml: square.modes: missing; give it, or square.variance_share"
    ]


@pytest.mark.parametrize(
    "load",
    [
        "{force_n: 1500, apparent_area_m2: 1.5e-5}",
        "{nominal_pressure_pa: 1.0e+8, apparent_area_m2: 1.5e-5}",
        "{force_n: 1500, nominal_pressure_pa: 1.0e+8}",
    ],
)
def test_two_parts_of_a_load_take_the_place_of_what_was_given_by_hand(mine, load):
    """1500 N = 100 MPa x 1.5e-5 m^2, which are 1000 windows of 25 um x 600 um. Figure 3 is over loads."""
    by_hand = "extends: paper\noscillator: {penetration_percentile: 30, windows_in_parallel: 7}"
    scene = mine(f"extends: base\nload: {load}", base=by_hand)
    assert scene["load"] == pytest.approx(
        {"force_n": 1500.0, "nominal_pressure_pa": 1e8, "apparent_area_m2": 1.5e-5}, rel=1e-12
    )
    assert scene["oscillator"]["normal_force_n"] == pytest.approx(1500.0, rel=1e-12)
    assert scene["oscillator"]["windows_in_parallel"] == 1000
    assert scene["oscillator"]["penetration_percentile"] is None
    assert scene["targets"] == ["figure2", "friction_against_load", "figure5", "figure_map"]
    assert scene["friction"]["scatter"] == "multiplicative"
    least = mine("extends: paper\nload: {force_n: 1, apparent_area_m2: 1.5e-8}")  # a window, but for rounding
    assert least["oscillator"]["windows_in_parallel"] == 1
    for window, windows in ((0.0, 0), (1e-200, 1)):  # a zero is refused by its range; an area below all doubles here
        tiny = {"load": {"force_n": 1.0, "nominal_pressure_pa": 1e5}, "strip": {"window_m": window, "width_m": 1e-200}}
        assert len(list(friction.mistakes(tiny))) == windows
    (absent,) = friction.mistakes({"oscillator": {"mass_kg": 1.0}})
    assert absent == (("oscillator.normal_force_n",), "missing; give it, or load")


def test_a_number_is_a_float_however_written(mine):
    as_integer = mine("extends: paper\noscillator: {mass_kg: 2}\nensemble: {damping_ratios: [0, 1]}")
    as_float = mine("extends: paper\noscillator: {mass_kg: 2.0}\nensemble: {damping_ratios: [0.0, 1.0e+0]}")
    assert repr(as_integer) == repr(as_float)
    assert isinstance(as_integer["square"]["nodes"], int)


def test_names_and_files(folder, monkeypatch):
    monkeypatch.chdir(folder)

    def lines(name):
        return lines_of(load, name, Path("scenes"))

    rule = "a small letter, then at most 39 small letters, digits, _ or -"
    assert lines("papr") == [
        "scenes/papr.yaml: no such file; did you mean paper? scenes: cam_follower, cam_follower_long, clutch, "
        "clutch_long, coulomb, disc_brake, disc_brake_long, elastoplastic, excited, excited_away, fractal, given, "
        "measured, nongaussian, paper, quick, resolved, rubber_bearing, rubber_bearing_long, slideway, slideway_long, "
        "smoke, tribometer"
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
    Path("paper.yaml").write_text("extends: paper\nseed: 3\n")  # elsewhere, of a scene of its own name
    assert load("./paper.yaml", Path("scenes"))["seed"] == 3


def test_all_mistakes_at_once(mine):
    text = """extends: base
seed: 1
strip: {cell_m: 0, length_m: 0.01, widht_m: 2.5e-5}
material: {young_modulus_pa: 2.1e11}
square: {modes: 101, nodes: 10}
oscillator:
ensemble: {drawn_realisations: 200}
"""
    base = "extends: paper\nroughness: {covariance: cubic}\nensemble: {duration_periods: 10, realisations: 150}\n"
    assert sorted(lines_of(mine, text, base=base)) == [
        "scenes/base.yaml: ensemble.duration_periods: 10 is not allowed; a number >= 20 and <= 10000",
        f"scenes/base.yaml: roughness.covariance: 'cubic' is not allowed; one of {KINDS}",
        "scenes/mine.yaml: ensemble.drawn_realisations: 200 is not allowed; at most ensemble.realisations = 150",
        "scenes/mine.yaml: material.young_modulus_pa: '2.1e11' is text, not a number; "
        "write 2.1e+11, a number >= 1000 and <= 1e+13 [Pa]",
        "scenes/mine.yaml: oscillator: no value is not allowed; "
        + describe_allowed(SCHEMA["properties"]["oscillator"]),
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


def test_rules_count_as_the_stages_do():
    columns = range(4, 60)
    assert [contact.training_columns(n) for n in columns] == [len(training_columns(slice(7, 7 + n))) for n in columns]
    assert len(NAMES) == FUNCTIONALS


def test_friction_has_one_of_its_forms(mine):
    forms = {
        "{}": "friction: empty; give statistics, record, or mean_at_median with least_contact_fraction",
        "{mean_at_median: 0.3}": "friction.least_contact_fraction: missing; goes with friction.mean_at_median",
        "{least_contact_fraction: 0.1}": "friction.mean_at_median: missing; goes with friction.least_contact_fraction",
    }
    others = yaml.safe_dump({key: value for key, value in PAPER.items() if key != "friction"})
    for given, line in forms.items():
        assert lines_of(mine, f"{others}friction: {given}\n") == [f"scenes/mine.yaml: {line}"]


def test_a_scene_that_lacks_what_its_targets_need(mine):
    needed = {
        "figure2": {"material", "roughness", "square", "expansion", "numerics"},
        "figure3": {"material", "roughness", "strip", "expansion", "friction", "numerics"},
        "figure5": {"oscillator", "ensemble", "friction", "numerics"},
        "answer": {"oscillator", "friction", "numerics"},
        "figure_map": {"oscillator", "map", "friction", "numerics"},
    }
    for target, sections in needed.items():
        all_sections = sections | needed["figure3"] if "oscillator" in sections else sections
        lines = lines_of(mine, f"description: own\nseed: 1\ntargets: [{target}]\n")
        assert sorted(lines) == sorted(f"scenes/mine.yaml: {key}: missing; needed for {target}" for key in all_sections)
    assert lines_of(mine, "numerics: {}\n") == [
        "scenes/mine.yaml: description: missing; text on one line, 1 to 200 characters",
        "scenes/mine.yaml: seed: missing; a whole number >= 0 and <= 4294967295",
        f"scenes/mine.yaml: targets: missing; a list of at least 1, each once, of one of {FIGURES}",
    ]


def test_a_stiffness_gives_the_frequency_with_the_mass_of_the_scene(mine):
    """sqrt(k / m); a scene that changes the mass alone keeps the spring."""
    base = "extends: paper\noscillator: {stiffness_n_per_m: 1.6e+5}"
    assert mine(base)["oscillator"]["natural_frequency_rad_per_s"] == 400.0
    heavy = mine("extends: base\noscillator: {mass_kg: 4}", base=base)["oscillator"]
    assert (heavy["natural_frequency_rad_per_s"], heavy["stiffness_n_per_m"]) == (200.0, 1.6e5)
    back = mine("extends: base\noscillator: {natural_frequency_rad_per_s: 316}", base=base)["oscillator"]
    assert "stiffness_n_per_m" not in back


@pytest.mark.parametrize("changed", ["oscillator: {mass_kg: 2}", "friction: {mean_at_median: 0.2}"])
def test_another_oscillator_or_friction_has_its_own_list_and_ranges(mine, changed):
    scene = mine(f"extends: paper\n{changed}")
    assert "damping_ratios" not in scene["ensemble"]
    assert "ranges" not in scene["map"]
    kept = mine(f"extends: paper\n{changed}\nensemble: {{damping_ratios: [0.1]}}")
    assert kept["ensemble"]["damping_ratios"] == [0.1]


def test_only_a_scene_that_names_no_targets_gets_a_map(mine):
    assert mine("extends: given")["targets"] == ["figure5", "figure_map"]
    assert mine("extends: given\ntargets: [figure5]")["targets"] == ["figure5"]
    assert mine("extends: excited")["targets"] == ["figure5"]
    assert mine("extends: elastoplastic")["targets"] == ["figure2", "figure3"]


def test_a_standard_uncertainty_reaches_only_the_stage_that_asks_for_it(mine):
    """Values stand in their places, overlays merge into the group, and no other slice, so no other key, changes."""
    plain = mine("extends: disc_brake\ntargets: [figure_budget]\noscillator: {mass_kg: 9, static_friction: 0.45}\n")
    other = "extends: disc_brake\noscillator: {mass_kg: {value: 8, standard_uncertainty: 2}}\n"
    table = "friction_table: [[0, {value: 0.45, standard_uncertainty: 0.02}], [0.02, 0.42], [0.1, 0.39], [0.5, 0.38]]"
    text = f"extends: other\ntargets: [figure_budget]\noscillator: {{mass_kg: {{value: 9}}, {table}}}\n"
    scene = mine(text, other=other)
    assert ["oscillator.mass_kg", 2.0] in scene["standard_uncertainties"]
    assert ["oscillator.friction_table.0.1", 0.02] in scene["standard_uncertainties"]
    changed = {stage for stage in declarations() if slice_for(plain, stage) != slice_for(scene, stage)}
    assert changed == {"budget"}
    assert "figure_budget" in mine(other)["targets"]
    exact = mine("extends: other\noscillator: {mass_kg: 8}\n", other=other)
    assert "oscillator.mass_kg" not in dict(exact.get("standard_uncertainties", []))
