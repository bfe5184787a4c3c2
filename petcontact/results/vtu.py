"""Results for ParaView: fields inside the body and on its boundary as .vtu, through meshio."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import TYPE_CHECKING

import meshio
import numpy as np

from ..arrays import Array, Index
from ..fields.interior import Field
from ..mesh.basis import lagrange
from ..mesh.curve_mesh import CurveMesh
from ..runtime.atomic_write import temporary_name

if TYPE_CHECKING:
    from .solution import Solution



def write_vtu(path: str | Path, field: Field) -> None:
    """Write displacement, stress, von Mises and principal stresses inside the body as a .vtu file.

    Parameters
    ----------
    path : str or Path
        Appears when it is whole.
    field : Field
        From `field_on_grid`; ParaView's "Warp By Vector" with `displacement` shows the deformed body.

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
    ))  # fmt: skip


def write_boundary_vtu(path: str | Path, solution: Solution) -> None:
    """Write the boundary data of a solution as a .vtu file of lines.

    Points belong to one element each, since tractions jump from element to element; elements of higher order and arcs
    are cut into short lines. Point data: displacement, traction, normal, sigma_n, sigma_t (along the tangent, the normal
    turned by +90°), arc_length; cell data: the number of the part, and contact (-1 elsewhere, 0 stick, 1 slip).

    Raises
    ------
    OutputError
        If the file cannot be written.
    """
    mesh, contact = solution.mesh, solution.contact
    state = np.full(mesh.n_nodes, -1, dtype=np.int64)
    state[contact.nodes] = contact.state
    pieces = [_element(mesh, k, solution.u, solution.traction, state) for k in range(mesh.n_elements)]
    counts = np.array([len(piece["x"]) for piece in pieces])
    first = np.concatenate([[0], np.cumsum(counts)])
    lines = np.concatenate([
        np.column_stack([np.arange(a, b - 1), np.arange(a + 1, b)]) for a, b in itertools.pairwise(first)
    ])
    x, normal, u, traction, s = (np.concatenate([p[name] for p in pieces]) for name in ("x", "normal", "u", "traction", "s"))
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    _write(path, meshio.Mesh(
        _in_space(x), [("line", lines)],
        point_data={
            "displacement": _in_space(u), "traction": _in_space(traction), "normal": _in_space(normal),
            "sigma_n": np.sum(traction * normal, axis=1), "sigma_t": np.sum(traction * tangent, axis=1), "arc_length": s,
        },
        cell_data={"part": [np.repeat(mesh.part, counts - 1)],
                   "contact": [np.concatenate([p["state"] for p in pieces]).astype(np.int64)]},
    ))  # fmt: skip


def _element(mesh: CurveMesh, k: int, u: Array, traction: Array, state: Index) -> dict[str, Array]:
    """Points along an element and the boundary data there."""
    order, nodes = int(mesh.order[k]), slice(int(mesh.first_node[k]), int(mesh.first_node[k + 1]))
    turn = abs(float(mesh.curvature[k] * mesh.length[k]))
    count = max(1, 2 * order, int(np.ceil(turn / 0.1)))
    xi = np.linspace(-1.0, 1.0, count + 1)
    place, normal = mesh.on_element(k, xi)
    basis = lagrange(order, xi)
    nearest = np.abs(0.5 * (xi[1:] + xi[:-1])[:, None] - mesh.xi[nodes]).argmin(axis=1)
    return {
        "x": place, "normal": normal, "u": basis.T @ u[nodes], "traction": basis.T @ traction[nodes],
        "s": mesh.side_start[k] + 0.5 * (1.0 + xi) * mesh.length[k], "state": state[nodes][nearest].astype(float),
    }  # fmt: skip


def _in_space(values: Array) -> Array:
    """VTK knows three components only."""
    return np.column_stack([values, np.zeros(len(values))])


def _write(path: str | Path, mesh: meshio.Mesh) -> None:
    with temporary_name(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
