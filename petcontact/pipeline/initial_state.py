"""Where an iteration starts: by name, from a result file, or from a solution on another mesh."""

from __future__ import annotations

import functools
from pathlib import Path

import numpy as np
import scipy

from ..arrays import Index
from ..contact.state import Start
from ..contact.system import ContactSystem
from ..errors import InputError
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..results.records import ContactFields
from ..results.solution import read_solution

NEAREST = 4
"""Nodes of an old surface mesh between which values are interpolated, by the inverse square of their distance."""


def initial_functions(name: str, system: ContactSystem, mesh: BoundaryMesh, nodes: Index) -> Start | None:
    """Initial functions by name; those of a result file are carried over by arc length, part by part.

    Raises
    ------
    InputError
        If the name is neither "zero", "frictionless" nor a file.
    ResultError
        If the file is not a result.
    """
    if name == "zero":
        return None
    if name == "frictionless":
        return system.u_0, np.zeros_like(system.u_0)
    if not Path(name).exists():
        raise InputError(f'method.start: {name!r} is neither "zero", "frictionless" nor a result file')
    return carried_over(mesh, read_solution(name).contact, nodes)


@functools.singledispatch
def carried_over(mesh: BoundaryMesh, old: ContactFields, nodes: Index) -> Start:
    """u_t and σ_t (m, d-1) of a solution at the contact nodes of another mesh, part by part, from the nearest old nodes."""
    names = np.array(mesh.part_names)[mesh.node_part[nodes]]
    tangent = mesh.tangents(nodes)
    result = [np.zeros(tangent.shape[:2]) for _ in range(2)]
    for part in np.unique(names):
        here, there = np.flatnonzero(names == part), np.flatnonzero(old.part == part)
        if len(there):
            near = min(NEAREST, len(there))
            distance, place = scipy.spatial.cKDTree(old.x[there]).query(mesh.x[nodes[here]], k=range(1, near + 1))
            share = 1.0 / np.maximum(distance, 1e-12 * np.ptp(old.x)) ** 2
            share /= share.sum(axis=1, keepdims=True)
            for new, components in zip(result, (old.u_t, old.sigma_t), strict=True):
                vectors = np.einsum("nk,nkd->nd", components[there], old.tangent[there])[place]
                new[here] = np.einsum("nq,nqd,nkd->nk", share, vectors, tangent[here])
    return result[0], result[1]


@carried_over.register
def _(mesh: CurveMesh, old: ContactFields, nodes: Index) -> Start:
    """By arc length."""
    names = np.array(mesh.part_names)[mesh.node_part[nodes]]
    u, sigma = np.zeros((len(nodes), 1)), np.zeros((len(nodes), 1))
    for part in np.unique(names):
        here, there = names == part, old.part == part
        if there.any():
            s = mesh.arc_length[nodes[here]]
            u[here, 0] = np.interp(s, old.arc_length[there], old.u_t[there, 0])
            sigma[here, 0] = np.interp(s, old.arc_length[there], old.sigma_t[there, 0])
    return u, sigma
