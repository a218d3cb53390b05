"""Results of contact: of one plane or load, and of several."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from roughslip.contact.edge import contact_shares
from roughslip.short_repr import short_repr


@short_repr
@dataclass(frozen=True)
class ContactSolution:
    """Pressures and gaps of one surface and one plane.

    pressure : (nx, ny) [Pa] never negative nor above the hardness, exactly zero off contact
    gap : (nx, ny) [m] between the deformed surface and the plane, zero in contact up to the residual
    plastic_displacement : (nx, ny) [m] u_plastic, the permanent displacement; zero below the hardness
    plane : [m] height of the plane relative to the heights of the surface; zero where interferences were given
    residual : [-] relative, of these fields, with gap - u_plastic = B p - u_bar computed anew
    work : Cholesky factors ("dense") or products with B ("fft")
    method : "none" (no contact), "dense" or "fft"
    nodes : number of nodes solved for: none, those of positive interference, or all on their rows and columns
    start : initial pressures of the iteration: "given", "nested" from coarser meshes, or "zero"; "none" without one
    hardness_pa : H, the highest pressure [Pa]
    periodic : whether the surface is a periodic cell
    """

    pressure: np.ndarray
    gap: np.ndarray
    plastic_displacement: np.ndarray
    plane: float
    residual: float
    work: int
    method: str
    nodes: int
    start: str
    hardness_pa: float = math.inf
    periodic: bool = False

    @property
    def signed_gap(self) -> np.ndarray:
        """(nx, ny) [m] B p - u_bar: the gap, and where the surface yields minus the plastic displacement."""
        return self.gap - self.plastic_displacement

    @property
    def contact(self) -> np.ndarray:
        """(nx, ny) where the pressure is positive."""
        return self.pressure > 0

    @property
    def area_fraction(self) -> float:
        """Share of the nodes in contact [-]."""
        return np.count_nonzero(self.pressure) / self.pressure.size

    @property
    def shares(self) -> np.ndarray:
        """(nx, ny) [-] share of each cell in contact, `contact_shares`; their mean is the area without mesh error."""
        return contact_shares(self.pressure, self.hardness_pa, self.periodic)

    @property
    def yielded_share(self) -> float:
        """Share [-] of the real area that bears the hardness; zero without contact."""
        return float(np.count_nonzero(self.pressure == self.hardness_pa) / max(self.shares.sum(), 1e-300))

    @property
    def mean_pressure(self) -> float:
        """Normal force per nominal area [Pa]."""
        return float(self.pressure.mean())


@short_repr
@dataclass(frozen=True)
class ContactSweep:
    """Solutions of one surface at several planes or loads, in the order asked for; iterates over them.

    plane : (k,) [m] height of the plane
    mean_pressure : (k,) [Pa] normal force per nominal area
    area : (k,) [-] share of the nominal area in contact, less the error of the mesh
    residual : (k,) [-]
    solutions : (k,) each with its pressures and gaps
    """

    plane: np.ndarray
    mean_pressure: np.ndarray
    area: np.ndarray
    residual: np.ndarray
    solutions: tuple[ContactSolution, ...]

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[ContactSolution]:
        return iter(self.solutions)


def curve_of(solutions: Sequence[ContactSolution]) -> ContactSweep:
    """The curve of some solutions."""
    rows = [(one.plane, one.mean_pressure, one.shares.mean(), one.residual) for one in solutions]
    plane, mean_pressure, area, residual = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return ContactSweep(plane, mean_pressure, area, residual, tuple(solutions))
