"""Hierarchically compressed operators (HODLR with nested bases) and their products. They need
nothing but entries."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from ...arrays import Array, Index, even_bounds
from ...record import record
from ...untyped import Comm
from ..workers import Workers
from .skeleton import Entries, ManyEntries, Operator
from .subtrees import Forest
from .translations import Stretch, Translations
from .tree_levels import Stack, build_part, build_top

PROBED = 20_000
"""Number of nodes whose columns of some exact rows are in memory at once."""


@record
class Split:
    """The distribution of nodes: bounds (ranks + 1,), this rank's ranges (one for each subtree),
    and the size of a leaf."""

    bounds: Index
    ranges: list[tuple[int, int]]
    leaf: int


class HODLR:
    """A compressed operator; `compress` makes one.

    Vectors are this rank's share: the degrees of freedom of its nodes, first_node to last_node
    (exclusive).

    Attributes
    ----------
    shape : (int, int)
        Rows and columns of the whole operator.
    first_node, last_node : int
    """

    def __init__(
        self,
        operator: Operator,
        parts: list[Stack],
        top: Stack | None,
        workers: Workers,
        split: Split,
    ) -> None:
        self.operator = operator
        self.parts = parts
        self.top = top
        self.workers = workers
        self.split = split
        bounds = split.bounds
        self.shape = int(operator.row_axis.offsets[-1]), int(operator.column_axis.offsets[-1])
        self.first_node, self.last_node = int(bounds[workers.rank]), int(bounds[workers.rank + 1])
        lengths = np.array([part.levels[0].near.shape[1] for part in parts])
        kept = np.array(workers.gather([len(part.levels[-1].kept_rows) for part in parts]))
        first = sum(workers.gather([len(parts)])[: workers.rank])
        self.forest = Forest(list(parts), top, workers, lengths, kept, first)

    def mult(self, x: Array) -> Array:
        """Return H x for x (n,), or for several columns (n, s). Collective."""
        return self.forest.sweep(x)

    __matmul__ = mult

    def with_columns(self, entries: Entries, col_offsets: ArrayLike) -> HODLR:
        """Compress an operator with the same rows. Its columns are those that this operator was
        prepared for by `serve`. Collective.

        It costs about what its columns cost: the bases of rows are shared.

        Parameters
        ----------
        entries : callable
        col_offsets : (n+1,) int array
            As for `compress`.
        """
        operator = self.operator.with_columns(entries, np.asarray(col_offsets, dtype=np.int64))
        return _build(operator, self.workers, self.split, self)

    def error_estimate(self, entries: Entries, rng: np.random.Generator, probes: int = 8) -> float:
        """Return the largest error of a few random rows, over the 2-norm of the longest exact row
        [-]. Collective.

        The 2-norm of a row's error is estimated by its products with a few random vectors of unit
        variance.

        Parameters
        ----------
        entries : callable
            As for `compress`.
        rng : numpy.random.Generator
            That of rank 0 is used.
        probes : int
            Number of nodes, and of vectors.
        """
        rows_of, columns_of = self.operator.row_axis, self.operator.column_axis
        carriers = np.flatnonzero(np.diff(rows_of.offsets))
        nodes, x = self.workers.at_root(
            lambda: (
                np.sort(rng.choice(carriers, min(probes, len(carriers)), replace=False)),
                rng.standard_normal((self.shape[1], probes)),
            )
        )
        rows, own = rows_of.freedoms(nodes), rows_of.offsets[[self.first_node, self.last_node]]
        own_x = x[columns_of.offsets[self.first_node] : columns_of.offsets[self.last_node]]
        del x
        product, squares = np.zeros((len(rows), probes)), np.zeros(len(rows))
        # rows of a large operator are long: some columns at a time
        cuts = [*range(self.first_node, self.last_node, PROBED), self.last_node]
        offsets = columns_of.offsets[cuts] - columns_of.offsets[self.first_node]
        for (first, last), (a, b) in zip(
            itertools.pairwise(cuts), itertools.pairwise(offsets), strict=True
        ):
            exact = entries(nodes, np.arange(first, last))
            product += exact @ own_x[a:b]
            squares += np.einsum("ij,ij->i", exact, exact)
        is_own = (rows >= own[0]) & (rows < own[1])
        product[is_own] -= self.mult(own_x)[rows[is_own] - own[0]]
        error = np.square(sum(self.workers.gather([product]))).mean(axis=1).max(initial=0.0)
        scale = np.max(sum(self.workers.gather([squares])), initial=0.0)
        return float(np.sqrt(error / max(float(scale), float(np.finfo(np.float64).tiny))))


def compress(
    entries: Entries,
    points: ArrayLike,
    row_offsets: ArrayLike,
    col_offsets: ArrayLike,
    tol: float = 1e-10,
    leaf: int = 64,
    *,
    breaks: ArrayLike = (),
    threads: int = 1,
    comm: Comm = None,
    serve: tuple[ManyEntries, Sequence[ArrayLike]] | None = None,
    stretches: Sequence[Stretch] = (),
) -> HODLR:
    """Compress an operator between the nodes of closed outlines, from entries alone. Collective.

    Every cluster of neighbouring nodes is fitted on a graded sample of the nodes outside it, and
    judged on random ones.

    Parameters
    ----------
    entries : callable
        entries(row_nodes, column_nodes) gives, for two increasing int arrays, the exact entries of
        all degrees of freedom of these nodes, (rows, columns). Called from several threads if
        threads > 1.
    points : (n, 2) array
        Nodes in order along the outlines, one outline after another [length].
    row_offsets, col_offsets : (n+1,) int arrays
        Node i has rows row_offsets[i]..row_offsets[i+1], and columns likewise; it may have none.
    tol : float
        Relative error of a row, in the sense of `HODLR.error_estimate`.
    leaf : int
        Most nodes of a cluster that is not divided.
    breaks : int array
        Nodes where a side, a part or another kind of column begins. Without them a short piece may
        go unseen.
    threads : int
        Threads of each rank; BLAS should use one then.
    comm : mpi4py.MPI.Comm or None
        Nodes are split over its ranks as PETSc splits them.
    serve : (entries, list of col_offsets) or None
        All columns, this operator's among them, that the bases of rows are to serve, for
        `HODLR.with_columns`: entries gives a list of arrays, one for each of the offsets.
    stretches : sequence of Stretch
        Where clusters that are translates of one another may share blocks and bases.

    Raises
    ------
    ValueError
        If lengths do not match, tol is not in (0, 1), leaf or threads is not positive, or a rank
        would have no node.

    References
    ----------
    P.-G. Martinsson and V. Rokhlin, J. Comput. Phys. 205 (2005); K. L. Ho and L. Greengard, SIAM J.
    Sci. Comput. 34 (2012): recursive skeletonisation. N. Halko, P.-G. Martinsson, J. A. Tropp, SIAM
    Rev. 53 (2011): sketches.
    """
    points = np.asarray(points, dtype=np.float64)
    offsets = [np.asarray(o, dtype=np.int64) for o in (row_offsets, col_offsets)]
    workers = Workers(threads, comm)
    n = len(points)
    if points.shape != (n, 2) or any(o.shape != (n + 1,) for o in offsets):
        raise ValueError("points must be (n, 2), and row_offsets and col_offsets (n+1,)")
    if not 0.0 < tol < 1.0 or leaf < 1 or threads < 1 or n < workers.size:
        raise ValueError(
            "tol must be in (0, 1), leaf and threads positive, and every rank needs a node"
        )
    served = (
        None if serve is None else (serve[0], [np.asarray(o, dtype=np.int64) for o in serve[1]])
    )
    translations = Translations(stretches, points)
    breaks = np.asarray(breaks, dtype=np.int64)
    operator = Operator(entries, points, offsets[0], offsets[1], breaks, tol, translations, served)
    bounds = even_bounds(n, workers.size)
    first, last = int(bounds[workers.rank]), int(bounds[workers.rank + 1])
    cuts = first + even_bounds(last - first, max(1, min(threads, (last - first) // leaf)))
    ranges = [(int(a), int(b)) for a, b in itertools.pairwise(cuts)]
    return _build(operator, workers, Split(bounds, ranges, leaf))


def _build(operator: Operator, workers: Workers, split: Split, like: HODLR | None = None) -> HODLR:
    """Compress all subtrees and then the top, with the bases of rows of `like` if it is given."""
    whole = len(workers.gather(split.ranges)) == 1
    models: Sequence[Stack | None] = like.parts if like is not None else [None] * len(split.ranges)
    parts = workers.map(
        lambda r, model: build_part(operator, r[0], r[1], split.leaf, whole, model),
        split.ranges,
        models,
    )
    top = None
    if not whole:
        roots = workers.gather([part.root.border() for part in parts])
        top = workers.at_root(
            lambda: build_top(operator, roots, like.top if like is not None else None)
        )
    return HODLR(operator, parts, top, workers, split)
