"""Where the stress of a body has no bound: corners and edges, by the conditions beside them.

Displacements behave like r^λ there, and stresses like r^(λ-1). The exponent λ follows from the
angle, and from what the two sides do: they are free, held, slide, or touch another body (see
`refinement.corner_exponents`). A contact counts as what it does in the solution: what is open is
free, what slips slides. A corner that presses on the smooth side of another body makes the stress
of that body unbounded, too.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...arrays import Array, Index, Mask
from ...contact.law_protocol import OPEN
from ...fields.boundary.places import located, meeting, sizes
from ...geometry.rotation import lifted
from ...given.conditions import Condition, Displacement, Periodic
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.corner_exponents import CLAMPED, FREE, SLIDING, SideKind
from ...refinement.corner_modes import (
    Expansion,
    corner_expansion,
    joint_expansions,
    shear_expansion,
)
from ...refinement.panels.edges import SMOOTH, TOGETHER
from ...refinement.singular_points import kinds_seen
from ...round_off import SINGLE
from ..evaluated import NOWHERE, Evaluated
from ..records import StepResult
from .corners import Corners, corners_of
from .opposite import opposite
from .place import SHARE, Place
from .touching import (
    MISMATCH,
    MOST,
    Does,
    Partner,
    Touching,
    core_of,
    facing_nodes,
    felt,
    firmness,
    goes_on,
    growing,
    growing_at_ends,
    kind_of,
    mismatch,
    nearest,
    nodes_beside,
    partner_of,
    pressed_at,
    touched,
)


def singular_places(solution: Evaluated, step: StepResult) -> dict[str, list[Place]]:
    """Return the places of each body after an increment."""
    return all_places(solution, step)[0]


def all_places(solution: Evaluated, step: StepResult) -> tuple[dict[str, list[Place]], ...]:
    """The places of each body, and those where stress is told as a value, looked for once."""
    return solution.at_end("singular", step, lambda: _places(solution, step))


def _places(solution: Evaluated, step: StepResult) -> tuple[dict[str, list[Place]], ...]:
    """The places of each body, and those where stress is told as a value."""
    bodies = dict[str, _Body]()
    bodies |= {name: _Body(solution, name, step, bodies) for name in solution.meshes}
    places = {name: list[Place]() for name in bodies}, {name: list[Place]() for name in bodies}
    for body in bodies.values():
        found = (body.at_corners(), body.at_edges_of_gaps(), body.at_forces())
        for place in itertools.chain(*found):
            places[place.weak][place.body].append(place)
    return places


class _Body:
    """A body after an increment: its corners, and what its elements touch."""

    def __init__(
        self, solution: Evaluated, name: str, step: StepResult, bodies: Mapping[str, _Body]
    ) -> None:
        self._solution, self._step, self._name, self._bodies = solution, step, name, bodies
        self.mesh: BoundaryMesh = solution.meshes[name]
        self._body = solution.posed.bodies[list(solution.meshes).index(name)]
        self._conditions: Mapping[str, Condition] = self._body.conditions[step.step - 1]
        self.kappa = 3.0 - 4.0 * self._body.material.plane_strain_ratio
        self._corners: Corners = self.mesh.once("corners", lambda: corners_of(self.mesh))
        self._whole = float(np.ptp(self.mesh.x, axis=0).max())
        # the `mismatch` that counts beside contact
        self._felt = felt(self.mesh, step.bodies[name].traction, solution.accuracy.error)
        self._pair = np.full(self.mesh.n_nodes, -1)
        self._row = np.zeros(self.mesh.n_nodes, dtype=np.int64)
        self._partners = list[Partner]()
        moduli = {body.name: body.material.shear_modulus for body in solution.posed.bodies}
        for posed in solution.posed.interfaces:
            if (pair := step.pairs.get(posed.name)) is None or posed.periodic:
                continue
            secondary, faced = solution.sides[posed.name]
            partner, part = solution.primaries.get(posed.name, NOWHERE)
            if secondary == name:
                nodes, rows, faced = solution.nodes[posed.name], np.arange(len(pair.x)), part
            elif partner == name:
                nodes, partner = self.mesh.nodes_of(part), secondary
                other = solution.meshes[secondary]
                own = other.element[solution.nodes[posed.name]]
                nodes, rows = facing_nodes(pair, sizes(other)[own], nodes, self.mesh.x[nodes])
            else:
                continue
            self._pair[nodes], self._row[nodes] = len(self._partners), rows
            stiffer = moduli[partner] / moduli[name] if partner in moduli else math.inf
            body = partner if partner in moduli else ""
            self._partners.append(partner_of(posed.law, pair, body, faced, stiffer))

    @functools.cached_property
    def _edges(self) -> list[tuple[Array, str]]:
        """Points (k, d) of each edge that may press on the body, as a jump of a gap shows it, and
        what it is called."""
        solution = self._solution
        return [
            (points, f"{side.part}, under edge {number} of the gap")
            for side in solution.posed.interfaces
            if side.law.normal == "unilateral" and solution.sides[side.name][0] == self._name
            for number, points in enumerate(solution.gap_edges[side.name], 1)
        ]

    def _size(self, x: Array, corner: int | None = None, stretch: Array | None = None) -> float:
        """The size of the feature at a point, or at a corner by its number [length].

        Of a stretch (2, d) of an edge of the other body its length counts, not its points."""
        corners = self._corners
        # of a body of revolution the ring goes on beyond the axis
        others = np.vstack([*self.mesh.images(x[None]), *(points for points, _ in self._edges)])
        away = [np.linalg.norm(others - x, axis=1)]
        if stretch is not None:
            length = float(np.linalg.norm(stretch[1] - stretch[0]))
            way = (stretch[1] - stretch[0]) / (length or 1.0)
            off = others - x - np.outer((others - x) @ way, way)
            away = [away[0] * (np.linalg.norm(off, axis=1) > SINGLE * self._whole), [length]]
        if corner is None:
            away.append(np.linalg.norm(corners.x - x, axis=1))
        else:
            away.append(np.array([corners.nearest[corner], corners.radius[corner]]))
        every = np.concatenate(away)
        return float(every[every > SINGLE * self._whole].min(initial=self._whole))

    @functools.cached_property
    def _sizes(self) -> list[float]:
        """The size of the feature at each corner [length]."""
        return [self._size(x, number) for number, x in enumerate(self._corners.x)]

    def at_forces(self) -> Iterator[Place]:
        """Yield the place of each force that acts at a point."""
        axes = np.eye(self.mesh.dim)
        for each in self._body.forces[self._step.step - 1]:
            if np.any(each.force):
                x = np.array(each.at)
                size = self._size(x)
                ends = np.array([x, x])
                yield Place(
                    self._name, ends, (), "a point force", size, axes[0], axes[1], 2.0 * math.pi
                )

    def at_edges_of_gaps(self) -> Iterator[Place]:
        """Yield a place for each element in contact beside which an edge of the other body
        presses."""
        closed, (centre, radius) = np.flatnonzero(self._is_closed()), self.mesh.spheres
        own = np.unique(self.mesh.element[closed])
        for points, where in self._edges:
            for piece in pressed_at(points, centre[own], radius[own]):
                place = self._pressed(*piece, where, closed)
                if place is not None:
                    yield place

    def _pressed(self, ends: Array, stretch: Array, where: str, closed: Index) -> Place | None:
        """The place at a piece of an edge of the other body, or None where no node is closed."""
        mesh, x = self.mesh, ends.mean(axis=0)
        radius = mesh.spheres[1]
        elements = meeting(mesh, x, float(radius.min()))[1]
        # a jump may lie inside the next element
        near = 2.0 * float(radius[elements].max())
        nodes = closed[np.linalg.norm(mesh.x[closed] - x, axis=1) < near]
        if not len(nodes):
            return None
        inward = -mesh.normal[nodes[0]]
        ways = mesh.x[nodes] - x
        ways -= np.outer(ways @ inward, inward)
        along = np.mean(ways / np.linalg.norm(ways, axis=1)[:, None], axis=0)
        size, does = float(np.linalg.norm(along)), self._touched(nodes, along, inward)
        # where both sides press, as under an apex, stress grows like a logarithm
        one = size > MOST and does is not None
        kinds = (does.kind if isinstance(does, Touching) else CLAMPED, FREE)
        return Place(
            self._name,
            ends,
            tuple(elements.tolist()),
            where,
            self._size(x, stretch=stretch),
            along / max(size, SINGLE),
            inward,
            math.pi,
            (corner_expansion(math.pi, self.kappa, *kinds, True),) if one else (),
            True,
            core_of(x, (does,)),
        )

    def at_corners(self) -> Iterator[Place]:
        """Yield its corners that have no bound, and what they press on smooth sides of others."""
        corners = self._corners
        for number in range(len(corners.x)):
            angle, x = round(float(corners.angle[number]), 6), corners.x[number]
            if not angle > 0.0:  # elements of an altered file may lie on one another
                continue
            first, does = self._sides(number)
            does, (own, under) = growing_at_ends(does, functools.partial(self._expansion, angle, x))
            if own is None:
                continue
            found = [own, *self._across(number, angle, first, does)]
            data = self._step.bodies[self._name], self._body.material
            differ = mismatch(self.mesh, *data, corners, number, (first, 1 - first), does)
            beside = self._pair[self.mesh.first_node[corners.element[number]]] >= 0
            least = self._felt if beside.any() else SINGLE
            expansions = growing(found, differ, least)
            if expansions or differ[0] > MISMATCH:
                yield Place(
                    self._name,
                    corners.ends[number],
                    tuple(corners.element[number].tolist()),
                    " and ".join(dict.fromkeys(map(self._part_of, corners.element[number]))),
                    self._sizes[number],
                    corners.along[number, first],
                    corners.inward[number, first],
                    angle,
                    expansions,
                    isinstance(does[0], Touching) and not does[0].partner.bonded,
                    core_of(x, does),
                    differ[1] > least,
                )
            if under is not None and own.least < 1.0:
                # a part may end where the side goes on
                what = "the end of a part" if abs(angle - math.pi) < SMOOTH else "a corner"
                yield replace(under, sides=f"under {what} of {self._name}")

    def _part_of(self, element: int) -> str:
        """The name of the part of an element."""
        return str(self.mesh.part_names[self.mesh.part[element]])

    def _sides(self, number: int) -> tuple[int, tuple[Does, Does]]:
        """Which side of a corner is θ = 0, that which is held more, and what both do, first it."""
        frames = list(zip(self._corners.along[number], self._corners.inward[number], strict=True))
        does = [self._does(number, k, *frame) for k, frame in enumerate(frames)]
        first = int(firmness(does[1]) > firmness(does[0]))
        along, inward = frames[1 - first]
        # at the other side θ grows out of the body
        return first, (does[first], self._does(number, 1 - first, along, -inward))

    def _does(self, number: int, side: int, along: Array, across: Array) -> Does:
        """What a side of a corner does, by its nodes beside it."""
        corners, mesh = self._corners, self.mesh
        ends, element = corners.ends[number], corners.element[number, side]
        part, reach = self._part_of(element), SHARE * self._sizes[number]
        nodes = mesh.once(
            ("beside", number, side, reach), lambda: nodes_beside(mesh, ends, part, element, reach)
        )
        own = self._touched(nodes[mesh.element[nodes] == element], along, across)
        touched = nearest(own, self._touched(nodes, along, across))
        if isinstance(touched, Touching) and not self._reaches(number, touched):
            return FREE
        if touched is not None:
            return touched
        condition = self._conditions.get(part)
        # what is periodic goes on in the next cell
        periodic = isinstance(condition, Periodic)
        return SLIDING if periodic else kinds_seen(condition, along, across)[0]

    def _reaches(self, number: int, closed: Touching) -> bool:
        """Whether the part that a side of a corner touches reaches the corner."""
        to, ends = closed.partner, self._corners.ends[number]
        slack = max(TOGETHER * float(np.linalg.norm(ends[1] - ends[0])), SINGLE * self._whole)
        x = self._corners.x[number]
        return not to.body or opposite(self._bodies[to.body].mesh, x, closed).off <= slack

    def _is_closed(self) -> Mask:
        """Which nodes are in contact that is closed."""
        closed = np.zeros(self.mesh.n_nodes, dtype=bool)
        for k, partner in enumerate(self._partners):
            own = self._pair == k
            closed[own] = partner.pair.state[self._row[own]] != OPEN
        return closed

    def _touched(self, nodes: Index, along: Array, across: Array) -> Does | None:
        """What some nodes of a side do by what most of them do; None off the contact."""
        nodes = nodes[self._pair[nodes] >= 0]
        if not len(nodes):
            return None
        number = int(self._pair[nodes[0]])
        nodes = nodes[self._pair[nodes] == number]
        traction = self._step.bodies[self._name].traction
        frame = np.stack([along, across])
        return touched(self.mesh, traction, self._partners[number], nodes, self._row[nodes], frame)

    def _expansion(
        self, angle: float, x: Array, does: tuple[Does, Does]
    ) -> tuple[Expansion | None, Place | None]:
        """How stress in the plane grows towards a corner, if it is one of the whole body; where it
        presses on the smooth side of another body, the place there."""
        first, second = does
        if not isinstance(first, Touching):
            return corner_expansion(angle, self.kappa, *does), None
        to, pressed = first.partner, not first.partner.bonded
        alone = (
            None
            if goes_on(angle, does)
            else corner_expansion(angle, self.kappa, first.kind, kind_of(second), pressed)
        )
        if not to.body or isinstance(second, Touching):
            return alone, None
        other = self._bodies[to.body]
        other_angle, beside, place = other.facing(x, first)
        if FREE not in (second, beside):
            return alone, None
        angles, kappas = (angle, other_angle), (self.kappa, other.kappa)
        own, under = joint_expansions(
            angles, kappas, to.stiffer, first.friction, (second, beside), pressed
        )
        return own, place and replace(place, expansions=(under,))

    def _across(
        self, number: int, angle: float, first: int, does: tuple[Does, Does]
    ) -> Iterator[Expansion]:
        """How displacements across the plane grow towards a corner, where there are any."""
        mesh, corners = self.mesh, self._corners
        if mesh.components == 2:
            return
        held = list[bool]()
        for side, what in zip((first, 1 - first), does, strict=True):
            element = corners.element[number, side]
            condition = self._conditions.get(self._part_of(element))
            if isinstance(condition, Displacement) and not isinstance(what, Touching):
                frame = np.stack([corners.along[number, side], corners.inward[number, side]])
                edge = np.cross(*lifted(frame, 3))
                axes = ~np.array(condition.free)
                held.append(bool(np.abs(edge[: len(axes)][axes]).max(initial=0.0) > SINGLE))
            else:
                held.append(kind_of(what) == CLAMPED)
        yield shear_expansion(angle, *held)

    def facing(self, x: Array, closed: Touching) -> tuple[float, SideKind, Place | None]:
        """The angle of the corner that a point of the other body faces and what its side off the
        contact does; where there is none those of a smooth free side, and the place on it that the
        point faces."""
        corners, at = self._corners, opposite(self.mesh, x, closed)
        number = corners.meeting(at.foot, at.elements)
        if number is not None:
            side = 1 - self._sides(number)[0]
            frame = corners.along[number, side], corners.inward[number, side]
            return float(corners.angle[number]), kind_of(self._does(number, side, *frame)), None
        return math.pi, FREE, self._smooth_place(at.foot, at.elements, closed)

    def _smooth_place(self, x: Array, elements: Index, closed: Touching) -> Place:
        """The place on smooth elements that an edge of the other body presses."""
        # sides that touch may be turned by as much as gaps are wide
        inward = -self.mesh.at(*located(self.mesh, x[None], within=sizes(self.mesh)))[1][0]
        along = closed.along - (closed.along @ inward) * inward
        return Place(
            self._name,
            np.array([x, x]),
            tuple(elements.tolist()),
            "",
            self._size(x),
            along / np.linalg.norm(along),
            inward,
            pressed=not closed.partner.bonded,
            core=core_of(x, (closed,)),
        )
