"""Number and directions of variables: those of a known response, and no directions from noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from roughslip.chaos import selection
from roughslip.chaos.local import GROUPS, Samples, fit_best, fit_local
from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.selection import (
    fit_count,
    regression_first,
    residual_directions,
    rotated,
)
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


@pytest.mark.parametrize(
    "number", [2, pytest.param(4, marks=pytest.mark.slow), 5, pytest.param(6, marks=pytest.mark.slow)]
)
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
    again = fit_local(chosen.samples, DEGREE, TARGET)
    np.testing.assert_array_equal(chosen.expansion.whole.coefficients, again.whole.coefficients)


@pytest.mark.parametrize(("more", "taken"), [(0.9, 2), (1.1, 4)])
def test_the_smallest_number_within_a_standard_error_of_the_best_is_taken(monkeypatch, more, taken):
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


@pytest.mark.slow
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
        expected[part::2] = fit_local(rotated(samples, rotation), DEGREE, TARGET).scores[part::2]
    assert chosen.scores[chosen.counts.index(5)] == pytest.approx(expected.sum(), rel=1e-13)
    np.testing.assert_array_equal(chosen.rotation[GIVEN:], both[:1])


def test_a_number_that_is_asked_for_is_taken():
    samples = solved(5)
    few = fit_count(samples, GIVEN, 3, DEGREE, [TARGET])
    best, scores = fit_best(
        Samples(samples.variables[..., :3], np.zeros(2), samples.pressure, samples.gap), 2, [TARGET]
    )
    np.testing.assert_array_equal(few.expansion.whole.coefficients, best.whole.coefficients)
    assert (few.counts, few.targets) == ((3,), scores)
    many = fit_count(samples, GIVEN, 5, DEGREE, [TARGET])
    assert abs(many.rotation[4, GIVEN:] @ HIDDEN) > 0.95
    assert many.expansion.score < 0.8 * few.expansion.score
    assert few.scores[0] == few.expansion.score


def test_more_directions_than_exceed_the_noise_are_refused():
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


RIDGE = np.array([0.5, -0.3, 0.2, 0.1, 0.4, 0.0, 0.6, -0.2, 0.2236])  # of unit length to four digits


def ridge(seed=0, count=600, noise=0.05):
    """A response to one direction in all candidates, bent: a cubic that rises everywhere."""
    generator = np.random.default_rng([19, seed])
    u = generator.standard_normal((count, 2, CANDIDATES))
    t = u @ (RIDGE / np.linalg.norm(RIDGE))
    r = 0.2 + t + 0.1 * t**2 + 0.05 * t**3 + noise * generator.standard_normal(t.shape)
    return Samples(u, np.zeros(2), np.maximum(r, 0), np.maximum(-r, 0) / TARGET.gap_stiffness)


def test_the_regression_direction_comes_first_and_the_given_variables_after_it():
    """The scatter of the nonlinear part is sqrt(2 0.1^2 + 6 0.05^2 + noise^2) = 0.19. With 1200 independent samples the
    slope errs in each of 8 other directions by 0.19 / (1.15 sqrt(1200)): a sine of 0.014 in all. Chi with 8 degrees is
    below 5.2 / 2.8 times that with 99.9 %."""
    rotation = regression_first(ridge(), GIVEN, TARGET)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(CANDIDATES), atol=1e-13)
    cosine = abs(rotation[0] @ RIDGE) / np.linalg.norm(RIDGE)
    assert np.sqrt(1 - cosine**2) < 0.026
    for row in range(1, GIVEN):  # each adds one given variable to what the rows before it span
        inside = np.vstack([rotation[: row + 1]])
        unit = np.eye(CANDIDATES)[row - 1]
        assert np.linalg.norm(unit - inside.T @ (inside @ unit)) < 1e-12


def test_one_direction_of_a_regression_explains_more_than_all_given_variables():
    samples = ridge()
    alone = fit_count(samples, GIVEN, GIVEN, 3, [TARGET])
    first = fit_count(samples, GIVEN, 1, 3, [TARGET], regression=True)
    assert first.rotation.shape == (1, CANDIDATES)
    assert first.expansion.cross_validated < 0.02  # noise 0.05^2 of 1.2, and the sine above
    assert alone.expansion.cross_validated > 0.5  # four of nine components hold 0.39 of the direction's square
    np.testing.assert_allclose(first.samples.variables, samples.variables @ first.rotation.T, atol=1e-12)


def test_signs_are_kept_for_selected_variables_and_unknown_for_mixed_ones():
    odd = np.arange(2 * CANDIDATES).reshape(CANDIDATES, 2) % 2
    samples = replace(solved(2), odd=odd)
    np.testing.assert_array_equal(rotated(samples, np.eye(CANDIDATES)[[3, 0]]).odd, odd[[3, 0]])
    assert rotated(samples, np.ones((1, CANDIDATES))).odd.size == 0
    assert rotated(solved(2), np.eye(CANDIDATES)).odd.size == 0


SURFACES, NODES, USED, FRAME = 800, 3, 2, 7
TRUE = np.array([0.6, 0.0, -0.8, 0.0, 0.0, 0.0, 0.0])
OTHER = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
NOISE = 0.5


def noisy_surfaces(seed, count=SURFACES):
    """u : (K, nodes, 2), q : (K, nodes, 7) with half their variance common to the nodes, and their common noise."""
    generator = np.random.default_rng([92, seed])
    shape = (count, NODES, USED + FRAME)
    both = (generator.standard_normal(shape) + generator.standard_normal((count, 1, USED + FRAME))) / np.sqrt(2)
    return both[..., :USED], both[..., USED:], NOISE * generator.standard_normal((count, 1))


def significant(residual, u, q):
    directions, number = residual_directions(residual, u, q, np.random.default_rng(5))
    np.testing.assert_allclose(directions @ directions.T, np.eye(q.shape[2]), atol=1e-13)
    return directions[:number]


# Residuals, each with its strength: the root mean square gradient along TRUE.
ALONG = {
    "linear": (lambda u, s: s, 1.0),
    "quadratic": (lambda u, s: (s**2 - 1) / 2, 1.0),  # H = TRUE TRUE'
    "product": (lambda u, s: u[..., 1] * s, 1.0),
    "saturated": (lambda u, s: np.tanh(s), 0.6),  # E[tanh'(s)]
}


@pytest.mark.parametrize("name", ALONG)
def test_one_direction_is_found_to_within_its_noise(name):
    """An entry of g or H across TRUE has a standard deviation of at most sqrt(3) sd(r) / sqrt(K). It is a mean of
    q_i q_j r, where r holds the same q. The sine of the angle is their norm over the six directions across,
    divided by the strength, within twice its root mean square."""
    response, strength = ALONG[name]
    u, q, noise = noisy_surfaces(1)
    r = response(u, q @ TRUE) + noise
    directions = significant(r, u, q)
    assert len(directions) == 1
    sine = np.sqrt(max(0.0, 1 - (directions[0] @ TRUE) ** 2))
    assert sine < 2 * np.sqrt(3 * (FRAME - 1) / SURFACES) * r.std() / strength


def test_two_directions_come_in_the_order_of_their_strength_and_are_orthonormal():
    """Strengths of 1.5 and 0.6, and the same noise in the entries as above."""
    u, q, noise = noisy_surfaces(2, 8000)
    r = 1.5 * q @ TRUE + 0.3 * ((q @ OTHER) ** 2 - 1) + noise
    directions = significant(r, u, q)
    assert len(directions) == 2
    np.testing.assert_allclose(directions @ directions.T, np.eye(2), atol=1e-14)
    for one, true, strength in zip(directions, (TRUE, OTHER), (1.5, 0.6), strict=True):
        assert np.sqrt(1 - (one @ true) ** 2) < 2 * np.sqrt(3 * (FRAME - 1) / 8000) * r.std() / strength


@pytest.mark.slow
def test_noise_offers_a_direction_in_five_of_a_hundred_studies():
    """Heavy tails and a scatter that depends on u, as of a pressure. Of 100 with 5 % each more than 12 have 0.2 %."""
    offered = 0
    for seed in range(100):
        u, q, noise = noisy_surfaces(1000 + seed, 300)
        offered += len(significant(noise**3 * np.exp(0.5 * u[..., 0]), u, q)) > 0
    assert offered <= binom.ppf(0.998, 100, 0.05)


def test_directions_rotate_with_the_frame_and_do_not_depend_on_units_or_the_order_of_nodes():
    u, q, noise = noisy_surfaces(3)
    r = q @ TRUE + noise
    plain = significant(r, u, q)
    rotation = np.linalg.qr(np.random.default_rng(4).standard_normal((FRAME, FRAME)))[0]
    for other in (
        significant(r, u, q @ rotation.T) @ rotation,
        significant(r[:, ::-1], u[:, ::-1], q[:, ::-1]),
        significant(-1e9 * r, u, q),
    ):
        assert np.abs(other @ plain.T) == pytest.approx(1.0, abs=1e-12)
    mirrored = significant(r, u, q * np.where(TRUE < 0, -1, 1))
    assert np.abs(mirrored @ np.abs(TRUE)) == pytest.approx(np.abs(plain @ TRUE), abs=1e-12)
