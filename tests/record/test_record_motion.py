"""Stick-slip, swings and steady sliding are distinct in synthetic records of many kinds, and in public ones."""

from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from roughslip import IllPosedError, InputError
from roughslip.record.likelihood import scatter_path
from roughslip.record.reading import Trace, read_records
from roughslip.record.slips import Rig, sliding

PUBLIC = Path(__file__).parents[3] / "shared" / "data" / "paper-on-paper"


def said(friction, speed, rate, load=None, **others):
    """The share of a record that is left out, and what is said."""
    speed, load = (None if one is None else np.broadcast_to(one, friction.shape) for one in (speed, load))
    try:
        found = sliding([Trace(np.arange(friction.size) / rate, speed, friction, load, None)], **others)
    except IllPosedError as error:
        return 1.0, str(error)
    return float(np.mean(found.stick[0])), "; ".join(found.notes)


def saw(generator, _):
    """5 to 500 teeth, equal or not, of 8 samples or more; noise of up to 30 % of a tooth; slow waves."""
    teeth = round(5.0 * 100.0 ** generator.random())
    in_tooth = max(8.0, 130.0 / teeth) * min(100.0, 300.0 / teeth) ** generator.random()
    slip = max(generator.uniform(0.01, 0.2), 1.0 / in_tooth)
    sizes = np.exp(generator.choice([0.0, 0.2]) * generator.standard_normal(teeth))
    edges = np.append(0.0, np.cumsum(sizes)) * teeth / sizes.sum()
    place = (np.arange(int(teeth * in_tooth)) + 0.5) / in_tooth
    tooth = np.searchsorted(edges, place, side="right") - 1
    phase = (place - edges[tooth]) / np.diff(edges)[tooth]
    values = (np.minimum(phase / (1.0 - slip), (1.0 - phase) / slip) - generator.integers(2)) * sizes[tooth]
    values += generator.integers(2) * np.sin(2.0 * np.pi * generator.uniform(0.2, 2.0) * place / teeth)
    return 0.3 + 0.05 * (values + generator.uniform(0.0, 0.3) * generator.standard_normal(place.size)), 0.05


def steady(generator, kind):
    """Scatter over 40 to 3000 lengths: alone, with bumps, slow waves or heavy tails, at steps or on ramps of speed."""
    n = int(400.0 * 100.0 ** generator.random())
    share, speed, tails = np.arange(n) / n, 0.05, generator.uniform(2.5, 6.0)
    values = scatter_path(share, 0.025 * (40.0 / min(n, 3000)) ** generator.random(), generator)
    for height in generator.uniform(3.0, 30.0, 2) * generator.choice([-1, 1]) if kind == 1 else ():
        away = (share - generator.random()) / (0.04 / n ** generator.random())
        values += height * np.exp(-np.maximum(-(10.0 ** generator.random()) * away, away))
    if kind == 2:
        values += generator.uniform(1.0, 5.0) * np.sin(2.0 * np.pi * generator.uniform(0.5, 10.0) * share)
    elif kind == 3:
        values = stats.t.ppf(stats.norm.cdf(values), tails) + generator.integers(2) * generator.standard_t(tails, n)
    elif kind == 4:
        speed = np.exp(generator.uniform(-4.0, 0.0, 8))[(share * generator.integers(2, 8)).astype(int)]
    elif kind == 5:
        speed = 0.01 * 30.0 ** np.abs((share * generator.choice([1, 2, 4]) + generator.random()) % 2.0 - 1.0)
    values += generator.uniform(0.0, 2.0) * generator.standard_normal(n)
    return 0.3 + 0.15 / (1.0 + 8.0 * speed) + 0.01 * values, speed


@pytest.mark.parametrize("count", [10, pytest.param(200, marks=pytest.mark.nightly)])
def test_stick_slip_is_told_from_steady_sliding(count):
    """At most 2 % of saws pass, and of at most 2 % of steady records more than a twentieth is left out."""
    wrong = []
    for made, is_saw in ((saw, True), (steady, False)):
        generators = [np.random.default_rng([seed, is_saw]) for seed in range(count)]
        lost = [said(*made(one, seed % 6), 5.0 * 1e3 ** one.random())[0] for seed, one in enumerate(generators)]
        wrong.append(sum(share < 0.95 if is_saw else share > 0.05 for share in lost))
    print(f"of {count} each, {wrong[0]} saws pass and {wrong[1]} steady records are refused")
    assert max(wrong) <= 0.02 * count


@pytest.mark.parametrize("rate", [10.0, 50.0, 2000.0])
def test_the_rate_of_samples_does_not_count(rate):
    """Teeth of 4.1 s of which slips last 0.12 s, with noise of 7 %."""
    phase = np.arange(int(200.0 * rate)) / rate / 4.1 % 1.0
    noise = 0.004 * np.random.default_rng(0).standard_normal(phase.size)
    text = said(0.31 + 0.055 * np.minimum(phase / 0.97, (1.0 - phase) / 0.03) + noise, 42e-6, rate)[1]
    assert "no sample of the record is in steady sliding: stick-slip up to 4.2e-05 m/s" in text


def test_a_bump_costs_its_own_stretch():
    values = np.random.default_rng(3).normal(0.3, 0.01, 6000)
    values[3010:3013] += 0.4
    assert said(values, 0.1, 100.0) == (pytest.approx(1 / 60), "a bump from 30 to 30.99 s is left out")


def test_a_swing_is_handed_to_the_balance_of_forces():
    """At the natural frequency the spring's force swings; a wave of each revolution, of known radius, is none."""
    wave = 0.1 * np.sin(2.0 * np.pi * 57.0 * 1e-3 * np.arange(8000))
    record = 0.35 + wave + np.random.default_rng(0).normal(0.0, 0.01, 8000), 0.01, 1e3
    assert "no sample of the record is in steady sliding: a swing at 57" in said(*record)[1]
    assert said(*record, radius_m=0.01 / 57.0 / (2.0 * np.pi))[0] == 0.0
    rig = Rig(0.02, 0.02 * (2.0 * np.pi * 57.0) ** 2)
    assert said(*record, 0.01, rig=rig) == (0.0, "")
    assert "varies more than the force" in said(*record, 0.01, rig=Rig(0.1, rig.stiffness_n_per_m))[1]
    with pytest.raises(InputError, match="column load: missing"):
        said(*record, rig=rig)


@pytest.mark.skipif(not PUBLIC.exists(), reason="the public records are not there, which are not part of the project")
@pytest.mark.parametrize(
    ("speed", "expected"),
    [
        (42, ["stick-slip"] * 3),
        (1100, ["stick-slip", "a swing at 27", "a swing at 5"]),
        (4300, ["a swing at 14", "a swing at 35", "a swing at 5"]),
    ],
)
def test_public_records_end_in_the_right_description(speed, expected):
    """Nine of paper on paper, by J. Colas et al., Phys. Rev. E (2019); data of N. Pustelnik and V. Vidal, CeCILL-B."""
    for k, motion in zip((168, 1002, 2254), expected, strict=True):
        with pytest.raises(IllPosedError, match=f"in steady sliding: {motion}"):
            sliding(read_records([PUBLIC / f"k{k}_v{speed}.csv"]))
