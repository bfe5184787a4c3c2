"""Sides of one outline of which one is the other moved along: their joints, and which nodes belong
together."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...errors import InputError
from ...frozen import frozen
from ...geometry.outline import Outline
from ...round_off import SINGLE
from ..boundary_mesh import BoundaryMesh


@frozen
class TranslatedSides:
    """A `Projection` from the sides of a part to those of its partner, which the body lies on the
    other side of."""

    secondary: tuple[int, Index]
    primary: tuple[int, Index]

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Sides and fractions are counted from the other end."""
        count = len(self.secondary[1])
        return np.full(len(fractions), count - 1 - side), 1.0 - np.asarray(fractions)

    to_secondary = to_primary


def translated_sides(number: int, outline: Outline, part: str, partner: str) -> TranslatedSides:
    """The sides of a part of a body and of its partner.

    Raises
    ------
    InputError
        If one is not the other moved along.
    """
    own, other = (
        [k for k, side in enumerate(outline.sides) if side.part == name] for name in (part, partner)
    )
    same = len(own) == len(other)
    if same:
        pairs = [
            (outline.sides[a], outline.sides[b]) for a, b in zip(own, other[::-1], strict=True)
        ]
        length = sum(side.length for side, _ in pairs)
        ways = np.array([(b.end - a.start, b.start - a.end) for a, b in pairs]).reshape(-1, 2)
        turned = max(abs(a.curvature + b.curvature) for a, b in pairs) * length
        same = bool(np.ptp(ways, axis=0).max() <= SINGLE * length and turned <= SINGLE)
    if not same:
        raise InputError(
            f"part {partner!r} is not part {part!r} moved along, side by side; periodic parts are"
        )
    return TranslatedSides((number, np.array(own)), (number, np.array(other)))


def partner_nodes(mesh: BoundaryMesh, part: str, partner: str) -> Index:
    """The nodes of the partner in the order of those of the part, which the same elements carry
    from the other end."""
    own, other = mesh.nodes_of(part), mesh.nodes_of(partner)
    order = np.argsort(mesh.variables(own)["s"]), np.argsort(-mesh.variables(other)["s"])
    result = np.empty_like(own)
    result[order[0]] = other[order[1]]
    return result
