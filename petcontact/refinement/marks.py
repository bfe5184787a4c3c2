"""Points to which meshes are graded, and the sizes of the smallest elements there.

The points are corners, ends of parts, the user's points, and transition points of a solution.
"""

from __future__ import annotations

import functools
import itertools
import math
import operator
from collections.abc import Collection, Iterator

import numpy as np

from ..arrays import Array, Index
from ..errors import InputError
from ..geometry.outline import Outline
from ..geometry.same_place import SMALLEST, TOLERANCE, inside
from ..given.body_data import Body
from ..given.conditions import Contact
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.grading import LARGEST_MESH, points_on_sides, singular_ends
from ..mesh.hp_grading import Grading, Marks, balanced, graded_mesh
from ..record import field, record, replace
from .contact_line import ContactLine, grading_points, slip_at_end
from .gap_minima import lowest_minima
from .known_data import SideData, fields, resolved
from .levels import SLIP_LADDER, Level, first_level
from .singular_points import corner_exponents

MILDEST = 0.7
"""Least value of 1/(2λ), the power of the error with which elements shrink at corners [-]. It is
that of a right angle that is clamped on one side and free on the other (λ = 0.71, ν = 0.3)."""
WEAK = 0.3
"""Exponent λ below which elements at corners are powers of the distance. It is so small only
between two sliding sides. Without powers ten random bodies (scripts/verify_random --seed 7 --first
100) took 1.1 times as many nodes, and one of them missed the wanted error."""
DATA_SHARE = 0.2
"""Accepted defect of the given data on one element, over the level's error [-]. With 1 meshes have
0.95 times as many nodes, but true errors of 22 random bodies were up to 1.1 times the reported
ones (scripts/verify_random --seed 7 --first 100), not up to 1.0 times."""
UNSEEN = 24
"""Least number of elements on a contact side whose transition points are unknown."""
FINEST = 1e-6
"""Size of the smallest elements at edges of contact over the thickness of the body, and at a
minimum of the gap over the side, while the width of the contact is unknown [-]. Minima within it
count as one, or as an end. The round-off of displacements over this size becomes round-off of
p."""
IN_ZONES = 0.25
"""Power of a level's error with which elements at the ends of narrow zones shrink, relative to the
zones' widths [-]. With 0 true errors of ten random bodies were 1.5 times as large, and up to 1.0
times the reported ones, not 0.85 times (scripts/verify_random --seed 7 --first 100)."""
FINER = 0.5
"""Largest size of elements at corners over that on the level before [-]. Errors of tractions that
fade out there fall like the size to the power λ + 1/2, which is about 1. They halve at least, and
the difference of the levels exceeds the error of the finer one. Without it true errors of 20 random
contacts (scripts/verify_random --contact --seed 7 --first 100) were up to 0.8 times the reported
ones, not up to 0.45 times."""


@record
class GradedOutline:
    """Data of a body that all meshes of an adaptive solve share.

    Attributes
    ----------
    outline : Outline
    scale : float
        Twice the area over the perimeter, about the thickness of the body [length].
    contact : list of bool
        Which sides are in contact.
    given : list of (k,) arrays
        Arc lengths of the user's points on each side [length].
    data : list of lists of SideData
        Given data that vary along each side.
    singular : list of pairs of bool
        Whether the start and the end of each side are corners or ends of a part.
    exponents : list of pairs of float
        λ there, see `singular_points.corner_exponents`.
    powers : list of pairs of float, optional
        λ where elements at corners are powers of the distance, else 0.
    last : list of pairs of float, optional
        Lengths of the elements at the start and the end of each side on the level before [length].
    gaps : list of lists of SideData, optional
        Gaps along each side.
    """

    outline: Outline
    scale: float
    contact: list[bool]
    given: list[Array]
    data: list[list[SideData]]
    singular: list[tuple[bool, bool]]
    exponents: list[tuple[float, float]]
    powers: list[tuple[float, float]] = field(default_factory=list)
    last: list[tuple[float, float]] = field(default_factory=list)
    gaps: list[list[SideData]] = field(default_factory=list)

    @staticmethod
    def from_body(body: Body, outline: Outline) -> GradedOutline:
        """Return the data of a body and its outline."""
        if len(outline.sides) * UNSEEN > LARGEST_MESH:
            raise InputError(
                f"mesh: {len(outline.sides)} graded sides give more than {LARGEST_MESH:.0e} nodes; "
                "name an element_size, or describe the body by fewer sides"
            )
        parts = {condition.part for condition in body.boundary if isinstance(condition, Contact)}
        given = [
            side.length * f
            for side, f in zip(outline.sides, points_on_sides(outline, body.mesh), strict=True)
        ]
        contact = [side.part in parts for side in outline.sides]
        data = fields(body, outline)
        return GradedOutline(
            outline,
            outline.thickness,
            contact,
            given,
            data,
            singular_ends(outline),
            corner_exponents(body, outline),
            gaps=[[each for each in row if each.kind == "gap"] for row in data],
        )

    def with_powers(self) -> GradedOutline:
        """Return the body with elements that are powers at corners with very small exponents.

        Their error comes from the next term, of order r. It is that of a corner with exponent (1 +
        λ)/2.
        """
        powers = [(a if a < WEAK else 0.0, b if b < WEAK else 0.0) for a, b in self.exponents]
        exponents = [
            (0.5 * (1.0 + a) if a < WEAK else a, 0.5 * (1.0 + b) if b < WEAK else b)
            for a, b in self.exponents
        ]
        return replace(self, exponents=exponents, powers=powers)

    def after(self, mesh: CurveMesh) -> GradedOutline:
        """Return the body whose next meshes have smaller elements at corners than a mesh."""
        ends = np.cumsum(mesh.length)
        starts, last = ends - mesh.length, list[tuple[float, float]]()
        sides = np.array([side.length for side in self.outline.sides])
        for length, end in zip(sides, np.cumsum(sides), strict=True):
            nearest = np.abs(starts - (end - length)).argmin(), np.abs(ends - end).argmin()
            last.append((float(mesh.length[nearest[0]]), float(mesh.length[nearest[1]])))
        return self._with_last(last)

    def _with_last(self, last: list[tuple[float, float]]) -> GradedOutline:
        """Return the body with other lengths at corners; what the data say is not asked again."""
        result = replace(self, last=last)
        vars(result).update(touching=self.touching, kinks=self.kinks)
        return result

    def halving(self, mesh: CurveMesh, resolved: float) -> GradedOutline:
        """Return the body as `after`, where a mesh and a level are about as fine at corners.

        Elements that are by far smaller on the mesh make its error there none, and the difference
        that of the level.
        """
        body = self.after(mesh)
        laws = [[self.corner_size(each, resolved) for each in pair] for pair in self.exponents]
        last = [
            (a if a > FINER * law[0] else math.inf, b if b > FINER * law[1] else math.inf)
            for (a, b), law in zip(body.last, laws, strict=True)
        ]
        return body._with_last(last)

    @functools.cached_property
    def kinks(self) -> list[Array]:
        """Arc lengths inside each side at which its data have a kink or a jump, increasing
        [length]."""
        fractions = [
            np.concatenate([np.empty(0), *(field.switches[0] for field in row)])
            for row in self.data
        ]
        return [
            inside(on_side * side.length, self.closest, side.length)
            for side, on_side in zip(self.outline.sides, fractions, strict=True)
        ]

    @functools.cached_property
    def touching(self) -> list[dict[float, float]]:
        """Arc lengths of the lowest minima of the gaps along each side, and the smallest elements
        there while the width of the contact is unknown [length]."""
        lowest = lowest_minima(self.outline, self.gaps, self.singular, FINEST)
        return [
            dict.fromkeys(arcs, FINEST * side.length)
            for arcs, side in zip(lowest, self.outline.sides, strict=True)
        ]

    def meets_at_points(self, side: int, far: float) -> bool:
        """Return whether two bodies meet near the lowest places of the gaps along a side only.

        This is so where each gap exceeds its least value by more than `far` times the side on more
        than half of it: displacements that are small do not close it there. Meshes are graded to
        those places, and need no small elements between them. Gaps that are given are not looked
        at: one body has few sides.
        """
        if any(gap.kind != "distance" for gap in self.gaps[side]):
            return False
        whole = np.linspace(0.0, 1.0, 1 + 8 * UNSEEN)
        gaps = [gap.values(whole)[:, 0] for gap in self.gaps[side]]
        limit = far * self.outline.sides[side].length
        return bool(gaps) and all(
            np.count_nonzero(gap - np.nanmin(gap) <= limit) < 0.5 * len(whole)
            for gap in gaps
            if np.isfinite(gap).any()
        )

    def gap(self, part: str, s: Array) -> Array:
        """Return the least gap (n,) at arc lengths (n,) along a part, nan where nothing is opposite
        [length]."""
        result, sides = np.full(len(s), np.nan), self.outline.sides
        for side, start, row in zip(sides, self.outline.offsets, self.gaps, strict=True):
            share = (s - start) / side.length
            on = (side.part == part) & (share >= 0.0) & (share <= 1.0)
            for each in row:
                result[on] = np.fmin(result[on], each.values(share[on])[:, 0])
        return result

    def touching_beside(self, side: int, places: Collection[float]) -> dict[float, float]:
        """Return what `touching` has of a side, without arc lengths that are one of some places."""
        return {
            s: size
            for s, size in self.touching[side].items()
            if all(abs(s - place) > self.closest for place in places)
        }

    @property
    def closest(self) -> float:
        """Distance within which points count as one [length]."""
        return TOLERANCE * self.outline.diameter

    @functools.cached_property
    def smallest(self) -> float:
        """Least size of elements at corners [length]."""
        farthest = max(float(np.abs(side.start).max()) for side in self.outline.sides)
        return SMALLEST * max(self.scale, farthest)

    def corner_size(self, exponent: float, resolved: float) -> float:
        """Return the size of the smallest elements at a corner for a relative error of u_t
        [length].

        Far from the corner, elements of size a cause an error of about a^(2λ), measured on the
        paper's examples.
        """
        power = max(0.5 / exponent, MILDEST)
        # at a corner of power 1 a size of .015 leaves an error of 1e-4
        size = (0.015 ** (1.0 / MILDEST) * resolved / 1e-4) ** power
        return max(self.smallest, self.scale * float(size))

    def end_sizes(self, number: int, resolved: float) -> list[float]:
        """Return the sizes of the smallest elements at both ends of a side [length]."""
        last_sizes = self.last[number] if self.last else (math.inf, math.inf)
        return [
            min(self.corner_size(exponent, resolved), max(FINER * last, self.smallest))
            for exponent, last in zip(self.exponents[number], last_sizes, strict=True)
        ]

    def mesh(
        self,
        level: Level,
        largest: list[float],
        shown: list[ContactLine] | None,
        edges: dict[int, list[tuple[float, float]]] | None = None,
    ) -> LevelMesh:
        """Return the mesh of a level, with elements that resolve the data.

        Parameters
        ----------
        level : Level
        largest : list of float, one a side
            Largest length of elements on the side [length].
        shown : list of ContactLine, optional
            As in `marks_for`.
        edges : dict of lists by side, optional
            Arc lengths along the side of further points, and the smallest elements there; by
            default those of `touching` [length].
        """
        missed = [0.0]

        def resolve(side: int, breaks: Array, orders: Index) -> tuple[Array, Index]:
            least = self.smallest / self.outline.sides[side].length
            breaks, orders, left = resolved(
                breaks, orders, self.data[side], DATA_SHARE * level.error, least
            )
            missed.append(left)
            return breaks, orders

        marks = marks_for(self, level.grading, level.resolved, shown)
        if edges is None:
            edges = {k: list(sizes.items()) for k, sizes in enumerate(self.touching) if sizes}
        for side, inner in edges.items():
            marks[side] = _with_points(marks[side], inner, level.grading)
        mesh = graded_mesh(
            self.outline, marks, level.grading, largest, resolve if any(self.data) else None
        )
        if max(missed) > 0.0:
            # thousands of elements do not resolve the data: a solve on them is not worth its cost
            mesh = graded_mesh(self.outline, marks, level.grading, largest)
        return LevelMesh(mesh, max(missed))


@record
class LevelMesh:
    """A mesh, and the largest defect of the data above the accepted one, or 0 [-]."""

    mesh: BoundaryMesh
    missed: float


def default_mesh(body: Body, outline: Outline) -> BoundaryMesh:
    """Return the mesh of a body without element size, order or grading.

    It is that of a refinement level, with the user's points.
    """
    graded = GradedOutline.from_body(body, outline)
    level = SLIP_LADDER.levels[first_level(body.mesh.accuracy or SLIP_LADDER.usual)]
    largest = [
        side.whole / UNSEEN if contact and not len(given) else np.inf
        for side, contact, given in zip(outline.sides, graded.contact, graded.given, strict=True)
    ]
    return graded.mesh(level, largest, None).mesh


def marks_for(
    body: GradedOutline, grading: Grading, resolved: float, shown: list[ContactLine] | None
) -> list[Marks]:
    """Return the points of each side to which meshes are graded, and their smallest elements.

    Parameters
    ----------
    body : GradedOutline
    grading : Grading
    resolved : float
        Relative error of u_t that the smallest elements may cause [-].
    shown : list of ContactLine, optional
        Solution on an earlier mesh, one line for each contact side; it gives the transition points.
    """
    # in narrower zones two levels must have different elements: an error that both meshes share
    # does not appear in their difference
    first = SLIP_LADDER.levels[0]
    share = min(1.0, (resolved / first.resolved) ** IN_ZONES * first.grading.ratio / grading.ratio)
    lines, marks = iter(shown or []), []
    for k, side in enumerate(body.outline.sides):
        line = next(lines, None) if body.contact[k] else None
        ends = body.end_sizes(k, resolved)
        candidates = [
            (0.0, ends[0]),
            *_marks_inside(body, k, resolved, line),
            (side.length, ends[1]),
        ]
        candidates.sort(key=operator.itemgetter(0))
        kept = [
            mark
            for mark, after in itertools.pairwise([*candidates, (math.inf, 0.0)])
            if after[0] - mark[0] > body.closest
        ]
        points, sizes = (np.array(values) for values in zip(*kept, strict=True))
        points[0] = 0.0
        for end, singular in zip((0, -1), body.singular[k], strict=True):
            given = line is None and (0.0, side.length)[end] in body.given[k]
            sizes[end] = (
                min(sizes[end], _at_end(body, k, line, end)) if singular or given else np.inf
            )
        powers = body.powers[k] if body.powers else (0.0, 0.0)
        marks.append(balanced(Marks(points, sizes, powers), grading, share))
    return _equal_at_corners(body.outline, marks)


def _marks_inside(
    body: GradedOutline, number: int, resolved: float, line: ContactLine | None
) -> Iterator[tuple[float, float]]:
    """Yield the marked points inside a side, and the smallest elements there [length]."""
    # errors at transition points fall with the square of the size (measured on the paper's
    # examples), and with the size itself where slip changes its sign
    fall = (resolved / 1e-4) ** 0.5
    at_transition, turning = 0.06 * body.scale * fall, min(1.0, fall)
    kinks, length = body.kinks[number], body.outline.sides[number].length
    if line is None:
        # the user's points on contact sides stand for transition points until there is a solution
        size = at_transition if body.contact[number] else body.corner_size(1.0, resolved)
        inner = [(s, size) for s in body.given[number].tolist()]
    else:
        inner = [
            (s, at_transition * (turning if turns else 1.0))
            for s, turns in grading_points(line)
            if not np.any(np.abs(kinks - s) < body.closest)
        ]
    for s, size in inner:
        if body.closest < s < length - body.closest:
            yield s, size
    yield from ((s, at_transition) for s in kinks.tolist())


def _at_end(body: GradedOutline, number: int, line: ContactLine | None, end: int) -> float:
    """Return the largest accepted size of elements at a singular end of a side [length]."""
    if line is not None:
        return 0.3 * slip_at_end(line, end == -1)
    # the elements resolve the growth of the traction towards the end
    return 0.015 * body.scale if body.contact[number] else np.inf


def _with_points(marks: Marks, inner: list[tuple[float, float]], grading: Grading) -> Marks:
    """Return the marks with further points; they replace marks close to them, and ends that they
    meet."""
    points, sizes = (np.array(values) for values in zip(*inner, strict=True))
    apart = np.abs(marks.position[:, None] - points[None]).min(axis=1)
    kept = apart > 3.0 * sizes.max()
    kept[[0, -1]] = apart[[0, -1]] > 0.0
    position, size = np.append(marks.position[kept], points), np.append(marks.size[kept], sizes)
    order = np.argsort(position)
    return balanced(replace(marks, position=position[order], size=size[order]), grading)


def _equal_at_corners(outline: Outline, marks: list[Marks]) -> list[Marks]:
    """Set the smaller of both smallest elements on both sides of each corner, and return the
    marks."""
    for k, following in enumerate(outline.neighbours[1].tolist()):
        if following != k:
            marks_before, marks_after = marks[k], marks[following]
            marks_before.size[-1] = marks_after.size[0] = min(
                marks_before.size[-1], marks_after.size[0]
            )
    return marks
