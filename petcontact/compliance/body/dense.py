"""A body eliminated by a dense factorisation of (4.12) and (4.13), stored as a PETSc matrix."""

from __future__ import annotations

import copy
from dataclasses import replace

import numpy as np

from ...arrays import Array, Index
from ...bem.boundary_data import BoundaryData
from ...bem.dense_assembly import fill_dense
from ...bem.operators import BoundaryOperators
from ...linalg.dense_elimination import Elimination
from ...linalg.row_layout import even_ranges, everywhere
from ...runtime.petsc import stage
from ...untyped import Comm
from .conditioning import forward_error, known_solution
from .eliminated import ElasticBody, gauge


class DenseBody(ElasticBody):
    """A body with one factorisation of the bordered system for all load states and tractions.

    Parameters
    ----------
    operators : BoundaryOperators
    modes : (n, d, r) array
    comm : PETSc.Comm
        Its ranks share the rows of the system; each rank has the whole S.

    Raises
    ------
    SolverError
        If the factorisation fails.
    """

    compliance: Array

    def __init__(self, operators: BoundaryOperators, modes: Array, comm: Comm) -> None:
        super().__init__(operators, modes)
        with stage("assemble"):
            system = DenseRows(operators, modes, comm)
            self.missed = system.missed
        with stage("factor"):
            self._solved = Elimination(
                system.system,
                system.contact,
                system.loads,
                operators.data.contact_unknowns,
                comm,
                system.kinds,
            )
            self.digits_lost = forward_error(self._solved.solve(system.of_known), system.known)
        self.compliance = self._solved.influence
        self.compliance /= operators.traction_scale
        self.u_0 = self._at_rest(self._solved.at_rest)
        self._comm = comm

    def with_data(self, data: BoundaryData) -> DenseBody | None:
        """Return the same body under other known values; only its loads are solved again.

        It is None if other components are known.
        """
        if not data.has_matrix_of(self.data):
            return None
        body = copy.copy(self)
        ElasticBody.__init__(body, replace(self.operators, data=data), self.modes)
        with stage("factor"):
            rows = DenseRows(body.operators, self.modes, self._comm, self.missed)
            body._solved = self._solved.with_load(rows.loads)
            body.u_0 = body._at_rest(body._solved.at_rest)
        return body

    def _at_rest(self, solved: Array) -> Array:
        """Return u_0 (K, m, k) from the solutions (m k, K) for all loads [length]."""
        data = self.operators.data
        return solved.T.reshape(data.states, *data.contact_shape) + data.sliding

    def unknowns(self, shares: Array, traction: Array) -> Array:
        """Return all unknowns of the body by back substitution."""
        return self._solved.unknowns(shares, traction.ravel() / self.operators.traction_scale)

    def describe(self) -> str:
        """Return the text for the verdict: how the body is stored."""
        return "condensed, dense"

    def close(self) -> None:
        """Free every PETSc object."""
        self._solved.close()


class DenseRows:
    """This rank's rows of the bordered system, its contact columns and its loads. Given what the
    equations `missed` of translations, which other loads do not change, only the loads are filled.

    Equations (4.12), at nodes on Γ_C, and (4.13), at all others, give the rows. A_0 has the columns
    of the unknowns, G_Ct those of the free tractions on Γ_C. The loads follow from known values.
    The last rank has the rows of the border.

    Attributes
    ----------
    system : (d n + r, rows) array
        A_0 by columns.
    contact, loads : (m k, rows), (K, rows) arrays
        G_Ct and the loads by columns.
    known : (d n + r,) array
        A known solution, see `conditioning`.
    missed : (n, d, d) array
        See `ElasticBody`; of all ranks.
    of_known : (rows,) array
        Right-hand side of the known solution.
    kinds : pair of int arrays, optional
        Components of the unknowns (d n + r,) and of the equations (rows,), each motion being one;
        None where all belong together.
    """

    def __init__(
        self,
        operators: BoundaryOperators,
        modes: Array,
        comm: Comm,
        missed: Array | None = None,
    ) -> None:
        data, (n, d, r) = operators.data, modes.shape
        rank, ranks = comm.getRank(), comm.getSize()
        nodes = np.arange(*even_ranges(n, ranks)[rank])
        self.size, border = d * n + r, r if rank == ranks - 1 else 0
        inner, rows = d * len(nodes), d * len(nodes) + border
        if missed is None:
            operators = replace(operators, translated=operators.mesh.motions.along)
        self.loads = np.zeros((data.states + len(operators.translated), rows))
        loads = self._inside(self.loads, len(nodes), d)
        if missed is not None:
            self.missed = missed
            fill_dense(operators, nodes, None, None, loads)
        else:
            # every entry of A_0 is written
            self.system = np.zeros((self.size, rows)) if r else np.empty((self.size, rows))
            self.contact = np.zeros((data.contact_directions.size, rows))
            inside = self.system[: d * n, :inner].reshape(n, d, len(nodes), d)
            contact = self._inside(self.contact, len(nodes), d)
            fill_dense(operators, nodes, inside, contact, loads)  # (4.12), (4.13)
            self.missed = _missed(operators, loads[data.states :], comm)
            inside[nodes, :, np.arange(len(nodes))] += np.einsum(
                "rja,rca,rc->rcj", self.missed[nodes], data.frame[nodes], data.traction_known[nodes]
            )
            own = np.arange(d * n).reshape(n, d)[nodes].ravel()
            self.system[d * n :, :inner] = modes.reshape(d * n, r)[own].T
            if border:
                self.system[: d * n, inner:] = gauge(operators.mesh, data, modes).T
            self.kinds = None
            if operators.mesh.components > operators.mesh.dim:
                # torsion does not know of other displacements
                self.kinds = self._kinds(n, d, r), self._kinds(len(nodes), d, border)
            self.known = known_solution(self.system, comm)
            self.of_known = self.known @ self.system
        self.loads, loads = self.loads[: data.states], loads[: data.states]
        loads -= np.einsum("rja,kra->krj", self.missed[nodes], data.displaced[:, nodes])
        loads += operators.point_loads.T.reshape(data.states, n, d)[:, nodes]

    @staticmethod
    def _inside(columns: Array, count: int, d: int) -> Array:
        """Return a view of columns (c, rows) on the integral equations, by node and component."""
        return columns[:, : d * count].reshape(len(columns), count, d)

    @staticmethod
    def _kinds(nodes: int, d: int, motions: int) -> Index:
        """Return the components at some nodes, and a kind for each motion."""
        return np.append(np.tile(np.arange(d), nodes), np.arange(d, d + motions))


def _missed(operators: BoundaryOperators, moved: Array, comm: Comm) -> Array:
    """Return what ½ + H lacks at all nodes (n, d, d), from the loads (t, rows, d) of translations
    on this rank's. Collective.

    Nodes are rounded. Elements of size h beside a node see it off their line by 1e-16 L/h, L the
    size of the body, and a body that moves by u seems to be strained by 1e-16 L u/h². But ½ + H of
    a translation is 0, and 1 around an infinite plate.
    """
    own = np.zeros((*moved.shape[1:], moved.shape[2]))
    own[:, :, list(operators.translated)] = np.moveaxis(moved - np.rint(moved), 0, 2)
    return everywhere(own, comm)
