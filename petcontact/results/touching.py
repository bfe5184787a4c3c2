"""What the sides of a corner do: whether they touch something, and what that is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from ..arrays import Array, Index
from ..given.interfaces import Law
from ..refinement.corner_exponents import CLAMPED, FREE, SideKind, Slip
from ..round_off import SINGLE
from .records import PairResult


@dataclass(frozen=True)
class Partner:
    """What a side of a body may touch.

    Attributes
    ----------
    pair : PairResult
    body, part : str
        The other body, or empty for what is rigid, and its part.
    stiffer : float
        Its shear modulus over that of the body.
    bonded : bool
    coulomb : bool
        Whether friction grows with pressure: beside one without a bound a given bound is nothing.
    """

    pair: PairResult
    body: str
    part: str
    stiffer: float
    bonded: bool
    coulomb: bool


@dataclass(frozen=True)
class Touching:
    """A side that touches something at a corner.

    Attributes
    ----------
    partner : Partner
    friction : float
        σ_rθ over σ_θθ where it slips, infinite where it sticks, with θ = 0 on this side.
    normal, along : (d,) arrays
        Along which it faces the partner, one way or the other, and along the side, away from the
        corner.
    """

    partner: Partner
    friction: float
    normal: Array
    along: Array

    @property
    def kind(self) -> SideKind:
        """What it is as seen from a rigid partner."""
        return Slip(self.friction) if math.isfinite(self.friction) else CLAMPED


def partner_of(law: Law, pair: PairResult, body: str, part: str, stiffer: float) -> Partner:
    """What a side may touch, by the law of its contact."""
    coulomb = law.friction_coefficient is not None and law.friction_bound is None
    return Partner(pair, body, part, stiffer, law.normal == "bonded", coulomb)


Does = Touching | SideKind
"""What a side of a corner does: what it touches, or what kind it is."""


def kind_of(does: Does) -> SideKind:
    """Of a side, as seen from what is rigid."""
    return does.kind if isinstance(does, Touching) else does


def firmness(does: Does) -> int:
    """Of the two sides that with the larger number is θ = 0."""
    return 3 if isinstance(does, Touching) else {CLAMPED: 2, FREE: 0}.get(str(does), 1)


def facing_nodes(pair: PairResult, size: Array, nodes: Index, x: Array) -> tuple[Index, Index]:
    """The nodes of a primary, at points (n, d), that face the secondary, whose nodes have elements
    of half lengths (m,), and the node of that each; what reaches beyond faces nothing."""
    rows = scipy.spatial.cKDTree(pair.x).query(x)[1]
    away, normal = x - pair.x[rows], pair.normal[rows]
    away -= np.sum(away * normal, axis=1)[:, None] * normal
    faces = np.linalg.norm(away, axis=1) < (1.0 + SINGLE) * size[rows]
    return nodes[faces], rows[faces]
