"""Sizes that both the rules of scenes and the computations obey; light, because every start of the study imports it."""

from itertools import pairwise

MOST_NUMBERS = 100_000_000  # in one array of floats: 0.8 GB

SHARES = 8  # of the samples of a stage, where the study finds their number; a job takes one or two
MOST_RUNS = 20_000  # at each damping ratio, where the study finds the number of runs
LARGEST_ACCURACY = {"friction_mean": 0.5, "friction_std": 0.5, "pressure": 0.4, "cycles": 1000}  # half widths
MOST_WINDOWS = 20_000_000  # of all strips and penetrations, where the study finds the number of strips: 2.5 GB

FUNCTIONALS = 8  # local functionals of the heights, in the order of chaos.functionals.NAMES
TRAINING_SPACING = 8  # columns of a strip from one training column to the next: closer columns add little information
TRAINING_NODES = 16  # at most, on each surface of the square

DESIGN_SAMPLES = 4000  # Latin hypercube samples of a design, to which eqs. (8) and (9) are fitted


def designs_of(samples: int) -> list[slice]:
    """The designs that Latin hypercube samples hold, one after another: one for each full DESIGN_SAMPLES."""
    count = max(1, samples // DESIGN_SAMPLES)
    ends = [samples * number // count for number in range(count + 1)]
    return [slice(*pair) for pair in pairwise(ends)]
