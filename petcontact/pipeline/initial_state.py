"""Where an iteration starts: by name, from a result file, or from a solution on another mesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..arrays import Index
from ..contact.state import Start
from ..contact.system import ContactSystem
from ..errors import InputError
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..results.hdf5 import read_solution
from ..results.solution import ContactFields


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
    return carried_over(read_solution(name).contact, as_curve(mesh), nodes)


def carried_over(old: ContactFields, mesh: CurveMesh, nodes: Index) -> Start:
    """u_t and σ_t (m, 1) of a solution at the contact nodes of another mesh, by arc length along each part."""
    names = np.array(mesh.part_names)[mesh.node_part[nodes]]
    u, sigma = np.zeros((len(nodes), 1)), np.zeros((len(nodes), 1))
    for part in np.unique(names):
        here, there = names == part, old.part == part
        if there.any():
            s = mesh.arc_length[nodes[here]]
            u[here, 0] = np.interp(s, old.arc_length[there], old.u_t[there, 0])
            sigma[here, 0] = np.interp(s, old.arc_length[there], old.sigma_t[there, 0])
    return u, sigma
