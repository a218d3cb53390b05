"""Counts by the period of the cycle."""

from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.oscillator.law import CoulombLaw
from roughslip.oscillator.motion import ensemble_counts
from roughslip.oscillator.periodic import counts_by_period
from tests.oscillator.motions import LAW, STUDY

DAMPINGS = [0.0, 0.05, 0.17, 0.23, 0.3, 0.324, 0.325, 0.34, 0.6, 0.99, 1.5]


@pytest.mark.parametrize("law", [LAW, CoulombLaw(0.3, 0.4)])
@pytest.mark.parametrize("periods", [0.3, 1.7, 40.3, 97.0])
def test_counts_are_those_of_the_whole_motion(law, periods):
    """On both sides of the end of the cycle, for runs that end in stick, in slip and before the first slip."""
    whole = ensemble_counts(STUDY, law, None, 0.0, periods, DAMPINGS)
    found = counts_by_period(STUDY, law, periods, DAMPINGS)
    assert np.array_equal(found.cycles, whole.cycles)
    assert np.array_equal(found.micro_slips, whole.micro_slips)
    assert found.last_cycle == pytest.approx(whole.last_cycle, abs=1e-7)
    if periods > 40.0:
        assert found.steps < 0.3 * whole.steps


def test_excitation_is_refused():
    driven = replace(STUDY, excitation_force_n=10.0, excitation_frequency_rad_per_s=300.0)
    with pytest.raises(ParameterError, match="excitation"):
        counts_by_period(driven, LAW, 10.0, [0.1])
