"""Kept results: which files are kept, and which differences of a run are allowed."""

import numpy as np
import pytest

from roughslip.errors import StoreError
from roughslip.verdicts.kept_results import KEPT as KEPT_FILES
from roughslip.verdicts.kept_results import compared_claims, compared_friction, compared_summaries, keep

KEPT = [
    {"id": "one", "verdict": "reproduced", "ours": 1.0, "interval": [0.9, 1.2]},
    {"id": "two", "verdict": "not tested", "ours": None, "interval": None},
]


def disagreeing(rows):
    return [row.name for row in rows if not row.agrees]


@pytest.mark.parametrize(
    ("changes", "moved", "wrong"),
    [
        ({}, [], []),
        ({"ours": 1.2}, ["one"], []),
        ({"ours": 1.2001}, ["one"], ["one"]),
        ({"ours": None}, ["one"], ["one"]),
        ({"verdict": "contradicted"}, ["one, verdict"], ["one, verdict"]),
        ({"id": "other"}, ["one, verdict", "other, verdict"], ["one, verdict", "other, verdict"]),
    ],
)
def test_a_changed_claim_disagrees(changes, moved, wrong):
    rows = compared_claims([KEPT[0] | changes, KEPT[1]], KEPT)
    assert [row.name for row in rows if row.moved] == moved
    assert disagreeing(rows) == wrong


TABLE = """percentile,mean,mean_low,mean_high,length_m,length_low_m,length_high_m,beta_at_bound
5,0.3,0.29,0.32,3e-4,2e-4,4e-4,0
50,0.3,0.3,0.3,nan,nan,nan,1
"""


@pytest.mark.parametrize(
    ("old", "new", "wrong"),
    [
        ("5,0.3,", "5,0.29,", []),
        ("5,0.3,", "5,0.2899,", ["mean at 5 %"]),
        ("3e-4", "4.1e-4", ["length_m at 5 %"]),
        ("4e-4,0", "4e-4,1", ["beta_at_bound at 5 %"]),
        ("nan,nan,nan", "1e-4,1e-4,1e-4", ["length_m at 50 %"]),
        ("50,0.3,0.3,0.3", "50,0.300002,0.3,0.3", []),  # a rounding of six digits
        ("50,", "60,", ["penetrations"]),
    ],
)
def test_numbers_of_a_summary_stay_within_the_kept_intervals(old, new, wrong):
    assert disagreeing(compared_summaries(TABLE, TABLE)) == []
    assert len(compared_summaries(TABLE, TABLE)) == 1 + 2 * 3
    assert disagreeing(compared_summaries(TABLE.replace(old, new), TABLE)) == wrong


@pytest.mark.parametrize("text", ["", "percentile,mean\n5\n", "other\n5\n"])
def test_a_summary_that_is_none_is_refused(text):
    with pytest.raises(StoreError, match="not a table"):
        compared_summaries(text, TABLE)


def test_friction_is_held_against_direct_strips_in_standard_errors_of_both():
    """Half an interval of 0.0196 is a standard error of 0.01; with the reference's, 3/4 of it, 0.0125.

    The mean at the median gives the scale, 2.
    """
    friction = {"percentile": np.array([20.0, 50.0])}
    for name, values in (("mean", [0.4, 0.3]), ("std", [0.05, 0.04])):
        friction |= {
            f"combined_{name}{end}": np.array(values) + off for end, off in (("_low", -0.0196), ("_high", 0.0196))
        }
        friction[f"combined_{name}"] = np.array(values)
    reference = {"percentile": np.array([50.0])}
    for name, value in (("mean", 0.15), ("std", 0.02)):
        reference |= {name: np.array([value]), f"{name}_standard_error": np.array([0.00375])}
    assert disagreeing(compared_friction(friction, reference)) == []
    friction["combined_std"] = np.array([0.05, 0.04 + 3.99 * 0.0125])
    assert disagreeing(compared_friction(friction, reference)) == []
    friction["combined_std"] = np.array([0.05, 0.04 + 4.01 * 0.0125])
    rows = compared_friction(friction, reference)
    assert disagreeing(rows) == ["std at 50 %, direct"]
    assert not any(row.moved for row in rows)  # a run with the kept bits differs from other strips too
    assert rows[1].allowed.endswith("+4.01 of them off")


def results(folder, names=KEPT_FILES):
    folder.mkdir()
    for name in (*names, "big.nc"):
        (folder / name).write_bytes(f"{name} of {folder.name}".encode())
    return folder


def test_the_kept_files_and_no_others_are_copied_and_replaced(tmp_path):
    for run in ("old", "new"):
        keep(results(tmp_path / run), tmp_path / "reference" / "paper")
        copied = {path.name: path.read_bytes() for path in (tmp_path / "reference" / "paper").iterdir()}
        assert copied == {name: f"{name} of {run}".encode() for name in KEPT_FILES}


def test_an_incomplete_scene_is_refused_whole(tmp_path):
    source = results(tmp_path / "given", [name for name in KEPT_FILES if name not in ("figure2.png", "summary.csv")])
    with pytest.raises(StoreError, match=r"given: lacks figure2\.png, summary\.csv"):
        keep(source, tmp_path / "reference")
    assert not (tmp_path / "reference").exists()
