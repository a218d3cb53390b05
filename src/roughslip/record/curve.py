"""Mean friction over speed: Stribeck's law of the scenes, or a penalised spline where that law does not fit.

All least squares are of whitened columns, so tests and errors take the correlation of the scatter into account.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import scipy

from roughslip.oscillator.table_law import TableLaw
from roughslip.probability.estimate import NORMAL_95
from roughslip.results import described, result

MOST_COLUMNS = 9  # of the spline
KNOTS = 30  # of the stored curve
SAME_SPEED = 0.02  # of a speed: nearer speeds are one level
SIGNIFICANT = 0.01  # p-value of the misfit below which Stribeck's law is left
DECAYS = 60  # tried, from a hundredth to a hundred times the inverse of the middle speed
PENALTIES = np.logspace(-4, 6, 41)

Whiten = Callable[[np.ndarray], np.ndarray]


@result
class FrictionCurve:
    """Mean friction against sliding speed, over the speeds that were measured."""

    form: str = described("stribeck, the law of the scene, or spline, where that law does not fit")
    speeds_m_per_s: np.ndarray = described(
        "increasing speeds, from the slowest to the fastest measured", "m/s", "speed"
    )
    friction: np.ndarray = described("mean friction coefficient at the speeds", "1", "speed")
    factor: np.ndarray = described("F, with F F' the covariance of the curve", "1", "speed draw")
    misfit: float = described("p-value of the hypothesis that Stribeck's law fits")
    at_rest: float = described(
        "friction towards rest, where no record measures: of Stribeck's law; of a spline as at the slowest speed"
    )
    factor_at_rest: np.ndarray = described("the row of the factor at rest", "1", "draw")

    def interval(self) -> tuple[np.ndarray, np.ndarray]:
        """Ends : (K,) [-] of the pointwise 95 % intervals."""
        half = NORMAL_95 * np.sqrt(np.sum(self.factor**2, axis=1))
        return self.friction - half, self.friction + half

    def law(self, static_friction: float = 0.0) -> TableLaw:
        """The curve as a friction law, from rest on; beyond the speeds measured friction is constant.

        static_friction : limit of stick, where it is larger than the friction at the slowest speed
        """
        static = max(static_friction, float(self.friction[0]))
        speeds = (0.0, *self.speeds_m_per_s.tolist())
        values = (min(self.at_rest, static), *self.friction.tolist())
        return TableLaw(speeds, values, static, measured_from_m_per_s=speeds[1])


class SpeedBasis:
    """Cubic B-splines of the logarithm of speed, with knots at quantiles of the speeds measured.

    speeds : (n,) [m/s] positive. Fewer levels of speed allow fewer columns; one level has the constant alone.
    """

    def __init__(self, speeds: np.ndarray) -> None:
        ordered = np.sort(speeds)
        self.slowest, self.fastest = float(ordered[0]), float(ordered[-1])
        levels = 1 + np.count_nonzero(np.diff(np.unique(np.round(np.log(ordered) / SAME_SPEED))))
        self.columns = min(int(levels), MOST_COLUMNS)
        degree = min(3, self.columns - 1)
        inner = self.columns - degree - 1
        shares = np.linspace(0.0, 1.0, inner + 2)[1:-1]
        span = np.log([self.slowest * (1.0 - 1e-9), self.fastest * (1.0 + 1e-9)])
        # between quantiles and equal distances: each column needs data, and a curve needs columns where it bends
        knots = 0.5 * (np.log(np.quantile(ordered, shares)) + span[0] + shares * (span[1] - span[0]))
        self._knots = np.concatenate([np.repeat(span[0], degree + 1), knots, np.repeat(span[1], degree + 1)])
        self._degree = degree

    def at(self, speeds: np.ndarray) -> np.ndarray:
        """(n, columns) the splines at speeds [m/s] within the range measured."""
        places = np.log(np.clip(speeds, self.slowest, self.fastest))
        return np.asarray(scipy.interpolate.BSpline.design_matrix(places, self._knots, self._degree).toarray())

    def knots(self) -> np.ndarray:
        """(K,) [m/s] speeds at which the curve is stored."""
        fastest = max(self.fastest, self.slowest * (1.0 + SAME_SPEED))
        return (
            np.geomspace(self.slowest, self.fastest, KNOTS) if self.columns > 1 else np.array([self.slowest, fastest])
        )


def stribeck_columns(speeds: np.ndarray, decay: float) -> np.ndarray:
    """(n, 3) what a constant, the decaying part and the quadratic part of Stribeck's law multiply."""
    return np.column_stack([np.ones(speeds.size), 1.0 / (1.0 + decay * speeds), speeds**2])


def left(white: np.ndarray, target: np.ndarray) -> np.ndarray:
    """What whitened columns leave of whitened targets."""
    basis = scipy.linalg.orth(white / np.linalg.norm(white, axis=0))
    return np.asarray(target - basis @ (basis.T @ target))


def f_test(target: np.ndarray, simple: np.ndarray, more: np.ndarray, number: int) -> float:
    """The p-value that further whitened columns, `number` of them independent, explain nothing of the target."""
    full = np.column_stack([simple, more])
    squares, least = (float(np.sum(left(columns, target) ** 2)) for columns in (simple, full))
    freedom = target.size - full.shape[1]
    return float(scipy.stats.f.sf((squares - least) / number / (least / freedom), number, freedom))


def fitted_curve(speeds: np.ndarray, target: np.ndarray, others: np.ndarray, whiten: Whiten) -> FrictionCurve:
    """The curve over the speeds measured, the simpler form first.

    speeds : (n,) [m/s]; target : (n,) friction, whitened
    others : (n, k) regressors that are no part of the curve, such as drift
    whiten : makes regressors those of the target
    """
    basis = SpeedBasis(speeds)
    spline = basis.at(speeds)
    of_spline, of_rest = np.split(whiten(np.column_stack([spline, others])), [basis.columns], axis=1)
    knots = basis.knots()
    if basis.columns < 5:  # no more levels than the law has numbers: nothing tests it
        return _spline_curve(basis, knots, target, of_spline, of_rest, np.nan)
    middle = float(np.sqrt(basis.slowest * basis.fastest))
    decays = np.geomspace(0.01, 100.0, DECAYS) / middle
    fixed = np.column_stack([whiten(np.column_stack([np.ones(speeds.size), speeds**2])), of_rest])

    def squares(log_decay: float) -> float:
        part = whiten(1.0 / (1.0 + np.exp(log_decay) * speeds[:, None]))
        return float(np.sum(left(np.column_stack([fixed, part]), target) ** 2))

    tried = [squares(log_decay) for log_decay in np.log(decays)]
    near = np.log(decays[np.clip(int(np.argmin(tried)) + np.array([-1, 1]), 0, DECAYS - 1)])
    decay = float(np.exp(scipy.optimize.minimize_scalar(squares, bounds=near, method="bounded").x))
    of_law = whiten(stribeck_columns(speeds, decay))
    misfit = f_test(target, np.column_stack([of_law, of_rest]), of_spline, basis.columns - 3)
    if misfit < SIGNIFICANT:
        return _spline_curve(basis, knots, target, of_spline, of_rest, misfit)
    coefficients = np.linalg.lstsq(np.column_stack([of_law, of_rest]), target, rcond=None)[0]
    # The errors are those of the law made linear in the logarithm of its decay, too.
    places = np.append(0.0, knots)
    bend, bent = (-coefficients[1] * decay * v / (1.0 + decay * v) ** 2 for v in (speeds, places))
    factor = _root_of_inverse(np.column_stack([of_law, whiten(bend[:, None]), of_rest]))[:4]
    columns = stribeck_columns(places, decay)
    found, root = columns @ coefficients[:3], np.column_stack([columns, bent]) @ factor
    rest = 0 if found[0] > 0.0 else 1
    return FrictionCurve("stribeck", knots, found[1:], root[1:], misfit, float(found[rest]), root[rest])


def _spline_curve(
    basis: SpeedBasis, knots: np.ndarray, target: np.ndarray, white: np.ndarray, others: np.ndarray, misfit: float
) -> FrictionCurve:
    """A spline whose second differences are penalised as generalised cross-validation asks (P. Craven & G. Wahba,
    Numer. Math. 31 (1979) 377; P. H. C. Eilers & B. D. Marx, Statist. Sci. 11 (1996) 89).

    Its errors are those of the Bayesian covariance, which hold bias as well (D. Nychka, JASA 83 (1988) 1134).
    """
    columns = np.column_stack([white, others])
    rough = np.zeros((max(basis.columns - 2, 0), columns.shape[1]))
    if basis.columns > 2:
        rough[:, : basis.columns] = np.diff(np.eye(basis.columns), 2, axis=0)
    gram, product, n = columns.T @ columns, columns.T @ target, target.size

    def score(penalty: float) -> float:
        inverse = np.linalg.pinv(gram + penalty * (rough.T @ rough), hermitian=True)
        coefficients = inverse @ product
        return float(np.sum((target - columns @ coefficients) ** 2) / (n - np.trace(inverse @ gram)) ** 2)

    penalty = min(PENALTIES * np.trace(gram) / len(gram) * 1e-3, key=score) if basis.columns > 3 else 0.0
    stacked = np.vstack([columns, np.sqrt(penalty) * rough])
    coefficients = np.linalg.lstsq(stacked, np.append(target, np.zeros(len(rough))), rcond=None)[0]
    at_knots = basis.at(knots)
    friction, root = at_knots @ coefficients[: basis.columns], at_knots @ _root_of_inverse(stacked)[: basis.columns]
    return FrictionCurve("spline", knots, friction, root, misfit, float(friction[0]), root[0])


def _root_of_inverse(columns: np.ndarray) -> np.ndarray:
    """F with F F' the covariance of least squares coefficients of columns with unit errors."""
    norms = np.linalg.norm(columns, axis=0)
    _, singular, right = np.linalg.svd(columns / norms, full_matrices=False)
    kept = singular > 1e-10 * singular[0]
    return np.asarray((right[kept].T / singular[kept]) / norms[:, None])
