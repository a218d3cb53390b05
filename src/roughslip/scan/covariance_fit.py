"""Covariance models fitted to an estimated autocorrelation and to the spectrum, by weighted least squares.

A fit searches the logarithm of the geometric mean of the two correlation lengths. With e half the logarithm of their
ratio, it also searches e cos(2 lay) and e sin(2 lay), which stay smooth where the surface is isotropic.

Lags determine lengths and lay, but hardly a smoothness or a Hurst exponent: a spectrum that is ten times too high at
short waves still fits them. Rings of the spectrum determine the shape, but no directions, and they distort lengths
where a model does not hold. So with rings the shape is the best for both, with lengths and lay fitted to the lags at
that shape, and models are compared by both. Each sum of squares is weighted by its effective number of independent
estimates: of n whose errors, from leaving out parts of the scan, have the correlation R, it is (tr R)^2 / tr R^2.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares, minimize_scalar

from roughslip.errors import ConvergenceError, IllPosedError, ParameterError
from roughslip.probability.estimate import student_95
from roughslip.results import described, result
from roughslip.scan.autocorrelation import Autocorrelation
from roughslip.scan.statistics import HIGHEST, LEAKAGE, ROLL_OFF, ScanStatistics, rings
from roughslip.scan.topography import Topography
from roughslip.surface.covariance import Covariance
from roughslip.surface.models import MODELS
from roughslip.validation import gate

MOST_ANISOTROPIC = 2.5  # bound of half the logarithm of the ratio of lengths: 1 to 150
NEAR_BOUND = 0.01  # share of the range of a shape
NEAR_LAGS = 0.3  # correlation above which lags enter the first guess
MOST_LAGS = 4000  # of both signs: more say the same again, at a cost
DIRECTIONS = 4  # in which the lags across an endless lay are taken, so that fits find them isotropic


@result
class CovarianceFit:
    """A fitted model, and how well it fits."""

    covariance: Covariance = described("the model")
    misfit: float = described(
        "root mean square of (estimate - model) / standard error over the lags; near 1 where the model holds"
    )
    spectrum_misfit: float = described("the same of the logarithms of the powers of rings; zero without rings")
    criterion: float = described(
        "n' misfit^2 + m' spectrum_misfit^2 + p ln(n' + m'), the Bayesian information criterion of n' "
        "lags and m' rings that are independent in effect; smallest is best",
    )


@dataclass(frozen=True)
class Lags:
    """An estimated autocorrelation at the lags of one half plane, without lag zero, whose correlation is exactly 1.

    x, y : (n,) [m] lags
    correlation : (n,) [-]
    standard_error : (n,) [-] positive
    number : n' that are independent in effect
    """

    x: np.ndarray
    y: np.ndarray
    correlation: np.ndarray
    standard_error: np.ndarray
    number: float

    def distance(self, covariance: Covariance) -> np.ndarray:
        """(n,) a model less the estimate, in standard errors."""
        correlation = covariance(self.x, self.y) / covariance.rms_height_m**2
        return np.asarray((correlation - self.correlation) / self.standard_error)


@dataclass(frozen=True)
class RingPowers:
    """An estimated spectrum, averaged over rings of wave vectors.

    power : (m,) [m^4] positive
    standard_error : (m,) [-] of its logarithm, positive
    number : m' that are independent in effect
    expected : the powers (m,) [m^4] of a model on the same rings
    """

    power: np.ndarray
    standard_error: np.ndarray
    number: float
    expected: Callable[[Covariance], np.ndarray]

    def distance(self, covariance: Covariance) -> np.ndarray:
        """(m,) logarithm of the power of a model over the estimated one, in standard errors."""
        model = np.maximum(self.expected(covariance), np.finfo(float).tiny)  # a gaussian may underflow
        return np.asarray(np.log(model / self.power) / self.standard_error)


def fit_covariance(
    kind: str, lags: Lags, rms_height_m: float, rings: RingPowers | None, cutoff_wavelength_m: float
) -> CovarianceFit:
    """Least squares of (estimate - model) / standard error.

    kind : of the model
    lags : estimated autocorrelation
    rms_height_m : Sq [m], not fitted: correlations do not hold it
    rings : powers of the spectrum that determine its shape and count in its criterion
    cutoff_wavelength_m : of self_affine [m], not fitted: geometric mean of both axes, such as twice the pixel

    Returns the fit of two lengths and a lay. Raises IllPosedError where there are too few lags, ConvergenceError where
    the search fails, ParameterError for another kind.
    """
    if kind not in MODELS:
        raise ParameterError(f"there is no covariance {kind!r}; choose one of {', '.join(MODELS)}")
    model = MODELS[kind]
    start, low, high = _start_and_bounds(model, lags)
    n, p = len(lags.x), len(start)

    def build(parameters: np.ndarray) -> Covariance:
        """The model of a vector of parameters: (log mean length, e cos 2 lay, e sin 2 lay, shape)."""
        mean, cos, sin = map(float, parameters[:3])
        e, lay, shape = math.hypot(cos, sin), 0.5 * math.atan2(sin, cos), None
        if model.fitted_shape is not None:
            least, most = model.shapes[model.fitted_shape.name]
            value = math.exp(parameters[3]) if model.fitted_shape.logarithmic else float(parameters[3])
            shape = min(max(value, least), most)  # the exponential of a bound may round past it
        return model.of_fit(rms_height_m, math.exp(mean + e), math.exp(mean - e), lay, shape, cutoff_wavelength_m)

    def of_lags(parameters: np.ndarray) -> np.ndarray:
        return math.sqrt(lags.number / n) * lags.distance(build(parameters))

    def of_rings(parameters: np.ndarray) -> np.ndarray:
        if rings is None:
            return np.zeros(0)
        return math.sqrt(rings.number / len(rings.power)) * rings.distance(build(parameters))

    x = _solved(model, of_lags, start, low, high)
    if rings is not None and model.fitted_shape is not None:
        x = _profiled(model, of_lags, of_rings, x, low, high)
    number, number_of_rings = lags.number, 0.0 if rings is None else rings.number
    squares, squares_of_rings = np.sum(of_lags(x) ** 2), np.sum(of_rings(x) ** 2)
    return CovarianceFit(
        build(x),
        misfit=math.sqrt(squares / number),
        spectrum_misfit=math.sqrt(squares_of_rings / number_of_rings) if number_of_rings else 0.0,
        criterion=float(squares + squares_of_rings + p * math.log(number + number_of_rings)),
    )


@gate
def fitted_covariances(
    kinds: Sequence[str], scan: Topography, statistics: ScanStatistics
) -> tuple[list[CovarianceFit], list[str]]:
    """Fits of the kinds that can be fitted, the best first, and why the others cannot.

    A self_affine spectrum goes on to the highest wavenumber of the scan. With an endless lay the fits are those of
    the profile across it, isotropic and without rings. Raises IllPosedError where none can be.
    """
    endless, rms_height_m = statistics.sub_areas.endless, float(statistics.rms_height.value)
    lags = lags_to_fit(statistics.autocorrelation, endless)
    powers = rings_to_fit(scan, statistics) if endless is None else None
    fits: list[CovarianceFit] = []
    refused: dict[str, list[str]] = {}  # kinds by the reason
    for kind in kinds:
        try:
            fits.append(fit_covariance(kind, lags, rms_height_m, powers, 2.0 * math.sqrt(scan.dx * scan.dy)))
        except (IllPosedError, ConvergenceError) as error:
            refused.setdefault(str(error), []).append(kind)
    reasons = [f"{', '.join(names)}: {reason}" for reason, names in refused.items()]
    if not fits:
        text = f"no model fits the autocorrelation; take the measured one ({'; '.join(reasons)})"
        raise IllPosedError(text, scene_keys="roughness.scan.covariance")
    return sorted(fits, key=lambda fit: fit.criterion), reasons


def _start_and_bounds(model: type[Covariance], lags: Lags) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First guess from the quadratic form x'Gx = (-ln r)^(2/alpha) of near lags: alpha = 2 gaussian, 1 exponential."""
    near = (lags.correlation > NEAR_LAGS) & (lags.correlation < 0.999)
    if near.sum() < 3:
        raise IllPosedError(f"fewer than 3 lags have correlations above {NEAR_LAGS}: give shorter lags")
    form = (-np.log(lags.correlation[near])) ** model.quadratic_power
    x, y = lags.x[near], lags.y[near]
    squares = np.stack((x**2 + y**2, x**2 - y**2, 2 * x * y))
    weights = 1 / np.sum(squares[0])
    trace, difference, mixed = np.linalg.lstsq(squares.T * weights, form * weights, rcond=None)[0]
    unequal = math.hypot(difference, mixed)
    trace = max(trace, 1e-6 / np.max(squares[0]))
    ratio = min(unequal / trace, 0.98)  # the form may be indefinite where estimates scatter
    logs = 0.25 * math.log((1 + ratio) / (1 - ratio))
    longest = math.sqrt(np.max(lags.x**2 + lags.y**2))
    shortest = math.sqrt(np.min(lags.x**2 + lags.y**2))
    angle = math.atan2(-mixed, -difference)  # of twice the lay: the form is smallest along it
    parameters = [
        -0.25 * math.log(trace**2 * (1 - ratio**2)) + math.log(model.fitted_ratio),
        logs * math.cos(angle),
        logs * math.sin(angle),
    ]
    low = [math.log(shortest / 100), -MOST_ANISOTROPIC, -MOST_ANISOTROPIC]
    high = [math.log(100 * longest), MOST_ANISOTROPIC, MOST_ANISOTROPIC]
    if model.fitted_shape is not None:
        name, start, logarithmic = model.fitted_shape
        scaled = [math.log(value) if logarithmic else value for value in (start, *model.shapes[name])]
        for row, value in zip((parameters, low, high), scaled, strict=True):
            row.append(value)
    bounds = np.array(low), np.array(high)
    return np.clip(parameters, bounds[0] + 1e-3, bounds[1] - 1e-3), *bounds


def _solved(
    model: type[Covariance],
    residual: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    solution = least_squares(residual, start, bounds=(low, high), x_scale="jac", xtol=1e-12, ftol=1e-12, gtol=1e-12)
    if not solution.success:
        text = f"the fit of {model.kind} did not converge: use another kind, or lags that are still correlated"
        raise ConvergenceError(text, float(solution.optimality), int(solution.nfev))
    return np.asarray(solution.x)


def _profiled(
    model: type[Covariance],
    of_lags: Callable[[np.ndarray], np.ndarray],
    of_rings: Callable[[np.ndarray], np.ndarray],
    start: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
) -> np.ndarray:
    """Parameters: the shape best for lags and rings, the others for lags at it."""

    def at(shape: float) -> np.ndarray:
        others = _solved(model, lambda x: of_lags(np.append(x, shape)), start[:-1], low[:-1], high[:-1])
        return np.append(others, shape)

    def total(shape: float) -> float:
        x = at(shape)
        return float(np.sum(np.concatenate((of_lags(x), of_rings(x))) ** 2))

    optimum = minimize_scalar(total, bounds=(low[-1], high[-1]), method="bounded", options={"xatol": 1e-5})
    if not optimum.success:
        text = f"the fit of {model.kind} to rings did not converge: use another kind, or fit without rings"
        raise ConvergenceError(text, float(optimum.fun), int(optimum.nfev))
    shape = float(optimum.x)
    bound = float(min(low[-1], high[-1], key=lambda end: abs(shape - end)))
    if abs(shape - bound) < NEAR_BOUND * (high[-1] - low[-1]):  # the search never ends at one
        shape = min(bound, shape, key=total)
    return at(shape)


def lags_to_fit(estimate: Autocorrelation, endless: int | None = None) -> Lags:
    """Estimates at every lag, or every second, third ... on each axis where these are too many.

    endless : axis of an endless lay. Lags across it are taken, each in several directions, so that fits find them
        isotropic. The effective number of estimates does not change, since copies err together
    """
    step = math.ceil(math.sqrt(estimate.rows[0].size / MOST_LAGS))
    kept = tuple(slice(n // 2 % step, None, step) for n in estimate.rows[0].shape)
    reach = estimate.correlation.high - estimate.correlation.low
    error = (reach / (2 * student_95(len(estimate.rows) - 1)))[kept]
    rows, lags = estimate.rows[(slice(None), *kept)], (estimate.lag_x[kept[0]], estimate.lag_y[kept[1]])
    if endless is None:
        x, y = np.meshgrid(*lags, indexing="ij")
        half = (x > 0) | ((x == 0) & (y > 0))
        x, y, rows, error = x[half], y[half], rows[:, half], error[half]
    else:
        middle = error.shape[endless] // 2
        rows, error, across = (
            np.take(rows, middle, 1 + endless),
            np.take(error, middle, endless),
            lags[1 - endless],
        )
        outer, angles = across > 0, np.arange(DIRECTIONS) * math.pi / DIRECTIONS
        x, y = (np.outer(part, across[outer]).ravel() for part in (np.cos(angles), np.sin(angles)))
        rows, error = np.tile(rows[:, outer], DIRECTIONS), np.tile(error[outer], DIRECTIONS)
    return Lags(x, y, rows[0], error, effective_number(rows[1:], error))


def rings_to_fit(scan: Topography, statistics: ScanStatistics) -> RingPowers | None:
    """Powers of the rings to which lags are not sensitive; None where the scan has fewer than two of them.

    The band starts at ROLL_OFF over the shorter length and ends at HIGHEST of the highest wavenumber. Rings below the
    side lobes of the window are left out.
    """
    parts, power = statistics.sub_areas, statistics.spectrum.power
    q = statistics.spectrum.wavenumber
    kept = (q >= ROLL_OFF / min(parts.extent)) & (q <= HIGHEST * math.pi / max(scan.dx, scan.dy))
    kept &= power.value > LEAKAGE * power.value.max()
    if kept.sum() < 2:
        return None
    over = rings(scan.grid, parts)
    error = np.log(power.high / power.low)[kept] / (2 * student_95(parts.number))
    number = effective_number(np.log(statistics.spectrum.rows[1:, kept]), error)
    return RingPowers(power.value[kept], error, number, lambda model: over.expected(model.spectrum)[kept])


def effective_number(without_part: np.ndarray, standard_error: np.ndarray) -> float:
    """n' of the module's heading.

    without_part : (B, n) estimates without each part of the scan
    """
    parts = len(without_part)
    errors = math.sqrt((parts - 1) / parts) * (without_part - without_part.mean(axis=0)) / standard_error
    gram = errors @ errors.T
    return float(max(np.trace(gram) ** 2 / np.sum(gram**2), 1.0 + 1e-9))
