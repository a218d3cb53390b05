"""Which jobs a scene's targets bring, and which scenes a command line can ask for."""

from __future__ import annotations

import re
from collections import Counter

import pytest

from roughslip.scene.plan import stages_of_several_scenes

pytestmark = pytest.mark.slow

# One job a batched stage, three for the designs of the square.
END = {"claims": 1, "costs": 1, "scene_report": 1}
SQUARE = {"surface": 1, "design": 1, "contact_square": 3, "chaos_square": 1, "figure2": 1}
STRIP = {"contact_strip": 1, "chaos_strip": 1, "expansion_strip": 1, "friction": 1}
OSCILLATOR = {"deterministic": 1, "oscillator": 1, "cycles": 1, "figure5": 1}

FIELD = {"field_square": 1, "figure_field": 1}
MAP = {"stick_slip_map": 1, "survival": 1, "figure_map": 1}
SCAN = {"grinding": 1, "scan": 1, "twins": 1, "figure_scan": 1}
GROUND = "roughness: {scan: {form: plane, covariance: best, marginal: gaussian, grinding: {points: 96, \
  spacing_m: 1.0e-6, grains_per_m2: 2.0e+10, depth_m: 3.0e-7, tip_radius_m: 3.0e-6, path_radius_m: 1.5e-4, \
  blank_rms_m: 3.0e-7, blank_length_m: 3.0e-6}}}\n"

STATISTICS = "{mean: 0.3, standard_deviation: 0.05, correlation_length_m: 2.5e-4, beta_a: 2.1, beta_b: 5.0}"
FOUND = "expansion: {samples: auto, cdf_error: 0.1}\n"
SPACED = "ensemble: {nodes_per_correlation_length: auto, count_error: 0.05}\n"
GIVEN = f"friction:\n  statistics: {STATISTICS}\n"
SCENES = {
    "targets: [figure2]": {**SQUARE, **END},
    "targets: [figure_field]": {"surface": 1, **FIELD, **END},
    "targets: [figure2, figure_field]": {**SQUARE, **FIELD, **END},
    f"targets: [figure_field]\n{GROUND}": {"surface": 1, **FIELD, **SCAN, **END},
    "targets: [figure3]": {**STRIP, "figure3": 1, "figure3_law": 1, **END},
    "targets: [figure5]": {**STRIP, **OSCILLATOR, **END},
    "targets: [figure2, figure3]": {**SQUARE, **STRIP, "figure3": 1, "figure3_law": 1, **END},
    f"targets: [figure5]\n{GIVEN}": {**OSCILLATOR, **END},
    f"targets: [figure_map]\n{GIVEN}": {**MAP, **END},
    f"targets: [figure5, figure_map]\n{GIVEN}": {**OSCILLATOR, **MAP, **END},
    "targets: [figure_map]": {**STRIP, **MAP, **END},
    f"targets: [figure5]\n{GIVEN}{SPACED}": {"spacing": 1, **OSCILLATOR, **END},
    f"targets: [figure2, figure5]\n{GIVEN}": {**SQUARE, **OSCILLATOR, **END},
    f"targets: [figure2]\n{FOUND}": {**SQUARE, "contact_square": 2, "training_square": 1, **END},
    f"targets: [figure3]\n{FOUND}": {**STRIP, "figure3": 1, "figure3_law": 1, **END},
    f"targets: [figure3]\n{GROUND}": {**STRIP, "figure3": 1, "figure3_law": 1, **SCAN, **END},
    f"targets: [figure2, figure_scan]\n{GROUND}": {**SQUARE, **SCAN, **END},
    f"targets: [figure_scan]\n{GROUND}": {**SCAN, **END},
    f"targets: [figure5]\n{GIVEN}{GROUND}": {**OSCILLATOR, **END},
}


@pytest.fixture(scope="module")
def fresh(empty, tmp_path_factory):
    """A project without results, for dry runs only."""
    return empty.copy(tmp_path_factory.mktemp("targets") / "copy")


def test_only_the_stages_that_the_targets_need_are_planned_and_have_keys(fresh):
    """All scenes in one dry run; each job says whose result it makes."""
    names = [f"mine{number}" for number in range(len(SCENES))]
    for name, text in zip(names, SCENES, strict=True):
        fresh.scene(name, f"extends: tiny\ndescription: Mine\n{text}\n")
    run = fresh.snakemake("-n", *names)
    assert run.returncode == 0, run.stdout[-5000:] + run.stderr
    jobs = re.findall(r"^(?:local)?rule (\w+):\n(?:    .*\n)*?    output: results/(\w+)/", run.stdout, re.M)
    planned = {name: Counter(rule for rule, scene in jobs if scene == name) for name in names}
    assert planned == dict(zip(names, SCENES.values(), strict=True))
    for name, stages in zip(names, SCENES.values(), strict=True):
        written = {path.stem for path in fresh.path(f"results/{name}/keys").iterdir()}
        assert written == {"report" if stage == "scene_report" else stage for stage in stages}.union(
            stages_of_several_scenes()
        )


def test_a_result_is_a_target_too(fresh):
    """Of a scene that has no key file yet: Snakemake lists the folder of a target's inputs once."""
    fresh.scene("one", "extends: tiny\n")
    assert fresh.plan("results/one/figure2.png") == SQUARE
    fresh.scene("two", "extends: tiny\n")
    assert fresh.plan("results/two/contact/strip-0-8.nc") == {"contact_strip": 1}


def test_the_scene_given_runs_the_oscillator_alone(fresh):
    assert set(fresh.plan("given")) == {*OSCILLATOR, *END, "given"}


def test_without_a_target_the_scenes_of_the_configuration_are_planned(fresh):
    fresh.scene("other", f"extends: tiny\ndescription: Other\ntargets: [figure5]\n{GIVEN}")
    fresh.path("config/config.yaml").write_text("scenes: [tiny, other]\n")
    both = {name: 2 * count for name, count in {**OSCILLATOR, **END}.items()}
    reports = {"report_of_the_default_scenes": 1, "all": 1}
    assert fresh.plan() == {**SQUARE, **STRIP, "figure3": 1, "figure3_law": 1, **both, **reports}


def test_figure_3_of_several_scenes_is_drawn_in_one_picture(fresh):
    """Of the scenes that are asked for; without a word of those of COMPARED that there are."""
    fresh.scene("other", "extends: tiny\ndescription: Other\n")
    fresh.path("config/config.yaml").write_text("scenes: [tiny]\n")
    planned = fresh.plan("comparison", "--config", "compare=tiny,other")
    assert planned == {**dict.fromkeys((*STRIP, "figure3"), 2), "comparison": 1}
    for wrong in ("tiny,none", "tiny,tiny", "tiny,given"):
        run = fresh.snakemake("-n", "comparison", "--config", f"compare={wrong}")
        assert run.returncode == 1
        (line,) = [line for line in run.stderr.splitlines() if line.startswith("--config compare: ")]
        assert "is not allowed; scenes with figure3, each once, of: " in line


def test_a_broken_scene_that_nobody_asks_for_harms_nobody(fresh):
    """Neither one with mistakes, nor one with the name of a rule, nor one that no scene can have."""
    rules = [fresh.path("Snakefile"), *fresh.path("workflow/rules").iterdir()]
    taken = {name for path in rules for name in re.findall(r"^rule (\w+):", path.read_text(), re.M)}
    taken.add("benchmark_surface_figure")  # made in a loop
    assert {"all", "surface", "scene_report"} <= taken
    for name in (*taken, "benchmarks", "Capital", "with space"):
        fresh.scene(name, "extends: tiny\n")
    fresh.scene("broken", "square: [\n")
    assert fresh.plan("results/tiny/surface/modes.nc") == {"surface": 1}
    run = fresh.snakemake("-n", *sorted(taken), "benchmarks", "broken")
    refused = [line.partition(": ")[0] for line in run.stderr.splitlines() if "config/scenes" in line]
    assert run.returncode == 1
    assert refused == sorted(f"config/scenes/{name}.yaml" for name in (*taken, "benchmarks", "broken"))


def test_what_is_no_target_is_refused_without_a_traceback(fresh):
    run = fresh.snakemake("-n", "results/mein/figure2.png")
    assert run.returncode == 1
    assert "No rule to produce results/mein/figure2.png" in run.stdout + run.stderr
    assert "Traceback" not in run.stdout + run.stderr
