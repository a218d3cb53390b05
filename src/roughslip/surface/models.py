"""The covariance models, a class each, and their registry, MODELS. The base classes describe what a model gives."""

import math
import runpy
from dataclasses import dataclass, field
from functools import cache
from typing import ClassVar

import numpy as np
import scipy  # its parts when they are used

from roughslip.errors import ParameterError
from roughslip.surface import self_affine_transform
from roughslip.surface.covariance import Covariance, FittedShape, check_shapes
from roughslip.validation import gate, positive


@gate
@dataclass(frozen=True)
class Gaussian(Covariance):
    """exp(-r^2): infinitely smooth, and a product of functions of x and of y."""

    kind = "gaussian"
    is_product = True
    quadratic_power = 1.0
    scale, reach, curvature, fourth_derivative = 1.0, 6.0, 2.0, 12.0

    def profile(self, u: np.ndarray) -> np.ndarray:
        return np.exp(-(u**2))

    @gate
    def correlation(self, a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.exp(-(a**2) - b**2)

    def transform(self, k: np.ndarray) -> np.ndarray:
        return math.pi * np.exp(-(k**2) / 4)


@gate
@dataclass(frozen=True)
class Exponential(Covariance):
    """exp(-r): heights have no slope."""

    kind = "exponential"
    quadratic_power = 2.0
    scale, reach, curvature = 1.0, 36.0, math.inf

    def profile(self, u: np.ndarray) -> np.ndarray:
        return np.exp(-u)

    def transform(self, k: np.ndarray) -> np.ndarray:
        return 2 * math.pi * (1 + k**2) ** -1.5


@gate
@dataclass(frozen=True)
class Matern(Covariance):
    """2^(1-nu) / Gamma(nu) u^nu K_nu(u), exponential at nu = 1/2 and Gaussian for nu to infinity.

    smoothness : nu [-]
    """

    kind = "matern"
    # at the largest smoothness it is within 0.01 of the Gaussian, and no Bessel function overflows
    shapes: ClassVar = {"smoothness": (0.05, 20.0)}
    fitted_shape = FittedShape("smoothness", 1.0, logarithmic=True)

    smoothness: float = field(kw_only=True)

    def profile(self, u: np.ndarray) -> np.ndarray:
        """C / Sq^2 : (as u) [-] through logarithms: the factors overflow long before their product."""
        nu = self.smoothness
        positive = np.maximum(u, 1e-12)  # where the product is 1 within rounding unless nu is near zero
        gamma, bessel = scipy.special.gammaln(nu), scipy.special.kve(nu, positive)
        log = (1 - nu) * math.log(2) - gamma + nu * np.log(positive) + np.log(bessel) - positive
        return np.where(u > 0, np.exp(log), 1.0)

    @property
    def curvature(self) -> float:
        """1 / (2 nu - 2): heights have a slope above nu = 1."""
        return 0.5 / (self.smoothness - 1) if self.smoothness > 1 else math.inf

    @property
    def fourth_derivative(self) -> float:
        """3 / (4 (nu - 1) (nu - 2)): heights have a curvature above nu = 2."""
        return 0.75 / (self.smoothness - 1) / (self.smoothness - 2) if self.smoothness > 2 else math.inf

    def transform(self, k: np.ndarray) -> np.ndarray:
        return 4 * math.pi * self.smoothness * (1 + k**2) ** (-self.smoothness - 1)


@gate
@dataclass(frozen=True)
class SelfAffine(Covariance):
    """The transform of a spectrum constant below q_r, falling as q^(-2-2H) up to Q q_r, zero beyond.

    hurst : H, in (0, 1] [-]
    bandwidth : Q = q_s / q_r, above 1 [-]
    """

    kind = "self_affine"
    shapes: ClassVar = {"hurst": (0.01, 1.0), "bandwidth": (1.000001, 1e9)}
    fitted_shape = FittedShape("hurst", 0.7, logarithmic=False)
    fitted_ratio = 4.0  # of the roll-off wavelength
    reach = math.inf

    hurst: float = field(kw_only=True)
    bandwidth: float = field(kw_only=True)

    @property
    def scale(self) -> float:
        """s = q_r l with a correlation of 1/e at u = s."""
        return self_affine_transform.scale(self.hurst, self.bandwidth)

    @property
    def rolloff_wavelengths_m(self) -> tuple[float, float]:
        """2 pi / q_r [m] along and across the lay."""
        scale = 2 * math.pi / self.scale
        return scale * self.lengths_m[0], scale * self.lengths_m[1]

    @property
    def cutoff_wavelengths_m(self) -> tuple[float, float]:
        """2 pi / q_s [m] along and across the lay."""
        along, across = self.rolloff_wavelengths_m
        return along / self.bandwidth, across / self.bandwidth

    @property
    def curvature(self) -> float:
        """int k^3 S(k) / S(0) dk / 2 over the mass of the spectrum."""
        return self._moment(2) / 2

    @property
    def fourth_derivative(self) -> float:
        """3/8 int k^5 S(k) / S(0) dk over the mass of the spectrum."""
        return 3 / 8 * self._moment(4)

    def _moment(self, power: int) -> float:
        """Mean of k^power over the spectrum."""
        total = float(self_affine_transform.moment(power, self.hurst, self.bandwidth))
        return total / self_affine_transform.mass(self.hurst, self.bandwidth)

    def profile(self, u: np.ndarray) -> np.ndarray:
        return self_affine_transform.profile(u, self.hurst, self.bandwidth)

    def transform(self, k: np.ndarray) -> np.ndarray:
        plateau = 2 * math.pi / self_affine_transform.mass(self.hurst, self.bandwidth)
        return np.where(k <= self.bandwidth, plateau * np.maximum(k, 1.0) ** (-2 - 2 * self.hurst), 0.0)

    @classmethod
    def of_fit(
        cls, rms_height_m: float, along: float, across: float, lay_rad: float, shape: float | None, cutoff: float
    ) -> "SelfAffine":
        """The model of roll-off wavelengths, a Hurst exponent and a cut-off."""
        assert shape is not None  # `fitted_shape` is
        cutoff = min(cutoff * math.sqrt(along / across), along / (1 + 1e-5))
        return self_affine(rms_height_m, shape, along, cutoff, across, lay_rad)


MODELS: dict[str, type[Covariance]] = {model.kind: model for model in (Gaussian, Exponential, Matern, SelfAffine)}
KINDS = tuple(MODELS)


@cache
def covariance_model(name: str) -> type[Covariance]:
    """The covariance model of a name.

    name : one of MODELS, or `my_models.py:Mine`, a class in a file of your own

    Raises ParameterError for a name that is not in MODELS, and where the file or the class is missing.
    """
    if name in MODELS:
        return MODELS[name]
    file, colon, own = name.rpartition(":")
    if not colon:
        raise ParameterError(
            f"there is no covariance {name!r}; choose one of {', '.join(MODELS)}, or a class in a file of your own, as "
            "my_models.py:Mine"
        )
    try:
        found = runpy.run_path(file).get(own)
    except OSError as error:
        raise ParameterError(f"the covariance {name!r} cannot be read: {error}") from error
    if not (isinstance(found, type) and issubclass(found, Covariance)):
        raise ParameterError(f"{file} has no class {own} that inherits roughslip.surface.Covariance")
    found.kind = name
    return found


@gate
def covariance_of(
    kind: str,
    rms_height_m: float,
    correlation_length_m: float,
    correlation_length_across_m: float | None = None,
    lay_rad: float = 0.0,
    **shapes: float | None,
) -> Covariance:
    """The covariance model of a name.

    kind : a name of MODELS, or `my_models.py:Mine`, a class in a file of your own
    shapes : shape parameters of that model; None counts as not given
    others : as of Covariance

    Raises ParameterError for a name that is not in MODELS, and as the model.
    """
    model = covariance_model(kind)
    given = {name: value for name, value in shapes.items() if value is not None}
    check_shapes(model, given)
    return model(rms_height_m, correlation_length_m, correlation_length_across_m, lay_rad, **given)  # type: ignore[arg-type]


@gate
def self_affine(
    rms_height_m: float,
    hurst: float,
    rolloff_wavelength_m: float,
    cutoff_wavelength_m: float,
    rolloff_wavelength_across_m: float | None = None,
    lay_rad: float = 0.0,
) -> SelfAffine:
    """The self-affine covariance of a roll-off and a cut-off wavelength.

    rms_height_m : Sq [m]
    hurst : H [-]; the fractal dimension of a profile is 2 - H, that of the surface 3 - H
    rolloff_wavelength_m : 2 pi / q_r [m] along the lay; longer waves have a constant spectrum
    cutoff_wavelength_m : 2 pi / q_s [m] along the lay; none is shorter. Two cells of the mesh or more
    rolloff_wavelength_across_m : [m] across the lay, with the cut-off in the same ratio; equal if not given
    lay_rad : angle from x to the lay

    Returns the covariance, whose `axis_lengths_m` are its 1/e lengths. Raises ParameterError as the class.
    Method: Persson et al., J. Phys.: Condens. Matter 17 (2005) R1, section 3, with the transform in closed form.
    """
    across = rolloff_wavelength_m if rolloff_wavelength_across_m is None else rolloff_wavelength_across_m
    bandwidth = rolloff_wavelength_m / positive("cutoff_wavelength_m", cutoff_wavelength_m, "m")
    check_shapes(SelfAffine, {"hurst": hurst, "bandwidth": bandwidth})
    scale = self_affine_transform.scale(hurst, bandwidth) / (2 * math.pi)
    lengths = scale * rolloff_wavelength_m, scale * across
    return SelfAffine(rms_height_m, *lengths, lay_rad, hurst=hurst, bandwidth=bandwidth)
