"""Contacts as they are expected from the shapes of both faces: a zone at each place where the gap
is least."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from ...arrays import Array, Mask
from ...fields.boundary.places import all_at
from ...geometry.chart import Chart
from ...geometry.charts import chart_of, disc_of
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ...record import Keeping, record, replace
from ...refinement.panels.basins import Within, basins, shares
from ...refinement.panels.compact import ellipse_of
from ...refinement.panels.face_gaps import face_gap, touching
from ...refinement.panels.forecast import (
    Forecast,
    Line,
    band_of,
    force_at,
    forecast_across,
    is_alone,
)
from ...refinement.panels.ridge import Gap, Ridge, is_ring, lowest_sample, ridge_of
from ...refinement.panels.zone import ELONGATED, ContactEllipse
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ...round_off import CHAINED, SINGLE, TINY
from .known_forces import load_of
from .long_contacts import ZonedContact

STEPS, KNOWN = 8, 0.01
"""Most steps to the shares of one force, each of which leaves at most half of an error, and the
relative error with which they are known [-]."""


@record
class Shape:
    """Where a contact begins.

    Attributes
    ----------
    charts : list of Chart
        Of its faces.
    gap : callable
        The gap on the first one; it is infinite in other basins.
    start : (2,) array
        A place near the least gap [length].
    ridge : Ridge or None
        The ridge there.
    """

    charts: list[Chart]
    gap: Gap
    start: Array
    ridge: Ridge | None


Pressed = tuple[ZonedContact, float, float]
"""A contact in one basin, its least gap [length], and the approach [length]."""


class Expected(Keeping):
    """Expects contacts from the shapes of faces and a force, or an overlap.

    Parameters
    ----------
    posed : Posed
    """

    def __init__(self, posed: Posed) -> None:
        self._posed, self._boundaries = posed, posed.boundaries

    def zones(
        self,
        side: PosedInterface,
        force: float,
        meshes: Sequence[SurfaceMesh],
        solution: Solution | None,
    ) -> list[ZonedContact]:
        """Return the contacts that a force makes, one in each basin of the gap; none of them if one
        is neither an ellipse nor long."""
        shape = self._shape(side, solution, meshes)
        first = shape and self._pressed(side, shape, force, meshes)
        if shape is None or not first:
            return []
        shapes = self._parts(side, shape, first[2], solution, meshes)
        forces = np.full(len(shapes), force / len(shapes))
        for _ in range(STEPS):
            tried = [
                self._pressed(side, *each, meshes) for each in zip(shapes, forces, strict=True)
            ]
            found = [each for each in tried if each]
            if len(found) < len(shapes):
                return []
            last, (least, approach) = forces, np.array([each[1:] for each in found]).T
            forces = shares(last, least, approach)
            if np.allclose(forces, last, rtol=KNOWN):
                break
            shapes = [shape for shape, own in zip(shapes, forces, strict=True) if own > 0.0]
            forces = forces[forces > 0.0]
        fits = map(_is_all, shapes, found)
        return [long for long, *_ in found] if all(fits) else []

    def force(
        self,
        side: PosedInterface,
        approach: float,
        meshes: Sequence[SurfaceMesh],
        solution: Solution | None,
    ) -> float:
        """Return the force that ends an overlap; 0 where there is no ridge."""
        shape = self._shape(side, solution, meshes)
        if shape is None or shape.ridge is None:
            return 0.0
        thin = min(float(np.ptp(meshes[b].x, axis=0).min()) for b in side.bodies)
        deep, whole = 0.5 * thin, 0.0
        for part in self._parts(side, shape, approach, solution, meshes):
            if part.ridge is not None:
                (chart, *_), ridge = part.charts, part.ridge
                left = approach - float(ridge.gap.min() - shape.ridge.gap.min())
                line = self._line(side, chart, ridge, meshes)[0]
                own = force_at(ridge, line, left, self._modulus(side), deep) if left > 0.0 else 0.0
                whole += own / chart.copies
        return whole

    def overlap(
        self,
        side: PosedInterface,
        pair: PairResult,
        meshes: Sequence[SurfaceMesh],
        solution: Solution | None,
    ) -> float:
        """Return how deep a contact overlaps between nodes, by what the nearest one has moved."""
        shape = self._shape(side, solution, meshes)
        if shape is None or shape.ridge is None:
            return 0.0
        (chart, *_), ridge = shape.charts, shape.ridge
        least = int(ridge.gap.argmin())
        place = chart.at(chart.folded(ridge.points[[least]]))
        near = [int(np.linalg.norm(pair.x - place, axis=1).argmin())]
        place = chart.local(x := pair.x[near])
        # a panel's node is not on the face
        before = shape.gap(place) + np.sum((chart.at(place) - x) * pair.normal[near], axis=1)
        return max(float((before - pair.gap[near])[0] - ridge.gap[least]), 0.0)

    def charts(
        self, side: PosedInterface, middle: Array | None = None, ring: bool = False
    ) -> list[Chart]:
        """Return the charts of the faces of a contact, or none if one has none, about a point (3,),
        or about the axis of a face unless contact is a ring about it."""
        found = [
            (not ring and disc_of(self._boundaries[b], part))
            or chart_of(self._boundaries[b], part, middle)
            for b, part in side.ends
        ]
        return [chart for chart in found if chart is not None] if all(found) else []

    def _pressed(
        self, side: PosedInterface, shape: Shape, force: float, meshes: Sequence[SurfaceMesh]
    ) -> Pressed | None:
        """Return the contact that a force makes in one basin, or None if it is not long or has no
        ridge."""
        charts, ridge, modulus = shape.charts, shape.ridge, self._modulus(side)
        force *= charts[0].copies
        found = ellipse_of(shape.gap, charts[0], shape.start, force, modulus)
        if found is not None:
            return ZonedContact(side, charts, found[0]), *found[1:]
        if ridge is None:
            return None
        line, ends = self._line(side, charts[0], ridge, meshes)
        forecast = forecast_across(shape.gap, ridge, line, force, modulus)
        if not _is_long(forecast):
            return None
        band = replace(band_of(ridge, forecast), mirrored=ends)
        return (
            ZonedContact(side, charts, band, ridge.closed),
            float(ridge.gap.min()),
            forecast.approach,
        )

    def _mirrored(
        self, side: PosedInterface, chart: Chart, ridge: Ridge, meshes: Sequence[SurfaceMesh]
    ) -> tuple[bool, bool]:
        """Return at which ends of its ridge a contact goes on beyond those of its chart."""
        if ridge.closed:
            return True, True
        place, across = chart.folded(ridge.points[[0, -1]]), ridge.across[0]
        way = np.array([-across[1], across[0]])
        ways = np.einsum("k,knd->nd", way, chart.tangents(place))
        first, last = map(
            functools.partial(self._mirrors, side.body, meshes), chart.at(place), ways
        )
        return first, last

    def _line(
        self, side: PosedInterface, chart: Chart, ridge: Ridge, meshes: Sequence[SurfaceMesh]
    ) -> tuple[Line, tuple[bool, bool]]:
        """Return where the ridge of a contact lies, and the planes of symmetry at its ends; and
        whether contact goes on there."""
        mirrored = self._mirrored(side, chart, ridge, meshes)
        ends = np.array([[0.0, 1e-4], [1.0, 1.0 - 1e-4]]) * (ridge.s[-1] - ridge.s[0]) + ridge.s[0]
        planes = [
            (place, place - inner)
            for (place, inner), here in zip(
                (chart.at(ridge.at(both)[0]) for both in ends),
                mirrored,
                strict=True,
            )
            if here and not ridge.closed
        ]
        return Line(chart.at(ridge.points), planes), mirrored

    def _modulus(self, side: PosedInterface) -> float:
        """Return E* of a contact [stress]."""
        return 1.0 / self._posed.softness(side)

    def _gap(self, side: PosedInterface, charts: list[Chart], solution: Solution | None) -> Gap:
        """Return the gap of a contact, when it touches if its direction is the normal; it is the
        same beyond planes of symmetry."""
        own = charts[0]
        gap = face_gap(own, side.law.gap, side.direction, *charts[1:])
        if side.direction is None:
            gap = touching(gap, own.itself, self._way(side, own, gap, solution))
        return lambda place: gap(own.folded(place))

    def _way(
        self, side: PosedInterface, chart: Chart, gap: Gap, solution: Solution | None
    ) -> Array:
        """Return the unit vector (3,) along which a secondary moves towards its primary, by a
        solution or by the load of an obstacle."""
        if solution is None:
            moved = -load_of(self._posed, side)
        else:
            pair = step_ends(solution.steps or solution.tried)[-1].pairs[side.name]
            opened = gap(chart.local(pair.x))
            known = np.isfinite(opened) & np.isfinite(pair.gap)
            closed = opened[known] - pair.gap[known]
            moved = np.linalg.lstsq(pair.normal[known], closed, rcond=None)[0]
        return np.asarray(moved / max(float(np.linalg.norm(moved)), TINY))

    def _mirrors(self, body: int, meshes: Sequence[SurfaceMesh], x: Array, way: Array) -> bool:
        """Return whether a face of a plane of symmetry, or on rollers, ends at a point (3,) and is
        normal to a unit vector."""
        mesh = meshes[body]
        there = set(mesh.part_names) & set(self._posed.bodies[body].mirrors)
        met = np.concatenate([[], *(all_at(mesh, x, part)[0] for part in there)])
        normal = mesh.normal[np.isin(mesh.element, met)]
        return bool(np.any(np.abs(normal @ way) > 1.0 - SINGLE))

    def _shape(
        self, side: PosedInterface, solution: Solution | None, meshes: Sequence[SurfaceMesh]
    ) -> Shape | None:
        """Return the shape of a contact, looked for once; None where its faces have no charts."""
        return self.once(side.name, lambda: self._about(side, self.charts(side), solution, meshes))

    def _parts(
        self,
        side: PosedInterface,
        shape: Shape,
        approach: float,
        solution: Solution | None,
        meshes: Sequence[SurfaceMesh],
    ) -> list[Shape]:
        """Return the shape in each basin of a gap."""
        charts = [chart.itself for chart in shape.charts]
        within = basins(shape.gap, charts[0], approach)
        if len(within) == 1:
            return [shape]
        found = [self._about(side, charts, solution, meshes, own) for own in within]
        return [part for part in found if part is not None]

    def _about(
        self,
        side: PosedInterface,
        charts: list[Chart],
        solution: Solution | None,
        meshes: Sequence[SurfaceMesh],
        within: Within | None = None,
    ) -> Shape | None:
        """Return the shape of a contact about its least gap, on charts that are cut opposite, and
        go on beyond planes of symmetry in which it lies."""
        if not charts:
            return None
        (own, *_), gap = charts, _limited(self._gap(side, charts, solution), within)
        start = lowest_sample(gap, own)
        if start is None:
            return None
        middle = own.at(start[None])
        charts = self.charts(side, middle[0], ring=is_ring(gap, own))
        inside = within and (lambda place: within(own.local(charts[0].at(place))))
        gap = _limited(self._gap(side, charts, solution), inside)
        start, planes = self._planes(side, charts, gap, charts[0].local(middle)[0], meshes)
        charts = [chart.unfolded(own) for chart, own in zip(charts, planes, strict=True)]
        gap = _limited(self._gap(side, charts, solution), inside)
        return Shape(charts, gap, start, ridge_of(gap, charts[0], start))

    def _planes(
        self,
        side: PosedInterface,
        charts: list[Chart],
        gap: Gap,
        start: Array,
        meshes: Sequence[SurfaceMesh],
    ) -> tuple[Array, list[Mask]]:
        """Return a place near the least gap, moved into the planes of symmetry in which the gap is
        least, and at which sides of each chart these planes are, (2, 2)."""
        planes = [np.zeros((2, 2), dtype=bool) for _ in charts]
        for foot, axis in _feet(gap, charts[0], start):
            x, way = charts[0].at(foot[None]), charts[0].tangents(foot[None])[axis, 0]
            met = [
                (np.abs(chart.sides - chart.local(x)) < chart.slack)
                & self._mirrors(body, meshes, chart.at(chart.local(x))[0], way)
                for chart, (body, _) in zip(charts, side.ends, strict=True)
            ]
            if all(map(np.any, met)):
                start = np.where(np.eye(2)[axis], foot, start)
                planes = [old | new for old, new in zip(planes, met, strict=True)]
        return start, planes


def _feet(gap: Gap, chart: Chart, start: Array) -> Iterator[tuple[Array, int]]:
    """Yield the feet of a point on sides of a face where the gap between them is least at the foot
    and largest at the point, so that no hill parts them, and the coordinate along which they
    lie."""
    noise = CHAINED * float(np.ptp(chart.sides, axis=0).max())
    shares = np.append(0.0, np.geomspace(SINGLE, 1.0))
    for axis, end in itertools.product((0, 1), (0, 1)):
        foot = np.where(np.eye(2)[axis], chart.sides[end], start)
        least, *others = gap(foot + shares[:, None] * (start - foot))
        falls = least < others[-1] - noise and least < min(others) + noise
        if falls and max(others) < others[-1] + noise:
            yield foot, axis


def _limited(gap: Gap, within: Within | None) -> Gap:
    """Return a gap that is infinite outside of places."""
    if within is None:
        return gap
    return lambda place: np.where(within(place), gap(place), np.inf)


def _is_all(shape: Shape, pressed: Pressed) -> bool:
    """Return whether a basin has no contact but an ellipse, if it is one."""
    (chart, *_), (long, least, approach) = shape.charts, pressed
    return not isinstance(long.zone, ContactEllipse) or is_alone(
        shape.gap, chart, long.zone, least + approach
    )


def _is_long(forecast: Forecast) -> bool:
    """Return whether a contact is longer than an ellipse that rings surround, or is no ellipse and
    longer than wide.

    Crowns of the fourth power on a block were told to 2.7 to 4 % in 7 to 13 s with ratios of 1.6 to
    2.9; without a band that of 1.6 had no result in 130 s.
    """
    low, high = forecast.ends
    ratio = ELONGATED if forecast.elliptic else 1.0
    return high - low > 2.0 * ratio * forecast.usual
