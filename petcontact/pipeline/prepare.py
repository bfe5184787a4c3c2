"""From a case to its contact system: mesh, boundary data, operators, elimination."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from ..bem.boundary_data import evaluate_boundary, free_modes
from ..bem.kernels import kernel_for
from ..bem.operators import BoundaryOperators
from ..compliance.base import EliminatedSystem
from ..compliance.condensed import CondensedSystem
from ..compliance.full import FullSystem
from ..compliance.spectral import shared_by
from ..contact.laws import ContactLaw, Tresca
from ..contact.system import BodySystem
from ..errors import InputError, SolverError
from ..mesh.curve_mesh import CurveMesh
from ..model.assembly import Assembly
from ..model.case import Case
from ..model.problem import Contact, Displacement, Problem
from ..refinement.meshes import mesh_of
from ..runtime import threads
from ..runtime.petsc import options, petsc, timed
from .choice import LARGEST, check_memory, is_compressed, predicted_seconds, resolved_bem
from .trust.elastic import ELASTIC_LIMIT, SAFE, elastic_residual


@dataclass
class Prepared:
    """A discretised and eliminated problem: any number of methods, rules and ρ run on it.

    Attributes
    ----------
    operators : BoundaryOperators
    system : BodySystem
    law : ContactLaw
    comm : PETSc.Comm
    timings : dict of str to float
        Seconds of mesh, assemble and factor.
    """

    operators: BoundaryOperators
    system: BodySystem
    law: ContactLaw
    comm: Any
    timings: dict[str, float] = field(default_factory=dict)

    def close(self) -> None:
        """Free every PETSc object."""
        self.system.close()


def discretise(problem: Problem) -> BoundaryOperators:
    """Mesh, boundary data and operators (not yet assembled) of a problem."""
    if not any(isinstance(condition, Contact) for condition in problem.boundary):
        raise InputError('boundary: no part is in contact; one at least needs condition = "contact"')
    mesh = mesh_of(problem)
    return BoundaryOperators(mesh, evaluate_boundary(problem, mesh), kernel_for(mesh, problem.material))


def is_stepped(case: Case | Assembly) -> bool:
    """Whether a case takes bodies with contact tractions in all directions and load steps; else it is the paper's."""
    return isinstance(case, Assembly) or not case.plain or _held_by_friction(case)


def _held_by_friction(case: Case) -> bool:
    """Whether only friction keeps the body where it is: `solve_assembly` finds whether it can, the body's motion unknown."""
    conditions = case.boundary
    fixed = any(isinstance(c, Displacement) and "free" not in c.value for c in conditions)
    if fixed or case.method.resolved_name != "semismooth-newton" or not any(isinstance(c, Contact) for c in conditions):
        return False
    mesh = mesh_of(case)
    data = evaluate_boundary(case, mesh, held=False)
    holding = int((~data.traction_known).any(axis=1).sum())
    return bool(holding > mesh.dim and data.friction_bound.any() and len(free_modes(data, mesh)))


Announce = Callable[[int, int, float], Callable[[float], None]]
"""Told nodes, unknowns and predicted seconds; what it returns is told the share of the matrix that is built."""


def prepare(case: Case, comm: Any = None, cases: int = 1, announce: Announce | None = None) -> Prepared:
    """Discretise and eliminate; what does not depend on the method's parameters is done once, here.

    `cases` is how many will be run on it: several may share more than one would. `announce` is told the numbers of nodes and
    unknowns, and the predicted seconds before they are spent; what it returns is told how far the build of an H-matrix is.

    Raises
    ------
    InputError
        If the problem has load steps or another contact law than the paper's, which `solve_assembly` takes.
    """
    if not case.plain:
        raise InputError("load steps, and contact other than bilateral with a friction bound, need `solve_assembly`")
    comm = comm if comm is not None else petsc().COMM_WORLD
    began = time.perf_counter()
    operators = discretise(case)
    timings = {"mesh": time.perf_counter() - began}
    progress: Callable[[float], None] = silent
    if announce is not None:
        seconds = predicted_seconds(resolved_bem(case.bem), operators.mesh)
        progress = announce(operators.mesh.n_nodes, operators.n_unknowns, seconds)
    return prepare_operators(operators, case, comm, timings, cases, progress)


def silent(share: float) -> None:
    """Tells nobody."""


def prepare_operators(
    operators: BoundaryOperators, case: Case, comm: Any, timings: dict[str, float], cases: int = 1,
    progress: Callable[[float], None] = silent,
) -> Prepared:  # fmt: skip
    """Eliminate a problem that is discretised already; `timings` are the seconds that this has taken."""
    with options(case.petsc), threads.suited_to(operators.n_unknowns), timed() as seconds:
        system = _build_system(operators, case, comm, progress)
        if isinstance(system, EliminatedSystem) and cases > 1:
            system = shared_by(cases, system, operators, comm)
    law = Tresca(operators.data.friction_bound, operators.kernel.dim - 1)
    return Prepared(operators, system, law, comm, {**timings, **seconds})


def _build_system(operators: BoundaryOperators, case: Case, comm: Any, progress: Callable[[float], None]) -> BodySystem:
    """The system that `[bem]`, the -bem_ options and the formulation ask for."""
    bem = resolved_bem(case.bem)
    if case.method.formulation == "full" or not is_compressed(bem, operators.mesh):
        check_memory(operators.mesh)
    if case.method.formulation == "full":
        if bem.mat_type in ("hodlr", "hmatrix"):
            raise InputError(f'method.formulation: "full" is dense; use "condensed" with bem.mat_type = "{bem.mat_type}"')
        return FullSystem(operators, comm)
    if not is_compressed(bem, operators.mesh):
        return CondensedSystem(operators, comm)
    if not isinstance(operators.mesh, CurveMesh):
        from ..compliance.hierarchical.system import HierarchicalSystem

        return HierarchicalSystem(operators, comm, bem, progress)
    from ..compliance.compressed import CompressedSystem

    if bem.mat_type == "hodlr" or operators.mesh.n_nodes > LARGEST:
        return CompressedSystem(operators, comm, bem)
    try:
        system = CompressedSystem(operators, comm, bem)
    except SolverError:
        return CondensedSystem(operators, comm)
    if _is_accurate(system, operators):
        return system
    system.close()
    return CondensedSystem(operators, comm)


def _is_accurate(system: BodySystem, operators: BoundaryOperators) -> bool:
    """Whether the boundary data of friction at its bound satisfy the integral equations well enough."""
    u, traction = system.boundary(operators.data.friction_bound[:, None])
    return elastic_residual(operators, u, traction) <= SAFE * ELASTIC_LIMIT
