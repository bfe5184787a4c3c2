"""Elimination of the unknowns that only one cluster sees, level by level. It gives the factors of a
compressed square operator."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import scipy

from ...arrays import Array, Index, scattered
from ...record import record
from .block_batches import Batches, Block
from .translations import Cluster
from .tree_levels import TOGETHER, Stack, TreeLevel


@record
class Schur:
    """The remaining block of a cluster after elimination. Kept unknowns come first, waiting ones
    follow."""

    kept: int
    values: Array


@record
class LevelElimination:
    """One level of a factorisation.

    Once combined with the kept ones, the other rows and columns of a cluster are seen by no other
    cluster. Rows R and columns C of them are eliminated; rows S and columns K are left, those kept
    and the few that would make the block between R and C ill-conditioned and so wait. Between (R,
    S) and (C, K) stands [[E, F], [G, D]]. Stored are E⁻¹, E⁻¹F and G; D - G E⁻¹ F goes to the level
    above. At the root all are eliminated.

    A vector of n active unknowns and w that wait from below has n + w + 2 slots: active, zero,
    waiting, zero.

    Attributes
    ----------
    level : TreeLevel
    wait_rows, wait_columns : int arrays
        Slots of those that wait for the level above.
    inverse, forth, back : Batches
        E⁻¹, E⁻¹F and G.
    """

    level: TreeLevel
    wait_rows: Index
    wait_columns: Index
    inverse: Batches
    forth: Batches
    back: Batches

    def reduce(self, b: Array) -> Array:
        """Return the right-hand side of the level above. The array b then holds what `expand`
        needs."""
        kept, wait = self.level.kept_rows, self.wait_rows
        above = np.zeros((len(kept) + len(wait) + 2, b.shape[1]))
        above[: len(kept)] = b[kept]
        self.level.row_combine.add(above, b, -1.0)
        above[len(kept) + 1 : -1] = b[wait]
        x = np.zeros_like(b)
        self.inverse.add(b, x)
        self.back.add(x, above, -1.0)
        b[:] = x
        return above

    def expand(self, b: Array, above: Array) -> Array:
        """Return the solution from the result of `reduce` in b and from the solution above, which
        is overwritten."""
        kept = self.level.kept_columns
        self.forth.add(above, b, -1.0)
        b[self.wait_columns] = above[len(kept) + 1 : -1]
        self.level.column_combine.add(b, above, -1.0)
        b[kept] = above[: len(kept)]
        return b


class FactorStack:
    """The eliminations of all levels, from the leaves (first) to a root.

    Attributes
    ----------
    levels : list of LevelElimination
    left : list of Schur
        What the root leaves: one, of no rows if all is eliminated.
    """

    def __init__(self, levels: list[LevelElimination], entry: Index, left: list[Schur]) -> None:
        self.levels, self.left = levels, left
        self._entry = entry

    def ascend(self, x: Array) -> tuple[list[Array], Array]:
        """Return the reduced right-hand side of x (n, s) on each level, and the one that remains at
        the root. Kept unknowns come before waiting ones."""
        seen = []
        above = scattered(x, self._entry, len(x) + 2)
        for level in self.levels:
            seen.append(above)
            above = level.reduce(above)
        kept = self.left[0].kept
        return seen, np.concatenate([above[:kept], above[kept + 1 : -1]])

    def descend(self, seen: list[Array], outside: Array) -> Array:
        """Return the solution (n, s) from the result of `ascend` and from the solution at the root.
        `seen` is overwritten."""
        kept, zero = self.left[0].kept, np.zeros((1, outside.shape[1]))
        above = np.concatenate([outside[:kept], zero, outside[kept:], zero])
        for level, b in zip(reversed(self.levels), reversed(seen), strict=True):
            above = level.expand(b, above)
        return np.asarray(above[self._entry])


def eliminate(stack: Stack, below: list[Schur], use_up: bool) -> FactorStack:
    """Factorise a subtree.

    Parameters
    ----------
    stack : Stack
    below : list of Schur
        What the subtrees under the clusters of its first level left, in their order; none under
        leaves.
    use_up : bool
        Whether to release the near blocks as soon as they are used.
    """
    levels = []
    n = stack.levels[0].near.shape[0]
    # a slot of zeros follows the kept unknowns, another one the waiting ones
    entry = np.concatenate(list(_slots(below, n + 1))) if below else np.arange(n)
    for level in stack.levels:
        elimination, below = _eliminate(level, below, use_up)
        levels.append(elimination)
    return FactorStack(levels, entry, below)


def _slots(children: list[Schur], waiting: int) -> Iterator[Index]:
    """Yield the slots of the unknowns that each subtree hands over. Kept ones of all come first,
    those that wait follow from a given slot."""
    active = 0
    for schur in children:
        end = waiting + len(schur.values) - schur.kept
        yield np.concatenate([active + np.arange(schur.kept), np.arange(waiting, end)])
        active, waiting = active + schur.kept, end


class _Slots:
    """Places in the vectors of a level, handed out cluster by cluster: padding goes to the zero
    slots between the active and the waiting ones."""

    def __init__(self, n: int, k: int) -> None:
        self._own, self._above = [0, n + 1], [0, k + 1]

    @staticmethod
    def _next(starts: list[int], *counts: int) -> Index:
        parts = [np.arange(s, s + c) for s, c in zip(starts, counts, strict=True)]
        starts[:] = [s + c for s, c in zip(starts, counts, strict=True)]
        return np.concatenate(parts)

    def of(self, size: int, done: _Eliminated) -> tuple[Index, Index]:
        """The places of a cluster's own unknowns, and of what it leaves to the level above."""
        own = self._next(self._own, size, done.size - size)
        return own, self._next(self._above, done.left.kept, len(done.late_rows))


def _eliminate(
    level: TreeLevel, below: list[Schur], use_up: bool
) -> tuple[LevelElimination, list[Schur]]:
    """Eliminate one level, from what the level below left. Two clusters become one; leaves have
    nothing below."""
    n, k = level.row_combine.shape
    left, slots = list[Schur](), _Slots(n, k)
    batches = Batches(n, n), Batches(n, k), Batches(k, n)
    blocks, waiting = list[tuple[Block, Block, Block]](), list[tuple[Index, Index]]()
    by_leader: dict[int, _Eliminated] = {}
    for i, cluster in enumerate(level.clusters):
        # clusters with one leader are equal, and so is what the clusters under them left
        done = by_leader.get(id(cluster.leader)) if cluster.leader is not None else None
        if done is None:
            done = _eliminated(cluster, below[2 * i : 2 * i + 2])
            if cluster.leader is not None:
                by_leader[id(cluster.leader)] = done
        own, above = slots.of(len(cluster.rows), done)
        left.append(done.left)
        blocks.append(done.blocks(own, above))
        waiting.append((own[done.late_rows], own[done.late_columns]))
        if len(blocks) == TOGETHER or cluster is level.clusters[-1]:
            for batch, of_kind in zip(batches, zip(*blocks, strict=True), strict=True):
                batch.take([*of_kind])
            blocks.clear()
            if use_up:
                # the clusters so far were packed together, as `pack` did
                for used in level.clusters[i - i % TOGETHER : i + 1]:
                    used.near = []
                level.near.release(i // TOGETHER)
    late_rows, late_columns = map(np.concatenate, zip(*waiting, strict=True))
    return LevelElimination(level, late_rows, late_columns, *batches), left


@record
class _Eliminated:
    """The elimination of one cluster: remaining block, E⁻¹, E⁻¹F and G, and the places of R, of C
    and of waiting unknowns."""

    size: int
    left: Schur
    inverse: Array
    forth: Array
    back: Array
    rows: Index
    columns: Index
    late_rows: Index
    late_columns: Index

    def blocks(self, own: Index, above: Index) -> tuple[Block, Block, Block]:
        """E⁻¹, E⁻¹F and G at the places of the cluster's unknowns and of those above."""
        rows, columns = own[self.rows], own[self.columns]
        inverse, forth = Block(columns, rows, self.inverse), Block(columns, above, self.forth)
        return inverse, forth, Block(above, columns, self.back)


def _eliminated(cluster: Cluster, children: list[Schur]) -> _Eliminated:
    """Return the elimination of one cluster, from what its children left."""
    block = _assemble(cluster, children)
    e, f, g, d, rows, columns = _combine(cluster, block)
    scale = np.sqrt(np.einsum("ij,ij->j", block, block))[columns]
    inverse, row, column, late_row, late_column = _pivots(e, scale, cluster.row_basis is not None)
    kept = len(d)
    if len(late_row):
        late = e[late_row]
        d = np.block([[d, g[:, late_column]], [f[late_row], late[:, late_column]]])
        f = np.hstack([f[row], e[row[:, None], late_column]])
        g = np.vstack([g[:, column], late[:, column]])
    forth = inverse @ f
    return _Eliminated(
        len(block),
        Schur(kept, d - g @ forth),
        inverse,
        forth,
        g,
        rows[row],
        columns[column],
        rows[late_row],
        columns[late_column],
    )


def _assemble(cluster: Cluster, children: list[Schur]) -> Array:
    """Return the block of a cluster's active unknowns, followed by those that wait from below."""
    active = len(cluster.rows)
    size = active + sum(len(child.values) - child.kept for child in children)
    block = np.zeros((size, size))
    for near in cluster.near:
        block[near.rows[:, None], near.columns] = near.values
    for child, own in zip(children, _slots(children, active), strict=True):
        block[own[:, None], own] = child.values
    return block


def _combine(cluster: Cluster, block: Array) -> tuple[Array, Array, Array, Array, Index, Index]:
    """Return E, F, G and D before any unknown waits, and the rows and columns of E."""
    extra = np.arange(len(cluster.rows), len(block))
    by_row, by_column = cluster.row_basis, cluster.column_basis
    if by_row is None or by_column is None:
        size = len(block)
        return (
            block,
            np.zeros((size, 0)),
            np.zeros((0, size)),
            np.zeros((0, 0)),
            np.arange(size),
            np.arange(size),
        )
    rows, columns = np.concatenate([by_row.rest, extra]), np.concatenate([by_column.rest, extra])
    n_row, n_column = len(by_row.rest), len(by_column.rest)
    lower, upper = block[by_row.kept], block[rows]
    upper[:n_row] -= by_row.combine @ lower
    f, d = upper[:, by_column.kept], lower[:, by_column.kept]
    e, g = upper[:, columns], lower[:, columns]
    e[:, :n_column] -= f @ by_column.combine
    g[:, :n_column] -= d @ by_column.combine
    return e, f, g, d, rows, columns


def _pivots(e: Array, scale: Array, may_wait: bool) -> tuple[Array, Index, Index, Index, Index]:
    """Return the inverse of E (m, m) without the rows and columns that must wait, the remaining
    rows and columns, and the waiting ones.

    A pair that waits is taken out of the inverse by a rank-one update, which decides the next
    pivot; the inverse that is returned is computed once more when all are known.
    """
    inverse, exact = _inverse(e, may_wait), True
    rows = columns = np.arange(len(e))
    late_rows: list[int] = []
    late_columns: list[int] = []
    while may_wait:
        growth = np.abs(inverse)
        growth *= scale[columns, None]
        largest = growth.max(initial=0.0)
        # |entry of E⁻¹| times the norm of its column; beyond it a pivot waits for the level above
        if largest <= 100.0:
            break
        column, row = np.unravel_index(np.argmax(growth), growth.shape)
        late_rows.append(int(rows[row]))
        late_columns.append(int(columns[column]))
        rows, columns = np.delete(rows, row), np.delete(columns, column)
        # beyond it what is left is inverted anew: an update loses as many digits
        exact = largest > 1e6
        if exact:
            inverse = _inverse(e[rows[:, None], columns], may_wait)
        else:
            inverse = inverse - np.outer(inverse[:, row] / inverse[column, row], inverse[column])
            inverse = np.delete(np.delete(inverse, column, axis=0), row, axis=1)
    if not exact:
        inverse = _inverse(e[rows[:, None], columns], may_wait)
    return (
        inverse,
        rows,
        columns,
        np.array(late_rows, dtype=np.int64),
        np.array(late_columns, dtype=np.int64),
    )


def _inverse(block: Array, or_direction: bool) -> Array:
    """Return the inverse of a block. For a singular block, if asked for, return a large multiple of
    the direction that grows without bound.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the block is singular and that was not asked for.
    """
    if not len(block):
        return block
    # LAPACK sees the transpose, whose inverse is the transpose of ours
    lu, pivots, info = scipy.linalg.lapack.dgetrf(block.T)
    if info == 0:
        inverse, info = scipy.linalg.lapack.dgetri(lu, pivots, overwrite_lu=1)
    if info == 0:
        return np.asarray(inverse.T)
    if not or_direction:
        raise np.linalg.LinAlgError("a block to eliminate is singular")
    u, _, v = np.linalg.svd(block)
    return np.asarray(np.outer(v[-1], u[:, -1]) / np.finfo(np.float64).eps)
