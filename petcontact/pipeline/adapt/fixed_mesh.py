"""Error estimates on meshes that the user fixed.

Where it is cheap, the solution is compared with one on half as many elements, in space on panels
that are twice as large. With contact in space the estimate comes from the tails of tractions.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...contact.law_protocol import GivenLaw
from ...errors import PetcontactError
from ...geometry.outline import Outline, as_outline
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_building import build_mesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import as_surface
from ...model.problem import Problem
from ...refinement.body_meshes import mesh_of, resized
from ...refinement.contact_line import difference as line_difference
from ...refinement.levels import LEAST_GAIN
from ...refinement.marks import WEAK, GradedOutline
from ...refinement.singular_points import corner_exponents
from ...results.evaluated import displacement_scale
from ...results.report import Accuracy
from ...results.solution import Solution
from ...untyped import Comm
from ..judge.findings import limit_of, new_finding
from ..judge.remainders import DataRemainders, missed_data
from ..pose.discretise import discretise
from ..run import RESOLVED, Coarse, prepare, unreported
from ..steps.start import following
from .budget import says_something
from .difference import difference, displacement_difference
from .slip_ladder import contact_lines

FEWEST = 8
"""A body with fewer elements is not solved again on half as many: the difference would not show the
error."""
FEW = 1200
"""Largest number of nodes of a body that is solved again on half as many elements, which costs a
quarter of the first solve; in space a sixteenth, for four times as many nodes."""
FEWER = 0.7
"""Share of the nodes up to which a surface mesh counts as coarser; those of panels that are twice
as large are about a quarter."""
MOST_ITERATIONS = 100
"""Largest number of iterations of an increment on another mesh. 3 to 20 are usual; a solve that
takes more does not show the error."""


Report = Callable[[Solution, Coarse | None], Solution]
"""Adds to a solution what is to be said of it; a coarser mesh is given if that resolves the
contact."""


def with_estimate(
    solution: Solution,
    comm: Comm,
    law: GivenLaw | None = None,
    report: Report = lambda solution, _: solution,
) -> Solution:
    """Return the solution with its estimated error, or with the reason why the error is unknown.

    Findings are added where the meshes miss a large share of the given data. In space the estimate
    comes from the solution itself, see `TailErrors`. On curves it is the difference of two meshes,
    which is the error of the coarser one. With constant elements the error is proportional to h, so
    that it is also the error of the finer mesh. For higher orders it is larger than that error. The
    error is that of u_t in the paper's problem, of u without contact, else of p and q.

    Parameters
    ----------
    solution : Solution
    comm : PETSc.Comm
    law : optional
        As in `solve`.
    report : callable, optional
        It may divide the increments.
    """
    if solution.accuracy.is_known or not solution.converged:
        return report(solution, None)
    reason = "" if carries_something(solution) or not solution.nodes else "contact carries nothing"
    if solution.posed.boundaries[0].dim > 2 and solution.nodes and not reason:
        from .surface_errors import TailErrors

        solution = _with_missed(report(solution, None))
        errors = TailErrors(solution)
        error, of_resultants = errors.error()
        told = Accuracy(error=error, resultants=of_resultants, shared=errors.shared)
        if solution.kind != "bilateral":
            told = replace(told, pairs=errors.by_pair())
        return _estimated(solution, told, errors.where)
    reason = reason or _costly(solution)
    if not reason:
        return _compared(solution, comm, law, report)
    return _not_known(report(solution, None), reason)


def _compared(solution: Solution, comm: Comm, law: GivenLaw | None, report: Report) -> Solution:
    """Return the solution with its difference from one on half as many elements."""
    coarse, accuracy = None, Accuracy()
    reason = "the problem on half as many elements is not solved"
    try:
        coarse = _coarser(solution, comm, law)
        if coarse[1].converged:
            accuracy = _difference(solution, coarse[1])
    except PetcontactError:
        # data may be given for the nodes of one mesh, or a side may have too few elements
        reason = "half as many elements do not pose the problem"
    try:
        said = report(solution, coarse if accuracy.error <= RESOLVED else None)
        if coarse is None or not math.isfinite(accuracy.error):
            return _not_known(said, reason)
        there = said.tracked if isinstance(said.tracked, Solution) else coarse[1]
        if len(said.steps) > len(solution.steps):
            there = there if said.tracked else unreported(following(coarse[0], said), None)
            accuracy = _difference(said, there)
        return replace(_estimated(_with_missed(said), accuracy), coarser=there)
    finally:
        if coarse is not None:
            coarse[0].close()


def _with_missed(solution: Solution) -> Solution:
    """Return the solution with findings where the meshes miss given data, and what they miss."""
    meshes = [*solution.meshes.values()]
    data = DataRemainders(solution.posed.bodies, meshes)
    missed = missed_data(solution.posed, meshes, data)
    solution = replace(solution, accuracy=replace(solution.accuracy, unseen=data.unseen()))
    return solution.with_findings(new_finding("known data", text) for text in missed)


def _not_known(solution: Solution, reason: str) -> Solution:
    """Return the solution with the reason why its error is not known."""
    said = _with_missed(solution)
    return replace(said, accuracy=replace(said.accuracy, unknown=reason))


def _estimated(
    solution: Solution, accuracy: Accuracy, where: Callable[[], str] | None = None
) -> Solution:
    """Return the solution with an estimate, and with a finding if the estimate is large, which says
    `where` elements are too large."""
    error = accuracy.error if says_something(accuracy.error) else max(accuracy.error, 1.0)
    known = solution.accuracy
    accuracy = replace(accuracy, error=error, path=known.path, unseen=known.unseen)
    solution = replace(solution, accuracy=accuracy)
    if not error > limit_of("accuracy"):
        return solution
    text = f"the error is estimated to be {error:.0%}{' or more' * (error >= 1.0)}"
    there = f", most of all in {where()}" if where else ""
    advice = f"smaller elements{there}, or --adapt, make it less"
    return solution.with_findings([new_finding("accuracy", f"{text}: {advice}", measured=error)])


def carries_something(solution: Solution) -> bool:
    """Return whether the solution has u_t, u without contact, or tractions above round-off, to
    estimate an error of."""
    least = solution.posed.idle_traction
    pairs = (pair for step in solution.tried for pair in step.pairs.values())
    return solution.kind != "contact" or any((pair.size > least).any() for pair in pairs)


def _costly(solution: Solution) -> str:
    """Return why the problem is not solved on a coarser mesh, or ""."""
    meshes = list(solution.meshes.values())
    if not all(body.has_inside for body in solution.posed.bodies):
        return "a superelement has one mesh"
    if any(mesh.n_nodes > FEW * 4 ** (mesh.dim - 2) for mesh in meshes):
        return f"more than {FEW} nodes a body; compare with a finer mesh"
    if any(mesh.n_elements < FEWEST for mesh in meshes):
        return f"fewer than {FEWEST} elements"
    if solution.wear is not None:
        return "wear over cycles is not computed twice; compare with a finer mesh"
    if solution.kind == "bilateral":
        outline = as_outline(solution.posed.boundaries[0], "u_t")
        if min(map(min, corner_exponents(solution.posed.bodies[0], outline))) < WEAK:
            return "sides that slide meet at nearly 180°, which no polynomials resolve; use --adapt"
    return ""


def _coarser(solution: Solution, comm: Comm, law: GivenLaw | None) -> Coarse:
    """Return the problem on meshes with half as many elements along each direction, and the
    solution with the same increments."""
    meshes = list(solution.meshes.values())
    problem = by_newton(solution.problem, max_iterations=MOST_ITERATIONS)
    discrete = discretise(
        problem, lambda b, body, boundary: coarser_mesh(meshes[b], body, boundary), law
    )
    prepared = prepare(problem, comm, discrete)
    try:
        prepared = following(prepared, solution)
        return prepared, unreported(prepared, None, checked=False)
    except PetcontactError:
        prepared.close()
        raise


@functools.singledispatch
def coarser_mesh(mesh: BoundaryMesh, body: Body, boundary: Boundary) -> BoundaryMesh:
    """Return a mesh with half as many elements along each direction.

    Where a surface has no panels of that size it is the same mesh with the order below.
    """
    panels = as_surface(mesh)
    larger = as_surface(mesh_of(resized(body, boundary, 1), boundary))
    if larger.n_nodes < FEWER * panels.n_nodes:
        return larger
    return replace(panels, order=panels.order - 1)


@coarser_mesh.register
def _(mesh: CurveMesh, body: Body, boundary: Boundary) -> BoundaryMesh:
    return joined(mesh, as_outline(boundary, "the error"))


def by_newton(problem: Problem, **options: object) -> Problem:
    """Return the problem with semismooth Newton from zero, and further options of `[method]`."""
    newton = {"name": "semismooth-newton", "rule": None, "start": "zero"}
    method = problem.method.model_copy(update=newton | {"formulation": "condensed"} | options)
    return problem.model_copy(update={"method": method})


def _difference(solution: Solution, coarse: Solution) -> Accuracy:
    """Return the relative difference of u_t, of p and q, or of u without contact."""
    if not solution.nodes:
        apart = displacement_difference(coarse, solution)
        surfaces = solution.posed.boundaries[0].dim > 2
        return Accuracy(error=apart, estimates=[LEAST_GAIN * apart, apart] if surfaces else [])
    if solution.kind == "bilateral":
        body = GradedOutline.from_body(
            solution.posed.bodies[0], as_outline(solution.posed.boundaries[0], "u_t")
        )
        apart = line_difference(contact_lines(body, coarse), contact_lines(body, solution))
        of_tractions = difference(coarse, solution).inside
        return Accuracy(error=apart / displacement_scale(solution), tractions=of_tractions)
    apart_by = difference(coarse, solution)
    return Accuracy(error=apart_by.inside, with_ends=apart_by.whole, singular=apart_by.singular)


def joined(mesh: CurveMesh, outline: Outline) -> CurveMesh:
    """Return the mesh with pairs of neighbouring elements joined on each side.

    In the middle of a side one element stays single, or three are joined. Elements at both ends,
    where errors are largest, are always joined. The only element of a side has the order below:
    what two meshes share shows no error. The result does not depend on the direction of the side.
    """
    ends = np.cumsum([side.length for side in outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
    breaks, orders = [], []
    for k, side in enumerate(outline.sides):
        elements = np.flatnonzero(side_of_element == k)
        fractions = np.concatenate([[0.0], np.cumsum(mesh.length[elements])]) / side.length
        fractions[-1] = 1.0
        half = len(elements) // 4 * 2 + 1  # the end of the first half, in pairs
        chosen = np.unique([*range(0, half, 2), *range(len(elements), len(elements) - half, -2)])
        breaks.append(fractions[chosen])
        orders.append(np.maximum(mesh.order[elements[chosen[:-1]]] - (len(elements) == 1), 0))
    return build_mesh(outline, breaks, orders)
