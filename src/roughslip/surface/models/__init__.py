"""Covariance models, one in a module, by the names that scenes use. Register a new one in MODELS."""

from __future__ import annotations

from roughslip.errors import ParameterError
from roughslip.surface.covariance import Covariance, check_shapes
from roughslip.surface.models.exponential import Exponential
from roughslip.surface.models.gaussian import Gaussian
from roughslip.surface.models.matern import Matern
from roughslip.surface.models.self_affine import SelfAffine
from roughslip.surface.models.separable_exponential import SeparableExponential

__all__ = [
    "KINDS",
    "MODELS",
    "Exponential",
    "Gaussian",
    "Matern",
    "SelfAffine",
    "SeparableExponential",
    "covariance_of",
]

MODELS: dict[str, type[Covariance]] = {
    model.kind: model for model in (Gaussian, Exponential, SeparableExponential, Matern, SelfAffine)
}
KINDS = tuple(MODELS)


def covariance_of(
    kind: str,
    rms_height_m: float,
    correlation_length_m: float,
    correlation_length_across_m: float | None = None,
    lay_rad: float = 0.0,
    **shapes: float | None,
) -> Covariance:
    """The covariance model of a name.

    kind : a name of MODELS
    shapes : shape parameters of that model; None counts as not given
    others : as of Covariance

    Raises ParameterError for a name that is not in MODELS, and as the model.
    """
    if kind not in MODELS:
        raise ParameterError(f"there is no covariance {kind!r}; choose one of {', '.join(MODELS)}")
    given = {name: value for name, value in shapes.items() if value is not None}
    check_shapes(MODELS[kind], given)
    return MODELS[kind](rms_height_m, correlation_length_m, correlation_length_across_m, lay_rad, **given)  # type: ignore[arg-type]
