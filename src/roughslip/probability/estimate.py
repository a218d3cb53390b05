"""A statistic with its 95 % interval; how much of the variance of a result each uncertain source carries.

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
from dataclasses import dataclass, field

import numpy as np
import scipy  # its parts when they are used
from scipy.special import ndtri, stdtrit

from roughslip.errors import ParameterError
from roughslip.validation import gate

TAILS = (0.025, 0.975)
"""Probabilities of the ends of a 95 % interval."""

NORMAL_95 = float(ndtri(TAILS[1]))
"""Half width of the 95 % interval of a normal variable, over its standard deviation."""

SCALE_FREEDOM = 1 / 3
"""Degrees of freedom of the variance of log std that resampled groups show, over those of a mean. Influences of
kurtosis k have 2 / (k + 2). k is 4 for Gaussian groups of three independent values each, and more for smaller ones."""

ROUNDING = 1e-9  # of the largest variance
NEGLIGIBLE = 1e-6  # of the largest variance: axes that are not drawn, as of a curve whose points hang together
RESAMPLES = 200


def student_95(samples: int | np.ndarray) -> np.ndarray:
    """Half width of Student's 95 % interval of a mean, over its standard error. samples : independent ones"""
    return np.asarray(stdtrit(np.asarray(samples) - 1, TAILS[1]))


@gate
def wilson_interval(successes: np.ndarray | float, trials: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """95 % interval of a probability from independent trials; it never leaves [0, 1].

    successes, trials : (...) 0 <= successes <= trials, fractions allowed; no trials give the interval [0, 1]

    Returns (low, high) : (...) [-]. Raises ParameterError.

    Method: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209. `scipy.stats.binomtest` takes one pair of whole numbers.
    """
    k, n = np.asarray(successes, dtype=np.float64), np.asarray(trials, dtype=np.float64)
    if not (np.isfinite(n).all() and np.all((k >= 0) & (k <= n))):
        raise ParameterError("successes must lie between none and all of the trials, which must be finite")
    squared = NORMAL_95**2
    centre = (k + squared / 2) / (n + squared)
    half = NORMAL_95 * np.sqrt(k * (n - k) / np.where(n > 0, n, 1.0) + squared / 4) / (n + squared)
    return np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0)


def interval_margin(samples: int | np.ndarray, freedom: float = 1.0) -> np.ndarray:
    """Factor on the half width of a percentile interval that makes it Student's.

    samples : independent ones, which are resampled; their replicates scatter by sqrt(1 - 1 / samples) too little
    freedom : degrees of freedom of the variance that they show, over those of a Gaussian mean, samples - 1
    """
    degrees = np.asarray(samples) - 1.0
    quantile = stdtrit(np.maximum(freedom * degrees, 1.0), TAILS[1])
    return np.asarray(quantile / ndtri(TAILS[1]) * np.sqrt(1.0 + 1.0 / degrees))


@dataclass(frozen=True)
class Estimate:
    """A statistic with its 95 % interval.

    value, low, high : (...) point estimate and ends of the interval
    replicates : (..., R) the statistic of each bootstrap replicate; empty where the interval has another source
    """

    value: np.ndarray
    low: np.ndarray
    high: np.ndarray
    replicates: np.ndarray = field(default_factory=lambda: np.empty(0))

    @classmethod
    def from_rows(cls, rows: np.ndarray, margin: float = 1.0) -> Estimate:
        """Percentile interval of the bootstrap.

        rows : (1 + R, ...) the statistic of the sample, then of replicates
        margin : factor on its distances from the value, see `interval_margin`
        """
        replicates = np.ascontiguousarray(np.moveaxis(rows[1:], 0, -1))
        low, high = rows[0] + margin * (np.quantile(replicates, TAILS, axis=-1) - rows[0])
        return cls(np.array(rows[0]), np.asarray(low), np.asarray(high), replicates)

    @classmethod
    def of_scale(cls, rows: np.ndarray, margin: float = 1.0) -> Estimate:
        """Interval of a standard deviation or a ratio to one, which a sample tends to show too small.

        Replicates lie below the value as the value lies below the truth. So the percentiles of their logarithms are
        reflected at the value: the basic interval of Davison and Hinkley, Bootstrap Methods, 1997, ch. 5.
        rows, margin : as of `from_rows`, above zero; the margin acts on logarithms
        """
        of_logarithm = cls.from_rows(np.log(rows), margin)
        low, high = 2.0 * of_logarithm.value - of_logarithm.high, 2.0 * of_logarithm.value - of_logarithm.low
        return cls(np.array(rows[0]), np.exp(low), np.exp(high), np.exp(of_logarithm.replicates))

    @classmethod
    def of_distance(cls, rows: np.ndarray, moved: np.ndarray) -> Estimate:
        """Interval of a distance (). Noise can only raise a distance, so percentiles of its replicates lie too high.

        rows : (1 + R,) distance of a curve from a model or a family of models, in some norm
        moved : (R,) distance of each resampled curve from the curve of the sample, in the same norm

        By the triangle inequality the truth lies within the 95 % quantile of `moved` (Bickel and Krieger, Journal of
        the American Statistical Association 84, 1989), cut at 0. The interval is conservative.
        """
        value, radius = rows[0], np.quantile(moved, 0.95)
        return cls(np.array(value), np.maximum(value - radius, 0.0), np.asarray(value + radius), rows[1:].copy())

    def __repr__(self) -> str:
        """`0.3001 [0.2983, 0.3024]`, or the shape of several."""
        if np.ndim(self.value):
            return f"Estimate of shape {np.shape(self.value)}"
        return "{:.4g} [{:.4g}, {:.4g}]".format(*(float(part) for part in (self.value, self.low, self.high)))

    @property
    def rows(self) -> np.ndarray:
        """(1 + R, ...) the value, then the replicates: the inverse of `from_rows`."""
        return np.concatenate((self.value[None], np.moveaxis(self.replicates, -1, 0)))


def columns_of(estimates: Estimate | Sequence[Estimate]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value, lower and upper end of an estimate; those of several stack along a first axis."""
    if isinstance(estimates, Estimate):
        return estimates.value, estimates.low, estimates.high
    value, low, high = (np.array([getattr(each, part) for each in estimates]) for part in ("value", "low", "high"))
    return value, low, high


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
        own = np.linalg.eigvalsh(relative)
        if not (np.all(relative > -1.0) and np.allclose(relative, relative.T) and own[0] >= -ROUNDING * own[-1]):
            raise ParameterError(
                f"Source.covariance of {self.name} must be symmetric, above -x_i x_j, and have no negative variance"
            )
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
    low, high = np.quantile(again, TAILS, axis=0)
    ends = [np.stack((value, low[i], high[i]), axis=-1) for i, value in enumerate((first, total))]
    return Split(np.concatenate((of_a, of_b), axis=1), ends[0], ends[1])


def _indices(of_a: np.ndarray, of_b: np.ndarray, mixed: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and total indices (results, sources) from results (results, samples) and (sources, results, samples)."""
    columns = {"f_A": of_a, "f_B": of_b, "f_AB": mixed}
    columns = {name: np.repeat(of, 2, axis=-2) for name, of in columns.items()}  # SciPy fails for one of one source
    found, shape = scipy.stats.sobol_indices(func=columns, n=of_a.shape[1]), (2 * len(of_a), len(mixed))
    return np.reshape(found.first_order, shape)[::2], np.reshape(found.total_order, shape)[::2]
