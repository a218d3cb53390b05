"""Streams of random numbers: the second entry of every seed, after that of the scene, so that no two stages share one.

A generator is `default_rng([scene.seed, Stream.STRIP, number])`, with the number of the sample.
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
