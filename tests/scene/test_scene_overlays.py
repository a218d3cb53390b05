"""What a scene file that extends another becomes."""

import copy
from pathlib import Path

from roughslip.scene.loader import load
from tests.scene.shipped import FRACTAL, SCAN, TABLE, lines_of, shipped_scene

TIME = "correlation_time_s: 2.6e-4"


def test_overlays_merge_to_any_depth(mine):
    scene = mine(
        "extends: a\nstrip: {samples: 20}",
        a="extends: b\nstrip: {samples: 30, training_samples: 9}",
        b="extends: paper\nensemble: {damping_ratios: [0.2]}\nseed: 7",
    )
    paper = shipped_scene("paper")
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
    assert load("./paper.yaml", Path("scenes"))["seed"] == 3


def test_one_form_of_friction_replaces_the_other(mine):
    scene = mine("extends: given\nfriction: {mean_at_median: 0.25, least_contact_fraction: 0.002}")
    assert scene["friction"] == {"mean_at_median": 0.25, "least_contact_fraction": 0.002}
    given = shipped_scene("given")
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


def test_another_law_leaves_what_only_the_last_one_takes(mine):
    base = f"extends: given\noscillator: {{law: table, friction_table: {TABLE}, friction_follows: time, {TIME}}}"
    assert mine("extends: base\nseed: 4", base=base)["oscillator"]["friction_table"]["values"] == [0.4, 0.3]
    found = mine("extends: base\noscillator: {law: coulomb, friction_follows: belt}", base=base)["oscillator"]
    assert not {"friction_table", "correlation_time_s"} & set(found)


def test_a_number_is_a_float_however_written(mine):
    as_integer = mine("extends: paper\noscillator: {mass_kg: 2}\nensemble: {damping_ratios: [0, 1]}")
    as_float = mine("extends: paper\noscillator: {mass_kg: 2.0}\nensemble: {damping_ratios: [0.0, 1.0e+0]}")
    assert repr(as_integer) == repr(as_float)
    assert isinstance(as_integer["square"]["nodes"], int)
