"""Corners of the outline of a body, or edges of its surface, where parts end or sides turn."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np

from ...arrays import Array, Index, largest_by
from ...geometry.arcs import turn_between
from ...mesh.surface_mesh import SurfaceMesh
from ...record import record
from ...refinement.panels.edges import SMOOTH, TOGETHER, edges
from ...round_off import SINGLE


@record
class Corners:
    """Corners of an outline, or edges of a surface.

    Attributes
    ----------
    ends : (k, 2, d) array
        Of each; a corner is both its ends [length].
    element : (k, 2) array
        The elements that meet there.
    angle : (k,) array
        Of the body, in (0, 2π) [rad].
    along, inward : (k, 2, d) arrays
        Unit vectors along the two sides, away from the corner, and into the body across them.
    radius : (k,) array
        The smaller one of sides that are arcs [length].
    """

    ends: Array
    element: Index
    angle: Array
    along: Array
    inward: Array
    radius: Array

    @functools.cached_property
    def x(self) -> Array:
        """The middle of each (k, d) [length]."""
        return np.asarray(self.ends.mean(axis=1))

    def meeting(self, foot: Array, elements: Index) -> int | None:
        """The number of the corner or edge on which the foot (d,) of a point on some elements lies,
        if there is one.

        Chords of a curved edge lie off it, but not along the side that ends there.
        """
        off, edge = foot - self.x, self.ends[:, 1] - self.ends[:, 0]
        length = np.linalg.norm(edge, axis=1)
        along = np.abs(np.einsum("kd,ksd->ks", off, self.along))
        away = np.where(np.isin(self.element, elements), along, np.inf).min(axis=1, initial=np.inf)
        beside = np.abs(np.sum(off * edge, axis=1)) <= (0.5 + TOGETHER) * length**2
        slack = SINGLE * float(np.abs(self.ends).max(initial=0.0))
        met = np.flatnonzero(beside & (away <= np.maximum(TOGETHER * length, slack)))
        return int(met[away[met].argmin()]) if met.size else None

    @functools.cached_property
    def nearest(self) -> Array:
        """The distance (k,) of the middle of each from the others, in the plane across it
        [length]."""
        return np.array([self._nearest(number) for number in range(len(self.ends))])

    def _nearest(self, number: int) -> float:
        start, end = self.ends[:, 0], self.ends[:, 1]
        way = end[number] - start[number]
        before, behind = ((each - self.x[number]) @ way for each in (start, end))
        crosses = before * behind <= 0.0
        share = np.divide(
            before, before - behind, out=np.zeros(len(before)), where=before != behind
        )
        away = np.linalg.norm(start + share[:, None] * (end - start) - self.x[number], axis=1)
        # a corner may be one point with another one: of a slit, of two loops
        apart = crosses & (away > SINGLE * float(np.abs(self.ends).max()))
        return float(away[apart].min(initial=np.inf))


@functools.singledispatch
def corners_of(mesh: Any) -> Corners:
    """Where the sides of a body turn, or one part ends and another begins."""
    before, _ = mesh.neighbours()
    bend = np.abs(mesh.curvature)
    normal = mesh.on_elements(np.arange(mesh.n_elements), np.array([-1.0, 1.0]))[1]
    ends = normal[..., ::-1] * [-1.0, 1.0]
    arriving, leaving = ends[before, 1], ends[:, 0]
    turn = turn_between(arriving, leaving)
    chosen = np.flatnonzero((np.abs(turn) > SMOOTH) | (mesh.part != mesh.part[before]))
    return Corners(
        mesh.start[chosen][:, None].repeat(2, axis=1),
        np.column_stack([chosen, before[chosen]]),
        math.pi - turn[chosen],
        np.stack([leaving[chosen], -arriving[chosen]], axis=1),
        -np.stack([normal[chosen, 0], normal[before[chosen], 1]], axis=1),
        1.0 / np.maximum(np.maximum(bend, bend[before]), np.finfo(float).tiny)[chosen],
    )


@corners_of.register
def _(mesh: SurfaceMesh) -> Corners:
    one, other, angle, ends = edges(mesh)
    # sides that hang on longer ones are paired one way only
    twice = np.isin(other + 1j * one, one + 1j * other)
    chosen = ((one < other) | ~twice) & (
        (np.abs(angle - math.pi) > SMOOTH) | (mesh.part[one] != mesh.part[other])
    )
    element, ends = np.column_stack([one[chosen], other[chosen]]), ends[chosen]
    # of a curved panel its normal in the middle
    middle = mesh.spheres[0][element]
    inward = -mesh.normal[mesh.first_node[element]]
    edge = ends[:, 1] - ends[:, 0]
    edge = edge / np.maximum(np.linalg.norm(edge, axis=1), np.finfo(float).tiny)[:, None]
    along = np.cross(inward, edge[:, None])
    along *= np.sign(np.sum(along * (middle - ends.mean(axis=1)[:, None]), axis=2))[..., None]
    return Corners(
        ends,
        element,
        _squared(mesh, element, angle[chosen]),
        along,
        inward,
        np.full(len(ends), np.inf),
    )


def _squared(mesh: SurfaceMesh, element: Index, angle: Array) -> Array:
    """Angles (k,) between panels (k, 2) [rad], right or straight where curved panels may be as far
    off: rims of polynomials of degree 2 are off by a tenth of what a triangle turns, measured at
    the pole of a sphere, and its nodes see half of that turn."""
    which = np.repeat(np.arange(mesh.n_elements), np.diff(mesh.first_node))
    first = mesh.normal[mesh.first_node[which]]
    turns = np.arccos(np.clip(np.sum(first * mesh.normal, axis=1), -1.0, 1.0))
    turned = largest_by(which, turns, mesh.n_elements)
    right = 0.5 * math.pi * np.round(angle / (0.5 * math.pi))
    return np.where(np.abs(angle - right) < 0.2 * turned[element].max(axis=1), right, angle)
