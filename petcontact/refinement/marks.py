"""Where and how much meshes are graded: corners, ends of parts, given points, the transition points of a solution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..arrays import Array
from ..geometry.outline import Outline
from ..mesh.curve_mesh import CurveMesh
from ..mesh.grading import mesh_outline, points_on_sides, singular_ends
from ..mesh.hp_grading import Grading, Marks, balanced, graded_mesh
from ..model.problem import Contact, Problem
from .contact_line import ContactLine, slip_at_end, transition
from .singular_points import RIGHT_ANGLE, corner_powers, kinks

CORNER_SIZE = 0.015 ** (1.0 / RIGHT_ANGLE)
"""Size of the smallest elements, in thicknesses of the body, that leaves an error of 1e-4 at a corner of power 1."""
UNSEEN = 24
"""Least number of elements on a contact side whose transition points nobody has told."""


@dataclass(frozen=True)
class Rung:
    """One grading of the ladder.

    Attributes
    ----------
    grading : Grading
    resolved : float
        Relative error that the smallest elements leave at corners and transition points [-].
    error : float
        Typical relative error of u_t, measured on the paper's examples; only ratios of it are used as estimates [-].
    """

    grading: Grading
    resolved: float
    error: float


LADDER = (
    Rung(Grading(1, 0.30), 2.5e-3, 3.3e-3),
    Rung(Grading(2, 0.30), 1.0e-4, 6.7e-5),
    Rung(Grading(3, 0.28), 1.0e-5, 4.6e-6),
    Rung(Grading(5, 0.28), 3.0e-7, 4.0e-7),
    Rung(Grading(5, 0.33), 6.0e-8, 3.3e-8),
    Rung(Grading(5, 0.40), 1.2e-8, 1.3e-8),
    Rung(Grading(5, 0.50), 2.5e-9, 3.0e-9),
)
MARGIN = 1.3
"""How far below the wanted error a rung's typical error is when it is tried first."""


def first_rung(accuracy: float) -> int:
    """The lowest rung but the first that may be expected to have this error."""
    return next((k for k in range(1, len(LADDER)) if MARGIN * LADDER[k].error <= accuracy), len(LADDER) - 1)


@dataclass(frozen=True)
class Body:
    """What all meshes of an adaptive solve share.

    Attributes
    ----------
    outline : Outline
    scale : float
        Twice the area over the perimeter, about the thickness of the body [length].
    contact : list of bool
        Which sides are in contact.
    given : list of (k,) arrays
        Arc lengths of the points of each side that the user wants graded [length].
    kinks : list of (k,) arrays
        Arc lengths on each side at which the data have a kink or a jump [length].
    singular : list of pairs of bool
        Whether the start and the end of each side are corners or places where parts meet.
    powers : list of pairs of float
        With which power of the error the smallest elements shrink there, see `singular.corner_powers`.
    """

    outline: Outline
    scale: float
    contact: list[bool]
    given: list[Array]
    kinks: list[Array]
    singular: list[tuple[bool, bool]]
    powers: list[tuple[float, float]]

    @staticmethod
    def of(problem: Problem, outline: Outline) -> Body:
        """Of a problem, whose outline is made once."""
        parts = {condition.part for condition in problem.boundary if isinstance(condition, Contact)}
        polygon = outline.polygon()
        given = [side.length * f for side, f in zip(outline.sides, points_on_sides(outline, problem.mesh), strict=True)]
        scale = 2.0 * polygon.area / polygon.length
        contact = [side.part in parts for side in outline.sides]
        return Body(
            outline, scale, contact, given, kinks(problem, outline), singular_ends(outline),
            corner_powers(problem, outline),
        )  # fmt: skip


def mesh_of(problem: Problem, outline: Outline) -> CurveMesh:
    """The mesh that a problem asks for, or the default one.

    Raises
    ------
    InputError
        As `mesh_outline`.
    """
    return default_mesh(problem, outline) if problem.mesh.automatic else mesh_outline(outline, problem.mesh)


def default_mesh(problem: Problem, outline: Outline) -> CurveMesh:
    """The mesh of a problem that names no element size, order or grading: a rung of the ladder, with the points given."""
    body, rung = Body.of(problem, outline), LADDER[first_rung(problem.mesh.accuracy)]
    largest = [
        side.length / UNSEEN if contact and not len(given) else np.inf
        for side, contact, given in zip(outline.sides, body.contact, body.given, strict=True)
    ]
    return graded_mesh(outline, marks_for(body, rung.grading, rung.resolved, None), rung.grading, largest)[0]


def marks_for(body: Body, grading: Grading, resolved: float, shown: list[ContactLine] | None) -> list[Marks]:
    """Corners, given points and transition points of each side, with the sizes of the smallest elements there.

    Parameters
    ----------
    body : Body
    grading : Grading
    resolved : float
        Relative error of u_t that the smallest elements may leave [-].
    shown : list of ContactLine, optional
        A solution so far, one a contact side, which shows the transition points.
    """
    # truncation errors fall with the power 2λ of the size at corners, with its square at transition points (measured on
    # the paper's examples, whose corners are clamped at one side, the strongest case at a right angle: 2λ = 1/0.7)
    level = resolved / 1e-4
    at_corner, at_transition = body.scale * (CORNER_SIZE * level) ** RIGHT_ANGLE, 0.06 * body.scale * level**0.5
    lines = iter(shown or [])
    marks = []
    for k, side in enumerate(body.outline.sides):
        line = next(lines, None) if body.contact[k] else None
        found = [] if line is None else [transition(line, cut) for cut in line.cuts]
        closest = 1e-9 * side.length
        inner = np.array(sorted(s for s in found if closest < s < side.length - closest))
        given = body.given[k]
        inside = given[(given > closest) & (given < side.length - closest)]
        kinked = body.kinks[k][(body.kinks[k] > closest) & (body.kinks[k] < side.length - closest)]
        ends = [singular or float(s) in given for singular, s in zip(body.singular[k], (0.0, side.length), strict=True)]
        points = np.concatenate([[0.0], inside, inner, kinked, [side.length]])
        sizes = np.full(len(points), at_corner)
        # points that are given on contact sides are transition points
        sizes[1 if body.contact[k] else 1 + len(inside) : -1] = at_transition
        sizes[[0, -1]] = [body.scale * (CORNER_SIZE * level) ** power for power in body.powers[k]]
        order = np.argsort(points, kind="stable")
        points, sizes = points[order], sizes[order]
        distinct = np.append(np.diff(points) > closest, True)
        points, sizes = points[distinct], sizes[distinct]
        points[0] = 0.0
        for place, singular in zip((0, -1), ends, strict=True):
            if not singular:
                sizes[place] = np.inf
            elif line is not None:
                sizes[place] = min(sizes[place], 0.3 * slip_at_end(line, place == -1))
            elif body.contact[k]:
                # small enough to show how the traction grows towards the end
                sizes[place] = min(sizes[place], 0.015 * body.scale)
        marks.append(balanced(Marks(points, sizes), grading))
    return _equal_at_corners(body.outline, marks)


def _equal_at_corners(outline: Outline, marks: list[Marks]) -> list[Marks]:
    """Both sides of a corner get the smaller of their smallest elements."""
    first = 0
    for loop in outline.loops:
        for k in range(len(loop)):
            one, other = marks[first + k], marks[first + (k + 1) % len(loop)]
            one.size[-1] = other.size[0] = min(one.size[-1], other.size[0])
        first += len(loop)
    return marks
