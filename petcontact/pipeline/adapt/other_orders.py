"""Error estimates of u without contact from panels of another order."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, Mask
from ...errors import PetcontactError
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.panels.edges import edge_exponent
from ...results.records import StepResult, step_ends
from ...results.solution import Solution
from ..pose.discretise import MeshMaker
from .budget import budget_of

FEW = 1200
"""Largest number of nodes of a body for another solve that costs up to four times the first one: in
space those with order p + 1, in the plane those of the solution, where half as many elements cost a
quarter."""
SURE = 1.6
"""Factor on `share`, measured by scripts/verify_space: errors on coarse meshes fall more slowly
than in the limit [-]."""


def share(order: int, changed_order: int, exponent: float) -> float:
    """Return the error over the change by another order, for an error that falls as (p + 1)^-4λ.

    The errors of energies fall so where displacements behave like r^λ at the ends of elements. The
    error in the energy norm falls as (p + 1)^-2λ, with twice the exponent of h. The error
    of the energy is its square. Source: I. Babuska, M. Suri, The h-p version of the finite element
    method with quasiuniform meshes, RAIRO M2AN 21 (1987) 199-238.

    Parameters
    ----------
    order, other : int
        p, and the order of the solution that it is compared with.
    exponent : float
        λ.

    Examples
    --------
    >>> [round(share(order, other, 0.6), 2) for order, other in ((2, 1), (3, 2), (2, 3))]
    [0.61, 1.01, 2.01]
    """
    return 1.0 / abs(math.pow((order + 1.0) / (changed_order + 1.0), 4.0 * exponent) - 1.0)


def whole_error(solution: Solution, solved_on: Callable[[MeshMaker], Solution]) -> float:
    """Return the relative L2 error of u without contact [-].

    It is the largest over bodies and step ends. It is a `share` of the change when all panels get
    the next order, or, if that costs too much, the order below.

    Parameters
    ----------
    solution : Solution
    solved_on : callable
        Function that solves the same problem on other meshes.

    Returns
    -------
    float
        nan if unknown. The next order is not for panels of order 3, and too expensive above `FEW`
        nodes. The order below is impossible with panels of order 0, and too expensive above the
        nodes of `BUDGETS`.
    """
    meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
    change = _affordable(meshes)
    if not (change and all(body.has_inside for body in solution.problem.bodies)):
        return math.nan
    orders = [int(mesh.order.max()) for mesh in meshes]
    shares = [
        share(order, order + change, edge_exponent(mesh, body))
        for order, mesh, body in zip(orders, meshes, solution.problem.bodies, strict=True)
    ]
    changed = [
        other_order(mesh, np.ones(mesh.n_elements, dtype=bool), change, factor)
        for mesh, factor in zip(meshes, shares, strict=True)
    ]
    compared = _converged(solved_on, changed)
    if compared is None:
        return math.nan
    return max(
        SURE * factor * _changed_by(solution, compared, name, ends)
        for ends in zip(step_ends(solution.steps), step_ends(compared.steps), strict=True)
        for name, factor in zip(solution.meshes, shares, strict=True)
    )


def _affordable(meshes: Sequence[SurfaceMesh]) -> int:
    """Return the change of all orders for another solve: 1, -1, or 0 if none is worth its cost.

    The order p - 1 costs 0.5 to 0.8 of the first solve. It is tried on meshes that an adaptive
    solve would make without being asked for an accuracy.
    """
    if max(map(_next_nodes, meshes)) <= FEW and max(mesh.order.max() for mesh in meshes) < 3:
        return 1
    small = sum(mesh.n_nodes for mesh in meshes) <= budget_of(len(meshes), asked=False).nodes
    return -1 if small and min(mesh.order.min() for mesh in meshes) >= 1 else 0


def _changed_by(
    solution: Solution, compared: Solution, name: str, ends: tuple[StepResult, StepResult]
) -> float:
    """Return the relative L2 difference of u of two solutions on a body at the end of a step
    [-]."""
    both = [
        (as_surface(solved.meshes[name]), end.bodies[name].u)
        for solved, end in zip((solution, compared), ends, strict=True)
    ]
    size = _norm(both[0][0].weight, both[0][1])
    (lower, u), (mesh, finer) = sorted(both, key=lambda solved: int(solved[0].order.max()))
    apart = lower.basis_at(mesh.element, mesh.places) @ u - finer
    return _norm(mesh.weight, apart) / size if size > 0.0 else 0.0


def _norm(weight: Array, values: Array) -> float:
    return math.sqrt(float(weight @ np.sum(values**2, axis=1)))


def _converged(
    solved_on: Callable[[MeshMaker], Solution], meshes: Sequence[SurfaceMesh]
) -> Solution | None:
    """Return the converged solution on other meshes, or None."""
    try:
        solution = solved_on(lambda number, body, boundary: meshes[number])
    except PetcontactError:  # data given for the nodes of one mesh
        return None
    return solution if solution.converged else None


def _next_nodes(mesh: SurfaceMesh) -> int:
    """Return the number of nodes if all panels get the next order."""
    triangle = np.isnan(mesh.corners[:, 3, 0])
    after = mesh.order + 2
    return int(np.sum(np.where(triangle, after * (after + 1) // 2, after**2)))


def other_order(mesh: SurfaceMesh, marked: Mask, change: int, gained: float) -> SurfaceMesh:
    """Return the mesh with marked panels of another order, and with curved sides moved to match.

    A curved side misses the arc through its points by an error, which is to fall with the order,
    too. The sides move nearer to the arc or away from it, so that the motion times `gained` is this
    error. A parabola with chord h and sagitta s = hθ/4 lies hθ³/120 inside an arc of the angle 2θ,
    on average. A sagitta that is smaller by 0.8 s (s/h)² moves it inside by the same distance.

    Parameters
    ----------
    mesh : SurfaceMesh
    marked : (n_elements,) bool array
    change : int
        Change of the order, 1 or -1.
    gained : float
        The value of `share`.
    """
    start, end = mesh.corners, np.roll(mesh.corners, -1, axis=1)
    triangle = np.isnan(start[:, 3, 0])
    end[triangle, 2] = start[triangle, 0]
    order = mesh.order + change * marked
    if not len(mesh.middles):
        return replace(mesh, order=order)
    sagitta = mesh.middles[:, :4] - 0.5 * (start + end)
    part = np.sum(sagitta**2, axis=2) / np.sum((end - start) ** 2, axis=2)
    off = change / gained * 0.8 * part[:, :, None] * sagitta
    off = np.concatenate([off, 0.5 * off.sum(axis=1, keepdims=True)], axis=1)
    return replace(mesh, order=order, middles=mesh.middles + off)
