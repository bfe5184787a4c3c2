"""Adaptive strategy in the plane for pressure and shear of any contact."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ...contact.friction_law import main_direction, signed
from ...contact.law_protocol import OPEN, SLIP
from ...contact.laws import STEEP
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.posed import Posed
from ...mesh.curve_mesh import as_curve
from ...refinement.contact_edges import Edge, is_apart, merged, zone_at
from ...refinement.known_data import SideData, varying_data
from ...refinement.levels import CONTACT_LADDER, Level, believed
from ...refinement.marks import FINER, FINEST, UNSEEN, GradedOutline, LevelMesh
from ...refinement.narrow_contacts import NarrowContact
from ...results.contact_zones import pair_edges
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ..judge.findings import limit_of, wants_smaller_elements
from ..pose.discretise import Discrete
from ..steps.increment import PreparedProblem
from .difference import Difference, difference, fading_places, unloaded
from .part_ends import PressedSides, pressed_sides
from .strategy import Strategy

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
"""Error of an edge's place over the smallest elements there [-], see `CONTACT_REFINEMENT_LEVELS`.
Edges at the ends of two steps that are farther apart are two, however coarse the level is: an edge
that several levels leave out does not show in their differences. With 0 second meshes of two steps
had up to a quarter more elements (configs/axial_press_fit.toml), with 1 third ones of random bodies
of revolution 1.08 times as many."""


class Tractions(Strategy):
    """The strategy for p and q, with the edges of contact and stick that it has seen.

    Attributes
    ----------
    levels : tuple of Level
        Refinement levels of the meshes.
    accuracy : float
        Default of the wanted accuracy [-].
    differences : list of float
        Relative differences of p and q between neighbouring meshes [-].
    """

    accuracy, exhausted = 1e-2, ""

    def __init__(self, posed: Posed) -> None:
        self.differences: list[float] = []
        self.wanted, self.asked = self.accuracy, True
        self._posed, self._bodies = posed, dict[int, GradedOutline]()
        self._last, self._level, self._apart = list[Solution](), self.levels[0], Difference()
        self._edges: dict[str, list[Edge]] = {}
        self._apart_of = dict[str, list[float]]()
        self._idle, self._settled = set[tuple[int, str]](), dict[int, Level]()
        self._sides = {side.name: (side.body, side.part) for side in posed.interfaces}
        outlines = [as_outline(boundary, "--adapt").joined for boundary in posed.boundaries]
        self._pressed = pressed_sides(outlines, posed.interfaces)
        self._places = fading_places(posed)

    @property
    def levels(self) -> tuple[Level, ...]:
        """The levels of `CONTACT_LADDER` that the wanted accuracy needs."""
        return CONTACT_LADDER.reaching(self.wanted)

    def refine(self, number: int, posed: Body, boundary: Boundary, level: Level) -> LevelMesh:
        """Return a mesh graded to corners, to the user's points and to edges on secondary parts."""
        if number not in self._bodies:
            body = GradedOutline.from_body(posed, as_outline(boundary, "--adapt").joined)
            body = with_pressing_corners(body, self._pressed[number])
            self._bodies[number] = with_later_data(body, posed)
        body, level = self._bodies[number], self._settled.get(number, level)
        edges_on: dict[str, list[Edge]] = {}  # a part may be in several contacts
        for name, (b, part) in self._sides.items():
            if b == number:
                edges_on[part] = [*edges_on.get(part, []), *self._edges.get(name, [])]
        largest, inner = list[float](), dict[int, list[tuple[float, float]]]()
        for k, (side, start) in enumerate(
            zip(body.outline.sides, body.outline.offsets, strict=True)
        ):
            edges = [replace(e, s=e.s - start) for e in edges_on.get(side.part, [])]
            largest.append(self._largest(number, k, edges))
            pressing = self._pressing_sizes(number, k, edges, level)
            if not edges and (number, side.part) not in self._idle:
                pressing |= body.touching_beside(k, pressing)
            if graded := self._graded(pressing, edges, level, body, side.length):
                inner[k] = graded
        return body.mesh(level, largest, None, inner)

    def _largest(self, number: int, k: int, edges: list[Edge]) -> float:
        """Return the largest length of elements on a side [length]."""
        body = self._bodies[number]
        side = body.outline.sides[k]
        if (number, side.part) not in self._sides.values():
            return np.inf
        if not self._last:
            points = body.meets_at_points(k, limit_of("far apart"))
            return np.inf if points else side.whole / UNSEEN
        return np.inf if edges or (number, side.part) in self._idle else SMOOTH * body.scale

    def _graded(
        self,
        pressing: dict[float, float],
        edges: list[Edge],
        level: Level,
        body: GradedOutline,
        length: float,
    ) -> list[tuple[float, float]]:
        """Return the points inside a side to which its mesh is graded, and the smallest elements
        there.

        They are pressing corners and rough points of the gap, with the sizes that are given, and
        edges that do not coincide with these or with an end of the side.
        """
        corners, finest = list[tuple[float, float]](), FINEST * body.scale
        for s, size in sorted(pressing.items()):
            # points of two contacts may differ by round-off only
            if not corners or s - corners[-1][0] > size:
                corners.append((s, max(size, finest)))
        fixed = [Edge(s, np.inf) for s, _ in corners]
        sizes = [
            (edge.s, max(level.edge * edge.width, finest))
            for edge in edges
            if is_apart(edge, fixed, level.edge, finest)
        ]
        return sorted([*corners, *((s, size) for s, size in sizes if size < s < length - size)])

    def _pressing_sizes(
        self, number: int, k: int, edges: list[Edge], level: Level
    ) -> dict[float, float]:
        """Return the element sizes at pressing corners, kinks and jumps of the gap inside a side
        [length].

        They are no larger than at an edge of a contact that reaches as near to the point as such
        elements do, and at most `FINER` times those on the last mesh.
        """
        body, pressed, result = self._bodies[number], self._pressed[number], dict[float, float]()
        size = body.corner_size(PUNCH, level.resolved)
        for s in (*pressed.inner.get(k, []), *pressed.kinks.get(k, [])):
            widths = [e.width for e in edges if abs(e.s - s) <= 2.0 * e.width + size]
            result[s] = min([size, *(level.edge * width for width in widths)])
            if self._last:
                mesh = as_curve(list(self._last[-1].meshes.values())[number])
                on_part = mesh.part == mesh.part_names.index(body.outline.sides[k].part)
                begins = np.abs(mesh.side_start[on_part] - body.outline.offsets[k] - s)
                last = float(mesh.length[on_part][begins.argmin()])
                result[s] = min(result[s], FINER * last)
        return result

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return a start with the zones of the last solution, or None."""
        seen = self._last and problem.discrete.sides
        return warm_start(self._last[-1], problem.discrete) if seen else None

    def mark(self, solution: Solution, level: Level) -> None:
        """Store the edges of a solution, to which the next mesh is graded."""
        if self._last:
            self._apart = difference(self._last[-1], solution, self._places)
            self.differences.append(self._apart.inside)
        self._last, self._level = [solution], level
        self._bodies = {
            number: body.after(as_curve(mesh))
            for (number, body), mesh in zip(
                sorted(self._bodies.items()), solution.meshes.values(), strict=True
            )
        }
        self._edges = self._edges_of(solution)
        self._idle = set(self._sides.values()) - {
            self._sides[name]
            for step in solution.steps
            for name, pair in step.pairs.items()
            if pair.size.max(initial=0.0) > unloaded(self._posed)
        }
        if self.differences:
            self._settle(level)

    def _settle(self, level: Level) -> None:
        """Keep the level of bodies whose contacts are all as accurate as is wanted."""
        bodies = {side.name: set(side.bodies) for side in self._posed.interfaces}
        for name, both in bodies.items():
            if both - self._settled.keys():  # else its mesh is the one before
                self._apart_of.setdefault(name, []).append(self._apart.each[name])
        errors = self._errors()
        left = {b for name, both in bodies.items() if errors[name] > self.wanted for b in both}
        every = set[int]().union(*bodies.values())
        self._settled = {b: self._settled.get(b, level) for b in every - left}

    def _errors(self) -> dict[str, float]:
        """Return the error of each contact by `believed`, 0 of one that carries nothing."""
        return {
            name: 0.0 if self._sides[name] in self._idle else believed(differences)
            for name, differences in self._apart_of.items()
        }

    def mark_failed(self, solution: Solution) -> bool:
        """Store the edges of the contact in a rejected solution that overlaps beside it; return
        whether there are any."""
        failed = solution.failed
        if failed is None or "overlap between nodes" not in wants_smaller_elements(failed.findings):
            return super().mark_failed(solution)
        self._edges, self._idle = self._edges_of(replace(solution, steps=solution.tried)), set()
        self._settled.clear()
        return any(self._edges.values())

    def _edges_of(self, solution: Solution) -> dict[str, list[Edge]]:
        finest = {
            name: FINEST * self._bodies[body].scale for name, (body, _) in self._sides.items()
        }
        return edges_of_steps(solution, self._level.edge, finest, self._narrow)

    def _narrow(
        self, solution: Solution, name: str, pair: PairResult, seen: list[Edge]
    ) -> list[Edge]:
        """Return the edges of a pair, those of the first mesh by what narrow contacts carry."""
        if self.differences:
            return seen
        side = next(side for side in self._posed.interfaces if side.name == name)
        mesh, order = solution.meshes[solution.sides[name][0]], np.argsort(pair.arc_length)
        load = pair.pressure * mesh.measure[solution.nodes[name]]
        contact = NarrowContact(
            functools.partial(self._bodies[side.body].gap, side.part), self._posed.softness(side)
        )
        closed = (pair.state != OPEN)[order]
        return contact.edges(seen, pair.arc_length[order], load[order], closed)

    @property
    def estimate(self) -> float:
        """Estimated error of the last mesh, the largest of all contacts: the last difference, which
        is the error of the mesh before; of one difference alone twice that, see `CONTACT_LADDER`
        [-]."""
        if not CONTACT_LADDER.believes(self.differences, self.wanted):
            return max(self._errors().values(), default=believed(self.differences))
        return max(2.0 * self.differences[0], self._level.error)

    def shown(self) -> dict[str, Any]:
        """Return fields of `Accuracy`: edges of contact and stick, and the errors at ends of
        parts."""
        edges = {name: [edge.s for edge in items] for name, items in self._edges.items()}
        ends = {"with_ends": self._apart.whole, "singular": self._apart.singular}
        return {"edges": edges, **(ends if self.differences else {})}


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
    moved: Callable[[Solution, str, PairResult, list[Edge]], list[Edge]],
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
            edges[id(step) in last] += moved(solution, name, step.pairs[name], seen)
        ends = merged(edges[True], FOUND * smallest, (), finest[name])
        between = sorted(edges[False], key=lambda edge: edge.s)
        result[name] = merged(between[:: 1 + len(between) // MANY], smallest, ends, finest[name])
    return result


def warm_start(before: Solution, discrete: Discrete) -> Start:
    """Return v and σ of size 1 on another mesh.

    Their sets are the zones of a solution after its first increment.
    """
    parts = []
    first = before.steps[0]
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = first.pairs[side.name]
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
