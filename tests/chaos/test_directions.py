"""Directions beyond those in use: found where the residual has them, and not where it has none."""

import numpy as np
import pytest
from scipy.stats import binom

from roughslip.chaos.directions import LEAST_SURFACES, moving_frame, residual_directions
from roughslip.errors import IllPosedError, ParameterError

SURFACES, NODES, USED, FRAME = 800, 3, 2, 7
TRUE = np.array([0.6, 0.0, -0.8, 0.0, 0.0, 0.0, 0.0])
OTHER = np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0])
NOISE = 0.5


def surfaces(seed, count=SURFACES):
    """u : (K, nodes, 2), q : (K, nodes, 7) with half their variance common to the nodes, and their common noise."""
    generator = np.random.default_rng([92, seed])
    shape = (count, NODES, USED + FRAME)
    both = (generator.standard_normal(shape) + generator.standard_normal((count, 1, USED + FRAME))) / np.sqrt(2)
    return both[..., :USED], both[..., USED:], NOISE * generator.standard_normal((count, 1))


def found(residual, u, q):
    directions, number = residual_directions(residual, u, q, np.random.default_rng(5))
    np.testing.assert_allclose(directions @ directions.T, np.eye(q.shape[2]), atol=1e-13)
    return directions[:number]


# Beside its strength, a root mean square gradient along TRUE, each residual has the standard deviation given.
ALONG = {
    "linear": (lambda u, s: s, 1.0),
    "quadratic": (lambda u, s: (s**2 - 1) / 2, 1.0),  # H = TRUE TRUE'
    "product": (lambda u, s: u[..., 1] * s, 1.0),
    "saturated": (lambda u, s: np.tanh(s), 0.6),  # E[tanh'(s)]
}


@pytest.mark.parametrize("name", ALONG)
def test_one_direction_is_found_to_within_its_noise(name):
    """An entry of g or H across TRUE has a standard deviation of at most sqrt(3) sd(r) / sqrt(K): a mean of q_i q_j r
    where r holds the same q. The sine of the angle is their norm over the six directions across, divided by the
    strength, here within twice its root mean square."""
    response, strength = ALONG[name]
    u, q, noise = surfaces(1)
    r = response(u, q @ TRUE) + noise
    directions = found(r, u, q)
    assert len(directions) == 1
    sine = np.sqrt(max(0.0, 1 - (directions[0] @ TRUE) ** 2))
    assert sine < 2 * np.sqrt(3 * (FRAME - 1) / SURFACES) * r.std() / strength


def test_two_directions_come_in_the_order_of_their_strength_and_are_orthonormal():
    """Strengths of 1.5 and 0.6, and the same noise in the entries as above."""
    u, q, noise = surfaces(2, 8000)
    r = 1.5 * q @ TRUE + 0.3 * ((q @ OTHER) ** 2 - 1) + noise
    directions = found(r, u, q)
    assert len(directions) == 2
    np.testing.assert_allclose(directions @ directions.T, np.eye(2), atol=1e-14)
    for one, true, strength in zip(directions, (TRUE, OTHER), (1.5, 0.6), strict=True):
        assert np.sqrt(1 - (one @ true) ** 2) < 2 * np.sqrt(3 * (FRAME - 1) / 8000) * r.std() / strength


def test_noise_offers_a_direction_in_five_of_a_hundred_studies():
    """Heavy tails and a scatter that depends on u, as of a pressure. Of 100 with 5 % each more than 12 have 0.2 %."""
    offered = 0
    for seed in range(100):
        u, q, noise = surfaces(1000 + seed, 300)
        offered += len(found(noise**3 * np.exp(0.5 * u[..., 0]), u, q)) > 0
    assert offered <= binom.ppf(0.998, 100, 0.05)


def test_what_depends_on_the_variables_in_use_offers_nothing():
    """Far above what random signs of so many surfaces leave of it, were it a direction."""
    offered = [len(found(np.sin(2 * u[..., 0]) + u[..., 1] ** 2, u, q)) > 0 for u, q, _ in map(surfaces, range(20))]
    assert sum(offered) <= 4  # of 20 with 5 % each: 0.3 %


def test_directions_turn_with_the_frame_and_do_not_mind_the_order_of_nodes_or_units():
    u, q, noise = surfaces(3)
    r = q @ TRUE + noise
    plain = found(r, u, q)
    rotation = np.linalg.qr(np.random.default_rng(4).standard_normal((FRAME, FRAME)))[0]
    for other in (
        found(r, u, q @ rotation.T) @ rotation,
        found(r[:, ::-1], u[:, ::-1], q[:, ::-1]),
        found(-1e9 * r, u, q),
    ):
        assert np.abs(other @ plain.T) == pytest.approx(1.0, abs=1e-12)
    mirrored = found(r, u, q * np.where(TRUE < 0, -1, 1))
    assert np.abs(mirrored @ np.abs(TRUE)) == pytest.approx(np.abs(plain @ TRUE), abs=1e-12)


def test_directions_of_impossible_input_are_refused():
    u, q, noise = surfaces(4)
    r = np.repeat(noise, NODES, axis=1)
    assert found(r, u, q[..., :0]).shape == (0, 0)
    with pytest.raises(IllPosedError, match="39 surfaces are too few"):
        found(r[: LEAST_SURFACES - 1], u[: LEAST_SURFACES - 1], q[: LEAST_SURFACES - 1])
    with pytest.raises(ParameterError, match="do not match"):
        found(r, u[1:], q)
    with pytest.raises(ParameterError, match="finite"):
        found(np.where(q[..., 0] > 2, np.nan, r), u, q)


def functionals(nodes=3, n=4, modes=9, seed=0):
    """Functionals at nodes that differ by a tenth, and two directions in use at each."""
    generator = np.random.default_rng([6, seed])
    both = generator.standard_normal((n + 2, modes)) + 0.1 * generator.standard_normal((nodes, n + 2, modes))
    return both[:, :n], np.linalg.qr(both[:, n:].transpose(0, 2, 1))[0].transpose(0, 2, 1)


def test_a_frame_is_orthonormal_beside_the_directions_and_spans_what_the_functionals_add():
    points, used = functionals()
    frame = moving_frame(points, used)
    assert frame.shape == (3, 4, 9)
    np.testing.assert_allclose(frame @ frame.transpose(0, 2, 1), np.broadcast_to(np.eye(4), (3, 4, 4)), atol=1e-14)
    np.testing.assert_allclose(frame @ used.transpose(0, 2, 1), 0, atol=1e-14)
    left = points - (points @ used.transpose(0, 2, 1)) @ used
    np.testing.assert_allclose(left @ frame.transpose(0, 2, 1) @ frame, left, atol=1e-13)


def test_a_frame_moves_with_the_node():
    """Modes turned at every node: the same frame, turned. Its rows at nodes that are alike are the same."""
    points, used = functionals(nodes=1)
    turns = np.linalg.qr(np.random.default_rng(7).standard_normal((3, 9, 9)))[0]
    frame = moving_frame(points[0] @ turns, used[0] @ turns)
    np.testing.assert_allclose(frame, np.broadcast_to(frame[0] @ turns[0].T, (3, 4, 9)) @ turns, atol=1e-13)


def test_a_frame_has_no_row_for_what_is_in_use_already():
    points, used = functionals()
    doubled = np.concatenate([points, points[:, :1] - 3 * points[:, 1:2], used], axis=1)
    assert moving_frame(doubled, used).shape == (3, 4, 9)
    assert moving_frame(2 * used, used).shape == (3, 0, 9)


def test_frames_of_impossible_input_are_refused():
    points, used = functionals()
    with pytest.raises(ParameterError, match="do not match"):
        moving_frame(points[1:], used)
    with pytest.raises(ParameterError, match="finite"):
        moving_frame(np.where(points == points.max(), np.nan, points), used)
    blind = points.copy()
    blind[0, 0] *= 0.01
    with pytest.raises(IllPosedError, match="in common"):
        moving_frame(blind, used)
