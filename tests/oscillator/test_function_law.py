"""A friction law of a function: against the same formula as a class, and what it refuses."""

import math
import subprocess
import sys

import numpy as np
import pytest

from roughslip.errors import ParameterError
from roughslip.oscillator import Oscillator, StribeckLaw, existence_limit, friction_law, simulate
from roughslip.oscillator.laws import friction_curvature

BELT = Oscillator(
    mass_kg=1.0,
    natural_frequency_rad_per_s=316.0,
    damping_ratio=0.17,
    belt_velocity_m_per_s=0.948,
    normal_force_n=2500.0,
)
FORMULA = StribeckLaw(0.3)


def stribeck(speed):
    return 0.3 / (1.0 + 1.42 * speed) + 0.1 + 0.01 * speed**2


def test_values_slopes_and_curvatures_by_differences():
    """Fourth-order differences over a thousandth of a speed err by some 1e-12 of the slope, and 1e-8 of the bend.

    Near rest they are continued from the first speed that differences reach, of third order in 1e-3 of the decay.
    """
    law, speeds = friction_law(stribeck), np.array([1e-3, 0.1, 1.0, 20.0])
    assert law.mu(speeds) == pytest.approx(FORMULA.mu(speeds), rel=1e-14)
    assert law.slope(speeds) == pytest.approx(FORMULA.slope(speeds), rel=1e-11)
    assert law.slope(0.0) == pytest.approx(FORMULA.slope(0.0), rel=1e-7)
    for speed, relative in ((0.0, 1e-4), (1e-3, 1e-7), (1.0, 1e-7)):
        bend = friction_curvature(speed, law.parameters())
        assert bend == pytest.approx(friction_curvature(speed, FORMULA.parameters()), rel=relative)


@pytest.mark.slow  # compiles the motion
def test_a_motion_is_that_of_the_class():
    """Events to the tolerance of the motion, 1e-9, times what a hundred periods magnify."""
    own, known = simulate(BELT, friction_law(stribeck)), simulate(BELT, FORMULA)
    assert own.cycles == known.cycles > 80
    assert own.time == pytest.approx(known.time, rel=1e-7)
    assert existence_limit(BELT, friction_law(stribeck)) == pytest.approx(existence_limit(BELT, FORMULA), rel=1e-9)


def test_each_function_with_its_own_numbers_is_a_law_of_its_own():
    """Coulomb's law at two levels: the steady sliding position is the level times N / c."""

    def constant(level):
        return friction_law(lambda v: level)

    low, high = constant(0.2), constant(0.3)
    assert type(low.parameters()) is not type(high.parameters())
    assert type(low.parameters()) is type(constant(0.2).parameters())
    assert [float(law.mu(1.0)) for law in (low, high)] == [0.2, 0.3]
    assert low.static == 0.2


@pytest.mark.parametrize(
    ("function", "static", "message"),
    [
        (lambda v: 1.0 / v, None, "fails at 0 m/s: float division by zero"),
        (lambda v: math.nan, None, "must give a finite number at 0 m/s, not nan"),
        (lambda v: "0.3", None, "must give a finite number at 0 m/s, not '0.3'"),
        (lambda v: 0.4, 0.3, "static must be at least the friction at rest, 0.4, not 0.3"),
        pytest.param(
            *(lambda v: float(str(0.3).strip()) + 0.0 * v, None, "numba cannot compile the friction law"),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_is_no_law_is_refused(function, static, message):
    with pytest.raises(ParameterError, match=message):
        friction_law(function, static=static)


MODULE = """\
from roughslip.oscillator import Oscillator, friction_law, simulate

def mu(speed):
    return LEVEL - 0.05 * speed / (1.0 + speed)

LEVEL = 0.4
belt = Oscillator(1.0, 316.0, 0.17, 0.948, 2500.0)
if __name__ == "__main__":
    import logging
    logging.basicConfig(level=logging.INFO)
    print(simulate(belt, friction_law(mu), duration_periods=3.0).position[:1])
"""


@pytest.mark.slow  # compiles the motion twice
def test_in_a_file_it_is_compiled_once_and_an_edit_is_seen(tmp_path):
    """What is compiled says so in the log; the edit moves the first departure, static N / c, by its factor."""
    module, first = tmp_path / "own.py", []
    for text in (MODULE, MODULE, MODULE.replace("0.4", "0.44")):
        module.write_text(text)
        run = subprocess.run([sys.executable, module], capture_output=True, text=True, check=True)
        first.append((float(run.stdout.strip(" []\n")), "compiling" in run.stderr))
    assert [compiles for _, compiles in first] == [True, False, True]
    assert first[1][0] == first[0][0]
    assert first[2][0] == pytest.approx(1.1 * first[0][0], rel=0.02)
