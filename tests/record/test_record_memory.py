"""Memory of the contact from synthetic records: Radau's method on the spring of a rig and the age of contacts."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lfilter

from roughslip.record.followed import Law, followed
from roughslip.record.likelihood import scatter_path
from roughslip.record.memory import contact_memory
from roughslip.record.reading import Trace
from roughslip.record.slips import Rig

REFERENCE = 1e-6


def record(
    seed, speeds=(1e-6, 1e-5) * 3, seconds=(20.0, 4.0) * 3, rate=100.0, a=0.01, b=0.015, length=2e-6, stiffness=1e6,
    scatter=5e-4, correlation=1e-4, noise=2e-4, low_pass=0.0, drift=0.0, speed_noise=0.0, swing=0.0,
):  # fmt: skip
    """mu = 0.6 + a ln(v / v*) + b ln(theta v* / D_c) at speeds of the drive. stiffness : [1/m] over normal force

    swing : [s] of the mass in a radian
    """
    generator, ends = np.random.default_rng([seed, 5]), np.cumsum(seconds)
    time = (np.arange(int(ends[-1] * rate) - 1) + generator.random()) / rate
    drive = np.array(speeds)[np.searchsorted(ends, time, side="right")]
    path, state = [], [0.6 + (a - b) * np.log(speeds[0] / REFERENCE), length / speeds[0], 0.0, np.log(speeds[0])]
    for end, lasts, speed in zip(ends, seconds, speeds, strict=True):

        def rates(_, y, speed=speed):
            w = np.log(REFERENCE) + (y[0] - 0.6 - b * np.log(y[1] * REFERENCE / length)) / a  # where forces balance
            v = np.exp(y[3] if swing else w)
            faster = a * (w - y[3]) / (stiffness * swing**2 * v) if swing else 0.0
            return [stiffness * (speed - v), 1.0 - v * y[1] / length, v, faster]

        places = np.append(time[(time >= end - lasts) & (time < end)] - (end - lasts), lasts)
        found = solve_ivp(rates, (0.0, lasts), state, "Radau", places, rtol=1e-7, atol=[1e-9, 1e-9, 1e-13, 1e-8]).y
        path, state = [*path, found[:, :-1]], found[:, -1]
    friction, _, slipped, _ = np.hstack(path)
    friction += scatter * scatter_path(np.maximum.accumulate(slipped), correlation, generator)
    keep = np.exp(-1.0 / (rate * low_pass)) if low_pass else 0.0
    friction = lfilter([1.0 - keep], [1.0, -keep], friction - friction[0]) + friction[0]
    friction += noise * generator.standard_normal(time.size) + drift * (time / ends[-1] - 0.5)
    drive = drive * (1.0 + speed_noise * generator.standard_normal(time.size))
    return Trace(time, drive, friction, np.full(time.size, 10.0), None)


def holds(times=(1.0, 3.0, 10.0, 30.0, 100.0), rate=50.0, **others):
    seconds = [5.0, *(lasts for hold in times for lasts in (hold, 5.0))]
    speeds = [1e-5, *([0.0, 1e-5] * len(times))]
    return others | {"speeds": speeds, "seconds": seconds, "rate": rate, "scatter": 3e-4, "noise": 1e-4}


STEPS = {"speeds": (1e-6, 3e-6, 1e-5, 3e-6) * 2, "seconds": (100.0, 40.0, 20.0, 40.0) * 2, "rate": 20.0}
ROWS = {
    "a stiff rig": {},
    "noise of a tenth of a step": {"noise": 3e-3, "scatter": 0.0},
    "a spring": {"stiffness": 2e4},
    "a soft spring, a > b": {"stiffness": 3e3, "a": 0.015, "b": 0.01},
    "three speeds, drift": STEPS | {"length": 1e-5, "drift": 0.01, "correlation": 1e-3},
    "low-pass, noise in the speed": {"low_pass": 0.03, "speed_noise": 0.02},
    "10 samples a second": {"rate": 10.0, "length": 4e-6},
    "holds": holds(stiffness=3e4),
    "steps between samples": {"seconds": (20.003, 4.006) * 3},
}


def covered(seeds, row):
    """Of a, b and ln D_c: shares of intervals that hold the truth, half widths over 1.96 spreads. Holds show no a."""
    found = [contact_memory([record(seed, **ROWS[row])]) for seed in seeds]
    triples = np.array([[one.direct_effect, one.ageing_effect, np.log(one.length_m)] for one in found])
    truth = {"a": 0.01, "b": 0.015, "length": 2e-6} | ROWS[row]
    values, half = triples[:, :, 0], 0.5 * (triples[:, :, 2] - triples[:, :, 1])
    inside = np.abs(values - [truth["a"], truth["b"], np.log(truth["length"])]) < half
    known = slice(int(row == "holds"), None)
    return inside.mean(axis=0)[known], (np.median(half, axis=0) / values.std(axis=0) / 1.96)[known]


@pytest.mark.slow
@pytest.mark.parametrize("row", ["a spring", "10 samples a second", "holds", "steps between samples"])
def test_intervals_of_five_records_hold_the_truth(row):
    """Three or more miss with a probability below 2 %, if each holds with 0.88."""
    assert np.all(covered(range(300, 305), row)[0] >= 0.6)


@pytest.mark.nightly
def test_intervals_of_the_memory_hold_the_truth():
    """0.88, 0.88 and 0.85 over all rows, and half widths of 1.3 at most.

    In one row of 60 records a share has a standard error of 0.04, and a spread one of 9 %: three of these below.
    """
    of_rows = []
    for row in ROWS:
        shares, wide = covered(range(60), row)
        print(f"{row}: coverage of a, b, D_c {shares.round(3)}, half widths over 1.96 spreads {wide.round(2)}")
        of_rows.append(np.pad([shares, wide], ((0, 0), (3 - shares.size, 0)), constant_values=np.nan))
    shares, wide = np.transpose(of_rows, (1, 0, 2))
    assert np.all(np.nanmean(shares, axis=0) >= [0.88, 0.88, 0.85])
    assert np.all(np.nanmin(shares, axis=0) >= [0.76, 0.76, 0.73])
    assert np.all(np.nanmean(wide, axis=0) <= 1.3)
    assert np.nanmax(wide) <= 1.65


@pytest.mark.slow
def test_static_friction_grows_by_b_in_each_e_folding_of_the_hold():
    """0.015 of a stiff rig. With three samples a second the peak is gone; a factor of 5 in time is too little."""
    _, low, high = contact_memory([record(1, **holds())]).growth
    assert low < 0.015 < high < 1.07 * low
    for given, why in ((holds(rate=3.0), "its peak passes between"), (holds((2.0, 5.0, 10.0)), "over a factor of 10")):
        hidden = contact_memory([record(1, **given)])
        assert np.isnan(hidden.growth).all()
        assert why in hidden.notes[-1]


@pytest.mark.parametrize(
    "count", [pytest.param(4, marks=pytest.mark.slow), pytest.param(100, marks=pytest.mark.nightly)]
)
def test_no_memory_is_found_where_there_is_none(count):
    """In at most 2 % of records with b = 0, in scatter, noise, a spring and a low-pass."""
    kinds = {}, {"stiffness": 2e4}, {"noise": 2e-3, "low_pass": 0.03}, {"scatter": 4e-3, "correlation": 1e-5}
    found = [contact_memory([record(seed, b=0.0, **kinds[seed % 4])]) for seed in range(count)]
    false = np.count_nonzero([np.isfinite(one.ageing_effect[0]) for one in found])
    print(f"{false} of {count} records without a memory seem to have one")
    assert false <= 0.02 * count


@pytest.mark.slow
def test_what_hides_a_memory_is_said():
    """Samples too sparse, levels of speed shorter than D_c, a rig far softer; without steps nothing is sought."""
    soft = {"stiffness": 10.0, "a": 0.02, "b": 0.01, "noise": 2e-3}
    for why, given in {"from 3e-07": {"rate": 10.0, "length": 1e-8}, "levels": {"length": 5e-5}, "rig": soft}.items():
        found = contact_memory([record(2, **given)])
        assert np.isnan([found.direct_effect, found.ageing_effect, found.length_m]).all()
        assert why in found.notes[0]


def test_friction_that_is_followed_is_that_of_radau_s_method():
    """After a step and a hold, on a spring and with a mass; without noise, so the error is that of the time steps."""
    speeds, seconds = (1e-6, 1e-5, 0.0, 1e-5), (5.0, 2.0, 5.0, 2.0)
    for swing in (0.0, 0.02):
        trace = record(0, speeds, seconds, rate=1e3, stiffness=2e4, swing=swing, scatter=0.0, noise=0.0)
        edges, ends = np.append(0.0, trace.time), np.append(0.0, np.cumsum(seconds))
        places = np.interp(edges, ends, np.append(0.0, np.cumsum(np.multiply(speeds, seconds))))
        steps, numbers = np.append(-1.0, np.diff(places)), np.array([[0.015], [2e-6], [1 / 2e4], [2e4 * swing**2]])
        law = Law(np.log([1e-7, 1e-5]), 0.6 - 0.005 * np.log([[0.1, 10.0]]), *numbers)
        found = followed(steps[None], np.append(1.0, np.diff(edges)), np.append(1e-6, trace.speed), 1e-9, law)[0, 1:]
        assert np.abs(found - trace.friction).max() < 3e-5


@pytest.mark.slow
def test_transients_that_are_taken_out_leave_steady_friction_as_the_instrument_shows_it():
    """To 1e-4, with scatter and noise of 1e-5. A low-pass in time in place of samples leaves 4e-3 after each step."""
    trace = record(4, low_pass=0.03, scatter=1e-5, noise=1e-5)
    steady, keep = 0.6 - 0.005 * np.log(trace.speed / REFERENCE), np.exp(-1.0 / 3.0)
    steady = lfilter([1.0 - keep], [1.0, -keep], steady - steady[0]) + steady[0]
    left = trace.friction - contact_memory([trace]).transients[0] - steady
    assert np.abs(left[1000:] - np.median(left)).max() < 1e-4


@pytest.mark.slow
def test_a_mass_that_is_not_given_is_found_or_said_to_hide_the_memory():
    """Its swing shifts b by 3 % where the samples show half of it, and by more than its interval where they do not."""
    shown = contact_memory([record(1, stiffness=2e4, swing=0.03)])
    assert shown.ageing_effect[1] < 0.015 < shown.ageing_effect[2]
    assert shown.length_m[1] < 2e-6 < shown.length_m[2]


def test_a_rig_that_is_given_is_not_fitted_and_a_ramp_is_no_step():
    found = contact_memory([record(4, stiffness=2e4)], Rig(1e-3, 2e5), 0.0)
    assert found.flexibility_m == pytest.approx(5e-5, rel=1e-12)
    assert found.length_m[1] < 2e-6 < found.length_m[2]
    ramp = np.geomspace(1e-6, 1e-5, 2000)
    assert contact_memory([Trace(0.01 * np.arange(2000), ramp, 0.6 + 0.0 * ramp, None, None)]) is None


@pytest.mark.parametrize(("friction", "why"), [(0.0, "one friction"), (0.3, "no contact on this rig")])
def test_friction_that_no_contact_has_is_said(friction, why):
    """One friction at all speeds, and a fall of 0.3 over a factor of ten on a heavy and soft rig."""
    speed = np.repeat([1e-3, 1e-2, 1e-3, 1e-2], 50)
    trace = Trace(0.1 * np.arange(200), speed, 0.6 - friction * (speed > 2e-3), np.full(200, 10.0), None)
    found = contact_memory([trace], Rig(100.0, 100.0))
    assert np.isnan(found.length_m).all()
    assert why in found.notes[0]
