"""What the sides of a corner do: whether they touch something, and what that is."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar

import numpy as np

from ...arrays import Array, Complex, Index
from ...contact.friction_law import lengths
from ...contact.law_protocol import OPEN, SLIP
from ...geometry.rotation import lifted
from ...given.interface_data import Law
from ...given.tables.material import Material
from ...linalg.nearest import Nearest
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record, replace
from ...refinement.corner_exponents import (
    CLAMPED,
    FREE,
    NEAR,
    SLIDING,
    SideKind,
    Slip,
    known_on,
    wedge,
)
from ...refinement.corner_modes import Expansion
from ...refinement.panels.edges import SMOOTH
from ...round_off import SINGLE
from ..records import BodyResult, PairResult
from .corners import Corners

LINE = 3
"""Points of an edge that say which way it runs: the nearest one, and one on either side."""
MOST = 0.5
"""Share of what lies beside a place that is closed, or slips, for the contact there to do so."""
NEARLY = 0.06
"""Least singular value of the matrix of a corner for λ = 1 up to which one of its exponents lies
within `refinement.corner_modes.STRONG` of 1: it is about three times as far off."""
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
    at_end : float
        As `friction`, in the element at the corner.
    """

    partner: Partner
    friction: float
    normal: Array
    along: Array
    unlike: Array
    at_end: float

    @property
    def kind(self) -> SideKind:
        """What it is as seen from a rigid partner."""
        return Slip(self.friction) if math.isfinite(self.friction) else CLAMPED


def partner_of(law: Law, pair: PairResult, body: str, part: str, stiffer: float) -> Partner:
    """What a side may touch, by the law of its contact."""
    coulomb = law.friction_coefficient is not None and law.friction_bound is None
    return Partner(pair, body, part, stiffer, law.normal == "bonded", coulomb)


P = TypeVar("P")
"""What is found beside an expansion."""
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


def goes_on(angle: float, does: tuple[Does, Does]) -> bool:
    """Return whether a corner is a smooth point of a whole body: contact that slips meets a plane
    of symmetry at a right angle.

    Slip across the plane and its image are opposite. Friction opposes both and would hold them back
    without a bound next to the plane: contact sticks there, or slips along the plane.
    """
    slips = isinstance(does[0], Touching) and math.isfinite(does[0].friction)
    return slips and does[1] == SLIDING and abs(angle - 0.5 * math.pi) < SMOOTH


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
        return Touching(partner, math.inf, normal, along, mesh.x[nodes[slips | ~closed]], math.inf)
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
    return Touching(partner, friction, normal, along, mesh.x[nodes[~slips]], friction)


def nearest(own: Does | None, most: Does | None) -> Does | None:
    """What a side does by what its own element does and what most of it does: a contact may be
    narrower than what lies near, and what slips may slip the other way farther off."""
    if isinstance(own, Touching) and isinstance(most, Touching):
        both_slip = own.kind != CLAMPED != most.kind
        friction = own.friction if both_slip else most.friction
        return replace(most, friction=friction, at_end=own.friction)
    return own if most == FREE else most


def growing_at_ends(
    does: tuple[Does, Does], found: Callable[[tuple[Does, Does]], tuple[Expansion | None, P]]
) -> tuple[tuple[Does, Does], tuple[Expansion | None, P]]:
    """What the sides of a corner do, and what is found for it: stress that has a bound where a side
    sticks may have none where its end slips."""
    own, ends = found(does), (_at_end(does[0]), _at_end(does[1]))
    if own[0] is None or own[0].modes or ends == does:
        return does, own
    return ends, found(ends)


def _at_end(does: Does) -> Does:
    """What a side does next to the corner. If most of it does something else, no node farther out
    says how strongly stress grows there."""
    if not isinstance(does, Touching) or does.at_end == does.friction:
        return does
    return replace(does, friction=does.at_end, unlike=np.full((1, len(does.normal)), np.inf))


def nodes_beside(mesh: BoundaryMesh, ends: Array, part: str, element: int, reach: float) -> Index:
    """The nodes of a part that lie in an element, or nearer to a corner than some reach and across
    the piece of an edge (2, d) that it is: what lies along the edge may do something else."""
    nodes, edge = mesh.nodes_of(part), ends[1] - ends[0]
    ways = mesh.x[nodes] - ends.mean(axis=0)
    across = np.abs(ways @ edge) <= 0.5 * float(edge @ edge)
    near = (mesh.element[nodes] == element) | (across & (np.linalg.norm(ways, axis=1) < reach))
    return np.asarray(nodes[near])


def facing_nodes(pair: PairResult, size: Array, nodes: Index, x: Array) -> tuple[Index, Index]:
    """The nodes of a primary, at points (n, d), that face the secondary, whose nodes have elements
    of half lengths (m,), and the node of that each; what reaches beyond faces nothing."""
    rows = Nearest(pair.x)(x)[:, 0]
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
    nearest = Nearest(points)
    near = points[nearest(points[nearest(centre)[:, 0]], LINE)]
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


def mismatch(
    mesh: BoundaryMesh,
    found: BodyResult,
    material: Material,
    corners: Corners,
    number: int,
    sides: tuple[int, int],
    does: tuple[Does, Does],
) -> tuple[float, float]:
    """How far what is known on the two sides of a corner is from that of any uniform stress, where
    stress grows like a logarithm for it, and where it does so nearly, over the mean traction [-].

    Two components are known on each side. Those of uniform stress and a rotation may be others
    where the four equations for these depend on each other: λ = 1 is an exponent of the corner. Of
    two free sides one of them is no equation, since a stress that depends on the angle balances any
    tractions, but on a straight side (Timoshenko and Goodier, Theory of Elasticity, § 45). There,
    and where a side slides at a right angle to the other one, stress grows like (2/π) m log(1/r)
    with the difference m of two shears.

    Parameters
    ----------
    mesh : BoundaryMesh
    found : BodyResult
    material : Material
    corners, number
        Those of the body, and which of them.
    sides, does
        The sides, that at θ = 0 first, and what they do.
    """
    data = 2.0 * material.shear_modulus * found.u, found.traction
    kinds, angle = [kind_of(each) for each in does], float(corners.angle[number])
    touching = (each for each in does if isinstance(each, Touching) and each.partner.body)
    if any(each.kind == CLAMPED for each in touching):
        return 0.0, 0.0
    if (free := kinds == [FREE, FREE]) and abs(angle - math.pi) > NEAR:
        return 0.0, 0.0
    given: Array = np.ravel(
        [
            known_on(_beside(mesh, data, corners, number, sides, turn)[None, :, None], kind)
            for turn, kind in enumerate(kinds)
        ]
    ).real
    given[1::2] *= not free  # on a straight side stress has a bound where pressure jumps
    matrix = wedge(angle, 3.0 - 4.0 * material.plane_strain_ratio, *kinds)
    left, size, _ = np.linalg.svd(matrix(np.ones(1, dtype=complex))[0].real)
    left, told = left[:, size < NEARLY], np.isfinite(given)
    if np.abs(left[~told]).max(initial=0.0) > NEAR:
        return 0.0, 0.0
    given = given[told] @ left[told] * math.sqrt(2.0)
    given /= float(mesh.weight @ lengths(data[1]) / mesh.weight.sum()) or 1.0
    exact = given[size[size < NEARLY] < NEAR]
    return float(np.linalg.norm(exact)), float(np.linalg.norm(given))


def felt(mesh: BoundaryMesh, traction: Array, error: float) -> float:
    """Return the `mismatch` beside contact from which on it is more than an error.

    Tractions and slopes are known there to the relative error of the largest traction. A mismatch
    adds as large a share of the mean traction as it is one of `MISMATCH`."""
    size = lengths(traction)
    mean = float(mesh.weight @ size / mesh.weight.sum()) or 1.0
    return max(SINGLE, MISMATCH * float(np.nan_to_num(error)) * float(size.max()) / mean)


def growing(
    found: Sequence[Expansion], differ: tuple[float, float], least: float
) -> tuple[Expansion, ...]:
    """How stress grows towards a corner, by its `mismatch`: the expansions that have modes, or all
    where stress is told as a value that is slow to settle.

    A mismatch of at most `least` is one of errors."""
    # from λ = 2 on stress changes no more by all halvings to come than by the last one
    slow = differ[1] > least or min(each.slowest for each in found) < 2.0 - NEAR
    modes = tuple(each for each in found if each.modes)
    return modes or tuple(found) * (slow and differ[0] <= MISMATCH)


def _beside(
    mesh: BoundaryMesh,
    data: tuple[Array, Array],
    corners: Corners,
    number: int,
    sides: tuple[int, int],
    turn: int,
) -> Complex:
    """The slopes of 2µ u_r and 2µ u_θ along an element beside a corner, NaN unless u is linear, and
    σ_rθ and σ_θθ next to it, (4,) [stress]."""
    x, element = corners.x[number], corners.element[number, sides[turn]]
    nodes = np.arange(mesh.first_node[element], mesh.first_node[element + 1])
    nearest = nodes[np.linalg.norm(mesh.x[nodes] - x, axis=1).argmin()]
    along, sign = corners.along[number, sides[turn]], 1 - 2 * turn
    axes = np.stack([along, sign * corners.inward[number, sides[turn]]])
    axes = lifted(axes, mesh.components)
    away = mesh.x[nodes] - mesh.x[nodes].mean(axis=0)
    moved = (data[0][nodes] - data[0][nodes].mean(axis=0)) @ axes.T
    slopes = np.linalg.pinv(away) @ moved
    bent = np.abs(moved - away @ slopes).max() > SINGLE * np.abs(data[0]).max(initial=0.0)
    # of a curved side the normal there: pressure is no shear
    normal, pull = lifted(mesh.normal[nearest], mesh.components), data[1][nearest]
    stress = -sign * float((pull - (pull @ normal) * normal) @ axes[0]), float(pull @ normal)
    return np.append(np.full(2, np.nan) if bent else along @ slopes, stress).astype(complex)
