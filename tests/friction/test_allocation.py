"""Numbers of strips for an accuracy asked: variances of Gaussian windows, the least cost, and refusals."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from roughslip.errors import IllPosedError
from roughslip.friction.allocation import (
    COARSE_MUST_SAVE,
    ErrorSources,
    Option,
    SampleLimits,
    allocate,
    cheapest,
    error_sources,
    half_width,
    influences,
    strip_pilot,
)
from roughslip.friction.combination import ORDERS
from roughslip.friction.level import Level, levels_of
from roughslip.probability.estimate import CHANCE

RHO, SCATTER, WINDOWS = 0.95, 0.1, 25
PERCENTILES = np.array([5.0, 20.0, 50.0])
ASKED = {"friction_mean": 0.01, "friction_std": 0.03}
FACTORS = {name: [1 / (2**order - 1) for order in ORDERS[name]] for name in ("mean", "std")}  # f at both orders
OPEN, MIDDLE = {name: (high - low) / 2 for name, (high, low) in FACTORS.items()}, sum(FACTORS["mean"]) / 2
WIDE = SampleLimits((8, 10_000), (1, 1_000_000), (0.3, 0.01), 1e9)


def truth(statistic: str, slope: float = 1.0) -> tuple[float, float]:
    """A and D of one strip. slope : c, if the extrapolation takes the influence on log mean times c.

    log std has the variance 1 / (2 W), and log mean s^2 / W, from two independent levels: its own and the median.
    """
    of_mean = SCATTER**2 / WINDOWS
    left, explained = slope**2 * (1 - RHO**2) + (slope - 1) ** 2 * RHO**2, (2 * slope - 1) * RHO**2
    if statistic == "friction_mean":
        return 2 * of_mean * left, 2 * of_mean * explained
    return (1 - RHO**4) / (2 * WINDOWS) + of_mean * left, RHO**4 / (2 * WINDOWS) + of_mean * explained


def pilot(strips: int, others: int, *seed: int) -> tuple[list, list]:
    """Levels of independent Gaussian windows 1 + 0.1 n, and a control of another mean and scale, correlation RHO."""
    rng, solved, control = np.random.default_rng([21, *seed]), [], []
    for _ in PERCENTILES:
        seen, own = rng.standard_normal((strips + others, WINDOWS)), rng.standard_normal((strips, WINDOWS))
        mu = 1.0 + SCATTER * (RHO * seen[:strips] + math.sqrt(1 - RHO**2) * own)
        solved.append((mu, np.ones(mu.shape, bool)))
        control.append((2.5 + 0.25 * seen, np.ones(seen.shape, bool)))
    return solved, control


def levels(*windows: list) -> tuple[Level, ...]:
    """From (mu, valid) at each penetration, solved, of the control and on cells 2h."""
    return levels_of(*((np.stack([mu for mu, _ in each]), np.stack([valid for _, valid in each])) for each in windows))


@pytest.mark.parametrize("wider", [1.0, 1.4])
def test_a_pilot_shows_what_gaussian_windows_leave(wider: float):
    """Of 4000 strips a variance is known to sqrt(2 / 4000), and those of squares of 25 windows about as well.

    Cells 2h show `wider` times the deviations: the extrapolation, a part f of the change, then takes some of them off.
    """
    solved, control = pilot(4000, 4000)
    coarse = [(1.0 + wider * (mu - 1.0), valid) for mu, valid in solved]
    sources = error_sources(PERCENTILES, levels(solved, control, coarse))
    # below 20 % nothing is asked, and the mean at the median is exact by calibration
    names = [(20.0, "friction_mean"), (20.0, "friction_std"), (50.0, "friction_std")]
    assert [(one.percentile, one.statistic) for one in sources] == names
    for one in sources:
        without = one.solved / one.safety[0], one.control / one.safety[1]
        exact = truth(one.statistic, 1.0 + MIDDLE * (1.0 - wider))
        assert without == pytest.approx(exact, rel=5 * math.sqrt(2 / 4000))


@pytest.mark.parametrize("others", [1, 8])
def test_strips_on_coarse_cells_alone_take_their_share_of_the_variance(others: int):
    """Windows z on cells 2h of correlation RHO with the control, windows h of correlation c with z, all Gaussian.

    g = (1 + m) h - m z with the middle m of f, and alpha = c / (1 + (1 - RHO^2) / k). So g - alpha z leaves
    ((1 + m) c - m - alpha)^2 + (1 + m)^2 (1 - c^2) of the variance. Influences on log std correlate by c^2 and RHO^2.
    """
    rng, c, strips = np.random.default_rng(31), 0.98, 4000
    solved, coarse, control = [], [], []
    for _ in PERCENTILES:
        seen, own, fine = rng.standard_normal((3, strips, WINDOWS))
        half = RHO * seen + math.sqrt(1 - RHO**2) * own
        values = c * half + math.sqrt(1 - c**2) * fine
        for tables, part in ((solved, values), (coarse, half), (control, 2.0 * seen)):
            tables.append((1.0 + SCATTER * part, np.ones(part.shape, bool)))
    parts = {}
    for statistic, power in (("mean", 1), ("std", 2)):
        m = sum(1 / (2**order - 1) for order in ORDERS[statistic]) / 2
        of_half, seen = c**power, RHO**power
        alpha = of_half / (1 + (1 - seen**2) / others)
        left = ((1 + m) * of_half - m - alpha) ** 2 + (1 + m) ** 2 * (1 - of_half**2)
        parts[statistic] = np.array([left + alpha**2 * (1 - seen**2) / others, alpha**2 * seen**2])
    of_mean = SCATTER**2 / WINDOWS * parts["mean"]
    exact = {"friction_mean": 2 * of_mean, "friction_std": parts["std"] / (2 * WINDOWS) + of_mean}
    for one in error_sources(PERCENTILES, levels(solved, control, coarse), others):
        without = one.solved / one.safety[0], one.control / one.safety[1]
        assert without == pytest.approx(exact[one.statistic], rel=5 * math.sqrt(2 / strips))


def test_other_strips_are_taken_where_they_save_a_quarter_of_the_cost():
    """Solved strips alone cost up to COARSE_MUST_SAVE more."""
    plain, many = ErrorSources(50.0, "friction_std", 0.02, 0.1), ErrorSources(50.0, "friction_std", 0.01, 0.1)
    alone = allocate([plain], ASKED, WIDE)
    options = [Option(0, [plain], WIDE), Option(4, [many], WIDE)]
    with_others = allocate([many], ASKED, WIDE)
    assert alone.cost > (1 + COARSE_MUST_SAVE) * with_others.cost
    assert cheapest(options, ASKED) == (options[1], with_others)
    dearer = replace(WIDE, costs=(1.5 * WIDE.costs[0], WIDE.costs[1]))
    options[1] = replace(options[1], limits=dearer)
    assert (
        allocate([many], ASKED, dearer).cost
        < alone.cost
        < (1 + COARSE_MUST_SAVE) * allocate([many], ASKED, dearer).cost
    )
    assert cheapest(options, ASKED) == (options[0], alone)


def test_influences_are_what_a_strip_adds_where_some_windows_do_not_touch():
    """Of the logarithms of mean and deviation: their mean is zero, and a strip counted twice moves both by its S-th."""
    rng = np.random.default_rng(3)
    mu, valid = rng.normal(0.3, 0.05, (400, 6)), rng.random((400, 6)) < 0.6
    change = influences(mu, valid)
    assert np.abs(change.mean(axis=0)).max() < 1e-12
    for strip in (0, 7):
        twice, also = np.concatenate((mu, mu[[strip]])), np.concatenate((valid, valid[[strip]]))
        moved = [math.log(of(twice[also]) / of(mu[valid])) for of in (np.mean, np.std)]
        assert moved == pytest.approx(change[strip] / 400, abs=3e-5)
    assert np.isfinite(influences(mu, valid & (np.arange(400) < 2)[:, None])).all()
    with pytest.raises(IllPosedError, match="fewer than 2 of 400"):
        influences(mu, valid & (np.arange(400) < 1)[:, None])


def test_the_order_of_the_mesh_error_is_left_open():
    """Cells 2h read mu 3 % higher than cells h at one level, and 1 % at the median. Half the range of f stays open."""
    solved, control = pilot(24, 200)
    coarse = [(factor * mu, valid) for factor, (mu, valid) in zip((1.0, 1.03, 1.01), solved, strict=True)]
    mean, std, std_median = error_sources(PERCENTILES, levels(solved, control, coarse))
    assert mean.mesh == (pytest.approx(math.log(1.03 / 1.01) * OPEN["mean"]), 0.0)
    assert std.mesh == (pytest.approx(math.log(1.03) * OPEN["std"]), pytest.approx(math.log(1.01) * OPEN["mean"]))
    assert std_median.mesh == tuple(pytest.approx(math.log(1.01) * OPEN[name]) for name in ("std", "mean"))


def test_the_half_width_of_normal_and_uniform_parts():
    """Of one uniform part 95 % of its half width; of two equal ones, a triangle, 2 w (1 - sqrt(0.05))."""
    assert half_width(0.02, (0.0, 0.0)) == pytest.approx(0.02 * 1.959964, rel=1e-6)
    assert half_width(0.0, (0.01, 0.0)) == pytest.approx(0.0095, rel=1e-3)
    assert half_width(0.0, (0.01, 0.01)) == pytest.approx(0.02 * (1 - math.sqrt(0.05)), rel=0.01)
    drawn = np.random.default_rng(22).standard_normal(400_000) * 0.01
    drawn += np.random.default_rng(23).uniform(-0.02, 0.02, 400_000)
    assert half_width(0.01, (0.02, 0.0)) == pytest.approx(np.quantile(np.abs(drawn), 0.95), rel=0.01)


def test_one_statistic_has_the_numbers_of_neyman():
    """n = sqrt(A / c_n) (sqrt(A c_n) + sqrt(D c_N)) / v, N in the same way, and the half width is as asked.

    The margin for few strips takes 1.3 % of the half width, and 1.3 % / 2 of it moves from N to n.
    """
    one, asked = ErrorSources(50.0, "friction_std", *truth("friction_std")), 0.007
    chosen = allocate([one], {"friction_std": asked}, WIDE)
    roots = [math.sqrt(part * cost) for part, cost in zip(truth("friction_std"), WIDE.costs, strict=True)]
    allowed = (asked / 1.959964 / one.margin(chosen.strips)) ** 2
    n, many = (root / cost * sum(roots) / allowed for root, cost in zip(roots, WIDE.costs, strict=True))
    assert (chosen.strips, chosen.many) == (pytest.approx(n, rel=0.02), pytest.approx(many, rel=0.03))
    assert one.half_width(chosen.strips, chosen.many) == pytest.approx(asked, rel=0.001)
    assert one.half_width(chosen.strips, chosen.many) <= asked
    assert chosen.cost == pytest.approx(sum(roots) ** 2 / allowed, rel=0.001)


def test_an_interval_that_few_strips_widen_still_keeps_what_is_asked():
    """Also with the mesh's part, between the points where the allowed variance is solved for; little is to spare."""
    for asked, mesh in itertools.product(np.geomspace(0.02, 0.3, 12), (0.0, 0.015)):
        one = ErrorSources(50.0, "friction_std", 0.02, 0.1, (mesh, mesh / 3))
        chosen = allocate([one], {"friction_std": asked}, WIDE)
        reached = one.half_width(chosen.strips, chosen.many)
        assert reached <= asked
        assert reached >= 0.98 * asked or chosen.many == WIDE.minimum * chosen.strips


def test_no_neighbour_is_cheaper_and_numbers_given_by_hand_are_kept():
    errors = error_sources(PERCENTILES, levels(*pilot(24, 200)))
    chosen = allocate(errors, ASKED, WIDE)
    for strips, many in itertools.product((-1, 0, 1), (-20, -1, 0, 1, 20)):
        n, others = chosen.strips + strips, chosen.many + many
        enough = all(one.half_width(n, others) <= ASKED[one.statistic] for one in errors)
        assert not enough or 0.3 * n + 0.01 * others >= chosen.cost - 1e-9
    by_hand = allocate(errors, ASKED, SampleLimits((2 * chosen.strips,) * 2, WIDE.many, WIDE.costs, WIDE.limit))
    assert by_hand.strips == 2 * chosen.strips
    assert by_hand.many >= 2 * by_hand.strips
    by_hand = allocate(errors, ASKED, SampleLimits(WIDE.strips, (3 * chosen.many,) * 2, WIDE.costs, WIDE.limit))
    assert by_hand.many == 3 * chosen.many
    assert by_hand.strips < chosen.strips


@pytest.mark.slow
def test_a_pilot_of_24_strips_seldom_asks_for_too_few():
    """One statistic: the true half width at the numbers chosen exceeds what is asked with a probability of CHANCE.

    200 pilots count 20 of these, +- 2.6 standard deviations, and the share is somewhat less, as D is allowed for too.
    On average the margin costs what the quantile of chi-square says, 1.55 of the variance.
    """
    exact, exceeded, used = ErrorSources(20.0, "friction_mean", *truth("friction_mean")), 0, []
    for number in range(200):
        errors = error_sources(PERCENTILES, levels(*pilot(24, 200, number)))[:1]
        chosen = allocate(errors, ASKED, WIDE)
        width = exact.half_width(chosen.strips, chosen.many)
        exceeded += width > ASKED["friction_mean"]
        used.append((ASKED["friction_mean"] / width) ** 2)
    assert exceeded <= 200 * CHANCE + 2.6 * math.sqrt(200 * CHANCE * (1 - CHANCE))
    assert 1.1 < np.mean(used) < 1.6


def test_an_accuracy_out_of_reach_has_a_nearest_one():
    errors, half = (
        error_sources(PERCENTILES, levels(*pilot(24, 200))),
        {name: value / 2 for name, value in ASKED.items()},
    )
    full = allocate(errors, half, WIDE)
    short = SampleLimits(WIDE.strips, WIDE.many, WIDE.costs, full.cost / 4)
    assert allocate(errors, half, short) is None
    near = strip_pilot([Option(0, errors, short)], half, 1e-6).nearest()
    assert allocate(errors, near, short) is not None
    assert allocate(errors, {name: 0.98 * value for name, value in near.items()}, short) is None
    # a quarter of the cost doubles the half width, and fewer strips widen it
    strips = full.strips, allocate(errors, near, short).strips
    wider = np.divide(*(errors[1].margin(each) for each in strips[::-1]))
    assert errors[1].statistic == "friction_std"
    assert near["friction_std"] == pytest.approx(ASKED["friction_std"] * wider, rel=0.03)
    assert near["friction_mean"] / near["friction_std"] == pytest.approx(1 / 3, rel=0.01)
    rough = [ErrorSources(20.0, "friction_mean", 1e-4, 1e-4, (0.04, 0.0))]  # of the mesh alone 0.038
    assert allocate(rough, ASKED, WIDE) is None
    by_mesh = strip_pilot([Option(0, rough, WIDE)], ASKED, 1e-6)
    assert by_mesh.nearest()["friction_mean"] == pytest.approx(0.038, rel=0.02)
    with pytest.raises(IllPosedError, match=r"take strip.cell_m = 5e-07 or less, as the mesh alone leaves 0.038 of"):
        by_mesh.numbers()
    nothing = Option(0, errors, SampleLimits(WIDE.strips, WIDE.many, WIDE.costs, 1e-3))
    with pytest.raises(IllPosedError, match=r"nor is any other; raise accuracy.cost_limit_cpu_s to"):
        strip_pilot([nothing], ASKED, 1e-6).numbers()
