"""Objects of the science, made from the part of a scene that a stage reads, and the streams of random numbers.

A generator is `default_rng([scene.seed, Stream.STRIP, number])`, with the number of the sample. The second entry is
that of a stream, so that no two stages share one.
"""

from enum import IntEnum


class Stream(IntEnum):
    """What is drawn. Numbers that are left out belonged to stages that no longer exist."""

    MONTE_CARLO = 1
    LATIN_HYPERCUBE = 2
    EXPANSION_DESIGN = 3
    STRIP = 4
    DRAWS = 5
    BOOTSTRAP = 6
    PROCESS = 7
    MAP = 15
    ANSWER = 18
    CELL = 19
    BUDGET = 20
    RECORD = 24
