"""A body without strain, for checks of equilibrium before any matrix is built."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...bem.operators import BoundaryOperators
from .eliminated import ElasticBody


class RigidBody(ElasticBody):
    """A body with its rigid motions, resultants and contact nodes, but with u_0 = 0 and S = 0.

    Parameters
    ----------
    operators : BoundaryOperators
    modes : (n, d, r) array
        Rigid motions that no known displacement holds [-].
    """

    compliance = None

    def __init__(self, operators: BoundaryOperators, modes: Array) -> None:
        super().__init__(operators, modes)
        self.u_0 = np.zeros((self.data.states, *self.data.contact_shape))

    def describe(self) -> str:
        """Return the word "rigid"."""
        return "rigid"
