"""Stage friction on known windows: its definitions, lengths, trends, and what is drawn and tabled.

The stages that find how many strips an accuracy takes, and the shares that compute these."""

import math
import re
from itertools import pairwise

import numpy as np
import pytest
import yaml

from roughslip import store
from roughslip.errors import IllPosedError
from roughslip.friction.marginal import SHAPES
from roughslip.friction.over_penetration import TRENDS
from roughslip.limits import SHARES
from roughslip.stages import chaos_strip, contact_strip, expansion_strip, friction, strip_allocation, strip_pilot
from tests.stages.scenes import CONTACT, changed

STRIPS, MANY, WINDOWS = 12, 40, 60
SCENE = changed(
    CONTACT,
    strip={"penetration_percentiles": [10.0, 50.0, 90.0], "window_spacing_m": 1e-5},
    friction={"mean_at_median": 0.3, "least_contact_fraction": 0.001},
)


@pytest.fixture(scope="module")
def known(run, stored):
    """A / N of the expansion is correlated with that of the solved windows; the levels lie at 3, 2 and 1 in 1e-9 / Pa.

    One window has less than the least contact, 0.001 of 0.1 x 0.025 mm^2, and one a little more.

    Returns result, solved and expanded A / N (strips, levels, windows), the former NaN where the contact is too small,
    and the solved sum(A) / sum(N) by level.
    """
    rng = np.random.default_rng(5)
    noise = np.apply_along_axis(np.convolve, 2, rng.standard_normal((MANY, 3, WINDOWS + 9)), np.ones(10) / 10, "valid")
    levels = np.array([3.0, 2.0, 1.0])[None, :, None]
    expanded = 1e-9 * (levels * 1.5 + 0.2 * noise)
    solved = 1e-9 * (levels + 0.2 * noise[:STRIPS] + 0.02 * rng.standard_normal((STRIPS, 3, WINDOWS)))
    shape = ("sample", "level", "window")
    area = {name: 1e-10 * rng.uniform(1, 2, ratio.shape) for name, ratio in (("s", solved), ("e", expanded))}
    area["s"][:2, 2, 0] = 2.4e-12, 2.6e-12
    contact = []
    for name, first, last in (("z", 0, 5), ("y", 5, STRIPS)):  # named in another order than numbered
        part = slice(first, last)
        fields = {"area": (shape, area["s"][part]), "force": (shape, area["s"][part] / solved[part])}
        fields |= {f"block_{name}": (("sample", "level", "block"), values) for name, (_, values) in fields.items()}
        fields |= {f"area_{name}": (shape[:2], area["s"][part, :, 0]) for name in ("corrected", "of_nodes")}
        residual = (("sample", "level"), np.full((last - first, 3), 1e-11 * (1 + first)))
        contact.append(stored(f"{name}.nc", {"first": first}, residual=residual, **fields))
    expansion = stored("e.nc", {"first": 0}, area=(shape, area["e"]), force=(shape, area["e"] / expanded))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)  # intervals have tests of their own
        found = run(friction, SCENE, contact=contact, expansion=[expansion])
    total = area["s"].sum(axis=(0, 2)) / (area["s"] / solved).sum(axis=(0, 2))
    solved[0, 2, 0] = np.nan
    return found, solved, expanded, total


def test_friction_of_known_windows(known):
    """The definitions: tau so that the mean is 0.3 at the median; moments over all windows, pairs of one strip."""
    found, solved, expanded, total = known
    shear = float(found["shear_strength"])
    assert found["combined_mean"][1] == pytest.approx(0.3, rel=1e-12)
    # the control explains all but the solved windows' own noise, so that all 40 strips determine the mean
    everywhere = expanded.mean(axis=(0, 2)) - np.array([1.5, 1.0, 0.5]) * 1e-9
    own = 2e-11 / math.sqrt(STRIPS * WINDOWS)
    np.testing.assert_allclose(found["combined_mean"] / shear, everywhere, rtol=0, atol=3 * own)
    np.testing.assert_allclose(
        found["mean"], shear * np.stack([np.nanmean(solved, axis=(0, 2)), expanded[STRIPS:].mean(axis=(0, 2))])
    )
    np.testing.assert_allclose(
        found["std"], shear * np.stack([np.nanstd(solved, axis=(0, 2)), expanded[STRIPS:].std(axis=(0, 2))]), rtol=1e-9
    )
    # 12 solved and 28 new strips: a perfect control would give 40 / 12
    assert np.all((found["combined_mean_gain"] > 2.5) & (found["combined_mean_gain"] < 40 / 12))
    assert not np.any(found["mesh_change_of_mean"])  # of one mesh
    np.testing.assert_allclose(found["ratio_of_sums"], shear * total)
    assert found["largest_residual"] == pytest.approx(6e-11)
    np.testing.assert_allclose(found["missing_share"], [0, 0, 1 / (STRIPS * WINDOWS)])


def test_lags_lengths_and_trends_of_known_windows(known):
    """Noise averaged over ten windows: its autocorrelation falls along 1 - k / 10, to 1/e near six of them."""
    found, *_ = known
    np.testing.assert_allclose(found["lag"], 1e-5 * np.arange(WINDOWS), atol=1e-18)
    np.testing.assert_allclose(found["triangle"], np.maximum(1 - found["lag"] / 1e-4, 0.0), atol=1e-12)
    curve = found["autocorrelation"]
    assert curve.shape == (3, WINDOWS)
    controlled = found["combined_autocorrelation"]
    np.testing.assert_allclose(controlled[:, :10], np.tile(1 - np.arange(10) / 10, (3, 1)), atol=0.15)
    np.testing.assert_allclose(found["length_one_over_e"], 6.3e-5, rtol=0.4)
    for name in TRENDS:
        change, levels = found[f"trend_combined_{name}_change"], found[f"combined_{name}"]
        np.testing.assert_allclose(change, levels[-1] - levels[0], rtol=1e-9)
    # of three levels at equal distances the middle one does not turn the line
    np.testing.assert_allclose(found["trend_combined_mean_line"], found["trend_combined_mean_change"], rtol=1e-9)
    for name in found:
        if f"{name}_low" in found:
            assert np.all(~(found[f"{name}_low"] > found[f"{name}_high"])), name


def test_what_is_drawn_and_tabled_is_at_its_penetration(known, folder):
    found, solved, *_ = known
    edges, density = found["histogram_edge"], found["histogram"]
    mu = float(found["shear_strength"]) * solved[:, 1]
    assert (edges[0], edges[-1]) == (pytest.approx(mu.min()), pytest.approx(mu.max()))
    counts = [np.count_nonzero((low <= mu) & (mu < high)) for low, high in pairwise(edges)]
    np.testing.assert_allclose(density[:-1], np.array(counts[:-1]) / mu.size / np.diff(edges)[:-1])
    rows = store.table_rows((folder / "summary.csv").read_text())
    assert [float(row["percentile"]) for row in rows] == [10.0, 50.0, 90.0]
    text = (folder / "summary.csv").read_text().splitlines()
    explained = [line[2:].split(" [") for line in text if line.startswith("# ") and "]: " in line]
    columns = [name for name in rows[0] if not name.removesuffix("_m").endswith(("_low", "_high"))]
    assert [name for name, _ in explained] == columns  # each with its unit, and no other
    assert ["combined_length_least_squares_m", "m"] in [[name, rest.split("]")[0]] for name, rest in explained]
    for level, row in enumerate(rows):
        assert float(row["combined_mean"]) == pytest.approx(found["combined_mean"][level], rel=1e-5)
        assert float(row["combined_skewness"]) == pytest.approx(found["combined_skewness"][level], rel=1e-5)
        assert float(row["combined_std"]) == pytest.approx(found["combined_std"][level], rel=1e-5)
        length = found["combined_length_least_squares_low"][level]
        assert float(row["combined_length_least_squares_low_m"]) == pytest.approx(length, rel=1e-5)
        shapes = [found[f"beta_{shape}"][level] / np.array(SHAPES) for shape in "ab"]
        at_bound = any(least < 1.001 or most > 0.999 for least, most in shapes)
        assert int(row["beta_at_bound"]) == found["beta_at_bound"][level] == at_bound


def test_one_level_has_no_trend(run, known, folder):
    """Its intervals are those of the level among others but for the random numbers."""
    found, *_ = known
    paths = [folder / name for name in ("one-z.nc", "one-y.nc", "one-e.nc")]
    for path, source in zip(paths, ("z.nc", "y.nc", "e.nc"), strict=True):
        batch = store.read(folder / source)
        variables = {
            name: one._replace(values=one.values[:, 1:2]) if "level" in one.dimensions else one
            for name, one in batch.variables.items()
        }
        store.write(path, variables, store.Key({}, "code"), {"first": batch.attributes["first"]})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)
        scene = changed(SCENE, strip={"penetration_percentiles": [50.0]})
        one = run(friction, scene, "one", contact=paths[:2], expansion=paths[2:], summary=folder / "one.csv")
    assert not [name for name in one if name.startswith("trend_")]
    for name in ("mean", "std", "skewness"):
        np.testing.assert_allclose(one[name][..., 0], found[name][..., 1], rtol=1e-12)


ASKED = {"friction_mean": 0.05, "friction_std": 0.08}
PILOT = 12
ENDS = (("low", "high"), ("high", "low"))
ALLOTTED = changed(
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
ALLOTTED["strip"] |= {"training_samples": PILOT, "samples": "auto", "expansion_samples": "auto"}


@pytest.fixture(scope="module")
def allotted(run):
    """Paths of the pilot, of the expansion and of the allocation."""
    pilot = run(strip_pilot, ALLOTTED).path
    expansion = run(chaos_strip, ALLOTTED, contact=[pilot]).path
    return pilot, expansion, run(strip_allocation, ALLOTTED, pilot=pilot, expansion=expansion).path


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
            paths.append(run(stage, ALLOTTED, f"{stage.STAGE.name}-{share}", **place).path)
    by_hand = changed(ALLOTTED, strip={"samples": strips, "expansion_samples": many})
    for stage, count in ((contact_strip, strips), (expansion_strip, many)):
        whole = run(stage, by_hand, f"{stage.STAGE.name}-whole", first=0, last=count, expansion=expansion)
        for name in ("area", "force"):
            np.testing.assert_array_equal(store.join(store.read_all(parts[stage]), name), whole[name])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)
        found = run(
            friction, ALLOTTED, contact=parts[contact_strip], expansion=parts[expansion_strip], allocation=allocation
        )
    assert found.attributes["strips"] == strips
    for name, asked in ASKED.items():
        statistic = f"combined_{name.removeprefix('friction_')}"
        width = (found[f"{statistic}_high"] - found[f"{statistic}_low"]) / 2 / found[statistic]
        assert run.did[f"{name}_reached"] == pytest.approx(width.max(), abs=1e-5)
        assert width.max() < 1.3 * asked


@pytest.mark.slow
def test_strips_on_coarse_cells_alone_are_those_of_a_whole_solve(run, stored):
    """Bit for bit. As a control they leave the same friction, within the intervals of both."""
    scene = changed(ALLOTTED, numerics={"extrapolate_mesh": True, "contact_area": "corrected"}, strip={"width_m": 3e-5})
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
    scene = changed(ALLOTTED, accuracy={"cost_limit_cpu_s": limit})
    with pytest.raises(IllPosedError, match=r"nearest is .* or raise accuracy.cost_limit_cpu_s to") as caught:
        run(strip_allocation, scene, "refused", pilot=pilot, expansion=expansion)
    near = yaml.safe_load(re.search(r"nearest is (\{.*\});", str(caught.value))[1])
    scene = changed(scene, accuracy=near)
    assert run(strip_allocation, scene, "nearest", pilot=pilot, expansion=expansion)["cost"] <= limit
    assert all(ASKED[name] < value < 2 * ASKED[name] for name, value in near.items())
    by_hand = changed(ALLOTTED, strip={"samples": PILOT + SHARES})
    with pytest.raises(IllPosedError, match="or leave the number of strips that you gave to auto"):
        run(strip_allocation, by_hand, "refused", pilot=pilot, expansion=expansion)
