"""Numbers of `--config`: taken whole, or told in a line each."""

from __future__ import annotations

import pytest

from roughslip.errors import InputError
from workflow.study.options import whole_numbers


def test_what_is_not_given_is_none():
    assert whole_numbers({"memory_mb": 4000, "seed": "today"}) == {
        "memory_mb": 4000,
        "problems": None,
        "reference_surfaces": None,
        "reference_strips": None,
    }


@pytest.mark.parametrize("value", ["abc", [1], 0, -3, 1e9, True, None, {"a": 1}])
def test_what_is_no_whole_number_is_told(value):
    with pytest.raises(InputError) as caught:
        whole_numbers({"memory_mb": value, "problems": 0})
    assert [line.partition(":")[0] for line in caught.value.lines] == ["--config memory_mb", "--config problems"]
    assert all(line.endswith(" is not allowed; a whole number from 1") for line in caught.value.lines)
