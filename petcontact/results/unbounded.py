"""Where the stress of a solution has no bound: corners and edges, by the conditions beside them.

Displacements behave like r^λ there, and stresses like r^(λ-1). The exponent λ follows from the
angle, and from what the two sides do: they are free, held, slide, or touch another body (Williams
1952, Bogy 1971, see `refinement.corner_exponents`). A contact counts as what it does in the
solution: what is open is free, what slips slides. A corner that presses on the smooth side of
another body makes the stress of that body unbounded, too.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from ..arrays import Array, Index, Mask
from ..contact.law_protocol import OPEN, SLIP
from ..fields.boundary.places import meeting, sizes
from ..mesh.boundary_mesh import BoundaryMesh
from ..refinement.corner_exponents import (
    CLAMPED,
    FREE,
    SLIDING,
    SideKind,
    corner_exponent,
    pair_exponent,
)
from ..refinement.panels.edges import SMOOTH
from ..refinement.singular_points import kinds_seen, torsion_exponent
from ..round_off import SINGLE
from .corners import corners_of
from .evaluated import Evaluated
from .records import PairResult, StepResult

NEAR = 0.05
"""Distance from a place without a bound, over the largest side of the box about the body, up to
which stress is left out. It is a definition: stress falls from there without an end. Another corner
that is a point is nearer to what lies beyond the middle between the two."""


@dataclass(frozen=True)
class Unbounded:
    """Where the stress of a body has no bound.

    Attributes
    ----------
    ends : (2, d) array
        Of an edge; a point is both its ends [length].
    elements : tuple of int
        Elements of the body that meet there; none where a force acts inside.
    sides : str
        The parts that meet there, or what presses there.
    reach : float
        Distance from it up to which stress is left out [length].
    """

    ends: Array
    elements: tuple[int, ...]
    sides: str
    reach: float

    @property
    def x(self) -> Array:
        """The middle (d,) [length]."""
        return np.asarray(self.ends.mean(axis=0))

    def nearest_to(self, x: Array) -> Array:
        """The nearest points of the edge to points (n, d), (n, d) [length]."""
        start, along = self.ends[0], self.ends[1] - self.ends[0]
        share = (x - start) @ along / max(float(along @ along), np.finfo(float).tiny)
        return np.asarray(start + np.clip(share, 0.0, 1.0)[:, None] * along)

    def away(self, x: Array) -> Array:
        """The distances of points (n, d) from the edge, (n,) [length]."""
        return np.asarray(np.linalg.norm(x - self.nearest_to(x), axis=1))

    def leaves_out(self, x: Array) -> Mask:
        """Which points (n, d) are nearer than its reach."""
        return np.asarray(self.away(x) < self.reach)


def unbounded_places(solution: Evaluated, step: StepResult) -> dict[str, list[Unbounded]]:
    """Of each body, after an increment."""
    return solution.once("unbounded", step, lambda: _unbounded(solution, step))


def _unbounded(solution: Evaluated, step: StepResult) -> dict[str, list[Unbounded]]:
    places: dict[str, list[Unbounded]] = {name: [] for name in solution.meshes}
    bodies = {name: _Body(solution, name, step) for name in solution.meshes}
    at_corners = (each for body in bodies.values() for each in body.singular(bodies))
    points = (
        (name, Unbounded(np.array([x, x]), elements, sides, bodies[name].reach(x)))
        for points_of in (_point_forces, _pressing)
        for name, x, elements, sides in points_of(solution, step)
    )
    for name, place in itertools.chain(at_corners, points):
        places[name].append(place)
    return places


Point = tuple[str, Array, tuple[int, ...], str]
"""The name of a body, and the place, elements and sides of a point without a bound."""


def _point_forces(solution: Evaluated, step: StepResult) -> Iterator[Point]:
    """Yield the place of each force that acts at a point of a body."""
    for body in solution.posed.bodies:
        for each in body.forces[step.step - 1]:
            if np.any(each.force):
                yield body.name, np.array(each.at), (), "a point force"


def _pressing(solution: Evaluated, step: StepResult) -> Iterator[Point]:
    """Yield each place where an edge of the other body presses, as a jump of the gap shows it."""
    interfaces = solution.posed.interfaces
    for side in (each for each in interfaces if each.law.normal == "unilateral"):
        pair, name = step.pairs[side.name], solution.sides[side.name][0]
        mesh, closed = solution.meshes[name], pair.x[pair.pressure > 0.0]
        edges = enumerate(solution.gap_edges[side.name], 1)
        for number, x in ((number, x) for number, points in edges for x in points):
            elements = meeting(mesh, x, float(sizes(mesh).min()))[1]
            near = 2.0 * sizes(mesh)[elements].max()  # a jump may lie inside the next element
            if (np.linalg.norm(closed - x, axis=1) < near).any():
                where = f"{side.part}, under edge {number} of the gap"
                yield name, x, tuple(elements.tolist()), where


def _exponent(angle: float, kappa: float, first: SideKind, second: SideKind) -> float:
    # elements of an altered file may lie on one another
    if not angle > 0.0 or (first == second == FREE and angle <= math.pi):
        return 1.0
    return corner_exponent(angle, kappa, first, second)


@dataclass(frozen=True)
class _Corner(Unbounded):
    """A corner or an edge, bounded or not, and the angle of the body there [rad]."""

    angle: float


@dataclass(frozen=True)
class _Closed:
    """A side that touches something at a corner.

    Attributes
    ----------
    partner, part : str
        The other body, or empty for what is rigid, and its part.
    kinds : tuple
        What the side is as seen from a rigid partner.
    stiffer : float
        Shear modulus of the partner over that of the body.
    friction : float
        |σ_t| over |p| where it slips, infinite where it sticks.
    normal : (d,) array
        Along which it faces the partner, one way or the other.
    """

    partner: str
    part: str
    kinds: tuple[SideKind, ...]
    stiffer: float
    friction: float
    normal: Array

    def is_singular(
        self,
        angles: tuple[float, float],
        kappas: tuple[float, float],
        beside: tuple[tuple[SideKind, ...], tuple[SideKind, ...]],
    ) -> bool:
        """Whether λ < 1 for a way to slip and something that the other sides may be."""
        ways = {self.friction, -self.friction} if math.isfinite(self.friction) else {math.inf}
        return any(
            pair_exponent(angles, kappas, self.stiffer, *both) < 1.0
            for both in itertools.product(ways, itertools.product(*beside))
        )


Sides = list[_Closed | tuple[SideKind, ...]]
"""What the two sides of a corner do: what each touches, or what it may be."""


def _beside(sides: Sides, mirrored: int) -> tuple[SideKind, ...]:
    """What the side beside the contact may be, free where there is none; that with the number
    `mirrored` is seen in a mirror, in which the contact lies at θ = 0."""
    for number, side in enumerate(sides):
        if not isinstance(side, _Closed):
            turned = (-kind if isinstance(kind, float) else kind for kind in side)
            return tuple(turned) if number == mirrored else side
    return (FREE,)


def _faced(pair: PairResult, size: Array, nodes: Index, x: Array) -> tuple[Index, Index]:
    """The nodes of a primary, at points (n, d), that face the secondary, whose nodes have elements
    of half lengths (m,), and the node of that each; what reaches beyond faces nothing."""
    rows = scipy.spatial.cKDTree(pair.x).query(x)[1]
    away, normal = x - pair.x[rows], pair.normal[rows]
    away -= np.sum(away * normal, axis=1)[:, None] * normal
    faces = np.linalg.norm(away, axis=1) < (1.0 + SINGLE) * size[rows]
    return nodes[faces], rows[faces]


class _Body:
    """A body after an increment: its corners, and what its elements touch."""

    def __init__(self, solution: Evaluated, name: str, step: StepResult) -> None:
        self._mesh: BoundaryMesh = solution.meshes[name]
        body = solution.posed.bodies[list(solution.meshes).index(name)]
        self._conditions = body.conditions[step.step - 1]
        self._name = name
        self.kappa = 3.0 - 4.0 * body.material.plane_strain_ratio
        self._corners = corners_of(self._mesh)
        self._size = float(np.ptp(self._mesh.x, axis=0).max())
        self._pair = np.full(self._mesh.n_nodes, -1)
        self._row = np.zeros(self._mesh.n_nodes, dtype=np.int64)
        self._pairs: list[tuple[PairResult, str, str, float]] = []
        moduli = {body.name: body.material.shear_modulus for body in solution.problem.body}
        for pair_name, pair in step.pairs.items():
            secondary, faced = solution.sides[pair_name]
            partner, _, part = solution.primaries.get(pair_name, "").partition(".")
            if secondary == name:
                nodes, rows, faced = solution.nodes[pair_name], np.arange(len(pair.x)), part
            elif partner == name:
                nodes, partner = self._mesh.nodes_of(part), secondary
                other = solution.meshes[secondary]
                own = other.element[solution.nodes[pair_name]]
                nodes, rows = _faced(pair, sizes(other)[own], nodes, self._mesh.x[nodes])
            else:
                continue
            self._pair[nodes], self._row[nodes] = len(self._pairs), rows
            # ground is rigid
            stiffer = moduli[partner] / moduli[name] if partner in moduli else 1e6
            self._pairs.append((pair, partner if partner in moduli else "", faced, stiffer))

    def singular(self, bodies: Mapping[str, _Body]) -> Iterator[tuple[str, Unbounded]]:
        """Yield its corners that have no bound, and what they press on smooth sides of others."""
        for number in range(len(self._corners.x)):
            corner, sides = self._corner_and_sides(number)
            closed = [side for side in sides if isinstance(side, _Closed)]
            partner = bodies.get(closed[0].partner) if len(closed) == 1 else None
            if self.is_singular(corner, sides, partner):
                yield self._name, corner
                under = partner and partner.facing(corner.x, closed[0])[2]
                if partner and under:
                    x, elements = under
                    # a part may end where the side goes on
                    smooth = abs(corner.angle - math.pi) < SMOOTH
                    what = "the end of a part" if smooth else "a corner"
                    where = f"under {what} of {self._name}", partner.reach(x)
                    yield closed[0].partner, Unbounded(np.stack([x, x]), elements, *where)

    def reach(self, x: Array) -> float:
        """The distance from a place without a bound up to which stress is left out [length]."""
        apart = np.linalg.norm(self._corners.points - x, axis=1)
        nearest_corner = float(apart[apart > SINGLE * self._size].min(initial=np.inf))
        return min(NEAR * self._size, 0.5 * nearest_corner)

    def _corner_and_sides(self, number: int) -> tuple[_Corner, Sides]:
        """Return a corner by its number with what its two sides do."""
        mesh, corners = self._mesh, self._corners
        x, elements, angle = (
            corners.x[number],
            corners.element[number],
            round(float(corners.angle[number]), 6),
        )
        parts = [mesh.part_names[mesh.part[element]] for element in elements]
        names = " and ".join(dict.fromkeys(parts))
        sides = [
            self._touched(element, x) or kinds_seen(self._conditions.get(part), way, mesh.dim)
            for element, part, way in zip(elements, parts, corners.leaving[number], strict=True)
        ]
        ends, reach = corners.ends[number], self.reach(x)
        return _Corner(ends, tuple(elements.tolist()), names, reach, angle), sides

    def is_singular(self, corner: _Corner, sides: Sides, partner: _Body | None) -> bool:
        """Whether λ < 1 at a corner; where it presses with one side and ends at a free one, its own
        or that of the other body, that of both."""
        closed = [side for side in sides if isinstance(side, _Closed)]
        if len(closed) == 1 and (partner or (FREE,) in sides):
            angle, beside, _ = (
                partner.facing(corner.x, closed[0]) if partner else (math.pi, (FREE,), None)
            )
            kappas, others = (self.kappa, (partner or self).kappa), (_beside(sides, 0), beside)
            if (FREE,) in others:
                return closed[0].is_singular((corner.angle, angle), kappas, others)
        return self._own(
            corner, [side.kinds if isinstance(side, _Closed) else side for side in sides]
        )

    def _own(self, corner: _Corner, kinds: list[tuple[SideKind, ...]]) -> bool:
        """Whether λ < 1 at a corner by what its sides may be."""
        pairs = itertools.product(*kinds)
        if any(_exponent(corner.angle, self.kappa, *pair) < 1.0 for pair in pairs):
            return True
        if self._mesh.components == self._mesh.dim or not corner.angle > 0.0:
            return False
        parts = self._mesh.part[list(corner.elements)]
        given = [self._conditions.get(self._mesh.part_names[part]) for part in parts]
        return torsion_exponent(corner.angle, given, kinds) < 1.0

    def facing(
        self, x: Array, closed: _Closed
    ) -> tuple[float, tuple[SideKind, ...], tuple[Array, tuple[int, ...]] | None]:
        """The angle of the corner that a point of the other body faces and what its side off the
        contact may be; where there is none those of a smooth free side, and the place on it that
        the point faces and the elements that meet there."""
        mesh, normal = self._mesh, closed.normal
        nodes = mesh.x[mesh.nodes_of(closed.part)]
        near = (1.0 + SINGLE) * float(np.linalg.norm(nodes - x, axis=1).min())
        across = meeting(mesh, x, near, closed.part)[0] - x
        if along := float(across @ normal):
            x = x + normal * float(across @ across) / along
        foot, elements = meeting(mesh, x, near, closed.part)
        apart = np.linalg.norm(self._corners.x - foot, axis=1)
        if not (meets := np.flatnonzero(apart < SINGLE * self._size)).size:
            return math.pi, (FREE,), (foot, tuple(elements.tolist()))
        corner, sides = self._corner_and_sides(int(meets[0]))
        return corner.angle, _beside(sides, 1), None

    def _touched(self, element: int, x: Array) -> _Closed | tuple[SideKind, ...] | None:
        """What the element is at the node that is nearest to a point; None off the contact."""
        first, end = self._mesh.first_node[element : element + 2]
        node = first + int(np.argmin(np.linalg.norm(self._mesh.x[first:end] - x, axis=1)))
        if self._pair[node] < 0:
            return None
        (pair, partner, part, stiffer), row = self._pairs[self._pair[node]], self._row[node]
        if pair.state[row] == OPEN:
            return (FREE,)
        if pair.state[row] != SLIP:
            return _Closed(partner, part, (CLAMPED,), stiffer, math.inf, pair.normal[row])
        pressure, shear = abs(pair.pressure[row]), float(np.linalg.norm(pair.sigma_t[row]))
        ratio = round(min(shear / pressure, 1.0), 3) if pressure > 0.0 else 0.0
        return _Closed(partner, part, (SLIDING,), stiffer, ratio, pair.normal[row])
