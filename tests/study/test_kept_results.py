"""Kept results: which differences of a run are allowed."""

import pytest

from roughslip.study.verify import compared_claims, compared_summaries

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
