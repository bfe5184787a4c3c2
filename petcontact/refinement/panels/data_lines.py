"""Lines across faces on which given data have a kink or a jump: panels of boxes end there, and
other bodies may press there."""

from __future__ import annotations

import functools
import itertools
import math

import numpy as np

from ...arrays import Array
from ...geometry.meridian import meridian
from ...geometry.outline import Outline, Side
from ...geometry.same_place import TOLERANCE, distinct
from ...geometry.surface import BOX_PARTS, Boundary, BoxSurface, face_axes
from ...given.body_data import Body
from ...given.features import kinks, uniform
from ...given.lines import lines_of
from ...given.sites import Sites
from ...given.values import Given
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.pairs.box_faces import grid_lines, mesh_of_lines
from ...mesh.pairs.common_breakpoints import with_joints
from ...mesh.ring_mesh import RingMesh
from ...mesh.rough_places import MOST
from ...mesh.surface_mesh import SurfaceMesh
from ...round_off import SINGLE, SOLVED
from ..known_data import rough_data
from .tail import FADE


@functools.singledispatch
def with_data_lines(boundary: Boundary, body: Body, mesh: SurfaceMesh) -> SurfaceMesh:
    """Return the mesh of a box with panels that end at the lines of `data_lines`.

    Other ends of panels that are too close to a line are dropped. The meshes of other bodies
    stay as they are."""
    return mesh


@with_data_lines.register
def _(box: BoxSurface, body: Body, mesh: SurfaceMesh) -> SurfaceMesh:
    lines = data_lines(body, box)
    sides = grid_lines(box, mesh) if any(map(len, lines)) else []
    if not sides:
        return mesh
    return mesh_of_lines(
        box,
        [
            with_joints(side, line) if len(line) else side
            for side, line in zip(sides, lines, strict=True)
        ],
    )


def data_lines(body: Body, box: BoxSurface) -> list[Array]:
    """Return fractions of both axes of each face, twelve arrays, at which data have a kink or a
    jump.

    The kink or jump lies on a line across the face.

    Parameters
    ----------
    body : Body
    box : BoxSurface

    Examples
    --------
    >>> [line.round(3).tolist() for line in data_lines(body, box) if len(line)]
    [[0.25, 0.75]]
    """
    result, names = [np.empty(0) for _ in range(12)], list(BOX_PARTS)
    for condition in body.boundary:
        number = names.index(condition.part)
        terms = (term.given for _, term in rough_data(condition))
        data = itertools.chain.from_iterable(terms)
        varying = [datum for datum in data if datum.varies and datum.everywhere]
        for k, datum in itertools.product((0, 1), varying):
            fractions = _across(datum, box, condition.part, k)
            result[2 * number + k] = distinct(
                np.concatenate([result[2 * number + k], fractions]), TOLERANCE, 1.0
            )
    return result


@functools.singledispatch
def gap_edges(boundary: Boundary | BoundaryMesh, part: str, gap: Given) -> list[Array]:
    """Return the points (k, d) of each edge that presses on a part [length].

    What comes as a mesh may be given as the mesh: a result holds it, not the file of its outline.

    There the gap jumps, or has a kink that points to the part, as the apex of a wedge or, on the
    axis of revolution, of a cone. On a face of a box all points where the gap jumps are one edge.
    On other surfaces they are not looked for.
    """
    return []


@gap_edges.register
def _(boundary: Outline, part: str, gap: Given) -> list[Array]:
    points: list[Array] = []
    for number, line in enumerate(lines_of(boundary)):
        if line.side.part == part:
            bent, jumps = line.switches(gap)
            slopes = [line.slope(gap, fraction, way) for fraction in bent for way in (-1.0, 1.0)]
            pressing = np.sum(np.reshape(slopes, (-1, 2)), axis=1) > SINGLE
            apex = [
                float(end)
                for k, end in boundary.axis_ends
                if k == number and line.slope(gap, end, 1.0 - 2.0 * end) > SINGLE
            ]
            points += [*line.side.point(np.concatenate([jumps, bent[pressing], apex]))[:, None]]
    return points


@gap_edges.register
def _(mesh: CurveMesh, part: str, gap: Given) -> list[Array]:
    names = mesh.part_names
    loops = [
        tuple(
            Side(mesh.start[k], mesh.end[k], names[mesh.part[k]], float(mesh.curvature[k]))
            for k in loop
        )
        for loop in mesh.loops()
    ]
    # those of bodies of revolution are closed along the axis
    ends = [(loop, Side(loop[-1].end, loop[0].start, "")) for loop in loops]
    outline = Outline(tuple((*loop, last) if last.length else loop for loop, last in ends)).joined
    return gap_edges(meridian(outline) if isinstance(mesh, RingMesh) else outline, part, gap)


@gap_edges.register
def _(box: BoxSurface, part: str, gap: Given) -> list[Array]:
    if not gap.everywhere or math.isfinite(gap.degree):
        return []
    # they are closer than half of the strip beside an edge in which errors fade out
    along = math.ceil(2.0 / FADE)
    points = np.vstack([_jumps(gap, box, part, k, along) for k in (0, 1)])
    return [points] if 0 < len(points) <= MOST * along else []


def _jumps(gap: Given, box: BoxSurface, part: str, axis: int, count: int) -> Array:
    """Return the points (k, 3) at which a gap jumps along some lines across a face.

    Of each interval the half with the larger change is kept: it stays as large at a jump only.
    """
    width, cells = 1.0 / count, np.arange(count) / count
    low, share = (each.ravel() for each in np.meshgrid(cells, cells + 0.5 * width))

    def values(fractions: Array) -> Array:
        return gap.near(_sites(box, part, axis, share, fractions))

    ends = np.array([values(low), values(low + width)])
    least = np.maximum(0.5 * np.abs(ends[1] - ends[0]), SOLVED * np.abs(ends).max())
    while width > TOLERANCE:
        width *= 0.5
        middle = values(low + width)
        upper = np.abs(ends[1] - middle) > np.abs(middle - ends[0])
        low = low + upper * width
        ends = np.where(upper, [middle, ends[1]], [ends[0], middle])
    inside = (low > TOLERANCE) & (low < 1.0 - 2.0 * TOLERANCE)
    jumps = inside & (np.abs(ends[1] - ends[0]) > least)
    return _sites(box, part, axis, share[jumps], low[jumps]).x


def _across(datum: Given, box: BoxSurface, part: str, axis: int) -> Array:
    """Return the fractions of an axis of a face with a kink, or a jump, on at least two lines along
    it."""
    shares = uniform()
    far = float(np.abs([box.lower, box.upper]).max() / (box.upper - box.lower).min())

    def values(share: float, fractions: Array) -> Array:
        return datum.near(_sites(box, part, axis, share, fractions))

    # multiples of the golden section: only a line across has equal kinks at two of them
    found = [
        kinks(functools.partial(values, share), shares, values(share, shares), far)
        for share in 0.618 * np.arange(1.0, 8.0) % 1.0
    ]
    ends = np.sort(np.concatenate([fractions for fractions, _ in found]))
    lines = distinct(ends[1:][np.diff(ends) < TOLERANCE], TOLERANCE, 1.0)
    lines = lines[(lines > 0.0) & (lines < 1.0)]
    return lines if len(lines) <= MOST else np.empty(0)


def _sites(box: BoxSurface, part: str, axis: int, share: Array | float, fractions: Array) -> Sites:
    """Return the sites at fractions (n,) of an axis of a face, at a share, or shares (n,), of the
    other axis."""
    across, side = BOX_PARTS[part]
    axes, shares = face_axes(across, side), np.empty((len(fractions), 3))
    shares[:, axes[axis]] = fractions
    shares[:, axes[1 - axis]] = share
    shares[:, across] = float(side)
    normal = np.zeros_like(shares)
    normal[:, across] = 2 * side - 1
    return Sites(box.lower + shares * (box.upper - box.lower), normal)
