"""Rigid motions that only contact holds, as a border of the equations of an active set."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Mask
from ..linearisation import Linearisation
from ..system import Modes

FREE = 1e-10
"""Singular value, relative to motions of unit size, below which a rigid motion moves no component that is active."""


class RigidModeConstraint:
    """Rigid motions beside a block of S, in scaled coordinates; those that move no active component are left out.

    Parameters
    ----------
    modes : Modes or None
    linearised : Linearisation
    sigma : (m, k) array
        Traction whose resultant the equations are to complete.
    scale : float
        Size of the block's entries [length/stress].
    """

    def __init__(self, modes: Modes | None, linearised: Linearisation, sigma: Array, scale: float) -> None:
        self._length = scale or 1.0
        if modes is None:
            self._basis = self.free = np.zeros((0, 0))
            self.columns, self.rhs = np.zeros((int(linearised.active.sum()), 0)), np.zeros(0)
            self.rows, self._unit = self.columns.T, 1.0
            return
        rank, size = len(modes.load), modes.size
        factor = np.linalg.qr(modes.motion[linearised.active] / size, mode="r")
        values, vectors = np.linalg.svd(factor, full_matrices=True)[1:]
        followed = np.zeros(rank, dtype=bool)
        followed[: len(values)] = values > FREE * max(1.0, float(values.max(initial=0.0)))
        basis, self.free = vectors[followed].T, vectors[~followed].T
        work = np.einsum("rib,ibc->ric", modes.resultant / size[:, None, None], linearised.derivative)[:, linearised.active]
        # where all nodes slide one way nothing resists a motion along it, though it moves components that are active
        turned, strength, _ = np.linalg.svd(np.asarray(np.linalg.qr((basis.T @ work).T, mode="r")).T)
        resisted = np.append(strength, np.zeros(basis.shape[1] - len(strength))) > FREE * float(strength.max(initial=0.0))
        if not resisted.all():
            basis, self.free = basis @ turned[:, resisted], np.column_stack([self.free, basis @ turned[:, ~resisted]])
        self._basis = basis / size[:, None]
        self.columns = modes.motion[linearised.active] @ self._basis * self._length
        rows = basis.T @ work
        self._unit = self._length / (float(np.abs(rows).max(initial=0.0)) or 1.0)
        self.rows = self._unit * rows
        self.rhs = self.work(-modes.unbalanced(sigma))

    def spread(self, active: Mask) -> tuple[Array, Array]:
        """Columns and rows on all components, (q, m, k)."""
        both = np.zeros((2, len(self.rhs), *active.shape))
        both[0][:, active], both[1][:, active] = self.columns.T, self.rows
        return both[0], both[1]

    def around(self, block: Array) -> Array:
        """The bordered matrix."""
        n, r = len(block), self._basis.shape[1]
        whole = np.zeros((n + r, n + r))
        whole[:n, :n], whole[:n, n:], whole[n:, :n] = block, self.columns, self.rows
        return whole

    def work(self, resultant: Array) -> Array:
        """What the rows give of a traction of this resultant Eσ (r,)."""
        return np.asarray(self._unit * (self._basis.T @ resultant))

    def motion(self, coordinates: Array) -> Array:
        """δα."""
        return np.asarray(self._basis @ coordinates * self._length)
