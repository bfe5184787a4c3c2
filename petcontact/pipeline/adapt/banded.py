"""Meshes whose panels follow contacts: forecast from the shapes, then from solutions."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence

import numpy as np

from ...arrays import Array, connected
from ...fields.boundary.places import all_at
from ...geometry.charts import Chart, chart_of, disc_of
from ...given.conditions import Displacement, Symmetry
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ...record import Keeping, replace
from ...refinement.panels.bands import LEVELS, Laid, banded
from ...refinement.panels.face_gaps import face_gap, opposite, touching
from ...refinement.panels.forecast import Forecast, Line, band_of, ellipse_of, force_at, forecast_of
from ...refinement.panels.ridge import Gap, Ridge, is_ring, lowest_sample, ridge_of
from ...refinement.panels.zone import ELONGATED, ContactBand, ContactEllipse, Zone
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ...round_off import SINGLE, TINY
from .known_forces import is_held, known_force, load_of, way_of
from .long_contacts import LEFT, LaidBands, Long, followed, round_zone

ERRORS: dict[type, tuple[float, ...]] = {
    ContactBand: (0.052 * LEFT, 0.033 * LEFT, 0.023 * LEFT),
    ContactEllipse: (0.09, 0.04, 0.02),
}
"""Error of p with none, one and two lines between the ridge and the edge: of Hertz' ellipse 1:20
by the change with one more line; of his circle, with one ring more, by tails (scripts/verify_space
--only adaptive)."""
Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]


_Shape = tuple[list[Chart], Gap, Array, Ridge | None]
"""The charts of the faces of a contact, its gap on the first one, a place near the least one, and
the ridge there, if there is one."""


UNKNOWN = ContactEllipse(np.zeros(2), np.eye(2))
"""The zone of a contact that no forecast has."""
Made = tuple[list[SurfaceMesh], LaidBands]
"""Meshes with bands, or none, and all bands."""


class Bands(Keeping):
    """Lays bands along long contacts, and rings around compact ones.

    Without rings, panels as narrow at a circular edge are nine times as many. Their error is
    larger, since p is a square root at the edge, which no polynomial across the edge follows.

    Parameters
    ----------
    posed : Posed
    wanted : float
        The wanted accuracy [-].

    Attributes
    ----------
    faces : int
        Number of faces that may have bands.
    """

    def __init__(self, posed: Posed, wanted: float) -> None:
        self._posed, self._boundaries, self._wanted = posed, posed.boundaries, wanted
        together = connected({k: side.ends for k, side in enumerate(posed.interfaces)})
        self._groups = [
            group
            for group in ([posed.interfaces[k] for k in numbers] for numbers in together)
            if all(side.law.normal == "unilateral" for side in group)
        ]
        self._sides = [side for group in self._groups for side in group]
        self.faces = len({end for side in self._sides for end in side.ends})

    def first(self, meshes: Sequence[SurfaceMesh], completed: Completed) -> Made:
        """Return first meshes with bands where forces of contacts are known, else none.

        They have so many lines that one more line reaches the wanted error."""
        forces = {side.name: known_force(self._posed, side, meshes) for side in self._sides}
        known = {name: force for name, force in forces.items() if force}
        return self._more(LaidBands(), meshes, known, completed)

    def next(
        self,
        laid: LaidBands,
        solution: Solution,
        meshes: Sequence[SurfaceMesh],
        completed: Completed,
    ) -> Made:
        """Return meshes with bands that follow a solution, with more lines than before, or none."""
        steps, forces = step_ends(solution.steps or solution.tried), dict[str, float]()
        shared = {k: self._shared(side, meshes) for k, side in enumerate(self._sides)}
        for group in ([self._sides[k] for k in numbers] for numbers in connected(shared)):
            for side in group:
                pairs = [step.pairs[side.name] for step in steps]
                forces[side.name] = max(float(pair.weight @ pair.pressure) for pair in pairs)
            if not any(forces[side.name] for side in group):
                forces |= self._of_overlaps(group, solution, meshes)
                laid = replace(laid, most=0)  # such bands show where the next ones lie
        return self._more(laid, meshes, forces, completed, solution)

    def _more(
        self,
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        completed: Completed,
        solution: Solution | None = None,
    ) -> Made:
        """Return meshes with one line more in each band, or none if no band is new.

        First bands that cost too much have two lines less: the next ones then cost less, too, and
        show the error.
        """
        while True:
            for sticks in (True, False) if solution is not None else (False,):
                made, new = self._one_more(laid, meshes, forces, solution, sticks)
                grown = [name for name, at in new.lines.items() if at != laid.lines.get(name)]
                made = completed(made) if grown else []
                if made:
                    counts = {name: laid.made.get(name, 0) + 1 for name in grown}
                    return made, replace(new, made=laid.made | counts)
            laid = replace(laid, long=new.long | laid.long)
            used = max((new.lines[name] for name in grown), default=0)
            if laid.lines or not used:
                return [], laid
            laid = replace(laid, most=max(used - 2, 0))

    def _one_more(
        self,
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
        sticks: bool,
    ) -> Made:
        """Return meshes with one line more in each band."""
        made = [*meshes]
        for group in self._groups:
            known, longs = self._longs(group, laid, meshes, forces, solution, sticks)
            laid = replace(laid, long=known)
            own = {name: self._lines(laid, long) for name, long in longs.items()}
            new = self._on_all(made, longs, own)
            if new is not None:
                made = new
                laid = replace(laid, long={**laid.long, **longs}, lines=laid.lines | own)
        return made, laid

    def _lines(self, laid: LaidBands, long: Long) -> int:
        """Return the number of lines of the next band: as many as reach the wanted error, or one
        more than before. First rings show where a contact sticks, and later ones follow that."""
        made = laid.lines.get(long.side.name)
        needed = sum(error > self._wanted for error in ERRORS[type(long.zone)][:-1])
        if made is None:
            seen_later = not long.is_band and long.side.law.may_stick
            return 0 if seen_later else min(needed, laid.most)
        return min(made + 1 if long.is_band else max(made + 1, needed), LEVELS - 1)

    def _longs(
        self,
        group: Sequence[PosedInterface],
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
        sticks: bool,
    ) -> tuple[dict[str, Long | None], dict[str, Long]]:
        """Return what is known of contacts, and those of a group that carry anything; none of them
        if one has no zone."""
        known, result = dict(laid.long), dict[str, Long]()
        for side in group:
            force = forces.get(side.name, 0.0)
            if force > 0.0 and side.name not in known:
                known[side.name] = self._expected(side, force, meshes, solution)
            long = known[side.name] if force > 0.0 else None
            if solution is not None and force > 0.0 and (long is None or side.name in laid.lines):
                long = self._followed(side, long, solution, sticks)
            if long is None and (force > 0.0 or solution is None):
                return known, {}
            if long is not None:
                result[side.name] = long
        return known, result

    def _followed(
        self, side: PosedInterface, long: Long | None, solution: Solution, sticks: bool
    ) -> Long | None:
        """Return a contact as a solution has it, or None if it has no zone."""
        if long is not None and isinstance(long.zone, ContactBand):
            return replace(long, zone=followed(long, long.zone, solution))
        if long is None:
            pair = step_ends(solution.steps or solution.tried)[-1].pairs[side.name]
            charts = self._charts(side, pair.x[int(pair.pressure.argmax())])
            if len(charts) < len(side.ends):
                return None
            long = Long(side, charts, UNKNOWN)
        zone = round_zone(long.charts[0], solution, side.name, sticks)
        return None if zone is None else replace(long, zone=zone)

    def _on_all(
        self, meshes: Sequence[SurfaceMesh], longs: Mapping[str, Long], levels: Mapping[str, int]
    ) -> list[SurfaceMesh] | None:
        """Return meshes with the bands of a group on all its faces, or None without such."""
        laid, result = dict[tuple[int, str], list[Laid]](), [*meshes]
        for name, long in longs.items():
            for end, chart, zone in zip(long.side.ends, long.charts, zones_of(long), strict=True):
                laid.setdefault(end, []).append((chart, zone, levels[name]))
        for (body, part), bands in laid.items():
            mesh = banded(result[body], part, *bands)
            if mesh is None:
                return None
            result[body] = mesh
        return result if laid else None

    def _expected(
        self,
        side: PosedInterface,
        force: float,
        meshes: Sequence[SurfaceMesh],
        solution: Solution | None,
    ) -> Long | None:
        """Return the contact that a force makes, or None if it is not long or has no ridge."""
        shape = self._shape(side, solution)
        if shape is None:
            return None
        (charts, gap, start, ridge), modulus = shape, self._modulus(side)
        found = ellipse_of(gap, charts[0], start, force, modulus)
        if found is not None:
            return Long(side, charts, found)
        if ridge is None:
            return None
        first, last, halved = self._mirrored(side, charts[0], ridge, meshes)
        whole, line = force * (1.0 + halved), self._line(side, charts[0], ridge, meshes)
        forecast = forecast_of(ridge, line, whole, modulus)
        if not _is_long(forecast):
            return None
        band = replace(band_of(ridge, forecast), mirrored=(first, last), halved=halved)
        return Long(side, charts, band, ridge.closed)

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
    ) -> Line:
        """Return where the ridge of a contact lies, and the planes of symmetry at its ends."""
        ends = np.array([[0.0, 1e-4], [1.0, 1.0 - 1e-4]]) * (ridge.s[-1] - ridge.s[0]) + ridge.s[0]
        planes = [
            (place, place - inner)
            for (place, inner), here in zip(
                (chart.at(ridge.at(both)[0]) for both in ends),
                self._mirrored(side, chart, ridge, meshes)[:2],
                strict=True,
            )
            if here and not ridge.closed
        ]
        return Line(chart.at(ridge.points), planes)

    def _shared(self, side: PosedInterface, meshes: Sequence[SurfaceMesh]) -> set[Hashable]:
        """Return the faces of a contact, and its bodies that move along it as a whole: these close
        one contact as far as they open another one."""
        way = way_of(self._posed, side)
        if way is None:
            return {*side.ends}
        loose = (b for b in side.bodies if not is_held(self._posed, b, meshes[b], way))
        return {*side.ends, *loose}

    def _of_overlaps(
        self, group: Sequence[PosedInterface], solution: Solution, meshes: Sequence[SurfaceMesh]
    ) -> dict[str, float]:
        """Return the forces that end overlaps between nodes, which contacts of a group share: a
        roller may be pressed into one of two plates before it moves."""
        step = step_ends(solution.steps or solution.tried)[-1]
        shapes = {side.name: shape for side in group if (shape := self._shape(side, solution))}
        ridges = {name: (*shape[:2], shape[3]) for name, shape in shapes.items() if shape[3]}
        depth = sum(_overlap(*ridges[n], step.pairs[n]) for n in ridges) / len(group)
        if not 0.0 < depth < math.inf:
            return {}
        thick, result = [float(np.ptp(mesh.x, axis=0).min()) for mesh in meshes], {}
        for side in group:
            if side.name in ridges:
                deep = 0.5 * min(thick[b] for b in side.bodies)
                (chart, *_), _, ridge = ridges[side.name]
                line, modulus = self._line(side, chart, ridge, meshes), self._modulus(side)
                whole = force_at(ridge, line, depth, modulus, deep)
                halved = self._mirrored(side, chart, ridge, meshes)[2]
                result[side.name] = whole / (1.0 + halved)
        return result

    def _modulus(self, side: PosedInterface) -> float:
        """Return E* of a contact [stress]."""
        return 1.0 / self._posed.softness(side)

    def _shape(self, side: PosedInterface, solution: Solution | None) -> _Shape | None:
        """Return the shape of a contact, looked for once; None where its faces have no charts."""
        return self.once(side.name, lambda: self._looked_for(side, solution))

    def _looked_for(self, side: PosedInterface, solution: Solution | None) -> _Shape | None:
        charts = self._charts(side)
        if len(charts) < len(side.ends):
            return None
        start = lowest_sample(gap := self._gap(side, charts, solution), charts[0])
        if start is None:
            return None
        middle = charts[0].at(start[None])
        charts = self._charts(side, middle[0], ring=is_ring(gap, charts[0]))
        gap = self._gap(side, charts, solution)
        start = charts[0].local(middle)[0]
        return charts, gap, start, ridge_of(gap, charts[0], start)

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

    def _charts(
        self, side: PosedInterface, middle: Array | None = None, ring: bool = False
    ) -> list[Chart]:
        """Return the charts of the faces of a contact that have any, about a point (3,), or about
        the axis of a face unless contact is a ring about it."""
        found = [
            (not ring and disc_of(self._boundaries[b], part))
            or chart_of(self._boundaries[b], part, middle)
            for b, part in side.ends
        ]
        return [chart for chart in found if chart is not None]


def _overlap(charts: list[Chart], gap: Gap, ridge: Ridge, pair: PairResult) -> float:
    """Return how deep a contact overlaps between nodes, by what the nearest one has moved."""
    least = int(ridge.gap.argmin())
    place = charts[0].at(ridge.points[[least]])
    near = [int(np.linalg.norm(pair.x - place, axis=1).argmin())]
    moved = float((gap(charts[0].local(pair.x[near])) - pair.gap[near])[0])
    return max(moved - float(ridge.gap[least]), 0.0)


def zones_of(long: Long) -> list[Zone]:
    """Return the zone on the secondary, and the same zone on the primary, if that is a body."""
    own, zone = long.charts[0], long.zone
    if len(long.charts) == 1:
        return [zone]
    chart = long.charts[1]
    x, normal = own.at(zone.points), own.normal(zone.points)
    places = opposite(chart, x, normal, long.side.direction)[0]
    if chart.wraps:  # a band that goes round ends where it begins
        period = chart.high[0] - chart.low[0]
        places[:, 0] = np.unwrap(places[:, 0], period=period)
        places[:, 0] -= period * np.floor((places[:, 0].mean() - chart.low[0]) / period)
    return [zone, zone.moved(places)]


def _is_long(forecast: Forecast) -> bool:
    """Return whether a contact is longer than an ellipse that rings surround, or is no ellipse and
    longer than wide.

    Crowns of the fourth power on a block were told to 2.7 to 4 % in 7 to 13 s with ratios of 1.6 to
    2.9; without a band that of 1.6 had no result in 130 s.
    """
    low, high = forecast.ends
    ratio = ELONGATED if forecast.elliptic else 1.0
    return high - low > 2.0 * ratio * forecast.usual
