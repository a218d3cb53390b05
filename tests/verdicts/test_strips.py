"""Strips that decide statements on friction: closed forms of single numbers, and shares of Gaussian pilots.

Kept results: which files are kept, and which differences of a run are allowed."""

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy import optimize, stats

from roughslip.compilation.source_hash import closure_hash
from roughslip.errors import StoreError
from roughslip.probability import Estimate
from roughslip.probability.estimate import variance_margin
from roughslip.verdicts import strips
from roughslip.verdicts.finding import EVERY, MEDIAN, TREND, Bound
from roughslip.verdicts.kept_results import KEPT as KEPT_FILES
from roughslip.verdicts.kept_results import compared_claims, compared_friction, compared_summaries, keep
from roughslip.verdicts.rules import BOUNDS
from roughslip.verdicts.strips import ODDS, STEP, strips_from_pilot, strips_that_decide
from tests.verdicts.claimed import LEVELS, friction, with_interval

SKEWED = "mu-right-skewed"
SKEWED_ALONE = {SKEWED: BOUNDS[SKEWED]}


def levels(name, value, half):
    return with_interval(name, *(np.full(LEVELS, one) for one in (value, value - half, value + half)))


def scattered(value, replicates):
    return Estimate(np.array(value), *np.quantile(replicates, (0.025, 0.975), axis=-1), replicates)


@pytest.mark.parametrize(
    ("statement", "numbers", "times"),
    [
        ("mu-correlation-250um", levels("combined_length_least_squares", 285e-6, 30e-6), (30 / 15) ** 2),
        ("mu-correlation-250um", levels("combined_length_least_squares", 295e-6, 30e-6), None),  # 1.7 % from 300 µm
        ("mu-correlation-250um", levels("combined_length_least_squares", 260e-6, 30e-6), None),  # decided
        (SKEWED, levels("combined_skewness", 0.02, 0.06), (0.06 / 0.02) ** 2),
        ("mu-beta-2.1-5", levels("beta_distance_standardised", 0.08, 0.04), (0.04 / 0.02) ** 2),
        # both numbers of a rule: the farther from decided is 0.02 inside the lower end of the skewness, 0.28
        (
            "mu-beta-2.1-5",
            levels("beta_distance_standardised", 0.08, 0.04) | levels("combined_skewness", 0.30, 0.06),
            (0.06 / (0.30 - 0.5 * 0.5597)) ** 2,
        ),
        ("mu-leptokurtic", levels("combined_kurtosis", 0.02, 0.1), None),  # the paper contradicts itself
    ],
)
def test_intervals_narrow_with_the_root_of_the_strips_until_a_rule_decides(statement, numbers, times):
    """n = strips (half width / distance from the threshold)^2, up to one step of the search."""
    strips = strips_that_decide(friction() | numbers, 100, BOUNDS)
    if times is None:
        assert statement not in strips
    else:
        assert 100 * times <= strips[statement] <= math.ceil(100 * times * STEP) + 1


@pytest.mark.parametrize("distance", [0.0, 2.0, 4.0])
def test_a_gaussian_pilot_asks_for_the_strips_of_a_quantile_of_the_distance(distance):
    """q = N(distance, 1) in standard errors: for ODDS of these |q| exceeds d, so n = strips margin (1.96 / d)^2.

    400 replicates know the share of ODDS to 0.024, so d, where the density is 0.25 at least, to 0.1.
    """
    normal = np.random.default_rng(41).standard_normal((LEVELS, 400))
    normal = (normal - normal.mean(axis=1, keepdims=True)) / normal.std(axis=1, keepdims=True)
    table = {name: value for name, value in friction().items() if f"{name}_low" in friction()}
    estimates = {name: scattered(value, value[..., None] + np.zeros(400)) for name, value in table.items()}
    estimates["combined_skewness"] = scattered(np.full(LEVELS, distance), distance + normal)
    strips = strips_from_pilot(estimates, friction()["percentile"], 24, SKEWED_ALONE)
    below = lambda d: stats.norm.cdf(d - distance) - stats.norm.cdf(-d - distance) - (1 - ODDS)  # noqa: E731
    d = optimize.brentq(below, 0.0, 6.0)
    exact = [24 * max(1.0, variance_margin(24) * (1.96 / (d + error)) ** 2) for error in (0.1, -0.1)]
    assert exact[0] <= strips[SKEWED] <= STEP * exact[1] + 1


def test_noise_raises_a_distance_and_the_pivot_takes_that_off():
    """Replicates at 0.095 around 0.07 say that noise adds 0.025, so the truth is near 0.045, far below 0.1.

    A half width of 0.04 widened by the margin is less than that distance. Taken as they are, the replicates would ask
    for (0.05 / 0.005)^2 times the strips.
    """
    table = {name: value for name, value in friction().items() if f"{name}_low" in friction()}
    estimates = {name: scattered(value, value[..., None] + np.zeros(50)) for name, value in table.items()}
    replicates = 0.095 + 0.003 * np.random.default_rng(43).standard_normal((LEVELS, 50))
    ends = np.full(LEVELS, 0.03), np.full(LEVELS, 0.11)
    estimates["beta_distance_standardised"] = Estimate(np.full(LEVELS, 0.07), *ends, replicates)
    strips = strips_from_pilot(estimates, friction()["percentile"], 24, BOUNDS)
    assert strips["mu-beta-2.1-5"] == strips["mu-beta-any-depth"] == 24


@pytest.mark.slow
def test_with_these_strips_more_than_the_odds_are_decided():
    """Truths spread evenly about a threshold, and of 24 strips each the pilots that leave them undecided: some 120.

    Then means of as many strips as each pilot asks for. The share decided is ODDS and more, as the margin for few
    strips comes on top. The number that a pilot shows alone, (half width / distance)^2, decides fewer.
    """
    rng, asked_decides, shown_decides = np.random.default_rng(42), [], []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(strips, "STEPS", 120)
        for truth in rng.uniform(-0.8, 0.8, 300):
            own = truth + rng.standard_normal(24)
            half = 1.96 * own.std() / math.sqrt(24)
            if abs(own.mean()) > half:
                continue
            skewness = scattered(
                np.full(LEVELS, own.mean()), np.tile(rng.choice(own, (60, 24)).mean(axis=1), (LEVELS, 1))
            )
            pilot = {"combined_skewness": skewness}
            asked = strips_from_pilot(pilot, friction()["percentile"], 24, SKEWED_ALONE)[SKEWED]
            for decides, number in ((asked_decides, asked), (shown_decides, 24 * (half / own.mean()) ** 2)):
                more = number - 24
                end = (24 * own.mean() + rng.normal(more * truth, math.sqrt(more))) / number
                decides.append(abs(end) > 1.96 / math.sqrt(number))
    assert np.mean(asked_decides) > ODDS
    assert np.mean(shown_decides) < ODDS


STAGE = "roughslip.stages.strip_allocation"


@pytest.mark.parametrize(
    ("file", "old", "new", "changes"),
    [
        ("friction_distribution.py", "is found to be right skewed", "is right skewed", False),
        ("friction_correlation.py", "rms distance from the exponential", "distance", False),
        ("friction_over_penetration.py", "decreases with penetration", "falls", False),
        ("reading.py", "VISIBLE = 0.1 ", "VISIBLE = 0.2 ", False),  # it is given, see the next test
        ("strips.py", "ODDS = 0.75", "ODDS = 0.8", True),
    ],
)
def test_the_stage_that_asks_for_strips_depends_on_no_text(tmp_path, file, old, new, changes):
    """An edit of a statement, a note or a title must not solve strips again: the hash of the code stays."""
    source = Path(strips.__file__).parents[2]
    shutil.copytree(source, tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    edited = tmp_path / "src" / "roughslip" / "verdicts" / file
    text = edited.read_text(encoding="utf-8")
    assert old in text
    edited.write_text(text.replace(old, new), encoding="utf-8")
    assert (closure_hash(STAGE, source) != closure_hash(STAGE, tmp_path / "src")) == changes


def test_the_bounds_are_numbers_alone_and_pass_through_a_key_file():
    given = json.loads(json.dumps(BOUNDS, allow_nan=False))
    assert {name: [Bound(*row) for row in rows] for name, rows in given.items()} == {
        name: list(rows) for name, rows in BOUNDS.items()
    }
    texts = {entry for rows in given.values() for row in rows for entry in row if isinstance(entry, str)} - {""}
    assert texts <= {MEDIAN, EVERY, TREND, *friction()}


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

    The mean at the median gives the scale, 2. A mesh that changed the std by a quarter changes nothing else.
    """
    friction = {"percentile": np.array([20.0, 50.0]), "mesh_change_of_mean": np.zeros(2)}
    friction["mesh_change_of_std"] = np.zeros(2)
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
    friction["mesh_change_of_std"] = np.array([0.0, 0.25])
    friction |= {f"combined_std{end}": 1.25 * friction[f"combined_std{end}"] for end in ("", "_low", "_high")}
    assert compared_friction(friction, reference)[1].allowed == rows[1].allowed


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
