"""What the contact systems of one body have in common; vectors on Γ_C are (m, k) arrays, the same on every rank."""

from __future__ import annotations

import abc
import functools
from typing import Any

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..contact.system import Modes, Surrogate
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.surface_mesh import SurfaceMesh
from .contact_vectors import ContactVectors
from .half_space import HalfSpace
from .layer.operator import LayerOperator


class SystemBase:
    """What every formulation begins with: the operators, contact vectors, and counts at zero."""

    modes: Modes | None = None
    matrix_free = False

    def __init__(self, operators: BoundaryOperators, comm: Any) -> None:
        self.operators, self.comm = operators, comm
        self.contact = ContactVectors(operators, comm)
        self.ksp_iterations = self.ksp_reason = self.elastic_solves = self.applications = 0
        self.weight = operators.mesh.weight[operators.data.contact_nodes]
        self._scale = operators.traction_scale

    def surrogate(self) -> Surrogate | None:
        """T of elastic layers on curves, of half spaces on surfaces."""
        return stand_in(self.operators.mesh, self.operators)

    def _everywhere(self, unknowns: Any, sigma_t: Array) -> tuple[Array, Array]:
        """Displacement and traction on the whole boundary from a PETSc vector of unknowns."""
        return self.operators.split(self.contact.everywhere(unknowns.getArray(readonly=True)), sigma_t)


class EliminatedSystem(SystemBase, abc.ABC):
    """A formulation that knows u_0 and solves for increments: the Robin problem itself follows."""

    u_0: Array

    @abc.abstractmethod
    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """As in `ContactSystem`."""

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """(I + ρS) σ_t = f - ρ u_0."""
        change, sigma_t = self.robin_increment(rho, f - rho * self.u_0)
        return self.u_0 + change, sigma_t


@functools.singledispatch
def stand_in(mesh: BoundaryMesh, operators: BoundaryOperators) -> Surrogate | None:
    """By the kind of mesh; none where none is known."""
    return None


@stand_in.register
def _(mesh: CurveMesh, operators: BoundaryOperators) -> Surrogate | None:
    return LayerOperator.of(operators)


@stand_in.register
def _(mesh: SurfaceMesh, operators: BoundaryOperators) -> Surrogate | None:
    return HalfSpace.of(operators)
