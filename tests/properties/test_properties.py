"""Some problems of each subject are judged as `make stress` judges thousands."""

import pytest

from tests.properties.campaign import CAMPAIGNS, SEED, row_of

FEW, MORE = (
    {"scenes": 0, "machines": 0, "oscillator": 6, "contact": 40, "chaos": 24, "surface": 80, "friction": 6},
    {"scenes": 8, "machines": 12},
)


def wrong_of(stage: str, numbers: range) -> list[dict]:
    return [row for number in numbers if "why" in (row := row_of(stage, SEED, number))]


@pytest.mark.parametrize("stage", [stage for stage in CAMPAIGNS if FEW[stage]])
def test_a_few_problems_have_right_answers(stage):
    assert wrong_of(stage, range(FEW[stage])) == []


@pytest.mark.slow
@pytest.mark.parametrize("stage", [stage for stage in CAMPAIGNS if FEW[stage] < 40])
def test_more_problems_have_right_answers(stage):
    assert wrong_of(stage, range(FEW[stage], MORE.get(stage, 40))) == []
