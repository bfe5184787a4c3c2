"""T on one contact part: by Fourier transforms if elements are equal, compressed if the part is
long, else dense."""

from __future__ import annotations

import abc
import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import scipy

from ...arrays import Array, Complex, Index, Mask
from ...linalg.matrix_free import Krylov
from .kernel import Strip, layer_matrix

LONG_SIZE = 3000
"""Largest number of nodes of unequal elements for which T is dense."""


_kept = functools.lru_cache(maxsize=3)
"""Keeps the last three inverses: T⁻¹, and (I + ρT)⁻¹ of two directions, which may have two ρ."""


class DenseStrip:
    """T as a dense matrix, symmetric in the inner product of the node weights.

    Collocation on Gauss points is symmetric only up to its own error (1e-2). The symmetric part is
    equally good and has a Cholesky factor.
    """

    def __init__(self, strip: Strip, weight: Array) -> None:
        self._root = np.sqrt(weight)
        scaled = layer_matrix(strip) * (self._root[:, None] / self._root)
        self._scaled = 0.5 * (scaled + scaled.T)
        self._cholesky = _kept(self._factored)
        self._stick = StickCholesky(lambda k: self._scaled[k[:, None], k], self._root)

    def _factored(self, rho: float | None) -> Any:
        matrix = self._scaled if rho is None else np.eye(len(self._root)) + rho * self._scaled
        return scipy.linalg.cho_factor(matrix, lower=True, check_finite=False)

    def apply(self, x: Array) -> Array:
        """Return the product T x, (k,)."""
        return np.asarray(self._scaled @ (self._root * x) / self._root)

    def solve(self, x: Array, rho: float | None = None) -> Array:
        """Return T⁻¹ x, or (I + ρT)⁻¹ x if ρ is given, (k,)."""
        return np.asarray(
            scipy.linalg.cho_solve(self._cholesky(rho), self._root * x, check_finite=False)
            / self._root
        )

    def stick_solve(self, stick: Mask, rhs: Array, rtol: float) -> Array:
        """Return x for which T x = rhs on the stick nodes, and x = 0 elsewhere."""
        return self._stick(stick, rhs)

    def matrix(self) -> Array:
        """Return T as a matrix (k, k) [length/stress]."""
        return np.asarray(self._scaled * (self._root / self._root[:, None]))


class ProductStrip(abc.ABC):
    """T by its products and solves with T and I + ρT, and by factors of its small blocks."""

    def __init__(self, block: Callable[[Index], Array], root: Array) -> None:
        self._size, self._stick = len(root), StickCholesky(block, root)

    @functools.cached_property
    def _krylov(self) -> Krylov:
        return Krylov((self._size,), "layer_")

    @abc.abstractmethod
    def apply(self, x: Array) -> Array:
        """Return the product T x, (k,)."""

    @abc.abstractmethod
    def solve(self, x: Array, rho: float | None = None) -> Array:
        """Return T⁻¹ x, or (I + ρT)⁻¹ x if ρ is given, (k,)."""

    @abc.abstractmethod
    def has_factor(self, stick: Mask) -> bool:
        """Return whether a factor of the block of these nodes costs less than iterations."""

    def stick_solve(self, stick: Mask, rhs: Array, rtol: float) -> Array:
        """Return x for which T x = rhs on the stick nodes, and x = 0 elsewhere.

        Without a factor of the block it uses GMRES, preconditioned by the stick block of T⁻¹, which
        alone is x for a tolerance of 1.
        """
        if stick.all():
            return self.solve(rhs)
        if self.has_factor(stick):
            return self._stick(stick, rhs)

        def near(r: Array) -> Array:
            return np.where(stick, self.solve(np.where(stick, r, 0.0)), r)

        rhs = np.where(stick, rhs, 0.0)
        if rtol >= 1.0:
            return near(rhs)
        return np.asarray(
            self._krylov.solve(
                lambda x: np.where(stick, self.apply(np.where(stick, x, 0.0)), x),
                near,
                rhs,
                0.0,
                rtol,
            )
        )

    def matrix(self) -> Array:
        """Return T as a matrix (k, k) [length/stress]."""
        return np.column_stack([self.apply(e) for e in np.eye(self._size)])


class FourierStrip(ProductStrip):
    """T of equal elements of any order, a convolution from element to element.

    A product or a solve takes two transforms. An open strip is continued by its reflections at both
    ends until they make a loop; a closed one is already a loop.
    """

    def __init__(self, strip: Strip, weight: Array) -> None:
        super().__init__(lambda k: self._scaled[k[:, None], k], np.sqrt(weight))
        self._elements, self._nodes = len(strip.length), int(strip.order[0]) + 1
        self._open, self._root, self._ends = not strip.closed, np.sqrt(weight), strip.ends
        loop = strip
        if self._open:
            copies = 2 if strip.ends[0] == strip.ends[1] else 4
            count, total = copies * self._elements, copies * float(strip.length.sum())
            loop = Strip(
                np.arange(count * self._nodes),
                strip.length[0] * np.arange(count),
                np.full(count, strip.length[0]),
                np.full(count, strip.order[0]),
                total,
                strip.layers,
            )
        blocks = layer_matrix(loop, np.arange(self._nodes)).reshape(self._nodes, -1, self._nodes)
        symbol = np.conj(np.fft.rfft(blocks, axis=1)).transpose(1, 0, 2)
        ratio = weight[: self._nodes] / weight[: self._nodes, None]
        symbol = 0.5 * (symbol + np.conj(symbol.transpose(0, 2, 1)) * ratio)
        self._symbol = np.ascontiguousarray(symbol.transpose(1, 2, 0))
        self._inverse = _kept(self._inverted)

    def apply(self, x: Array) -> Array:
        """Return the product T x, (k,)."""
        return self._convolve(self._symbol, x)

    def solve(self, x: Array, rho: float | None = None) -> Array:
        """Return T⁻¹ x, or (I + ρT)⁻¹ x if ρ is given, (k,)."""
        return self._convolve(self._inverse(rho), x)

    def _inverted(self, rho: float | None) -> Complex:
        """Return the symbol of T⁻¹, or that of (I + ρT)⁻¹ if ρ is given."""
        blocks = self._symbol.transpose(2, 0, 1)
        blocks = blocks if rho is None else np.eye(self._nodes) + rho * blocks
        inverse = 1.0 / blocks if self._nodes == 1 else np.linalg.inv(blocks)
        return np.ascontiguousarray(inverse.transpose(1, 2, 0))

    def _convolve(self, symbol: Complex, x: Array) -> Array:
        # the transformed axis last and contiguous: scipy's transforms spend less on it than numpy's
        pieces = x.reshape(self._elements, self._nodes).T
        if self._open:
            first, last = self._ends
            mirrored = pieces[::-1, ::-1]
            copies = [pieces, last * mirrored]
            if first != last:
                copies += [-pieces, first * mirrored]
            pieces = np.concatenate(copies, axis=1)
        spectrum = scipy.fft.rfft(pieces)
        spectrum = (
            np.einsum("abk,bk->ak", symbol, spectrum) if self._nodes > 1 else symbol[0] * spectrum
        )
        return np.asarray(scipy.fft.irfft(spectrum, pieces.shape[1])[:, : self._elements].T.ravel())

    @functools.cached_property
    def _scaled(self) -> Array:
        return np.asarray(self.matrix() * (self._root[:, None] / self._root))

    def has_factor(self, stick: Mask) -> bool:
        """Return whether the system is small."""
        return self._size <= 256


class HodlrStrip(ProductStrip):
    """T as a HODLR matrix, for long strips of unequal elements.

    It is symmetric only up to the error of collocation.
    """

    def __init__(self, strip: Strip, weight: Array, points: Array) -> None:
        from ...compression.hodlr import factor

        super().__init__(self._scaled_block, np.sqrt(weight))
        self._strip, self._points, self._root = strip, points, np.sqrt(weight)
        self._matrix = self._compress(None)
        self._factorisation = _kept(
            lambda rho: factor(self._matrix if rho is None else self._compress(rho))
        )

    def _compress(self, rho: float | None) -> Any:
        """Return T, or I + ρT if ρ is given, as a HODLR matrix."""
        from ...compression.hodlr import compress

        def entries(rows: Index, columns: Index) -> Array:
            block = layer_matrix(self._strip, rows, columns)
            return block if rho is None else rho * block + (rows[:, None] == columns)

        offsets = np.arange(len(self._points) + 1)
        # coarse: T need not be exact, only the same in products and solves
        return compress(entries, self._points, offsets, offsets, 1e-4)

    def apply(self, x: Array) -> Array:
        """Return the product T x, (k,)."""
        return np.asarray(self._matrix @ x)

    def solve(self, x: Array, rho: float | None = None) -> Array:
        """Return T⁻¹ x, or (I + ρT)⁻¹ x if ρ is given, (k,)."""
        return np.asarray(self._factorisation(rho)(x))

    def _scaled_block(self, nodes: Index) -> Array:
        root = self._root[nodes]
        block = layer_matrix(self._strip, nodes, nodes) * (root[:, None] / root)
        return np.asarray(0.5 * (block + block.T))

    def has_factor(self, stick: Mask) -> bool:
        """Return whether the block is small: most nodes of a long part are open."""
        return np.count_nonzero(stick) <= LONG_SIZE


StripOperator = DenseStrip | FourierStrip | HodlrStrip
"""T of one strip; vectors are (k,) arrays."""


def strip_operator(strip: Strip, weight: Array, points: Array) -> StripOperator:
    """Return T of a strip in the form that suits its elements.

    Parameters
    ----------
    strip : Strip
    weight, points : (k,) and (k, 2) arrays
        Node weights and nodes [length].
    """
    if strip.uniform:
        return FourierStrip(strip, weight)
    if len(weight) > LONG_SIZE:
        return HodlrStrip(strip, weight, points)
    return DenseStrip(strip, weight)


class StickCholesky:
    """Solver for x with T x = rhs on the stick nodes and x = 0 elsewhere.

    `block` returns T on some nodes, made symmetric by the roots of the weights. The factors of the
    last sets of nodes are stored, because rigid motions need the same nodes several times.
    """

    def __init__(self, block: Callable[[Index], Array], root: Array) -> None:
        self._block, self._root = block, root
        self._factors = _kept(self._factored)

    def _factored(self, stick: bytes) -> tuple[Index, tuple[Array, bool]]:
        nodes = np.flatnonzero(np.frombuffer(stick, dtype=bool))
        return nodes, scipy.linalg.cho_factor(
            self._block(nodes), lower=True, overwrite_a=True, check_finite=False
        )

    def __call__(self, stick: Mask, rhs: Array) -> Array:
        nodes, factor = self._factors(stick.tobytes())
        result, root = np.zeros_like(rhs), self._root[nodes]
        result[nodes] = scipy.linalg.cho_solve(factor, root * rhs[nodes], check_finite=False) / root
        return result
