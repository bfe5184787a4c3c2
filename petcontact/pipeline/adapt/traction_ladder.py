"""Adaptive strategy in the plane for pressure and shear of any contact."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

import numpy as np

from ...contact.friction_law import main_direction, signed
from ...contact.law_protocol import OPEN, SLIP
from ...contact.laws import STEEP
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...given.body_data import Body
from ...given.posed import Posed
from ...mesh.curve_mesh import as_curve
from ...record import field, record, replace
from ...refinement.contact_edges import Edge, is_apart, merged, zone_at
from ...refinement.known_data import SideData, varying_data
from ...refinement.levels import CONTACT_LADDER, Level, believed
from ...refinement.marks import FINER, FINEST, UNSEEN, GradedOutline, LevelMesh
from ...refinement.narrow_contacts import NarrowContact
from ...results.contact_zones import pair_edges
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ...untyped import Keyed
from ..choice import BUDGET, posed_seconds
from ..judge.findings import limit_of, wants_smaller_elements
from ..pose.body_parts import body_alone
from ..steps.prepared import PreparedProblem
from .difference import Difference, difference, fading_places
from .part_ends import PressedSides, pressed_sides
from .strategy import Estimate, Meshes, Strategy, Tried, Wanted, no_start

PUNCH = 0.5
"""Exponent of displacements where a corner presses on a side, as for a rigid frictionless punch on
a half-plane [-]."""
MANY = 12
"""Number of edges before the end of a step, above which only a part of them is kept. The kinks that
they leave are weak if they are close to each other. Of 24 increments a step all edges took up to
twice as many nodes; with one of them a true error was 1.6 times the reported one (random contacts
of scripts/verify_random --contact --seed 7 --first 100)."""
SMOOTH = 2.0 / 3.0
"""Largest length of elements on a side that is closed all over, over the thickness of its body [-].
What presses on the other side of the body shows there: elements of order 3 with 3/2 of it had an
error of 2e-2 on the shaft of a bearing of 12 rollers (its inner ring is 7 mm thick)."""
FOUND = 0.1
"""Error of an edge's place over the smallest elements there [-], see `CONTACT_LADDER`.
Edges at the ends of two steps that are farther apart are two, however coarse the level is: an edge
that several levels leave out does not show in their differences. With 0 second meshes of two steps
had up to a quarter more elements (configs/axial_press_fit.toml), with 1 third ones of random bodies
of revolution 1.08 times as many."""


@record
class TractionEstimate(Estimate):
    """The error of p and q.

    Attributes
    ----------
    apart : Difference
        The difference from the solution on the mesh before.
    each : dict of lists of float
        Differences of each contact on the meshes that were solved for it [-].
    idle : set of (body, part)
        Secondary parts of contacts that carry nothing.
    """

    apart: Difference = field(default_factory=Difference)
    each: dict[str, list[float]] = field(default_factory=dict)
    idle: frozenset[tuple[int, str]] = frozenset()


@record
class EdgeMarks:
    """Where the meshes of a level are graded.

    Attributes
    ----------
    edges : dict of lists of Edge
        Edges of contact and stick by interface.
    idle : set of (body, part)
        Secondary parts of contacts that carry nothing.
    settled : dict of Level
        Levels of bodies whose contacts are all as accurate as is wanted.
    last : Solution or None
        The solution whose elements at corners are halved.
    """

    edges: dict[str, list[Edge]] = field(default_factory=dict)
    idle: frozenset[tuple[int, str]] = frozenset()
    settled: dict[int, Level] = field(default_factory=dict)
    last: Solution | None = None


class Tractions(Strategy[TractionEstimate, EdgeMarks]):
    """The strategy for p and q, with the edges of contact and stick that a solution shows.

    Attributes
    ----------
    accuracy : float
        Default of the wanted accuracy [-].
    """

    accuracy, first = CONTACT_LADDER.usual, EdgeMarks()

    def __init__(self, posed: Posed, wanted: Wanted) -> None:
        self._posed, self.wanted = posed, wanted
        self._sides = {side.name: (side.body, side.part) for side in posed.interfaces}
        outlines = [as_outline(boundary, "--adapt").joined for boundary in posed.boundaries]
        self._pressed = pressed_sides(outlines, posed.interfaces)
        self._places = fading_places(posed)

    @property
    def levels(self) -> tuple[Level, ...]:
        """The levels of `CONTACT_LADDER` that the wanted accuracy needs."""
        return CONTACT_LADDER.reaching(self.wanted.accuracy)

    @functools.cached_property
    def _bodies(self) -> list[GradedOutline]:
        """The data of each body, with the corners that press on it and loads of later steps."""
        result = []
        for number, boundary in enumerate(self._posed.boundaries):
            posed = body_alone(self._posed, number, boundary)
            body = GradedOutline.from_body(posed, as_outline(boundary, "--adapt").joined)
            body = with_pressing_corners(body, self._pressed[number])
            result.append(with_later_data(body, posed))
        return result

    def estimate(
        self, tried: Tried[EdgeMarks], before: TractionEstimate | None
    ) -> TractionEstimate:
        """Return the largest error of all contacts: the last difference, which is the error of the
        mesh before; of one difference alone twice that, see `CONTACT_LADDER`."""
        solution, marks = tried.solution, tried.meshes.marks
        idle = frozenset(self._sides.values()) - {
            self._sides[name]
            for step in solution.steps
            for name, pair in step.pairs.items()
            if pair.size.max(initial=0.0) > self._posed.idle_traction
        }
        if before is None:
            return TractionEstimate(tried, math.inf, idle=idle)
        apart = difference(before.solution, solution, self._places)
        differences = [*before.differences, apart.inside]
        each = {
            # of settled bodies the mesh is the one before
            side.name: [*before.each.get(side.name, []), apart.each[side.name]]
            if set(side.bodies) - marks.settled.keys()
            else before.each[side.name]
            for side in self._posed.interfaces
        }
        found = TractionEstimate(tried, math.inf, differences, apart, each, idle)
        enough = CONTACT_LADDER.believes(differences, self.wanted.accuracy)
        if enough or (len(differences) == 1 and self._needs_no_third(solution)):
            error = max(2.0 * differences[0], self.levels[tried.meshes.level].error)
        else:
            error = max(self._errors(found).values(), default=believed(differences))
        return replace(found, error=error)

    def _needs_no_third(self, solution: Solution) -> bool:
        """Return whether two meshes show the error and a third one were dear.

        Without contact meshes do not follow solutions: the difference is the error of the first.
        Where a third one is cheap, it shows peak stresses to more digits than u needs.
        """
        meshes = [*solution.meshes.values()]
        return not self._sides and posed_seconds(self._posed, meshes, 1) > BUDGET

    def _errors(self, estimate: TractionEstimate) -> dict[str, float]:
        """Return the error of each contact by `believed`, 0 of one that carries nothing."""
        return {
            name: 0.0 if self._sides[name] in estimate.idle else believed(differences)
            for name, differences in estimate.each.items()
        }

    def marks(self, estimate: TractionEstimate) -> EdgeMarks:
        """Return the edges of a solution, to which the next meshes are graded."""
        meshes = estimate.tried.meshes
        return EdgeMarks(
            self._edges(estimate.solution, meshes.level, bool(estimate.differences)),
            estimate.idle,
            self._settled(estimate) if estimate.differences else {},
            estimate.solution,
        )

    def _settled(self, estimate: TractionEstimate) -> dict[int, Level]:
        """Return the levels of bodies whose contacts are all as accurate as is wanted."""
        meshes, errors = estimate.tried.meshes, self._errors(estimate)
        bodies = {side.name: set(side.bodies) for side in self._posed.interfaces}
        left = {
            b for name, both in bodies.items() if errors[name] > self.wanted.accuracy for b in both
        }
        every = set[int]().union(*bodies.values())
        level = self.levels[meshes.level]
        return {b: meshes.marks.settled.get(b, level) for b in every - left}

    def marks_after_failure(
        self, tried: Tried[EdgeMarks], estimate: TractionEstimate | None
    ) -> EdgeMarks | None:
        """Return the edges of the contact in a rejected solution that overlaps beside it, or the
        next level if elements are too large."""
        failed = tried.solution.failed
        if failed is None or "overlap between nodes" not in wants_smaller_elements(failed.findings):
            return super().marks_after_failure(tried, estimate)
        accepted = 0 if estimate is None else estimate.tried.meshes.level
        seen = estimate is not None and bool(estimate.differences)
        edges = self._edges(replace(tried.solution, steps=tried.solution.tried), accepted, seen)
        last = None if estimate is None else estimate.solution
        return EdgeMarks(edges, last=last) if any(edges.values()) else None

    def _edges(self, solution: Solution, level: int, seen: bool) -> dict[str, list[Edge]]:
        """Return the edges that a solution on a level shows; on first meshes, that have seen no
        edges, by what narrow contacts carry."""
        finest = {
            name: FINEST * self._bodies[body].scale for name, (body, _) in self._sides.items()
        }
        moved = None if seen else self._narrow
        return edges_of_steps(solution, self.levels[level].edge, finest, moved)

    def _narrow(
        self, solution: Solution, name: str, pair: PairResult, seen: list[Edge]
    ) -> list[Edge]:
        """Return the edges of a pair on a first mesh, by what narrow contacts carry."""
        side = next(side for side in self._posed.interfaces if side.name == name)
        mesh, order = solution.meshes[solution.sides[name][0]], np.argsort(pair.arc_length)
        load = pair.pressure * mesh.measure[solution.nodes[name]]
        contact = NarrowContact(
            functools.partial(self._bodies[side.body].gap, side.part), self._posed.softness(side)
        )
        closed = (pair.state != OPEN)[order]
        return contact.edges(seen, pair.arc_length[order], load[order], closed)

    def meshes(self, marks: EdgeMarks, level: int) -> Meshes[EdgeMarks]:
        """Return meshes graded to corners, to the user's points and to edges on secondary parts."""
        if level == len(self.levels):
            return Meshes(marks, level)
        made = [
            self._mesh(marks, b, marks.settled.get(b, self.levels[level]))
            for b in range(len(self._bodies))
        ]
        missed = max(each.missed for each in made)
        start = no_start
        if marks.last is not None and self._sides:
            start = functools.partial(warm_start, marks.last)
        return Meshes(marks, level, [each.mesh for each in made], missed, start=start)

    def _mesh(self, marks: EdgeMarks, number: int, level: Level) -> LevelMesh:
        body = self._bodies[number]
        if marks.last is not None:
            body = body.after(as_curve([*marks.last.meshes.values()][number]))
        own = _OwnMarks(marks, number, body, level)
        edges_on: dict[str, list[Edge]] = {}  # a part may be in several contacts
        for name, (b, part) in self._sides.items():
            if b == number:
                edges_on[part] = [*edges_on.get(part, []), *marks.edges.get(name, [])]
        largest, inner = list[float](), dict[int, list[tuple[float, float]]]()
        for k, (side, start) in enumerate(
            zip(body.outline.sides, body.outline.offsets, strict=True)
        ):
            edges = [replace(e, s=e.s - start) for e in edges_on.get(side.part, [])]
            largest.append(self._largest(own, k, edges))
            pressing = own.pressing_sizes(self._pressed[number], k, edges)
            if not edges and (number, side.part) not in marks.idle:
                pressing |= body.touching_beside(k, pressing)
            if graded := own.graded(pressing, edges, side.length):
                inner[k] = graded
        return body.mesh(own.level, largest, None, inner)

    def _largest(self, own: _OwnMarks, k: int, edges: list[Edge]) -> float:
        """Return the largest length of elements on a side [length]."""
        side = own.body.outline.sides[k]
        if (own.number, side.part) not in self._sides.values():
            return np.inf
        if own.marks.last is None:
            points = own.body.meets_at_points(k, limit_of("far apart"))
            return np.inf if points else side.whole / UNSEEN
        settled = edges or (own.number, side.part) in own.marks.idle
        return np.inf if settled else SMOOTH * own.body.scale

    def shown(self, estimate: TractionEstimate) -> Keyed:
        """Return fields of `Accuracy`: edges of contact and stick, and the errors at ends of
        parts."""
        seen = self.marks(estimate).edges.items()
        edges = {name: [edge.s for edge in items] for name, items in seen}
        ends = {"with_ends": estimate.apart.whole, "singular": estimate.apart.singular}
        return {"edges": edges, **(ends if estimate.differences else {})}


@record
class _OwnMarks:
    """What is marked on one body, and the level of its mesh."""

    marks: EdgeMarks
    number: int
    body: GradedOutline
    level: Level

    def graded(
        self, pressing: dict[float, float], edges: list[Edge], length: float
    ) -> list[tuple[float, float]]:
        """Return the points inside a side to which its mesh is graded, and the smallest elements
        there.

        They are pressing corners and rough points of the gap, with the sizes that are given, and
        edges that do not coincide with these or with an end of the side.
        """
        corners, finest = list[tuple[float, float]](), FINEST * self.body.scale
        for s, size in sorted(pressing.items()):
            # points of two contacts may differ by round-off only
            if not corners or s - corners[-1][0] > size:
                corners.append((s, max(size, finest)))
        fixed, smallest = [Edge(s, np.inf) for s, _ in corners], self.level.edge
        sizes = [
            (edge.s, max(smallest * edge.width, finest))
            for edge in edges
            if is_apart(edge, fixed, smallest, finest)
        ]
        return sorted([*corners, *((s, size) for s, size in sizes if size < s < length - size)])

    def pressing_sizes(
        self, pressed: PressedSides, k: int, edges: list[Edge]
    ) -> dict[float, float]:
        """Return the element sizes at pressing corners, kinks and jumps of the gap inside a side
        [length].

        They are no larger than at an edge of a contact that reaches as near to the point as such
        elements do, and at most `FINER` times those on the last mesh.
        """
        size, result = self.body.corner_size(PUNCH, self.level.resolved), dict[float, float]()
        for s in (*pressed.inner.get(k, []), *pressed.kinks.get(k, [])):
            widths = [e.width for e in edges if abs(e.s - s) <= 2.0 * e.width + size]
            result[s] = min([size, *(self.level.edge * width for width in widths)])
            if self.marks.last is not None:
                mesh = as_curve([*self.marks.last.meshes.values()][self.number])
                on_part = mesh.part == mesh.part_names.index(self.body.outline.sides[k].part)
                begins = np.abs(mesh.side_start[on_part] - self.body.outline.offsets[k] - s)
                last = float(mesh.length[on_part][begins.argmin()])
                result[s] = min(result[s], FINER * last)
        return result


def with_pressing_corners(body: GradedOutline, pressed: PressedSides) -> GradedOutline:
    """Return the body with the gaps of its pairs, and pressing corners at least as singular as a
    punch."""
    exponents = [
        (
            min(first, PUNCH) if (k, 0) in pressed.pressing else first,
            min(last, PUNCH) if (k, 1) in pressed.pressing else last,
        )
        for k, (first, last) in enumerate(body.exponents)
    ]
    singular = [
        (first or (k, 0) in pressed.pressing, last or (k, 1) in pressed.pressing)
        for k, (first, last) in enumerate(body.singular)
    ]
    gaps = [row + pressed.gaps.get(k, []) for k, row in enumerate(body.gaps)]
    return replace(body, exponents=exponents, singular=singular, gaps=gaps)


def with_later_data(body: GradedOutline, posed: Body) -> GradedOutline:
    """Return an outline with data of the beginning, and those of its body in all steps."""
    for condition in {
        id(c): c for state in posed.conditions for c in state.values() if c not in posed.boundary
    }.values():
        rest = tuple(given for given in posed.boundary if given.part != condition.part)
        later = varying_data((*rest, condition), posed.volume, body.outline)
        on_part = [side.part == condition.part for side in body.outline.sides]
        body = _with_data(
            body, [more if is_on else [] for more, is_on in zip(later, on_part, strict=True)]
        )
    for loads in set(posed.loads) - {posed.volume}:
        body = _with_data(body, varying_data((), loads, body.outline))
    return body


def _with_data(body: GradedOutline, data: list[list[SideData]]) -> GradedOutline:
    return replace(body, data=[[*row, *more] for row, more in zip(body.data, data, strict=True)])


def edges_of_steps(
    solution: Solution,
    smallest: float,
    finest: dict[str, float],
    moved: Callable[[Solution, str, PairResult, list[Edge]], list[Edge]] | None = None,
) -> dict[str, list[Edge]]:
    """Return the edges of every interface at the ends of all steps, and of earlier increments.

    Edges that coincide are merged. An edge of an earlier increment leaves a kink in q, and is kept
    if no later edge is there.
    """
    last = {id(step) for step in step_ends(solution.steps)}
    result: dict[str, list[Edge]] = {}
    for name in solution.nodes:
        edges = {True: list[Edge](), False: list[Edge]()}
        for step in solution.steps:
            seen = pair_edges(step.pairs[name], smallest, finest[name])
            if moved is not None:
                seen = moved(solution, name, step.pairs[name], seen)
            edges[id(step) in last] += seen
        ends = merged(edges[True], FOUND * smallest, (), finest[name])
        between = sorted(edges[False], key=lambda edge: edge.s)
        result[name] = merged(between[:: 1 + len(between) // MANY], smallest, ends, finest[name])
    return result


def warm_start(before: Solution, problem: PreparedProblem) -> Start:
    """Return v and σ of size 1 on another mesh.

    Their sets are the zones of a solution after its first increment.
    """
    parts, discrete = [], problem.discrete
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = before.steps[0].pairs[side.name]
        along = main_direction(pair.sigma_t)
        direction = np.where(pair.state == SLIP, -np.sign(signed(pair.sigma_t, along)), 0.0)
        s = as_curve(discrete.meshes[side.body]).arc_length[interface.nodes]
        own, state = pair_edges(pair), pair.state.astype(np.int64)
        state, direction = (
            zone_at(pair.arc_length, values, own, s)
            for values in (state, direction.astype(np.int64))
        )
        slip = np.outer(np.where(state == SLIP, np.where(direction == 0, 1, direction), 0), along)
        # beyond every coefficient of friction
        columns = (
            ([slip], [-slip * STEEP**2])
            if interface.held
            else ([slip, -1.0 * (state == OPEN)], [-slip * STEEP**2, -1.0 * (state != OPEN)])
        )
        parts.append(tuple(np.column_stack(values) for values in columns))
    v, sigma = (np.concatenate(values).astype(np.float64) for values in zip(*parts, strict=True))
    return v, sigma
