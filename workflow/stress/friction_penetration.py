"""Random levels of penetration and the curve through them: the judge knows what a monotone cubic must do."""

from __future__ import annotations

import numpy as np

from roughslip.friction.penetration_law import between, penetration_law
from roughslip.friction.resampling import FEWEST_REPLICATES
from roughslip.probability import Estimate
from workflow.stress.drawing import one_of, power
from workflow.stress.friction_judge import EPS, Met

SHAPES = ("falling", "any", "flat", "steps", "huge-steps")


def judged(seed: tuple[int, ...]) -> Met:
    """Through its levels, monotone between two, its slope as differences have it, without a jump at a level."""
    generator = np.random.default_rng(seed)
    levels, shape = int(generator.integers(2, 9)), one_of(generator, SHAPES)
    q = (
        np.sort(generator.uniform(0.01, 99.99, levels))
        if generator.random() < 0.7
        else np.cumsum(np.geomspace(1e-6, 50, levels))
    )
    rows = generator.standard_normal((1 + FEWEST_REPLICATES, levels))
    if shape == "falling":
        rows = -np.cumsum(np.abs(rows), axis=1)
    elif shape == "flat":
        rows = np.full(rows.shape, 0.3)
    elif shape != "any":
        rows = np.round(rows) * (power(generator, 0, 12) if shape == "huge-steps" else 1.0)
    rows *= power(generator, -12, 6)
    law = penetration_law(q, [Estimate.from_rows(column) for column in rows.T])
    # a share of each interval, away from its ends by more than the step of the differences
    share = np.linspace(0.02, 0.98, 25)
    points = (q[:-1, None] + share * np.diff(q)[:, None]).ravel()
    values, slopes = law.at(points).rows, law.slope(points).rows
    widths = np.repeat(np.diff(q), len(share))
    step = 1e-4 * widths
    differences = (law.at(points + step).rows - law.at(points - step).rows) / (2 * step)
    falls = np.diff(rows, axis=1)
    low, high = (np.repeat(end(rows[:, :-1], rows[:, 1:]), len(share), axis=1) for end in (np.minimum, np.maximum))
    scale = np.abs(rows).max(axis=1, keepdims=True) + np.abs(falls).max(axis=1, keepdims=True)
    scale[scale == 0] = 1.0
    rising = slopes * np.sign(np.repeat(falls, len(share), axis=1))
    ends = np.concatenate((q[:-1] * (1 + 4 * EPS), q[1:] * (1 - 4 * EPS)))
    ends = ends[(ends >= q[0]) & (ends <= q[-1])]
    level = int(generator.integers(levels))
    # the third derivative of a cubic with slopes of 3 secants at most is below 24 falls / width^3
    steepest = np.repeat(np.abs(falls), len(share), axis=1) / widths
    return {
        "at its levels": (np.max(np.abs(law.at(q).rows - rows) / scale), 8 * EPS),
        "one level": (abs(between(q, rows[0], float(q[level])) - rows[0, level]), 0),
        "one point": (abs(between(q, rows[0], float(points[3])) - values[0, 3]) / scale[0, 0], 8 * EPS),
        "between two levels": (np.max(np.maximum(low - values, values - high) / scale), 16 * EPS),
        "turns nowhere": (np.max(-rising * widths / scale), 64 * EPS),
        "its slope": (np.max(np.abs(slopes - differences) / (4e-8 * steepest + 1e5 * EPS * scale / widths)), 1.0),
        "continuous": (
            np.max(np.abs(law.at(ends).rows - rows[:, np.argmin(np.abs(ends[:, None] - q), axis=1)]) / scale),
            1e-6,
        ),
    }
