"""What the comparison with public records measures, and that its kept files follow from the kept laws."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from workflow import against_measurement as of

PUBLIC = Path(__file__).parents[3] / "shared" / "data" / "paper-on-paper"
WITH_RECORDS = pytest.mark.skipif(not PUBLIC.is_dir(), reason="the public records are not here")


def kept(name):
    return json.loads((of.KEPT / f"{name}.json").read_text())


def test_teeth_of_a_saw_on_a_slow_wave_are_those_it_was_made_of():
    """Rises of 0.9 s and falls of 0.1 s by 0.05, to the interval of the samples."""
    time = np.arange(10_000) * 0.02
    saw = np.interp(time % 1.0, [0.0, 0.9, 1.0], [0.0, 0.05, 0.0])
    teeth = of.teeth_of(saw + 0.1 * np.sin(2 * math.pi * time / 93.0), 42)
    assert teeth.height.size == pytest.approx(198, abs=2)
    assert [column.mean() for column in teeth] == pytest.approx([0.9, 0.1, 0.05], rel=0.02)
    assert teeth.statistics()[5] == pytest.approx(math.log(0.05 / 0.9), abs=0.02)


def test_friction_of_a_synthetic_record_rises_as_the_drive_loads_the_spring():
    """By k v / N at most, and near it where the slider sticks."""
    law = of.Law(0.018, 0.25, 0.03, 1e-4, 3e-4, 1e-5, 0.05, 1e-5)
    made = of.synthetic(law, of.FIRST, 42, 0.3, 3000, [1])
    slope = math.exp(of.teeth_of(made, 42).statistics()[5])
    assert 0.8 < slope / (of.FIRST * 42e-6 / 0.25) <= 1.0
    assert made.mean() == pytest.approx(0.3, abs=0.02)


@WITH_RECORDS
def test_what_is_kept_of_the_records_follows_from_them():
    assert of.measured(str(PUBLIC)) == kept("measured")


@WITH_RECORDS
@pytest.mark.slow
@pytest.mark.parametrize("kind", of.KINDS)
def test_kept_predictions_are_of_the_kept_laws(kind, monkeypatch):
    monkeypatch.setattr(of, "RECORDS", ((1002, 4300),))
    found = of.predicted(str(PUBLIC), np.array(kept(f"law_{kind}")["draws"]))["k1002_v4300"]
    np.testing.assert_allclose(found, kept(f"predicted_{kind}")["k1002_v4300"], rtol=1e-6)
