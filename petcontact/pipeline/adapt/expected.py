"""Contacts as they are expected from the shapes of both faces: a zone at each place where the gap
is least."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...fields.boundary.places import all_at
from ...geometry.charts import Chart, chart_of, disc_of
from ...given.conditions import Displacement, Symmetry
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ...record import Keeping, record, replace
from ...refinement.panels.basins import Within, basins, shares
from ...refinement.panels.face_gaps import face_gap, touching
from ...refinement.panels.forecast import (
    Forecast,
    Line,
    band_of,
    ellipse_of,
    force_at,
    forecast_of,
    is_alone,
)
from ...refinement.panels.ridge import Gap, Ridge, is_ring, lowest_sample, ridge_of
from ...refinement.panels.zone import ELONGATED, ContactEllipse
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ...round_off import SINGLE, TINY
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
        shape = self._shape(side, solution)
        first = shape and self._pressed(side, shape, force, meshes)
        if shape is None or not first:
            return []
        shapes = self._parts(side, shape, first[2], solution)
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
        shape, thick = self._shape(side, solution), [np.ptp(m.x, axis=0).min() for m in meshes]
        if shape is None or shape.ridge is None:
            return 0.0
        deep, whole = 0.5 * float(min(thick[b] for b in side.bodies)), 0.0
        for part in self._parts(side, shape, approach, solution):
            if part.ridge is not None:
                (chart, *_), ridge = part.charts, part.ridge
                left = approach - float(ridge.gap.min() - shape.ridge.gap.min())
                line, (*_, halved) = self._line(side, chart, ridge, meshes)
                own = force_at(ridge, line, left, self._modulus(side), deep) if left > 0.0 else 0.0
                whole += own / (1.0 + halved)
        return whole

    def overlap(self, side: PosedInterface, pair: PairResult, solution: Solution | None) -> float:
        """Return how deep a contact overlaps between nodes, by what the nearest one has moved."""
        shape = self._shape(side, solution)
        if shape is None or shape.ridge is None:
            return 0.0
        (chart, *_), ridge = shape.charts, shape.ridge
        least = int(ridge.gap.argmin())
        place = chart.at(ridge.points[[least]])
        near = [int(np.linalg.norm(pair.x - place, axis=1).argmin())]
        moved = float((shape.gap(chart.local(pair.x[near])) - pair.gap[near])[0])
        return max(moved - float(ridge.gap[least]), 0.0)

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
        found = ellipse_of(shape.gap, charts[0], shape.start, force, modulus)
        if found is not None:
            return ZonedContact(side, charts, found[0]), *found[1:]
        if ridge is None:
            return None
        line, (*ends, halved) = self._line(side, charts[0], ridge, meshes)
        forecast = forecast_of(ridge, line, force * (1.0 + halved), modulus)
        if not _is_long(forecast):
            return None
        band = replace(band_of(ridge, forecast), mirrored=(ends[0], ends[1]), halved=halved)
        return (
            ZonedContact(side, charts, band, ridge.closed),
            float(ridge.gap.min()),
            forecast.approach,
        )

    def _mirrored(
        self, side: PosedInterface, chart: Chart, ridge: Ridge, meshes: Sequence[SurfaceMesh]
    ) -> list[bool]:
        """Return at which ends of its ridge a contact goes on, and whether it does across."""
        middle = len(ridge.s) // 2
        place, across = ridge.points[[0, -1, middle]], ridge.across[0]
        ways = np.array([[-across[1], across[0]]] * 2 + [across])
        ways = np.einsum("nk,knd->nd", ways, chart.tangents(place))
        always = ridge.closed, ridge.closed, False
        return [
            known or self._mirrors(side.body, meshes, *each)
            for known, *each in zip(always, chart.at(place), ways, strict=True)
        ]

    def _line(
        self, side: PosedInterface, chart: Chart, ridge: Ridge, meshes: Sequence[SurfaceMesh]
    ) -> tuple[Line, list[bool]]:
        """Return where the ridge of a contact lies, and the planes of symmetry at its ends; and
        whether contact goes on at both ends, and across."""
        mirrored = self._mirrored(side, chart, ridge, meshes)
        ends = np.array([[0.0, 1e-4], [1.0, 1.0 - 1e-4]]) * (ridge.s[-1] - ridge.s[0]) + ridge.s[0]
        planes = [
            (place, place - inner)
            for (place, inner), here in zip(
                (chart.at(ridge.at(both)[0]) for both in ends),
                mirrored[:2],
                strict=True,
            )
            if here and not ridge.closed
        ]
        return Line(chart.at(ridge.points), planes), mirrored

    def _modulus(self, side: PosedInterface) -> float:
        """Return E* of a contact [stress]."""
        return 1.0 / self._posed.softness(side)

    def _gap(self, side: PosedInterface, charts: list[Chart], solution: Solution | None) -> Gap:
        """Return the gap of a contact, when it touches if its direction is the normal."""
        gap = face_gap(charts[0], side.law.gap, side.direction, *charts[1:])
        if side.direction is not None:
            return gap
        return touching(gap, charts[0], self._way(side, charts[0], gap, solution))

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
        planes = [
            part
            for part, condition in self._posed.bodies[body].conditions[0].items()
            if isinstance(condition, Symmetry)
            or (isinstance(condition, Displacement) and condition.free.count(False) == 1)
        ]
        mesh = meshes[body]
        there = set(mesh.part_names) & set(planes)
        met = np.concatenate([[], *(all_at(mesh, x, part)[0] for part in there)])
        normal = mesh.normal[np.isin(mesh.element, met)]
        return bool(np.any(np.abs(normal @ way) > 1.0 - SINGLE))

    def _shape(self, side: PosedInterface, solution: Solution | None) -> Shape | None:
        """Return the shape of a contact, looked for once; None where its faces have no charts."""
        return self.once(side.name, lambda: self._about(side, self.charts(side), solution))

    def _parts(
        self, side: PosedInterface, shape: Shape, approach: float, solution: Solution | None
    ) -> list[Shape]:
        """Return the shape in each basin of a gap."""
        within = basins(shape.gap, shape.charts[0], approach)
        if len(within) == 1:
            return [shape]
        found = [self._about(side, shape.charts, solution, own) for own in within]
        return [part for part in found if part is not None]

    def _about(
        self,
        side: PosedInterface,
        charts: list[Chart],
        solution: Solution | None,
        within: Within | None = None,
    ) -> Shape | None:
        """Return the shape of a contact about its least gap, on charts that are cut opposite."""
        if not charts:
            return None
        (own, *_), gap = charts, _limited(self._gap(side, charts, solution), within)
        start = lowest_sample(gap, own)
        if start is None:
            return None
        middle = own.at(start[None])
        charts = self.charts(side, middle[0], ring=is_ring(gap, own))
        inside = within and (lambda place: within(own.local(charts[0].at(place))))
        gap, start = _limited(self._gap(side, charts, solution), inside), charts[0].local(middle)[0]
        return Shape(charts, gap, start, ridge_of(gap, charts[0], start))


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
