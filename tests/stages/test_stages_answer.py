"""The answer on stick-slip: the deterministic limits without scatter, identities of the equation of motion."""

import functools
import json
from argparse import Namespace

import numpy as np
import pytest

from roughslip import store
from roughslip.oscillator.friction_laws.stribeck import StribeckLaw
from roughslip.oscillator.limits import limit_cycle
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.probability.level_search import ACCURACY
from roughslip.report.machine import change_rows
from roughslip.scene.types import scene_of
from roughslip.stages import answer
from roughslip.stages.from_scene import mass_on_belt
from roughslip.stages.runtime.command import Job
from roughslip.stages.runtime.usage import Usage
from tests.stages.scenes import OSCILLATOR
from tests.stages.test_stages_motion import scattered

EXISTENCE = 0.324424  # of eq. (13) with the paper's numbers
CERTAIN = [72 / (72 + 1.959964**2), 1.0]  # Wilson's interval of 72 hits in 72 runs


@pytest.fixture(scope="module")
def answered(folder):
    """answered(std, varied, **oscillator) is answer.json, once; `varied` are the parameters that are searched."""

    @functools.cache
    def of_scene(std, varied=("damping",), **others):
        asked = scattered(std, **others) | {"answer": {"realisations": 72, "duration_periods": 20.0}}
        output, usage = folder / "answer.json", Usage(folder / "answer", "answer")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(answer, "VARIED", varied)
            answer.work(Job(store.Key(asked, "code"), Namespace(friction=None, output=output), usage))
        return json.loads(output.read_text())

    return of_scene


def test_without_scatter_both_limits_of_damping_are_the_existence_limit(answered):
    """Runs begin in stick, so that stick-slip exists up to there. From steady sliding, which is unstable, 20 periods
    are too short for so small a push to grow by exp(2 pi (0.231 - 0.17) 20) = 2000 to the size of the cycle."""
    found = answered(1e-9)
    assert [found["probability"]["value"], *found["probability"]["interval"]] == pytest.approx([1, *CERTAIN], rel=1e-6)
    assert found["probability_from_sliding"]["value"] == 0.0
    above, below = (found["limits"]["damping"][side] for side in ("above", "below"))
    for label in ("0.05", "0.95"):
        assert above[label]["change"] == "falls below"
        assert [above[label]["value"], *above[label]["interval"]] == pytest.approx([EXISTENCE] * 3, rel=2 * ACCURACY)
    assert above["without_scatter"]["value"] == pytest.approx(EXISTENCE, rel=4e-6)
    assert below == {"0.05": None, "0.95": None, "without_scatter": {"value": None, "interval": None, "unit": "1"}}
    assert found["decides"]["by"] == "mean curve"
    assert found["decides"]["existence_limit"]["value"] == pytest.approx(EXISTENCE, abs=1e-6)
    change = found["smallest_change"]
    assert (change["parameter"], change["side"], change["aim"]) == ("damping", "above", "end")
    assert change["value"] == pytest.approx(EXISTENCE / 0.17 - 1, rel=4 * ACCURACY)


def test_without_scatter_amplitude_and_frequency_are_those_of_the_limit_cycle(answered):
    """Samples miss the extremes of the displacement by (pi / 100)^2 / 2 of the amplitude at most."""
    found = answered(1e-9)
    belt, law = mass_on_belt.oscillator(scene_of({"oscillator": OSCILLATOR})), StribeckLaw(0.3, 0.4)
    assert found["frequency"]["value"] == pytest.approx(316 / limit_cycle(belt, law).period, rel=1e-5)
    drawn = trajectory(belt, law, None, 0.0, 10.0, MotionOptions(samples_per_period=4000))
    amplitude = 0.5 * np.ptp(drawn.position[20_000:])
    assert amplitude * (1 - 0.5 * (np.pi / 100) ** 2) <= found["amplitude"]["value"] <= amplitude * (1 + 1e-5)
    for name in ("amplitude", "frequency"):
        assert found[f"{name}_scatter"]["value"] < 1e-3 * found[name]["value"]


@pytest.mark.slow
def test_above_the_limits_stick_slip_begins_where_damping_falls(answered):
    """At D = 1 no run cycles, from either start; with hardly any scatter both levels are passed at the limit."""
    found = answered(1e-9, damping_ratio=1.0)
    assert found["probability"]["value"] == found["probability_from_sliding"]["value"] == 0.0
    assert found["amplitude"] == {"value": None, "interval": None, "unit": "m"}
    limit = found["limits"]["damping"]["below"]
    assert limit["0.05"]["change"] == limit["0.95"]["change"] == "rises above"
    assert limit["0.95"]["value"] == pytest.approx(EXISTENCE, rel=2 * ACCURACY)
    assert found["smallest_change"]["aim"] == "begin"
    assert found["smallest_change"]["value"] == pytest.approx(EXISTENCE - 1, rel=2 * ACCURACY)
    (row,) = change_rows(found)
    assert (row.name, row.now, row.needed, row.change) == ("less damping, D", "1", "0.324", "÷ 3.1")
    assert "practically excluded (0 % [0, 5])" in found["summary"][0]
    assert "begins stick-slip is -68 %" in found["summary"][2]


@pytest.mark.slow
def test_mass_spring_and_load_in_proportion_scale_their_limits_alone(answered):
    """The scaled equation has N / (m omega^2), V, D and omega: with twice the mass and load at one omega all runs are
    the same to the bit, as the factor is a power of two. The damper doubles with D."""
    one, two = (
        answered(0.03, answer.VARIED, mass_kg=factor, normal_force_n=factor * 2500, damping_ratio=0.3)
        for factor in (1.0, 2.0)
    )
    for key in ("probability", "probability_from_sliding", "amplitude", "frequency", "frequency_scatter"):
        assert one[key] == two[key]
    for name, factor in {"damping": 1, "belt_velocity": 1, "mass": 2, "stiffness": 2, "load": 2}.items():
        for side in ("below", "above"):
            for label in ("0.05", "0.95"):
                small, large = (found["limits"][name][side][label] for found in (one, two))
                assert (small is None) == (large is None)
                if small is not None:
                    assert large["value"] == pytest.approx(factor * small["value"], rel=1e-9)
                    assert large["change"] == small["change"]
    assert one["limits"]["load"]["below"]["0.05"]["value"] < 2500
    assert one["decides"]["by"] == "scatter"


def test_an_excited_mass_has_no_answer(answered):
    found = answered(0.03, excitation_force_n=10.0)
    assert found["given"] is False
    assert found["summary"] == [f"Stick-slip: no answer, because {found['reason']}."]
