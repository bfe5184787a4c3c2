"""Findings of data that the user hardly meant: unusual strains, loads, friction and gaps."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array, States
from ...compliance.interface import Interface
from ...contact.law_protocol import OPEN
from ...errors import ONE_BODY, the_body
from ...given.conditions import Traction
from ...given.interface_data import PosedInterface
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.panels.edges import SMOOTH
from ...results.records import StepResult, step_ends
from ...results.report import Finding
from ...results.solution import Solution
from ...results.strength.corners import corners_of
from ...round_off import SINGLE, SOLVED
from ..pose.discretise import Discrete
from .findings import limit_of, new_finding
from .increments import BLOCKS
from .thickness import SHARE


def suspicious(discrete: Discrete, solution: Solution) -> list[Finding]:
    """Find unusual numbers in a problem and in its solution."""
    return [
        *_strains(solution),
        *_frictions(discrete),
        *_planes(discrete),
        *_gaps(discrete),
        *_empty(step_ends(solution.steps), discrete.posed.method.tolerance),
        *_cut_off(discrete, step_ends(solution.steps)),
    ]


def _strains(solution: Solution) -> Iterator[Finding]:
    """Find bodies with large strains, and loaded bodies with strains that are almost 0."""
    if not solution.steps:
        return
    for body in solution.posed.bodies:
        if not solution.body_fields(body.name).known:
            continue
        _, state = solution.boundary_state(body.name)
        modulus, mesh = body.material.young_modulus, solution.meshes[body.name]
        strain = usual(state.von_mises[: mesh.n_nodes], mesh.weight) / modulus
        contacts = [p for n, p in solution.pairs.items() if solution.sides[n][0] == body.name]
        strain = max(
            [strain, *(_pressed(p.pressure, p.state, p.weight) / modulus for p in contacts)]
        )
        if strain > limit_of("strain"):
            plane = ", and that forces are per thickness" * (mesh.weight_power == 1)
            yield new_finding(
                "strain",
                f"{the_body(body.name)} is strained by {strain:.0%}: strains are taken to be small",
                advice=f"check the units of loads and moduli{plane}",
                measured=strain,
            )
        if SOLVED < strain < limit_of("tiny strain"):
            yield new_finding(
                "tiny strain",
                f"{the_body(body.name)} is strained by {strain:.1e} only",
                advice="check that loads and moduli have the same unit",
                measured=strain,
            )


def usual(values: Array, weight: Array) -> float:
    """Return the value that only the share `SHARE` of the boundary exceeds.

    The rest may be singular corners, whose strain has no bound.
    """
    order = np.argsort(values)
    row = int(np.searchsorted(np.cumsum(weight[order]), (1.0 - SHARE) * float(weight.sum())))
    return float(values[order[min(row, len(order) - 1)]])


def _pressed(pressure: Array, state: States, weight: Array) -> float:
    """Return the mean pressure over the nodes in contact, 0 without contact [stress]."""
    closed = state != OPEN
    area = float(weight[closed].sum())
    return float(weight[closed] @ np.abs(pressure[closed])) / area if area > 0.0 else 0.0


def _frictions(discrete: Discrete) -> Iterator[Finding]:
    """Find friction coefficients that no dry pair of materials has."""
    for side in discrete.sides:
        mu = side.law.friction_coefficient
        value = 0.0 if mu is None or mu.varies else mu.source
        if value > limit_of("friction coefficient"):
            yield new_finding(
                "friction coefficient",
                f"a friction coefficient of {value:g}: dry pairs have 0.05 to 1.5",
                f"pair {side.name!r}",
                advice=f"{value:g} % is {value / 100.0:g}",
                measured=value,
            )


def _planes(discrete: Discrete) -> Iterator[Finding]:
    """Find plane bodies of which some may not strain across the plane, and others may."""
    plane = discrete.meshes[0].dim == 2 and not discrete.posed.axial
    states = {body.material.plane: body.name for body in discrete.posed.bodies if plane}
    if len(states) < 2:
        return
    names = " and ".join(f"{name!r} in plane {plane}" for plane, name in sorted(states.items()))
    yield new_finding(
        "mixed planes",
        f"bodies {names} have other stiffnesses",
        advice="plane = the same in all",
    )


def _gaps(discrete: Discrete) -> Iterator[Finding]:
    """Find bodies that touch no other one, and gaps that bilateral contact closes by force."""
    names = [body.name for body in discrete.posed.bodies]
    touching = {names[number] for side in discrete.sides for number in side.bodies}
    for name in (n for n in names if n not in touching and len(names) > 1):
        yield new_finding(
            "unpaired",
            "touches no other body",
            the_body(name),
            advice="bodies meet where a [[contact]] names their parts",
        )
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        where, gap = f"pair {side.name!r}", interface.gap[np.isfinite(interface.gap)]
        if side.law.normal == "bilateral" and gap.max(initial=0.0) > 0.0:
            yield new_finding(
                "closed gap",
                f"bilateral contact closes a gap of {gap.max():.3g} by pulling",
                where,
                advice='a gap may stay open with normal = "unilateral"',
            )


def _empty(steps: Sequence[StepResult], tolerance: float) -> list[Finding]:
    """Find steps before the last one at whose end no contact transmits pressure, and those that
    leave all bodies where they are, to what the method leaves at its tolerance."""
    idle = [
        step
        for before, step in itertools.pairwise(steps)
        if all(
            np.abs(body.u - before.bodies[name].u).max()
            <= max(SOLVED, BLOCKS * step.history.left(tolerance)) * np.abs(body.u).max()
            for name, body in step.bodies.items()
        )
    ]
    unpressed = [
        step
        for step in steps[:-1]
        if step.pairs and not any(pair.pressure.any() for pair in step.pairs.values())
    ]
    return [
        new_finding("empty step", text, f"step {step.name!r}")
        for text, found in (
            ("its contact carries nothing", unpressed),
            ("it moves no body: check what it gives", idle),
        )
        for step in found
    ]


def _cut_off(discrete: Discrete, steps: Sequence[StepResult]) -> Iterator[Finding]:
    """Find contacts that are closed up to the end of their part, where the surface goes on
    smoothly, and the other side does, too.

    Of a constant gap the end of the part is where a punch ends. What lies beyond is a part without
    contact and without given displacements.
    """
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        element = discrete.meshes[side.body].element[interface.nodes]
        loose = [np.bincount(element, step.pairs[side.name].state == OPEN) for step in steps]
        closed = {e for e in element.tolist() if any(not count[e] for count in loose)}
        owner = discrete.posed.bodies[side.body].name
        for beyond in _beyond(discrete, side, interface, closed):
            own, other = (
                part if owner == ONE_BODY else f"{owner}.{part}" for part in (side.part, beyond)
            )
            yield new_finding(
                "cut off",
                f"its contact ends where {own!r} does, but the surface goes on smoothly as "
                f"{other!r} without contact",
                f"pair {side.name!r}",
                advice="give both one name, or take both as one contact: "
                f'secondary = ["{own}", "{other}"]',
            )


def _beyond(
    discrete: Discrete, side: PosedInterface, interface: Interface, closed: set[int]
) -> list[str]:
    """Return the parts without contact as which a secondary goes on beside closed elements."""
    gap, mesh = interface.gap[np.isfinite(interface.gap)], discrete.meshes[side.body]
    size = float(np.ptp(mesh.x, axis=0).max())
    if side.law.normal != "unilateral" or not len(gap) or np.ptp(gap) <= SINGLE * size:
        return []
    found = {
        mesh.part_names[mesh.part[other]]
        for x, one, other, along in _smooth_ends(mesh)
        if one in closed and _goes_on(discrete, interface, x, along)
    }
    return [part for part in sorted(found) if _is_free(discrete, side.body, part)]


def _is_free(discrete: Discrete, number: int, part: str) -> bool:
    """Return whether a part of a body has neither contact nor given displacements."""
    ends = {end for side in discrete.sides for end in side.ends}
    given = [each.get(part) for each in discrete.posed.bodies[number].conditions]
    return (number, part) not in ends and all(isinstance(each, Traction | None) for each in given)


def _smooth_ends(mesh: BoundaryMesh) -> Iterator[tuple[Array, int, int, Array]]:
    """Yield where one part goes on smoothly as another one: the place (d,), the last element, the
    first one of the other part, and the unit vector (d,) along that."""
    corners = mesh.once("corners", lambda: corners_of(mesh))
    for k in np.flatnonzero(np.abs(corners.angle - math.pi) < SMOOTH).tolist():
        for one in (0, 1):
            own, other = corners.element[k, one], corners.element[k, 1 - one]
            yield corners.x[k], int(own), int(other), corners.along[k, 1 - one]


def _goes_on(discrete: Discrete, interface: Interface, x: Array, along: Array) -> bool:
    """Return whether the primary of an interface reaches beyond a point along a unit vector."""
    if interface.primary is None:
        return True
    opposite = discrete.meshes[interface.primary].x[interface.primary_nodes]
    return bool(((opposite - x) @ along).max() > SINGLE * np.ptp(opposite, axis=0).max())
