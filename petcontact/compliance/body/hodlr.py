"""A plane body eliminated on HODLR operators.

A product with S is a product with G and a solve with A, of which the rows of u are taken.
"""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np
import scipy

from ...arrays import Array, Mask
from ...bem.boundary_data import BoundaryData
from ...bem.operators import BoundaryOperators
from ...given.tables.solver_options import Bem
from ...linalg.row_layout import everywhere, summed
from ...runtime.petsc import stage
from ...runtime.threads import one_blas_thread
from ...untyped import Comm
from .eliminated import ElasticBody, gauge
from .hodlr_operators import CompressedOperators

COLUMNS = 128
"""Number of columns of S that are solved for at once."""


class HodlrBody(ElasticBody):
    """A body with HODLR operators over all ranks; S is known by products, or formed if small.

    A is singular for a body that is not held. A + R P is regular, where P x are the motions that r
    displacements determine. One factorisation of it serves the bordered system [[A, R], [C, 0]]
    with C = RᵀW. The multipliers follow from r more solves.

    Parameters
    ----------
    operators : BoundaryOperators
    modes : (n, d, r) array
    bem : Bem
    comm : PETSc.Comm
    formed : int
        Largest number of contact unknowns for which S is formed. Its products are then very cheap.

    Raises
    ------
    SolverError
        As `CompressedOperators`.
    """

    def __init__(
        self, operators: BoundaryOperators, modes: Array, bem: Bem, comm: Comm, formed: int
    ) -> None:
        super().__init__(operators, modes)
        n, r = operators.n_unknowns, modes.shape[2]
        motions, rows = modes.reshape(n, r), gauge(self.mesh, self.data, modes)
        pins = pinned(self.data.components(modes), self.data.traction_known)
        self._compressed = CompressedOperators(operators, comm, bem, (motions, pins) if r else None)
        own_rows = self._compressed.here
        self._gauge, self._pins = rows[:, own_rows], pins[:, own_rows]
        with one_blas_thread(), stage("factor"):
            self._moved = (
                self._compressed.solve(motions[own_rows])
                if r
                else np.zeros((own_rows.stop - own_rows.start, 0))
            )
            self._seen = summed(self._gauge @ self._moved, comm)
            self._load(self._compressed.loads)
        size = operators.data.contact_directions.size
        self.compliance = None
        if size <= formed:
            columns = [
                self.apply(np.eye(size, min(COLUMNS, size - k), -k))
                for k in range(0, size, COLUMNS)
            ]
            self.compliance = np.hstack(columns) if columns else np.zeros((0, 0))

    def _load(self, loads: Array) -> None:
        """Store this rank's loads of all states, and solve for u_0."""
        operators, data = self.operators, self.operators.data
        self._loads = loads + operators.point_loads[self._compressed.here]
        at_rest = self._compressed.on_contact(self._bordered(self._loads)[0])
        self.u_0 = at_rest.T.reshape(data.states, *data.contact_shape) + data.sliding

    def with_data(self, data: BoundaryData) -> HodlrBody | None:
        """Return the same body under other known values.

        It is None unless the right-hand sides differ in amplitude only.
        """
        body, operators = copy.copy(self), replace(self.operators, data=data)
        if not data.has_matrix_of(self.data) or not operators.right_hand_sides.near(
            self.operators.right_hand_sides
        ):
            return None
        ElasticBody.__init__(body, operators, self.modes)
        with one_blas_thread(), stage("factor"):
            body._load(self._compressed.loads_by(operators.amplitudes))
        return body

    def apply(self, traction: Array) -> Array:
        """Return S t, by a product with G and a solve with A [length]."""
        if self.compliance is not None:
            return super().apply(traction)
        return self._compressed.on_contact(
            self._bordered(self._compressed.traction_to_rhs(traction))[0]
        )

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Return all unknowns of the body, by one solve with A."""
        unknowns, beta = self._bordered(
            self._loads @ shares + self._compressed.traction_to_rhs(traction.ravel())
        )
        return np.concatenate([everywhere(unknowns, self._compressed.comm), beta])

    def describe(self) -> str:
        """Return the text for the verdict: the storage and its tolerance."""
        return f"condensed, hodlr {self._compressed.bem.hodlr_tol:g}"

    def _bordered(self, rhs: Array) -> tuple[Array, Array]:
        """Return this rank's part of the solution x of the bordered system, and β."""
        x = self._compressed.solve(rhs)
        if not len(self._gauge):
            return x, np.zeros(0)
        beta = np.linalg.solve(self._seen, summed(self._gauge @ x, self._compressed.comm))
        x = x - self._moved @ beta
        return x, beta + summed(self._pins @ x, self._compressed.comm)


def pinned(motions: Array, free: Mask) -> Array:
    """Return P (r, d n) with P R = I, for motions R (n, d, r) by components.

    P uses r of the unknown displacements.
    """
    rows, result = motions[free], np.zeros((motions.shape[2], free.size))
    if len(result):
        _, chosen = scipy.linalg.qr(rows.T, mode="r", pivoting=True)
        few = chosen[: len(result)]
        result[:, np.flatnonzero(free)[few]] = np.linalg.inv(rows[few])
    return result
