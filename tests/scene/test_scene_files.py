"""Scene files: a mistake has its line (mistakes.txt lists both), overlays merge, and what excludes each other.

Mixtures of scenes load or are refused; SCENE_CASES=2000 draws as many (`make fuzz`). tests/properties/scenes.py runs
whole random scenes.
"""

import copy
import json
import os
import re
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings

from roughslip.errors import InputError
from roughslip.scene import contact, friction
from roughslip.study import plan
from roughslip.study.from_scene.geometry import training_columns
from roughslip.study.graph import STAGES
from tests.scene.shipped import CONFIG, SCAN, SCENES, TABLE, WORDS, lines_of, overlays, shipped_scene, slice_for

MISTAKES = (Path(__file__).parent / "mistakes.txt").read_text(encoding="utf-8").split("\n\n")[1:]


@pytest.mark.parametrize("name", SCENES)
def test_every_number_of_a_shipped_scene_says_where_it_comes_from(name):
    lines = (CONFIG / "scenes" / f"{name}.yaml").read_text().splitlines()
    given = [line for line in lines if re.search(r"[:,\[] ?-?[0-9.]+", line.partition("#")[0].partition('"')[0])]
    assert not [line for line in given if not re.search(r"# (paper|assumed): \S+ \S+", line)]


@pytest.mark.parametrize("mistake", MISTAKES)
def test_each_mistake_has_its_line(mine, mistake):
    for name, words in WORDS.items():
        mistake = mistake.replace(name, words)
    text, *lines = mistake.strip().split("\n-> ")
    text = text if "extends:" in text or "description: own" in text else f"extends: paper\n{text}"
    assert lines_of(mine, text) == [f"scenes/mine.yaml: {line}" for line in lines]


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("# nothing\n", "no value is not allowed; a scene file holds keys and values"),
        ("- 1\n- 2\n", "[1, 2] is not allowed; a scene file holds keys and values"),
        (b"seed: 1  # \xb5m\n", "not UTF-8 text; byte 11 is 0xb5"),
        ("a: 'b\n", "line 2, column 1: not valid YAML: found unexpected end of stream"),
        ("a: 1\n---\na: 1\n", "line 2, column 1: not valid YAML: another document"),
    ],
)
def test_a_file_that_is_no_scene(mine, content, said):
    (message,) = lines_of(mine, content)
    assert message.startswith(f"scenes/mine.yaml: {said}")
    assert "\n" not in message


def test_a_mistake_of_a_base_names_its_file(mine):
    (line,) = lines_of(mine, "extends: base\n", base="extends: paper\nensemble: {duration_periods: 10}\n")
    assert line == "scenes/base.yaml: ensemble.duration_periods: 10 is not allowed; a number >= 20 and <= 10000"


def test_what_no_target_reads_may_not_fit(mine):
    """A square of its own, with a correlation length too long for the strip that it inherits and does not use."""
    text = "extends: resolved\ntargets: [figure2]\nroughness: {correlation_length_m: 5.0e-4}\n"
    assert mine(text)["roughness"]["correlation_length_m"] == 5e-4
    assert len(lines_of(mine, text.replace("figure2", "figure3"))) == 1


def test_rules_count_as_the_stages_do():
    columns = range(4, 60)
    assert [contact.training_columns(n) for n in columns] == [len(training_columns(slice(7, 7 + n))) for n in columns]


def test_overlays_merge_to_any_depth(mine):
    """The last base gives lists and a map; a number is a float however it is written."""
    scene = mine(
        b"\xef\xbb\xbfextends: a\nstrip: {samples: 20}\noscillator: {mass_kg: 1}",  # a byte order mark is read over
        a="extends: b\nstrip: {samples: 30, training_samples: 9}",
        b="extends: paper\nensemble: {damping_ratios: [0, 1]}\nseed: 7",
    )
    paper = shipped_scene("paper")
    expected = copy.deepcopy(paper) | {"seed": 7}
    expected["strip"] |= {"samples": 20, "training_samples": 9}
    expected["ensemble"]["damping_ratios"] = [0.0, 1.0]
    expected["targets"].append("figure_map")  # none of the three names its own
    del expected["map"]["ranges"], expected["ensemble"]["damping_ratios"]  # of another oscillator
    origins, of_paper = scene.pop("origins"), expected.pop("origins")
    del of_paper["map.ranges"]
    mine = dict.fromkeys(("strip.samples", "oscillator.mass_kg"), "mine")
    del of_paper["ensemble.damping_ratios"]
    assert origins == of_paper | mine | {"strip.training_samples": "a", "seed": "b"}
    assert repr(scene) == repr(expected)


FIELD = "roughness: {covariance: exponential, rms_height_m: 1.0e-7, correlation_length_m: 2.0e-5}"
BY_TABLE = f"oscillator: {{law: table, friction_table: {TABLE}}}"
COULOMB = "oscillator: {law: coulomb, static_friction: 0.4}"
SCANNED = f"extends: paper\nroughness: {{scan: {SCAN}}}"
MATERN = "extends: paper\nroughness: {covariance: matern, smoothness: 1.0}"
MEASURED = "friction: {mean: 1, statistics: {standard_deviation: 0.02, correlation_length_m: 2.5e-4}}"
RATIOS = "ensemble: {damping_ratios: [0.1]}"
STATISTICS = "friction: {statistics: {standard_deviation: 0.02}}"


@pytest.mark.parametrize(
    ("base", "overlay", "section", "kept", "replaced"),
    [
        ("extends: tribometer", f"{MEASURED}\n{BY_TABLE}", "friction", "mean", "record"),
        ("extends: given", "friction: {record: a.csv}", "oscillator", "mass_kg", "static_friction"),
        ("extends: paper", BY_TABLE, "oscillator", "friction_table", "static_friction"),
        ("extends: given", STATISTICS, "friction", "mean statistics", ""),
        ("extends: paper", f"roughness: {{scan: {SCAN}}}", "roughness", "scan", "covariance rms_height_m"),
        ("extends: nongaussian", f"roughness: {{scan: {SCAN}}}", "roughness", "scan", "correct_correlation"),
        ("extends: fractal", "roughness: {hurst: 0.7}", "roughness", "rms_height_m hurst wavelengths_m", "covariance"),
        (SCANNED, FIELD, "roughness", "covariance rms_height_m correlation_length_m", "scan"),
        (MATERN, "roughness: {covariance: gaussian}", "roughness", "rms_height_m", "smoothness"),
        (f"extends: given\n{BY_TABLE}", "seed: 4", "oscillator", "friction_table", ""),
        (f"extends: given\n{BY_TABLE}", COULOMB, "oscillator", "law", "friction_table"),
        ("extends: paper", "map: {parameters: [mass, load]}", "map", "parameters points", "ranges"),
        ("extends: paper", "friction: {mean: 0.2}", "ensemble", "realisations", "damping_ratios"),
        ("extends: paper", f"friction: {{mean: 0.2}}\n{RATIOS}", "ensemble", "damping_ratios", ""),
    ],
)
def test_what_an_overlay_gives_takes_the_place_of_what_excludes_it(mine, base, overlay, section, kept, replaced):
    section_ = mine(f"extends: base\n{overlay}", base=base)[section]
    assert set(kept.split()) <= section_.keys()
    assert set(replaced.split()).isdisjoint(section_)


def test_a_load_takes_the_place_of_what_was_given_by_hand(mine):
    """1500 N = 100 MPa x 1.5e-5 m^2, which are 1000 windows of 25 um x 600 um. Figure 3 is over loads."""
    by_hand = "extends: paper\noscillator: {windows_in_parallel: 7}"
    scene = mine("extends: base\nload: {force_n: 1500, nominal_pressure_pa: 1.0e+8}", base=by_hand)
    assert scene["oscillator"]["normal_force_n"] == 1500.0
    assert scene["oscillator"]["windows_in_parallel"] == 1000
    assert scene["targets"] == ["figure2", "friction_against_load", "figure5", "figure_map"]
    assert scene["friction"]["scatter"] == "multiplicative"
    one = mine("extends: paper\nload: {force_n: 1, nominal_pressure_pa: 6.6666666667e+7}")  # a window, but for rounding
    assert one["oscillator"]["windows_in_parallel"] == 1
    (absent,) = friction.mistakes({"oscillator": {"mass_kg": 1.0}})
    assert absent == (("oscillator.normal_force_n",), "missing; give it, or load")


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
    own = f"mass_kg: {{value: 9}}, static_friction: 0.45, {table}"
    text = f"extends: other\ntargets: [figure_budget]\noscillator: {{{own}}}\n"
    scene = mine(text, other=other)
    assert ["oscillator.mass_kg", 2.0] in scene["standard_uncertainties"]
    assert ["oscillator.friction_table.0.1", 0.02] in scene["standard_uncertainties"]
    changed = {stage for stage in STAGES if slice_for(plain, stage) != slice_for(scene, stage)}
    assert changed == {"budget", "page"}  # which says where each value comes from
    assert "figure_budget" in mine(other)["targets"]
    exact = mine("extends: other\noscillator: {mass_kg: 8}\n", other=other)
    assert "oscillator.mass_kg" not in dict(exact.get("standard_uncertainties", []))


@pytest.mark.slow
@settings(
    max_examples=int(os.environ.get("SCENE_CASES", "20")),
    deadline=None,
    derandomize="SCENE_SEED" not in os.environ,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
@given(overlay=overlays())
def test_scenes_load_or_are_refused(mine, overlay):
    """One that loads has figures, and slices that JSON holds. A refusal is in printable lines that name a file."""
    try:
        scene = mine(yaml.safe_dump(overlay))
    except InputError as error:
        scene, lines = None, error.lines
    if scene is None:
        assert len(set(lines)) == len(lines) > 0
        assert [one for one in lines if not one.isprintable() or len(one) > 2000] == []
        assert [one for one in lines if not one.startswith(("scenes/", f"{CONFIG}/scenes/"))] == []
        return
    assert plan.figures(scene) or {*scene["targets"]} <= {"answer"}  # which has none
    for stage in plan.stages_needed(scene):
        json.dumps(slice_for(scene, stage), allow_nan=False)
