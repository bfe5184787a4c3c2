"""Panels along a band of contact: long along it, narrow across it, in frames around it.

Lines along the band lie at shares of its half-width, lines across it are dense where p changes
along it. The number of panels grows with the logarithm of its length over its width.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array
from ...geometry.chart import Chart
from ...geometry.round_surfaces import GRID
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SINGLE
from .forecast import WIDER
from .frames import TWICE, frames_around, nine_points
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
    inner = (
        ringed(chart, zone, level + 1)
        if isinstance(zone, ContactEllipse)
        else _inner(zone, chart, level)
    )
    if inner is None:
        return None
    frames = _turned_less(np.concatenate([inner.outer, *frames_around(chart, inner)]), chart)
    order = np.append(inner.order, np.full(len(frames), 2))
    on_face = _on_face(np.concatenate([inner.cells, frames]), order, chart)
    if on_face is None:
        return None
    cells, order = on_face
    points = chart.at(cells.reshape(-1, 2)).reshape(-1, 9, 3)
    if chart.flat:
        points[_straight(cells), 4:] = np.nan
    return points, order


def _on_face(cells: Array, order: Array, chart: Chart) -> tuple[Array, Array] | None:
    """Return the panels that lie on the face itself, and not beyond planes of symmetry, and their
    orders. Those that are their own images are halved; None if another one crosses such a plane, as
    where a second contact lies between it and a band."""
    for side, axis in np.argwhere(chart.mirrored):
        end = chart.sides[side, axis]
        for k in (0, 1):
            off = cells[..., axis] - end
            crosses = (off.min(axis=1) < -chart.slack) & (off.max(axis=1) > chart.slack)
            one, other = (np.abs(off[:, 5 - n] - off[:, 7 - n]) for n in (k, 1 - k))
            crosses &= one > other
            cells = np.concatenate([cells[~crosses], _halves(cells[crosses], k)])
            order = np.concatenate([order[~crosses], np.repeat(order[crosses], 2)])
        off = cells[..., axis] - end
        if ((off.min(axis=1) < -chart.slack) & (off.max(axis=1) > chart.slack)).any():
            return None
        cells[np.abs(off) < chart.slack, axis] = end
        own = (off[:, 8] > 0.0) == (side == 0)
        cells, order = cells[own], order[own]
    return cells, order


def _inner(band: ContactBand, chart: Chart, level: int) -> Inner | None:
    """Return the panels in and next to a band; None if it does not fit."""
    s = _along(band, level, chart)
    half = twice_as_fine(band.lines_at(s, LEAST))
    ridge, across = band.at(twice_as_fine(s))
    lines, (low, high) = _across(level)[:, None] * half, _room_across(chart, ridge[0], across[0])
    lines[(lines < low).any(axis=1)], lines[(lines > high).any(axis=1)] = low, high
    lines = np.unique(lines, axis=0)
    grid = ridge + twice_as_fine(lines)[..., None] * across
    if chart.round or not (chart.holds(grid.reshape(-1, 2), chart.slack).all() and band.straight):
        return None
    cells, ends = _turned_less(cells_of(grid), chart), grid[::2, ::2]
    rim = [ends[:, 0], ends[-1, :], ends[::-1, -1], ends[0, ::-1]]
    width = (MARGIN - 1.0) * band.widest
    return Inner(cells, cells[:0], np.full(len(cells), 2), rim, *_axes(band), width)


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


def _straight(cells: Array) -> Array:
    """Return which panels (n, 9, 2) have straight sides and their middle point in the middle."""
    off = np.abs(cells - nine_points(cells[:, :4])).max(axis=(1, 2))
    size = np.ptp(cells[:, :4], axis=1).min(axis=1)
    return np.asarray(off < SINGLE * size)


def _axes(band: ContactBand) -> tuple[Array, Array]:
    """Return the middle of a straight band and two unit vectors, across and along it, as rows."""
    points, across = band.at(np.array([0.5 * (band.ends[0] + band.ends[1])]))
    return points[0], np.array([across[0], [-across[0][1], across[0][0]]])


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
    return np.concatenate([cells[:0], *map(cells_of, twice)])
