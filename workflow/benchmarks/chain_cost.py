"""What the chain costs, beside the plain way at the same error: seconds of a unit of work times the units it takes.

Short samples are measured in this process, in CPU seconds, and extrapolated in proportion to the units; every stage
tells how its units were counted (`how`). Common to all:

    - Errors are standard errors. A plain mean over K independent samples errs by sigma / sqrt(K): it takes
      K = K' (s' / e)^2 samples for our error e, where K' samples leave s'. Of several numbers the median of K is taken:
      half of them come out better than ours, half worse. K of each is told.
    - Meshes, spacings and tolerances are the scene's in both, and errors of these are in both.
    - Left out of both: what both need or costs seconds (statistics of windows, designs, limits of the cycle, figures),
      start-up, compilation. Our fits and expansions count.
    - scipy's error control passes over the nodes of a friction path, where it errs far more than asked. The stage tells
      what scipy costs where a slip errs as ours does, and at the tolerance that the scene asks of ours, where it errs
      more: the two ratios of the chain are with the one and with the other.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

PROMISED = 100.0


@dataclass(frozen=True)
class Work:
    """units : of the work of a stage; seconds_each : [s] of one; besides : [s] of what else there is to do"""

    units: float
    seconds_each: float
    besides: float = 0.0

    @property
    def seconds(self) -> float:
        """Of the whole stage."""
        return self.units * self.seconds_each + self.besides

    def told(self) -> dict[str, float]:
        """As it stands in the file."""
        of = {"units": self.units, "seconds_each": self.seconds_each, "besides": self.besides, "seconds": self.seconds}
        return {name: float(value) for name, value in of.items()}


@dataclass(frozen=True)
class Stage:
    """A stage of the chain, our way and the plain one.

    unit : what is counted
    how : how the units were counted, and what was assumed
    as_asked : the plain way at the scene's own tolerance, where that differs
    counts : of the plain way by the number whose error is the same
    """

    name: str
    unit: str
    ours: Work
    plain: Work
    how: str
    counts: Mapping[str, float] = field(default_factory=dict)
    as_asked: Work | None = None

    def told(self, scene: str) -> dict[str, Any]:
        """As it stands in the file."""
        return {
            "scene": scene,
            "stage": self.name,
            "unit": self.unit,
            "ours": self.ours.told(),
            "plain": self.plain.told(),
            "ratio": self.plain.seconds / self.ours.seconds,
            "ratio_at_the_tolerance_asked": (self.as_asked or self.plain).seconds / self.ours.seconds,
            "how": self.how,
            "counts": dict(self.counts),
        }


def samples_for(error: float, samples: int, left: float) -> float:
    """Independent samples whose mean errs by `error`, where so many leave the error `left`."""
    return samples * (left / error) ** 2 if error > 0.0 else math.inf


def median_count(counts: Mapping[str, float]) -> float:
    """The median over the numbers that are wanted."""
    return statistics.median(counts.values())


def together(scene: str, stages: Sequence[Stage]) -> dict[str, Any]:
    """The chain: sums over the stages, and their ratio beside what was promised."""
    ours, plain = (sum(getattr(stage, way).seconds for stage in stages) for way in ("ours", "plain"))
    as_asked = sum((stage.as_asked or stage.plain).seconds for stage in stages)
    return {
        "scene": scene,
        "ours_seconds": ours,
        "plain_seconds": plain,
        "ratio": plain / ours,
        "ratio_at_the_tolerance_asked": as_asked / ours,
        "promised": PROMISED,
        "met": plain / ours >= PROMISED,
    }
