"""Panels along a band of contact: long along it, narrow across it, in frames around it.

Lines along the band lie at shares of its half-width, lines across it are dense where p changes
along it. The number of panels grows with the logarithm of its length over its width.
"""

from __future__ import annotations

import functools
import math

import numpy as np

from ...arrays import Array
from ...geometry.charts import Chart
from ...geometry.round_surfaces import GRID
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SINGLE
from .forecast import WIDER, from_end
from .hanging import closed
from .rings import CORE, FRAMES, SHRINK, Inner, cells_of, ringed, twice_as_fine
from .tiles import tiles
from .zone import ContactBand, ContactEllipse, Zone

MARGIN = 1.4
"""Outermost line along a band over its half-width [-]: the panels there are open."""
FOLLOWED = 0.02
"""Error of parabolas of panels along a band over the L2 norm of the load, with one line between
the ridge and the edge [-]. It falls by `SHRINK` with each further line."""
FIRST = 0.5
"""Length of the first panel at an end where p is infinite, over the half-width [-]; where p is a
root there, it is twice as long."""
LONGEST = 0.25
"""Longest panel over the length of a band [-]."""
LEAST = 0.35
"""Least half-width of lines along a band over the largest one [-]: lines that meet at an end make
wedges."""
TURN = 0.25 * math.pi
"""Largest angle between opposite sides of a panel on a curved face [rad], as of first meshes."""
LEVELS = 4
"""Numbers of lines between the ridge and the edge of a band, from 0."""


ARCS = 3
"""Least number of panels on a quarter of the rim of a disc: their parabolas are off by 1e-4 of its
radius."""
TWICE = np.array([[8, 0, 0], [3, 6, -1], [0, 8, 0], [-1, 6, 3], [0, 0, 8]]) / 8.0
"""Values of a parabola at five points by those at three."""


Laid = tuple[Chart, Zone, int]
"""A chart of a part, a zone on it, and the number of lines between its ridge and its edge."""


def banded(mesh: SurfaceMesh, part: str, *laid: Laid) -> SurfaceMesh | None:
    """Return the mesh with the panels of a part laid along zones, or None if they do not fit.

    Parameters
    ----------
    mesh : SurfaceMesh
        Its other parts stay as they are.
    part : str
    *laid : tuple
        Charts of the part, each with a zone on it and the number of lines between the ridge and the
        edge; an ellipse has one ring more.
    """
    charts, zones, levels = zip(*laid, strict=True)
    own = zip(tiles(charts, zones), zones, levels, strict=False)
    pieces = [piece for each in own if (piece := _laid(*each)) is not None]
    if not pieces or len(pieces) < len(laid):
        return None
    number = mesh.part_names.index(part)
    kept = mesh.part != number
    points, order = (np.concatenate(each) for each in zip(*pieces, strict=True))
    return closed(
        SurfaceMesh(
            np.concatenate([mesh.corners[kept], points[:, :4]]),
            np.append(mesh.order[kept], order),
            np.append(mesh.part[kept], np.full(len(points), number)),
            mesh.part_names,
            np.concatenate([mesh.middles[kept], points[:, 4:]]),
        )
    )


def _laid(chart: Chart, zone: Zone, level: int) -> tuple[Array, Array] | None:
    """Return the points (n, 9, 3) of panels of a chart with a zone, NaN for the middles of straight
    ones, and their orders; None if the zone does not fit."""
    inner = inner_panels(zone, chart, level)
    if inner is None:
        return None
    made = _frames(chart, inner)
    if not made:
        return None
    frames = _turned_less(np.concatenate(made), chart)
    cells = np.concatenate([inner.cells, frames])
    points = chart.at(cells.reshape(-1, 2)).reshape(-1, 9, 3)
    if chart.flat:
        points[_straight(cells), 4:] = np.nan
    return points, np.append(inner.order, np.full(len(frames), 2))


@functools.singledispatch
def inner_panels(zone: Zone, chart: Chart, level: int) -> Inner | None:
    """Return the panels in and next to a zone; None if it does not fit."""
    raise NotImplementedError


@inner_panels.register
def _(zone: ContactEllipse, chart: Chart, level: int) -> Inner | None:
    return ringed(chart, zone, level + 1)


@inner_panels.register
def _(band: ContactBand, chart: Chart, level: int) -> Inner | None:
    s = _along(band, level, chart)
    half = twice_as_fine(band.lines_at(s, LEAST))
    ridge, across = band.at(twice_as_fine(s))
    lines, (low, high) = _across(level)[:, None] * half, _room_across(chart, ridge[0], across[0])
    lines[(lines < low).any(axis=1)], lines[(lines > high).any(axis=1)] = low, high
    lines = np.unique(lines, axis=0)
    grid = ridge + twice_as_fine(lines)[..., None] * across
    if not (chart.holds(grid.reshape(-1, 2), chart.slack).all() and band.straight):
        return None
    cells, ends = _turned_less(cells_of(grid), chart), grid[::2, ::2]
    rim = [ends[:, 0], ends[-1, :], ends[::-1, -1], ends[0, ::-1]]
    width = (MARGIN - 1.0) * band.widest
    return Inner(cells, np.full(len(cells), 2), rim, *_axes(band), width)


def _room_across(chart: Chart, place: Array, across: Array) -> tuple[float, float]:
    """Return between which distances from a ridge lines along it lie on the face [length].

    Lines that would leave it become its rim. Slanted ones may: such bands are not laid.
    """
    if np.abs(across).max() < 1.0 - SINGLE:
        return -math.inf, math.inf
    return -chart.room(place, -across), chart.room(place, across)


def _across(level: int) -> Array:
    """Return the shares of the half-width at which lines run along a band."""
    inner = [1.0 - (1.0 - CORE) * SHRINK**k for k in range(level)]
    one = np.array([0.0, *inner, 1.0, MARGIN])
    return np.asarray(np.unique(np.concatenate([-one, one])))


def _along(band: ContactBand, level: int, chart: Chart) -> Array:
    """Return the places of lines across a band.

    Pieces are cut until a parabola follows the load on them, and at ends down to about the
    half-width. A panel lies beyond each end, as far as the face goes.
    """
    low, high = band.ends
    whole = math.sqrt(float(np.sum(band.load**2 * np.gradient(band.s))))
    most = FOLLOWED * SHRINK ** (level - 1) * whole
    ends, todo = {low, high}, [(low, 0.5 * (low + high)), (0.5 * (low + high), high)]
    while todo:
        a, b = todo.pop()
        ends |= {a, b}
        share = _share(band, (a, b), most, _bent(band, (a, b), level, chart))
        if share is not None:
            todo += [(a, a + share * (b - a)), (a + share * (b - a), b)]
    return _with_ends(np.array(sorted(ends)), band, chart)


def _with_ends(s: Array, band: ContactBand, chart: Chart) -> Array:
    """Return places along a ridge, with those beyond both ends as far away as the next ones inside,
    or at the rim of the face."""
    points, across = band.at(s[[0, -1]])
    out = np.array([[1.0], [-1.0]]) * across[:, ::-1] * [1.0, -1.0]
    room = [chart.room(*each) for each in zip(points, out, strict=True)]
    first, last = np.minimum(room, [s[1] - s[0], s[-1] - s[-2]]).tolist()
    return np.asarray(np.unique([s[0] - first, *s, s[-1] + last]))


def _bent(band: ContactBand, piece: tuple[float, float], level: int, chart: Chart) -> bool:
    """Return whether a piece of a band leaves its ridge: its panels are cut at the same places,
    since unlike neighbours would have slits between them."""
    ways = chart.tangents(band.at(np.array(piece))[0])
    turn = 2.0 * np.arcsin(0.5 * np.linalg.norm(ways[:, 0] - ways[:, 1], axis=1).max())
    width = np.diff(_across(level)).min() * band.widest
    return bool(turn > _most_turned(width / np.diff(piece)))


def _most_turned(share: Array) -> Array:
    """Return the largest angles between ends of panels that follow their arcs, by the shares of
    their width in their length [rad].

    A parabola through three points of an arc of length L and angle θ is off by 3 L θ³/2048. It may
    be off by as much of its width as bands are wider than expected (`WIDER`).
    """
    return np.asarray(np.minimum(TURN, np.cbrt((WIDER - 1.0) * 2048.0 / 3.0 * share)) + SINGLE)


def _share(band: ContactBand, piece: tuple[float, float], most: float, bent: bool) -> float | None:
    """Return the share at which a piece of a band is cut, or None where it is short enough."""
    (a, b), (low, high) = piece, band.ends
    length = b - a
    at = np.equal((a, b), (low, high)) & ~np.array(band.mirrored)
    sharp = bool((at & band.sharp).any())
    shortest = 2.0 * FIRST * band.widest
    if at.any() and length > (0.5 * shortest if sharp else shortest):
        share = 1.0 / FRAMES if sharp else SHRINK
        return share if at[0] else 1.0 - share
    rough = length > (LONGEST + SINGLE) * (high - low) or _missed(band, a, b) > most
    return 0.5 if (rough or bent) and length > shortest else None


def _missed(band: ContactBand, a: float, b: float) -> float:
    """Return the L2 norm of the load between two places less the best parabola."""
    t, w = np.polynomial.legendre.leggauss(12)
    basis = np.linalg.qr(np.vander(t, 3) * np.sqrt(w)[:, None])[0]
    values = band.load_at(0.5 * (a + b) + 0.5 * (b - a) * t) * np.sqrt(0.5 * (b - a) * w)
    return float(np.linalg.norm(values - basis @ (basis.T @ values)))


def _nine(corners: Array) -> Array:
    """Return the nine points of panels with straight sides from their corners (n, 4, 2)."""
    middles = 0.5 * (corners + np.roll(corners, -1, axis=1))
    return np.concatenate([corners, middles, corners.mean(axis=1, keepdims=True)], axis=1)


def _straight(cells: Array) -> Array:
    """Return which panels (n, 9, 2) have straight sides and their middle point in the middle."""
    off = np.abs(cells - _nine(cells[:, :4])).max(axis=(1, 2))
    size = np.ptp(cells[:, :4], axis=1).min(axis=1)
    return np.asarray(off < SINGLE * size)


def _frames(chart: Chart, inner: Inner) -> list[Array]:
    """Return the panels of frames around inner ones up to the rim of the face, or none if there is
    no room.

    Each side moves outward by a width that grows, and to the rim where less than half of the width
    would be left. Sides at the rim stay. Around a slanted rectangle all sides stop together where
    the next frame would reach the rim, and the last frame leads from there to it: its panels turn
    from one direction to another, and need room for it.
    """
    origin, axes, width = inner.origin, inner.axes, inner.width
    rim = [(side - origin) @ axes.T for side in inner.rim]
    every = np.concatenate(rim)
    box = np.append(every.min(axis=0), every.max(axis=0))
    face, last = _outermost(chart, (origin, axes), box)
    if chart.round and not np.abs(last - box).min() > 0.0:
        return []
    sign, result = np.array([-1.0, -1.0, 1.0, 1.0]), list[Array]()
    while True:
        done = (1.5 if face is None else 1.0 + FRAMES) * width > sign * (last - box)
        if face is not None and done.any():
            corners, done = face, done | True
        else:
            box = np.where(done, last, box + sign * width)
            corners = _box_corners(box)
        straight = [_is_straight(chart, origin + side @ axes) for side in rim]
        disc = (-axes @ origin, float(chart.high[0])) if chart.round and done.all() else None
        made, rim = _one_frame(rim, corners, width if result else 0.0, straight, disc)
        result.append(origin + made @ axes)
        if done.all():
            return result
        width *= FRAMES


def _is_straight(chart: Chart, side: Array) -> bool:
    """Return whether points (n, 2) lie on a straight line of the face, as on its generators."""
    x = chart.at(side)
    away = np.cross(x - x[0], x[-1] - x[0])
    return bool(np.abs(away).max() <= SINGLE * np.sum((x[-1] - x[0]) ** 2))


def _axes(band: ContactBand) -> tuple[Array, Array]:
    """Return the middle of a straight band and two unit vectors, across and along it, as rows."""
    points, across = band.at(np.array([0.5 * (band.ends[0] + band.ends[1])]))
    return points[0], np.array([across[0], [-across[0][1], across[0][0]]])


def _outermost(chart: Chart, axes: tuple[Array, Array], box: Array) -> tuple[Array | None, Array]:
    """Return the corners of a slanted face (4, 2), those of the square in a disc, or None, and the
    rectangle in which frames grow.

    They are in the band's own axes.
    """
    square = _box_corners(np.append(chart.low, chart.high))
    if chart.round:
        face = (math.sqrt(0.5) * square @ axes[1] - axes[0]) @ axes[1].T
        return face, _room_in(face, box)
    corners = (square - axes[0]) @ axes[1].T
    if np.abs(axes[1]).max(axis=1).min() > 1.0 - SINGLE:
        return None, np.array([*corners.min(axis=0), *corners.max(axis=0)])
    # panels between sides that are turned by more than 45 degrees to each other would fold
    along = np.roll(corners, -1, axis=0) - corners
    start = int(np.argmax(along[:, 0] / np.linalg.norm(along, axis=1)))
    face = np.roll(corners, -start, axis=0)
    return face, _room_in(face, box)


def _box_corners(box: Array) -> Array:
    """Return the corners (4, 2), counter-clockwise, of a rectangle (low x, low y, high x, high
    y)."""
    return np.asarray(box[np.array([[0, 1], [2, 1], [2, 3], [0, 3]])])


def _room_in(corners: Array, box: Array) -> Array:
    """Return the largest rectangle about as far from a box on all sides that lies in a convex
    polygon (n, 2)."""
    sign = np.array([-1.0, -1.0, 1.0, 1.0])
    along = np.roll(corners, -1, axis=0) - corners
    low, high = 0.0, float(np.ptp(corners, axis=0).max())
    for _ in range(50):
        middle = 0.5 * (low + high)
        away = _box_corners(box + sign * middle)[:, None] - corners
        inside = along[:, 0] * away[..., 1] - along[:, 1] * away[..., 0] > 0.0
        low, high = (middle, high) if inside.all() else (low, middle)
    return np.asarray(box + sign * low)


def _on_disc(place: Array, centre: Array, radius: float) -> Array:
    """Return the points of a circle in the direction of places (n, 2) from its centre."""
    way = place - centre
    return np.asarray(centre + radius * way / np.linalg.norm(way, axis=1, keepdims=True))


def _one_frame(
    rim: list[Array],
    corners: Array,
    width: float,
    straight: list[bool],
    disc: tuple[Array, float] | None = None,
) -> tuple[Array, list[Array]]:
    """Return the panels (n, 9, 2) between a rim, four sides of points, and the sides between
    corners (4, 2), and the new rim.

    With width 0 panels are as long as those inside. On a side that is not straight they end where
    those inside end: there would be slits between different parabolas otherwise. The new rim of a
    disc, with a centre and a radius, is its own.
    """
    cells, outer = list[Array](), list[Array]()
    for k, side in enumerate(rim):
        length = float(np.linalg.norm(side[-1] - side[0]))
        t = np.linalg.norm(side - side[0], axis=1) / length
        if width > 0.0:
            t = _shares_of(width / length) if straight[k] else _every_other(t, width / length)
            side = side[0] + t[:, None] * (side[-1] - side[0])
        start, end = corners[k], corners[(k + 1) % 4]
        out = start + t[:, None] * (end - start)
        if disc is not None:
            t = np.unique(np.concatenate([t, np.linspace(0.0, 1.0, ARCS + 1)]))
            side = side[0] + t[:, None] * (side[-1] - side[0])
            out = _on_disc(start + t[:, None] * (end - start), *disc)
        quads = np.stack([out[:-1], out[1:], side[1:], side[:-1]], axis=1)
        one, other = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
        square = np.maximum(np.sum(one**2, axis=1), np.sum(other**2, axis=1))
        nine = _nine(quads[np.abs(np.cross(one, other)) > SINGLE * square])
        if disc is not None:
            moved = _on_disc(nine[:, 4], *disc) - nine[:, 4]
            nine[:, [4, 8]] += np.stack([moved, 0.5 * moved], axis=1)
        cells.append(nine)
        outer.append(out)
    return np.concatenate(cells), outer


def _shares_of(width: float) -> Array:
    """Return the shares of a side at which panels end, about as long as they are wide at both ends
    and longer in the middle."""
    ends = from_end(0.5, 1.5 * width, 0.5, FRAMES) if 3.0 * width < 1.0 else [0.0, 0.5]
    return np.asarray(np.unique(np.concatenate([ends, 1.0 - np.asarray(ends)])))


def _every_other(t: Array, width: float) -> Array:
    """Return shares of a side, every other one where panels are shorter than they are wide."""
    return t[::2] if len(t) % 2 and np.diff(t).max() < width else t


def _turned_less(cells: Array, chart: Chart) -> Array:
    """Return the panels of a curved face, cut into equal pieces whose sides follow it: the normals
    of a ring that lies on a plane do not turn."""
    if chart.flat:
        return cells
    while True:
        ways = chart.tangents(cells[:, 4:8].reshape(-1, 2)).reshape(2, -1, 4, 3)
        turn = 2.0 * np.arcsin(
            0.5 * np.linalg.norm(ways[:, :, [1, 0]] - ways[:, :, [3, 2]], axis=3)
        )
        size = np.linalg.norm(cells[:, [5, 4]] - cells[:, [7, 6]], axis=2)
        over = turn.max(axis=0) > _most_turned(size[:, ::-1] / size)
        if not over.any():
            return cells
        axis = int(over.any(axis=0).argmax())
        wide = over[:, axis]
        cells = np.concatenate([cells[~wide], _halves(cells[wide], axis)])


def _halves(cells: Array, axis: int) -> Array:
    """Return both halves (2n, 9, 2) of panels along a coordinate."""
    grid = np.empty((len(cells), 3, 3, 2))
    grid[:, *np.transpose(GRID)] = cells
    twice = np.moveaxis(np.tensordot(TWICE, grid, axes=(1, axis + 1)), 0, axis + 1)
    return np.concatenate([cells_of(each) for each in twice])
