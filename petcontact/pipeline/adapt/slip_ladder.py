"""Adaptive strategy in the plane for the slip of one body in bilateral contact."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np

from ...arrays import Array
from ...bem.compatibility import check_compatible
from ...bem.kernels import kernel_for
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...mesh.curve_mesh import as_curve
from ...refinement.contact_line import (
    ContactLine,
    difference,
    farthest_apart,
    without_specks,
)
from ...refinement.levels import SLIP_LADDER, Level, believed
from ...refinement.marks import ACCURACY, GradedOutline, LevelMesh
from ...refinement.zones import Zone
from ...results.evaluated import displacement_scale
from ...results.solution import Solution
from ...round_off import HALF
from ..steps.increment import PreparedProblem
from .difference import difference as traction_difference
from .strategy import Strategy

FIRST_LOOK = 12
"""Least number of elements on a contact side while its zones are unknown. With 24 the first two
meshes of Example 1 differ most where u_t is smooth: the second one is coarser there."""


class Slip(Strategy):
    """The strategy for u_t, with its transition points between stick and slip.

    Near such a point u_t behaves like the power 3/2 of the distance.

    Attributes
    ----------
    levels : tuple of Level
        Refinement levels of the meshes; the error of each is about a tenth of the one before.
    accuracy : float
        Default of the wanted accuracy [-].
    differences : list of float
        Relative differences of u_t between neighbouring meshes [-].
    """

    accuracy, exhausted = ACCURACY, ""

    def __init__(self) -> None:
        self.differences: list[float] = []
        self.wanted, self.asked = self.accuracy, True
        self._shown: list[list[ContactLine]] = []
        self._before: Solution | None = None
        self._last: Solution | None = None
        self._body: GradedOutline | None = None

    @property
    def levels(self) -> tuple[Level, ...]:
        """The levels of `SLIP_LADDER` that the wanted accuracy needs."""
        return SLIP_LADDER.reaching(self.wanted)

    def refine(self, number: int, posed: Body, boundary: Boundary, level: Level) -> LevelMesh:
        """Return a mesh that is graded to the transition points of the last solution.

        Raises
        ------
        InputError
            If data contradict each other where parts meet.
        """
        if self._body is None:
            outline = as_outline(boundary, "--adapt").joined
            self._body = GradedOutline.from_body(posed, outline).with_powers()
            check_compatible(self._body.outline, posed)
        body = self._body
        if self._last is not None:
            body = body.halving(as_curve(self._last.mesh), level.resolved)
        longest = [
            side.length / FIRST_LOOK if contact and not self._shown else np.inf
            for side, contact in zip(body.outline.sides, body.contact, strict=True)
        ]
        return body.mesh(level, longest, self._shown[-1] if self._shown else None)

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return v and σ whose sets on another mesh are the zones of the last solution, or None."""
        if self._last is None:
            return None
        assert self._body is not None
        zones = transition_zones(self._body, self._shown[-1])
        contact = self._last.contact
        ways = list[Array]()
        for side, interface in zip(
            problem.discrete.sides, problem.discrete.interfaces, strict=True
        ):
            own_zones = [zone for zone in zones if zone.part == side.part]
            begins = np.maximum.accumulate([zone.start for zone in own_zones])
            s = as_curve(problem.discrete.meshes[side.body]).arc_length[interface.nodes]
            ways.append(np.array([zone.sign for zone in own_zones])[np.searchsorted(begins[1:], s)])
        # only the tangential component has zones, also if all components are unknowns
        direction = np.zeros((problem.system.size, problem.system.k))
        direction[:, 0] = np.concatenate(ways)
        # the largest u_t leads out of the ball of the largest σ_t, which is the bound there
        v, sigma = (float(np.abs(values).max()) for values in (contact.u_t, contact.sigma_t))
        return v * direction, -sigma * direction

    def mark(self, solution: Solution, level: Level) -> None:
        """Store the transition points of a solution, to which the next mesh is graded."""
        assert self._body is not None
        lines = contact_lines(self._body, solution)
        if self._last is not None:
            self.differences.append(
                difference(self._shown[-1], lines) / displacement_scale(solution)
            )
        self._shown.append(lines)
        self._before, self._last = self._last, solution

    @property
    def estimate(self) -> float:
        """Estimated error of the last mesh [-].

        It is the last difference, which is the error of the mesh before. Elements at corners halve
        at least from mesh to mesh (`GradedOutline.halving`), so that errors there show in it.
        """
        if SLIP_LADDER.believes(self.differences, self.wanted):
            return max(self.differences[0], self.levels[1].error)
        return believed(self.differences)

    def shown(self) -> dict[str, Any]:
        """Return fields of `Accuracy`: the zones, and how far their ends moved."""
        assert self._body is not None
        differ = {}
        if self.differences and self.estimate > self.wanted:
            number, s = farthest_apart(*self._shown[-2:])
            side = np.flatnonzero(self._body.contact)[number]
            along = self._body.outline.offsets[side] + s
            differ = {
                "meshes_differ": "the last two differ most on "
                f"{self._body.outline.sides[side].part!r} at s = {along:.6g}"
            }
        zones, *before = (transition_zones(self._body, shown) for shown in self._shown[:-3:-1])
        tractions = math.nan
        if self._before is not None and self._last is not None:
            tractions = traction_difference(self._before, self._last).inside
        return {
            "zones": [dataclasses.astuple(zone) for zone in zones],
            "zone_errors": zone_errors(zones, before[0] if before else []),
            "tractions": tractions,
            **differ,
        }


def contact_lines(body: GradedOutline, solution: Solution) -> list[ContactLine]:
    """Return u_t and σ_t along each contact side of a solution."""
    mesh, contact = as_curve(solution.mesh), solution.contact
    ends = np.cumsum([side.length for side in body.outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
    element = mesh.element[contact.nodes]
    sign = np.where(contact.state == 1, -np.sign(contact.sigma_t[:, 0]), 0.0).astype(np.int64)
    compliance = kernel_for(mesh, solution.posed.bodies[0].material).half_space_compliance
    compliance *= float(mesh.measure[contact.nodes].sum())
    # by less friction displaces a half-space by round-off only
    negligible = HALF * displacement_scale(solution) / compliance
    lines = []
    for k in np.flatnonzero(body.contact):
        chosen = side_of_element[element] == k
        # where friction is too weak to move anything, there is one zone with the mean sign of u_t
        free = chosen & (contact.friction_bound <= negligible)
        sign[free] = 1 if contact.u_t[free, 0].sum() >= 0.0 else -1
        elements = np.flatnonzero(side_of_element == k)
        offset = mesh.side_start[elements[0]]
        breaks = (
            np.append(
                mesh.side_start[elements], mesh.side_start[elements[-1]] + mesh.length[elements[-1]]
            )
            - offset
        )
        kinks = body.kinks[k]
        power = mesh.power[elements]
        if power.any():
            # no polynomial is fitted across the end of an element with a power
            kinks = np.unique(
                [
                    *kinks,
                    *breaks[1:-1][
                        [power[0] > 0.0, *[False] * (len(elements) - 3), power[-1] < 0.0]
                    ],
                ]
            )
        lines.append(
            ContactLine(
                contact.arc_length[chosen] - offset,
                contact.weight[chosen],
                element[chosen],
                breaks,
                contact.u_t[chosen, 0],
                contact.sigma_t[chosen, 0],
                contact.friction_bound[chosen],
                without_specks(sign[chosen], element[chosen]),
                kinks,
                (float(power[0]), float(-power[-1])),
            )
        )
    return lines


def transition_zones(body: GradedOutline, shown: list[ContactLine]) -> list[Zone]:
    """Return the zones between estimated transition points, by arc length along the part."""
    zones: list[Zone] = []
    offset: dict[str, float] = {}
    lines = iter(shown)
    for side, contact in zip(body.outline.sides, body.contact, strict=True):
        start = offset.get(side.part, 0.0)
        offset[side.part] = start + side.length
        if not contact:
            continue
        line = next(lines)
        # an extrapolated point is kept between the two nodes that it separates
        points = [
            min(max(s, float(line.s[cut - 1])), float(line.s[cut]))
            for s, cut in zip(line.transitions, line.cuts.tolist(), strict=True)
        ]
        ends = [0.0, *points, side.length]
        for zone, a, b in zip(line.zones(), ends[:-1], ends[1:], strict=True):
            sign = int(line.sign[zone.start])
            if (
                zones
                and zones[-1].part == side.part
                and zones[-1].sign == sign
                and zones[-1].end == start + a
            ):
                a = zones.pop().start - start
            zones.append(Zone(side.part, start + a, start + b, sign))
    return zones


def zone_errors(zones: list[Zone], before: list[Zone]) -> list[tuple[float, float]]:
    """Return the distance of both ends of each zone from the nearest end on a coarser mesh
    [length]."""

    def moved(part: str, s: float) -> float:
        ends = [end for zone in before if zone.part == part for end in (zone.start, zone.end)]
        return min((abs(s - end) for end in ends), default=0.0)

    return [(moved(zone.part, zone.start), moved(zone.part, zone.end)) for zone in zones]
