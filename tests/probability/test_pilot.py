"""Numbers for an accuracy, and the nearest one that is reached: half widths b + c / sqrt(n) in closed form."""

import math

import pytest

from roughslip.errors import IllPosedError
from roughslip.probability.pilot import Pilot

FIXED, SCATTER, MOST = (
    {"friction_mean": 0.01, "friction_std": 0.02},
    {"friction_mean": 1.0, "friction_std": 3.0},
    40_000,
)


def cheapest(asked):
    """The least n with b + c / sqrt(n) <= a for both, at most MOST."""
    if any(asked[name] <= FIXED[name] for name in FIXED):
        return None
    needed = max(math.ceil((SCATTER[name] / (asked[name] - FIXED[name])) ** 2) for name in FIXED)
    return needed if needed <= MOST else None


def pilot(mean, std, **options):
    return Pilot({"friction_mean": mean, "friction_std": std}, cheapest, lambda: "take finer cells", **options)


def test_the_cheapest_numbers_keep_every_half_width():
    """The standard deviation decides: (3 / 0.08)^2."""
    assert pilot(0.05, 0.1).numbers() == 1407


@pytest.mark.parametrize(("mean", "std", "binding"), [(0.01, 0.1, 1.5), (0.05, 0.007, 5.0)])
def test_what_is_out_of_reach_has_a_nearest_accuracy_in_the_same_ratio(mean, std, binding):
    """At MOST the half widths are 0.01 + 1 / 200 and 0.02 + 3 / 200: 1.5 or 5 times what is asked, to 1 %."""
    near = pilot(mean, std).nearest()
    assert near["friction_mean"] / mean == pytest.approx(near["friction_std"] / std, rel=0.01)
    assert binding <= near["friction_mean"] / mean <= 1.011 * binding
    assert cheapest(near) is not None
    with pytest.raises(IllPosedError) as refused:
        pilot(mean, std).numbers()
    wanted, reached = (
        f"{{friction_mean: {first:g}, friction_std: {second:g}}}" for first, second in ((mean, std), near.values())
    )
    assert str(refused.value) == (
        f"accuracy: {wanted} is not reached; nearest is {reached}; ask for that, or take finer cells"
    )
    wider = pilot(mean, std, margin=1.1).nearest()
    assert wider["friction_mean"] == pytest.approx(1.1 * near["friction_mean"], rel=0.01)


def test_the_nearest_accuracy_is_one_that_a_scene_may_ask_for():
    """0.035 of a standard deviation asked as 0.001 widens the mean to 0.35, and asked as 0.0001 beyond 0.5."""
    assert pilot(0.01, 0.001).nearest()["friction_mean"] == pytest.approx(0.35, rel=0.01)
    assert pilot(0.01, 0.0001).nearest() is None
    with pytest.raises(IllPosedError, match="is not reached, nor is any other; take finer cells"):
        pilot(0.01, 0.0001).numbers()
