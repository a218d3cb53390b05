"""Stationary covariance of surface heights: the base of all closed models, and where a rigid plane stands.

A closed model is a function of the scaled lag (a, b) = (x'/l, y'/l'), with x' along the lay and y' across it. At one
correlation length it has fallen to 1/e. Spectra are S(q) = int C(x) exp(-i q.x) dx, so that Sq^2 = int S dq / (2 pi)^2.
The models stand in `roughslip.surface.models`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar, NamedTuple, Protocol, Self

import numpy as np
import scipy  # its parts when they are used: `scipy.optimize` and `scipy.special` take half a second to import

from roughslip.errors import ParameterError, real
from roughslip.validation import gate, positive, reals

NEGLIGIBLE = 1e-15  # correlation that counts as none


class FittedShape(NamedTuple):
    """The shape parameter that a fit searches: its name, its first value, and whether its logarithm is searched."""

    name: str
    start: float
    logarithmic: bool


class StationaryCovariance(Protocol):
    """What sampling and expansion need of a covariance."""

    @property
    def rms_height_m(self) -> float:
        """Sq [m]."""

    @property
    def separable(self) -> bool:
        """Whether C(x, y) is a product of a function of x and one of y."""

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y); C(-x, -y) = C(x, y) always holds."""

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges of the box outside which the correlation is below 1e-15; infinite where none is."""

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""


@dataclass(frozen=True)
class Covariance:
    """Covariance of a zero-mean Gaussian field of heights, of the scaled distance r = (a^2 + b^2)^(1/2) alone.

    rms_height_m : Sq [m]
    correlation_length_m : l [m] along the lay, where the autocorrelation is 1/e
    correlation_length_across_m : l' [m] across it; equal to l if not given
    lay_rad : angle from x to the lay

    A model is a subclass with `profile`, and `transform` for fits of scans, of a distance u in a unit of its own. The
    base finds by root search where the profile is 1/e (`scale`) and where it is negligible (`reach`), so the profile
    must fall monotonically. A model whose profile oscillates gives `scale` and `reach` itself, as does one that has
    them in closed form. Raises ParameterError for values that are not positive and finite, and for shapes outside their
    ranges.
    """

    kind: ClassVar[str]  # the name of the model in a scene
    shapes: ClassVar[Mapping[str, tuple[float, float]]] = {}  # range of each shape parameter, a field of the model
    is_product: ClassVar[bool] = False  # whether the correlation is a product of functions of a and of b
    # What fits need. First the power p for which (-ln C)^p is nearly a quadratic form of the lag: 1 is exact for the
    # Gaussian and 2 for the exponential. The first guess of lengths and lay is read from that form.
    quadratic_power: ClassVar[float] = 1.4
    fitted_shape: ClassVar[FittedShape | None] = None
    fitted_ratio: ClassVar[float] = 1.0  # of the length that a fit searches to l, in the first guess

    rms_height_m: float
    correlation_length_m: float
    correlation_length_across_m: float | None = None
    lay_rad: float = 0.0

    def __post_init__(self) -> None:
        positive("rms_height_m", self.rms_height_m, "m")
        for length in self.lengths_m:
            positive("correlation_length_m", length, "m")
        if not math.isfinite(real("lay_rad", self.lay_rad)):
            raise ParameterError(f"lay_rad must be finite, not {self.lay_rad} rad")
        check_shapes(type(self), {name: getattr(self, name) for name in self.shapes})

    def profile(self, u: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (as u) [-] at a distance u, 1 at zero."""
        raise NotImplementedError

    def transform(self, k: np.ndarray) -> np.ndarray:
        """2 pi int_0^inf u profile(u) J0(k u) du : (as k) [-]."""
        raise NotImplementedError

    @property
    def scale(self) -> float:
        """The distance u of a correlation of 1/e."""
        return _distance_of(self._unit, math.exp(-1.0))

    @property
    def reach(self) -> float:
        """Correlation lengths beyond which the correlation is below 1e-15; infinite if it oscillates without end."""
        return _distance_of(self._unit, NEGLIGIBLE) / self.scale

    @property
    def curvature(self) -> float:
        """-profile''(0) [-], infinite where it grows without end. A model whose slope comes late gives it itself."""
        near, nearer = (2 * (1 - float(self.profile(np.array(u)))) / u**2 for u in (1e-3, 1e-4))
        return nearer if nearer < 1.01 * near else math.inf

    @property
    def fourth_derivative(self) -> float:
        """Fourth derivative of the profile at zero [-], infinite where it grows without end."""
        near, nearer = (
            24 * (float(self.profile(np.array(u))) - 1 + self.curvature * u**2 / 2) / u**4 for u in (2e-2, 1e-2)
        )
        return nearer if nearer < 1.01 * near else math.inf

    @property
    def lengths_m(self) -> tuple[float, float]:
        """(l, l') [m] along and across the lay."""
        across = self.correlation_length_across_m
        return self.correlation_length_m, self.correlation_length_m if across is None else across

    @property
    def axis_lengths_m(self) -> tuple[float, float]:
        """[m] distances along x and y at which the autocorrelation is 1/e."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        return 1 / math.hypot(cos / along, sin / across), 1 / math.hypot(sin / along, cos / across)

    @property
    def reach_m(self) -> tuple[float, float]:
        """[m] half edges of the box outside which the correlation is below 1e-15."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        return self.reach * math.hypot(along * cos, across * sin), self.reach * math.hypot(along * sin, across * cos)

    @property
    def rms_slope(self) -> float:
        """h' [-], the root mean square of the gradient: Sq s (curvature (1/l^2 + 1/l'^2))^(1/2), s being `scale`."""
        along, across = self.lengths_m
        return self.rms_height_m * self.scale * math.sqrt(self.curvature) * math.hypot(1 / along, 1 / across)

    @property
    def rms_curvature(self) -> float:
        """[1/m], the root mean square of half the Laplacian: (<h_xx^2> + 2 <h_xx h_yy> + <h_yy^2>)^(1/2) / 2."""
        if not math.isfinite(self.rms_slope):
            return math.inf
        along, across = (1 / length**2 for length in self.lengths_m)
        moments = self.fourth_derivative * (along**2 + 2 / 3 * along * across + across**2)
        return 0.5 * self.rms_height_m * self.scale**2 * math.sqrt(moments)

    @property
    def mirror_symmetric(self) -> bool:
        """Whether C(-x, y) = C(x, y)."""
        along, across = self.lengths_m
        return along == across or 0.0 in direction(self.lay_rad)

    @property
    def separable(self) -> bool:
        """Whether C(x, y) is a product of a function of x and one of y."""
        return self.is_product and self.mirror_symmetric

    @property
    def _unit(self) -> Self:
        """The model of the same shape with unit variance and lengths, which is the key of the cache."""
        return replace(self, rms_height_m=1.0, correlation_length_m=1.0, correlation_length_across_m=None, lay_rad=0.0)

    def __call__(self, x: np.ndarray, y: np.ndarray | float = 0.0) -> np.ndarray:
        """C : (broadcast of x and y) [m^2] covariance of two heights that lie x [m] and y [m] apart."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        if sin != 0.0:
            x, y = cos * x + sin * y, cos * y - sin * x
        if along == across and not self.is_product:
            return self.rms_height_m**2 * self.profile(self.scale * (np.hypot(x, y) / along))
        return self.rms_height_m**2 * self.correlation(x / along, np.asarray(y) / across)

    @gate
    def correlation(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (broadcast of a and b) [-] at the lag over the lengths along and across the lay."""
        return self.profile(self.scale * np.hypot(a, b))

    @gate
    def spectrum(self, qx: np.ndarray, qy: np.ndarray | float = 0.0) -> np.ndarray:
        """S : (broadcast of qx and qy) [m^4] spectral density at the wave vector (qx, qy) [rad/m]."""
        (along, across), (cos, sin) = self.lengths_m, direction(self.lay_rad)
        a, b = along * (cos * qx + sin * qy), across * (cos * qy - sin * qx)
        density = self.transform(np.hypot(a, b) / self.scale) / self.scale**2
        return self.rms_height_m**2 * along * across * density

    @classmethod
    def of_fit(
        cls, rms_height_m: float, along: float, across: float, lay_rad: float, shape: float | None, cutoff: float
    ) -> Self:
        """The model of fitted lengths and shape. cutoff : wavelength [m] of one that ends, geometric mean."""
        shapes = {} if cls.fitted_shape is None else {cls.fitted_shape.name: shape}
        return cls(rms_height_m, along, across, lay_rad, **shapes)  # type: ignore[arg-type]


def check_shapes(model: type[Covariance], given: Mapping[str, object]) -> None:
    """Raises ParameterError for a shape parameter that the model does not have or that lies outside its range."""
    for name in given.keys() - model.shapes.keys():
        raise ParameterError(f"a {model.kind} covariance has no {name}: leave it out, or take another model")
    for name, (low, high) in model.shapes.items():
        value = given.get(name)
        if value is None or not low <= real(name, value) <= high:  # a NaN fails both comparisons
            raise ParameterError(
                f"the {name} of a {model.kind} covariance must lie in [{low:g}, {high:g}], not {value}"
            )


@lru_cache
def _distance_of(model: Covariance, value: float) -> float:
    """The distance u at which the profile of a model has fallen to a value."""

    def excess(u: float) -> float:
        return float(model.profile(np.array(u))) - value

    end = 100.0
    while excess(end) > 0.0:
        end *= 2.0
    return float(scipy.optimize.brentq(excess, 1e-12, end, xtol=1e-15, rtol=1e-15))


@gate
def plane_height(percentile: float | np.ndarray, rms_height_m: float) -> np.ndarray:
    """h_p [m] that `percentile` per cent of the ensemble of Gaussian heights lie above; 50 is the median."""
    above = reals("a penetration percentile", percentile) / 100.0
    if not np.all((above > 0) & (above < 1)):
        wrong = 100.0 * float(above[~((above > 0) & (above < 1))][0])
        raise ParameterError(f"a penetration percentile must lie between 0 and 100, not {wrong:g}")
    return np.asarray(rms_height_m * scipy.special.ndtri(1.0 - above))


def direction(lay_rad: float) -> tuple[float, float]:
    """Cosine and sine of the lay, exact at quarter turns."""
    cos, sin = math.cos(lay_rad), math.sin(lay_rad)
    if min(abs(cos), abs(sin)) < 1e-12:
        return float(round(cos)), float(round(sin))
    return cos, sin
