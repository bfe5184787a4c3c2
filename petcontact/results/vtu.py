"""Results for ParaView: fields inside the body and on its boundary as .vtu, through meshio."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING
from xml.sax.saxutils import quoteattr

import meshio
import numpy as np

from ..arrays import Array, Index
from ..fields.interior import Field
from ..mesh.basis import lagrange
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..model.units import Units
from ..runtime.atomic_write import temporary_name
from ..runtime.figure_style import STATES
from ..runtime.terminal import printable

if TYPE_CHECKING:
    from .solution import Solution
    from .steps.vtu import BodyBoundary


def write_vtu(path: str | Path, field: Field, units: Units | None = None) -> None:
    """Write displacement, stress, von Mises and principal stresses inside the body as a .vtu file.

    Parameters
    ----------
    path : str or Path
        Appears when it is whole.
    field : Field
        From `field_on_grid`; ParaView's "Warp By Vector" with `displacement` shows the deformed body.
    units : Units, optional
        Named in the file's field data.

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    x, y, xy = field.stress.T
    zero = np.zeros_like(x)
    # VTK's order of a symmetric tensor is xx, yy, zz, xy, yz, xz
    tensor = np.column_stack([x, y, field.sigma_zz, xy, zero, zero])
    _write(path, meshio.Mesh(
        _in_space(field.points), [("triangle", field.cells)],
        point_data={
            "displacement": _in_space(field.u), "stress": tensor, "von_mises": field.von_mises,
            "principal_1": field.principal[:, 0], "principal_2": field.principal[:, 1],
        },
    ), _unit_notes(units))  # fmt: skip


def write_boundary_vtu(path: str | Path, solution: Solution | BodyBoundary) -> None:
    """Write the boundary data of a solution as a .vtu file of lines.

    Points belong to one element each, since tractions jump from element to element; elements of higher order and arcs
    are cut into short lines. Point data: displacement, traction, normal, sigma_n, sigma_t (along the tangent, the normal
    turned by +90°), friction_bound (0 off the contact), arc_length; cell data: the number of the part, and contact (-1
    elsewhere, 0 stick, 1 slip). Shear between the nodes of a contact element is cut at the bound, which a polynomial may
    pass there. Names of parts, states and units are those of the arrays of the field data (ParaView's "Information").

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    mesh, contact = as_curve(solution.mesh), solution.contact
    state, bound = np.full(mesh.n_nodes, -1, dtype=np.int64), np.zeros(mesh.n_nodes)
    state[contact.nodes], bound[contact.nodes] = contact.state, contact.friction_bound
    nodal = np.column_stack([solution.u, solution.traction, bound])
    pieces = [_element(mesh, k, nodal, state) for k in range(mesh.n_elements)]
    counts = np.array([len(piece["x"]) for piece in pieces])
    first = np.concatenate([[0], np.cumsum(counts)])
    lines = np.concatenate([
        np.column_stack([np.arange(a, b - 1), np.arange(a + 1, b)]) for a, b in itertools.pairwise(first)
    ])
    x, normal, values, s = (np.concatenate([p[name] for p in pieces]) for name in ("x", "normal", "values", "s"))
    cell_state = np.concatenate([p["state"] for p in pieces]).astype(np.int64)
    u, traction, bound = values[:, :2], values[:, 2:4], np.maximum(values[:, 4], 0.0)
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    sigma_n, sigma_t = np.sum(traction * normal, axis=1), np.sum(traction * tangent, axis=1)
    touching = np.repeat([(p["state"] >= 0).all() for p in pieces], counts)
    sigma_t = np.where(touching, np.clip(sigma_t, -bound, bound), sigma_t)
    traction = sigma_n[:, None] * normal + sigma_t[:, None] * tangent
    notes = {f"part {k} is {name}": k for k, name in enumerate(mesh.part_names)}
    notes |= {"contact -1 is elsewhere": -1, **{f"contact {k} is {name}": k for k, (name, _, _) in STATES.items()}}
    _write(path, meshio.Mesh(
        _in_space(x), [("line", lines)],
        point_data={
            "displacement": _in_space(u), "traction": _in_space(traction), "normal": _in_space(normal),
            "sigma_n": sigma_n, "sigma_t": sigma_t, "friction_bound": np.where(touching, bound, 0.0), "arc_length": s,
        },
        cell_data={"part": [np.repeat(mesh.part, counts - 1)],
                   "contact": [cell_state]},
    ), notes | _unit_notes(solution.case.units))  # fmt: skip


def _unit_notes(units: Units | None) -> dict[str, int]:
    given = units.model_dump(exclude_none=True) if units is not None else {}
    return {f"unit of {quantity} is {name}": 1 for quantity, name in given.items()}


def _element(mesh: CurveMesh, k: int, nodal: Array, state: Index) -> dict[str, Array]:
    """Points along an element and the boundary data there."""
    order, nodes = int(mesh.order[k]), slice(int(mesh.first_node[k]), int(mesh.first_node[k + 1]))
    turn = abs(float(mesh.curvature[k] * mesh.length[k]))
    count = max(1, 2 * order, int(np.ceil(turn / 0.1)))
    xi = np.linspace(-1.0, 1.0, count + 1)
    place, normal = mesh.on_element(k, xi)
    basis = lagrange(order, xi)
    nearest = np.abs(0.5 * (xi[1:] + xi[:-1])[:, None] - mesh.xi[nodes]).argmin(axis=1)
    return {
        "x": place, "normal": normal, "values": basis.T @ nodal[nodes],
        "s": mesh.side_start[k] + 0.5 * (1.0 + xi) * mesh.length[k], "state": state[nodes][nearest].astype(float),
    }  # fmt: skip


def _in_space(values: Array) -> Array:
    """VTK knows three components only."""
    return np.column_stack([values, np.zeros(len(values))])


def _write(path: str | Path, mesh: meshio.Mesh, notes: dict[str, int]) -> None:
    """The file with notes as its field data, which meshio reads but does not write; names are what they say."""
    with temporary_name(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
        if notes:
            kind = 'type="Int32" NumberOfTuples="1" format="ascii"'
            arrays = "".join(f"<DataArray Name={quoteattr(printable(name))} {kind}>{value}</DataArray>"
                             for name, value in notes.items())  # fmt: skip
            start = b"<UnstructuredGrid>"
            content = temporary.read_bytes()
            temporary.write_bytes(content.replace(start, start + f"<FieldData>{arrays}</FieldData>".encode(), 1))
