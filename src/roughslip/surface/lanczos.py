"""Leading eigenpairs of the covariance matrix of a mesh, never formed: Lanczos on all its symmetry classes at once.

C(-x, -y) = C(x, y), so modes are even or odd under reflection in the centre of the mesh; where C(-x, y) = C(x, y) too,
they are even or odd about both its middle lines. Each class has a Lanczos process of its own, with vectors a half or a
quarter as long and fewer of them, and one product with the sum of their vectors serves all of them.

A process that starts from one vector sees one mode of each eigenvalue. Those that symmetry makes equal, as on a square,
mostly fall into different classes; others may come twice in one, such as lambda_0 lambda_2 of a product of equal
factors. So the modes are taken out once they have converged, and the processes start again from new vectors, until
they find nothing more above the smallest mode asked for and have gone on for so long that something would have shown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import ducc0  # type: ignore[import-not-found]
import numpy as np
import scipy.linalg

from roughslip.errors import ConvergenceError, ParameterError, whole
from roughslip.grid import Grid
from roughslip.surface.covariance import StationaryCovariance
from roughslip.surface.embedding import circulant_eigenvalues
from roughslip.surface.symmetry import Operator, SymmetryClass, symmetry_classes

TOLERANCE = 1e-11  # of Lanczos: residual over the smallest eigenvalue asked for; most modes end near rounding
ROUNDING = 1e-14  # of a product, relative to the largest eigenvalue
LARGEST_RESIDUAL = 1e-9  # relative to the largest eigenvalue
DOUBT = 1e-6  # chance that a mode stays unseen, whatever the spectrum
CANCELLED = 0.5  # share of a vector that orthogonalisation leaves, below which it is repeated
STRIDE, SHARE = 5, 16  # products between looks at the Ritz values; of a large basis the 16th part of its vectors
MOST_PRODUCTS = 20_000  # from one start


class Process:
    """Lanczos in one class: every vector is orthogonalised against all before, and a full basis is halved.

    basis : rows 0 ... count - 1 orthonormal, of which the first `kept` were there at the start; the next is row `count`
    projected : (count, count) the matrix in this basis
    coupling : norm of what the last product has outside the basis; 0 where nothing is left

    Method: Lanczos with thick restarts (Wu and Simon, SIAM J. Matrix Anal. Appl. 22, 2000, 602).
    """

    def __init__(self, symmetry: SymmetryClass, order: int, seed: int) -> None:
        self.symmetry = symmetry
        self.most_kept = order + 10
        capacity = min(symmetry.size, 2 * order + 60)
        self.basis = np.empty((capacity + 1, symmetry.size))
        self.projected = np.zeros((capacity, capacity))
        self.count = self.kept = 0
        self.coupling = 0.0
        self.generator = np.random.default_rng(seed)  # fixed: the same bits from run to run
        self.start(0.0)

    def start(self, residual: float) -> None:
        """Keeps the Ritz vectors of at most this residual, the largest first, and goes on from a random vector."""
        if self.count:
            _, residuals, vectors = self.ritz()
            self._compress(vectors[:, residuals <= residual][:, : self.most_kept])
        self.kept = self.count
        if self.count == self.symmetry.size:
            return
        direction, _ = self._orthogonalised(self.generator.standard_normal(self.symmetry.size), self.count)
        self.coupling = float(np.linalg.norm(direction))
        self.basis[self.count] = direction / self.coupling

    def next_field(self) -> np.ndarray:
        """(nx, ny) of which the product is due; a full basis is halved before."""
        if self.count == len(self.projected):
            self._restart()
        return self.symmetry.unfold(self.basis[self.count])

    def advance(self, image: np.ndarray) -> None:
        """One step, given the product of the matrix with a field whose part in this class is the next vector."""
        image, coefficients = self._orthogonalised(self.symmetry.fold(image), self.count + 1)
        self.projected[self.count, : self.count + 1] = coefficients
        self.projected[: self.count + 1, self.count] = coefficients
        self.count += 1
        self.coupling = float(np.linalg.norm(image)) if self.count < self.symmetry.size else 0.0
        if self.coupling:
            self.basis[self.count] = image / self.coupling

    def ritz(self, first: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Values descending, their residuals, and vectors in columns: of the basis from its row `first` on."""
        values, vectors = np.linalg.eigh(self.projected[first : self.count, first : self.count])
        return values[::-1], self.coupling * np.abs(vectors[-1, ::-1]), vectors[:, ::-1]

    def _orthogonalised(self, vector: np.ndarray, rows: int) -> tuple[np.ndarray, np.ndarray]:
        """The part of a vector orthogonal to so many rows of the basis, and its coefficients in them."""
        basis, last = self.basis[:rows], self.basis[max(rows - 2, 0) : rows]
        coefficients = np.zeros(rows)
        coefficients[-2:] = last @ vector  # of a product all but rounding, so that one pass over the others is enough
        vector = vector - coefficients[-2:] @ last
        for _ in range(2):
            before = np.linalg.norm(vector)
            rest = basis @ vector
            vector -= rest @ basis
            coefficients += rest
            if np.linalg.norm(vector) >= CANCELLED * before:
                break
        return vector, coefficients

    def _restart(self) -> None:
        """The larger half of the Ritz vectors since the start goes on, with the same next vector."""
        following = self.basis[self.count].copy()
        half = self.ritz(self.kept)[2][:, : (self.count - self.kept) // 2]
        self._compress(scipy.linalg.block_diag(np.eye(self.kept), half))
        self.basis[self.count] = following

    def _compress(self, rotation: np.ndarray) -> None:
        """The basis turned into fewer vectors, whose coefficients in it are the columns of `rotation`."""
        old, self.count = self.count, rotation.shape[1]
        self.basis[: self.count] = rotation.T @ self.basis[:old]
        self.projected[: self.count, : self.count] = rotation.T @ self.projected[:old, :old] @ rotation


def leading_modes(
    covariance: StationaryCovariance, grid: Grid, order: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The `order` largest eigenvalues of the covariance matrix of the nodes over Sq^2, and their vectors.

    covariance, grid : of the field
    order : M, at most a quarter of the nodes

    Returns eigenvalues (M,) [-] descending, vectors (M, nx ny) of unit norm, and residuals
    |C phi - lambda phi| / lambda_1 (M,) [-], computed afresh.
    Raises ConvergenceError where Lanczos stops short or a residual exceeds LARGEST_RESIDUAL: ask for fewer modes;
    ParameterError for a covariance that is not finite, and for an order outside 1 ... nx ny.

    Method: Lanczos on symmetry classes with products by FFT. That no mode is missing, however often its eigenvalue
    comes, is seen by Lanczos from a random start on the matrix without the modes found: after k steps the largest Ritz
    value is below (1 - e) times the largest eigenvalue with a chance of at most 1.648 sqrt(n) exp(-(2 k - 1) sqrt(e))
    (Kuczynski and Wozniakowski, SIAM J. Matrix Anal. Appl. 13, 1992, 1094, theorem 4.2).
    """
    if not 1 <= whole("the order", order) <= grid.size:
        raise ParameterError(f"order {order} is not between 1 and the {grid.size} nodes of the mesh")
    apply = covariance_operator(covariance, grid)
    processes = [Process(one, order, seed) for seed, one in enumerate(symmetry_classes(covariance, grid))]
    while True:
        smallest, tolerance = _converge(apply, processes, order)
        for process in processes:
            process.start(tolerance)
        enough = sum(process.kept for process in processes) >= order
        if enough and _nothing_above(smallest, tolerance, apply, processes):
            break
    values = np.concatenate([process.projected.diagonal()[: process.kept] for process in processes])
    residuals = np.concatenate([*_residuals(apply, processes)]) / values.max()
    owners = [(process, row) for process in processes for row in range(process.kept)]
    leading = np.argsort(-values, kind="stable")[:order]
    vectors = np.empty((order, grid.size))
    for m, (process, row) in enumerate(owners[index] for index in leading):
        vectors[m] = process.symmetry.unfold(process.basis[row]).ravel()
    worst = float(residuals[leading].max())
    if not worst <= LARGEST_RESIDUAL:
        raise ConvergenceError(f"modes of {grid.shape} nodes are inaccurate; ask for fewer", worst, order)
    return values[leading], vectors, residuals[leading]


def _residuals(apply: Operator, processes: Sequence[Process]) -> list[np.ndarray]:
    """|C phi - lambda phi| of the vectors that every process keeps, one product for one vector of each.

    The parts of the image in the classes are orthogonal, so what one class should not hold of another is seen as well.
    """
    residuals = [np.empty(process.kept) for process in processes]
    for row in range(max(process.kept for process in processes)):
        owners = [(process, norms) for process, norms in zip(processes, residuals, strict=True) if row < process.kept]
        image = apply(np.sum([process.symmetry.unfold(process.basis[row]) for process, _ in owners], axis=0))
        for process, norms in owners:
            expected = process.projected[row, row] * process.basis[row]
            norms[row] = np.linalg.norm(process.symmetry.fold(image) - expected)
    return residuals


def _converge(apply: Operator, processes: Sequence[Process], order: int) -> tuple[float, float]:
    """Goes on until the `order` largest Ritz values, all where there are fewer, have converged.

    Returns the smallest of them, and the residual to which.
    """
    products, worst = 0, math.inf
    while products < MOST_PRODUCTS:
        products += _advance(apply, processes, max(process.count for process in processes) // SHARE)
        pairs = [process.ritz()[:2] for process in processes]
        values, residuals = (np.concatenate(part) for part in zip(*pairs, strict=True))
        leading = np.argsort(-values)[:order]
        smallest, largest = float(values[leading[-1]]), float(values[leading[0]])
        tolerance = TOLERANCE * abs(smallest) + ROUNDING * largest
        if residuals[leading].max() <= tolerance:
            return smallest, tolerance
        worst = float(residuals[leading].max()) / largest
    raise ConvergenceError(f"Lanczos has not found {order} modes; ask for fewer", worst, products)


def _nothing_above(limit: float, tolerance: float, apply: Operator, processes: Sequence[Process]) -> bool:
    """Whether the matrix without the vectors kept has no eigenvalue above the limit; goes on until that is known."""
    products, certain = 0, False
    while not certain:
        if products >= MOST_PRODUCTS:
            raise ConvergenceError("whether a mode is missing cannot be told; ask for fewer", math.nan, products)
        products += _advance(apply, processes, products // SHARE)
        certain = True
        for process in processes:
            steps = process.count - process.kept
            if not steps:  # the modes kept are all of the class
                continue
            values, residuals, _ = process.ritz(process.kept)
            if values[0] > limit + tolerance:
                return False
            error = (math.log(1.648 * math.sqrt(process.symmetry.size) / DOUBT) / (2 * steps - 1)) ** 2
            # where the next eigenvalue is as large as the limit, it converges
            certain &= bool(values[0] <= (1 - error) * limit or residuals[0] <= tolerance)
    return True


def _advance(apply: Operator, processes: Sequence[Process], products: int) -> int:
    """So many products, at least STRIDE, each a step of every process that has not ended; their number."""
    products = max(STRIDE, products)
    for _ in range(products):
        active = [process for process in processes if process.coupling]
        if not active:
            break
        field = active[0].next_field()
        for process in active[1:]:
            field += process.next_field()
        image = apply(field)
        for process in active:
            process.advance(image)
    return products


def covariance_operator(covariance: StationaryCovariance, grid: Grid) -> Operator:
    """The function that multiplies a field (nx, ny) by the covariance matrix of the nodes over Sq^2.

    A convolution on a torus of twice the mesh; rows that are padding are neither transformed nor transformed back.
    Raises ParameterError for a covariance that is not finite.
    """
    nx, ny = grid.shape
    torus = 2 * nx, 2 * ny
    scale = covariance.rms_height_m**2 * math.prod(torus)
    symbol = circulant_eigenvalues(covariance, grid, torus) / scale
    if not np.all(np.isfinite(symbol)):
        raise ParameterError(f"the covariance is not finite at all lags of {nx} x {ny} nodes")
    padded, spectrum = np.zeros((nx, 2 * ny)), np.zeros((2 * nx, ny + 1), dtype=complex)
    result = np.empty_like(padded)

    def apply(field: np.ndarray) -> np.ndarray:
        padded[:, :ny] = field
        ducc0.fft.r2c(padded, axes=(1,), out=spectrum[:nx])
        spectrum[nx:] = 0.0
        ducc0.fft.c2c(spectrum, axes=(0,), out=spectrum)
        np.multiply(spectrum, symbol, out=spectrum)
        ducc0.fft.c2c(spectrum, axes=(0,), forward=False, out=spectrum)
        ducc0.fft.c2r(
            spectrum[:nx], axes=(1,), lastsize=2 * ny, forward=False, out=result, allow_overwriting_input=True
        )
        return result[:, :ny].copy()

    return apply
