"""The stages that find how many strips an accuracy takes, and the shares that compute these."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.level import levels_of_sums
from roughslip.friction.over_penetration import JUDGED, TRENDS, judged_estimates
from roughslip.limits import MOST_WINDOWS, SHARES
from roughslip.stages import chaos_strip, contact_strip, expansion_strip, friction, strip_allocation, strip_pilot
from roughslip.stages.from_scene import geometry
from tests.stages.scenes import CONTACT, changed

ASKED = {"friction_mean": 0.05, "friction_std": 0.08}
PILOT = 12
ENDS = (("low", "high"), ("high", "low"))
SCENE = changed(
    CONTACT,
    strip={
        "length_m": 8e-4,
        "window_m": 2e-4,
        "penetration_percentiles": [50.0, 70.0, 90.0],
        "expansion_spacing_m": 1e-5,
    },
    expansion={"target": "squared_pressure", "degree": 1},
    friction={"mean_at_median": 0.3, "least_contact_fraction": 0.001},
    accuracy=ASKED,
)
SCENE["strip"] |= {"training_samples": PILOT, "samples": "auto", "expansion_samples": "auto"}


@pytest.fixture(scope="module")
def allotted(run):
    """Paths of the pilot, of the expansion and of the allocation."""
    pilot = run(strip_pilot, SCENE).path
    expansion = run(chaos_strip, SCENE, contact=[pilot]).path
    return pilot, expansion, run(strip_allocation, SCENE, pilot=pilot, expansion=expansion).path


@pytest.mark.slow
def test_pilot_and_shares_are_the_strips_of_one_batch_and_reach_what_is_asked(run, allotted):
    """Bit for bit, each strip once.

    Half widths of some 50 strips and 200 replicates are themselves known to 11 %, 1 / sqrt(2 x 50) and quantiles
    together. So the largest of three lies below 1.3 times what is asked.
    """
    pilot, expansion, allocation = allotted
    chosen = store.read(allocation)
    strips, many = int(chosen["strips"]), int(chosen["expansion_strips"])
    assert strips >= PILOT + SHARES
    assert many >= 2 * strips
    assert np.all(chosen["expected"] < chosen["bound"])
    assert np.all(chosen["bound"] <= chosen["asked"])
    parts = {contact_strip: [pilot], expansion_strip: []}
    for stage, paths in parts.items():
        for share in range(SHARES):
            place = {"first": share, "last": share + 1, "allocation": allocation, "expansion": expansion}
            paths.append(run(stage, SCENE, f"{stage.STAGE.name}-{share}", **place).path)
    by_hand = changed(SCENE, strip={"samples": strips, "expansion_samples": many})
    for stage, count in ((contact_strip, strips), (expansion_strip, many)):
        whole = run(stage, by_hand, f"{stage.STAGE.name}-whole", first=0, last=count, expansion=expansion)
        for name in ("area", "force"):
            np.testing.assert_array_equal(store.join(store.read_all(parts[stage]), name), whole[name])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)
        found = run(
            friction, SCENE, contact=parts[contact_strip], expansion=parts[expansion_strip], allocation=allocation
        )
    assert found.attributes["strips"] == strips
    for name, asked in ASKED.items():
        statistic = f"combined_{name.removeprefix('friction_')}"
        width = (found[f"{statistic}_high"] - found[f"{statistic}_low"]) / 2 / found[statistic]
        assert run.did[f"{name}_reached"] == pytest.approx(width.max(), abs=1e-5)
        assert width.max() < 1.3 * asked

    verdict_numbers_are_those_of_stage_friction(store.read_all(parts[contact_strip]), parts[expansion_strip], found)


def verdict_numbers_are_those_of_stage_friction(solved, expanded, found):
    """The pilot and the final strips are judged by the same numbers, with the same draws of the bootstrap.

    The pilot has a mean of 1 at the median and the scene 0.3, by which mean and scatter differ.
    """
    strip = SCENE["strip"]
    least = SCENE["friction"]["least_contact_fraction"] * strip["window_m"] * strip["width_m"]
    of_all = [friction.area_and_force(batches) for batches in (solved, store.read_all(expanded))]
    levels = levels_of_sums(least, *of_all)
    lags = strip["window_spacing_m"] * np.arange(levels[0].mu.shape[2])
    rng = np.random.default_rng([SCENE["seed"], geometry.STREAM_BOOTSTRAP])
    percentiles = np.array(strip["penetration_percentiles"])
    numbers = judged_estimates(percentiles, levels, lags, strip["window_m"], 200, rng)
    assert len(numbers) == 2 * len(TRENDS) + len(JUDGED) + 1
    for name, one in numbers.items():
        scale = 0.3 if re.search("_(mean|std)_(line|change)$", name) else 1.0
        for end, value in (("", one.value), ("_low", one.low), ("_high", one.high)):
            np.testing.assert_allclose(scale * value, found[f"{name}{end}"], rtol=1e-9, atol=1e-15)

    # the median alone: the same numbers from the same draws, and no trend
    median = [replace(level, mu=level.mu[:1], valid=level.valid[:1]) for level in levels]
    rng = np.random.default_rng([SCENE["seed"], geometry.STREAM_BOOTSTRAP])
    alone = judged_estimates(percentiles[:1], median, lags, strip["window_m"], 200, rng)
    assert alone.keys() == {name for name in numbers if not name.startswith("trend_")}
    for name, one in alone.items():
        np.testing.assert_allclose(one.rows[:, 0], numbers[name].rows[:, 0], rtol=1e-9, atol=1e-15)


@pytest.mark.slow
def test_strips_are_added_for_verdicts_as_far_as_the_limit_allows(run, allotted):
    """As many as the most that one of them takes, if they cost less; given numbers and no limit add none."""
    pilot, expansion, allocation = allotted
    files, plain = {"pilot": pilot, "expansion": expansion}, store.read(allocation)
    assert "strips_needed" not in plain
    ample = run(strip_allocation, changed(SCENE, accuracy={"verdict_limit_cpu_s": 1e6}), "ample", **files)
    did = run.did
    needed = dict(zip(ample["statement"].tolist(), ample["strips_needed"].tolist(), strict=True))
    assert ample["strips_for_accuracy"] == did["strips_for_accuracy"] == plain["strips"]
    most = MOST_WINDOWS // (2 * plain_windows() * 3)
    affordable = [number for number in needed.values() if number <= most]
    assert ample["strips"] == max(affordable) > plain["strips"]
    assert ample["expansion_strips"] >= ample["strips"] * (PILOT + strip_allocation.MORE) / PILOT
    for name, number in needed.items():
        assert did.get(f"strips_to_decide_{name}", 0) == (number if plain["strips"] < number <= most else 0)
    limit = 0.5 * (float(plain["cost"]) + float(ample["cost"]))
    some = run(strip_allocation, changed(SCENE, accuracy={"verdict_limit_cpu_s": limit}), "some", **files)
    assert plain["strips"] <= some["strips"] < ample["strips"]
    assert some["cost"] <= limit
    assert any(name.startswith("strips_beyond_limit_for_") for name in run.did)
    by_hand = changed(SCENE, accuracy={"verdict_limit_cpu_s": 1e6}, strip={"samples": int(plain["strips"])})
    given = run(strip_allocation, by_hand, "given", **files)
    assert given["strips"] == plain["strips"]
    assert "strips_needed" not in given


def plain_windows() -> int:
    """Windows of a strip."""
    strip = SCENE["strip"]
    return round((strip["length_m"] - strip["window_m"]) / strip["window_spacing_m"]) + 1


@pytest.mark.slow
def test_strips_on_coarse_cells_alone_are_those_of_a_whole_solve(run, stored):
    """Bit for bit. As a control they leave the same friction, within the intervals of both."""
    scene = changed(SCENE, numerics={"extrapolate_mesh": True, "contact_area": "corrected"}, strip={"width_m": 3e-5})
    pilot = run(strip_pilot, scene, "both-pilot").path
    expansion = run(chaos_strip, scene, "both-chaos", contact=[pilot]).path
    none = {name: (("number",), np.array([])) for name in ("percentile", "statistic")}
    found = {}
    for coarse in (20, 60):
        numbers = {"strips": ((), 20), "coarse_strips": ((), coarse), "expansion_strips": ((), 200)}
        place = {"allocation": stored(f"{coarse}.nc", None, **none, **numbers), "expansion": expansion}
        parts = {contact_strip: [pilot], expansion_strip: []}
        for stage, paths in parts.items():
            for share in range(SHARES):
                name = f"{coarse}-{stage.STAGE.name}-{share}"
                paths.append(run(stage, scene, name, first=share, last=share + 1, **place).path)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(friction, "REPLICATES", 200)
            files = {"contact": parts[contact_strip], "expansion": parts[expansion_strip]}
            found[coarse] = run(friction, scene, f"{coarse}-friction", **files, allocation=place["allocation"])
    for name in ("combined_mean", "combined_std"):
        low, high = (found[60][f"{name}_{end}"] - found[20][f"{name}_{other}"] for end, other in ENDS)
        assert np.all((low <= 0.0) & (high >= 0.0))
        assert not np.array_equal(found[20][name], found[60][name])
    batches = [one for one in store.read_all(parts[contact_strip]) if "other_area" in one]
    whole = run(contact_strip, scene, "others-whole", first=20, last=60)
    for name in ("area", "force"):
        np.testing.assert_array_equal(store.join(batches, f"other_{name}"), whole[f"coarse_{name}"])


@pytest.mark.slow
def test_an_accuracy_above_the_cost_limit_is_refused_with_the_nearest_one(run, allotted):
    """What the message names as nearest is then reached."""
    pilot, expansion, allocation = allotted
    limit = float(store.read(allocation)["cost"]) / 2
    scene = changed(SCENE, accuracy={"cost_limit_cpu_s": limit})
    with pytest.raises(IllPosedError, match=r"nearest is .* or raise accuracy.cost_limit_cpu_s to") as caught:
        run(strip_allocation, scene, "refused", pilot=pilot, expansion=expansion)
    near = yaml.safe_load(re.search(r"nearest is (\{.*\});", str(caught.value))[1])
    scene = changed(scene, accuracy=near)
    assert run(strip_allocation, scene, "nearest", pilot=pilot, expansion=expansion)["cost"] <= limit
    assert all(ASKED[name] < value < 2 * ASKED[name] for name, value in near.items())
    by_hand = changed(SCENE, strip={"samples": PILOT + SHARES})
    with pytest.raises(IllPosedError, match="or leave the number of strips that you gave to auto"):
        run(strip_allocation, by_hand, "refused", pilot=pilot, expansion=expansion)
