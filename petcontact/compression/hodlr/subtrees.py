"""Subtrees over threads and ranks below the common top of the tree. One sweep up and down is a
product or a solve."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Index
from ..workers import Workers
from .elimination import FactorStack
from .tree_levels import Stack

CHUNK = 64  # right-hand sides that go through the tree together


Sweepable = Stack | FactorStack
"""Subtrees, of a matrix or of its factors."""


class Forest:
    """The subtrees of one rank, one for each thread, and the top of the tree, which every rank has.

    Parameters
    ----------
    parts : sequence of Sweepable
    top : Sweepable or None
        None if a single subtree is the whole tree.
    workers : Workers
    lengths : (p,) array
        Degrees of freedom of each subtree that go in.
    handed : (q,) array
        Degrees of freedom that each subtree of any rank gets back from the top.
    first : int
        Place of this rank's first subtree among all.
    """

    def __init__(
        self,
        parts: Sequence[Sweepable],
        top: Sweepable | None,
        workers: Workers,
        lengths: Index,
        handed: Index,
        first: int,
    ) -> None:
        self.parts, self.top, self.workers, self.lengths = parts, top, workers, lengths
        self._first = first
        self._bounds = np.concatenate([[0], np.cumsum(handed)])[first : first + len(parts) + 1]

    def like(self, parts: Sequence[Sweepable], top: Sweepable | None, handed: Index) -> Forest:
        """Return a forest of other objects on the same subtrees."""
        return Forest(parts, top, self.workers, self.lengths, handed, self._first)

    def sweep(self, x: Array) -> Array:
        """Sweep up and down with this rank's share of a vector (n,) or of several vectors (n, s).
        Collective.

        Raises
        ------
        ValueError
            If the length of x is not this rank's.
        """
        if x.shape[0] != self.lengths.sum():
            raise ValueError(f"{x.shape[0]} rows given where this rank has {self.lengths.sum()}")
        columns = np.asarray(x, dtype=np.float64)
        columns = columns[:, None] if columns.ndim == 1 else columns
        cuts = range(0, max(1, columns.shape[1]), CHUNK)
        result = np.hstack([self._sweep(columns[:, i : i + CHUNK]) for i in cuts])
        return result.reshape(len(result), *x.shape[1:])

    def _sweep(self, x: Array) -> Array:
        pieces = np.split(x, np.cumsum(self.lengths)[:-1])
        risen = self.workers.map(lambda part, piece: part.ascend(piece), self.parts, pieces)
        outside = [border for _, border in risen]
        if self.top is not None:
            seen, above = self.top.ascend(np.concatenate(self.workers.gather(outside)))
            given = self.top.descend(seen, above)
            outside = [given[a:b] for a, b in itertools.pairwise(self._bounds)]
        return np.concatenate(
            self.workers.map(
                lambda part, up, border: part.descend(up[0], border), self.parts, risen, outside
            )
        )
