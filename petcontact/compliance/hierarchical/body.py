"""A body in space on an H-matrix, solved together with the bodies in contact with it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from ...arrays import Array
from ...bem.operators import BoundaryOperators
from ...given.tables.solver_options import Bem
from ...runtime.petsc import stage
from ...runtime.threads import one_blas_thread
from ...untyped import Comm
from ..body.eliminated import ElasticBody
from ..interface import ContactMaps, Interface
from .contact_system import MonolithicBodies
from .joint import JointBodies
from .rows import CompressedRows, CondensedRows


class HierarchicalBody(ElasticBody):
    """A body with its boundary equations on an H-matrix.

    They are solved together with those of the bodies in contact with it.

    Parameters
    ----------
    operators : BoundaryOperators
        Operators on a `SurfaceMesh`.
    modes : (n, 3, r) array
    bem : Bem
    comm : PETSc.Comm
    progress : callable, optional
        Called with the share of the matrix that is built.

    Raises
    ------
    InputError
        If the matrix does not fit into the machine's memory.
    SolverError
        If the compressed operator misses its tolerance on random exact rows.
    """

    compliance = None
    is_solved_jointly = True

    def __init__(
        self,
        operators: BoundaryOperators,
        modes: Array,
        bem: Bem,
        comm: Comm,
        progress: Callable[[float], None] = lambda share: None,
    ) -> None:
        super().__init__(operators, modes)
        self.tolerance = bem.hmatrix_tol
        with one_blas_thread(), stage("assemble"):
            self.rows = CompressedRows(operators, modes, comm, bem.hmatrix_tol, progress)
        self._joint: JointBodies | None = None
        self._number = 0

    def join(self, joint: JointBodies, number: int) -> None:
        """Store the joint equations, and this body's number in them; set u_0."""
        self._joint, self._number = joint, number
        self.u_0 = joint.at_rest[:, joint.unknowns_of(number)] + self.data.sliding

    @property
    def joint(self) -> JointBodies:
        """Equations of all bodies, this one included."""
        assert self._joint is not None, "a body on an H-matrix is solved with those that it meets"
        return self._joint

    def apply(self, traction: Array) -> Array:
        """Return S t, by one solve for each column [length]."""
        if traction.ndim > 1:
            return np.column_stack([self.apply(column) for column in traction.T])
        moved = self.joint.moved_by(self._number, traction, np.zeros(self.data.states)).z
        return np.asarray(moved[self.joint.unknowns_of(self._number)].ravel())

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Return the unknowns and β for these loads and tractions.

        They are those of the last solution if it has these loads, else those of one more solve.
        """
        joint = self.joint
        state = joint.solution_for(self._number, shares, traction.ravel())
        z = self.rows.by_nodes(joint.strained(self._number, state))
        return np.concatenate([z, joint.multipliers(self._number, state)])

    def describe(self) -> str:
        """Return the text for the verdict: operator and memory."""
        memory = "" if self._joint is None else f" of {self._joint.equations.memory() / 1e6:.0f} MB"
        return f"mixed, hmatrix {self.tolerance:g}{memory}"

    def close(self) -> None:
        """Free the PETSc objects and the matrix."""
        if self._joint is not None:
            self._joint.close()
            self._joint = None


def joined(
    bodies: Sequence[ElasticBody],
    interfaces: Sequence[Interface],
    maps: Sequence[ContactMaps],
    comm: Comm,
) -> MonolithicBodies:
    """Return the joint equations of all bodies, on H-matrices or eliminated.

    Bodies on H-matrices get their u_0.
    """
    own = {n: body for n, body in enumerate(bodies) if isinstance(body, HierarchicalBody)}
    rows = [own[n].rows if n in own else CondensedRows(body, comm) for n, body in enumerate(bodies)]
    with one_blas_thread():
        joint = MonolithicBodies(bodies, rows, interfaces, maps, comm)
    for number, hierarchical in own.items():
        hierarchical.join(joint, number)
    return joint
