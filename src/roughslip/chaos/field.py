"""The pressure at every node of the square, expanded in all modes with one factorisation.

The pressure at node j depends on the surface mainly through one direction d_j in the space of the modes. Regression of
any monotone function of the state on Gaussian variables finds it (Brillinger, A Festschrift for E. L. Lehmann, 1982,
97; Li and Duan, Ann. Stat. 17 (1989) 1009). The normal scores of the state, which is the pressure in contact and minus
the gap outside, need neither units nor weights. All nodes share the basis (1, xi), its factors and its leverages. With

    t_j = d_j xi,     E[p_j | t_j] = g_j(t_j),     P(p_j > 0 | t_j) = q_j(t_j)    (links of `single_index`)

each node has an expansion of any degree in all modes: c_j,alpha = h_jn sqrt(n! / alpha!) d_j^alpha, with n = |alpha|
and h_jn the Hermite coefficients of g_j. As control variate, each surface has the expansion of the others.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg
from scipy.special import ndtri

from roughslip.chaos.regression import Factor, factorised
from roughslip.chaos.remedies import FEWER_MODES, MORE_SURFACES
from roughslip.chaos.single_index import Link, fit_link, knots_for, sensitivity_along, share_of_modes
from roughslip.errors import IllPosedError, ParameterError
from roughslip.limits import FIELD_GROUPS as GROUPS
from roughslip.short_repr import short_repr
from roughslip.validation import finite, gate

LEAST_CONTACTS = 20  # at every node; with fewer the error of a probability is unknown
DEGREE = 24  # of the polynomials for shares of the variance; they contain all but 1e-4 of it
BLOCK = 256  # nodes at a time
# Share of the surfaces whose states give the distribution at an index, and their least number.
NEIGHBOURS, LEAST_NEIGHBOURS = 0.04, 40


@dataclass(frozen=True)
class Statistic:
    """A statistic of the pressure at every node.

    value, error : (nodes,) value and standard error
    gain : (nodes,) [-] variance of the estimate from solved surfaces alone, over the variance of the value
    """

    value: np.ndarray
    error: np.ndarray
    gain: np.ndarray


@short_repr
@dataclass(frozen=True)
class FieldExpansion:
    """The expansion of the field of pressures, with its statistics.

    direction : (M, nodes) [-] d, unit vectors
    without : (GROUPS, M, nodes) [-] the same without each group of surfaces
    index : (K, nodes) [-] t of the surfaces, each with the direction from the others
    link : of contact [-], pressure [Pa] and its square, in this order
    contact, mean, deviation : contact probability [-], mean and standard deviation of the pressure [Pa]
    missed : (nodes,) [-] share of the variance of the pressure that predictions of left-out surfaces miss
    """

    direction: np.ndarray
    without: np.ndarray
    index: np.ndarray
    link: Link
    contact: Statistic
    mean: Statistic
    deviation: Statistic
    missed: np.ndarray

    @gate
    def expected_pressure(self, index: np.ndarray) -> np.ndarray:
        """E[p | t] : (..., nodes) [Pa] at indices : (..., nodes), such as xi @ direction."""
        return self.link(index)[1]


@gate
def fit_field(xi: np.ndarray, state: np.ndarray, contact: np.ndarray | None = None) -> FieldExpansion:
    """Expand the pressure at every node.

    xi : (K, M) [-] standard normal variables of the modes, of independent surfaces
    state : (K, nodes) pressure [Pa] of a node in contact, minus its gap [m] otherwise
    contact : (K, nodes) [-] share of the cell that is in contact; 1 where the state is positive, if not given

    Raises ParameterError for shapes that do not match or numbers that are not finite. Raises IllPosedError for too few
    surfaces, as the regression, and where a node is in contact on fewer than LEAST_CONTACTS of them.
    """
    if xi.ndim != 2 or state.ndim != 2 or len(xi) != len(state):
        raise ParameterError(f"variables {xi.shape} and states {state.shape} must be tables with a row a surface")
    xi, state = finite("xi", xi), finite("state", state)
    surfaces, nodes = state.shape
    knots = knots_for(surfaces)
    basis = np.column_stack([np.ones(surfaces), xi])
    factor, inverses = factorised(basis, FEWER_MODES), _group_inverses(basis)
    contacts = np.count_nonzero(state > 0, axis=0)
    if contacts.min() < LEAST_CONTACTS:
        raise IllPosedError(
            f"node {np.argmin(contacts)} is in contact on {contacts.min()} of {surfaces} surfaces; {LEAST_CONTACTS} "
            "are needed for an error of its probability: take more samples or a deeper penetration; scene keys: "
            "expansion.samples, square.penetration_percentile"
        )
    direction, without = np.empty((xi.shape[1], nodes)), np.empty((GROUPS, xi.shape[1], nodes))
    index, values = np.empty((surfaces, nodes)), np.empty((3, len(knots), nodes))
    statistics, missed = np.empty((3, 3, nodes)), np.empty(nodes)
    for block in _blocks(nodes):
        scores = normal_scores(state[:, block])
        direction[:, block], index[:, block] = left_out_index(factor, basis, scores)
        without[:, :, block] = _without_groups(basis, inverses, scores)
        pressure = np.maximum(state[:, block], 0.0)
        touching = pressure > 0 if contact is None else contact[:, block]
        responses = np.stack([touching, pressure, pressure**2])
        link, control = fit_link(index[:, block], responses, knots)
        values[:, :, block] = link.values
        plain = responses - responses.mean(axis=1, keepdims=True)
        statistics[:, :, block] = _statistics(control.mean, control.deviation, plain)
        missed[block] = np.mean(control.deviation[1] ** 2, axis=0) / np.mean(plain[1] ** 2, axis=0)
    probability, mean, deviation = (Statistic(*parts) for parts in statistics)
    return FieldExpansion(direction, without, index, Link(knots, values), probability, mean, deviation, missed)


def normal_scores(state: np.ndarray) -> np.ndarray:
    """Normal quantiles : (K, nodes) of the ranks of states : (K, nodes), node by node."""
    order = np.argsort(state, axis=0, kind="stable")
    quantiles = ndtri((np.arange(len(state)) + 0.5) / len(state))
    scores = np.empty(state.shape)
    np.put_along_axis(scores, order, np.broadcast_to(quantiles[:, None], state.shape), axis=0)
    return scores


def left_out_index(factor: Factor, basis: np.ndarray, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions of a regression, and the index of each sample with the direction from the others.

    factor : of the basis : (K, 1 + M), a constant and xi
    scores : (K, nodes)

    Returns direction : (M, nodes), index : (K, nodes). Raises IllPosedError where a slope vanishes.

    Method: without sample k the coefficients are c - v_k e_k / (1 - l_k), with residual e_k and leverage l_k.
    Here v_k = (X'X)^-1 x_k (Cook and Weisberg, Residuals and Influence, 1982, eq. 2.2.5). Products with v and c are
    shared by all nodes.
    """
    dual = scipy.linalg.solve_triangular(factor.r, factor.q.T, check_finite=False) / factor.norms[:, None]
    coefficients = dual @ scores
    slope, moves = coefficients[1:], dual[1:].T
    along = basis[:, 1:] @ slope
    left_out = (scores - along - coefficients[0]) / factor.freedom[:, None]
    along -= left_out * np.einsum("km,km->k", moves, basis[:, 1:])[:, None]
    length = np.sum(slope**2, axis=0) - 2 * left_out * (moves @ slope)
    length += left_out**2 * np.sum(moves**2, axis=1)[:, None]
    norm = np.linalg.norm(slope, axis=0)
    if not (np.all(norm > 0) and np.all(length > 0)):
        raise IllPosedError(f"the state of a node does not depend on any of {len(slope)} modes: {MORE_SURFACES}")
    return slope / norm, along / np.sqrt(length)


def _group_inverses(basis: np.ndarray) -> np.ndarray:
    """(X'X)^-1 : (GROUPS, P, P) without each group of samples, whose numbers leave one remainder."""
    return np.stack([_inverse(np.delete(basis, np.s_[g::GROUPS], axis=0)) for g in range(GROUPS)])


def _inverse(basis: np.ndarray) -> np.ndarray:
    factor = factorised(basis, FEWER_MODES)
    root = scipy.linalg.solve_triangular(factor.r, np.eye(len(factor.r)), check_finite=False) / factor.norms[:, None]
    return np.asarray(root @ root.T)


def _without_groups(basis: np.ndarray, inverses: np.ndarray, scores: np.ndarray) -> np.ndarray:
    """Directions : (GROUPS, M, nodes) without each group of samples."""
    sides = np.stack([basis[g::GROUPS].T @ scores[g::GROUPS] for g in range(GROUPS)])
    slope = (inverses @ (sides.sum(axis=0) - sides))[:, 1:]
    return np.asarray(slope / np.linalg.norm(slope, axis=1, keepdims=True))


def _statistics(mean: np.ndarray, deviation: np.ndarray, plain: np.ndarray) -> np.ndarray:
    """Value, error and gain : (3, 3, nodes) of contact, mean and standard deviation.

    mean, deviation : (3, nodes), (3, K, nodes) of contact, pressure and its square, with the control
    plain : (3, K, nodes) deviations of the samples from their mean, without the control

    The error of the standard deviation is linearised in the mean and the mean square.
    """
    variance = mean[2] - mean[1] ** 2
    if not np.all(variance > 0):
        raise IllPosedError(
            f"the variance of the pressure at a node is estimated as {variance.min():.3g} Pa^2, and must be positive: "
            f"{MORE_SURFACES}"
        )
    root = np.sqrt(variance)

    def squares(deviations: np.ndarray) -> np.ndarray:
        of_root = (deviations[2] - 2 * mean[1] * deviations[1]) / (2 * root)
        return np.stack([np.mean(part**2, axis=0) for part in (deviations[0], deviations[1], of_root)])

    surfaces = deviation.shape[1]
    controlled, alone = squares(deviation), squares(plain)
    error = np.sqrt(controlled / surfaces)
    error[0] = np.maximum(error[0], 1.0 / surfaces)  # where all surfaces touch: one more out of contact
    gain = np.divide(alone, controlled, out=np.ones_like(alone), where=alone > 0)
    return np.stack([np.stack([mean[0], mean[1], root]), error, gain], axis=1)


@short_repr
@dataclass(frozen=True)
class ModeShares:
    """Sobol' indices of the modes for the expected pressure, averaged over all nodes with its variance as weight.

    first, total : (M,) [-]
    first_error, total_error : (M,) [-] standard errors
    leading : (nodes,) [-] share of the variance at a node that the leading modes explain together

    Method: indices of many outputs, Lamboni, Monod and Makowski, Reliab. Eng. Syst. Saf. 96 (2011) 450. Errors from a
    jackknife of the directions over groups of surfaces; errors of the links cancel in the shares.
    """

    first: np.ndarray
    total: np.ndarray
    first_error: np.ndarray
    total_error: np.ndarray
    leading: np.ndarray


@gate
def mode_shares(expansion: FieldExpansion, leading: int) -> ModeShares:
    """Shares of the modes in the variance of the field.

    leading : number of leading modes for the joint share
    """
    coefficients = expansion.link.hermite(DEGREE)[1]
    weights = np.sum(coefficients[1:] ** 2, axis=0)
    weights /= weights.sum()
    members = [expansion.direction, *expansion.without]
    shares = np.array([[indices @ weights for indices in sensitivity_along(d, coefficients)] for d in members])
    first, total = shares[0]
    first_error, total_error = np.sqrt((GROUPS - 1) * np.var(shares[1:], axis=0))
    joint = share_of_modes(expansion.direction, coefficients, leading)
    return ModeShares(first, total, first_error, total_error, joint)


def draw_pressure(
    expansion: FieldExpansion,
    state: np.ndarray,
    index: np.ndarray,
    generator: np.random.Generator,
    own: np.ndarray | None = None,
) -> np.ndarray:
    """Draw fields of pressure from the distribution of the state given its index.

    state : (K, nodes) as in `fit_field`
    index : (fields, nodes) of the fields, such as xi @ direction
    generator : chooses a solved surface for each field, one of those with the nearest expected load
    own : (fields,) number of the solved surface of each field, which is not chosen for it; none if not given

    Returns p : (fields, nodes) [Pa].

    Method: at every node the distribution is that of the solved surfaces nearest in the index, as in the local
    bootstrap of Shi (J. Stat. Comput. Simul. 39 (1991) 1). States at the highest indices are moved along E[p | t]. The
    rank in the distribution is that of the chosen surface at all nodes. So the scatter is correlated in space as in
    solved fields (Schaake shuffle: Clark et al., J. Hydrometeorol. 5 (2004) 243). Where the expected load is high,
    neighbours take a larger part of it. Without the choice by load, the load of drawn fields would scatter twice as
    much as that of solved ones. On the resolved square (60 fields, percentile 50) the mean load is 6 % low with an
    error of 2 %. Its scatter and that of the contact area agree within their errors.
    """
    surfaces, nodes = state.shape
    near = min(surfaces, max(LEAST_NEIGHBOURS, round(NEIGHBOURS * surfaces)))
    known, loads = expansion.index, _expected_load(expansion, expansion.index)
    apart = np.abs(_expected_load(expansion, index)[:, None] - loads)
    if own is not None:
        apart[np.arange(len(index)), own] = np.inf
    alike = np.argsort(apart, axis=1)[:, : min(near, surfaces - 1)]
    donors = generator.permuted(alike, axis=1)[:, 0]
    pressure = np.empty(index.shape)
    for block in _blocks(nodes):
        order = np.argsort(known[:, block], axis=0)
        indices, states = (np.take_along_axis(table[:, block], order, axis=0) for table in (known, state))
        law = _NearestStates(indices, states, Link(expansion.link.knots, expansion.link.values[1:2, :, block]), near)
        for field, donor in enumerate(donors):
            rank = np.count_nonzero(law.at(known[donor, block]) < state[donor, block], axis=0)
            drawn = np.take_along_axis(law.at(index[field, block]), np.minimum(rank, near - 1)[None], axis=0)[0]
            pressure[field, block] = np.maximum(drawn, 0.0)
    return pressure


class _NearestStates(NamedTuple):
    """States of the solved surfaces, ordered by the index at each node.

    known, state : (K, nodes) indices in ascending order at each node, and the corresponding states
    link : E[p | t]
    near : number of surfaces
    """

    known: np.ndarray
    state: np.ndarray
    link: Link
    near: int

    def at(self, index: np.ndarray) -> np.ndarray:
        """States : (near, nodes), ascending, at an index : (nodes,)."""
        last = len(self.known) - self.near
        first = np.clip(np.count_nonzero(self.known < index, axis=0) - self.near // 2, 0, last)
        rows = first + np.arange(self.near)[:, None]
        states = np.take_along_axis(self.state, rows, axis=0)
        moved = self.link(index)[0] - self.link(np.take_along_axis(self.known, rows, axis=0))[0]
        highest = (states > 0) & (first == last)  # elsewhere as many neighbours lie above as below
        return np.sort(states + np.where(highest, moved, 0.0), axis=0)


def _expected_load(expansion: FieldExpansion, index: np.ndarray) -> np.ndarray:
    """Mean of E[p | t] over the nodes : (fields,) [Pa]."""
    return np.array([expansion.expected_pressure(field_index).mean() for field_index in index])


def _blocks(nodes: int) -> Iterator[slice]:
    return (slice(first, min(first + BLOCK, nodes)) for first in range(0, nodes, BLOCK))
