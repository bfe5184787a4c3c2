"""The error on a mesh that the user fixed, where it is cheap: against the same mesh with pairs of elements joined."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import PetcontactError
from ..geometry.outline import Outline
from ..mesh.curve_mesh import CurveMesh, build_mesh
from ..refinement.contact_line import difference
from ..refinement.marks import Body
from ..results.solution import Solution
from .assemble import discretise
from .run import prepare, run
from .slip_quantity import contact_lines, displacement_scale

CHEAP = 1200
"""Nodes up to which a quarter more of assembly is nothing to wait for."""
FEWEST = 8
"""Elements of a mesh below which half of them say nothing."""


def with_estimate(solution: Solution, comm: Any) -> Solution:
    """The solution, its info with `estimated_error` where that is cheap: a plane body, one rank, a mesh that is not large.

    What two meshes differ by is the error of the coarser one; of constant elements, whose error halves with h, it is that of
    the finer one, of elements of higher order more.
    """
    problem = solution.problem
    if not solution.bilateral or "estimated_error" in solution.info or not solution.converged:
        return solution
    if len(problem.body) > 1 or comm.getSize() > 1:
        return solution
    outline, mesh = problem.geometry.outline(), solution.mesh
    if not isinstance(outline, Outline) or not isinstance(mesh, CurveMesh):
        return solution
    if not FEWEST <= mesh.n_elements <= mesh.n_nodes <= CHEAP:
        return solution
    method = problem.method.model_copy(update={
        "name": "semismooth-newton", "rule": None, "start": "zero", "formulation": "condensed"
    })  # fmt: skip
    problem = problem.model_copy(update={"method": method})
    try:
        discrete = discretise(problem, lambda number, one, boundary: joined(mesh, outline))
        prepared = prepare(problem, comm, discrete)
        try:
            other = run(prepared, checked=False)
        finally:
            prepared.close()
        body = Body.of(problem, outline)
    except PetcontactError:  # data given for the nodes of one mesh, a body that half the elements do not hold
        return solution
    error = difference(contact_lines(body, other), contact_lines(body, solution)) / displacement_scale(solution)
    return replace(solution, info={**solution.info, "estimated_error": error})


def joined(mesh: CurveMesh, outline: Outline) -> CurveMesh:
    """The mesh with pairs of neighbouring elements of each side joined, an odd one left."""
    ends = np.cumsum([side.length for side in outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
    breaks, orders = [], []
    for k, side in enumerate(outline.sides):
        mine = np.flatnonzero(side_of_element == k)
        fractions = np.concatenate([[0.0], np.cumsum(mesh.length[mine])]) / side.length
        fractions[-1] = 1.0
        chosen = np.unique([*range(0, len(fractions), 2), len(fractions) - 1])
        breaks.append(fractions[chosen])
        orders.append(mesh.order[mine[chosen[:-1]]])
    return build_mesh(outline, breaks, orders)
