"""Some problems of each subject are judged as `make stress` judges thousands; and a judge sees wrong science."""

import pytest

from roughslip.contact import influence
from tests.properties.campaign import CAMPAIGNS, SEED, row_of

FEW, MORE = {"oscillator": 6, "contact": 80, "chaos": 24, "surface": 80, "friction": 6}, 40


def wrong_of(stage: str, numbers: range) -> list[dict]:
    return [row for number in numbers if "why" in (row := row_of(stage, SEED, number))]


@pytest.mark.parametrize("stage", CAMPAIGNS)
def test_a_few_problems_have_right_answers(stage):
    assert wrong_of(stage, range(FEW[stage])) == []


@pytest.mark.slow
@pytest.mark.parametrize("stage", [stage for stage in CAMPAIGNS if FEW[stage] < MORE])
def test_more_problems_have_right_answers(stage):
    assert wrong_of(stage, range(FEW[stage], MORE)) == []


@pytest.mark.parametrize("wrong", [0.0, 1e-8])
def test_wrong_science_is_a_false_claim(wrong, monkeypatch):
    """Love's coefficients too large by 1e-8."""
    love = influence.love_coefficients
    monkeypatch.setattr(influence, "love_coefficients", lambda *given: (1 + wrong) * love(*given))
    row = row_of("contact", SEED, 1)
    assert (row["outcome"], "why" in row) == (("false claim", True) if wrong else ("converged", False))
