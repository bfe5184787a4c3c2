"""Warnings of a solution that is accepted: motions that are not small, tractions that are hardly in
equilibrium."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import half_extent, unit_motions
from ...contact.law_protocol import OPEN
from ...mesh.boundary_mesh import BoundaryMesh
from ...results.records import BodyResult, PairResult, StepResult
from ...results.report import Finding
from ...round_off import WRITTEN
from ..pose.discretise import Discrete
from .findings import limit_of, new_finding
from .increments import overlap_of

ROLLED = "{} turns by {:.2g} widths of its contact"


def rolled_off(
    discrete: Discrete, pairs: Mapping[str, PairResult], bodies: Mapping[str, BodyResult]
) -> list[Finding]:
    """Find bodies that an increment turns by more than the width of their contact."""
    return _large("rolled off", ROLLED, rolls(discrete, pairs, bodies))


def absurd(discrete: Discrete, largest: Sequence[float]) -> list[Finding]:
    """Find displacements of an increment that are not accepted, by the body that moves farthest.

    `largest` is the largest displacement of each body [length].
    """
    moved, number = max(
        (u / size, b) for b, (u, size) in enumerate(zip(largest, discrete.sizes, strict=True))
    )
    if not moved > limit_of("displacement"):
        return []
    text = (
        f"body {discrete.problem.body[number].name!r} moves by {moved:.1e} times its size, at most "
        f"{limit_of('displacement'):.0e} is accepted: displacements are taken to be small"
    )
    advice = "check the units of loads and moduli"
    return [new_finding("displacement", text, advice=advice, measured=moved)]


def unusual(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find motions that are not small, and tractions without equilibrium."""
    return [*_uneven(results), *_rough(discrete, results), *_motions(discrete, results)]


def _motions(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find bodies, obstacles and interfaces whose motions are not small."""
    turned, moved, rolled = dict[str, float](), dict[str, float](), dict[str, float]()
    for result in results:
        for mesh, body in zip(discrete.meshes, discrete.problem.body, strict=True):
            rotation, travel = _rigid_part(mesh, result.bodies[body.name].u)
            _raise(turned, f"body {body.name!r}", rotation)
            _raise(moved, f"body {body.name!r}", travel)
        for name, way in rolls(discrete, result.pairs, result.bodies).items():
            _raise(rolled, name, way)
        for name, obstacle in result.obstacles.items():
            _raise(turned, f"obstacle {name!r}", np.abs(obstacle.rotation).max())
    return [
        *_large("turn", "{} turns by {:.2g} rad", turned),
        *_large("roll", ROLLED, rolled),
        *_large("travel", "{} moves by {:.2g} times its size", moved),
        *_large("slip", "{} slips by {:.2g} elements", _slips(discrete, results)),
    ]


def _large(kind: str, text: str, values: dict[str, float]) -> list[Finding]:
    """Findings of motions that are larger than their limit."""
    advice = "displacements are taken to be small"
    return [
        new_finding(kind, text.format(name, value), advice=advice, measured=value)
        for name, value in values.items()
        if value > limit_of(kind)
    ]


def _slips(discrete: Discrete, results: Sequence[StepResult]) -> dict[str, float]:
    """The largest slip in contact of each interface, over the largest of its elements.

    Along fixed straight ground nothing changes, however far a body slips. Elements that are graded
    to nothing say nothing of what the surface is like further on.
    """
    slid = dict[str, float]()
    for posed, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        mesh = discrete.meshes[posed.body]
        if posed.holds_normal and np.ptp(mesh.normal[interface.nodes], axis=0).max() < WRITTEN:
            continue
        area = np.bincount(mesh.element, mesh.measure)[mesh.element[interface.nodes]].max()
        for result in results:
            pair = result.pairs[posed.name]
            way = np.linalg.norm(pair.slip, axis=1) * (pair.state != OPEN)
            size = area ** (1.0 / (mesh.dim - 1))
            _raise(slid, f"pair {posed.name!r}", way.max(initial=0.0) / size)
    return slid


def rolls(
    discrete: Discrete, pairs: Mapping[str, PairResult], bodies: Mapping[str, BodyResult]
) -> dict[str, float]:
    """How far round bodies that turn carry their contacts along, over the width of these.

    A disc that turns rolls on: its contact stays below its middle. With forces at undeformed places
    it moves along the disc, and its arm rights the disc where nothing else does.
    """
    turned = dict[str, float]()
    for posed, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = pairs[interface.name]
        closed = pair.state != OPEN
        if interface.held or posed.law.normal == "bonded" or not closed.any():
            continue
        place = pair.x[closed]
        width = float(discrete.meshes[posed.body].measure[interface.nodes[closed]].sum())
        for b, part in posed.ends:
            mesh, name = discrete.meshes[b], discrete.problem.body[b].name
            if np.ptp(mesh.normal[mesh.nodes_of(part)], axis=0).max() < WRITTEN:
                continue
            way = _turned(mesh, bodies[name].u, place)
            _raise(turned, f"body {name!r}", way / width ** (1.0 / (mesh.dim - 1)))
    return turned


def _turned(mesh: BoundaryMesh, u: Array, place: Array) -> float:
    """How far the rotation of the rigid motion nearest to a displacement moves some places about
    the middle of the body."""
    motions = mesh.motions.of(mesh.x).reshape(u.size, -1)
    turn = np.array(np.linalg.lstsq(motions, u.ravel(), rcond=None)[0])
    turn[: len(mesh.motions.along)] = 0.0
    middle = mesh.measure @ mesh.x / mesh.measure.sum()
    # what moves round the axis stays where it is in the half section
    moved = (mesh.motions.of(place, middle) @ turn)[:, : mesh.dim]
    return float(np.linalg.norm(moved, axis=1).max())


def _rigid_part(mesh: BoundaryMesh, u: Array) -> tuple[float, float]:
    """Largest rotation [rad] of the rigid motion nearest to a displacement (n, d), and the largest
    displacement over the size of the body [-]."""
    motions, size = unit_motions(mesh).reshape(u.size, -1), half_extent(mesh)
    amplitudes = np.linalg.lstsq(motions.T @ motions, motions.T @ u.ravel(), rcond=None)[0]
    rotation = amplitudes[len(mesh.motions.along) :] / size
    return float(np.abs(rotation).max(initial=0.0)), float(np.abs(u).max()) / (2.0 * size)


def _uneven(results: Sequence[StepResult]) -> list[Finding]:
    """Find tractions that are hardly in equilibrium."""
    left = max(
        (float(np.nan_to_num(result.residuals["equilibrium"])) for result in results), default=0.0
    )
    text, advice = f"tractions are in equilibrium to {left:.1e} only", "choose smaller elements"
    uneven = new_finding("uneven tractions", text, advice=advice, measured=left)
    return [uneven] if left > limit_of("uneven tractions") else []


def _rough(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find steps whose increments overlap between nodes, but whose last one is accepted."""
    overlapping = [result for result in results if overlap_of(result)]
    begun = dict.fromkeys(result.name for result in overlapping if result.load_factor == 1.0)
    rough = dict.fromkeys(
        result.name
        for result in overlapping
        if _is_asked_for(discrete, result) and result.name not in begun
    )
    advice = "refine the mesh there"
    ways = (
        (rough, "before its end: tractions of those increments are rough"),
        (
            begun,
            "by little next to what contact displaces in other steps: its own tractions are rough",
        ),
    )
    return [
        new_finding(
            "rough increments",
            f"surfaces overlap between nodes{', ' if names is begun else ' '}{how}",
            f"step {name!r}",
            advice=advice,
        )
        for names, how in ways
        for name in names
    ]


def _is_asked_for(discrete: Discrete, result: StepResult) -> bool:
    """Whether the config asks for this increment, and not for what the path needs."""
    steps = discrete.problem.step
    return result.step <= len(steps) and steps[result.step - 1].increments != "auto"


def _raise(largest: dict[str, float], key: str, value: float) -> None:
    largest[key] = max(largest.get(key, 0.0), float(value))
