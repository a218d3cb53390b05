"""The Stribeck law of eq. (13)."""

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.oscillator.law import StribeckLaw


def test_published_law():
    """Eq. (13) with mu_fit = 0.3 at the belt speed of the study, term by term."""
    law = StribeckLaw(fit=0.3)
    assert float(law.mu(0.948)) == pytest.approx(0.3 / (1 + 1.42 * 0.948) + 0.1 + 0.01 * 0.948**2, rel=1e-15)
    assert float(law.mu(0.0)) == pytest.approx(0.4, rel=1e-15)


def test_even_in_velocity():
    law = StribeckLaw(fit=0.25)
    velocity = np.linspace(0.0, 3.0, 31)
    assert np.array_equal(law.mu(velocity), law.mu(-velocity))
    assert np.array_equal(law.slope(velocity), law.slope(-velocity))


def test_slope_is_the_derivative():
    """Complex step: no subtraction, so the derivative is exact to rounding."""
    law = StribeckLaw(fit=0.3, static=0.45, decay_s_per_m=2.0, quadratic_s2_per_m2=0.03)
    for speed in (0.0, 0.2, 0.948, 2.5):
        z = speed + 1e-30j
        exact = (law.fit / (1 + 2.0 * z) + 0.15 + 0.03 * z * z).imag / 1e-30
        assert float(law.slope(speed)) == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("name", ["fit", "static", "decay_s_per_m", "quadratic_s2_per_m2"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_refuses(name, value):
    with pytest.raises(ParameterError, match=name):
        StribeckLaw(**({"fit": 0.3} | {name: value}))
