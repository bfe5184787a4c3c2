"""What estimates of the errors of tractions need of the meshes of contacts."""

from __future__ import annotations

from ...refinement.panels.edges import rim_powers
from ...refinement.panels.tail import Tails
from ..discrete.discretise import Discrete


def contact_tails(discrete: Discrete) -> list[Tails]:
    """Of each contact of a problem on meshes, with the powers that tractions have at its rim."""
    found, bodies = list[Tails](), discrete.problem.body
    for side, face in zip(discrete.sides, discrete.interfaces, strict=True):
        mesh, primary = discrete.meshes[side.body], bodies[side.primary[0]] if side.primary else None
        powers = rim_powers(mesh, bodies[side.body], side.part, primary, side.law.friction_coefficient or 0.0)
        found.append(Tails(mesh, face.nodes, powers))
    return found
