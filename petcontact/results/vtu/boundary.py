"""Values on the boundary of a body for ParaView: lines in the plane, panels in space."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from ...arrays import Array, Index, largest_by, marked
from ...contact.friction_law import project_ball
from ...fields.stress_state import StressState
from ...geometry.rotation import lifted
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import SurfaceMesh
from ...refinement.panels.tail import Tails
from ...runtime.figure_style import STATES
from ..body_fields import BodyFields
from ..data import SolutionData
from ..records import BodyResult, StepResult
from .spread_points import vtk_cells
from .writing import unit_notes, write_mesh


def write_boundary_vtu(
    path: str | Path,
    solution: SolutionData,
    body: str | None = None,
    step: StepResult | None = None,
    degrees: float | None = None,
) -> None:
    """Write the boundary values of a body after an increment, the last one by default, as a .vtu
    file of lines or panels.

    Points belong to one element each, since tractions jump from element to element; in the plane
    elements of higher order and arcs are cut into short lines, in space panels that are curved or
    of order 2 or more are cells of the second order (6-node triangles, 9-node quadrilaterals).
    Point data: displacement, traction, stress, von_mises; in the plane also normal, sigma_n,
    sigma_t (along the tangent, the normal turned by +90°; with torsion also sigma_theta),
    friction_bound (0 off the contact) and arc_length. Cell data: the number of the part,
    traction_error (estimated from the highest degrees of the polynomials), and
    contact (-1 elsewhere, 0 stick, 1 slip, 2 open; of a panel the largest of its nodes). Shear
    between the nodes of a contact element is cut at the bound, which a polynomial may pass there.
    Names of parts, states and units are those of the arrays of the field data (ParaView's
    "Information").

    Parameters
    ----------
    path : str or Path
    solution : Solution
    body : str, optional
        Its name, where there are several; the states are those of the interfaces whose secondary it
        is.
    step : StepResult, optional
    degrees : float, optional
        Angle by which a half section is turned about its axis, up to 360.

    Raises
    ------
    InputError
        If there are several bodies, and none is named.
    OutputError
        If the file cannot be written.
    """
    name = body or solution.only_body("write_boundary_vtu")
    notes = {f"part {k} is {part}": k for k, part in enumerate(solution.meshes[name].part_names)}
    notes |= {
        "contact -1 is elsewhere": -1,
        **{f"contact {k} is {word}": k for k, (word, _, _) in STATES.items()},
    }
    write_mesh(
        path,
        boundary_cells(solution, name, step or solution.last),
        notes | unit_notes(solution.problem.units),
        degrees,
    )


def boundary_cells(solution: SolutionData, name: str, step: StepResult) -> meshio.Mesh:
    """Lines or panels of a body with the point and cell data of `write_boundary_vtu` after an
    increment."""
    mesh = solution.meshes[name]
    state, bound = np.full(mesh.n_nodes, -1), np.zeros(mesh.n_nodes)
    for pair, (owner, _) in solution.sides.items():
        if owner == name and pair in step.pairs:
            nodes, bounds = solution.nodes[pair], step.pairs[pair].bound
            state[nodes] = step.pairs[pair].state
            bound[nodes] = np.where(np.isfinite(bounds), bounds, np.finfo(np.float64).max)
    return _cells(mesh, solution.body_fields(name, step), state, bound)


def traction_error(mesh: BoundaryMesh, result: BodyResult) -> Array:
    """Estimated error of the traction on each element, (n_elements,), see `panels.tail`
    [stress]."""
    at_nodes = Tails(mesh, np.arange(mesh.n_nodes)).errors(result.traction)
    return np.asarray(at_nodes[mesh.first_node[:-1]])


@functools.singledispatch
def _cells(mesh: Any, fields: BodyFields, state: Index, bound: Array) -> meshio.Mesh:
    """Cells of a kind of mesh, with point and cell data, from the state (n,) of nodes, -1 off the
    contact, and the bound (n,) of the shear."""
    turn = np.abs(mesh.curvature * mesh.length)
    # arcs are cut into lines that turn by a tenth at most
    counts = np.maximum(np.maximum(2 * mesh.order, 1), np.ceil(turn / 0.1).astype(np.int64))
    lines = np.repeat(np.arange(mesh.n_elements), counts)
    element = np.repeat(np.arange(mesh.n_elements), counts + 1)
    place = (np.arange(len(element)) - np.searchsorted(element, element)) / counts[element]
    middle = (np.arange(len(lines)) - np.searchsorted(lines, lines) + 0.5) / counts[lines]
    (x, normal), stress = mesh.at(element, place), fields.on_boundary(element, place)
    cell_state = state[_nearest(mesh, lines, middle)]
    touching = ~marked(lines[cell_state < 0], mesh.n_elements)[element]
    values = mesh.basis_at(element, place) @ np.column_stack(
        [fields.found.u, fields.found.traction, bound]
    )
    u, traction = np.split(values[:, :-1], 2, axis=1)
    limit = np.where(touching, np.maximum(values[:, -1], 0.0), np.inf)
    sigma_n, sigma_t, traction = _within(limit, traction, normal, mesh)
    return meshio.Mesh(
        lifted(x, 3),
        [
            (
                "line",
                np.stack(
                    [np.arange(len(lines)) + lines, np.arange(len(lines)) + lines + 1], axis=1
                ),
            )
        ],
        point_data={
            "displacement": lifted(u, 3),
            "traction": lifted(traction, 3),
            "normal": lifted(normal, 3),
            "sigma_n": sigma_n,
            **dict(zip(("sigma_t", "sigma_theta"), sigma_t.T, strict=False)),
            "friction_bound": np.where(touching, limit, 0.0),
            "arc_length": mesh.arc_lengths(element, place),
            **_stress_data(stress),
        },
        cell_data={
            "part": [mesh.part[lines]],
            "contact": [cell_state],
            "traction_error": [traction_error(mesh, fields.found)[lines]],
        },
    )


@_cells.register
def _(mesh: SurfaceMesh, fields: BodyFields, state: Index, bound: Array) -> meshio.Mesh:
    places, cells = vtk_cells(mesh)
    at = mesh.basis_at(places.element, places.place)
    panel_state = largest_by(mesh.element, state, mesh.n_elements, -1)
    stress = fields.on_boundary(places.element, places.place)
    return meshio.Mesh(
        stress.x,
        [(kind, numbers) for kind, numbers, _ in cells],
        point_data={
            "displacement": at @ fields.found.u,
            "traction": at @ fields.found.traction,
            **_stress_data(stress),
        },
        cell_data={
            name: [field[panels] for _, _, panels in cells]
            for name, field in (
                ("part", mesh.part),
                ("contact", panel_state),
                ("traction_error", traction_error(mesh, fields.found)),
            )
        },
    )


def _stress_data(stress: StressState) -> dict[str, Array]:
    """Point data of stresses; VTK's order of a symmetric tensor is xx, yy, zz, xy, yz, xz."""
    return {"stress": stress.components[:, [0, 1, 2, 3, 5, 4]], "von_mises": stress.von_mises}


def _within(
    bound: Array, traction: Array, normal: Array, mesh: CurveMesh
) -> tuple[Array, Array, Array]:
    """σ_n (q,), σ_t (q, d-1) of tractions (q, d), cut at a bound (q,), and the tractions of
    both."""
    across, along = lifted(normal, mesh.components), mesh.slip_directions(normal)
    sigma_n = np.sum(traction * across, axis=1)
    sigma_t = project_ball(np.einsum("qtd,qd->qt", along, traction), bound)
    return sigma_n, sigma_t, sigma_n[:, None] * across + np.einsum("qt,qtd->qd", sigma_t, along)


def _nearest(mesh: CurveMesh, element: Index, place: Array) -> Index:
    """The node of each element (q,) that is nearest to a place on it, the first of two."""
    # ξ is within [-1, 1]: nodes of other elements are further away
    nodes, wanted = 4.0 * mesh.element + mesh.xi, 4.0 * element + 2.0 * place - 1.0
    after = np.clip(np.searchsorted(nodes, wanted), 1, mesh.n_nodes - 1)
    return np.asarray(
        np.where(wanted - nodes[after - 1] <= nodes[after] - wanted, after - 1, after)
    )
