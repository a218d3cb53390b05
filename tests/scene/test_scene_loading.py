"""What overlays of scene files become, and scenes that are refused as a whole.

The spring by its stiffness, and what a scene with another oscillator no longer inherits.
"""

import copy
from pathlib import Path

import pytest
import yaml

from roughslip.chaos.variables import NAMES
from roughslip.limits import FUNCTIONALS
from roughslip.scene import contact, friction
from roughslip.scene.loader import RESERVED, load
from roughslip.scene.schema import describe_allowed, scene_schema
from roughslip.study.from_scene.geometry import training_columns
from roughslip.study.graph import STAGES
from tests.scene.shipped import PAPER, SCAN, SCENES, TABLE, WORDS, lines_of, shipped_scene, slice_for


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


SOLVED = "friction: {mean: 0.25}"
FIELD = "roughness: {covariance: exponential, rms_height_m: 1.0e-7, correlation_length_m: 2.0e-5}"
BY_TABLE = f"oscillator: {{law: table, friction_table: {TABLE}}}"
SCANNED = f"extends: paper\nroughness: {{scan: {SCAN}}}"
MATERN = "extends: paper\nroughness: {covariance: matern, smoothness: 1.0}"


@pytest.mark.parametrize(
    ("base", "overlay", "section", "kept", "replaced"),
    [
        ("extends: tribometer", SOLVED, "friction", "mean", "record"),
        ("extends: paper", f"roughness: {{scan: {SCAN}}}", "roughness", "scan", "covariance rms_height_m"),
        ("extends: fractal", "roughness: {hurst: 0.7}", "roughness", "rms_height_m hurst wavelengths_m", "covariance"),
        (SCANNED, FIELD, "roughness", "covariance rms_height_m correlation_length_m", "scan"),
        (MATERN, "roughness: {covariance: gaussian}", "roughness", "rms_height_m", "smoothness"),
        (f"extends: given\n{BY_TABLE}", "seed: 4", "oscillator", "friction_table", ""),
        (f"extends: given\n{BY_TABLE}", "oscillator: {law: coulomb}", "oscillator", "law", "friction_table"),
        ("extends: paper", "map: {parameters: [mass, load]}", "map", "parameters points", "ranges"),
    ],
)
def test_what_an_overlay_gives_takes_the_place_of_what_excludes_it(mine, base, overlay, section, kept, replaced):
    section_ = mine(f"extends: base\n{overlay}", base=base)[section]
    assert set(kept.split()) <= section_.keys()
    assert set(replaced.split()).isdisjoint(section_)


def test_forms_merge(mine):
    narrower = mine("extends: given\nfriction: {statistics: {standard_deviation: 0.02}}")
    expected = shipped_scene("given")["friction"]["statistics"] | {"standard_deviation": 0.02}
    assert narrower["friction"]["statistics"] == expected


def test_a_load_takes_the_place_of_what_was_given_by_hand(mine):
    """1500 N = 100 MPa x 1.5e-5 m^2, which are 1000 windows of 25 um x 600 um. Figure 3 is over loads."""
    by_hand = "extends: paper\noscillator: {windows_in_parallel: 7}"
    scene = mine("extends: base\nload: {force_n: 1500, nominal_pressure_pa: 1.0e+8}", base=by_hand)
    assert scene["oscillator"]["normal_force_n"] == 1500.0
    assert scene["oscillator"]["windows_in_parallel"] == 1000
    assert scene["targets"] == ["figure2", "friction_against_load", "figure5", "figure_map"]
    assert scene["friction"]["scatter"] == "multiplicative"
    least = mine(
        "extends: paper\nload: {force_n: 1, nominal_pressure_pa: 6.6666666667e+7}"
    )  # a window, but for rounding
    assert least["oscillator"]["windows_in_parallel"] == 1
    tiny = {"load": {"force_n": 1.0, "nominal_pressure_pa": 1e5}, "strip": {"window_m": 1e-200, "width_m": 1e-200}}
    assert len(list(friction.mistakes(tiny))) == 1  # an area below all doubles
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
    assert lines("papr") == [f"scenes/papr.yaml: no such file; did you mean paper? scenes: {', '.join(SCENES)}"]
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
strip: {cell_m: 0, widht_m: 2.5e-5}
material: {young_modulus_pa: 2.1e11}
square: {modes: 101, nodes: 10}
oscillator:
ensemble: {damping_ratios: [0.2, 0.1]}
"""
    base = "extends: paper\nroughness: {covariance: cubic}\nensemble: {duration_periods: 10, realisations: 150}\n"
    assert sorted(lines_of(mine, text, base=base)) == [
        "scenes/base.yaml: ensemble.duration_periods: 10 is not allowed; a number >= 20 and <= 10000",
        f"scenes/base.yaml: roughness.covariance: 'cubic' is not allowed; one of {WORDS['{KINDS}']}, "
        "or one of your own, as my_file.py:Mine",
        "scenes/mine.yaml: ensemble.damping_ratios: [0.2, 0.1] is not allowed; strictly increasing",
        "scenes/mine.yaml: material.young_modulus_pa: '2.1e11' is text, not a number; "
        "write 2.1e+11, a number >= 1000 and <= 1e+13 [Pa]",
        "scenes/mine.yaml: oscillator: no value is not allowed; "
        + describe_allowed(scene_schema()["properties"]["oscillator"]),
        "scenes/mine.yaml: square.modes: 101 is not allowed; at most square.nodes^2 = 10^2",
        "scenes/mine.yaml: strip.cell_m: 0 is not allowed; a number > 0 [m]",
        "scenes/mine.yaml: strip.widht_m: unknown key; did you mean width_m? allowed: "
        + ", ".join(scene_schema()["properties"]["strip"]["properties"]),
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
    others = yaml.safe_dump({key: value for key, value in PAPER.items() if key != "friction"})
    line = "scenes/mine.yaml: friction.mean: missing; give it, or friction.record"
    assert lines_of(mine, f"{others}friction: {{}}\n") == [line]


def test_a_scene_that_lacks_what_its_targets_need(mine):
    needed = {
        "figure2": {"material", "roughness", "square", "expansion"},
        "figure3": {"material", "roughness", "strip", "expansion", "friction"},
        "figure5": {"oscillator", "ensemble", "friction"},
        "answer": {"oscillator", "friction"},
        "figure_map": {"oscillator", "map", "friction"},
    }
    for target, sections in needed.items():
        all_sections = sections | needed["figure3"] if "oscillator" in sections else sections
        lines = lines_of(mine, f"description: own\nseed: 1\ntargets: [{target}]\n")
        assert sorted(lines) == sorted(f"scenes/mine.yaml: {key}: missing; needed for {target}" for key in all_sections)
    assert lines_of(mine, "numerics: {}\n") == [
        "scenes/mine.yaml: description: missing; text on one line, 1 to 200 characters",
        "scenes/mine.yaml: seed: missing; a whole number >= 0 and <= 4294967295",
        f"scenes/mine.yaml: targets: missing; a list of at least 1, each once, of one of {WORDS['{FIGURES}']}",
    ]


@pytest.mark.parametrize("changed", ["oscillator: {mass_kg: 2}", "friction: {mean: 0.2}"])
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
    changed = {stage for stage in STAGES if slice_for(plain, stage) != slice_for(scene, stage)}
    assert changed == {"budget"}
    assert "figure_budget" in mine(other)["targets"]
    exact = mine("extends: other\noscillator: {mass_kg: 8}\n", other=other)
    assert "oscillator.mass_kg" not in dict(exact.get("standard_uncertainties", []))
