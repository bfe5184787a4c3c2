"""Contact forces anywhere on the hull of an element: what equilibrium may ask for before it is
known which mesh is fine enough."""

from __future__ import annotations

import dataclasses

import numpy as np

from ...arrays import Array, largest_by
from ...compliance.interface import Interface
from ...contact.equilibrium import Forces
from ...contact.law_protocol import Admissible, LimitedLaw
from ...mesh.boundary_mesh import BoundaryMesh
from .increment import Increment


def forces_at_corners(increment: Increment) -> Forces | None:
    """What the tractions of elements come to at their corners, within the largest limits of their
    nodes; None where contact directions are tangents only.

    Nodes lie inside of their elements: a voussoir that stands on the edge of its joint is held
    there, and by none of its nodes. The integrals of a traction times the linear functions of the
    corners have its resultant and its moment on a straight element. Limits are convex, and so these
    forces keep to them with the area that belongs to each corner.
    """
    problem, modes, law = increment.problem, increment.system.modes, increment.law
    system = problem.system
    if modes is None or not isinstance(law, LimitedLaw) or system.k < system.components:
        return None
    limits = law.admissible()
    forces = []
    for where, face, side in zip(
        system.slices, system.interfaces, problem.discrete.sides, strict=True
    ):
        mesh = problem.discrete.meshes[side.body]
        of_pair = Admissible(*(values[where] for values in dataclasses.astuple(limits)))
        forces.append(_of_pair(mesh, face, modes.motion[where], of_pair))
    resultants, values = zip(*forces, strict=True)
    columns = zip(*map(dataclasses.astuple, values), strict=True)
    felt = modes.solved_for(np.concatenate(resultants, axis=1))
    return felt, Admissible(*map(np.concatenate, columns))


def _of_pair(mesh: BoundaryMesh, face: Interface, motion: Array, limits: Admissible) -> Forces:
    nodes = face.nodes
    number, element = np.unique(mesh.element[nodes], return_inverse=True)
    rows, which = np.nonzero(~np.isnan(mesh.corners[number, :, 0]))
    corners = mesh.corners[number[rows], which]
    # relative motions of rigid bodies are rigid, and so are known at the corners by the nodes
    moved = np.einsum("mkd,mkr->mdr", face.directions, motion).reshape(
        mesh.components * len(nodes), -1
    )
    rigid = mesh.motions.modes(mesh.x[nodes]).reshape(len(moved), -1)
    shares = np.linalg.lstsq(rigid, moved, rcond=None)[0]
    away = np.linalg.norm(corners[:, None] - mesh.x[nodes], axis=2)
    directions = face.directions[
        np.argmin(np.where(element == rows[:, None], away, np.inf), axis=1)
    ]
    area = (np.bincount(element, mesh.weight[nodes]) / np.bincount(rows))[rows]
    resultant = np.einsum("qkd,qdc,cr->rqk", directions, mesh.motions.modes(corners), shares)
    largest = largest_by(element, np.transpose(dataclasses.astuple(limits)), len(number))
    return area[:, None] * resultant, Admissible(*largest[rows].T)
