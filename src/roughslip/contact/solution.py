"""Results of contact: of one plane or load, and of several."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from roughslip.contact.edge import contact_shares
from roughslip.results import described, result


@result
class ContactSolution:
    """Pressures and gaps of one surface and one plane."""

    pressure: np.ndarray = described(
        "contact pressure, never negative nor above the hardness, exactly zero off contact", "Pa", "x y"
    )
    gap: np.ndarray = described(
        "gap between the deformed surface and the plane, zero in contact up to the residual", "m", "x y"
    )
    plastic_displacement: np.ndarray = described(
        "permanent displacement u_plastic; zero below the hardness", "m", "x y"
    )
    plane: float = described(
        "height of the plane relative to the heights of the surface; zero where interferences were given", "m"
    )
    residual: float = described("relative residual of these fields, with gap - u_plastic = B p - u_bar computed anew")
    work: int = described('Cholesky factors ("dense") or products with B ("fft")')
    method: str = described('"none" (no contact), "dense" or "fft')
    nodes: int = described(
        "number of nodes solved for: none, those of positive interference, or all on their rows and columns"
    )
    start: str = described(
        'initial pressures of the iteration: "given", "nested" from coarser meshes, or "zero"; "none" without one'
    )
    hardness_pa: float = described("H, the highest pressure", "Pa", default=math.inf)
    periodic: bool = described("whether the surface is a periodic cell", default=False)

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


@result
class ContactSweep:
    """Solutions of one surface at several planes or loads, in the order asked for; iterates over them."""

    plane: np.ndarray = described("height of the plane", "m", "k")
    mean_pressure: np.ndarray = described("normal force per nominal area", "Pa", "k")
    area: np.ndarray = described("share of the nominal area in contact, less the error of the mesh", "1", "k")
    residual: np.ndarray = described("relative residual of each solution", "1", "k")
    solutions: tuple[ContactSolution, ...] = described("the solutions, each with its pressures and gaps", "1", "k")

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[ContactSolution]:
        return iter(self.solutions)


def curve_of(solutions: Sequence[ContactSolution]) -> ContactSweep:
    """The curve of some solutions."""
    rows = [(one.plane, one.mean_pressure, one.shares.mean(), one.residual) for one in solutions]
    plane, mean_pressure, area, residual = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return ContactSweep(plane, mean_pressure, area, residual, tuple(solutions))
