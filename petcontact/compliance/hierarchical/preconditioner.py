"""The two-level preconditioner for bodies in contact: coarse groups of nodes, and local patches
with both sides of a contact."""

from __future__ import annotations

import copy
from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Array, marked
from ...compression.hmatrix.schwarz import CoarseLevel, LocalSolves
from .coupling import ColumnExpansion, Coupling
from .patches import Nodes, sums
from .rows import BodyRows


class Preconditioner:
    """The preconditioner for the equations with a given expansion.

    Parameters
    ----------
    rows : sequence of BodyRows
    coupling : Coupling
    motions : pair of (N, r) arrays
        Orthonormal rigid motions, along which the operator is the identity, and the weights that
        give their amplitudes in any displacement.
    total : callable
        Sums an array over the ranks.
    share : (int, int)
        Number of this rank and of all ranks, over which the patches are dealt out in turn.
    expansion : ColumnExpansion
        Expansion for given tractions.
    """

    def __init__(
        self,
        rows: Sequence[BodyRows],
        coupling: Coupling,
        motions: tuple[Array, Array],
        total: Callable[[Array], Array],
        share: tuple[int, int],
        expansion: ColumnExpansion,
    ) -> None:
        nodes = Nodes(rows, coupling)
        group, columns = nodes.groups()
        self._coarse = CoarseLevel(group, columns, total(sums(rows, coupling, group, columns)))
        self._dual, self._sums = motions[1], np.asarray(self._coarse.repeat.T @ motions[0])
        patches = list(nodes.patches())[share[0] :: share[1]]
        self._local = LocalSolves(rows, coupling.first_column, patches, coupling.size)
        self._local.update(expansion.factors, np.ones(coupling.size, dtype=bool))
        self._coupling, self._total, self._law = coupling, total, expansion.relation.basis
        self.expansion = expansion
        self._factor()

    def copy(self) -> Preconditioner:
        """Return an independent copy that shares unchanged arrays."""
        result = copy.copy(self)
        result._local, result._coarse = self._local.copy(), self._coarse.copy()
        return result

    def update(self, expansion: ColumnExpansion) -> None:
        """Change to another expansion.

        The coarse level is factorised anew, and patches whose law has changed by more than 0.2.
        """
        if expansion is self.expansion:
            return
        law = expansion.relation.basis
        # a patch is inverted anew if the law of a node, whose basis has unit size, changes by this
        nodes = np.abs(law - self._law).max(axis=(1, 2)) > 0.2
        moved = self._coupling.secondary.reshape(self._coupling.shape)[nodes]
        self._local.update(expansion.factors, marked(moved, self._coupling.size))
        self._law, self.expansion = np.where(nodes[:, None, None], law, self._law), expansion
        self._factor()

    def _factor(self) -> None:
        factors = self.expansion.factors[:, : self._coupling.size]
        grouped = np.asarray(
            self._coupling.of_unknowns(factors @ self._coarse.repeat).T @ self._dual
        )
        self._coarse.factor(factors, self._sums @ grouped.T)

    def solve(self, r: Array, product: Callable[[Array], Array]) -> Array:
        """Return an approximate solution (N,) of the equations of the bodies.

        `product` returns the left-hand side (N,) of these equations for unknowns (N,).
        """
        coarse = self._coarse.solve(r)
        return np.asarray(coarse + self._total(self._local.solve(r - product(coarse))))

    @property
    def nbytes(self) -> int:
        """Memory on this rank."""
        return self._local.nbytes
