"""Adaptive strategy in the plane for the slip of one body in bilateral contact."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np

from ...arrays import Array
from ...bem.compatibility import check_compatible
from ...bem.kernels import kernel_for
from ...contact.state import Start
from ...geometry.outline import as_outline
from ...given.posed import Posed
from ...mesh.curve_mesh import as_curve
from ...record import field, record
from ...refinement.contact_line import (
    ContactLine,
    difference,
    farthest_apart,
    without_specks,
)
from ...refinement.levels import SLIP_LADDER, Level, believed
from ...refinement.marks import GradedOutline
from ...refinement.zones import Zone
from ...results.evaluated import displacement_scale
from ...results.solution import Solution
from ...round_off import HALF
from ...untyped import Keyed
from ..pose.body_parts import body_alone
from ..steps.prepared import PreparedProblem
from .difference import difference as traction_difference
from .strategy import Before, Estimate, Meshes, Strategy, Tried, Wanted

FIRST_LOOK = 12
"""Least number of elements on a contact side while its zones are unknown. With 24 the first two
meshes of Example 1 differ most where u_t is smooth: the second one is coarser there."""


@record
class SlipEstimate(Estimate):
    """The error of u_t.

    Attributes
    ----------
    lines : list of ContactLine
        u_t and σ_t along each contact side.
    before : SlipEstimate or None
        The estimate on the mesh before.
    """

    lines: list[ContactLine] = field(default_factory=list)
    before: SlipEstimate | None = None


class Slip(Strategy[SlipEstimate, Before[SlipEstimate]]):
    """The strategy for u_t, with its transition points between stick and slip.

    Near such a point u_t behaves like the power 3/2 of the distance.

    Attributes
    ----------
    accuracy : float
        Default of the wanted accuracy [-].
    """

    accuracy, first = SLIP_LADDER.usual, ()

    def __init__(self, posed: Posed, wanted: Wanted) -> None:
        self._posed, self.wanted = posed, wanted

    @property
    def levels(self) -> tuple[Level, ...]:
        """The levels of `SLIP_LADDER` that the wanted accuracy needs; the error of each is about a
        tenth of the one before."""
        return SLIP_LADDER.reaching(self.wanted.accuracy)

    @functools.cached_property
    def _body(self) -> GradedOutline:
        """The data of the body.

        Raises
        ------
        InputError
            If data contradict each other where parts meet.
        """
        (boundary,) = self._posed.boundaries
        body, outline = body_alone(self._posed, 0, boundary), as_outline(boundary, "--adapt").joined
        check_compatible(outline, body)
        return GradedOutline.from_body(body, outline).with_powers()

    def estimate(
        self, tried: Tried[Before[SlipEstimate]], before: SlipEstimate | None
    ) -> SlipEstimate:
        """Return the last difference of u_t, which is the error of the mesh before.

        Elements at corners halve at least from mesh to mesh (`GradedOutline.halving`), so that
        errors there show in it.
        """
        lines, differences = contact_lines(self._body, tried.solution), list[float]()
        if before is not None:
            change = difference(before.lines, lines) / displacement_scale(tried.solution)
            differences = [*before.differences, change]
        if SLIP_LADDER.believes(differences, self.wanted.accuracy):
            error = max(differences[0], self.levels[1].error)
        else:
            error = believed(differences)
        return SlipEstimate(tried, error, differences, lines, before)

    def marks(self, estimate: SlipEstimate) -> Before[SlipEstimate]:
        """Return the estimate with its transition points."""
        return (estimate,)

    def meshes(self, marks: Before[SlipEstimate], level: int) -> Meshes[Before[SlipEstimate]]:
        """Return a mesh that is graded to transition points."""
        if level == len(self.levels):
            return Meshes(marks, level)
        reached, body = self.levels[level], self._body
        if marks:
            (seen,) = marks
            body = body.halving(as_curve(seen.solution.mesh), reached.resolved)
            made = body.mesh(reached, [np.inf] * len(body.contact), seen.lines)
            start = functools.partial(self._start, seen)
            return Meshes(marks, level, [made.mesh], made.missed, start=start)
        longest = [
            side.length / FIRST_LOOK if contact else np.inf
            for side, contact in zip(body.outline.sides, body.contact, strict=True)
        ]
        made = body.mesh(reached, longest, None)
        return Meshes(marks, level, [made.mesh], made.missed)

    def _start(self, seen: SlipEstimate, problem: PreparedProblem) -> Start:
        """Return v and σ whose sets are the zones of a solution on another mesh."""
        zones, ways = transition_zones(self._body, seen.lines), list[Array]()
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
        contact = seen.solution.contact
        v, sigma = (float(np.abs(values).max()) for values in (contact.u_t, contact.sigma_t))
        return v * direction, -sigma * direction

    def shown(self, estimate: SlipEstimate) -> Keyed:
        """Return fields of `Accuracy`: the zones, and how far their ends moved."""
        zones, before = transition_zones(self._body, estimate.lines), estimate.before
        shown: Keyed = {"zones": [dataclasses.astuple(zone) for zone in zones]}
        if before is None:
            return shown | {"zone_errors": zone_errors(zones, [])}
        if estimate.error > self.wanted.accuracy:
            number, s = farthest_apart(before.lines, estimate.lines)
            side = np.flatnonzero(self._body.contact)[number]
            along = self._body.outline.offsets[side] + s
            shown["meshes_differ"] = (
                "the last two differ most on "
                f"{self._body.outline.sides[side].part!r} at s = {along:.6g}"
            )
        return shown | {
            "zone_errors": zone_errors(zones, transition_zones(self._body, before.lines)),
            "tractions": traction_difference(before.solution, estimate.solution).inside,
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
