"""A linear problem of bodies in contact, and its solution."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...frozen import frozen
from .coupling import Expansion


@frozen
class Balance:
    """Rows for rigid motions of bodies, then of free obstacles: q combinations in equilibrium, p
    that are where they are.

    Attributes
    ----------
    motion : (M, k, o) array
        v by free motions of obstacles.
    resultant, load : (q, M, k), (q,) arrays
        Eσ + f = 0.
    held, amplitude : (p, r), (p,) arrays
        Combinations of all r = p + q motions, and what they are.
    """

    motion: Array
    resultant: Array
    load: Array
    held: Array
    amplitude: Array

    @classmethod
    def at_rest(cls, shape: tuple[int, int], motions: int) -> Balance:
        """Bodies that do not move as a whole, and no free obstacles."""
        return cls(
            np.zeros((*shape, 0)),
            np.zeros((0, *shape)),
            np.zeros(0),
            np.eye(motions),
            np.zeros(motions),
        )

    @property
    def count(self) -> int:
        """Number r of rigid motions."""
        return len(self.load) + len(self.amplitude)


@frozen
class Posed:
    """A linear problem.

    Attributes
    ----------
    expansion : Expansion
        Of the law.
    offset : (M, k) array
        v beyond the displacements [length].
    factors, rows : arrays
        Loads: factors of all columns on the right, and what this rank's rows get besides.
    balance : Balance
    """

    expansion: Expansion
    offset: Array
    factors: Array
    rows: Array
    balance: Balance


@frozen
class State:
    """A solution.

    Attributes
    ----------
    z : (N,) array
        Displacements, and tractions over scales, of all bodies.
    v, sigma : (M, k) arrays
        [length], [stress]
    alpha : (r,) array
        Rigid motions of bodies, then of free obstacles.
    beta : (r,) array
        Multipliers of the motions of bodies.
    """

    z: Array
    v: Array
    sigma: Array
    alpha: Array
    beta: Array
