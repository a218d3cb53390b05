"""Least squares of friction with a memory, about scatter over the slipped distance and noise.

The likelihood has many maxima: a spring, a low-pass and a memory all round off a step. So many starts are compared.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import scipy

from roughslip.errors import IllPosedError
from roughslip.record.likelihood import ProcessFit
from roughslip.record.steps_of_speed import LAG, LENGTH, MASS, SPRING, B, Rows, S

LOW, HIGH = (-np.inf, -23.0, 0.0, 0.0, 0.0), (np.inf, -2.0, np.inf, np.inf, np.inf)  # of p
MOST_LATE, PAYS = 0.5, 10.0  # samples of a step; half the sum of squares that a mass has to explain
FAR = 1e10  # a miss where nothing moves
LENGTHS, SPRINGS, SIZES = 9, (0.0, 0.03, 0.3, 3.0), (0.3, 1.0)  # starts; of D_c / b; of the range of friction
SLOW = 2.0  # samples of a time constant to begin with, next to none
TRIED, BRIEF, FEW, MANY, ROUNDS = 6, 6, 12, 60, 3  # starts that are fitted; steps of fits; fits of scatter
START, SMALL = 0.05, 1e-4  # length over path, scatter and noise before they are fitted


def fitted_memory(rows: Rows, given: np.ndarray) -> tuple[Rows, np.ndarray, np.ndarray, float]:
    """Rows with the likelier kind of low-pass, parameters, a root of their covariance, and the p-value of no memory.

    given : parameters, NaN where free

    Raises IllPosedError where no parameters have the friction of the record.
    """
    free, places = np.isnan(given), np.arange(given.size)
    heavy, free = free, free & (places != MASS)
    if (freedom := rows.root.size - np.count_nonzero(heavy)) < 1 or not np.ptp(rows.seen.friction / rows.root) > 0.0:
        raise IllPosedError("too few samples after steps of speed, or one friction")
    p = _first(rows, np.nan_to_num(given), free)
    process = rows.process(p, free)
    starts = p, np.where(free & (places == LAG), SLOW, p)
    kinds = rows, replace(rows, digital=True)
    fits = [(*_fit(one, start, free, process, FEW), one) for one, start in product(kinds, starts)]
    cost, p, rows = min(fits, key=lambda one: one[0])
    if heavy[MASS] and p[SPRING] > 0.0:  # a mass that swings by a radian in each sample, to begin with
        massive = np.where(places == MASS, 1e12 * rows.interval**2 / p[SPRING], p)
        other, found = _fit(rows, massive, heavy, process)
        p, free = (found, heavy) if other < cost - PAYS else (p, free)
    for _ in range(ROUNDS - 1):
        process = rows.process(p, free)
        cost, p = _fit(rows, p, free, process)
    none, without = free & (places > LENGTH), np.where(places == B, 0.0, p)
    stiff = np.where(places == SPRING, 0.0, without)
    better = min(_fit(rows, one, none, process)[0] for one in (without, stiff)) / cost - 1.0
    chance = float(scipy.stats.f.sf(0.5 * freedom * better, 2, freedom)) if p[B] > 0.0 else 1.0
    return rows, p, _root(rows, p, free, process) * np.sqrt(2.0 * cost / freedom), chance


def _first(rows: Rows, start: np.ndarray, free: np.ndarray) -> np.ndarray:
    """Parameters from which a fit goes to the least squares: of many lengths, springs and sizes the best ones."""
    linear, friction = np.arange(start.size) >= S, rows.drive.friction
    process = ProcessFit(START * rows.drive.slipped[-1], SMALL, SMALL, 0.0, False, np.eye(2), np.nan, rows.root)
    start[LENGTH] = np.log(rows.reach)
    stiff = np.where(linear | (np.arange(start.size) == LENGTH), start, 0.0)
    white = rows.white(process, np.column_stack([rows.slopes(stiff, linear), friction]))
    start[linear] = np.linalg.lstsq(white[:, :-1], white[:, -1], rcond=None)[0]
    start[slice(*rows.ends)] = 0.0
    start[S] = start[S + 1] if rows.single else start[S]
    of_b = np.ptp(np.quantile(friction[rows.used], [0.01, 0.99])) / np.log(rows.levels[-1] / rows.levels[0])
    tried = []
    for length, share, size in product(
        np.geomspace(rows.interval * rows.levels[0], rows.reach, LENGTHS),
        SPRINGS if free[SPRING] else (0.0,),
        SIZES,
    ):
        one = start.copy()
        one[:SPRING] = size * of_b, np.log(length)
        one[SPRING] += 1e6 * share * length / (size * of_b)
        tried.append(one)
    miss = friction[:, None] - np.stack([rows.friction(p) for p in tried], axis=1)
    squares = np.sum(rows.white(process, np.nan_to_num(miss, nan=FAR)) ** 2, axis=0)
    some = free & ~np.isin(np.arange(free.size), [LAG, MASS])  # which hide others from afar
    brief = [_fit(rows, tried[i], some, process, BRIEF) for i in np.argsort(squares)[:TRIED]]
    return _fit(rows, min(brief, key=lambda one: one[0])[1], some, process)[1]


def _fit(
    rows: Rows, start: np.ndarray, free: np.ndarray, process: ProcessFit, most: int = MANY
) -> tuple[float, np.ndarray]:
    """Half the sum of squares and parameters of least squares from a start. most : steps"""
    bounds = np.tile([[-np.inf], [np.inf]], start.size)
    bounds[:, :S] = LOW, HIGH
    bounds[:, slice(*rows.ends)] = [[-MOST_LATE], [MOST_LATE]]

    def whole(some: np.ndarray) -> np.ndarray:
        p = start.copy()
        p[free] = some
        return p

    def left(some: np.ndarray) -> np.ndarray:
        p = whole(some)
        miss = np.nan_to_num(rows.drive.friction - rows.friction(p), nan=FAR)
        return np.append(rows.white(process, miss[:, None]), rows.prior() @ p)

    def slopes(some: np.ndarray) -> np.ndarray:
        return np.vstack([-rows.white(process, rows.slopes(whole(some), free)), rows.prior()[:, free]])

    at = np.clip(start, *bounds)[free]
    if not np.all(np.isfinite(left(at))):
        raise IllPosedError("no contact on this rig slides as the record does")
    found = scipy.optimize.least_squares(left, at, slopes, bounds[:, free], x_scale="jac", max_nfev=most)
    return float(found.cost), whole(found.x)


def _root(rows: Rows, p: np.ndarray, free: np.ndarray, process: ProcessFit) -> np.ndarray:
    """R with R R' the covariance of least squares."""
    columns = np.vstack([rows.white(process, rows.slopes(p, free)), rows.prior()[:, free]])
    norms = np.maximum(np.linalg.norm(columns, axis=0), 1e-30)
    root = np.zeros((p.size, len(columns)))
    root[free] = np.linalg.pinv(columns / norms) / norms[:, None]
    return root
