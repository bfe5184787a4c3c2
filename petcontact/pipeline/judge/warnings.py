"""Warnings for accepted solutions: motions that are not small, and poor equilibrium of
tractions."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import half_extent, unit_motions
from ...contact.law_protocol import OPEN
from ...errors import the_body
from ...mesh.boundary_mesh import BoundaryMesh
from ...results.records import BodyResult, PairResult, StepResult
from ...results.report import Finding
from ...round_off import WRITTEN
from ..pose.discretise import Discrete
from .findings import limit_of, new_finding
from .increments import overlap_of
from .suspicious import usual

THIN = 5.0
"""Length over thickness from which plates bend more than they shear: of the deflection of a beam a
tenth is shear there [-]."""
ROLLED = "{} turns by {:.2g} widths of its contact"


def rolled_off(
    discrete: Discrete, pairs: Mapping[str, PairResult], bodies: Mapping[str, BodyResult]
) -> list[Finding]:
    """Find bodies that one increment turns by more than the width of their contact."""
    return _large("rolled off", ROLLED, rolls(discrete, pairs, bodies))


def absurd(discrete: Discrete, largest: Sequence[float]) -> Iterator[Finding]:
    """Find the body that moves farthest over its size, if it moves by more than is accepted.

    `largest` is the largest displacement of each body in the increment [length].
    """
    moved, number = max(
        (u / size, b) for b, (u, size) in enumerate(zip(largest, discrete.sizes, strict=True))
    )
    if moved > limit_of("displacement"):
        yield new_finding(
            "displacement",
            f"{the_body(discrete.posed.bodies[number].name)} moves by {moved:.1e} times its size, "
            f"at most {limit_of('displacement'):.0e} is accepted: displacements are taken to be "
            "small",
            advice="check the units of loads and moduli",
            measured=moved,
        )


def unusual(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find motions that are not small, and tractions that are not in equilibrium."""
    return [*_uneven(results), *_rough(discrete, results), *_motions(discrete, results)]


def _motions(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find bodies, obstacles and interfaces whose motions are not small."""
    turned, moved, bent, rolled = (dict[str, float]() for _ in range(4))
    for result in results:
        for mesh, body in zip(discrete.meshes, discrete.posed.bodies, strict=True):
            found = _rigid_part(mesh, result.bodies[body.name].u)
            for largest, value in zip((turned, moved, bent), found, strict=True):
                _raise(largest, the_body(body.name), value)
        for name, arc in rolls(discrete, result.pairs, result.bodies).items():
            _raise(rolled, name, arc)
        for name, obstacle in result.obstacles.items():
            _raise(turned, f"obstacle {name!r}", np.abs(obstacle.rotation).max())
    return [
        *_large("turn", "{} turns by {:.2g} rad", turned),
        *_large("roll", ROLLED, rolled),
        *_large("travel", "{} moves by {:.2g} times its size", moved),
        *_large("bend", "{} bends by about {:.1g} of its thickness", bent),
        *_large("slip", "{} slips by {:.2g} elements", _slips(discrete, results)),
    ]


def _large(kind: str, text: str, values: dict[str, float]) -> list[Finding]:
    """Return a finding for each value that exceeds the limit of its kind."""
    advice = "displacements are taken to be small"
    return [
        new_finding(kind, text.format(name, value), advice=advice, measured=value)
        for name, value in values.items()
        if value > limit_of(kind)
    ]


def _slips(discrete: Discrete, results: Sequence[StepResult]) -> dict[str, float]:
    """Return the largest slip in contact of each interface, over the size of its largest element
    [-].

    Slip along fixed straight ground changes no gap, however large it is: such interfaces are left
    out. The largest element is taken since graded elements are arbitrarily small at their point.
    """
    slid = dict[str, float]()
    for posed, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        mesh = discrete.meshes[posed.body]
        if posed.holds_normal and np.ptp(mesh.normal[interface.nodes], axis=0).max() < WRITTEN:
            continue
        area = np.bincount(mesh.element, mesh.measure)[mesh.element[interface.nodes]].max()
        for result in results:
            pair = result.pairs[posed.name]
            slip = np.linalg.norm(pair.slip, axis=1) * (pair.state != OPEN)
            size = area ** (1.0 / (mesh.dim - 1))
            _raise(slid, f"pair {posed.name!r}", slip.max(initial=0.0) / size)
    return slid


def rolls(
    discrete: Discrete, pairs: Mapping[str, PairResult], bodies: Mapping[str, BodyResult]
) -> dict[str, float]:
    """Return how far each turning round body carries its contacts along, over their width [-].

    A disc that turns rolls on: in truth its contact stays below its centre. The model applies
    forces at undeformed points, so that the contact moves along with the disc. Its arm then rights
    the disc even where nothing else would.
    """
    turned = dict[str, float]()
    for posed, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = pairs[interface.name]
        closed = pair.state != OPEN
        if interface.held or posed.law.normal == "bonded" or not closed.any():
            continue
        points = pair.x[closed]
        width = float(discrete.meshes[posed.body].measure[interface.nodes[closed]].sum())
        for b, part in posed.ends:
            mesh, name = discrete.meshes[b], discrete.posed.bodies[b].name
            if np.ptp(mesh.normal[mesh.nodes_of(part)], axis=0).max() < WRITTEN:
                continue
            arc = _turned(mesh, bodies[name].u, points)
            _raise(turned, the_body(name), arc / width ** (1.0 / (mesh.dim - 1)))
    return turned


def _turned(mesh: BoundaryMesh, u: Array, points: Array) -> float:
    """Return how far the rotation in a displacement moves the given points about the body's centre.

    The rotation is that of the rigid motion nearest to u (n, d) in least squares [length].
    """
    motions = mesh.motions.modes(mesh.x).reshape(u.size, -1)
    turn = np.array(np.linalg.lstsq(motions, u.ravel(), rcond=None)[0])
    turn[: len(mesh.motions.along)] = 0.0
    middle = mesh.measure @ mesh.x / mesh.measure.sum()
    # the half section does not show motions around the axis
    moved = (mesh.motions.modes(points, middle) @ turn)[:, : mesh.dim]
    return float(np.linalg.norm(moved, axis=1).max())


def _rigid_part(mesh: BoundaryMesh, u: Array) -> tuple[float, float, float]:
    """Return the rotation [rad] and the travel [-] in a displacement u (n, d), and the deflection
    beyond them [-].

    The rotation is the largest component of the rigid motion nearest to u in least squares. The
    travel is the largest displacement over the size of the body. The deflection is that across the
    surface, from end to end, over twice the volume over the surface, which of a plate is its
    thickness; 0 of bodies that are not thin.
    """
    motions, size = unit_motions(mesh).reshape(u.size, -1), half_extent(mesh)
    amplitudes = np.linalg.lstsq(motions.T @ motions, motions.T @ u.ravel(), rcond=None)[0]
    rotation = amplitudes[len(mesh.motions.along) :] / size
    left = (u.ravel() - motions @ amplitudes).reshape(u.shape)[:, : mesh.dim]
    across = usual(np.abs(np.sum(left * mesh.normal, axis=1)), mesh.weight)
    thickness = 2.0 * mesh.weight @ (mesh.x[:, -1] * mesh.normal[:, -1]) / mesh.weight.sum()
    thin = 0.0 < THIN * thickness < 2.0 * size
    deflection = 2.0 * across / thickness if thin else 0.0
    travel = float(np.abs(u).max()) / (2.0 * size)
    return float(np.abs(rotation).max(initial=0.0)), travel, float(deflection)


def _uneven(results: Sequence[StepResult]) -> Iterator[Finding]:
    """Find that the tractions of some increment are not in equilibrium."""
    left = max(
        (float(np.nan_to_num(result.residuals["equilibrium"])) for result in results), default=0.0
    )
    if left > limit_of("uneven tractions"):
        yield new_finding(
            "uneven tractions",
            f"tractions are in equilibrium to {left:.1e} only",
            advice="choose smaller elements",
            measured=left,
        )


def _rough(discrete: Discrete, results: Sequence[StepResult]) -> list[Finding]:
    """Find accepted steps with increments that overlap between nodes: on the way, or at the end by
    little next to what contact displaces in other steps."""
    rough = dict.fromkeys(
        result.name
        for result in results
        if overlap_of(result) and (result.ends or _is_asked_for(discrete, result))
    )
    text = "surfaces overlap between nodes in some increments: their tractions are rough"
    return [
        new_finding("rough increments", text, f"step {name!r}", advice="refine the mesh there")
        for name in rough
    ]


def _is_asked_for(discrete: Discrete, result: StepResult) -> bool:
    """Return whether the config asks for this increment; others only follow the path."""
    steps = discrete.posed.steps
    return result.step <= len(steps) and steps[result.step - 1].increments != "auto"


def _raise(largest: dict[str, float], key: str, value: float) -> None:
    largest[key] = max(largest.get(key, 0.0), float(value))
