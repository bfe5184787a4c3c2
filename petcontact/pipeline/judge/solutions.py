"""Findings of a solve that ended: its interfaces, obstacles and loads."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from ...arrays import Array
from ...compliance.interface import Interface
from ...contact.friction_law import contact_norm, lengths
from ...contact.law_protocol import OPEN
from ...fields.boundary.maxima import smallest_gap
from ...geometry.rotation import Motions
from ...given.posed import HOLD, Obstacle
from ...results.records import StepResult
from ...results.report import Finding
from ...results.solution import Solution
from ...round_off import TINY
from ..pose.discretise import Discrete
from ..steps.prepared import PreparedProblem
from .findings import limit_of, new_finding
from .measured import spread_by_noise
from .suspicious import suspicious
from .warnings import unusual


def findings_of(problem: PreparedProblem, solution: Solution) -> list[Finding]:
    """Return all findings of a solve that ended; what several increments share is listed once."""
    results, tried = solution.steps, solution.tried
    measured = problem.discrete.sides, problem.discrete.boundaries
    findings = [
        *problem.discrete.findings,
        *_open(problem, results),
        *problem.discrete.of_meshes,
        *(
            finding
            for result in tried
            for finding in result.findings
            if finding.severity == "warning"
        ),
        *_ignored(problem),
        *_jammed(problem, results),
        *_unlike(problem, results),
        *_oblique(problem.discrete, results),
        *unusual(problem.discrete, results),
        *suspicious(problem.discrete, solution),
        *(spread_by_noise(*measured, solution.pairs) if results else ()),
    ]
    return list({str(finding): finding for finding in findings}.values())


def _unlike(problem: PreparedProblem, results: list[StepResult]) -> Iterator[Finding]:
    """Find interfaces whose two sides differ in force or in shape.

    The difference in shape is the `sag` of their faces. It is compared with the gap that contact
    closes.
    """
    for interface in problem.discrete.interfaces:
        pairs = [result.pairs[interface.name] for result in results]
        left = max((pair.imbalance for pair in pairs), default=0.0)
        if left > limit_of("moments"):
            yield new_finding(
                "moments",
                f"the moments on its two sides differ by {left:.1e} of all that acts there: "
                "friction across a gap or an overlap that is not small next to the face",
                f"pair {interface.name!r}",
                measured=left,
            )
        closed = [
            float(np.abs(interface.gap[pair.state != OPEN]).max(initial=0.0)) for pair in pairs
        ]
        # without contact, the height of the facets is compared with the smallest gap
        approach = max(closed, default=0.0) or float(np.abs(interface.gap).min(initial=np.inf))
        near = interface.gap <= approach
        sag = 0.0 if interface.sag is None else float(interface.sag[near].max(initial=0.0))
        if sag > limit_of("sag") * approach:
            yield new_finding(
                "sag",
                f"its elements miss the curved faces that they stand for by up to {sag:.2g}, next "
                f"to {approach:.2g} that contact closes or leaves open: p is as rough",
                f"pair {interface.name!r}",
                advice="use smaller elements, or give the gap as an expression",
                measured=sag,
                limit=limit_of("sag") * approach,
            )


def _oblique(discrete: Discrete, results: list[StepResult]) -> Iterator[Finding]:
    """Find contacts that act along a direction far off the normals of both sides.

    A pressure p along a direction at an angle θ to the normals is p sin θ along the surfaces, which
    no friction law knows. It is measured by its L2 norm over that of p. In a pin in a hole, 42, 26
    and 14 % made p 11, 2.7 and 1 % smaller, and 42 % the von Mises stress 57 % larger.
    """
    for posed, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        if posed.direction is None or not results:
            continue
        sine = _sines_off(discrete, posed.direction, interface)
        pairs = (result.pairs[posed.name] for result in results)
        pair = max(pairs, key=lambda pair: float(pair.pressure.max(initial=0.0)))
        along, pressure = (sine * pair.pressure)[:, None], pair.pressure[:, None]
        share = contact_norm(along, pair.weight) / (contact_norm(pressure, pair.weight) or 1.0)
        if share > limit_of("oblique"):
            largest = math.asin(min(float(sine[pair.state != OPEN].max()), 1.0))
            yield new_finding(
                "oblique",
                f"its direction is up to {math.degrees(largest):.0f} degrees off the normals "
                f"where it acts: {share:.0%} of the pressure acts along the surfaces, where "
                "stress is about as far off",
                f"pair {posed.name!r}",
                advice="leave direction out, so that contact acts along normals",
                measured=share,
            )


def _sines_off(discrete: Discrete, direction: Array, interface: Interface) -> Array:
    """Return the sine of the angle between a direction and the nearer normal of the two sides, (m,)
    [-].

    The surface of an obstacle is where the gaps end; in space it is taken to be normal to the
    direction.
    """
    mesh = discrete.meshes[interface.body]
    normals = [mesh.smooth_normal[interface.nodes]]
    if interface.primary is not None and interface.values is not None:
        opposite = discrete.meshes[interface.primary].smooth_normal[interface.primary_nodes]
        normals.append(interface.values @ opposite)
    else:
        gap = np.where(np.isfinite(interface.gap), interface.gap, 0.0)
        surface = mesh.x[interface.nodes] + gap[:, None] * direction
        normals.append(mesh.normals_through(surface, direction))
    sines = [
        lengths(normal - np.outer(normal @ direction, direction))
        / np.maximum(lengths(normal), TINY)
        for normal in normals
    ]
    return np.asarray(np.minimum(*sines))


def _ignored(problem: PreparedProblem) -> Iterator[Finding]:
    """Find obstacles without contact, and obstacle loads on components whose motion is given."""
    discrete, kind = problem.discrete, problem.system.motions
    for k, obstacle in enumerate(discrete.posed.obstacles):
        if all(side.obstacle != k for side in discrete.sides):
            yield new_finding("ignored load", f"obstacle {obstacle.name!r} is in no contact")
        if any(
            load and motion not in ("free", HOLD)
            for o in (end[k] for end in discrete.posed.obstacles_at)
            for motion, load in zip(o.motions(kind), o.loads(kind), strict=True)
        ):
            yield new_finding(
                "ignored load",
                "a force or moment on a component whose motion is given does nothing",
                f"obstacle {obstacle.name!r}",
            )


def _jammed(problem: PreparedProblem, results: list[StepResult]) -> Iterator[Finding]:
    """Find interfaces that stay pressed after a step that took all loads away.

    An overlap of bodies and a preload count as loads.
    """
    for number in _unloaded(problem):
        ends = [r for r in results if r.step == number and r.ends]
        for name in ends[0].pairs if ends else ():
            left, *pressed = (
                float(r.pairs[name].pressure.max(initial=0.0)) for r in (ends[0], *results)
            )
            if left > limit_of("jam") * max(pressed):
                yield new_finding(
                    "jam",
                    f"pressure stays after step {problem.steps[number - 1].name!r} took all "
                    "loads away: it jams, and what stays depends on the path",
                    f"pair {name!r}",
                    advice="unload in several increments",
                    measured=left,
                )


def _unloaded(problem: PreparedProblem) -> list[int]:
    """Return the numbers of the steps that take all loads away."""
    discrete, kind = problem.discrete, problem.system.motions
    if not all(boundary.has_inside for boundary in discrete.boundaries):
        return []
    return [
        number
        for number, obstacles in enumerate(discrete.posed.obstacles_at)
        if number > 0
        and not any(data.loaded[number] for data in discrete.data)
        and not any(_is_driven(o, kind) for o in obstacles)
        and not any(side.laws[number].preload for side in discrete.sides)
        and not any(_overlaps(face, number) for face in discrete.interfaces)
    ]


def _overlaps(face: Interface, number: int) -> bool:
    """Return whether the parts overlap in a load state, as they lie or by an interference."""
    given = 0.0 if face.overlap is None else face.overlap[number]
    return bool((face.gap - given).min(initial=np.inf) < 0.0)


def _is_driven(obstacle: Obstacle, kind: Motions) -> bool:
    """Return whether an obstacle is displaced or loaded."""
    pairs = zip(obstacle.motions(kind), obstacle.loads(kind), strict=True)
    return any(load if motion == "free" else motion for motion, load in pairs)


def reached(discrete: Discrete, results: list[StepResult]) -> str:
    """Return the sentence that says how a converged solve ended, with its largest residuals."""
    if not discrete.sides:
        defect = max(float(np.nan_to_num(result.residuals["elastic"])) for result in results)
        return f"nothing is in contact, elastic residual {defect:.1e}"
    if discrete.holds_normals and not discrete.posed.steps:
        return results[-1].reason
    worst = {
        key: max(0.0 if math.isnan(r.residuals[key]) else float(r.residuals[key]) for r in results)
        for key in ("normal", "tangential", "balance", "elastic", "equilibrium")
    }
    # a balance of 0 means that no body is held by contact only
    return "residuals " + ", ".join(
        f"{key} {value:.1e}" if value else f"{key} 0"
        for key, value in worst.items()
        if key != "balance" or value
    )


def _open(problem: PreparedProblem, results: list[StepResult]) -> Iterator[Finding]:
    """Find that no increment has contact anywhere."""
    pairs = results[-1].pairs if results else {}
    if not pairs or any((p.state != OPEN).any() for r in results for p in r.pairs.values()):
        return
    discrete = problem.discrete
    gaps = {
        own.name: smallest_gap(discrete.meshes[own.body], own.nodes, pairs[own.name].gap)
        for own in discrete.interfaces
    }
    apart = "; ".join(f"pair {name!r} {_distance(gap)}" for name, gap in gaps.items())
    yield new_finding(
        "no contact",
        f"no contact anywhere ({apart})",
        advice="check gaps, and the directions of loads and displacements",
    )


def _distance(gap: float) -> str:
    if np.isinf(gap):
        return "faces nothing"
    return f"lies {gap:.3g} apart" if gap > 0.0 else "touches without pressure"
