"""Sizes that both the rules of scenes and the computations obey; light, because every start of the study imports it."""

from itertools import pairwise

MOST_NUMBERS = 100_000_000  # in one array of floats: 0.8 GB

MOST_WINDOWS = 20_000_000  # of all strips and penetrations: 2.5 GB

WINDOWS, MARGIN = 4, 0.5  # windows on a strip, and the part of one that is solved beyond either end and not used
LEAST_CONTACT = 0.001  # of its area, with which a window counts: friction of one cell grows without bound
FUNCTIONALS = 8  # local functionals of the heights, in the order of chaos.variables.NAMES
TRAINING_SPACING = 8  # columns of a strip from one training column to the next: closer columns add little information

DESIGN_SAMPLES = 4000  # Latin hypercube samples of a design, to which eqs. (8) and (9) are fitted


def designs_of(samples: int) -> list[slice]:
    """The designs that Latin hypercube samples hold, one after another: one for each full DESIGN_SAMPLES."""
    count = max(1, samples // DESIGN_SAMPLES)
    ends = [samples * number // count for number in range(count + 1)]
    return [slice(*pair) for pair in pairwise(ends)]


PATH_NODES = 4  # of a friction path, in a correlation length: sticking depends on integrals over many of them
