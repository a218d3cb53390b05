"""How many runs, and how many nodes of their friction paths, an accuracy asked of mean counts takes.

Few runs show how the counts scatter, and how they follow the standard deviation of friction: each path is run with
its scatter a quarter larger, and as much smaller. Between its nodes an interpolated path scatters less than the process
does, by a share that its covariance gives. The mean counts then err by this share times their derivative by the
logarithm of the standard deviation. Sums over many nodes lose less of their scatter, so that this bounds the error::

    w(runs, nodes) = t_95(runs) sigma / sqrt(runs) + |dM / d log std| missing_scatter(nodes)

A path that is read at half its nodes is no measure of it. Near the limit of existence a motion forgets the details of
a path within a few cycles. It then counts like another path.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from roughslip.limits import MOST_RUNS
from roughslip.probability.estimate import student_95, variance_margin

SCATTER_FACTOR = 1.25  # of the standard deviation of friction in half of the pilot; its inverse in the other half
NODES_SHARE = 0.25  # of the accuracy, for the nodes of the paths
NUMBERS_OF_NODES = (2, 4, 8, 16, 32, 64)
FEWEST_RUNS = 8


def missing_scatter(nodes: int) -> float:
    """Share of the standard deviation that a path of so many nodes a correlation length misses between them.

    For the autocorrelation exp(-s / L), and the weights of `oscillator.path` of four nodes in a row.
    """
    correlation = np.exp(-np.abs(np.subtract.outer(np.arange(4), np.arange(4))) / nodes)
    t = (np.arange(64) + 0.5) / 64
    before, after = 0.5 * t * (1 - t) ** 2, 0.5 * t**2 * (1 - t)
    start, end = 1 - 2.5 * t**2 + 1.5 * t**3, 0.5 * t + 2 * t**2 - 1.5 * t**3
    weights = np.array([-before, start, end, -after])
    return 1.0 - float(np.sqrt(np.einsum("it,ij,jt->t", weights, correlation, weights)).mean())


@dataclass(frozen=True, eq=False)
class RunErrors:
    """Errors of the mean counts, from a pilot.

    deviation : (dampings,) standard deviation of the counts of a run
    slope : largest derivative of a mean count by the logarithm of the standard deviation of friction, 95 % bound
    pilot : runs of the pilot for each damping ratio and scatter
    """

    deviation: np.ndarray
    slope: float
    pilot: int

    @classmethod
    def of_pilot(cls, counts: np.ndarray) -> RunErrors:
        """From counts (2, runs, dampings) of the same paths with less scatter of friction and with more."""
        runs = counts.shape[1]
        slope = (counts[1] - counts[0]) / (2 * math.log(SCATTER_FACTOR))
        bounds = np.abs(slope.mean(axis=0)) + 2 * slope.std(axis=0, ddof=1) / math.sqrt(runs)
        return cls(np.sqrt(counts.var(axis=1, ddof=1).mean(axis=0)), float(np.max(bounds)), runs)

    def from_nodes(self, nodes: int) -> float:
        """Error of the mean counts, at most, from the nodes of the paths."""
        return self.slope * missing_scatter(nodes)

    def from_runs(self, runs: int, *, safe: bool = True) -> float:
        """Largest half width of Student's 95 % interval of the mean counts of so many runs.

        safe : whether to allow for the own error of the pilot, else as expected
        """
        margin = math.sqrt(variance_margin(self.pilot)) if safe else 1.0
        return margin * float(self.deviation.max()) * float(student_95(runs)) / math.sqrt(runs)

    def runs_for(self, largest: float) -> int:
        """Runs with which no half width is above `largest`; more than MOST_RUNS stand for any number above that."""
        runs = FEWEST_RUNS
        while runs <= MOST_RUNS and self.from_runs(runs) > largest:
            runs = math.ceil(1.02 * runs)
        return runs

    def numbers(
        self, asked: float, nodes: int | None, runs: int | None, limits: tuple[int, int]
    ) -> tuple[int, int] | None:
        """The fewest nodes and runs that keep the accuracy asked, in cycles; None where it takes too many runs.

        nodes, runs : where they are given
        limits : fewest and most runs
        """
        enough = (number for number in NUMBERS_OF_NODES if self.from_nodes(number) <= NODES_SHARE * asked)
        nodes = next(enough, NUMBERS_OF_NODES[-1]) if nodes is None else nodes
        if runs is None:
            runs = max(self.runs_for(asked - self.from_nodes(nodes)), limits[0])
            if runs > limits[1]:
                return None
        return nodes, runs
