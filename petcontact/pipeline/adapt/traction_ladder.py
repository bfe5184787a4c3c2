"""Pressure and shear of any contact, followed from mesh to mesh: what an adaptive solve refines
for, and its error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...contact.friction_law import main_direction, signed
from ...contact.law_protocol import OPEN, SLIP
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...geometry.surface import Boundary
from ...mesh.curve_mesh import as_curve
from ...model.loads import NO_LOADS, loads_by_step
from ...model.problem import Problem
from ...refinement.contact_edges import Edge, merged, zone_at
from ...refinement.known_data import Field, fields
from ...refinement.levels import CONTACT_LADDER, Level, believed
from ...refinement.marks import UNSEEN, Body, LevelMesh
from ...results.contact_zones import pair_edges
from ...results.records import step_ends
from ...results.solution import Solution
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..pose.discretise import Discrete
from ..steps.increment import PreparedProblem
from .difference import Difference, difference, fading_places
from .part_ends import PressedSides, pressed_sides
from .slip_ladder import DENSE_NODES

ATTEMPTS = 3
"""How often one level is tried while a contact is seen by few nodes only."""
FEW = 8
"""Closed nodes of a contact below which its edges are looked for once more on the same level."""
PUNCH = 0.5
"""Exponent of displacements where a corner presses on a side: of a rigid, frictionless one on a
half-plane."""
APART = 3.0
"""Distance of an edge from such a corner, in its smallest elements, below which it is that
corner."""
MANY = 12
"""Edges on a contact that increments before the end of a step leave, of more of them only some are
graded to: kinks that follow one another closely are weak."""
FINEST = 1e-6
"""Smallest elements at edges, of the thickness of the body: the round-off of displacements over
their size is one of p."""
OUTSIDE = 1e6
"""Shear, in units of the pressure, that no coefficient of friction holds."""


class Tractions:
    """p and q, and the edges of contact and of stick.

    Attributes
    ----------
    levels : tuple of Level
        Meshes to climb.
    accuracy : float
        That is wanted by default [-].
    differences : list of float
        Relative differences of p and q between neighbouring meshes.
    """

    accuracy, dense_nodes, exhausted = 1e-2, DENSE_NODES, ""

    def __init__(self, problem: Problem) -> None:
        self.differences: list[float] = []
        self.wanted, self.asked = self.accuracy, True
        self._problem, self._bodies = problem, dict[int, Body]()
        self._last, self._level, self._apart = list[Solution](), self.levels[0], Difference()
        self._edges: dict[str, list[Edge]] = {}
        self._attempt = 0
        self._sides = {side.name: (side.body, side.part) for side in problem.interfaces}
        outlines = [as_outline(boundary, "--adapt").joined for boundary in problem.boundaries]
        self._pressed = pressed_sides(outlines, problem.interfaces)
        self._places = fading_places(problem)

    @property
    def levels(self) -> tuple[Level, ...]:
        """Those of `CONTACT_LADDER` that the wanted accuracy needs."""
        return CONTACT_LADDER.to(self.wanted)

    def refine(
        self, number: int, one: Callable[[], Problem], boundary: Boundary, level: Level
    ) -> LevelMesh:
        """Graded to corners, to points that the user gave, and to the edges on secondary parts."""
        if number not in self._bodies:
            posed = one()
            body = Body.of(posed, as_outline(boundary, "--adapt").joined)
            body = with_pressing_corners(body, self._pressed[number])
            self._bodies[number] = with_later_data(body, self._problem, number, posed)
        body, pressed = self._bodies[number], self._pressed[number]
        found: dict[str, list[Edge]] = {}  # of one part in several contacts those of all
        for name, (b, part) in self._sides.items():
            if b == number:
                found[part] = [*found.get(part, []), *self._edges.get(name, [])]
        largest, inner = list[float](), dict[int, list[tuple[float, float]]]()
        for k, (side, start) in enumerate(
            zip(body.outline.sides, body.outline.offsets, strict=True)
        ):
            unseen = side.part in found and not self._last
            largest.append(side.length / UNSEEN if unseen else np.inf)
            edges = [(e.s - start, e.width) for e in found.get(side.part, [])]
            pressing = *pressed.inner.get(k, []), *pressed.kinks.get(k, [])
            if graded := self._graded(pressing, edges, level, body, side.length):
                inner[k] = graded
        return body.mesh(level, largest, None, inner)

    def _graded(
        self,
        pressing: Sequence[float],
        edges: list[tuple[float, float]],
        level: Level,
        body: Body,
        length: float,
    ) -> list[tuple[float, float]]:
        """Places inside a side that meshes are graded to, with the smallest elements there: where
        corners press or the gap is rough, and edges that are not one with these or with an end."""
        corners = list[tuple[float, float]]()
        for s in sorted(
            pressing
        ):  # two contacts of a part may jump at one place, but for round-off
            size = self._size_at(s, edges, level, body)
            if not corners or s - corners[-1][0] > size:
                corners.append((s, size))
        inside = [(s, max(level.edge * width, FINEST * body.scale)) for s, width in edges]
        inside = [
            (s, size)
            for s, size in inside
            if size < s < length - size
            and all(abs(s - corner) > APART * size for corner, _ in corners)
        ]
        return sorted([*corners, *inside])

    @staticmethod
    def _size_at(s: float, edges: list[tuple[float, float]], level: Level, body: Body) -> float:
        """Of the elements at a corner that presses, or a kink or jump of the gap: no larger than at
        an edge of the contact that it lies in [length]."""
        widths = [width for at, width in edges if abs(at - s) <= 2.0 * width + body.closest]
        size = body.corner_size(PUNCH, level.resolved)
        return max(min([size, *(level.edge * width for width in widths)]), FINEST * body.scale)

    def start(self, problem: PreparedProblem) -> Start | None:
        """Zones of the last solution."""
        return warm_start(self._last[-1], problem.discrete) if self._last else None

    def mark(self, solution: Solution, level: Level) -> bool:
        """Keep the edges that a solution shows, to which the next mesh is graded.

        A contact that few nodes see is looked at again on the same level, `ATTEMPTS` times in all;
        these solutions are not compared.
        """
        if self._last and not _few(self._last[-1]):
            self._apart = difference(self._last[-1], solution, self._places)
            self.differences.append(self._apart.inside)
        self._attempt = self._attempt + 1 if level is self._level and self._last else 1
        self._last, self._level = [solution], level
        finest = {
            name: FINEST * self._bodies[body].scale for name, (body, _) in self._sides.items()
        }
        self._edges = found_edges(solution, level.edge, finest)
        return _few(solution) and self._attempt < ATTEMPTS

    def mark_failed(self, solution: Solution) -> bool:
        """Whether a solution that is not accepted asks for another mesh."""
        failed = solution.failed
        return failed is not None and bool(wants_smaller_elements(failed.findings) & WHOLE_MESH)

    @property
    def estimate(self) -> float:
        """Of the error of the last mesh: the last difference, which is the error of the mesh
        before."""
        alone = CONTACT_LADDER.believes(self.differences, self.wanted)
        return max(self.differences[0], self._level.error) if alone else believed(self.differences)

    def shown(self) -> dict[str, Any]:
        """Fields of `Accuracy`: the edges of contact and stick, and what the ends of parts add."""
        edges = {name: [edge.s for edge in items] for name, items in self._edges.items()}
        ends = {"with_ends": self._apart.whole, "singular": self._apart.singular}
        return {"edges": edges, **(ends if self.differences else {})}


def with_pressing_corners(body: Body, pressed: PressedSides) -> Body:
    """A body whose corners that press on another one are at least as singular as a punch."""
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
    return replace(body, exponents=exponents, singular=singular)


def with_later_data(body: Body, problem: Problem, number: int, one: Problem) -> Body:
    """A body whose data are those of all steps; `one` is it as a problem of its own."""
    steps = problem.conditions(number)
    for condition in {
        id(c): c for step in steps for c in step.values() if c not in one.boundary
    }.values():
        rest = tuple(other for other in one.boundary if other.part != condition.part)
        later = fields(one.model_copy(update={"boundary": (*rest, condition)}), body.outline)
        here = [side.part == condition.part for side in body.outline.sides]
        body = _with_data(
            body, [more if mine else [] for more, mine in zip(later, here, strict=True)]
        )
    for loads in set(loads_by_step(problem, number)) - {one.loads or NO_LOADS}:
        body = _with_data(
            body,
            fields(
                one.model_copy(
                    update={
                        "body": (one.body[0].model_copy(update={"loads": loads, "boundary": ()}),)
                    }
                ),
                body.outline,
            ),
        )
    return body


def _with_data(body: Body, data: list[list[Field]]) -> Body:
    return replace(body, data=[[*row, *more] for row, more in zip(body.data, data, strict=True)])


def found_edges(
    solution: Solution, smallest: float, finest: dict[str, float]
) -> dict[str, list[Edge]]:
    """Edges on every interface at the ends of all steps, those that are one merged, and those of
    the increments before elsewhere: what they leave in q has a kink there."""
    last = {id(step) for step in step_ends(solution.steps)}
    result: dict[str, list[Edge]] = {}
    for name in solution.nodes:
        found = {True: list[Edge](), False: list[Edge]()}
        for step in solution.steps:
            found[id(step) in last] += pair_edges(step.pairs[name], smallest, finest[name])
        ends = merged(found[True], smallest, (), finest[name])
        between = sorted(found[False], key=lambda edge: edge.s)
        result[name] = merged(between[:: 1 + len(between) // MANY], smallest, ends, finest[name])
    return result


def _few(solution: Solution) -> bool:
    """Whether a contact is seen by so few nodes that its edges are guesses."""
    pairs = [step.pairs.values() for step in step_ends(solution.steps)]
    closed = [
        np.count_nonzero(pair.state != 2)
        for step in pairs
        for pair in step
        if np.any(pair.state == 2)
    ]
    return any(0 < count < FEW for count in closed)


def warm_start(before: Solution, discrete: Discrete) -> Start:
    """v and σ on another mesh whose sets are the zones that a solution had after its first
    increment; of size one."""
    parts = []
    first = before.steps[0]
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = first.pairs[side.name]
        along = main_direction(pair.sigma_t)
        way = np.where(pair.state == SLIP, -np.sign(signed(pair.sigma_t, along)), 0.0)
        s = as_curve(discrete.meshes[side.body]).arc_length[interface.nodes]
        own, state = pair_edges(pair), pair.state.astype(np.int64)
        state, way = (
            zone_at(pair.arc_length, values, own, s) for values in (state, way.astype(np.int64))
        )
        slip = np.outer(np.where(state == SLIP, np.where(way == 0, 1, way), 0), along)
        columns = (
            ([slip], [-slip * OUTSIDE])
            if interface.held
            else ([slip, -1.0 * (state == OPEN)], [-slip * OUTSIDE, -1.0 * (state != OPEN)])
        )
        parts.append(tuple(np.column_stack(values) for values in columns))
    v, sigma = (np.concatenate(values).astype(np.float64) for values in zip(*parts, strict=True))
    return v, sigma
