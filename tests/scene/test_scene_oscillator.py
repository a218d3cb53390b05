"""The spring by its stiffness, and what a scene with another oscillator no longer inherits."""

import pytest

from tests.scene.shipped import lines_of, shipped_scene


def test_a_stiffness_gives_the_frequency_with_the_mass_of_the_scene(mine):
    """sqrt(k / m); a scene that changes the mass alone keeps the spring."""
    base = "extends: paper\noscillator: {stiffness_n_per_m: 1.6e+5}"
    assert mine(base)["oscillator"]["natural_frequency_rad_per_s"] == 400.0
    heavy = mine("extends: base\noscillator: {mass_kg: 4}", base=base)["oscillator"]
    assert (heavy["natural_frequency_rad_per_s"], heavy["stiffness_n_per_m"]) == (200.0, 1.6e5)
    back = mine("extends: base\noscillator: {natural_frequency_rad_per_s: 316}", base=base)["oscillator"]
    assert "stiffness_n_per_m" not in back


def test_a_scene_with_neither_says_so(mine):
    oscillator = {key: 1.0 for key in shipped_scene("paper")["oscillator"] if "natural" not in key}
    oscillator |= {"law": "stribeck", "stochastic_static_limit": "true", "windows_in_parallel": 1}
    text = ", ".join(f"{key}: {value}" for key, value in oscillator.items())
    lines = lines_of(mine, f"description: own\nseed: 1\ntargets: [figure_scan]\noscillator: {{{text}}}")
    line = "oscillator.natural_frequency_rad_per_s: missing; give it, or oscillator.stiffness_n_per_m"
    assert f"scenes/mine.yaml: {line}" in lines


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
