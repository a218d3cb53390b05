"""The budget of an answer, against closed forms of Coulomb's law and against simulated machines."""

import dataclasses
import math

import numpy as np
import pytest

from roughslip.oscillator import (
    CoulombLaw,
    Oscillator,
    StribeckLaw,
    existence_limit,
    grazing_response,
    hopf_damping,
    uncertainty_budget,
)
from roughslip.oscillator.budget import ACCURACY, _Chance
from roughslip.probability import Source
from tests.oscillator.motions import machine
from tests.oscillator.test_attractors import HUMP, SLIDE

RELATIVE = {"speed": 0.1, "stiffness": 0.3, "mass": 0.2}


def coulomb(values):
    """Of what scales, all is N (static - kinetic) / (v0 sqrt(k m)) at a given damping ratio."""
    m, k = values.get("mass", 1.0), values.get("stiffness", 1e5)
    belt = Oscillator(m, math.sqrt(k / m), values.get("damping", 0.1), 0.5 * values.get("speed", 1.0), 2500.0)
    return machine(0.003 * values.get("scatter", 1.0), 3e-4, belt, CoulombLaw(0.3, 0.4))


@pytest.fixture(scope="module")
def found():
    base = {"speed": 1.0, "stiffness": 1e5, "mass": 1.0}
    sources = [Source.independent(name, {name: (base[name], s * base[name])}) for name, s in RELATIVE.items()]
    return uncertainty_budget(
        coulomb, [*sources, Source.independent("scatter", {"scatter": (1.0, 0.2)})], limits=("load",)
    )


@pytest.mark.slow
def test_the_limit_in_load_is_a_product_of_powers(found):
    """N* ~ v0 sqrt(k m): lognormal, with the variances of the logarithms 0.01 and a quarter of 0.086 and 0.039."""
    limit = found.limits["load"]
    parts = np.array([np.log1p(s**2) * (1.0, 0.25, 0.25)[i] for i, s in enumerate(RELATIVE.values())])
    deviation, whole = math.sqrt(parts.sum()), math.expm1(parts.sum())
    median = limit.value * math.exp(-0.25 * sum(np.log1p(RELATIVE[name] ** 2) for name in RELATIVE) - 0.25 * 0.00995)
    ends = [median * math.exp(z * deviation) for z in (-1.96, 1.96)]
    assert limit.interval == pytest.approx(ends, rel=0.05)
    assert limit.standard_uncertainty / limit.mean == pytest.approx(math.sqrt(whole), rel=0.05)
    for i, name in enumerate(RELATIVE):
        assert limit.first[name][0] == pytest.approx(math.expm1(parts[i]) / whole, abs=0.1)
        assert limit.total[name][0] == pytest.approx(1 - math.expm1(parts.sum() - parts[i]) / whole, abs=0.1)
    assert limit.first["scatter"] == (0.0, 0.0, 0.0)
    assert limit.beyond == 0.0


@pytest.mark.slow
def test_the_parts_of_the_outcome_add_up(found):
    """By the law of total variance; what is left over are interactions, up to the sampling error of the indices."""
    p = found.probability
    variance = p.mean * (1.0 - p.mean)
    assert found.scatter + p.standard_uncertainty**2 / variance == pytest.approx(1.0, rel=1e-12)
    assert found.scatter + sum(part for part, _, _ in found.outcome.values()) == pytest.approx(1.0, abs=0.25)
    total = sum(one[0] for one in p.total.values())
    assert sum(one[0] for one in p.first.values()) < 1.0 + 0.1 < total + 0.2


def test_without_uncertain_inputs_only_scatter_is_left():
    belt = coulomb({}).oscillator
    ratio = existence_limit(belt, coulomb({}).law)
    found = uncertainty_budget(lambda values: coulomb({"damping": ratio}), (), limits=())
    assert (found.probability.mean, found.outcome) == (pytest.approx(0.5, abs=0.02), {})
    assert found.scatter == pytest.approx(1.0)
    assert found.limits["damping"].interval == pytest.approx((ratio, ratio), rel=ACCURACY)


def test_the_blur_scales_as_the_orbit_of_another_machine():
    """Softer, faster, and with friction of another length: by the scaled orbit and by its own one, within a tenth."""
    law = StribeckLaw(0.3, 0.4)
    own = machine(0.01, 3e-4, law=law)
    other = machine(0.02, 5e-4, Oscillator(1.2, 280.0, 0.3, 1.0, 2300.0), law)
    chance, response = _Chance(own, grazing_response(own).limit, None), grazing_response(other)
    blur = 0.02 * response.scatter(5e-4)
    shifted = dataclasses.replace(other.oscillator, damping_ratio=response.limit - blur)
    found = chance.probability(dataclasses.replace(other, oscillator=shifted), response.limit)
    assert found == pytest.approx(0.8413, abs=0.1 * 0.242)


def test_the_end_of_a_vibration_is_as_uncertain_as_the_load():
    """It is the Hopf damping, which is proportional to the load."""

    def hump(values):
        return machine(0.002, 2.5e-4, dataclasses.replace(SLIDE, normal_force_n=values.get("load", 2000.0)), HUMP)

    found = uncertainty_budget(hump, [Source.independent("load", {"load": (2000.0, 100.0)})], limits=(), samples=16)
    limit = found.limits["vibration"]
    assert limit.value == hopf_damping(SLIDE, HUMP)
    assert limit.mean == pytest.approx(limit.value, rel=0.01)
    assert limit.standard_uncertainty == pytest.approx(0.05 * limit.value, rel=0.1)
    assert limit.first["load"][0] == pytest.approx(1.0, abs=0.2)  # of 16 draws
    assert "vibration" not in uncertainty_budget(coulomb, [], limits=()).limits
