"""Stick and slip of masses that move on and on, each on a friction path of its own, and their times in both states.

The equation is that of a run (`equation`), and so are the nodes of its path and the pieces between them (`path`). Steps
are of the classical fourth-order method of Runge and Kutta, and end with a node. Nothing is kept but the times.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.oscillator.equation import Coefficients, acceleration
from roughslip.oscillator.event_loop import static_limit
from roughslip.oscillator.path import Path, Piece, mu_s_at, piece_at

HALVINGS = 20  # of the step that reaches the belt
PAST = 1e-3  # of the spacing, beyond a node, at which a step ends
STILL = 1e-9  # of the belt's velocity, below which a step does not end with a node
SPELL, SLID, ENDS, SLIPS, BIRTHS, CROSSED, TIME, SPELL_SQUARES, SLID_SQUARES = range(9)  # totals


class Scatter(NamedTuple):
    """A friction path, node by node: mu_S of a score z, and z by regression on those before it.

    spacing : [m] of the nodes
    weights, noise : (lags,) [-] of the scores before, the last one first; deviation of what is new
    least, per_score, values : first score of a table, its nodes in a score, (nodes,) mu_S
    """

    spacing: float
    weights: np.ndarray
    noise: float
    least: float
    per_score: float
    values: np.ndarray


@compiled(error_model="numpy")
def mu_of_score(z: float, scatter: Scatter) -> float:
    """mu_S of a standard normal score."""
    place = min(max((z - scatter.least) * scatter.per_score, 0.0), scatter.values.size - 1.001)
    k = int(place)
    return scatter.values[k] + (place - k) * (scatter.values[k + 1] - scatter.values[k])


@compiled(error_model="numpy")
def _step(x: float, u: float, s: float, h: float, piece: Piece, p: Coefficients) -> Any:
    """X and X' after a step h of tau. Friction is constant beyond the belt, as the cubic of a table goes anywhere."""
    a = acceleration(0.0, x, u, 1.0, mu_s_at(piece, s), p)
    dx, du, x1, u1 = u, a, u, a
    for part, weight in ((0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
        x2, u2 = x + part * h * x1, u + part * h * u1
        x1, u1 = u2, acceleration(0.0, x2, min(u2, p.V), 1.0, mu_s_at(piece, s + part * h * p.V - (x2 - x)), p)
        dx, du = dx + weight * x1, du + weight * u1
    return x + h / 6.0 * dx, u + h / 6.0 * du


@compiled(error_model="numpy")
def _to_belt(x: float, u: float, s: float, h: float, piece: Piece, p: Coefficients) -> Any:
    """The part of a step until the belt's velocity, and X there."""
    low, high, end = 0.0, h, x
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        end, velocity = _step(x, u, s, middle, piece, p)
        if velocity >= p.V:
            high = middle
        else:
            low = middle
    return middle, end


@compiled(error_model="numpy")
def _next_node(z: np.ndarray, path: Path, scatter: Scatter, generator: np.random.Generator) -> None:
    """Draw the score after z, and move both rows on by a node."""
    nodes = path.nodes
    new, last = scatter.noise * generator.standard_normal(), z.size - 1
    for k in range(z.size):
        new += scatter.weights[k] * z[last - k]
    for k in range(last):
        z[k] = z[k + 1]
    for k in range(3):
        nodes[k] = nodes[k + 1]
    z[last], nodes[3] = new, mu_of_score(new, scatter)


@compiled(error_model="numpy")
def totals_of(
    scores: np.ndarray,
    scatter: Scatter,
    p: Coefficients,
    longest: tuple[float, float],
    steps: int,
    generator: np.random.Generator,
) -> np.ndarray:
    """Totals over masses, which begin at a departure and take so many steps each.

    scores : (n, lags) of the nodes of their paths, overwritten
    longest : tau of a step, and of a slip of the cycle; a longer one is sliding from its departure on

    Returns (9,) by SPELL to SLID_SQUARES. SPELL and SLID are tau in stick-slip and in sliding, TIME is tau of all. ENDS
    are those of stick-slip, SLIPS those of slips that slide, BIRTHS beginnings of stick-slip. CROSSED are passages of
    the belt under friction of the other sign. Squares are sums over all durations in a state, ended or not.
    """
    out, path = np.zeros(9), Path(np.zeros(4), 0, scatter.spacing, False)
    for z in scores:
        for k in range(4):
            path.nodes[k] = mu_of_score(z[z.size - 4 + k], scatter)
        limit, piece = static_limit(path.nodes[1], p), piece_at(path, scatter.spacing)
        x, u, s, age, backwards, slides, in_spell = limit - 2.0 * p.D * p.V, p.V, piece.left, 0.0, False, False, True
        lasted = 0.0
        for _ in range(steps):
            h = min(longest[0], (piece.right + PAST * scatter.spacing - s) / max(p.V - u, STILL * p.V))
            end, velocity = _step(x, u, s, h, piece, p)
            at_belt = velocity >= p.V and age > 0.0
            if at_belt:
                h, end = _to_belt(x, u, s, h, piece, p)
            s += h * p.V - (end - x)
            x, u, age = end, p.V if at_belt else min(velocity, p.V), age + h
            out[TIME] += h
            while s >= piece.right:
                s -= scatter.spacing
                _next_node(z, path, scatter, generator)
                piece = piece_at(path, piece.left)
            backwards |= u < 0.0
            if age > longest[1] and not slides:
                out[ENDS] += in_spell
                out[SPELL_SQUARES] += lasted**2
                slides, in_spell, lasted = True, False, 0.0
            if not at_belt:
                continue
            limit = static_limit(mu_s_at(piece, s), p)
            spare = limit - (x + 2.0 * p.D * p.V)
            out[CROSSED] += spare > 2.0 * limit
            if spare >= 0.0:
                out[SLIPS] += slides
                out[BIRTHS] += backwards and not slides and not in_spell
                in_spell |= backwards and not slides
                lasted = (lasted + age + spare / p.V) * in_spell
                out[SLID_SQUARES] += age**2 * slides
                out[SLID if slides else SPELL] += age * (slides or in_spell)
                out[SPELL] += spare / p.V * in_spell
                out[TIME] += spare / p.V
                x, age, backwards, slides = limit - 2.0 * p.D * p.V, 0.0, False, False
        out[SLID if slides else SPELL] += age * (slides or in_spell)
        out[SLID_SQUARES if slides else SPELL_SQUARES] += (lasted + age) ** 2 * (slides or in_spell)
    return out
