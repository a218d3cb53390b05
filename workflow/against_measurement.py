"""A law with a memory, fixed from the records of one spring, against those of two others.

python -m workflow.against_measurement laws|predict|compare FOLDER

laws are of three records of the first spring, with a memory and without; predict takes mean friction and length alone
of the other six; compare measures all nine, and draws them. Each keeps a file. FOLDER holds k<stiffness [N/m]>_v<speed
[um/s]>.csv. The page docs/evidence/against-measurement.md has the rule.
"""

import json
import math
import sys
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy

from roughslip.errors import RoughslipError
from roughslip.figures.style import draw_points, heads, panels, save
from roughslip.friction.paths import Friction
from roughslip.oscillator.equation import Oscillator
from roughslip.oscillator.laws import CoulombLaw
from roughslip.oscillator.memory_law import MemoryLaw
from roughslip.oscillator.motion import MotionOptions, trajectory
from roughslip.probability.estimate import TAILS

KEPT = Path("results/reference/against_measurement")
FIRST, OTHERS = 168, (1002, 2254)  # [N/m]
MEANS = {42: 40, 1100: 4, 4300: 1}  # samples of 2 kHz in a row of a record, by speed [um/s]
RECORDS = tuple(product((FIRST, *OTHERS), MEANS))  # spring and speed
RAW_S = 5e-4  # [s]
WIDE_M, SHARE, BLOCKS = 1e-3, 0.25, 8  # travel of the mean that is taken out; least tooth over the range; for intervals
FIXED = {"cutoff_speed_m_per_s": 1.0, "rest_speed_m_per_s": 1e-6}
NODES, SAMPLES, TOLERANCE = 4, 32, 1e-4  # of a path in its length; of a natural period; of the motion
LEVEL = 0.3  # mean friction at which effects are given; they are in proportion to it
MODEL_ERROR = 0.1  # of a statistic, added to its standard error
START, WALKERS, GENERATIONS, KEEP, APART = 800, 32, 90, 4, 15  # laws tried first; the last generations, so far apart
SEED, JUMP, SPREAD, LOST = 20261128, 0.6, 1e-2, 10.0  # of walkers: share of a difference, of ranges; misfit


class Law(NamedTuple):
    """What the records of one spring decide, as logarithms in the fit."""

    mass_kg: float
    load_n: float
    damper_kg_per_s: float
    direct_effect: float
    ageing_effect: float
    memory_length_m: float
    deviation: float
    correlation_length_m: float


LOW = Law(0.012, 0.15, 1e-3, 1e-5, 1e-5, 3e-7, 0.003, 3e-6)
HIGH = Law(0.035, 0.40, 2.0, 0.05, 0.08, 2e-4, 0.4, 6e-4)
FORGETS = {"direct_effect": 1e-8, "ageing_effect": 1e-8}
KINDS = {"with": (LOW, HIGH), "without": (LOW._replace(**FORGETS), HIGH._replace(**FORGETS))}  # a memory


class Teeth(NamedTuple):
    """Duration of rises and of falls [s], and height of falls [-], of all teeth of a record."""

    rise: np.ndarray
    fall: np.ndarray
    height: np.ndarray

    def statistics(self, part: slice = slice(None)) -> np.ndarray:
        """(6,) logarithms of mean period and height, their variation, logarithms of rise over fall, slope of rises."""
        rise, fall, height = (column[part] for column in self)
        period = rise + fall
        logs = np.log([period.mean(), height.mean(), rise.mean() / fall.mean(), height.sum() / rise.sum()])
        return np.array([*logs[:2], period.std() / period.mean(), height.std() / height.mean(), *logs[2:]])

    def errors(self) -> np.ndarray:
        """(6,) standard errors, from BLOCKS parts."""
        parts = np.array_split(np.arange(self.height.size), BLOCKS)
        return np.std([self.statistics(slice(p[0], p[-1] + 1)) for p in parts], axis=0, ddof=1) / math.sqrt(BLOCKS)


def teeth_of(friction: np.ndarray, speed: int) -> Teeth:
    """Teeth between turning points at least SHARE of the range apart, once a mean over WIDE_M of travel is out."""
    interval = RAW_S * MEANS[speed]
    narrow = friction - scipy.ndimage.uniform_filter1d(friction, max(int(WIDE_M / (1e-6 * speed * interval)), 3))
    least = SHARE * float(np.ptp(np.quantile(narrow, [0.02, 0.98])))
    tops, feet = (scipy.signal.find_peaks(side, prominence=least)[0] for side in (narrow, -narrow))
    turns = np.sort(np.concatenate([tops, feet]))
    time, height, falls = np.diff(turns) * interval, -np.diff(friction[turns]), np.isin(turns[:-1], tops)
    size = min(np.count_nonzero(falls), np.count_nonzero(~falls))
    return Teeth(time[~falls][:size], time[falls][:size], height[falls][:size])


def name_of(stiffness: int, speed: int) -> str:
    """The name of a record."""
    return f"k{stiffness}_v{speed}"


def record(folder: str, stiffness: int, speed: int) -> np.ndarray:
    """Friction over load of a record."""
    return np.loadtxt(Path(folder) / f"{name_of(stiffness, speed)}.csv", delimiter=",", skiprows=1)[:, 2]


def synthetic(law: Law, stiffness: int, speed: int, level: float, rows: int, seed: Sequence[int]) -> np.ndarray:
    """A record of so many rows by the law, of a sheet with this mean friction at this speed."""
    omega, velocity = math.sqrt(stiffness / law.mass_kg), 1e-6 * speed
    ratio = law.damper_kg_per_s / (2.0 * law.mass_kg * omega)
    belt = Oscillator(law.mass_kg, omega, ratio, velocity, law.load_n)
    effects = law.direct_effect * level / LEVEL, law.ageing_effect * level / LEVEL
    memory = MemoryLaw(CoulombLaw(level, level), *effects, law.memory_length_m, velocity, **FIXED)
    friction = Friction(level, law.deviation * level, law.correlation_length_m, multiplies=True)
    paths = friction.paths(NODES)
    before = 0.2 * level * belt.F / velocity + 10.0 * 2.0 * math.pi / omega  # [s] from a spring that is nearly loaded
    raw = before + RAW_S * np.arange(rows * MEANS[speed])
    periods = (raw[-1] + RAW_S) * omega / (2.0 * math.pi)
    options = MotionOptions(TOLERANCE, SAMPLES, "multiplicative")
    motion = trajectory(belt, memory, paths.realisation(seed), paths.spacing, periods, options, 0.9 * level * belt.F)
    shown = np.interp(raw, motion.time / omega, motion.position / belt.F)
    return shown.reshape(rows, -1).mean(axis=1)


def misfit(law: Law, of_record: Sequence[tuple[int, float, int, np.ndarray, np.ndarray]], seed: Sequence[int]) -> float:
    """Half the sum of squares of statistics of synthetic records, less those measured, over their errors."""
    total = 0.0
    for speed, level, rows, wanted, error in of_record:
        try:
            made = synthetic(law, FIRST, speed, level, rows, seed)
        except RoughslipError:
            return math.inf
        teeth = teeth_of(made, speed)
        if teeth.height.size < 2 * BLOCKS:
            return math.inf
        total += 0.5 * float(np.sum((teeth.statistics() - wanted) ** 2 / (error**2 + MODEL_ERROR**2)))
    return total


def laws(folder: str, low: Law, high: Law) -> tuple[np.ndarray, np.ndarray]:
    """(draws, 8) laws that make records like those of the first spring, and the (draws,) misfit of each.

    Markov chains that need no likelihood (P. Marjoram et al., PNAS 100 (2003) 15324), with proposals from the
    differences of walkers (C. J. F. ter Braak, Stat. Comput. 16 (2006) 239), of uniform logarithms.
    """
    of_record = []
    for speed in MEANS:
        friction = record(folder, FIRST, speed)
        teeth = teeth_of(friction, speed)
        of_record.append((speed, float(friction.mean()), friction.size, teeth.statistics(), teeth.errors()))
    generator, ends = np.random.default_rng(SEED), np.log([low, high])
    places = ends[0] + np.ptp(ends, axis=0) * scipy.stats.qmc.LatinHypercube(len(low), seed=SEED).random(START)
    found = np.array([misfit(Law(*np.exp(place)), of_record, [SEED, i]) for i, place in enumerate(places)])
    best = np.argsort(found)[:WALKERS]
    walkers, values, kept = places[best], found[best], []
    for number in range(GENERATIONS):
        if 2 * number == GENERATIONS:  # lost walkers begin again from the best one
            lost = values > np.median(values) + LOST
            walkers[lost], values[lost] = walkers[np.argmin(values)], np.min(values)
        for i in range(WALKERS):
            one, other = generator.choice(WALKERS, 2, replace=False)
            new = walkers[i] + JUMP * (walkers[one] - walkers[other])
            new += SPREAD * np.ptp(ends, axis=0) * generator.standard_normal(len(low))
            if np.all((ends[0] <= new) & (new <= ends[1])):
                value = misfit(Law(*np.exp(new)), of_record, [SEED, START + number * WALKERS + i])
                if math.log(generator.uniform()) < values[i] - value:
                    walkers[i], values[i] = new, value
        if (GENERATIONS - number - 1) % APART == 0 and number >= GENERATIONS - KEEP * APART:
            kept.append((walkers.copy(), values.copy()))
    return np.exp(np.concatenate([x for x, _ in kept])), np.concatenate([v for _, v in kept])


def predicted(folder: str, draws: np.ndarray) -> dict[str, list[list[float]]]:
    """Of each record (2, 3): period [s] and height [-] of teeth in synthetic ones, median and ends of 95 %."""
    found = {}
    for stiffness, speed in RECORDS:
        friction = record(folder, stiffness, speed)  # its mean and its length alone
        logs = []
        for number, draw in enumerate(draws):
            made = synthetic(Law(*draw), stiffness, speed, float(friction.mean()), friction.size, [SEED, number, 1])
            logs.append(teeth_of(made, speed).statistics()[:2])
        found[name_of(stiffness, speed)] = np.exp(np.quantile(logs, [0.5, *TAILS], axis=0)).T.tolist()
    return found


def measured(folder: str) -> dict[str, list[list[float]]]:
    """The same of the records themselves, with 95 % intervals."""
    found = {}
    for stiffness, speed in RECORDS:
        teeth = teeth_of(record(folder, stiffness, speed), speed)
        value, error = teeth.statistics()[:2], scipy.stats.t.ppf(TAILS[1], BLOCKS - 1) * teeth.errors()[:2]
        found[name_of(stiffness, speed)] = np.exp([value, value - error, value + error]).T.tolist()
    return found


def draw(files: dict[str, dict[str, list[list[float]]]]) -> None:
    """Periods and heights of teeth over the speed, for each spring: predicted as bars, measured as points."""
    figure, grid = panels(2, 1, 4.3)
    for axes, row, label in zip(grid, (0, 1), ("period of teeth [s]", "fall of friction in a tooth"), strict=True):
        for number, stiffness in enumerate((FIRST, *OTHERS)):
            for (name, values), wide in zip(files.items(), (5.0, 1.2), strict=True):
                ends = np.array([values[name_of(stiffness, speed)][row] for speed in MEANS]).T
                x = 1e-3 * np.array(list(MEANS)) * 1.12 ** (2 * number - 2 + (name == "measured"))
                look = {"color": f"C{number}", "alpha": 0.4 if name == "predicted" else 1.0}
                look |= {"marker": "_"} if name == "predicted" else {"label": f"{stiffness} N/m"}
                draw_points(axes, x, ends, look, wide)
        axes.set(xscale="log", yscale="log", xlabel="speed of the drive [mm/s]", ylabel=label)
    grid[0].legend(fontsize="small")
    heads(grid, "period: bars predicted, points measured", "amplitude")
    save(figure, KEPT / "against_measurement.svg")


def main() -> None:
    """One of the three steps."""
    step, folder = sys.argv[1:]
    kept = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in sorted(KEPT.glob("*.json"))}
    if step == "laws":
        for name, ends in KINDS.items():
            draws, misfits = laws(folder, *ends)
            write(f"law_{name}", {"parameters": Law._fields, "draws": rounded(draws), "misfits": rounded(misfits)})
    elif step == "predict":
        for name in KINDS:
            write(f"predicted_{name}", predicted(folder, np.array(kept[f"law_{name}"]["draws"])))
    elif step == "compare":
        write("measured", found := measured(folder))
        draw({"predicted": kept["predicted_with"], "measured": found})


def rounded(values: np.ndarray) -> list[Any]:
    """Values to four digits, for files that Git keeps."""
    return np.vectorize(lambda value: float(f"{value:.4g}"))(values).tolist()


def write(name: str, values: object) -> None:
    """A file that Git keeps."""
    (KEPT / f"{name}.json").write_text(json.dumps(values) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
