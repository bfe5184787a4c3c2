"""What a group of cases that share assembly and elimination will cost, by the size of its meshes
alone."""

from __future__ import annotations

from dataclasses import astuple

import numpy as np

from ...errors import PetcontactError
from ...model.problem import Problem
from ...pipeline.choice import compression_of, dense_seconds, resolved_bem
from ...pipeline.solve import adapts_itself
from ...record import record
from ...refinement.body_meshes import mesh_of

# Seconds on one core of 2020, fitted to Examples 1 and 2 at h = 0.4 ... 0.0125: only their ratios
# matter, they decide the order of the groups and who helps whom.
FIXED, CASE = 2e-3, 1.4e-3
PROCESS_MEMORY = 1.35e8
"""Bytes of a rank before it has read a case: Python, numpy, PETSc and HDF5."""


@record
class Cost:
    """Size of a prepared problem, and what it takes.

    Attributes
    ----------
    nodes, contact_unknowns : int
        n, and the tangential unknowns on Γ_C; 0 where the body cannot be meshed.
    prepare, case : float
        Estimated seconds of assembly and elimination, and of each case after them.
    memory : float
        Estimated bytes of its matrices, all ranks of a team together.
    adaptive : bool
        Whether each case has meshes of its own; the others are those of its first one.
    """

    nodes: int
    contact_unknowns: int
    prepare: float
    case: float
    memory: float
    adaptive: bool = False


def estimate(case: Problem, ranks: int) -> Cost:
    """Size, time and memory from the meshes; `ranks` solve each case together."""
    try:
        costs = [_of_body(case, b) for b in range(len(case.body))]
    except PetcontactError:
        # the sweep meets the same error in its turn and records it case by case
        return Cost(0, 0, FIXED, FIXED, 0.0)
    n, m, prepare, solve, memory, _ = (
        sum(column) for column in zip(*map(astuple, costs), strict=True)
    )
    if adapts_itself(case):
        # an adaptive case takes about four solves on its first mesh: it has three to six meshes
        return Cost(n, m, 0.0, CASE + 4.0 * (prepare + solve) / ranks, memory, adaptive=True)
    return Cost(n, m, FIXED + prepare / ranks, CASE + solve / ranks, memory)


def _of_body(case: Problem, number: int) -> Cost:
    body = case.body[number]
    contact = {condition.part for condition in body.boundary if condition.condition == "contact"}
    contact |= {part for side in case.interfaces for _, part in side.ends}
    mesh = mesh_of(case.posed.bodies[number], case.outline(number))
    n, unknowns = mesh.n_nodes, mesh.components * mesh.n_nodes
    m = (mesh.components - 1) * int(
        np.isin(np.array(mesh.part_names)[mesh.node_part], list(contact)).sum()
    )
    if (way := compression_of(resolved_bem(case.bem), mesh)) is not None:
        seconds = way.seconds(mesh)
        return Cost(n, m, seconds, seconds, way.memory(mesh))
    prepare = dense_seconds(mesh)
    if case.method.formulation == "full":
        return Cost(n, m, 0.0, 40.0 * prepare, 16.0 * unknowns**2)
    # a case that shares its elimination costs products with S
    return Cost(n, m, prepare, 6e-8 * m * m, 8.0 * (unknowns**2 + 2 * unknowns * m + 8 * m * m))
