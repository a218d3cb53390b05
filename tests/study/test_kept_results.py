"""Kept results: which files are kept, and which differences of a run are allowed."""

import pytest

from roughslip.errors import StoreError
from roughslip.study.verify import KEPT as KEPT_FILES
from roughslip.study.verify import compared_claims, compared_summaries, keep

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
    assert len(compared_summaries(TABLE, TABLE)) == 1 + 2 * 4
    assert disagreeing(compared_summaries(TABLE.replace(old, new), TABLE)) == wrong


def results(folder, names=KEPT_FILES):
    folder.mkdir()
    for name in (*names, "big.nc"):
        (folder / name).write_bytes(f"{name} of {folder.name}".encode())
    return folder


def test_the_kept_files_of_a_complete_scene_and_no_others_are_copied(tmp_path):
    for run in ("old", "new"):
        keep(results(tmp_path / run), tmp_path / "reference" / "paper")
        copied = {path.name: path.read_bytes() for path in (tmp_path / "reference" / "paper").iterdir()}
        assert copied == {name: f"{name} of {run}".encode() for name in KEPT_FILES}
    source = results(tmp_path / "given", KEPT_FILES[2:])
    with pytest.raises(StoreError, match=r"given: lacks figure_chain\.png, figure2\.png"):
        keep(source, tmp_path / "other")
    assert not (tmp_path / "other").exists()
