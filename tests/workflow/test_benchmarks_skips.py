"""The benchmark of skips: results without what was left out, every skip that costs tell, stages not needed."""

import json
import sys

import pytest

from roughslip.figures.style import save
from roughslip.stages.runtime import skip_reasons
from workflow.benchmarks import skips, skips_contact, skips_figure
from workflow.benchmarks.measure import OURS, fields

# Skips of results that are not the same without them, but as good: columns of a lattice and windows of the control are
# left out of what only lowers the variance; and of pilot ensembles, which stop as the training does.
ELSEWHERE = {
    skip_reasons.SMOOTH,
    skip_reasons.CONTROL,
    skip_reasons.TURNED,
    skip_reasons.ENOUGH_PATHS,
    skip_reasons.ENOUGH_NODES,
}


@pytest.fixture(scope="module")
def benchmark(tmp_path_factory):
    path = tmp_path_factory.mktemp("skips") / "skips.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["skips", "--quick", "--output", str(path)])
        skips.main()
    return json.loads(path.read_text())


def test_results_are_the_same_without_what_was_left_out(benchmark):
    by_case = {}
    for row in benchmark["rows"]:
        by_case.setdefault(row["case"], {})[row["method"]] = row
    for name, methods in by_case.items():
        assert set(methods) == {OURS, skips.PLAIN}, name
        assert methods[OURS]["error"] <= float(fields(name)["tolerance"]), name
    assert benchmark["summary"]["unchanged"]
    assert len(benchmark["summary"]["times_as_fast"]) == len(by_case)


def test_less_is_computed(benchmark):
    """By the count of work, as times are another matter; equal where the work left out is of another kind."""
    work = {}
    for row in benchmark["rows"]:
        work.setdefault(fields(row["case"])["skip"].replace("-", " "), {})[row["method"]] = row["work"]
    less = (
        skip_reasons.NO_CONTACT,
        skip_reasons.CROPPED,
        skip_reasons.WARM,
        skip_reasons.NESTED,
        skip_reasons.SYMMETRIC,
    )
    for name in (*less, skip_reasons.ENOUGH_SOLVES, skip_reasons.BY_PERIOD):
        assert work[name][OURS] < work[name][skips.PLAIN], name
    assert work[skip_reasons.SYMMETRIC] == {OURS: 75, skips.PLAIN: 165}


def test_every_kind_of_skip_is_measured(benchmark):
    told = {name for name, value in vars(skip_reasons).items() if name.isupper() and isinstance(value, str)}
    told = {getattr(skip_reasons, name) for name in told} - ELSEWHERE
    measured = {fields(row["case"])["skip"] for row in benchmark["rows"]}
    assert measured == {name.replace(" ", "-") for name in told | {skips_contact.ROWS}}


def test_stages_that_a_scene_does_without():
    """What they took in scenes that have them: strips and friction are given to `given`, `paper` asks for no field."""
    costs = {
        "one": [{"stage": "contact_strip", "cpu_seconds": 100.0}, {"stage": "oscillator", "cpu_seconds": 7.0}],
        "other": [{"stage": "field_square", "cpu_seconds": 20.0}, {"stage": "all", "cpu_seconds": 127.0}],
    }
    found = skips.spared_stages(costs)
    assert found["given"]["stages"]["contact_strip"] == {"cpu_seconds": 100.0, "why": "friction.statistics is given"}
    assert found["given"]["cpu_seconds"] == 120.0
    assert found["paper"]["cpu_seconds"] == 20.0


def test_it_is_drawn(benchmark, tmp_path):
    save(skips_figure.figure(benchmark["rows"]), tmp_path / "skips.png")
    assert (tmp_path / "skips.png").stat().st_size > 10_000
