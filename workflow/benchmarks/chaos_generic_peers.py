"""The sparse chaos of OpenTURNS, as its documentation says: least-angle regression, corrected leave-one-out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

Found = tuple[Callable[[np.ndarray], np.ndarray], int]


class Lars:
    """Candidates of a degree and norm; called with points and target it returns the expansion and its terms."""

    def __init__(self, families: Sequence[str], degree: int, norm: float) -> None:
        import openturns as ot

        ot.TBB.Disable()
        ot.Log.Show(ot.Log.NONE)
        self.ot = ot
        factories = {"hermite": ot.HermiteFactory, "legendre": ot.LegendreFactory}
        laws = {"hermite": ot.Normal, "legendre": lambda: ot.Uniform(-1.0, 1.0)}
        variables = len(families)
        self.enumerate = (
            ot.LinearEnumerateFunction(variables)
            if norm == 1
            else ot.HyperbolicAnisotropicEnumerateFunction(variables, norm)
        )
        self.basis = ot.OrthogonalProductPolynomialFactory([factories[f]() for f in families], self.enumerate)
        self.law = ot.JointDistribution([laws[f]() for f in families])
        self.size = self.enumerate.getMaximumDegreeCardinal(degree) if norm == 1 else self._size(degree, norm)

    def _size(self, degree: int, norm: float) -> int:
        """Terms of the degree: it lists them by their norm."""
        size = 0
        while np.sum(np.array(self.enumerate(size)) ** norm) <= degree**norm * (1 + 1e-12):
            size += 1
        return size

    def exponents(self) -> set[tuple[int, ...]]:
        """Of its candidates."""
        return {tuple(self.enumerate(number)) for number in range(self.size)}

    def __call__(self, points: np.ndarray, target: np.ndarray) -> Found:
        ot = self.ot
        selection = ot.LeastSquaresMetaModelSelectionFactory(ot.LARS(), ot.CorrectedLeaveOneOut())
        algorithm = ot.FunctionalChaosAlgorithm(
            ot.Sample(points),
            ot.Sample(target[:, None]),
            self.law,
            ot.FixedStrategy(self.basis, self.size),
            ot.LeastSquaresStrategy(selection),
        )
        algorithm.run()
        result = algorithm.getResult()
        model = result.getMetaModel()
        return lambda x: np.array(model(ot.Sample(x)))[:, 0], len(result.getIndices())


PEERS = {"openturns/lars": Lars}
