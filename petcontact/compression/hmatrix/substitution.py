"""Unknowns that stand for a combination of two columns: of the displacement and of the traction of a contact node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index


@dataclass(frozen=True)
class Substitution:
    """u = u_0 + N_u y and t = t_0 + N_t y in the k contact directions of m nodes: y takes u's place among the unknowns.

    With A the columns of the unknowns, B those beside and A z = B t + ..., the columns of y are A N_u - B N_t.

    Attributes
    ----------
    node : (m,) array
        Increasing or not.
    slot, beside : (m, k) arrays
        Where u stands among the unknowns, and t among the columns beside.
    n_u, n_t : (m, k, k) arrays
    """

    node: Index
    slot: Index
    beside: Index
    n_u: Array
    n_t: Array

    @classmethod
    def displacement(cls, node: Index, slot: Index, beside: Index) -> Substitution:
        """t is given, u the unknown itself."""
        eye = np.broadcast_to(np.eye(slot.shape[1]), (*slot.shape, slot.shape[1]))
        return cls(node, slot, beside, eye, np.zeros_like(eye))

    def expanded(self, z: Array, count: int) -> Array:
        """Factors of all columns, `count` of them beside, whose product is that with the unknowns z."""
        y = z[self.slot]
        both: Array = np.concatenate([z, np.zeros(count)])
        both[self.slot] = np.einsum("mij,mj->mi", self.n_u, y)
        both[len(z) + self.beside] = -np.einsum("mij,mj->mi", self.n_t, y)
        return both

    def combine(self, nodes: Index, system: Array, beside: Array, components: int, first: Index) -> None:
        """Make columns (d k, rows) of a block, of some nodes, increasing, those of the unknowns.

        Parameters
        ----------
        nodes : (k,) array
        system, beside : (d k, rows) and (q, rows) arrays
        components : int
            d.
        first : (n + 1,) array
            First column beside of each node.
        """
        mine = np.flatnonzero(np.isin(self.node, nodes))
        if not len(mine):
            return
        place = np.searchsorted(nodes, self.node[mine])
        counts = np.diff(first)[nodes]
        start = np.cumsum(counts) - counts
        slot = components * place[:, None] + self.slot[mine] % components
        other = start[place][:, None] + self.beside[mine] - first[self.node[mine]][:, None]
        of_u = np.einsum("mjr,mji->mir", system[slot], self.n_u[mine])
        system[slot] = of_u - np.einsum("mjr,mji->mir", beside[other], self.n_t[mine])
