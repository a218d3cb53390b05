"""Stage friction on known windows: its definitions, lengths, trends, and what is drawn and tabled."""

import math
from itertools import pairwise

import numpy as np
import pytest

from roughslip import store
from roughslip.friction.marginal import SHAPES
from roughslip.friction.table_variables import TRENDS
from roughslip.study import friction
from roughslip.study.from_scene import geometry
from tests.study.scenes import CONTACT, changed

STRIPS, MANY, WINDOWS = 12, 40, 60
SCENE = changed(
    CONTACT,
    strip={"penetration_percentiles": [10.0, 50.0, 90.0], "window_spacing_m": 1e-5},
    friction={"mean": 0.3},
)


BLOCKS = 1e-5, 2.5e-5, 1e-5  # windows are drawn as they are, so that each is one block


def sums(area: np.ndarray, ratio: np.ndarray) -> dict:
    """Area and force of blocks, from arrays (strips, levels, windows)."""
    shape = ("sample", "level", "along", "across")
    return {"area": (shape, area[..., None]), "force": (shape, (area / ratio)[..., None])}


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
    area = {name: 1e-10 * rng.uniform(1, 2, ratio.shape) for name, ratio in (("s", solved), ("e", expanded))}
    area["s"][:2, 2, 0] = 2.4e-12, 2.6e-12
    contact = []
    for name, first, last in (("z", 0, 5), ("y", 5, STRIPS)):  # named in another order than numbered
        part = slice(first, last)
        fields = sums(area["s"][part], solved[part])
        residual = (("sample", "level"), np.full((last - first, 3), 1e-11 * (1 + first)))
        contact.append(stored(f"{name}.nc", {"first": first, "model": "solved"}, residual=residual, **fields))
    expansion = stored("e.nc", {"first": 0, "model": "expansion"}, **sums(area["e"], expanded))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)  # intervals have tests of their own
        patch.setattr(geometry, "block_sizes", lambda _: BLOCKS)
        result = run(friction, SCENE, blocks=[*contact, expansion])
    total = area["s"].sum(axis=(0, 2)) / (area["s"] / solved).sum(axis=(0, 2))
    solved[0, 2, 0] = np.nan
    return result, solved, expanded, total


def test_friction_of_known_windows(known):
    """The definitions: tau so that the mean is 0.3 at the median; moments over all windows, pairs of one strip."""
    statistics, solved, expanded, total = known
    shear = float(statistics["shear_strength"])
    assert statistics["combined_mean"][1] == pytest.approx(0.3, rel=1e-12)
    # the control explains all but the solved windows' own noise, so that all 40 strips determine the mean
    everywhere = expanded.mean(axis=(0, 2)) - np.array([1.5, 1.0, 0.5]) * 1e-9
    own = 2e-11 / math.sqrt(STRIPS * WINDOWS)
    np.testing.assert_allclose(statistics["combined_mean"] / shear, everywhere, rtol=0, atol=3 * own)
    np.testing.assert_allclose(
        statistics["mean"], shear * np.stack([np.nanmean(solved, axis=(0, 2)), expanded[STRIPS:].mean(axis=(0, 2))])
    )
    np.testing.assert_allclose(
        statistics["std"],
        shear * np.stack([np.nanstd(solved, axis=(0, 2)), expanded[STRIPS:].std(axis=(0, 2))]),
        rtol=1e-9,
    )
    np.testing.assert_allclose(statistics["ratio_of_sums"], shear * total)
    np.testing.assert_allclose(statistics["missing_share"], [0, 0, 1 / (STRIPS * WINDOWS)])


def test_lags_lengths_and_trends_of_known_windows(known):
    """Noise averaged over ten windows: its autocorrelation falls along 1 - k / 10, to 1/e near six of them."""
    statistics, *_ = known
    np.testing.assert_allclose(statistics["lag"], 1e-5 * np.arange(WINDOWS), atol=1e-18)
    np.testing.assert_allclose(statistics["triangle"], np.maximum(1 - statistics["lag"] / 1e-4, 0.0), atol=1e-12)
    curve = statistics["autocorrelation"]
    assert curve.shape == (3, WINDOWS)
    controlled = statistics["combined_autocorrelation"]
    np.testing.assert_allclose(controlled[:, :10], np.tile(1 - np.arange(10) / 10, (3, 1)), atol=0.15)
    np.testing.assert_allclose(statistics["length_one_over_e"], 6.3e-5, rtol=0.4)
    for name in TRENDS:
        change, levels = statistics[f"trend_combined_{name}_change"], statistics[f"combined_{name}"]
        np.testing.assert_allclose(change, levels[-1] - levels[0], rtol=1e-9)
    # of three levels at equal distances the middle one does not turn the line
    np.testing.assert_allclose(
        statistics["trend_combined_mean_line"], statistics["trend_combined_mean_change"], rtol=1e-9
    )
    for name in statistics:
        if f"{name}_low" in statistics:
            assert np.all(~(statistics[f"{name}_low"] > statistics[f"{name}_high"])), name


def test_what_is_drawn_and_tabled_is_at_its_penetration(known, folder):
    statistics, solved, *_ = known
    edges, density = statistics["standard_edge"], statistics["standard_histogram"][1]
    mu = float(statistics["shear_strength"]) * solved[:, 1]
    standard = (mu - mu.mean()) / mu.std()
    counts = [np.count_nonzero((low <= standard) & (standard < high)) for low, high in pairwise(edges)]
    np.testing.assert_allclose(density[:-1], np.array(counts[:-1]) / mu.size / np.diff(edges)[:-1])
    rows = store.table_rows((folder / "summary.csv").read_text())
    assert [float(row["percentile"]) for row in rows] == [10.0, 50.0, 90.0]
    text = (folder / "summary.csv").read_text().splitlines()
    explained = [line[2:].split(" [") for line in text if line.startswith("# ") and "]: " in line]
    columns = [name for name in rows[0] if not name.removesuffix("_m").endswith(("_low", "_high"))]
    assert [name for name, _ in explained] == columns  # each with its unit, and no other
    assert ["combined_length_least_squares_m", "m"] in [[name, rest.split("]")[0]] for name, rest in explained]
    for level, row in enumerate(rows):
        assert float(row["combined_mean"]) == pytest.approx(statistics["combined_mean"][level], rel=1e-5)
        assert float(row["combined_skewness"]) == pytest.approx(statistics["combined_skewness"][level], rel=1e-5)
        assert float(row["combined_std"]) == pytest.approx(statistics["combined_std"][level], rel=1e-5)
        length = statistics["combined_length_least_squares_low"][level]
        assert float(row["combined_length_least_squares_low_m"]) == pytest.approx(length, rel=1e-5)
        shapes = [statistics[f"beta_{shape}"][level] / np.array(SHAPES) for shape in "ab"]
        at_bound = any(least < 1.001 or most > 0.999 for least, most in shapes)
        assert int(row["beta_at_bound"]) == statistics["beta_at_bound"][level] == at_bound


def test_one_level_has_no_trend(run, known, folder):
    """Its intervals are those of the level among others but for the random numbers."""
    statistics, *_ = known
    paths = [folder / name for name in ("one-z.nc", "one-y.nc", "one-e.nc")]
    for path, source in zip(paths, ("z.nc", "y.nc", "e.nc"), strict=True):
        batch = store.read(folder / source)
        variables = {
            name: one._replace(values=np.take(one.values, [1], axis=one.dimensions.index("level")))
            for name, one in batch.variables.items()
        }
        store.write(
            path, variables, store.Key({}, "code"), {name: batch.attributes[name] for name in ("first", "model")}
        )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(friction, "REPLICATES", 200)
        patch.setattr(geometry, "block_sizes", lambda _: BLOCKS)
        scene = changed(SCENE, strip={"penetration_percentiles": [50.0]})
        one = run(friction, scene, "one", blocks=paths)
    assert not [name for name in one if name.startswith("trend_")]
    for name in ("mean", "std", "skewness"):
        np.testing.assert_allclose(one[name][..., 0], statistics[name][..., 1], rtol=1e-12)
