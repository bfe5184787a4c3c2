"""Closed surfaces of bodies in space: boxes, and facets, flat or curved, whose orientation and
closedness are checked."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import scipy

from ..arrays import Array, Index, Mask, linked, shown
from ..errors import InputError
from ..record import field, record
from ..round_off import CHAINED
from .arcs import check_digits
from .crossings import first_crossing, winding
from .quadratic import QuadraticCells

BOX_PARTS = {
    "left": (0, 0),
    "right": (0, 1),
    "front": (1, 0),
    "back": (1, 1),
    "bottom": (2, 0),
    "top": (2, 1),
}
"""Axis and side of each face of a box."""
SLIVER = 1e-4
"""Smallest height of a facet over its longest edge."""
TURNED = np.array([[2, 1, 0, 3, 4], [3, 2, 1, 0, 4]])
"""Middles of the sides of triangles and quadrilaterals whose corners are run through in the other
direction."""


class Boundary:
    """The boundary of any body, an outline or a surface.

    Attributes
    ----------
    dim : int
        Of points.
    components : int
        Of displacements.
    parts : tuple of str
        Names of its parts.
    diameter : float
        Of its bounding box [length].
    exterior : bool
        Whether the body is what lies outside.
    closed : bool
        Whether it is all of the boundary of a finite body, on which tractions are in equilibrium
        with the loads inside.
    known : bool
        Whether it is a shape that elements of any size may be made of without a user's asking.
    exact : bool
        Whether it is a curved surface, and `onto` brings points onto it.
    meshed : bool
        Whether it comes as a mesh, whose elements are taken as they are.
    has_inside : bool
        Whether the inside is known: not that of a superelement.
    graded : bool
        Whether meshes that are adapted are graded along it anew; panels are cut.
    """

    if TYPE_CHECKING:  # fields in some classes, computed in others

        @property
        def dim(self) -> int: ...
        @property
        def components(self) -> int: ...
        @property
        def parts(self) -> tuple[str, ...]: ...
        @property
        def diameter(self) -> float: ...

    exterior: bool = False
    known: bool = False
    exact: bool = False
    meshed: bool = False
    has_inside: bool = True
    graded: bool = False

    @property
    def closed(self) -> bool:
        """Whether it is all of the boundary of a finite body."""
        return not self.exterior

    def onto(self, part: Index, points: Array) -> Array:
        """Points (n, k, 3) of panels of parts (n,), brought onto the exact surface; as they are
        where none is known."""
        return points


def face_axes(axis: int, side: int) -> tuple[int, int]:
    """The two axes of a face of a box, so that they and the outward normal are right-handed."""
    return ((axis + 1) % 3, (axis + 2) % 3) if side else ((axis + 2) % 3, (axis + 1) % 3)


class SolidSurface(Boundary):
    """The whole surface of a finite body in space, see `Boundary`."""

    dim = components = 3


@record
class BoxSurface(SolidSurface):
    """The six faces of [lower, upper], parts left x-, right x+, front y-, back y+, bottom z-, top
    z+ [length]."""

    lower: Array
    upper: Array
    parts: tuple[str, ...] = tuple(BOX_PARTS)
    known = True

    def __post_init__(self) -> None:
        check_digits(float((self.upper - self.lower).min()), [self.lower, self.upper], "box")

    @property
    def diameter(self) -> float:
        """Length of the diagonal [length]."""
        return float(np.linalg.norm(self.upper - self.lower))


@record
class FacetSurface(SolidSurface):
    """Facets, counter-clockwise seen from outside.

    Attributes
    ----------
    points : (n, 3) array
        [length]
    facets : (k, 4) int array
        Corners; -1 comes last in triangles.
    part : (k,) int array
        Number of each facet's part in `parts`.
    parts : tuple of str
    middles : (k, 5) int array, optional
        Of curved facets the middles of the sides, from the one after the first corner on, and of
        quadrilaterals the point in the middle; else -1.
    """

    points: Array
    facets: Index
    part: Index
    parts: tuple[str, ...]
    middles: Index = field(default_factory=lambda: np.empty((0, 5), dtype=np.int64))
    meshed = True

    def __post_init__(self) -> None:
        if not len(self.middles):
            object.__setattr__(self, "middles", np.full((len(self.facets), 5), -1))

    @property
    def diameter(self) -> float:
        """Length of the diagonal of the bounding box [length]."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0)))


def checked_surface(surface: FacetSurface, source: str) -> FacetSurface:
    """The surface with all normals outward, unneeded points dropped.

    Raises
    ------
    InputError
        If it is open, facets meet more than in pairs, points are doubled, facets are slivers,
        folded or cross, or it encloses separate pieces; one line that says
        where, beginning with `source`.
    """
    cells = np.column_stack([surface.facets, surface.middles])
    used, cells = np.unique(cells, return_inverse=True)
    first = int(used[0] < 0)
    points, cells = surface.points[used[first:]], cells.reshape(-1, 9) - first
    if not np.all(np.isfinite(points)):
        raise InputError(f"{source}: coordinates that are not finite")
    _check_points(points, source)
    _check_shapes(points, cells, source)
    flip = _orientation(points, cells, source)
    cells[flip] = _reversed(cells[flip])
    cells = _outward(points, cells, _components(cells[:, :4]), source)
    place = first_crossing(points, _triangles(cells)[0])
    if place is not None:
        raise InputError(f"{source}: the surface crosses itself near {shown(place)}")
    return FacetSurface(points, cells[:, :4], surface.part, surface.parts, cells[:, 4:])


def _check_points(points: Array, source: str) -> None:
    size = float(np.ptp(points, axis=0).max())
    pairs = scipy.spatial.cKDTree(points).query_pairs(CHAINED * size, output_type="ndarray")
    if len(pairs):
        raise InputError(
            f"{source}: {shown(points[pairs[0, 0]])} is given by two nodes ({len(pairs)} such "
            "pairs); join duplicate nodes (Gmsh: Coherence Mesh)"
        )


def _check_shapes(points: Array, cells: Index, source: str) -> None:
    """Refuse facets without a height, and folded ones."""
    facets = cells[:, :4]
    corners = points[np.where(facets >= 0, facets, facets[:, :1])]
    edge = np.roll(corners, -1, axis=1) - corners
    length = np.linalg.norm(edge, axis=2)
    longest = length.max(axis=1)
    triangles, owner = _triangles(cells)
    a, b, c = points[triangles].transpose(1, 0, 2)
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / longest[owner]
    worst = int(np.argmin(height / longest[owner]))
    if not height[worst] > SLIVER * longest[owner[worst]]:
        raise InputError(
            f"{source}: the facet at {shown(points[triangles[worst]].mean(axis=0))} is a sliver, "
            f"its height below {SLIVER:g} of its longest edge"
        )
    folded = folded_cells(points, cells)
    if len(folded):
        raise InputError(
            f"{source}: the curved cell at {shown(corners[folded[0]].mean(axis=0))} is folded or "
            f"turned inside out between its nodes ({len(folded)} such cells)"
        )


def folded_cells(points: Array, cells: Index) -> Index:
    """Numbers of the curved cells whose area factor is zero or turns round somewhere,
    increasing."""
    result = []
    for triangle, columns in ((True, [0, 1, 2, 4, 5, 6]), (False, list(range(9)))):
        of_shape = np.flatnonzero((cells[:, 4] >= 0) & ((cells[:, 3] < 0) == triangle))
        result.append(
            of_shape[np.isinf(QuadraticCells(points[cells[of_shape][:, columns]]).distortion)]
        )
    return np.sort(np.concatenate(result))


def _edges(facets: Index) -> tuple[Index, Index]:
    """Directed edges (e, 2) and their facets (e,)."""
    following = np.where(
        np.roll(facets, -1, axis=1) >= 0, np.roll(facets, -1, axis=1), facets[:, :1]
    )
    real = facets >= 0
    owner = np.broadcast_to(np.arange(len(facets))[:, None], facets.shape)
    return np.column_stack([facets[real], following[real]]), owner[real]


def _orientation(points: Array, cells: Index, source: str) -> Index:
    """Facets to turn round so that each edge is run through once in either direction."""
    facets = cells[:, :4]
    edges, owner = _edges(facets)
    middles = cells[:, 4:8][facets >= 0]
    ends = np.sort(edges, axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    ends, edges, owner = ends[order], edges[order], owner[order]
    starts = np.flatnonzero(np.concatenate([[True], np.any(ends[1:] != ends[:-1], axis=1)]))
    count = np.diff(np.append(starts, len(ends)))
    wrong = np.flatnonzero(count != 2)
    if len(wrong):
        n = int(count[wrong[0]])
        what = "is open: one facet" if n == 1 else f"is no boundary of a body: {n} facets"
        a, b = points[ends[starts[wrong[0]]]]
        raise InputError(
            f"{source}: the surface {what} at the edge from {shown(a)} to {shown(b)}, two must "
            f"meet ({len(wrong)} such edges)"
        )
    facet, neighbour = owner[starts], owner[starts + 1]
    way = np.where(
        middles[order] < 0, 0.5 * points[edges].sum(axis=1).T, points[middles[order]].T
    ).T
    gaping = np.flatnonzero(
        np.linalg.norm(way[starts] - way[starts + 1], axis=1)
        > CHAINED * np.ptp(points, axis=0).max()
    )
    if len(gaping):
        a, b = points[ends[starts[gaping[0]]]]
        raise InputError(
            f"{source}: the surface is open at the edge from {shown(a)} to {shown(b)}: its two "
            f"facets have different points in the middle of it ({len(gaping)} such edges)"
        )
    label = _copies(len(facets), facet, neighbour, edges[starts, 0] != edges[starts + 1, 0])
    n = len(facets)
    if np.any(label[:n] == label[n:]):
        k = int(np.argmax(label[:n] == label[n:]))
        raise InputError(
            f"{source}: the surface has one side only (like a Moebius strip) at "
            f"{shown(points[facets[k, 0]])}"
        )
    seen = np.full(label.max() + 1, -1)
    for k in range(n):
        # the first facet of a component stays as it is
        if seen[label[k]] < 0 and seen[label[k + n]] < 0:
            seen[label[k]] = k
    return np.flatnonzero(seen[label[:n]] < 0)


def _copies(n: int, facet: Index, neighbour: Index, agree: Mask) -> Index:
    """Components (2n,) that n facets and their reversed copies are in, where neighbours agree or
    not."""
    # two copies of each facet, as it is and reversed: neighbours that agree join equal copies, else
    # opposite ones
    rows = np.concatenate([facet, facet + n])
    columns = np.concatenate(
        [np.where(agree, neighbour, neighbour + n), np.where(agree, neighbour + n, neighbour)]
    )
    return linked(np.stack([rows, columns]), 2 * n)


def _reversed(cells: Index) -> Index:
    """Corners (and middles) in the other direction, the first corner kept."""
    triangle = cells[:, 3] < 0
    result = cells[:, [0, 3, 2, 1, *(4 + TURNED[1])]]
    result[triangle] = cells[triangle][:, [0, 2, 1, 3, *(4 + TURNED[0])]]
    return result


def _components(facets: Index) -> Index:
    """Number of the closed surface that each facet belongs to."""
    corners = np.where(facets >= 0, facets, facets[:, :1])
    n, k = len(facets), int(facets.max()) + 1
    rows = np.repeat(np.arange(n), 4)
    label = linked(np.stack([rows, n + corners.ravel()]), n + k)[:n]
    return np.asarray(np.unique(label, return_inverse=True)[1])


CUTS = {
    (3, False): ((0, 1, 2),),
    (4, False): ((0, 1, 2), (0, 2, 3)),
    (3, True): ((0, 4, 6), (4, 1, 5), (6, 5, 2), (4, 5, 6)),
    (4, True): (
        (0, 4, 7),
        (4, 1, 5),
        (5, 2, 6),
        (6, 3, 7),
        (4, 5, 8),
        (5, 6, 8),
        (6, 7, 8),
        (7, 4, 8),
    ),
}
"""Flat triangles that stand for a facet of some corners, curved or not, by its corners and
middles."""


def _triangles(cells: Index) -> tuple[Index, Index]:
    """Facets cut into triangles (t, 3), and the facet of each."""
    triangle, curved = cells[:, 3] < 0, cells[:, 4] >= 0
    parts, owners = [], []
    for (corners, bent), cuts in CUTS.items():
        of_shape = np.flatnonzero((triangle == (corners == 3)) & (curved == bent))
        for cut in cuts:
            parts.append(cells[of_shape][:, cut])
            owners.append(of_shape)
    return np.vstack(parts), np.concatenate(owners)


def _outward(points: Array, cells: Index, bodies: Index, source: str) -> Index:
    """The outer surface with positive volume, those of cavities with negative."""
    result, outer = cells.copy(), list[Array]()
    for body in range(int(bodies.max()) + 1):
        of_body = bodies == body
        triangles = _triangles(cells[of_body])[0]
        inside = sum(
            winding(points[_triangles(cells[bodies == second])[0]], points[triangles[0, :1]])[0]
            > 0.5
            for second in range(int(bodies.max()) + 1)
            if second != body
        )
        if not inside % 2:
            outer.append(points[triangles[0, 0]])
        a, b, c = (points[triangles] - points[triangles[0, 0]]).transpose(1, 0, 2)
        volume = float(np.sum(a * np.cross(b, c)))
        if (volume > 0.0) == bool(inside % 2):
            result[of_body] = _reversed(cells[of_body])
    if len(outer) > 1:
        raise InputError(
            f"{source}: {len(outer)} separate pieces, at {shown(outer[0])} and {shown(outer[1])}; "
            "a body is one piece: make a file and a [[body]] of each"
        )
    return result
