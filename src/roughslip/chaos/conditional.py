"""Contact probability and mean pressure at a node, given what an expansion predicts there.

The positive part of a predicted target is no estimate of the pressure: the target scatters around its prediction, so
that some nodes predicted apart from the plane touch it and the other way round. With the law of the target given its
prediction s, found from strips that the fit has not seen (`scatter`; wider where s is larger, if it is),

    P(contact | s) = P(target > 0 | s),   E[p | s] = E[pressure(target) | s],

smooth functions of s, kept as tables. As the scatter vanishes both become those of the prediction itself.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from roughslip.chaos.pressure import PressureTarget
from roughslip.chaos.residual_distribution import residual_scatter
from roughslip.compilation import compiled
from roughslip.errors import ParameterError

REACH = 1.5  # times the mean target in contact: predictions further below are out of contact, unless a sample was not
PLACES = 2000  # of a table, evenly spaced up to the largest target, which near a border is some 40 times the mean
DRAWS = 200  # quantiles of the scatter over which a mean runs


@dataclass(frozen=True)
class ConditionalMeans:
    """Tables over the prediction, one a penetration.

    target : how a target gives the pressure
    low, step : (levels,) [target] first place of each table, and distance of two
    scatter : (levels,) [target] root mean square of the target around m(s)
    contact : (levels, PLACES) [-] P(contact | s)
    pressure : (levels, PLACES) [Pa] E[p | s]
    """

    target: PressureTarget
    low: np.ndarray
    step: np.ndarray
    scatter: np.ndarray
    contact: np.ndarray
    pressure: np.ndarray

    def at(self, predicted: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Contact probability [-] and mean pressure [Pa] : (levels, ...) at predictions : (levels, ...).

        Linear between places, zero below the first, and above the last, the largest target that was seen, as there:
        polynomials run off. A scatter narrower than two places is not resolved and counts as none.
        """
        if len(predicted) != len(self.low):
            raise ParameterError(f"{len(predicted)} levels of predictions for tables of {len(self.low)}")
        contact, pressure = np.empty(predicted.shape), np.empty(predicted.shape)
        for level, s in enumerate(predicted):
            if self.scatter[level] <= 2 * self.step[level]:
                contact[level], pressure[level] = s > 0, self.target.pressure(s)
                continue
            scale = self.low[level], self.step[level]
            _interpolate(s.ravel(), *scale, self.contact[level], contact[level].reshape(-1))
            _interpolate(s.ravel(), *scale, self.pressure[level], pressure[level].reshape(-1))
        return contact, pressure


def conditional_means(predicted: np.ndarray, values: np.ndarray, target: PressureTarget) -> ConditionalMeans:
    """The tables from predictions of samples that the fit has not seen.

    predicted, values : (levels, n) [target] what was predicted and what came, at n nodes of all rows
    target : how a target gives the pressure

    Returns the tables. Raises ParameterError for arrays that do not match; IllPosedError as `residual_scatter` does,
    for too few samples near contact.
    """
    if predicted.shape != values.shape or predicted.ndim != 2:
        raise ParameterError(f"predictions {predicted.shape} and values {values.shape} must match, a row a penetration")
    levels = len(predicted)
    low, step, scatter = np.empty((3, levels))
    contact, pressure = np.empty((2, levels, PLACES))
    uniform = (np.arange(DRAWS) + 0.5) / DRAWS
    for level, (s, value) in enumerate(zip(predicted, values, strict=True)):
        touching = value > 0
        lowest = -REACH * float(value[touching].mean()) if touching.any() else 0.0
        near = s >= min(lowest, float(s[touching].min(initial=lowest)))
        law = residual_scatter(s[near], value[near])
        places = np.linspace(law.low, min(law.high, float(value.max())), PLACES)
        drawn = law.draw(places[:, None], uniform)
        low[level], step[level] = places[0], places[1] - places[0]
        scatter[level] = np.sqrt(np.mean((value[near] - law.centre(s[near])) ** 2))
        contact[level], pressure[level] = (drawn > 0).mean(axis=1), target.pressure(drawn).mean(axis=1)
    return ConditionalMeans(target, low, step, scatter, contact, pressure)


@compiled()
def _interpolate(s: np.ndarray, low: float, step: float, table: np.ndarray, found: np.ndarray) -> None:
    """Writes (n,) the table at s : (n,), zero below its first place and constant above its last; NaN where s is."""
    last = len(table) - 1
    for k in range(len(s)):
        place = min((s[k] - low) / step, float(last))
        if place > 0:
            below = min(int(place), last - 1)
            found[k] = table[below] + (place - below) * (table[below + 1] - table[below])
        else:
            found[k] = 0.0 * place
