"""Panels along a band of contact: long along it, narrow across it, in frames around it.

Lines along the band lie at shares of its half-width, lines across it are dense where p changes
along it. The number of panels grows with the logarithm of its length over its width.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...geometry.charts import Chart
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SINGLE
from .forecast import WIDER, from_end
from .hanging import closed
from .rings import CORE, FRAMES, SHRINK, cells_of, twice_as_fine
from .tiles import tiles
from .zone import ContactBand

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


Laid = tuple[Chart, ContactBand, int]
"""A chart of a part, a band on it, and the number of lines between its ridge and its edge."""


def banded(mesh: SurfaceMesh, part: str, *laid: Laid) -> SurfaceMesh | None:
    """Return the mesh with the panels of a part laid along bands, or None if they do not fit.

    Parameters
    ----------
    mesh : SurfaceMesh
        Its other parts stay as they are.
    part : str
    *laid : tuple
        Charts of the part, each with a band on it and the number of lines between the ridge and the
        edge.
    """
    charts, bands, levels = zip(*laid, strict=True)
    own = zip(tiles(charts, bands), bands, levels, strict=False)
    made = [_laid(*each) for each in own]
    pieces = [piece for piece in made if piece is not None]
    if not pieces or len(pieces) < len(made):
        return None
    number = mesh.part_names.index(part)
    kept = mesh.part != number
    points = np.concatenate(pieces)
    return closed(
        SurfaceMesh(
            np.concatenate([mesh.corners[kept], points[:, :4]]),
            np.append(mesh.order[kept], np.full(len(points), 2)),
            np.append(mesh.part[kept], np.full(len(points), number)),
            mesh.part_names,
            np.concatenate([mesh.middles[kept], points[:, 4:]]),
        )
    )


def _laid(chart: Chart, band: ContactBand, level: int) -> Array | None:
    """Return the points (n, 9, 3) of panels of a chart with a band, NaN for the middles of straight
    ones; None if the band does not fit."""
    s = _along(band, level, chart)
    half = twice_as_fine(band.lines_at(s, LEAST))
    ridge, across = band.at(twice_as_fine(s))
    lines, (low, high) = _across(level)[:, None] * half, _room_across(chart, ridge[0], across[0])
    lines[(lines < low).any(axis=1)], lines[(lines > high).any(axis=1)] = low, high
    lines = np.unique(lines, axis=0)
    grid = ridge + twice_as_fine(lines)[..., None] * across
    outside = np.any((grid < chart.low - chart.slack) | (grid > chart.high + chart.slack))
    if outside or not band.straight:
        return None
    width = (MARGIN - 1.0) * band.widest
    panels = [cells_of(grid), *_frames(chart, band, grid[::2, ::2], width)]
    cells = _turned_less(np.concatenate(panels), chart)
    points = chart.at(cells.reshape(-1, 2)).reshape(-1, 9, 3)
    if chart.flat:
        points[_straight(cells), 4:] = np.nan
    return points


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


def _frames(chart: Chart, band: ContactBand, grid: Array, width: float) -> list[Array]:
    """Return the panels of frames around a grid up to the rim of the face.

    Each side of the grid moves outward by a width that grows, and to the rim where less than half
    of the width would be left. Sides at the rim stay. Around a slanted grid all sides stop
    together where the next frame would reach the rim, and the last frame leads from there to it:
    its panels turn from one direction to another, and need room for it.
    """
    origin, axes = _axes(band)
    inner = (grid - origin) @ axes.T
    rim = [inner[:, 0], inner[-1, :], inner[::-1, -1], inner[0, ::-1]]
    box = np.array([inner[..., 0].min(), inner[0, 0, 1], inner[..., 0].max(), inner[0, -1, 1]])
    face, last = _outermost(chart, (origin, axes), box)
    sign, result = np.array([-1.0, -1.0, 1.0, 1.0]), list[Array]()
    while True:
        done = (1.5 if face is None else 1.0 + FRAMES) * width > sign * (last - box)
        if face is not None and done.any():
            corners, done = face, done | True
        else:
            box = np.where(done, last, box + sign * width)
            corners = _box_corners(box)
        straight = [_is_straight(chart, origin + side @ axes) for side in rim]
        made, rim = _one_frame(rim, corners, width if result else 0.0, straight)
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
    """Return the corners of a slanted face (4, 2), or None, and the rectangle in which frames grow.

    They are in the band's own axes.
    """
    corners = (_box_corners(np.append(chart.low, chart.high)) - axes[0]) @ axes[1].T
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


def _one_frame(
    rim: list[Array], corners: Array, width: float, straight: list[bool]
) -> tuple[Array, list[Array]]:
    """Return the panels (n, 9, 2) between a rim, four sides of points, and the sides between
    corners (4, 2), and the new rim.

    With width 0 panels are as long as those inside. On a side that is not straight they end where
    those inside end: there would be slits between different parabolas otherwise.
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
        quads = np.stack([out[:-1], out[1:], side[1:], side[:-1]], axis=1)
        one, other = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
        square = np.maximum(np.sum(one**2, axis=1), np.sum(other**2, axis=1))
        cells.append(_nine(quads[np.abs(np.cross(one, other)) > SINGLE * square]))
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
    """Return both halves (2n, 9, 2) of panels with straight sides along a coordinate."""
    a, b, c, d = cells[:, :4].transpose(1, 0, 2)
    if axis == 0:
        low, high = 0.5 * (a + b), 0.5 * (d + c)
        halves = (a, low, high, d), (low, b, c, high)
    else:
        low, high = 0.5 * (a + d), 0.5 * (b + c)
        halves = (a, b, high, low), (low, high, c, d)
    corners = np.stack([np.stack(half, axis=1) for half in halves], axis=1).reshape(-1, 4, 2)
    return _nine(corners)
