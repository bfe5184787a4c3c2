"""The error of a solution from the tails of its tractions, on any mesh and for nothing."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index
from ...contact.law_protocol import SLIP
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.panels.marks import element_sizes, faded
from ...refinement.panels.tail import rim_distance, tail
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from .difference import FADE
from .slip import displacement_scale

OF_SLIP = (2.0, 0.29, 0.52, 1.0)
"""Error of u_t over its tail, for order 0, 1, 2, and above; these factors are fitted to the runs of scripts/verify_space."""
SECOND = 10.7
"""Of linear elements in contact, over the square of that error relative to u_t: h² as against the h of their tail."""
BESIDE = 0.41
"""The error of u_t over that of u on other faces, before it fades with the distance."""
HELD = 0.085
"""Error of u_t over what the tails of tractions on other faces would move a half space by; they move the whole contact."""
UNEVEN = 1.4
"""Error of u_t over what tractions lack of equilibrium."""


def tail_error(solution: Solution) -> tuple[float, float]:
    """Relative errors in L2, over all interfaces and step ends the largest: of u_t, or of p and q, and of resultants.

    Of p and q: ‖tail‖/‖p‖, which fades out towards the rim of a part as `difference` does. Of u_t of the paper's
    problem, over ‖u_t‖: the tail of u, see `slip_squares`. Resultants are off by about the product of both, and by what
    tractions lack of equilibrium.
    """
    worst = 0.0
    for step in step_ends(solution.steps):
        for name, pair in step.pairs.items():
            mesh, nodes = solution.meshes[solution.sides[name][0]], solution.nodes[name]
            weight = pair.weight * inside(mesh, solution.sides[name][1], nodes)
            size = float(np.sqrt(weight @ pair.pressure**2))
            if size > 0.0:
                worst = max(worst, *(math.sqrt(weight @ error**2) / size for error in _errors(pair)))
    uneven = max((float(np.nan_to_num(step.residuals["equilibrium"])) for step in solution.steps), default=0.0)
    if not solution.bilateral:
        return min(worst, 1.0), worst**2 + uneven
    slip = math.sqrt(slip_squares(solution, solution.last).sum()) / displacement_scale(solution)
    error = min(math.hypot(slip, UNEVEN * uneven), 1.0)
    return error, worst * error + uneven


def _errors(pair: PairResult) -> tuple[Array, Array]:
    assert pair.pressure_error is not None and pair.sigma_t_error is not None
    return pair.pressure_error, pair.sigma_t_error


def slip_squares(solution: Solution, step: StepResult) -> Array:
    """Squared errors of u_t after a step that come from each element of a body in bilateral contact.

    In the contact that of the tail of u; on linear ones the next degree is taken to be to the tail as the tail is to u_t.
    What other faces lack moves the contact, too, its elements that slip somewhere: the tails of u the less the further away
    they are, those of tractions, which are infinite along the edges of clamped faces, all alike.

    Returns
    -------
    (n_elements,) array
        [length² · area]
    """
    (mesh,), (body,) = solution.meshes.values(), step.bodies.values()
    nodes, element, material = np.arange(mesh.n_nodes), mesh.element, solution.problem.body[0].material
    contact, slips = np.zeros((2, mesh.n_elements), dtype=bool)
    for name, pair in step.pairs.items():
        contact[element[solution.nodes[name]]] = True
        slips[element[solution.nodes[name][pair.state == SLIP]]] = True
    area = np.bincount(element, mesh.weight)
    share = max(area[slips].sum() / area[contact].sum(), 1.0 / np.count_nonzero(contact))
    of_u = np.bincount(element, mesh.weight * tail(mesh, nodes, body.u, OF_SLIP, 1.0) ** 2)
    of_t = np.bincount(element, mesh.weight * tail(mesh, nodes, body.traction, (1.0,), 1.0) ** 2)
    compliance = (1.0 - material.poisson_ratio) / (math.pi * material.shear_modulus)
    beside = BESIDE**2 * faded(mesh, contact) * of_u + (HELD * compliance * element_sizes(mesh)) ** 2 * of_t
    linear = contact & (mesh.order == 1)
    of_u[linear] *= (SECOND / displacement_scale(solution)) ** 2 * of_u[linear].sum()
    return np.where(contact, of_u, share * beside)


def inside(mesh: BoundaryMesh, part: str, nodes: Index) -> Array:
    """Factors (m,) of nodes of a part that fall from 1 to 0 over `FADE` of its size towards its rim.

    The rim is where the nearest nodes of other parts are: p may be infinite there, and no mesh its L2 norm exact.
    """
    size = float(mesh.weight[mesh.nodes_of(part)].sum()) ** (1.0 / (mesh.dim - 1))
    return np.asarray(np.minimum(1.0, rim_distance(mesh, nodes) / (FADE * size)) ** 2)
