"""The stochastic part of friction along the belt: mu_S(s) between equidistant nodes.

Cubic Hermite pieces with central differences as tangents (Catmull & Rom 1974), one-sided at the two ends: continuous
with its first derivative. Without nodes mu_S = 0 on a path without end.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from roughslip.compilation.cache import compiled
from roughslip.errors import ParameterError
from roughslip.oscillator.laws import CONTRACTED
from roughslip.validation import gate, positive, reals

NO_PATH = "a friction path is a row of finite nodes, or several one after another, or None"
WIDTHS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64)  # nodes that one step may pass
OVERSHOOT = 1 / 6  # of the range of the nodes: cubic pieces between them go no further beyond it
AHEAD = 3 + WIDTHS[-1]  # nodes that a step may read beyond the one before it


class Path(NamedTuple):
    """The present nodes of a path: numbers `first` and following, at the slipped distances number times spacing [m].

    ends : whether the path ends with the last of them
    least : that mu_S does not fall below, as far as known
    """

    nodes: np.ndarray
    first: int
    spacing: float
    ends: bool
    least: float = -math.inf


class Piece(NamedTuple):
    """mu_S = c0 + c1 t + c2 t^2 + c3 t^3 with t = (s - left) per_spacing, between left and right [m]."""

    c0: float
    c1: float
    c2: float
    c3: float
    left: float
    right: float
    per_spacing: float


@compiled()
def piece_at(path: Path, s: float) -> Piece:
    """The piece that holds s; the last one for any s beyond it (the caller checks the end of the path)."""
    nodes = path.nodes
    if nodes.size == 0:
        return Piece(0.0, 0.0, 0.0, 0.0, 0.0, np.inf, 1.0)
    j = min(int(s / path.spacing) - path.first, nodes.size - 2)
    k = path.first + j
    start, end = nodes[j], nodes[j + 1]
    rise = end - start
    left, right = k * path.spacing, (k + 1) * path.spacing
    out = 0.5 * (end - nodes[j - 1]) if k > 0 else rise
    into = 0.5 * (nodes[j + 2] - start) if j + 2 < nodes.size else rise
    return Piece(start, out, 3.0 * rise - 2.0 * out - into, out + into - 2.0 * rise, left, right, 1.0 / path.spacing)


@compiled()
def reaches(path: Path, s: float) -> bool:
    """Whether the present nodes determine the piece that holds s, and all that a step from there may read."""
    size = path.nodes.size
    return path.ends or size == 0 or int(s / path.spacing) + AHEAD < path.first + size


@compiled(error_model="numpy", fastmath=CONTRACTED)
def mu_s_at(piece: Piece, s: float) -> float:
    """mu_S at the slipped distance s [m]."""
    t = (s - piece.left) * piece.per_spacing
    return piece.c0 + t * (piece.c1 + t * (piece.c2 + t * piece.c3))


@compiled(error_model="numpy", fastmath=CONTRACTED)
def mu_s_slope(piece: Piece, s: float) -> float:
    """d mu_S / ds [1/m]."""
    t = (s - piece.left) * piece.per_spacing
    return (piece.c1 + t * (2.0 * piece.c2 + t * 3.0 * piece.c3)) * piece.per_spacing


class Row(NamedTuple):
    """Nodes of a path that are finite, the lowest and the highest of them."""

    nodes: np.ndarray
    low: float
    high: float


def checked(piece: np.ndarray) -> Row:
    """A row of finite nodes; with rows without nodes a motion would wait for ever."""
    nodes = np.ascontiguousarray(reals("a friction path", piece))
    if nodes.ndim == 1 and nodes.size > 0:
        low, high = float(nodes.min()), float(nodes.max())
        if math.isfinite(high - low):
            return Row(nodes, low, high)
    raise ParameterError(NO_PATH)


class PathFeed:
    """A path that arrives in pieces; it keeps the nodes that the motion may still read.

    path : (nodes,) all nodes, an iterable of such rows one after another, or None for mu_S = 0
    spacing_m : [m] distance of the nodes (not used without a path)

    Raises ParameterError for an invalid path, when the invalid piece arrives.
    """

    def __init__(self, path: np.ndarray | Iterable[np.ndarray] | None, spacing_m: float) -> None:
        pieces = [path] if isinstance(path, np.ndarray) else path or ()
        self._rows = path.rows() if isinstance(path, KeptPath) else map(checked, pieces)
        self.received = 0
        if path is None:
            self.path = Path(np.zeros(0), 0, 1.0, True)
            return
        self._low, self._high = math.inf, -math.inf
        spacing = positive("spacing_m", spacing_m, "m")
        self.path = Path(np.zeros(0), 0, spacing, False)
        self.advance(0.0)
        if self.received < 2:
            raise ParameterError(f"a friction path has at least two finite nodes, not {self.received}")

    @property
    def length_m(self) -> float:
        """Slipped distance [m] at the last present node."""
        return (self.path.first + self.path.nodes.size - 1) * self.path.spacing

    def advance(self, s: float) -> Path:
        """Take the nodes that the motion needs next from s [m] on, and drop those behind it."""
        nodes, first, spacing, ends, _ = self.path
        passed = max(int(s / spacing) - 2 - first, 0)
        rows, size, first = [nodes[passed:]] if nodes.size > passed else [], nodes.size - passed, first + passed
        while not ends and (size == 0 or int(s / spacing) + AHEAD + 1 >= first + size):
            row = next(self._rows, None)
            if row is None:
                ends = True
                break
            self._low, self._high = min(self._low, row.low), max(self._high, row.high)
            rows.append(row.nodes)
            size += row.nodes.size
            self.received += row.nodes.size
        present = rows[0] if len(rows) == 1 else np.concatenate([nodes[:0], *rows])
        self.path = Path(present, first, spacing, ends, self._low - OVERSHOOT * (self._high - self._low))
        return self.path


@gate
class KeptPath:
    """An iterable path that keeps its nodes, so that a second run does not draw them again.

    path : rows of nodes, the same in each iteration; kept up to the last one that a run has read
    maximum : nodes to keep; those after them are drawn for each run
    """

    def __init__(self, path: Iterable[np.ndarray], maximum: float = math.inf) -> None:
        self._path, self._maximum = path, maximum
        self._source, self._pieces = iter(path), 0
        self._kept = Row(np.zeros(0), math.inf, -math.inf)
        self._room = self._kept.nodes

    def __iter__(self) -> Iterator[np.ndarray]:
        return (row.nodes for row in self.rows())

    def rows(self) -> Iterator[Row]:
        """All kept nodes in one row, then those that are drawn, each checked once."""
        read = 0
        while read < self._kept.nodes.size or (read < self._maximum and self._draw()):
            nodes, low, high = self._kept
            yield Row(nodes[read:], low, high)
            read = nodes.size
        if read >= self._maximum:
            yield from map(checked, itertools.islice(self._path, self._pieces, None))

    def _draw(self) -> bool:
        """Keep another piece, in room that doubles; whether there is one."""
        piece = next(self._source, None)
        if piece is None:
            return False
        (nodes, low, high), old = checked(piece), self._kept
        before, size = old.nodes.size, old.nodes.size + nodes.size
        if size > self._room.size:
            self._room = np.concatenate([old.nodes, np.empty(max(nodes.size, before))])
        self._room[before:size] = nodes
        self._kept, self._pieces = Row(self._room[:size], min(low, old.low), max(high, old.high)), self._pieces + 1
        return True
