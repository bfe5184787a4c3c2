"""Warnings of a solution that is accepted: motions that are not small, tractions that are hardly in
equilibrium."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...bem.boundary_data import half_extent, unit_motions
from ...contact.law_protocol import OPEN
from ...results.records import StepResult
from ...round_off import WRITTEN
from ..pose.discretise import Discrete
from .increments import OVERLAPPING

TURN, TRAVEL = 0.1, 1.0
"""Rotation [rad], and displacement over the size of the body, beyond which displacements are not
small."""
ABSURD = 1e9
"""Displacement over the size of the body that is not accepted: loads and moduli are in different
units."""
UNEVEN = 0.02
"""Resultant of the tractions of a body over the sum of their sizes that is warned of, see
`increments.EQUILIBRIUM`."""


def absurd(discrete: Discrete, largest: Sequence[float]) -> str:
    """Why displacements of an increment are not accepted, by the body that moves farthest; empty
    where they are.

    `largest` is the largest displacement of each body [length].
    """
    moved, number = max(
        (u / size, b) for b, (u, size) in enumerate(zip(largest, discrete.sizes, strict=True))
    )
    if not moved > ABSURD:
        return ""
    name = discrete.problem.body[number].name
    return (
        f"body {name!r} moves by {moved:.1e} times its size, at most {ABSURD:.0e} is accepted: "
        f"displacements are "
        "taken to be small; check the units of loads and moduli"
    )


def unusual(discrete: Discrete, results: Sequence[StepResult]) -> list[str]:
    """What is said of motions that are not small, and of tractions without equilibrium."""
    turned, moved, slid = dict[str, float](), dict[str, float](), dict[str, float]()
    for result in results:
        for mesh, name in zip(
            discrete.meshes, (body.name for body in discrete.problem.body), strict=True
        ):
            body = result.bodies[name]
            motions, size = unit_motions(mesh).reshape(mesh.x.size, -1), half_extent(mesh)
            moves = np.linalg.lstsq(motions.T @ motions, motions.T @ body.u.ravel(), rcond=None)[0]
            rotation = moves[len(mesh.motions.along) :] / size
            _raise(turned, f"body {name!r}", np.abs(rotation).max(initial=0.0))
            _raise(moved, f"body {name!r}", np.abs(body.u).max() / (2.0 * size))
        for name, obstacle in result.obstacles.items():
            _raise(turned, f"obstacle {name!r}", np.abs(obstacle.rotation).max())
        for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
            mesh, pair = discrete.meshes[side.body], result.pairs[side.name]
            if side.holds_normal and np.ptp(mesh.normal[interface.nodes], axis=0).max() < WRITTEN:
                continue  # along fixed straight ground nothing changes, however far it slips
            area = np.bincount(mesh.element, mesh.measure)[mesh.element[interface.nodes]]
            way = np.linalg.norm(pair.slip, axis=1) * (pair.state != OPEN)
            # elements that are graded to nothing say nothing of what the surface is like further on
            _raise(
                slid,
                f"pair {side.name!r}",
                way.max(initial=0.0) / area.max() ** (1.0 / (mesh.dim - 1)),
            )
    small = "; displacements are taken to be small"
    overlapping = [result for result in results if OVERLAPPING in result.reason]
    begun = dict.fromkeys(result.name for result in overlapping if result.load_factor == 1.0)
    rough = dict.fromkeys(
        result.name
        for result in overlapping
        if _is_asked_for(discrete, result) and result.name not in begun
    )
    uneven = max(
        (float(np.nan_to_num(result.residuals["equilibrium"])) for result in results), default=0.0
    )
    return [
        *[f"tractions are in equilibrium to {uneven:.1e} only; choose smaller elements"]
        * bool(uneven > UNEVEN),
        *(
            f"step {name!r}: {OVERLAPPING} before its end: tractions of those increments are "
            f"rough; refine the mesh there"
            for name in rough
        ),
        *(
            f"step {name!r}: {OVERLAPPING}, by little next to what contact displaces in other "
            f"steps: its own tractions are "
            "rough; refine the mesh there"
            for name in begun
        ),
        *(
            f"{name} turns by {value:.2g} rad{small}"
            for name, value in turned.items()
            if value > TURN
        ),
        *(
            f"{name} moves by {value:.2g} times its size{small}"
            for name, value in moved.items()
            if value > TRAVEL
        ),
        *(
            f"{name} slips by {value:.2g} elements{small}"
            for name, value in slid.items()
            if value > 1.0
        ),
    ]


def _is_asked_for(discrete: Discrete, result: StepResult) -> bool:
    """Whether the config asks for this increment, and not for what the path needs."""
    steps = discrete.problem.step
    return result.step <= len(steps) and steps[result.step - 1].increments != "auto"


def _raise(largest: dict[str, float], key: str, value: float) -> None:
    largest[key] = max(largest.get(key, 0.0), float(value))
