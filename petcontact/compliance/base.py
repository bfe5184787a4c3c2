"""The contact system: what a method sees of the body, u_t = u_0 + S σ_t on Γ_C and a Robin solve.

Vectors on Γ_C are numpy arrays (m, 1), the same on every rank of the communicator; matrices are PETSc's, by rows over
the ranks.
"""

from __future__ import annotations

import abc
from typing import Any, Protocol

import numpy as np

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..linalg.row_layout import even_ranges, node_ranges, redistribute
from ..runtime.petsc import petsc


class ContactSystem(Protocol):
    """What a method may ask.

    Attributes
    ----------
    operators : BoundaryOperators
    ksp_iterations : int
        KSP iterations of the last Robin solve.
    ksp_reason : int
        Its outcome, PETSc's number.
    elastic_solves, applications : int
        Robin solves, and products with S, so far.
    u_0 : (m, 1) array
        u_t for σ_t = 0 [length].
    """

    operators: BoundaryOperators
    ksp_iterations: int
    ksp_reason: int
    elastic_solves: int
    applications: int

    @property
    def u_0(self) -> Array: ...

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t, (m, 1) [length]."""
        ...

    def robin(self, rho: float, f: Array) -> tuple[Array, Array]:
        """u_t and σ_t with u_t = u_0 + S σ_t and σ_t + ρ u_t = f: the Robin problem (4.4)-(4.8)."""
        ...

    def robin_increment(self, rho: float, r: Array) -> tuple[Array, Array]:
        """δu_t and δσ_t with δu_t = S δσ_t and δσ_t + ρ δu_t = r, so that inexact solves do not disturb w_k."""
        ...

    def compliance(self) -> Array:
        """S as a dense array (m, m) [length/stress], the same on every rank."""
        ...

    def boundary(self, sigma_t: Array) -> tuple[Array, Array]:
        """Displacement [length] and traction [stress] (n, 2) on the whole boundary for a given σ_t."""
        ...

    def describe(self) -> str:
        """One line: formulation, operator, KSP and PC."""
        ...

    def close(self) -> None:
        """Free every PETSc object."""
        ...


class ContactVectors:
    """Vectors on Γ_C between numpy (whole, on every rank) and PETSc (split evenly over the ranks)."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        nodes = operators.data.contact_nodes
        self.comm, self.size = comm, len(nodes)
        rank, ranks = comm.getRank(), comm.getSize()
        self.even = even_ranges(len(nodes), ranks)
        self.owned = slice(*self.even[rank])
        # where u_t stands among the unknowns of this rank's nodes, and which contact nodes those are on every rank
        node_owner = node_ranges(operators.mesh.n_nodes, ranks)
        self.by_node = [tuple(int(k) for k in np.searchsorted(nodes, bounds)) for bounds in node_owner]
        mine = slice(*self.by_node[rank])
        self.local_unknowns = operators.data.contact_unknowns[mine] - operators.kernel.dim * node_owner[rank][0]
        self._mpi = comm.tompi4py() if ranks > 1 else None

    @property
    def layout(self) -> tuple[int, int]:
        """Local and global size of a contact vector."""
        return self.owned.stop - self.owned.start, self.size

    def everywhere(self, local: Array) -> Array:
        """The whole array on every rank from each rank's rows."""
        return np.array(local) if self._mpi is None else np.concatenate(self._mpi.allgather(np.array(local)))

    def contact_rows(self, unknowns: Array) -> Array:
        """Rows of u_t out of the local rows of unknowns, moved to the even layout of contact vectors."""
        return redistribute(unknowns[self.local_unknowns], self.by_node, self.even, self.comm)  # type: ignore[arg-type]

    def vector(self, values: Array) -> Any:
        """A PETSc vector of a whole (m, 1) array; the caller destroys it."""
        vector = petsc().Vec().createMPI(self.layout, comm=self.comm)
        vector.setArray(values[self.owned, 0])
        return vector

    def gather(self, vector: Any) -> Array:
        """The whole (m, 1) array of a PETSc vector, which is destroyed."""
        whole = self.everywhere(vector.getArray(readonly=True)).reshape(-1, 1)
        vector.destroy()
        return whole


class SystemBase:
    """What every formulation begins with: the operators, contact vectors, and counts at zero."""

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        self.operators, self.comm = operators, comm
        self.contact = ContactVectors(operators, comm)
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0
        self._scale = operators.traction_scale


class EliminatedSystem(SystemBase, abc.ABC):
    """A formulation that knows u_0 and solves for increments: the Robin problem itself follows."""

    u_0: Array

    @abc.abstractmethod
    def robin_increment(self, rho: float, r: Array) -> tuple[Array, Array]:
        """As in `ContactSystem`."""

    def robin(self, rho: float, f: Array) -> tuple[Array, Array]:
        """(I + ρS) σ_t = f - ρ u_0."""
        change, sigma_t = self.robin_increment(rho, f - rho * self.u_0)
        return self.u_0 + change, sigma_t
