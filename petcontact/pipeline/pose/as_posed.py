"""A problem on its meshes before anything moves, in the form of a solution that can be drawn."""

from __future__ import annotations

import numpy as np

from ...compliance.interface import Interface
from ...contact.law_protocol import OPEN
from ...geometry.rotation import Axial, axial
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import Problem
from ...results.data import SolutionData
from ...results.records import BodyResult, ObstacleResult, PairResult, StepResult
from .discretise import Discrete, discretise


def as_posed(problem: Problem) -> SolutionData:
    """Return the state with which a solve would begin.

    It has the meshes, the initial gaps, and the known tractions at the end of the last step. No
    body is displaced and no contact is closed.

    Raises
    ------
    InputError
        If the problem is ill-posed.
    """
    discrete = discretise(problem)
    problem, names = discrete.problem, [body.name for body in discrete.problem.body]
    meshes = dict(zip(names, discrete.meshes, strict=True))
    steps = max(1, len(problem.step))
    d, none = discrete.meshes[0].components, np.zeros(0)
    spin: Axial = axial(np.zeros(len(discrete.meshes[0].motions.planes)))
    step = StepResult(
        problem.step[-1].name if problem.step else "load",
        steps,
        1.0,
        "converged",
        "",
        0,
        {},
        {
            face.name: _untouched(face, discrete.meshes[face.body], spin)
            for face in discrete.interfaces
        },
        _loaded(discrete),
        {
            obstacle.name: ObstacleResult(np.zeros(d), spin, np.zeros(d), spin)
            for obstacle in problem.obstacle
        },
        none,
    )
    sides = {side.name: (names[side.body], side.part) for side in discrete.sides}
    nodes = {face.name: face.nodes for face in discrete.interfaces}
    return SolutionData(problem, meshes, nodes, sides, [step], "converged", "", {})


def _loaded(discrete: Discrete) -> dict[str, BodyResult]:
    """Return all bodies without displacement, under their known tractions."""
    results = {}
    for body, data in zip(discrete.problem.body, discrete.data, strict=True):
        values = np.where(data.traction_known, data.value[-1], 0.0)
        traction = np.einsum("icj,ic->ij", data.frame, values)
        results[body.name] = BodyResult(np.zeros_like(traction), traction)
    return results


def _untouched(face: Interface, mesh: BoundaryMesh, spin: Axial) -> PairResult:
    """Return the result of an interface that is open everywhere."""
    zeros, shear = np.zeros(len(face.nodes)), np.zeros(face.tangent.shape[:2])
    return PairResult(
        mesh.x[face.nodes],
        face.normal,
        face.tangent,
        mesh.weight[face.nodes],
        mesh.sites(face.nodes).along,
        zeros,
        shear,
        zeros,
        face.gap - (0.0 if face.overlap is None else face.overlap[0]),
        shear,
        shear,
        np.full(len(zeros), OPEN),
        np.zeros(mesh.components),
        spin,
        0.0,
    )
