"""Elements at corners whose unknowns are powers of the distance r to the corner, instead of
polynomials.

Where two sides that slide meet at nearly 180°, displacements behave like r^λ and tractions like
r^(λ-1) with a small λ, and what lies within r of the corner matters like r^(2λ): no element is
small enough. One whose shape functions are these powers leaves what the next terms, of the order r,
do. It has one node, at r_0 = λ^(1/(1-λ)) of its length a, where a r^(λ-1) is its own mean: weights
are those of a constant element. Knowns (friction, loads) stay constant.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import gauss
from ...mesh.curve_mesh import CurveMesh, corner_node
from ...mesh.elements import Elements
from ..kernel import Kernel

ORDER = 5
"""Order of the pieces on which the powers are integrated."""
OWN, RATIO, NEAREST = 0.25, 0.4, 0.01
"""Half the length of the node's own piece over r_0, ratio of the pieces' ends, and r/r_0 below
which the traction is a force at its centroid."""
ELSEWHERE = -9
"""Number of no element."""


def corner_columns(
    kernel: Kernel, mesh: CurveMesh, rows: Index, nodes: Index
) -> Iterator[tuple[int, Array, Array]]:
    """Return the nodes of such elements and what the powers add to the columns of constants in G
    and H at other nodes, (d, d, m) each.

    Parameters
    ----------
    kernel : Kernel
    mesh : CurveMesh
    rows : (m,) array
        Nodes at which they are wanted.
    nodes : (c,) array
        Those of `mesh.corner_nodes` that are.
    """
    targets = mesh.targets(rows)
    # the node's own piece has it in its middle
    centred = replace(targets, xi=np.where(mesh.power[targets.element] != 0.0, 0.0, targets.xi))
    for number in mesh.element[nodes].tolist():
        power = abs(float(mesh.power[number]))
        own = float(corner_node(power))
        ends, pieces = _pieces(mesh, number, own)
        r = (ends[:-1, None] + np.diff(ends)[:, None] * 0.5 * (1.0 + gauss(ORDER)[0])) / own
        r = r if mesh.power[number] > 0.0 else r[:, ::-1]
        shaped_g, shaped_h = kernel.integrals(centred, pieces)
        constant_g, constant_h = kernel.integrals(targets, mesh.elements(np.array([number])))
        stress, displacement = r ** (power - 1.0), r**power
        # the force next to the corner, whose centroid is closer to it than any node
        stress[0] = 0.0
        force = own * float(mesh.length[number]) * (ends[1] / own) ** power / power
        points = _on_element(mesh, number, np.array([ends[1] * power / (1.0 + power)]))
        gain_g = np.einsum("ijkm,k->ijm", shaped_g, stress.ravel()) - constant_g[:, :, 0]
        for j, unit in enumerate(np.eye(kernel.dim)):
            gain_g[:, j] += kernel.point_displacement(
                targets.point,
                points,
                (kernel.traction_scale * force * kernel.measure(points))[:, None] * unit,
            ).T
        yield (
            int(mesh.first_node[number]),
            gain_g,
            np.einsum("ijkm,k->ijm", shaped_h, displacement.ravel()) - constant_h[:, :, 0],
        )


def _pieces(mesh: CurveMesh, number: int, own: float) -> tuple[Array, Elements]:
    """Return the pieces and their ends. The ends are shares of the element's length from the corner
    and increase from 0 to 1."""
    inward = (1.0 - OWN) * RATIO ** np.arange(np.ceil(np.log(NEAREST) / np.log(RATIO)), -1.0, -1.0)
    first = (1.0 + OWN) * own
    count = int(np.ceil(np.log(first) / np.log(RATIO)))
    outward = first ** (1.0 - np.arange(count + 1) / count)
    ends = np.concatenate([[0.0], own * inward, outward])
    points = _on_element(mesh, number, ends)
    start, end = (
        (points[:-1], points[1:]) if mesh.power[number] > 0.0 else (points[1:], points[:-1])
    )
    index = np.where(np.arange(len(start)) == len(inward), number, ELSEWHERE)
    curvature, line = (
        np.full(len(start), values[number]) for values in (mesh.curvature, mesh.line)
    )
    return ends, Elements(start, end, curvature, ORDER, line, index)


def _on_element(mesh: CurveMesh, number: int, shares: Array) -> Array:
    """Return the points (k, 2) of an element at shares of its length from its corner [length]."""
    xi = (2.0 * shares - 1.0) * np.sign(mesh.power[number])
    return np.asarray(mesh.on_elements(np.array([number]), xi)[0][0])
