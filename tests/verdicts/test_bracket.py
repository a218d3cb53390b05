"""Ends of ranges against functions whose change is known."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roughslip.errors import ParameterError
from roughslip.verdicts.bracket import ACCURACY, REACH, STEPS, end


@settings(derandomize=True, max_examples=60)
@given(st.floats(0.01, 100.0), st.floats(1.001, 9.99), st.booleans())
def test_an_end_is_found_from_both_sides_to_the_stated_accuracy(start, factor, upwards):
    """The answer is another from a known value on: it stays at the one number of the end, and not at the other."""
    place = start * factor if upwards else start / factor

    def answer(value):
        return (value < place) if upwards else (value > place)

    found = end(answer, start, start * REACH if upwards else start / REACH)
    assert answer(found.stands)
    assert not answer(found.changes)
    for number in (found.stands, found.changes):
        assert number == pytest.approx(place, rel=ACCURACY)
    assert min(found.stands, found.changes) <= place <= max(found.stands, found.changes)


def test_an_answer_that_never_changes_stands_to_the_end_of_the_search():
    found = end(lambda value: "same", 2.0, 20.0)
    assert (found.stands, found.changes) == (pytest.approx(20.0, rel=1e-12), None)


@pytest.mark.parametrize("reach", [10.0, 0.1])
def test_where_nothing_can_be_told_lies_between_the_two_numbers(reach):
    """Known up to a factor of 2, another from 5 on, and nothing in between."""

    def answer(value):
        factor = max(value, 1.0 / value)
        return "a" if factor < 2.0 else None if factor < 5.0 else "b"

    found = end(answer, 1.0, reach)
    assert max(found.stands, 1.0 / found.stands) == pytest.approx(2.0, rel=2 * ACCURACY)
    assert max(found.changes, 1.0 / found.changes) == pytest.approx(5.0, rel=2 * ACCURACY)
    assert (answer(found.stands), answer(found.changes)) == ("a", "b")


def test_what_comes_back_beyond_a_gap_is_not_taken_for_known():
    found = end(lambda value: None if 2.0 < value < 3.0 else "a", 1.0, 10.0)
    assert (found.stands, found.changes) == (pytest.approx(2.0, rel=2 * ACCURACY), None)


def test_the_work_is_a_step_in_the_walk_and_a_bit_in_the_bisection():
    calls = []
    end(lambda value: calls.append(value) or value < 3.0, 1.0, REACH)
    step = REACH ** (1.0 / STEPS) - 1.0
    assert len(calls) <= 1 + STEPS + 2 * math.ceil(math.log2(step / ACCURACY) + 1.0)


@pytest.mark.parametrize(("start", "reach"), [(0.0, 1.0), (1.0, 0.0), (-1.0, 1.0), (1.0, math.inf), (math.nan, 1.0)])
def test_a_range_lies_between_finite_positive_numbers(start, reach):
    with pytest.raises(ParameterError, match="finite positive"):
        end(lambda value: True, start, reach)


def test_no_range_begins_where_nothing_is_known():
    with pytest.raises(ParameterError, match="cannot be told"):
        end(lambda value: None, 1.0, 10.0)
