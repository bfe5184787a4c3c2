"""Slip of one body in bilateral contact, followed from mesh to mesh: what an adaptive solve refines
for, and its error."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ...arrays import Array
from ...bem.compatibility import check_compatible
from ...bem.kernels import kernel_for
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...geometry.surface import Boundary
from ...mesh.curve_mesh import as_curve
from ...model.problem import Problem
from ...refinement.contact_line import (
    ContactLine,
    difference,
    farthest_apart,
    largest,
    without_specks,
)
from ...refinement.levels import SLIP_LADDER, Level, believed
from ...refinement.marks import Body, LevelMesh
from ...refinement.zones import Zone
from ...results.solution import Solution
from ..judge.findings import WHOLE_MESH, wants_smaller_elements
from ..steps.increment import PreparedProblem
from .difference import displacement_scale

GAIN = 25.0
"""Ratio of the errors of two neighbouring levels of `REFINEMENT_LEVELS` beyond which it is chance:
that of the first two."""
NEGLIGIBLE = 1e-5
"""What friction moves a half space by, of that, below which the signs of slip are those of
round-off."""
DENSE_NODES = 2500
"""Nodes of graded meshes up to which `mat_type = "auto"` stays dense."""
BEYOND = 2.0
"""σ_t where a start slips, over the largest: outside of the ball of the friction bound."""
FIRST_LOOK = 12
"""Least number of elements on a contact side when nothing is known of its zones."""


class Slip:
    """u_t and its transition points between stick and slip, where it behaves like the power 3/2 of
    the distance.

    Attributes
    ----------
    levels : tuple of Level
        Meshes to climb, each with an error about ten times smaller than that of the one before.
    accuracy : float
        That is wanted by default [-].
    differences : list of float
        Relative differences of u_t between neighbouring meshes.
    """

    accuracy, dense_nodes, exhausted = 1e-4, DENSE_NODES, ""

    def __init__(self) -> None:
        self.differences: list[float] = []
        self.wanted, self.asked = self.accuracy, True
        self._shown: list[list[ContactLine]] = []
        self._levels: list[Level] = []
        self._last: Solution | None = None
        self._body: Body | None = None

    @property
    def levels(self) -> tuple[Level, ...]:
        """Those of `SLIP_LADDER` that the wanted accuracy needs."""
        return SLIP_LADDER.to(self.wanted)

    def refine(
        self, number: int, one: Callable[[], Problem], boundary: Boundary, level: Level
    ) -> LevelMesh:
        """Graded to the transition points that the last solution shows.

        Raises
        ------
        InputError
            If data contradict each other where parts meet.
        """
        if self._body is None:
            posed = one()
            self._body = Body.of(posed, as_outline(boundary, "--adapt").joined).with_powers()
            check_compatible(posed, self._body.outline)
        body = self._body
        longest = [
            side.length / FIRST_LOOK if contact and not self._shown else np.inf
            for side, contact in zip(body.outline.sides, body.contact, strict=True)
        ]
        return body.mesh(level, longest, self._shown[-1] if self._shown else None)

    def start(self, problem: PreparedProblem) -> Start | None:
        """v and σ on another mesh whose sets are the zones of the last solution: exact where its
        transition points are."""
        if self._last is None:
            return None
        assert self._body is not None
        zones, contact, ways = (
            transition_zones(self._body, self._shown[-1]),
            self._last.contact,
            list[Array](),
        )
        for side, face in zip(problem.discrete.sides, problem.discrete.interfaces, strict=True):
            mine = [zone for zone in zones if zone.part == side.part]
            begins = np.maximum.accumulate([zone.start for zone in mine])
            s = as_curve(problem.discrete.meshes[side.body]).arc_length[face.nodes]
            ways.append(np.array([zone.sign for zone in mine])[np.searchsorted(begins[1:], s)])
        # where all components are looked for none but the tangential one has zones
        way = np.zeros((problem.system.size, problem.system.k))
        way[:, 0] = np.concatenate(ways)
        return float(np.abs(contact.u_t).max()) * way, -BEYOND * float(
            np.abs(contact.sigma_t).max()
        ) * way

    def mark(self, solution: Solution, level: Level) -> bool:
        """Keep the transition points that a solution shows, to which the next mesh is graded."""
        assert self._body is not None
        lines = contact_lines(self._body, solution)
        if self._last is not None:
            self.differences.append(
                difference(self._shown[-1], lines) / displacement_scale(solution)
            )
        self._shown.append(lines)
        self._levels.append(level)
        self._last = solution
        return False

    def mark_failed(self, solution: Solution) -> bool:
        """Whether a solution that is not accepted asks for another mesh."""
        failed = solution.failed
        return failed is not None and bool(wants_smaller_elements(failed.findings) & WHOLE_MESH)

    @property
    def estimate(self) -> float:
        """Of the error of the last mesh."""
        assert self._body is not None
        if SLIP_LADDER.believes(self.differences, self.wanted):
            return max(self.differences[0], self._levels[1].error)
        return estimated_error(
            self.differences, [self._body.truncation(level.resolved) for level in self._levels]
        )

    def shown(self) -> dict[str, Any]:
        """Fields of `Accuracy`: the zones, and how far they moved."""
        assert self._body is not None
        differ = {}
        if self.differences and self.estimate > self.wanted:
            number, s = farthest_apart(*self._shown[-2:])
            side = np.flatnonzero(self._body.contact)[number]
            along = self._body.outline.offsets[side] + s
            differ = {
                "meshes_differ": f"the last two differ most on "
                f"{self._body.outline.sides[side].part!r} at s = {along:.6g}"
            }
        zones, *before = (transition_zones(self._body, shown) for shown in self._shown[:-3:-1])
        return {
            "largest_slip": largest(self._shown[-1]),
            "zones": [dataclasses.astuple(zone) for zone in zones],
            "zone_errors": zone_errors(zones, before[0] if before else []),
            **differ,
        }


def estimated_error(differences: list[float], truncation: list[float]) -> float:
    """Error of the last level from the differences of neighbouring ones, infinite while there are
    fewer than two of them.

    The last difference is the error of the last level but one, and an estimate for the last one
    that does not flatter. Two levels may be alike by chance, or because elements at a corner are as
    small as they can be: no step is believed to gain more than GAIN, and nothing more than the
    sizes of elements at corners allow: errors C T_k there show as differences d_k = C (T_k -
    T_(k+1)).

    Parameters
    ----------
    differences : list of k floats
        Of levels 0 and 1, 1 and 2, ...
    truncation : list of k + 1 floats
        T of each level, see `Body.truncation`.
    """
    if len(differences) < 2:
        return math.inf
    least = [
        max(d, before / GAIN) for d, before in zip(differences, [0.0, *differences], strict=False)
    ]
    steps = zip(least, truncation[:-1], truncation[1:], strict=True)
    # each difference bounds C, as far as its two meshes differ at corners at all
    bounds = [d / (before - after) for d, before, after in steps if before > 1.01 * after]
    left = truncation[-1] * min(bounds, default=0.0)
    return max(believed(differences, GAIN), left)


def contact_lines(body: Body, solution: Solution) -> list[ContactLine]:
    """u_t and σ_t along each contact side of a solution."""
    mesh, contact = as_curve(solution.mesh), solution.contact
    ends = np.cumsum([side.length for side in body.outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
    element = mesh.element[contact.nodes]
    sign = np.where(contact.state == 1, -np.sign(contact.sigma_t[:, 0]), 0.0).astype(np.int64)
    compliance = kernel_for(mesh, solution.problem.body[0].material).half_space_compliance
    compliance *= float(mesh.measure[contact.nodes].sum())
    negligible = NEGLIGIBLE * displacement_scale(solution) / compliance
    lines = []
    for k in np.flatnonzero(body.contact):
        chosen = side_of_element[element] == k
        # without friction, or with less than moves anything, there are no transitions: one zone,
        # whatever the sign of u_t
        free = chosen & (contact.friction_bound <= negligible)
        sign[free] = 1 if contact.u_t[free, 0].sum() >= 0.0 else -1
        mine = np.flatnonzero(side_of_element == k)
        offset = mesh.side_start[mine[0]]
        breaks = (
            np.append(mesh.side_start[mine], mesh.side_start[mine[-1]] + mesh.length[mine[-1]])
            - offset
        )
        kinks = body.kinks[k]
        power = mesh.power[mine]
        if power.any():
            # no polynomial reaches into an element that is a power
            kinks = np.unique(
                [
                    *kinks,
                    *breaks[1:-1][[power[0] > 0.0, *[False] * (len(mine) - 3), power[-1] < 0.0]],
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


def transition_zones(body: Body, shown: list[ContactLine]) -> list[Zone]:
    """Zones with their ends at the estimated transition points, by arc length along the part."""
    zones: list[Zone] = []
    offset: dict[str, float] = {}
    lines = iter(shown)
    for side, contact in zip(body.outline.sides, body.contact, strict=True):
        start = offset.get(side.part, 0.0)
        offset[side.part] = start + side.length
        if not contact:
            continue
        line = next(lines)
        # between the nodes that it parts, whatever an extrapolation says
        found = [
            min(max(at, float(line.s[cut - 1])), float(line.s[cut]))
            for at, cut in zip(line.transitions, line.cuts.tolist(), strict=True)
        ]
        ends = [0.0, *found, side.length]
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
    """How far the ends of zones lie from the nearest ones of a coarser mesh, one pair a zone
    [length]."""

    def moved(part: str, at: float) -> float:
        ends = [end for zone in before if zone.part == part for end in (zone.start, zone.end)]
        return min((abs(at - end) for end in ends), default=0.0)

    return [(moved(zone.part, zone.start), moved(zone.part, zone.end)) for zone in zones]
