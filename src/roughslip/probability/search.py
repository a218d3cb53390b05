"""Where an answer changes along one parameter, where the probability of an event crosses a level, and maps of it.

A probability is that of the same random paths at every value. A map has it at all nodes of a plane lattice, from its
values at few nodes: those are added where it changes.

K(x) of n independent paths show the event at the value x. At the true crossing K is binomial with the level as its
probability. So the values about the crossing of K / n at which K lies within the central 95 % of that distribution are
a 95 % interval. Where every path changes once, its ends are order statistics of the values at which the paths change
(H. A. David & H. N. Nagaraja, Order Statistics, 2003, 7.1). It also holds where paths change to and fro.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy  # its parts when they are used
from scipy.special import bdtr, ndtr, ndtri

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.probability.estimate import TAILS
from roughslip.validation import positive

ACCURACY = 1e-3  # relative, of a value at which the probability crosses a level,
COARSE = 0.02  # and where the values on both sides of it lie within its interval
END_ACCURACY = 0.5  # of the step that holds an end of the interval, as a share of its distance from the value
STEPS = 8  # from the start to either end of the search; a probability that crosses a level twice between is missed
LADDER = 0.49, 4.0, 32.0  # distances of values that are tried from a hint, in units of ACCURACY
PROBES = 12  # paths that look for the step with a crossing
ALIKE = 36  # that show no crossing at the end of the search: they are alike by chance in 0.16 of the cases at a level
RANGE_STEPS = 24  # between the start and the end of the search for another answer
RANGE_ACCURACY = 1e-6  # relative, of the value where it changes
START = 4  # nodes along either axis of the coarse lattice at the beginning
LEAST = 0.01  # probabilities p enter the spline as LEAST + (1 - 2 LEAST) p, whose quantiles are finite
FLAT = 1e-3  # variance of an outcome that nodes have where the probability is 0 or 1, so that none is never added
Occurs = Callable[[float, range], np.ndarray]


def first_change(
    answer: Callable[[float], Hashable | None], start: float, reach: float, accuracy: float = RANGE_ACCURACY
) -> tuple[float, float | None]:
    """Two neighbouring values from `start` towards `reach`, both positive, between which the answer changes.

    answer : of a value; None where it is unknown
    accuracy : relative, of both values

    Returns the last value before, and the first whose answer is known to be another: None where it never changes up to
    `reach`. A search outwards in steps, then bisection. Between two steps an answer is taken to change once at most.
    Raises ParameterError where the answer at the start is unknown, or where start and reach are not finite and
    positive.
    """
    for end in (start, reach):
        positive("an end of a search", end)
    own = answer(start)
    if own is None:
        raise ParameterError(f"the answer at the start value {start:g} is unknown, so no range begins there")
    for inside, outside in pairwise([start, *map(float, np.geomspace(start, reach, RANGE_STEPS + 1)[1:])]):
        if answer(outside) in (None, own):
            continue
        while abs(outside / inside - 1.0) > accuracy:
            middle = math.sqrt(inside * outside)
            inside, outside = (middle, outside) if answer(middle) in (None, own) else (inside, middle)
        return inside, outside
    return reach, None


@dataclass(frozen=True)
class Crossing:
    """Where a probability crosses a level.

    value : where the share of the paths does
    low, high : ends of the 95 % interval, None where it reaches the end of the search
    """

    value: float
    low: float | None
    high: float | None


def central_counts(paths: int, level: float) -> tuple[int, int]:
    """The least and the largest count of a binomial variable within its central 95 %."""
    below = bdtr(np.arange(paths + 1), paths, level)
    minimum, maximum = (int(np.searchsorted(below, tail)) for tail in TAILS)
    return minimum, maximum


class LevelSearch:
    """Counts of paths with the event along one parameter, and searches for crossings in them.

    occurs : of a value and a range of path numbers, (paths,) whether the event occurs; ConvergenceError,
        IllPosedError or ParameterError where the value cannot be tried
    paths : n
    start : of the search, positive
    low, high : its ends
    at_start : (n,) whether the event occurs there
    hints : values near which the probability may change fast
    """

    def __init__(
        self,
        occurs: Occurs,
        start: float,
        low: float,
        high: float,
        at_start: np.ndarray,
        hints: Sequence[float] = (),
    ) -> None:
        if not 0.0 < low < start < high < math.inf:
            raise ParameterError(f"a search goes from a positive start outwards, not from {start} to {low} and {high}")
        self._occurs, self.paths = occurs, len(at_start)
        down, up = (np.geomspace(start, end, STEPS + 1)[1:] for end in (low, high))
        self._grid = [*map(float, down[::-1]), start, *map(float, up)]
        self._seen = {start: at_start}
        self._ends = [0, len(self._grid) - 1]
        steps = [side * step * ACCURACY for step in LADDER for side in (-1.0, 1.0)]
        self._hints = [hint * math.exp(step) for step in steps for hint in hints]
        self.trials = 0

    @property
    def searched(self) -> tuple[float, float]:
        """The ends of the search, as far as values could be tried."""
        return self._grid[self._ends[0]], self._grid[self._ends[1]]

    def count(self, value: float, paths: int | None = None) -> int:
        """How many of the first paths, or of all, show the event."""
        number = self.paths if paths is None else paths
        seen = self._seen.get(value, np.zeros(0, dtype=bool))
        if seen.size < number:
            self.trials += number - seen.size
            seen = np.append(seen, self._occurs(value, range(seen.size, number)))
            self._seen[value] = seen
        return int(np.count_nonzero(seen[:number]))

    def crossing(self, level: float, upwards: bool) -> Crossing | None:
        """The nearest crossing of a level above or below the start; None where the search holds none.

        Raises ParameterError for a level whose interval this number of paths does not bound.
        """
        minimum, maximum = central_counts(self.paths, level)
        if not 0 < minimum <= maximum < self.paths:
            raise ParameterError(
                f"{self.paths} paths do not bound a value of the probability {level:g}: take more",
                scene_keys="answer.realisations",
            )
        step, target = 1 if upwards else -1, level * self.paths
        above = self._is_above(self._grid[STEPS], target)
        at = self._first_probe(step, level, not above)
        if at == self._ends[upwards] and self.count(self._grid[at], ALIKE) == (ALIKE if above else 0):
            return None
        far = self._first(at, step, target, not above)
        if far is None:
            return None
        while self._is_above(self._grid[far - step], target) != above:  # at the start it is equal
            far -= step
        value = self._root(target, self._grid[far - step], self._grid[far])
        inner, outer = (maximum + 0.5, minimum - 0.5) if above else (minimum - 0.5, maximum + 0.5)
        ends = self._end(far - step, -step, inner, above, value), self._end(far, step, outer, not above, value)
        low, high = ends if upwards else ends[::-1]
        return Crossing(value, None if low is None else min(low, value), None if high is None else max(high, value))

    def _first_probe(self, step: int, level: float, side: bool) -> int:
        """The grid point outwards at which the first paths come to a side of the level, or the last one."""
        at = STEPS
        while self._goes_on(at, step):
            at += step
            if (self.count(self._grid[at], PROBES) > level * PROBES) == side:
                break
        return at

    def _first(self, at: int, step: int, threshold: float, side: bool) -> int | None:
        """The first grid point from `at` on whose count is on a side of the threshold."""
        while self._is_above(self._grid[at], threshold) != side:
            if not self._goes_on(at, step):
                return None
            at += step
        return at

    def _goes_on(self, at: int, step: int) -> bool:
        """Whether there is a next grid point that can be tried; if not, the search ends here."""
        if at == self._ends[step > 0]:
            return False
        goes_on = self._can_be_tried(self._grid[at + step])
        if not goes_on:
            self._ends[step > 0] = at
        return goes_on

    def _can_be_tried(self, value: float) -> bool:
        try:
            self.count(value, PROBES)
        except (ConvergenceError, IllPosedError, ParameterError):
            return False
        return True

    def _is_above(self, value: float, threshold: float) -> bool:
        """Whether the count of all paths exceeds a threshold; of no more paths than decide it."""
        seen = PROBES
        while self.count(value, seen) <= threshold < self.count(value, seen) + self.paths - seen:
            seen = min(2 * seen, self.paths)
        return self.count(value, seen) > threshold

    def _end(self, at: int, way: int, threshold: float, side: bool, value: float) -> float | None:
        """The end of a value's interval: where, from a grid point on, the count comes to a side of the threshold."""
        last = self._first(at, way, threshold, side)
        if last is None:
            return None
        inside, outside = self._grid[last - way], self._grid[last]
        while abs(math.log(outside / inside)) > max(ACCURACY, END_ACCURACY * abs(math.log(inside / value))):
            inside, outside = self._narrowed(threshold, inside, outside)
        return self._between(threshold, inside, outside)

    def _root(self, threshold: float, a: float, b: float) -> float:
        """The value, of two on different sides of the threshold and between, where the count comes to it."""
        minimum, maximum = central_counts(self.paths, threshold / self.paths)
        while (width := abs(math.log(b / a))) > ACCURACY:
            if width <= COARSE and all(minimum <= self.count(value) <= maximum for value in (a, b)):
                break
            a, b = self._narrowed(threshold, a, b)
        return self._between(threshold, a, b)

    def _narrowed(self, threshold: float, a: float, b: float) -> tuple[float, float]:
        """Two values nearer to each other, on the same sides of the threshold as a and b.

        Values tried before serve first, then those about hints, the nearest first. Else a new one lies beyond the
        interpolated crossing, in the longer part.
        """
        side, before = self._is_above(a, threshold), a
        between = sorted((value for value in self._seen if min(a, b) < value < max(a, b)), reverse=b < a)
        if not between:
            hints = [value for value in self._hints if min(a, b) < value < max(a, b)]
            places = (*hints[:1], self._between(threshold, a, b, beyond=0.1), math.sqrt(a * b))
            between = [next(filter(self._can_be_tried, places), places[-1])]
        for value in between:
            if self._is_above(value, threshold) != side:
                return before, value
            before = value
        return before, b

    def _between(self, threshold: float, a: float, b: float, beyond: float = 0.0) -> float:
        """Where the normal score of the share of paths, linear in the logarithm of the value, is that of the threshold.

        beyond : how much farther into the longer part, as a share of the way from a to b
        """
        counts = [self.paths * self._seen[value].mean() for value in (a, b)] + [threshold]  # as if all were seen
        score_a, score_b, score = (float(ndtri((count + 0.5) / (self.paths + 1))) for count in counts)
        share = (score_a - score) / (score_a - score_b)
        return a * (b / a) ** (share + beyond if share < 0.5 else share - beyond)


@dataclass(frozen=True)
class LatticeMap:
    """The probability at the nodes of a lattice.

    probability : (points, points) [-] computed, or of the spline
    is_computed : (points, points)
    prediction_error : [-] mean error of the spline at the last third of the added nodes, before they were computed
    """

    probability: np.ndarray
    is_computed: np.ndarray
    prediction_error: float


def lattice_map(probability: Callable[[int, int], float], points: int, computed: int) -> LatticeMap:
    """The probability at points x points nodes, computed at as many as asked.

    probability : at a node, by its two indices [-], 0 to 1; the same random numbers should serve all nodes
    points : nodes along either axis
    computed : nodes at which it is computed, at least START^2 and at most all

    Raises ParameterError for numbers out of range.

    Method: a thin-plate spline through the quantiles of the normal distribution at the values. The next node is where
    its distance to the nearest computed one times the standard deviation of one outcome, sqrt(p (1 - p)), is largest.
    """
    if points < START or not START**2 <= computed <= points**2:
        raise ParameterError(
            f"a map of {points} x {points} nodes, at least {START} x {START}, is computed at {START**2} to {points**2} "
            f"of them, not at {computed}",
            scene_keys="map.points",
        )
    nodes = np.stack(np.divmod(np.arange(points**2), points), axis=1)
    place = nodes / (points - 1)
    lines = np.round(np.linspace(0, points - 1, START)).astype(int)
    known = [int(i * points + j) for i in lines for j in lines]
    values = [probability(*nodes[node].tolist()) for node in known]
    distance = np.min(np.linalg.norm(place[:, None] - place[known], axis=-1), axis=1)
    errors: list[float] = []
    spline = _spline(place, known, values)
    while len(known) < computed:
        node = int(np.argmax(distance * np.sqrt(spline * (1.0 - spline) + FLAT)))
        value = probability(*nodes[node].tolist())
        errors.append(abs(value - float(spline[node])))
        known.append(node)
        values.append(value)
        distance = np.minimum(distance, np.linalg.norm(place - place[node], axis=1))
        spline = _spline(place, known, values)
    spline[known] = values
    is_computed = np.zeros(points**2, dtype=bool)
    is_computed[known] = True
    last = errors[-(len(errors) // 3 + 1) :]
    shape = points, points
    return LatticeMap(spline.reshape(shape), is_computed.reshape(shape), float(np.mean(last)) if last else 0.0)


def _spline(place: np.ndarray, known: list[int], values: list[float]) -> np.ndarray:
    """(nodes,) the spline at all nodes through the values at the known ones."""
    quantiles = ndtri(LEAST + (1.0 - 2.0 * LEAST) * np.array(values))
    spline = scipy.interpolate.RBFInterpolator(place[known], quantiles, kernel="thin_plate_spline")
    return np.clip((ndtr(spline(place)) - LEAST) / (1.0 - 2.0 * LEAST), 0.0, 1.0)
