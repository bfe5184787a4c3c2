"""A linear problem of bodies in contact, and its solution."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...record import record
from .coupling import ColumnExpansion


@record
class Balance:
    """The rows for rigid motions of bodies, then of free obstacles.

    q combinations are in equilibrium, p combinations have given amplitudes.

    Attributes
    ----------
    motion : (M, k, o) array
        v by free motions of obstacles.
    resultant, load : (q, M, k), (q,) arrays
        E and f of the equilibrium Eσ + f = 0.
    held, amplitude : (p, r), (p,) arrays
        Combinations of all r = p + q motions, and their given amplitudes.
    """

    motion: Array
    resultant: Array
    load: Array
    held: Array
    amplitude: Array

    @classmethod
    def at_rest(cls, shape: tuple[int, int], motions: int) -> Balance:
        """Return the rows of bodies that do not move as a whole, without free obstacles."""
        return cls(
            np.zeros((*shape, 0)),
            np.zeros((0, *shape)),
            np.zeros(0),
            np.eye(motions),
            np.zeros(motions),
        )

    def share(self, left: Array, scale: Array, rtol: float) -> float:
        """Return by which share a residual (N + r,) must fall for forces to balance, at most 1.

        They are to balance to `rtol` times the largest load on a motion. The residual has the rows
        of motions at its end, times `scale` (r,).
        """
        forces = np.abs(left[len(left) - self.count :] / scale)[: len(self.load)]
        lost, most = (float(np.abs(each).max(initial=0.0)) for each in (forces, self.load))
        return min(1.0, rtol * most / lost) if most > 0.0 and lost > 0.0 else 1.0

    @property
    def count(self) -> int:
        """Number r of rigid motions."""
        return len(self.load) + len(self.amplitude)


@record
class Posed:
    """A linear problem of bodies in contact.

    Attributes
    ----------
    expansion : ColumnExpansion
        Expansion of the linear law.
    offset : (M, k) array
        Part of v that is not caused by displacements [length].
    factors, rows : arrays
        Loads: factors of all columns on the right-hand side, and terms that are added to this
        rank's rows.
    balance : Balance
    """

    expansion: ColumnExpansion
    offset: Array
    factors: Array
    rows: Array
    balance: Balance


@record
class State:
    """A solution of a linear problem.

    Attributes
    ----------
    z : (N,) array
        Displacements, and tractions over their scales, of all bodies [length].
    v, sigma : (M, k) arrays
        v [length] and σ [stress] on Γ_C.
    alpha : (r,) array
        Amplitudes of the rigid motions of bodies, then of free obstacles.
    beta : (r,) array
        Multipliers of the motions of bodies.
    """

    z: Array
    v: Array
    sigma: Array
    alpha: Array
    beta: Array
