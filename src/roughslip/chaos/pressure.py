"""The variable that is expanded to get the pressure at a node, and the paper's fits on the samples in contact.

The paper's eq. (8) is p = r^+ with r a polynomial. Its eqs. (10) and (11) fit r to the samples in contact alone, where
it is p, and leave it free elsewhere. The targets here define r out of contact too, so that every sample is used:

    - trial pressure: r = p - gap / B_00, and p = r^+
    - squared pressure: w = p^2 + p_1 p - k gap, and p from w^+

The trial pressure, the step of an active-set solver, suits coarse meshes, where a contact is one cell. The squared
pressure follows Hertz on fine meshes. On a summit of curvature kappa, p_0^2 = k approach with k = (2 E* / pi)^2 kappa
(Johnson, Contact Mechanics, 1985, eqs. 4.22 to 4.24). At first contact one cell touches, with p = approach / B_00; the
term p_1 p with p_1 = k B_00 makes w linear there too. For large B_00, w / p_1 becomes the trial pressure. Samples far
out of contact weigh 1 / (1 + (w / w_0)^2), with w_0 = 0.3 of the mean of w in contact.

Where the surface yields, p = H and the gap is minus the plastic displacement. The targets then continue above
their value at H, as they continue below zero out of contact. The pressure is limited at both ends.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from roughslip.chaos.regression import KEYS, MORE_CONTACT, Fit, Regression
from roughslip.errors import IllPosedError, ParameterError
from roughslip.validation import finite, gate, not_negative, positive

Kind = Literal["trial_pressure", "squared_pressure"]
KINDS: tuple[Kind, ...] = ("trial_pressure", "squared_pressure")

# On the resolved square (4000 samples, degree 3 in 8 variables) the Kolmogorov distance is 0.005 over all samples and
# 0.03 given contact with these values, and 0.013 and 0.09 without p_1. Scales of 0.1 to 3 and curvatures of 1 to 40
# Sq / l^2 were tried. With curvatures of 8 to 20 it stays below 0.007 and 0.035 on two independent designs.
OUTSIDE_SCALE = 0.3
CURVATURE = 10.0  # times Sq / l^2


@gate
@dataclass(frozen=True)
class PressureTarget:
    """A smooth variable whose positive part gives the pressure.

    kind : "trial_pressure" or "squared_pressure"
    gap_stiffness : factor of the gap, 1 / B_00 [Pa/m] or k [Pa^2/m]; positive
    cell_pressure_pa : [Pa] p_1, not negative; unused for the trial pressure
    hardness_pa : [Pa] H, the highest pressure; positive, infinite for elastic contact

    Raises ParameterError for an unknown kind or a number out of range.
    """

    kind: Kind
    gap_stiffness: float
    cell_pressure_pa: float = 0.0
    hardness_pa: float = math.inf

    def __post_init__(self) -> None:
        unit = "Pa/m" if self.kind == "trial_pressure" else "Pa^2/m"
        positive("PressureTarget.gap_stiffness", self.gap_stiffness, unit)
        not_negative("PressureTarget.cell_pressure_pa", self.cell_pressure_pa, "Pa")
        if not self.hardness_pa > 0:
            raise ParameterError(f"PressureTarget.hardness_pa must be positive, not {self.hardness_pa} Pa")

    @gate
    def values(self, pressure: np.ndarray, gap: np.ndarray) -> np.ndarray:
        """Target : (...) [Pa] or [Pa^2], from pressure : (...) [Pa] and gap : (...) [m].

        Pressure or gap is zero, unless the surface yields; then the pressure is the hardness, and the gap is minus the
        plastic displacement.
        """
        power = pressure if self.kind == "trial_pressure" else pressure * (pressure + self.cell_pressure_pa)
        return power - self.gap_stiffness * gap

    @gate
    def weights(self, target: np.ndarray) -> np.ndarray:
        """Weight : (...) [-] 1 in contact, decreasing out of contact.

        The trial pressure is linear in the gap far from contact too, and has unit weights. Raises IllPosedError where
        no sample of a squared pressure is in contact, which leaves no scale.
        """
        if self.kind == "trial_pressure":
            return np.ones_like(target)
        contact = target > 0
        if not np.any(contact):
            raise IllPosedError(f"no sample is in contact: {MORE_CONTACT}", KEYS)
        scale = OUTSIDE_SCALE * np.mean(target[contact])
        return np.where(contact, 1.0, 1.0 / (1.0 + (target / scale) ** 2))

    @gate
    def pressure(self, target: np.ndarray) -> np.ndarray:
        """Pressure : (...) [Pa], zero where the target : (...) is not positive, and at most the hardness."""
        positive = np.maximum(target, 0.0)
        if self.kind == "trial_pressure":
            return np.minimum(positive, self.hardness_pa)
        half = 0.5 * self.cell_pressure_pa
        root = np.sqrt(half**2 + positive) + half  # p = w / root avoids a difference of nearly equal numbers
        pressure = np.divide(positive, root, out=np.zeros_like(positive), where=positive > 0)
        return np.minimum(pressure, self.hardness_pa)


@gate
def pressure_target(
    kind: Kind,
    *,
    influence_diagonal: float,
    plane_strain_modulus_pa: float,
    rms_height_m: float,
    correlation_length_m: float,
    hardness_pa: float = math.inf,
) -> PressureTarget:
    """The target of a kind for a mesh, a material and a surface.

    influence_diagonal : [m/Pa] B_00, displacement of a cell under its own unit pressure; positive
    plane_strain_modulus_pa : [Pa] E*
    rms_height_m, correlation_length_m : [m] Sq and l, which give the curvature of summits, CURVATURE Sq / l^2
    hardness_pa : [Pa] H

    Raises ParameterError as PressureTarget does.
    """
    if kind == "trial_pressure":
        return PressureTarget(kind, 1.0 / positive("influence_diagonal", influence_diagonal), hardness_pa=hardness_pa)
    not_negative("influence_diagonal", influence_diagonal, "m/Pa")
    positive("plane_strain_modulus_pa", plane_strain_modulus_pa, "Pa")
    positive("rms_height_m", rms_height_m, "m")
    positive("correlation_length_m", correlation_length_m, "m")
    summit_curvature = CURVATURE * rms_height_m / correlation_length_m**2
    stiffness = (2 * plane_strain_modulus_pa / np.pi) ** 2 * summit_curvature
    return PressureTarget(kind, stiffness, stiffness * influence_diagonal, hardness_pa)


@gate
def fit_in_contact(basis: np.ndarray, pressure: np.ndarray, *, logarithm: bool) -> Fit:
    """Coefficients of eq. (8), or of eq. (9) with `logarithm`, by eqs. (10) and (11) on the samples in contact alone.

    basis : (K_t, P) terms at all samples
    pressure : (K_t,) [Pa] not negative

    Returns the fit of p [Pa] or of log(p / Pa). Raises ParameterError for pressures that are not finite, IllPosedError
    where the K samples in contact are not more than P, and as the regression.
    """
    basis, pressure = finite("basis", basis, 2), finite("pressures", pressure, 1)
    if len(pressure) != len(basis) or len(pressure) == 0:
        raise ParameterError(f"a pressure for each row of the basis is needed: {pressure.shape}, {basis.shape}")
    contact = pressure > 0
    count, terms = int(contact.sum()), basis.shape[1]
    if count <= terms:
        raise IllPosedError(
            f"{count} of {len(pressure)} samples are in contact; eq. (11) needs more than the {terms} coefficients: "
            "take more samples, a deeper penetration or a lower degree",
            scene_keys="square.latin_hypercube_samples, expansion.degree",
        )
    target = np.log(pressure[contact]) if logarithm else pressure[contact]
    return Regression(basis[contact]).fit(target)  # in contact variables are not normal, and squares are no variance
