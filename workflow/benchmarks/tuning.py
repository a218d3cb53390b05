"""The tolerance of a solver set so that its residual just meets that of a case."""

from __future__ import annotations

import math
from dataclasses import dataclass

from workflow.benchmarks import measure
from workflow.benchmarks.contact_peers import Peer
from workflow.benchmarks.contact_problem import Judge, Problem

# The residual may lie below the tolerance by this factor: one or two iterations.
BAND = 4.0
MOST_TRIALS = 10
SETTINGS = (1e-15, 1.0)


@dataclass(frozen=True)
class Trial:
    """A solve at a setting: the residual reached, the seconds and the applications of B that it took."""

    setting: float
    residual: float
    seconds: float
    work: int


def tune(peer: Peer, problem: Problem, load: float, tolerance: float, first: float, judge: Judge) -> Trial:
    """The loosest setting at which a peer meets the tolerance, to BAND; where none does, that of its least residual.

    first : the setting to begin with; one too loose costs less than one too tight

    Steps in proportion to the residual; between one that missed and one that met it, by halving on a logarithmic scale.
    """
    trials: list[Trial] = []
    setting = first
    for _ in range(MOST_TRIALS):
        seconds, (pressure, work) = measure.timed(lambda at=setting: peer.solve(problem, load, at, counting=True))
        trials.append(Trial(setting, judge.residual(problem, pressure), seconds, work))
        met = max((t for t in trials if t.residual <= tolerance), key=lambda t: t.setting, default=None)
        loose = min((t.setting for t in trials if t.residual > tolerance), default=math.inf)
        tight = met.setting if met else 0.0
        if met and (met.residual >= tolerance / BAND or loose <= 2 * tight):
            break
        aim = tolerance / BAND**0.5
        setting *= min(max(aim / max(trials[-1].residual, 1e-300), 1e-3), 1e3)
        if not tight < setting < loose:
            setting = (tight * loose) ** 0.5 if met and loose < math.inf else 10 * tight if met else loose / 10
        if not SETTINGS[0] <= setting <= SETTINGS[1]:
            break
    return met or min(trials, key=lambda t: t.residual)
