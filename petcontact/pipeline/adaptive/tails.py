"""The error of a solution from the tails of its tractions, on any mesh and for nothing."""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Index
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.panels.marks import element_sizes
from ...refinement.panels.tail import rim_distance
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from .difference import FADE
from .slip import displacement_scale

SLIP = (2.6, 1.4, 0.42, 0.47)
"""Error of u_t over the tail of q times the compliance of a half space to it, for order 0, 1, 2, and above."""
COUPLING = 0.15
"""Share of the tail of p in that of q: p moves points sideways, too."""


def tail_error(solution: Solution) -> tuple[float, float]:
    """Relative errors in L2, over all interfaces and step ends the largest: of u_t, or of p and q, and of resultants.

    Of p and q: ‖tail‖/‖p‖, which fades out towards the rim of a part as `relative_difference` does. Of u_t of the paper's
    problem: ‖h tail(q)‖ (1-ν)/(πµ), how far a half space is moved by what a traction lacks on elements of size h, over
    ‖u_t‖. Resultants are off by about the product of both, and by what tractions lack of equilibrium.
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
    error = _slip_error(solution) if solution.bilateral else worst
    return error, worst * error + uneven


def _errors(pair: PairResult) -> tuple[Array, Array]:
    assert pair.pressure_error is not None and pair.sigma_t_error is not None
    return pair.pressure_error, pair.sigma_t_error


def _slip_error(solution: Solution) -> float:
    material = solution.problem.body[0].material
    square = 0.0
    for name, pair in solution.pairs.items():
        mesh, nodes = solution.meshes[solution.sides[name][0]], solution.nodes[name]
        element = mesh.element[nodes]
        size = element_sizes(mesh)[element] * np.array(SLIP)[np.minimum(mesh.order[element], len(SLIP) - 1)]
        of_p, of_q = _errors(pair)
        square += float(pair.weight @ (size**2 * (of_q**2 + (COUPLING * of_p) ** 2)))
    compliance = (1.0 - material.poisson_ratio) / (math.pi * material.shear_modulus)
    return compliance * math.sqrt(square) / displacement_scale(solution)


def inside(mesh: BoundaryMesh, part: str, nodes: Index) -> Array:
    """Factors (m,) of nodes of a part that fall from 1 to 0 over `FADE` of its size towards its rim.

    The rim is where the nearest nodes of other parts are: p may be infinite there, and no mesh its L2 norm exact.
    """
    size = float(mesh.weight[mesh.nodes_of(part)].sum()) ** (1.0 / (mesh.dim - 1))
    return np.asarray(np.minimum(1.0, rim_distance(mesh, nodes) / (FADE * size)) ** 2)
