"""What the joint page shows of benchmarks and stress campaigns: run time against error, and outcomes.

They belong to no scene alone. A run of the study does not repeat them, since that would take hours.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

BUDGET = "chain"  # the benchmark that measures each source of error
MEASURED = {
    "surface": "Surfaces: times of leading modes and exact samples; error of the covariance against time.",
    "contact": "Contact: error of the pressure against time, and time at equal independent residual by mesh.",
    "chaos": "Pressure at the centre: distance of the distribution from its Monte Carlo reference against contact "
    "solves.",
    "oscillator": "Oscillator: error of the point where the mass sticks again against the time of a cycle.",
    "skips": "What is not computed: the time with everything computed, divided by the time as it is. And the "
    "difference of the two results relative to the tolerance, at the edge where they are equal to the bit.",
    BUDGET: "What each source leaves in every number of the figures, the others as the scene has them. To the right of "
    "each mark: two standard errors of it. Sources vary with common random numbers. Errors of mesh and path nodes are "
    "twice their change on halving, as of first order. Numbers in units of the mean friction coefficient at median "
    "penetration; cycles by damping ratio.",
}


@dataclass(frozen=True)
class Evidence:
    """Kept benchmarks and stress campaigns.

    pictures : PNG bytes by benchmark
    budget : of every number in the figures, by the name of its case, value, error and largest source
    cost : of the chain and of the plain way at the same error: stages, and scenes with all of them
    stress : rows with stage, problems, outcomes, worst residual over tolerance
    machine : on which the benchmarks ran, by benchmark
    """

    pictures: Mapping[str, bytes] = field(default_factory=dict)
    budget: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    cost: Mapping[str, Sequence[Mapping[str, Any]]] = field(default_factory=dict)
    stress: Sequence[Mapping[str, Any]] = ()
    machine: Mapping[str, str] = field(default_factory=dict)

    @property
    def measured(self) -> dict[str, bytes]:
        """Pictures of the benchmarks of single stages."""
        return {name: self.pictures[name] for name in MEASURED if name in self.pictures and name != BUDGET}

    @property
    def budget_picture(self) -> bytes | None:
        """Picture of the error budget."""
        return self.pictures.get(BUDGET)

    @property
    def budget_rows(self) -> list[dict[str, Any]]:
        """The error budget, a row a number with its scene."""
        rows = []
        for case, number in self.budget.items():
            names = dict(pair.split("=", 1) for pair in case.split(" "))
            rows.append({**number, "scene": names["scene"], "number": names["number"].replace("_", " ")})
        return rows

    def caption(self, name: str) -> str:
        """Caption of the picture of a benchmark."""
        machine = f" Measured on: {self.machine[name]}." if name in self.machine else ""
        return f"{MEASURED[name]}{machine} To repeat it: make benchmark."
