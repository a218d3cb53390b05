"""How many variables: the number that a known response has, no more where directions do not pay, errors that say so."""

from dataclasses import replace

import numpy as np
import pytest

from roughslip.chaos import selection
from roughslip.chaos.local import GROUPS, Samples, fit_best, fit_local
from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.selection import fit_count, regressed, turned
from roughslip.errors import IllPosedError, ParameterError

TARGET = PressureTarget("trial_pressure", 2.0)
GIVEN, CANDIDATES, DEGREE = 4, 9, 2
HIDDEN = np.array([0.0, 0.6, 0.0, -0.8, 0.0])  # of the five candidates behind the given ones


def two(u):
    return 0.2 + u[..., 0] + 0.5 * u[..., 1] + 0.3 * u[..., 0] * u[..., 1]


RESPONSES = {
    2: two,
    4: lambda u: two(u) + 0.4 * u[..., 2] - 0.3 * u[..., 3],
    5: lambda u: two(u) + 0.5 * u[..., 3] + 0.5 * u[..., GIVEN:] @ HIDDEN,
    6: lambda u: two(u) + 0.5 * u[..., 0] * (u[..., GIVEN:] @ HIDDEN) + 0.5 * (u[..., GIVEN] ** 2 - 1),
}


def solved(number, seed=0, count=600):
    """Two nodes of a surface share half the variance of their candidates."""
    generator = np.random.default_rng([17, seed])
    u = generator.standard_normal((count, 2, CANDIDATES)) + generator.standard_normal((count, 1, CANDIDATES))
    u /= np.sqrt(2)
    r = RESPONSES[number](u) + 0.3 * generator.standard_normal((count, 2))
    return Samples(u, np.zeros(2), np.maximum(r, 0), np.maximum(-r, 0) / TARGET.gap_stiffness)


@pytest.fixture(autouse=True)
def counts(monkeypatch):
    monkeypatch.setattr(selection, "COUNTS", (2, 4, 5, 6))


@pytest.mark.parametrize("number", RESPONSES)
def test_the_number_is_that_of_the_response(number):
    """What is left out is as strong as the noise or stronger, so that scores differ by many standard errors."""
    samples = solved(number)
    chosen = fit_count(samples, GIVEN, None, DEGREE, [TARGET])
    assert len(chosen.rotation) == number == chosen.samples.variables.shape[2] == chosen.expansion.indices.shape[1]
    np.testing.assert_allclose(chosen.rotation @ chosen.rotation.T, np.eye(number), atol=1e-13)
    np.testing.assert_array_equal(chosen.samples.variables, samples.variables @ chosen.rotation.T)
    np.testing.assert_array_equal(chosen.rotation[:GIVEN], np.eye(CANDIDATES)[: min(number, GIVEN)])
    place = chosen.counts.index(number)
    assert chosen.scores[place] <= np.nanmin(chosen.scores) + chosen.errors[place]
    smaller = (chosen.scores - np.nanmin(chosen.scores) > chosen.errors)[:place]
    assert np.all(smaller)
    assert number < 5 or abs(chosen.rotation[4:, GIVEN:] @ HIDDEN).max() > 0.95


def test_the_expansion_is_that_of_its_variables():
    chosen = fit_count(solved(5), GIVEN, None, DEGREE, [TARGET])
    again = fit_local(chosen.samples, DEGREE, TARGET)
    np.testing.assert_array_equal(chosen.expansion.coefficients, again.coefficients)


@pytest.mark.parametrize(("more", "taken"), [(0.9, 2), (1.1, 4)])
def test_of_numbers_that_cannot_be_told_apart_the_least_is_taken(monkeypatch, more, taken):
    """Two variables that score worse than four by so many standard errors, though all scores scatter by far more."""
    generator = np.random.default_rng(3)
    common, difference = 5.0 + generator.standard_normal(GROUPS), 0.1 * generator.standard_normal(GROUPS)
    error = np.sqrt(GROUPS) * difference.std(ddof=1)
    shares = {4: common, 2: common + difference - difference.mean() + more * error / GROUPS}
    monkeypatch.setattr(selection, "COUNTS", (2, 4))
    fit = selection.fit_local

    def scored(samples, degree, target):
        return replace(fit(samples, degree, target), scores=shares[samples.variables.shape[2]])

    monkeypatch.setattr(selection, "fit_local", scored)
    monkeypatch.setattr(selection, "fit_best", lambda s, d, t: (scored(s, d, t[0]), {TARGET.kind: 0.0}))
    chosen = fit_count(solved(2, count=200), GIVEN, None, DEGREE, [TARGET])
    assert len(chosen.rotation) == taken
    assert chosen.scores[0] - chosen.scores[1] == pytest.approx(more * chosen.errors[0])


def test_left_out_halves_do_not_see_the_directions_of_their_own(monkeypatch):
    """Each half of the surfaces is scored in what was found on the other."""
    samples, seen = solved(5), []
    monkeypatch.setattr(selection, "COUNTS", (4, 5))
    offered = selection._offered

    def watched(samples, given, whole, surfaces):
        found = offered(samples, given, whole, surfaces)
        seen.append((surfaces, found))
        return found

    monkeypatch.setattr(selection, "_offered", watched)
    chosen = fit_count(samples, GIVEN, None, DEGREE, [TARGET])
    (_, (both, _)), (odd, (first, _)), (even, (second, _)) = seen
    assert set(odd % GROUPS % 2) == {1}
    assert set(even % GROUPS % 2) == {0}
    assert len(odd) + len(even) == len(samples.pressure)
    expected = np.empty(GROUPS)
    for part, found in ((0, first), (1, second)):
        rotation = np.vstack([np.eye(CANDIDATES)[:GIVEN], found[:1]])
        expected[part::2] = fit_local(turned(samples, rotation), DEGREE, TARGET).scores[part::2]
    assert chosen.scores[chosen.counts.index(5)] == pytest.approx(expected.sum(), rel=1e-13)
    np.testing.assert_array_equal(chosen.rotation[GIVEN:], both[:1])


def test_the_standard_error_is_that_of_the_difference_over_groups():
    chosen = fit_count(solved(4), GIVEN, None, DEGREE, [TARGET])
    fits = [fit_local(turned(solved(4), np.eye(CANDIDATES)[:n]), DEGREE, TARGET) for n in (2, 4)]
    more = GROUPS * (fits[0].scores - fits[1].scores)  # as if each group were the whole: their mean is the difference
    assert chosen.scores[:2] == pytest.approx([one.score for one in fits], rel=1e-13)
    assert chosen.errors[0] == pytest.approx(more.std(ddof=1) / np.sqrt(GROUPS), rel=1e-12)
    assert chosen.errors[1] == 0


def test_a_number_that_is_asked_for_is_taken():
    samples = solved(5)
    few = fit_count(samples, GIVEN, 3, DEGREE, [TARGET])
    best, scores = fit_best(
        Samples(samples.variables[..., :3], np.zeros(2), samples.pressure, samples.gap), 2, [TARGET]
    )
    np.testing.assert_array_equal(few.expansion.coefficients, best.coefficients)
    assert (few.counts, few.targets) == ((3,), scores)
    many = fit_count(samples, GIVEN, 5, DEGREE, [TARGET])
    assert abs(many.rotation[4, GIVEN:] @ HIDDEN) > 0.95
    assert many.expansion.score < 0.8 * few.expansion.score
    assert few.scores[0] == few.expansion.score


def test_more_than_stand_out_of_the_noise_are_refused():
    with pytest.raises(IllPosedError, match=r"7 variables were asked for, but beyond the first 4 only 1 directions"):
        fit_count(solved(5), GIVEN, 7, DEGREE, [TARGET])
    for given, count in ((0, 1), (CANDIDATES + 1, 1), (GIVEN, CANDIDATES + 1), (GIVEN, 0)):
        with pytest.raises(ParameterError, match="cannot be had"):
            fit_count(solved(5), given, count, DEGREE, [TARGET])


def test_few_samples_are_asked_for_few_variables():
    """15 terms of four variables take 75 samples, at two nodes of each surface; six of two take 30."""
    chosen = fit_count(solved(5, count=60), GIVEN, None, DEGREE, [TARGET])
    assert chosen.counts[:2] == (2, 4)
    assert max(chosen.counts) <= 5  # 21 terms, 105 of 120 samples
    with pytest.raises(IllPosedError, match="40 samples are too few"):
        fit_count(solved(5, count=20), GIVEN, None, 4, [TARGET])


def test_candidates_that_are_refused_leave_the_others(monkeypatch):
    fit = selection.fit_local

    def fussy(samples, degree, target):
        if samples.variables.shape[2] == 2:
            raise IllPosedError("no")
        return fit(samples, degree, target)

    monkeypatch.setattr(selection, "fit_local", fussy)
    chosen = fit_count(solved(2), GIVEN, None, DEGREE, [TARGET])
    assert np.isnan(chosen.scores[0])
    assert len(chosen.rotation) == 4


RIDGE = np.array([0.5, -0.3, 0.2, 0.1, 0.4, 0.0, 0.6, -0.2, 0.2236])  # of unit length to four digits


def ridge(seed=0, count=600, noise=0.05):
    """A response to one direction in all candidates, bent: a cubic that rises everywhere."""
    generator = np.random.default_rng([19, seed])
    u = generator.standard_normal((count, 2, CANDIDATES))
    t = u @ (RIDGE / np.linalg.norm(RIDGE))
    r = 0.2 + t + 0.1 * t**2 + 0.05 * t**3 + noise * generator.standard_normal(t.shape)
    return Samples(u, np.zeros(2), np.maximum(r, 0), np.maximum(-r, 0) / TARGET.gap_stiffness)


def test_the_regression_direction_comes_first_and_the_given_variables_after_it():
    """Of 1200 independent samples the slope errs in each of 8 other directions by the scatter of what is not linear,
    sqrt(2 0.1^2 + 6 0.05^2 + noise^2) = 0.19, over 1.15 sqrt(1200): a sine of 0.014 in all, chi with 8 degrees below
    5.2 / 2.8 times that with 99.9 %."""
    rotation = regressed(ridge(), GIVEN, TARGET)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(CANDIDATES), atol=1e-13)
    cosine = abs(rotation[0] @ RIDGE) / np.linalg.norm(RIDGE)
    assert np.sqrt(1 - cosine**2) < 0.026
    for row in range(1, GIVEN):  # each adds one given variable to what the rows before it span
        inside = np.vstack([rotation[: row + 1]])
        unit = np.eye(CANDIDATES)[row - 1]
        assert np.linalg.norm(unit - inside.T @ (inside @ unit)) < 1e-12


def test_one_direction_of_a_regression_does_what_all_given_variables_cannot():
    samples = ridge()
    alone = fit_count(samples, GIVEN, GIVEN, 3, [TARGET])
    first = fit_count(samples, GIVEN, 1, 3, [TARGET], regression=True)
    assert first.rotation.shape == (1, CANDIDATES)
    assert first.expansion.cross_validated < 0.02  # noise 0.05^2 of 1.2, and the sine above
    assert alone.expansion.cross_validated > 0.5  # four of nine components hold 0.39 of the direction's square
    np.testing.assert_allclose(first.samples.variables, samples.variables @ first.rotation.T, atol=1e-12)


def test_a_number_is_found_after_a_regression_too():
    chosen = fit_count(ridge(), GIVEN, None, 3, [TARGET], regression=True)
    assert len(chosen.rotation) == chosen.counts[0] == 2  # the least there is: one would do
    np.testing.assert_allclose(chosen.rotation @ chosen.rotation.T, np.eye(2), atol=1e-12)


def test_directions_are_never_found_at_copies_of_the_surfaces_they_are_scored_at(monkeypatch):
    once = solved(6, count=300)
    again = np.random.default_rng(20).permutation(np.tile(np.arange(300), 2))
    samples = Samples(once.variables[again], once.distance2, once.pressure[again], once.gap[again])
    asked = []
    offered = selection._offered

    def noted(samples, given, whole, surfaces):
        asked.append(surfaces)
        return offered(samples, given, whole, surfaces)

    monkeypatch.setattr(selection, "_offered", noted)
    fit_count(samples, GIVEN, None, DEGREE, [TARGET])
    halves = [surfaces for surfaces in asked if not isinstance(surfaces, slice)]
    assert len(halves) >= 2
    for first, second in zip(halves[::2], halves[1::2], strict=True):
        assert len(first) + len(second) == 600
        assert not set(again[first]) & set(again[second])


def test_signs_go_with_variables_that_are_chosen_and_are_unknown_of_mixed_ones():
    odd = np.arange(2 * CANDIDATES).reshape(CANDIDATES, 2) % 2
    samples = replace(solved(2), odd=odd)
    np.testing.assert_array_equal(turned(samples, np.eye(CANDIDATES)[[3, 0]]).odd, odd[[3, 0]])
    assert turned(samples, np.ones((1, CANDIDATES))).odd.size == 0
    assert turned(solved(2), np.eye(CANDIDATES)).odd.size == 0
