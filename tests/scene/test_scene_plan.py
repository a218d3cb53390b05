"""What stages read of a scene, and which of them its targets need.

The scene as types: what stages get of it, and the schema that is generated from it.
"""

import pytest
from jsonschema import Draft202012Validator

from roughslip.scene import schema
from roughslip.scene.part import without_nulls
from roughslip.scene.types import scene_of
from roughslip.study.graph import STAGES
from roughslip.study.plan import slice_of
from roughslip.study.record import has_surface
from tests.scene.shipped import CONFIG, shipped_scene

KEYS = dict(schema.keys())


def test_slices_read_keys_of_the_schema_and_leave_none_out():
    keys = set(KEYS)
    read = {key for stage in STAGES.values() for key in stage.keys}
    read |= {key for stage in STAGES.values() for key in stage.batches.values()}
    read -= {"standard_uncertainties", "origins"}  # of the loader, not of scene files
    assert read <= keys
    unread = {key for key in keys if not any(f"{key}.".startswith(f"{r}.") or r.startswith(f"{key}.") for r in read)}
    assert unread == {"extends", "jobs"}


SURFACE = """material: {young_modulus_pa: 2.0e+11, poisson_ratio: 0.3}
roughness: {covariance: gaussian, rms_height_m: 1.0e-6, correlation_length_m: 2.0e-5}
strip: {window_m: 1.0e-3, width_m: 1.0e-3}
"""
FORCE = "oscillator: {normal_force_n: 500}\n"


@pytest.mark.parametrize(
    ("base", "own", "is_compared"),
    [
        ("given", "", False),
        ("paper", "", False),
        ("given", SURFACE, False),  # whose force it would be
        ("paper", FORCE + SURFACE.replace("poisson_ratio: 0.3", "hardness_pa: 1.0e+9"), False),  # half a material
        ("given", SURFACE + FORCE, True),
        ("base", FORCE, True),
    ],
)
def test_a_record_is_compared_with_a_surface_of_the_user_alone(mine, base, own, is_compared):
    """What a shipped scene gives is in no slice of the stage, nor in its hash."""
    text = f"extends: {base}\ntargets: [figure_record]\nfriction: {{record: a.csv}}\n{own}"
    part = slice_of(mine(text, base=f"extends: given\n{SURFACE}"), STAGES["record"], "mine")
    assert has_surface(part) == is_compared
    if not own:
        assert without_nulls(part) == {
            "seed": 20110913,
            "friction": {"record": {"file": ["a.csv"]}, "scatter": "additive"},
            "oscillator": {"windows_in_parallel": 1},
            "strip": {},
        }


def test_a_stage_reads_no_key_but_those_of_its_row():
    with pytest.raises(AttributeError, match="jobs is not among the keys that this stage reads"):
        scene_of(shipped_scene("paper"), ["seed"]).jobs  # noqa: B018


def test_the_schema_for_editors_and_the_page_of_keys_are_current():
    Draft202012Validator.check_schema(schema.scene_schema())
    for file, text in ((schema.FILE, schema.text()), (schema.PAGE, schema.page())):
        assert (CONFIG.parent / file).read_text(encoding="utf-8") == text, "run: make schema"
