"""Contact forces anywhere on the hull of an element: what equilibrium may ask for before it is
known which mesh is fine enough."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...arrays import Array
from ...compliance.interface import Interface
from ...contact.equilibrium import Forces
from ...contact.law_protocol import Admissible, LimitedLaw
from ...mesh.boundary_mesh import BoundaryMesh
from .increment import Increment


def forces_at_corners(increment: Increment) -> Forces | None:
    """What the traction of each whole element comes to at its corners, within the largest limits of
    its nodes; None where contact directions are tangents only.

    Nodes lie inside of their elements: a voussoir that stands on the edge of its joint is held
    there, and by none of its nodes.
    """
    problem, modes, law = increment.problem, increment.system.modes, increment.problem.discrete.law
    if modes is None or not isinstance(law, LimitedLaw) or problem.discrete.holds_normals:
        return None
    limits, system = law.admissible(), problem.system
    found = []
    for where, face, side in zip(
        system.slices, system.interfaces, problem.discrete.sides, strict=True
    ):
        mesh = problem.discrete.meshes[side.body]
        of_pair = Admissible(*(each[where] for each in dataclasses.astuple(limits)))
        found.append(_of_pair(mesh, face, modes.motion[where], of_pair))
    resultants, each = zip(*found, strict=True)
    columns = zip(*map(dataclasses.astuple, each), strict=True)
    return np.concatenate(resultants, axis=1), Admissible(*map(np.concatenate, columns))


def _of_pair(mesh: BoundaryMesh, face: Interface, motion: Array, limits: Admissible) -> Forces:
    x, element = mesh.x[face.nodes], mesh.element[face.nodes]
    number, position = np.unique(element, return_inverse=True)
    # relative motions of rigid bodies are rigid, and so are known at the corners by the nodes
    moved = np.einsum("mkd,mkr->mdr", face.directions, motion).reshape(x.size, -1)
    rigid = mesh.motions.of(x)
    shares = np.linalg.lstsq(rigid.reshape(x.size, -1), moved, rcond=None)[0]
    corners = mesh.corners[number]
    mine, which = np.nonzero(~np.isnan(corners[:, :, 0]))
    places = corners[mine, which]
    order = np.argsort(position, kind="stable")
    ends = np.searchsorted(position[order], np.arange(len(number)))
    nearest = np.array(
        [
            nodes[np.argmin(np.linalg.norm(x[nodes] - place, axis=1))]
            for place, e in zip(places, mine, strict=True)
            for nodes in [np.flatnonzero(position == e)]
        ]
    )
    area = np.add.reduceat(mesh.weight[face.nodes][order], ends)
    resultant = np.einsum(
        "qkd,qdc,cr->rqk", face.directions[nearest], mesh.motions.of(places), shares
    )
    largest = (np.maximum.reduceat(each[order], ends) for each in dataclasses.astuple(limits))
    return area[mine, None] * resultant, Admissible(*(each[mine] for each in largest))
