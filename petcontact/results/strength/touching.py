"""What the sides of a corner do: whether they touch something, and what that is."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
import scipy

from ...arrays import Array, Index
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN, SLIP
from ...geometry.rotation import lifted
from ...given.interface_data import Law
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record
from ...refinement.corner_exponents import CLAMPED, FREE, SLIDING, SideKind, Slip
from ...refinement.panels.edges import SMOOTH
from ...round_off import SINGLE
from ..records import PairResult
from .corners import Corners

LINE = 3
"""Points of an edge that say which way it runs: the nearest one, and one on either side."""
MOST = 0.5
"""Share of what lies beside a place that is closed, or slips, for the contact there to do so."""
MISMATCH = 0.23
"""Difference of two known shears at a right angle, over the mean of the body's tractions, from
which on stress has no bound there. It adds as much as that traction at a thousandth of the size:
(2/π) 0.23 log(1e3) = 1. The mean has a bound where tractions have none."""


@record
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


@record
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
    unlike : (k, d) array
        Nodes beside the corner that do something else: contact that sticks on the whole may slip
        next to its end [length].
    """

    partner: Partner
    friction: float
    normal: Array
    along: Array
    unlike: Array

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


def core_of(x: Array, does: Iterable[Does | None]) -> float:
    """The distance from a corner (d,) within which its sides do something else [length]."""
    unlike = [each.unlike for each in does if isinstance(each, Touching)]
    away = [np.linalg.norm(points - x, axis=1) for points in unlike]
    return float(np.concatenate([np.zeros(1), *away]).max())


def firmness(does: Does) -> int:
    """Of the two sides that with the larger number is θ = 0."""
    return 3 if isinstance(does, Touching) else {CLAMPED: 2, FREE: 0}.get(str(does), 1)


def touched(
    mesh: BoundaryMesh, traction: Array, partner: Partner, nodes: Index, rows: Index, frame: Array
) -> Does:
    """What some nodes of a side do by what most of them do, if they may touch a partner.

    Parameters
    ----------
    mesh : BoundaryMesh
        Of the body.
    traction : (n, d) array
        At all its nodes [stress].
    partner : Partner
    nodes, rows : (m,) arrays
        Nodes of the body, and their rows in the pair.
    frame : (2, d) array
        Unit vectors along the side, away from the corner, and across it, into the body.
    """
    (along, across), pair = frame, partner.pair
    weight = mesh.measure[nodes]
    closed, slips = pair.state[rows] != OPEN, pair.state[rows] == SLIP
    if weight[closed].sum() <= MOST * weight.sum():
        return FREE
    normal = pair.normal[rows[closed][0]]
    if weight[slips].sum() <= MOST * weight[closed].sum():
        return Touching(partner, math.inf, normal, along, mesh.x[nodes[slips | ~closed]])
    force = weight[slips] @ traction[nodes[slips]]
    pressed: Array = pair.pressure[rows[slips]]
    friction = 0.0
    if partner.coulomb and (pressed > 0.0).any():
        bound: Array = pair.bound[rows[slips]]
        most = float(np.median(bound[pressed > 0.0] / pressed[pressed > 0.0]))
        out, way = lifted(np.stack([across, along]), len(force))
        pull = force - (force @ out) * out
        most *= float(pull @ way) / (float(np.linalg.norm(pull)) or 1.0)
        friction = round(float(np.sign(force @ out)) * most, 6)
    return Touching(partner, friction, normal, along, mesh.x[nodes[~slips]])


def nodes_beside(mesh: BoundaryMesh, x: Array, part: str, element: int, reach: float) -> Index:
    """The nodes of a part that lie in an element, or nearer to a corner than some reach."""
    nodes = mesh.nodes_of(part)
    away = np.linalg.norm(mesh.x[nodes] - x, axis=1)
    near = (mesh.element[nodes] == element) | (away < reach)
    return np.asarray(nodes[near])


def facing_nodes(pair: PairResult, size: Array, nodes: Index, x: Array) -> tuple[Index, Index]:
    """The nodes of a primary, at points (n, d), that face the secondary, whose nodes have elements
    of half lengths (m,), and the node of that each; what reaches beyond faces nothing."""
    rows = scipy.spatial.cKDTree(pair.x).query(x)[1]
    away, normal = x - pair.x[rows], pair.normal[rows]
    away -= np.sum(away * normal, axis=1)[:, None] * normal
    faces = np.linalg.norm(away, axis=1) < (1.0 + SINGLE) * size[rows]
    return nodes[faces], rows[faces]


def pressed_at(points: Array, centre: Array, radius: Array) -> list[tuple[Array, Array]]:
    """The pieces (2, d) of an edge beside elements, and the stretches (2, d) of all pieces on one
    line.

    Parameters
    ----------
    points : (k, d) array
        Of the edge; in the plane it is one point, and so are pieces and stretches [length].
    centre, radius : (n, d) and (n,) arrays
        Of spheres around the elements [length].
    """
    tree = scipy.spatial.cKDTree(points)
    nearest = points[tree.query(centre)[1]]
    near = points[tree.query(nearest, range(1, min(LINE, len(points)) + 1))[1]]
    middle = near.mean(axis=1)
    _, size, ways = np.linalg.svd(near - middle[:, None], full_matrices=False)
    way = ways[:, 0] * (size[:, :1] > 0.0)
    foot = middle + np.sum((centre - middle) * way, axis=1)[:, None] * way
    away, kept = np.linalg.norm(foot - centre, axis=1) / radius, list[int]()
    for k in np.argsort(away, kind="stable").tolist():
        apart = np.linalg.norm(foot[kept] - foot[k], axis=1)
        if away[k] < 2.0 and np.all(apart > 0.5 * radius[k]):
            kept.append(k)
    return [_piece(foot[kept], radius[kept], j, way[k]) for j, k in enumerate(kept)]


def _piece(foot: Array, radius: Array, number: int, way: Array) -> tuple[Array, Array]:
    """One of the pieces of an edge about feet (n, d), along a unit vector, and its stretch."""
    along = (foot - foot[number]) @ way
    off = np.linalg.norm(foot - foot[number] - np.outer(along, way), axis=1)
    ends = (along + np.array([[-1.0], [1.0]]) * radius)[:, off < 0.5 * radius[number]]
    stretch = [ends.min(), ends.max()]
    own = np.outer([-radius[number], radius[number], *stretch], way) + foot[number]
    return own[:2], own[2:]


def shears_differ(
    mesh: BoundaryMesh, traction: Array, corners: Corners, number: int, does: tuple[Does, Does]
) -> bool:
    """Whether the two sides of a right angle have known shears that differ, by tractions (n, d).

    No stress is uniform there: it grows like (2/π) m log(1/r) with the difference m.
    """
    known, right = {FREE, SLIDING, Slip(0.0)}, abs(corners.angle[number] - 0.5 * math.pi) < SMOOTH
    if not (right and known.issuperset(map(kind_of, does))):
        return False
    shears = list[float]()
    for element, along in zip(corners.element[number], corners.along[number], strict=True):
        nodes = np.arange(mesh.first_node[element], mesh.first_node[element + 1])
        away = np.linalg.norm(mesh.x[nodes] - corners.x[number], axis=1)
        nearest = nodes[away.argmin()]
        # of a curved side the normal there: pressure is no shear
        normal = lifted(mesh.normal[nearest], mesh.components)
        pull = traction[nearest] - (traction[nearest] @ normal) * normal
        shears.append(float(pull @ lifted(along, mesh.components)))
    mean = float(mesh.weight @ lengths(traction) / mesh.weight.sum())
    return bool(abs(shears[0] - shears[1]) > MISMATCH * mean)
