"""Sides of one outline that are translations of one another: their joints and their nodes."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index, scattered
from ...errors import InputError
from ...geometry.outline import Outline
from ...record import record
from ...round_off import SINGLE
from ..boundary_mesh import BoundaryMesh


@record
class TranslatedSides:
    """The `PartProjection` from the sides of a part to those of its partner.

    The body lies on opposite sides of the two.
    """

    secondary: tuple[int, Index]
    primary: tuple[int, Index]

    def to_primary(self, side: int, fractions: Array) -> tuple[Index, Array]:
        """Return sides and fractions, counted from the opposite end."""
        count = len(self.secondary[1])
        return np.full(len(fractions), count - 1 - side), 1.0 - np.asarray(fractions)

    to_secondary = to_primary


def translated_sides(number: int, outline: Outline, part: str, partner: str) -> TranslatedSides:
    """Return the projection from a part of a body to its partner.

    Raises
    ------
    InputError
        If one is not a translation of the other.
    """
    own, opposite = (
        [k for k, side in enumerate(outline.sides) if side.part == name] for name in (part, partner)
    )
    same = len(own) == len(opposite)
    if same:
        pairs = [
            (outline.sides[a], outline.sides[b]) for a, b in zip(own, opposite[::-1], strict=True)
        ]
        length = sum(side.length for side, _ in pairs)
        ways = np.array([(b.end - a.start, b.start - a.end) for a, b in pairs]).reshape(-1, 2)
        turned = max(abs(a.curvature + b.curvature) for a, b in pairs) * length
        same = bool(np.ptp(ways, axis=0).max() <= SINGLE * length and turned <= SINGLE)
    if not same:
        raise InputError(
            f"part {partner!r} is not part {part!r} moved along, side by side; periodic parts are"
        )
    return TranslatedSides((number, np.array(own)), (number, np.array(opposite)))


def partner_nodes(mesh: BoundaryMesh, part: str, partner: str) -> Index:
    """Return the partner's nodes in the order of the part's nodes.

    The partner has the same elements, in reverse order.
    """
    own, opposite = mesh.nodes_of(part), mesh.nodes_of(partner)
    order = np.argsort(mesh.sites(own).along), np.argsort(-mesh.sites(opposite).along)
    return scattered(opposite[order[1]], order[0], len(own))
