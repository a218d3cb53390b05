"""What is expanded to get the pressure at a node: the paper's eqs. (8) and (9), and targets that use every sample.

Eq. (8) says p = r^+ with r a polynomial, but eqs. (10) and (11) fit r on the samples in contact alone, where it is p,
and leave it free elsewhere. The targets here say what r is out of contact as well, so that every sample counts:

    trial pressure    r = p - gap / B_00, p = r^+          the step that an active-set solver would take; coarse meshes
    squared pressure  w = p^2 - (2 E* / pi)^2 kappa gap,   p = sqrt(w^+)                                  fine meshes

The second follows Hertz: on a summit of curvature kappa, p0^2 = (2 E* / pi)^2 kappa approach, so w is linear in the
approach through first contact, where p itself rises as a square root. Out of contact a sample far away says little
about the pressure, so it counts less: weight 1 / (1 + (w / w_0)^2) with w_0 = 0.3 of the mean square pressure in contact.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from roughslip.chaos.regression import Fit, least_squares
from roughslip.errors import IllPosedError, ParameterError

OUTSIDE_SCALE = 0.3  # of the factors 0.1 to 3 tried on the resolved square the one with the least Kolmogorov distance


@dataclass(frozen=True)
class PressureTarget:
    """A smooth variable whose positive part gives the pressure.

    kind : "trial_pressure" or "squared_pressure"
    gap_stiffness : what a metre of gap counts: 1 / B_00 [Pa/m], or (2 E*/pi)^2 kappa [Pa^2/m]
    """

    kind: Literal["trial_pressure", "squared_pressure"]
    gap_stiffness: float

    def values(self, pressure: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """target : same shape [Pa] or [Pa^2]; `pressure` [Pa] and `gap` [m] are complementary."""
        power = pressure if self.kind == "trial_pressure" else pressure**2
        return power - self.gap_stiffness * gap

    def weights(self, target: np.ndarray) -> np.ndarray:
        """weight : same shape, 1 in contact, falling with the distance from it on the scale of the contact."""
        contact = target > 0
        if self.kind == "trial_pressure" or not np.any(contact):
            return np.ones_like(target)
        scale = OUTSIDE_SCALE * np.mean(target[contact])
        return np.where(contact, 1.0, 1.0 / (1.0 + (target / scale) ** 2))

    def pressure(self, target: np.ndarray) -> np.ndarray:
        """p : same shape [Pa], zero where the target is not positive."""
        positive = np.maximum(target, 0.0)
        return positive if self.kind == "trial_pressure" else np.sqrt(positive)


def pressure_target(
    kind: str, *, influence_diagonal: float, plane_strain_modulus_pa: float, summit_curvature_per_m: float
) -> PressureTarget:
    """The target of that kind for a mesh (B_00 [m/Pa]), a material (E* [Pa]) and a surface (kappa [1/m])."""
    if kind == "trial_pressure":
        return PressureTarget("trial_pressure", 1.0 / influence_diagonal)
    if kind == "squared_pressure":
        stiffness = (2 * plane_strain_modulus_pa / np.pi) ** 2 * summit_curvature_per_m
        return PressureTarget("squared_pressure", stiffness)
    raise ParameterError(f"target {kind!r} is not known: trial_pressure or squared_pressure")


def summit_curvature(rms_height_m: float, correlation_length_m: float) -> float:
    """kappa [1/m] typical of the summits of a Gaussian field with exp(-(r/l)^2): 4 Sq / l^2.

    At a stationary point of height z the mean curvature of the field is 2 z / l^2 on either axis, and the summits that
    touch stand at one to two Sq; the design's trial found 3 to 6 Sq / l^2 to serve.
    """
    return 4.0 * rms_height_m / correlation_length_m**2


def fit_in_contact(basis: np.ndarray, pressure: np.ndarray, *, logarithm: bool) -> Fit:
    """Coefficients of eq. (8), or of eq. (9) with `logarithm`, by eqs. (10) and (11) on the samples in contact alone.

    basis : (K_t, P), pressure : (K_t,) [Pa]. Raises IllPosedError where the K samples in contact are not more than P.
    """
    contact = pressure > 0
    count, terms = int(contact.sum()), basis.shape[1]
    if count <= terms:
        raise IllPosedError(
            f"{count} of {len(pressure)} samples are in contact; eq. (11) needs more than the {terms} coefficients: "
            "take more samples, a deeper penetration or the expansion that uses every sample"
        )
    target = np.log(pressure[contact]) if logarithm else pressure[contact]
    return least_squares(basis[contact], target)


def fit_all_samples(basis: np.ndarray, target: np.ndarray, kind: PressureTarget) -> Fit:
    """Coefficients of the smooth target : (K,) from every sample, weighted as the target asks."""
    return least_squares(basis, target, kind.weights(target))
