"""Meshes of outlines from break points on their sides."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Index
from ..geometry.meridian import Meridian, TwistedMeridian
from ..geometry.outline import Outline, Side
from .curve_mesh import CurveMesh
from .ring_mesh import RingMesh, TwistedRingMesh

MESHES: dict[type, type[CurveMesh]] = {
    Outline: CurveMesh,
    Meridian: RingMesh,
    TwistedMeridian: TwistedRingMesh,
}
"""The class of mesh for each class of outline."""


def build_mesh(
    outline: Outline,
    breaks: Sequence[Array],
    orders: Sequence[Index],
    powers: Sequence[tuple[float, float]] = (),
) -> CurveMesh:
    """Return the mesh with given break points on each side.

    Parameters
    ----------
    outline : Outline
    breaks : list of (n_k + 1,) arrays, one a side
        Fractions of the side's arc length, increasing from 0 to 1.
    orders : list of (n_k,) arrays
        Orders of the elements of each side.
    powers : list of pairs of float, one a side, optional
        λ of the first and the last element if they are powers (and constant), else 0.
    """
    names = outline.parts
    start, end, side_start, arcs = [], [], [], []
    travelled = dict.fromkeys(names, 0.0)
    counts = [len(fractions) - 1 for fractions in breaks]
    order, power = np.concatenate(list(orders)).astype(np.int64), np.zeros(sum(counts))
    for side, fractions in zip(outline.sides, breaks, strict=True):
        points = side.point(fractions)
        start.append(points[:-1])
        end.append(points[1:])
        arcs.append(side.arcs(fractions))
        side_start.append(travelled[side.part] + side.length * fractions[:-1])
        travelled[side.part] += side.length
    for last, count, pair in zip(itertools.accumulate(counts), counts, powers, strict=False):
        for place, exponent in ((last - count, pair[0]), (last - 1, -pair[1])):
            power[place] = exponent if exponent and order[place] == 0 else power[place]
    direction, curvature = map(np.concatenate, zip(*arcs, strict=True))
    return MESHES[type(outline)](
        start=np.concatenate(start),
        end=np.concatenate(end),
        curvature=curvature,
        order=order,
        part=np.repeat([names.index(side.part) for side in outline.sides], counts),
        line=np.repeat(line_numbers(outline), counts),
        side_start=np.concatenate(side_start),
        part_names=names,
        unit_length=outline.log_length,
        direction=direction,
        power=power,
        thickness=outline.depth,
    )


def line_numbers(outline: Outline) -> list[int]:
    """Return the number of the straight line of each side, -1 for arcs.

    Consecutive collinear sides lie on one line.
    """
    numbers: list[int] = []
    for loop in outline.loops:
        reference = None
        for side in loop:
            if side.curvature != 0.0:
                numbers.append(-1)
                reference = None
            elif reference is not None and _collinear(reference, side):
                numbers.append(numbers[-1])
            else:
                numbers.append(len(numbers))
                reference = side
    return numbers


def _collinear(first: Side, later: Side) -> bool:
    """Return whether the later side continues the first one in a straight line, to round-off."""
    direction, chord = first.end - first.start, later.end - later.start
    offset = later.end - first.start
    off_line = abs(direction[0] * offset[1] - direction[1] * offset[0])
    return bool(
        off_line
        <= 1e-13 * float(direction @ direction)
        + 4e-16 * np.abs(later.end).max() * np.hypot(*direction)
        and direction @ chord > 0.0
    )
