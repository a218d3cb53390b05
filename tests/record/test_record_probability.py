"""The probability of stick-slip of a machine whose friction was recorded: its interval holds that of the true friction.

The true one is counted in runs. A record has drift, the period of a revolution, a low-pass and noise.
"""

from functools import partial
from unittest import mock

import numpy as np
import pytest

from roughslip.friction import Friction
from roughslip.oscillator import (
    Machine,
    Oscillator,
    TableLaw,
    budget,
    existence_limit,
    grazing_response,
    run_until_known,
)
from roughslip.record.fit import fit_record
from roughslip.study.budget import law_of_record, sources_of_record
from tests.record.test_record_fit import DEVIATION, LENGTH, around, record, stribeck

RECORDS, STICKING, RUNS, RANGE = 20, 6, 100, 4.0
STATIC = stribeck(0.0)


def friction(deviation, length):
    return Friction(0.3, deviation, length, (100.0, 100.0))


def machine_at(fastest, damping_ratio, law, scatter=(DEVIATION, LENGTH)):
    """A belt of 0.3 of the fastest speed measured; V is two lengths and F five V."""
    speed = 0.3 * fastest
    omega = speed / (2.0 * LENGTH)
    return Machine(Oscillator(1.0, omega, damping_ratio, speed, 5.0 * speed * omega), law, friction(*scatter))


@pytest.fixture(scope="module")
def truth():
    """Fastest speed, damping ratios, shares of runs in stick-slip there, and the limit without scatter."""
    fastest = record(0, span=RANGE).speed.max()
    shares = np.geomspace(1e-3, 1.5, 60)
    law = TableLaw((0.0, *(fastest * shares)), (STATIC, *stribeck(shares)), STATIC)
    limit = existence_limit(machine_at(fastest, 0.1, law).oscillator, law)
    ratios = np.linspace(0.5, 1.2, 11) * limit

    def stick_slips(made, number):
        time = 10.0 * (1.0 + (number * 0.618) % 1.0)
        _, first, states = run_until_known(made, made.kept_path([5, number]), made.paths.spacing, time)
        return states.is_stick_slip(first + time)

    counted = [
        np.mean([stick_slips(machine_at(fastest, ratio, law), number) for number in range(RUNS)]) for ratio in ratios
    ]
    return fastest, ratios, np.array(counted), limit


def interval(found, made, static, apart):
    """The budget's 90 % interval of the probability. made : machine of a law, deviation and length [m]

    apart : of the damping ratios of 95 and 5 % from the limit without scatter
    """
    curve, scatter = found.curve, found.additive
    values = (min(curve.at_rest, static), *curve.friction)
    own = TableLaw((0.0, *curve.speeds_m_per_s), values, max(static, curve.friction[0]))

    def machine(drawn):
        factors = [drawn.get(f"record.{name}", 1.0) for name in ("scatter", "length")]
        of_scatter = np.multiply((scatter.standard_deviation, scatter.correlation_length_m), factors)
        return made(law_of_record(own, drawn), of_scatter.tolist())

    fitted = grazing_response(machine({})).limit
    stored = {"record_mean": 0.3, "curve": curve.friction, "curve_factor": curve.factor}
    stored |= {"curve_at_rest": curve.at_rest, "curve_factor_at_rest": curve.factor_at_rest}
    sources = sources_of_record(stored | {"additive_log_covariance": scatter.log_covariance}, "additive")
    band = fitted + apart[0], fitted + apart[1]
    with mock.patch.object(budget, "TAILS", (0.05, 0.95)):
        return budget.uncertainty_budget(machine, sources, band, limits=(), samples=32).probability.interval


@pytest.mark.slow
def test_intervals_of_the_probability_hold_the_truth(truth):
    """90 % intervals hold it in at least 85 % of the records; a share of 20 errs by 8 %. Of 60 records 93 % did.

    Each record has a damping ratio of its own, with a true probability between 0.1 and 0.9.
    """
    fastest, ratios, counted, limit = truth
    apart = [float(np.interp(-level, -counted, ratios)) - limit for level in (0.95, 0.05)]
    held = []
    for seed in range(RECORDS):
        found = fit_record(record(seed, span=RANGE), around(80.0))
        wanted = np.random.default_rng([seed, 9]).uniform(0.1, 0.9)
        made = partial(machine_at, fastest, float(np.interp(-wanted, -counted, ratios)))
        low, high = interval(found, made, STATIC, apart)
        held.append(low <= wanted <= high)
        print(f"{seed}: {wanted:.2f} in {low:.3f} to {high:.3f}", held[-1], flush=True)
    print(f"coverage {np.mean(held):.3f}")
    assert np.mean(held) > 0.85 - 0.08
