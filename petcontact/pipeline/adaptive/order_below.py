"""Errors by panels of the order below: of u_t, what faces beside the contact add, and of u where there is no contact."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Mask
from ...contact.law_protocol import STICK
from ...errors import PetcontactError
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.shapes.files import Superelement
from ...refinement.corner_exponents import SLIDING
from ...refinement.panels.edges import edge_exponent
from ...results.records import step_ends
from ...results.solution import Solution
from ..discrete.discretise import MeshMaker
from .slip import displacement_scale

MOST = 5000
"""Nodes up to which another solve, of .5 to .8 of the time, is nothing to wait for."""
SURE = 1.6
"""Factor of `share`, measured by scripts/verify_space: far from the limit errors fall slower than they do there."""


def share(order: int, exponent: float) -> float:
    """Error over what the last order gains, of a functional whose error falls as (p + 1)^-4λ.

    As those of energies do where displacements behave like r^λ at the ends of elements: the error in the norm of energy
    falls as (p + 1)^-2λ, twice as fast as in h (I. Babuska, M. Suri, The h-p version of the finite element method with
    quasiuniform meshes, RAIRO M2AN 21 (1987) 199-238), and that of the energy is its square.

    Parameters
    ----------
    order : int
        p, at least 1.
    exponent : float
        λ.

    Examples
    --------
    >>> [round(share(order, 0.6), 2) for order in (2, 3)]
    [0.61, 1.01]
    """
    return 1.0 / (math.pow(1.0 + 1.0 / order, 4.0 * exponent) - 1.0)


def beside_error(solution: Solution, solved_on: Callable[[MeshMaker], Solution]) -> float:
    """Error of u_t of one body in bilateral contact that is due to its other faces, over ‖u_t‖.

    It sees what tails do not: a body that is too stiff as a whole, since its held face or its bending is resolved poorly.

    Parameters
    ----------
    solution : Solution
    solved_on : callable
        The solution of the same problem on other meshes.

    Returns
    -------
    float
        nan where it is not known: beside panels of order 0 and 1, and on more than `MOST` nodes.
    """
    mesh, nodes = as_surface(solution.mesh), solution.contact.nodes
    contact = np.zeros(mesh.n_elements, dtype=bool)
    contact[mesh.element[nodes]] = True
    order = mesh.order[~contact]
    from_file = isinstance(solution.problem.body[0].geometry, Superelement)
    if from_file or mesh.n_nodes > MOST or len(order) == 0 or order.min() < 2:
        return math.nan
    sticks = set(solution.contact.part[solution.contact.state == STICK].tolist())
    kinds = dict.fromkeys(set(solution.contact.part.tolist()) - sticks, (SLIDING,))
    gained = SURE * share(int(order.max()), edge_exponent(mesh, solution.problem.body[0], kinds))
    below = order_below(mesh, ~contact)
    other = _converged(solved_on, [below])
    if other is None:
        return math.nan
    apart = solution.contact.weight @ np.sum((other.contact.u_t - solution.contact.u_t) ** 2, axis=1)
    return gained * math.sqrt(float(apart)) / displacement_scale(solution)


def whole_error(solution: Solution, solved_on: Callable[[MeshMaker], Solution]) -> float:
    """Error of u of bodies without contact, in L2 over ‖u‖, the largest over bodies and step ends: a `share` of what it
    changes by where all panels are of the order below.

    Parameters
    ----------
    solution, solved_on
        As in `beside_error`.

    Returns
    -------
    float
        nan where it is not known: with panels of order 0, and on more than `MOST` nodes.
    """
    meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
    from_file = any(isinstance(body.geometry, Superelement) for body in solution.problem.body)
    if from_file or max(mesh.n_nodes for mesh in meshes) > MOST or min(mesh.order.min() for mesh in meshes) < 1:
        return math.nan
    gained = [SURE * share(int(mesh.order.max()), edge_exponent(mesh, body))
              for mesh, body in zip(meshes, solution.problem.body, strict=True)]  # fmt: skip
    below = [order_below(mesh, np.ones(mesh.n_elements, dtype=bool)) for mesh in meshes]
    other = _converged(solved_on, below)
    if other is None:
        return math.nan
    worst = 0.0
    for one, lower in zip(step_ends(solution.steps), step_ends(other.steps), strict=True):
        for k, (body, changed) in enumerate(zip(one.bodies.values(), lower.bodies.values(), strict=True)):
            weight, apart = meshes[k].weight, below[k].basis_at(meshes[k].element, meshes[k].places) @ changed.u - body.u
            size, error = (math.sqrt(float(weight @ np.sum(values**2, axis=1))) for values in (body.u, apart))
            worst = max(worst, gained[k] * error / size if size > 0.0 else 0.0)
    return worst


def _converged(solved_on: Callable[[MeshMaker], Solution], meshes: Sequence[SurfaceMesh]) -> Solution | None:
    """The solution on other meshes, where there is one."""
    try:
        other = solved_on(lambda number, one, boundary: meshes[number])
    except PetcontactError:  # data given for the nodes of one mesh
        return None
    return other if other.converged else None


def order_below(mesh: SurfaceMesh, marked: Mask) -> SurfaceMesh:
    """The mesh with marked panels of the order below, and curved sides as far again from the arcs through their points.

    A parabola of chord h and sagitta s = hθ/4 lies hθ³/120 inside of an arc of the angle 2θ, on average; one whose sagitta
    is less by 0.8 s (s/h)² lies that much further inside.
    """
    start, end = mesh.corners, np.roll(mesh.corners, -1, axis=1)
    triangle = np.isnan(start[:, 3, 0])
    end[triangle, 2] = start[triangle, 0]
    if not len(mesh.middles):
        return replace(mesh, order=mesh.order - marked)
    sagitta = mesh.middles[:, :4] - 0.5 * (start + end)
    share = np.sum(sagitta**2, axis=2) / np.sum((end - start) ** 2, axis=2)
    less = 0.8 * share[:, :, None] * sagitta
    less = np.concatenate([less, 0.5 * less.sum(axis=1, keepdims=True)], axis=1)
    return replace(mesh, order=mesh.order - marked, middles=mesh.middles - less)
