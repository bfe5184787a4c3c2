"""The error on meshes that the user fixed: in the plane, where that is cheap, against the same
meshes with pairs of elements joined; on surfaces by the tails of tractions."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ...errors import PetcontactError
from ...geometry.outline import Outline, as_outline
from ...mesh.curve_building import build_mesh
from ...mesh.curve_mesh import CurveMesh, as_curve
from ...refinement.contact_line import difference as line_difference
from ...refinement.marks import WEAK, Body
from ...refinement.singular_points import corner_exponents
from ...results.report import Accuracy
from ...results.solution import Solution
from ...round_off import ROUNDED
from ..judge.findings import limit_of, new_finding
from ..judge.remainders import missed_data
from ..pose.discretise import MeshMaker, discretise
from ..run import prepare, unreported
from ..steps.load_steps import known_factors
from .difference import difference, displacement_difference, displacement_scale
from .other_orders import beside_error, whole_error
from .slip_ladder import contact_lines
from .surface_errors import TailErrors

CHEAP = 1200
"""Nodes of a body up to which a quarter more of assembly is nothing to wait for."""
FEWEST = 8
"""Elements of a mesh below which half of them say nothing."""
MOST_INCREMENTS = 64
"""That are solved once more: of half as many elements each costs a quarter."""
MOST = 100
"""Iterations of an increment on another mesh that are enough: 3 to 20 are usual, more say nothing
of the error."""


def with_estimate(solution: Solution, comm: Any, law: Any = None) -> Solution:
    """The solution with its estimated error where that is cheap, else with the reason why it is not
    known; and findings where the meshes miss much of what is known.

    On surfaces it comes from the solution itself, see `TailErrors`. On
    curves what two meshes differ by is the error of the coarser one; of constant elements, whose
    error halves with h, it is that of the finer one, of elements of higher order more. It is the
    error of u_t of the paper's problem, else of p and q, without contact of u.

    Parameters
    ----------
    solution : Solution
    comm : PETSc.Comm
    law : optional
        As in `solve`.
    """
    if solution.accuracy.is_known or not solution.converged:
        return solution
    missed = missed_data(solution.problem, [*solution.meshes.values()])
    solution = solution.with_findings(new_finding("known data", text) for text in missed)
    curves = all(isinstance(mesh, CurveMesh) for mesh in solution.meshes.values())
    reason = "" if carries_something(solution) or not solution.nodes else "contact carries nothing"
    if not curves and not reason:
        return _on_surfaces(solution, lambda make: _again(solution, make, comm, law))
    reason = reason or _costly(solution)
    if not reason:
        try:
            coarse = _coarser(solution, comm, law)
            if coarse.converged:
                accuracy = _difference(solution, coarse)
                if math.isfinite(accuracy.error):
                    return replace(_estimated(solution, accuracy), coarser=coarse)
            reason = "the problem on half as many elements is not solved"
        except (
            PetcontactError
        ):  # data given for the nodes of one mesh, a body that half the elements do not hold
            reason = "half as many elements do not pose the problem"
    return replace(solution, accuracy=replace(solution.accuracy, unknown=reason))


def _on_surfaces(solution: Solution, solved_on: Callable[[MeshMaker], Solution]) -> Solution:
    """As `with_estimate`."""
    whole = beside = math.nan
    if solution.kind == "bilateral" or not solution.nodes:
        whole = whole_error(solution, solved_on)
    if not solution.nodes:
        if math.isnan(whole):
            return replace(
                solution, accuracy=replace(solution.accuracy, unknown="compare with a finer mesh")
            )
        return _estimated(solution, Accuracy(error=min(whole, 1.0)))
    if solution.kind == "bilateral" and math.isnan(whole):
        beside = beside_error(solution, solved_on)
    error, of_resultants = TailErrors(solution).error(beside, whole)
    return _estimated(solution, Accuracy(error=error, resultants=of_resultants))


def _estimated(solution: Solution, accuracy: Accuracy) -> Solution:
    """The solution with an estimate, and a finding where it is large."""
    error = accuracy.error
    text = f"the error is estimated to be {error:.0%}{' or more' * (error >= 1.0)}"
    advice = "smaller elements, or --adapt, make it less"
    accuracy = replace(accuracy, path=solution.accuracy.path)
    large = new_finding("accuracy", f"{text}: {advice}", measured=error)
    return replace(solution, accuracy=accuracy).with_findings(
        [large] * bool(error > limit_of("accuracy"))
    )


def carries_something(solution: Solution) -> bool:
    """Whether there is a u_t, or a p, whose error could be known."""
    least = ROUNDED * min(body.material.young_modulus for body in solution.problem.body)
    pairs = (pair for step in solution.tried for pair in step.pairs.values())
    return solution.kind == "bilateral" or any((pair.size > least).any() for pair in pairs)


def _costly(solution: Solution) -> str:
    """Why no other mesh is solved on; empty where one is."""
    meshes = list(solution.meshes.values())
    if not all(body.geometry.has_inside for body in solution.problem.body):
        return "a superelement has one mesh"
    if any(mesh.n_nodes > CHEAP for mesh in meshes):
        return f"more than {CHEAP} nodes a body; compare with a finer mesh"
    if any(mesh.n_elements < FEWEST for mesh in meshes):
        return f"fewer than {FEWEST} elements"
    if solution.wear is not None:
        return "wear over cycles is not computed twice; compare with a finer mesh"
    if len(solution.steps) > MOST_INCREMENTS:
        return f"more than {MOST_INCREMENTS} increments; compare with a finer mesh, or use --adapt"
    if solution.kind == "bilateral" and min(map(min, _exponents(solution))) < WEAK:
        return "sides that slide meet at nearly 180°, which no polynomials resolve; use --adapt"
    return ""


def _exponents(solution: Solution) -> list[tuple[float, float]]:
    """λ at the ends of the sides of the one body."""
    return corner_exponents(solution.problem, as_outline(solution.problem.outline(), "u_t"))


def _coarser(solution: Solution, comm: Any, law: Any) -> Solution:
    """The solution on meshes of half as many elements."""
    meshes = [as_curve(mesh) for mesh in solution.meshes.values()]
    return _again(
        solution, lambda number, one, boundary: joined(meshes[number], boundary), comm, law
    )


def _again(solution: Solution, make: MeshMaker, comm: Any, law: Any) -> Solution:
    """The solution of the same problem on other meshes."""
    problem = solution.problem
    method = problem.method.model_copy(
        update={
            "name": "semismooth-newton",
            "rule": None,
            "start": "zero",
            "formulation": "condensed",
            "max_iterations": MOST,
        }
    )
    problem = problem.model_copy(update={"method": method})
    prepared = prepare(problem, comm, discretise(problem, make, law))
    # as many increments as the solution has
    prepared.factors = known_factors(solution, 0.0)
    try:
        return unreported(prepared, None, checked=False)
    finally:
        prepared.close()


def _difference(solution: Solution, other: Solution) -> Accuracy:
    """Of u_t, of p and q, or of u where nothing is in contact, relative, as a solution reports
    it."""
    if not solution.nodes:
        return Accuracy(error=displacement_difference(other, solution))
    if solution.kind == "bilateral":
        body = Body.of(solution.problem, as_outline(solution.problem.outline(), "u_t"))
        apart = line_difference(contact_lines(body, other), contact_lines(body, solution))
        return Accuracy(error=apart / displacement_scale(solution))
    apart_by = difference(other, solution)
    return Accuracy(error=apart_by.inside, with_ends=apart_by.whole, singular=apart_by.singular)


def joined(mesh: CurveMesh, outline: Outline) -> CurveMesh:
    """The mesh with pairs of neighbouring elements of each side joined, one left, or a third one
    joined, in the middle.

    Both ends of a side, where errors are largest, have joined elements, and a side run through
    backwards has the same ones.
    """
    ends = np.cumsum([side.length for side in outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
    breaks, orders = [], []
    for k, side in enumerate(outline.sides):
        mine = np.flatnonzero(side_of_element == k)
        fractions = np.concatenate([[0.0], np.cumsum(mesh.length[mine])]) / side.length
        fractions[-1] = 1.0
        half = len(mine) // 4 * 2 + 1  # behind the first half, in pairs
        chosen = np.unique([*range(0, half, 2), *range(len(mine), len(mine) - half, -2)])
        breaks.append(fractions[chosen])
        orders.append(mesh.order[mine[chosen[:-1]]])
    return build_mesh(outline, breaks, orders)
