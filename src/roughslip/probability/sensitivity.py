"""What is uncertain, by source, and how much of the variance of a result each source carries: Sobol' indices.

A positive input with the value x and the standard uncertainty u is lognormal with the mean x and the standard deviation
u. For small u / x this is the normal distribution of JCGM 101:2008, 6.4.7; for large ones it stays positive. Inputs of
one source may depend on each other. Their covariance C gives that of the logarithms, ln(1 + C_ij / (x_i x_j)). Sources
are independent, so that for a result f the variance splits (I. M. Sobol', Math. Comput. Simul. 55 (2001) 271):

    first_i = Var(E[f | source i]) / Var f,      total_i = 1 - Var(E[f | all others]) / Var f.

The first index is what exact knowledge of the source is expected to take away of the variance. Estimators are those of
`scipy.stats.sobol_indices` (A. Saltelli et al., Comput. Phys. Commun. 181 (2010) 259), at scrambled Sobol' points.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ParameterError
from roughslip.validation import gate

ROUNDING = 1e-9  # of the largest variance
NEGLIGIBLE = 1e-6  # of the largest variance: axes that are not drawn, as of a curve whose points hang together
RESAMPLES = 200
Values = Mapping[str, float]


@gate
@dataclass(frozen=True)
class Source:
    """Inputs that are uncertain together.

    name : of the source, as a budget shows it
    values : of its inputs by name, positive
    covariance : (inputs, inputs) of these, in the same order; the square of a standard uncertainty on its diagonal
    """

    name: str
    values: Mapping[str, float]
    covariance: np.ndarray

    def __post_init__(self) -> None:
        size, x = len(self.values), np.array(list(self.values.values()), dtype=np.float64)
        if self.covariance.shape != (size, size) or not size:
            raise ParameterError(f"Source.covariance must be {size} x {size}, not {self.covariance.shape}")
        if not (np.isfinite(x).all() and np.all(x > 0.0)):
            raise ParameterError(f"Source.values must be finite and positive, not {x.tolist()}")
        relative = self.covariance / np.outer(x, x)
        if not (np.all(relative > -1.0) and np.allclose(relative, relative.T)):
            raise ParameterError(f"Source.covariance of {self.name} must be symmetric, and above -x_i x_j")
        own = np.linalg.eigvalsh(relative)
        if own[0] < -ROUNDING * own[-1]:
            raise ParameterError(f"Source.covariance of {self.name} is none: it has a negative variance")
        variance, axes = np.linalg.eigh(np.log1p(relative))  # negative ones are of second order in u / x
        kept = variance > NEGLIGIBLE * variance[-1]
        object.__setattr__(self, "_root", axes[:, kept] * np.sqrt(variance[kept]))
        object.__setattr__(self, "_median", x * np.exp(-0.5 * np.log1p(np.diag(relative))))

    @classmethod
    @gate
    def independent(cls, name: str, inputs: Mapping[str, tuple[float, float]]) -> Source:
        """A source of independent inputs. inputs : value and standard uncertainty by name"""
        uncertainties = np.array([pair[1] for pair in inputs.values()], dtype=np.float64)
        return cls(name, {key: float(pair[0]) for key, pair in inputs.items()}, np.diag(uncertainties**2))

    @property
    def axes(self) -> int:
        """Independent variables that its inputs depend on: the rank of the covariance."""
        return int(self._root.shape[1])  # type: ignore[attr-defined]

    @gate
    def drawn(self, normal: np.ndarray) -> dict[str, np.ndarray]:
        """Inputs (samples,) by name, from independent standard normal variables.

        normal : (axes, samples)
        """
        drawn = self._median[:, None] * np.exp(self._root @ normal)  # type: ignore[attr-defined]
        return dict(zip(self.values, drawn, strict=True))


@dataclass(frozen=True)
class Split:
    """Results at drawn inputs, and the parts of their variance.

    drawn : (results, draws) independent of each other, for means and quantiles
    first, total : (results, sources, 3) indices with their 95 % intervals, by resampling; 0 of a constant result
    """

    drawn: np.ndarray
    first: np.ndarray
    total: np.ndarray


@gate
def variance_split(
    function: Callable[[Mapping[str, float]], Sequence[float]],
    sources: Sequence[Source],
    samples: int = 128,
    seed: Sequence[int] = (0,),
) -> Split:
    """Sobol' indices of the results of a function, by sources.

    function : of values of all inputs by name; finite results
    samples : a power of two; the function is called (sources + 2) samples times, or once without sources
    seed : of the points

    Raises ParameterError for samples that are no power of two, or an input in two sources.
    """
    names = [name for source in sources for name in source.values]
    if len(set(names)) < len(names):
        raise ParameterError("no input may stand in two sources")
    if samples < 2 or samples & (samples - 1):
        raise ParameterError(f"samples must be a power of two, not {samples}")
    if not sources:
        once = np.array(function({}), dtype=np.float64)[:, None]
        return Split(once, np.zeros((len(once), 0, 3)), np.zeros((len(once), 0, 3)))
    generator = np.random.default_rng([*seed])
    points = scipy.stats.qmc.Sobol(2 * sum(source.axes for source in sources), rng=generator).random(samples).T
    normal = scipy.special.ndtri(np.clip(points, 1e-12, 1.0 - 1e-12))

    def at(rows: np.ndarray) -> list[dict[str, np.ndarray]]:
        ends = np.cumsum([0, *(source.axes for source in sources)])
        return [source.drawn(rows[ends[i] : ends[i + 1]]) for i, source in enumerate(sources)]

    def results(inputs: Sequence[Mapping[str, np.ndarray]]) -> np.ndarray:
        columns = {name: values for of_source in inputs for name, values in of_source.items()}
        outputs = [function({name: float(values[row]) for name, values in columns.items()}) for row in range(samples)]
        return np.array(outputs, dtype=np.float64).T

    a, b = (at(rows) for rows in np.split(normal, 2))
    of_a, of_b = results(a), results(b)
    mixed = np.array([results([*a[:i], b[i], *a[i + 1 :]]) for i in range(len(sources))])
    first, total = _indices(of_a, of_b, mixed)
    rows = generator.integers(samples, size=(RESAMPLES, samples))
    again = np.array([_indices(of_a[:, row], of_b[:, row], mixed[:, :, row]) for row in rows])
    low, high = np.quantile(again, (0.025, 0.975), axis=0)
    ends = [np.stack((value, low[i], high[i]), axis=-1) for i, value in enumerate((first, total))]
    return Split(np.concatenate((of_a, of_b), axis=1), ends[0], ends[1])


def _indices(of_a: np.ndarray, of_b: np.ndarray, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and total indices (results, sources) from results (results, samples) and (sources, results, samples)."""
    columns = {"f_A": of_a, "f_B": of_b, "f_AB": mixed}
    indices = scipy.stats.sobol_indices(func=columns, n=of_a.shape[1])
    shape = len(of_a), len(mixed)
    return np.reshape(indices.first_order, shape), np.reshape(indices.total_order, shape)
