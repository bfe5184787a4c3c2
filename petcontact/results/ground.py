"""Bilateral contact with fixed ground as interfaces: one a contact part, under its name."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..arrays import Array, Index, States
from ..geometry.rotation import moment
from ..mesh.boundary_mesh import BoundaryMesh
from .records import PairResult


def ground_pairs(
    mesh: BoundaryMesh, parts: Iterable[str], nodes: Index, traction: Array, *,
    tangent: Array, u_t: Array, sigma_t: Array, bound: Array, state: States,
) -> dict[str, tuple[Index, PairResult]]:  # fmt: skip
    """Nodes, and nodal fields after the only increment, of each contact part.

    Parameters
    ----------
    mesh : BoundaryMesh
    parts : names
        The contact parts, in the order of the result.
    nodes : (m,) array
        Numbers of all contact nodes.
    traction : (n, d) array
        On the whole boundary [stress].
    tangent, u_t, sigma_t, bound, state : (m, ...) arrays
        At the contact nodes, as in `PairResult`.
    """
    found = {}
    for name in parts:
        here = np.flatnonzero(mesh.node_part[nodes] == mesh.part_names.index(name))
        mine = nodes[here]
        x, normal, weight = mesh.x[mine], mesh.normal[mine], mesh.weight[mine]
        force = weight[:, None] * traction[mine]
        found[name] = mine, PairResult(
            x, normal, tangent[here], weight, mesh.variables(mine).get("s", np.zeros(len(mine))),
            0.0 - np.einsum("ij,ij->i", traction[mine], normal), sigma_t[here], bound[here], np.zeros(len(mine)),
            u_t[here], u_t[here], state[here], force.sum(axis=0), moment(x, force),
            float(-weight @ np.sum(sigma_t[here] * u_t[here], axis=1)),
        )  # fmt: skip
    return found
