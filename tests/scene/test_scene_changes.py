"""Any change at all of a scene file loads or is told."""

import copy
import math
import re

import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from roughslip.errors import InputError
from tests.scene.shipped import PAPER, PAPER_TEXT


def leaves(value: object, path: tuple = ()) -> list[tuple]:
    if isinstance(value, dict | list) and value:
        items = value.items() if isinstance(value, dict) else enumerate(value)
        return [leaf for key, item in items for leaf in leaves(item, (*path, key))]
    return [path]


ANYTHING = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.sampled_from([0, 1, 49, 50, 4000, 1e-320, 1e308, 10**400, "1e9", "gaussian", "paper", "\ud800", "\x85"]),
    st.text(max_size=8),
    st.lists(st.one_of(st.integers(), st.floats(), st.text(max_size=3), st.none()), max_size=4),
    st.dictionaries(st.text(max_size=5), st.integers(), max_size=2),
)
FUZZ = settings(
    derandomize=True, deadline=None, max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture]
)


def check_loads_or_tells(mine, content: str | bytes) -> None:
    try:
        scene = mine(content)
    except InputError as error:
        lines = error.lines
    else:
        assert all(math.isfinite(value) for value in numbers_in(scene))
        return
    assert lines
    assert all(re.match(r"scenes/mine\.yaml: \S", line) and len(line.splitlines()) == 1 for line in lines)


def numbers_in(value: object):
    items = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    for item in items:
        yield from numbers_in(item)
    if isinstance(value, int | float):
        yield value


@FUZZ
@given(st.sampled_from(leaves(PAPER)), st.one_of(st.just(...), ANYTHING))
def test_any_changed_value_loads_or_is_told(mine, path, value):
    scene = copy.deepcopy(PAPER)
    inner = scene
    for key in path[:-1]:
        inner = inner[key]
    if value is ...:
        del inner[path[-1]]
    else:
        inner[path[-1]] = value
    check_loads_or_tells(mine, yaml.safe_dump(scene))


@settings(FUZZ)
@given(
    st.integers(0, len(PAPER_TEXT)),
    st.one_of(st.binary(max_size=6), st.text(":{}[]&*!'\"\\#\n\t -?|>%@0e", max_size=6)),
)
def test_any_text_loads_or_is_told(mine, place, text):
    inserted = text if isinstance(text, bytes) else text.encode()
    check_loads_or_tells(mine, PAPER_TEXT[:place].encode() + inserted + PAPER_TEXT[place:].encode())
