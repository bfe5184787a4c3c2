"""Meshes whose panels follow long contacts: forecast from the shapes, then from solutions."""

from __future__ import annotations

import math
from collections.abc import Callable, Hashable, Mapping, Sequence

import numpy as np

from ...arrays import Array, connected
from ...fields.boundary.places import all_at
from ...geometry.charts import Chart, chart_of
from ...given.conditions import Displacement, Symmetry
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ...record import Keeping, replace
from ...refinement.panels.bands import LEVELS, Laid, banded
from ...refinement.panels.face_gaps import face_gap, opposite, touching
from ...refinement.panels.forecast import Forecast, Line, band_of, force_at, forecast_of
from ...refinement.panels.ridge import Gap, Ridge, lowest_sample, ridge_of
from ...refinement.panels.zone import ELONGATED, ContactBand
from ...results.records import PairResult, step_ends
from ...results.solution import Solution
from ...round_off import SINGLE, TINY
from .known_forces import is_held, known_force, load_of, way_of
from .long_contacts import LEFT, LaidBands, Long, followed

ERRORS = (0.052, 0.033, 0.023)
"""Change of p by one more line, with none, one and two lines before, of Hertz' ellipse 1:20."""
Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]


_Shape = tuple[list[Chart], Gap, Ridge]
"""The charts of the faces of a contact, its gap on the first one, and the ridge of that."""


Made = tuple[list[SurfaceMesh], LaidBands]
"""Meshes with bands, or none, and all bands."""


class Bands(Keeping):
    """Lays bands along the long contacts of a problem.

    Parameters
    ----------
    posed : Posed

    Attributes
    ----------
    faces : int
        Number of faces that may have bands.
    """

    def __init__(self, posed: Posed) -> None:
        self._posed, self._boundaries = posed, posed.boundaries
        together = connected({k: side.ends for k, side in enumerate(posed.interfaces)})
        self._groups = [
            group
            for group in ([posed.interfaces[k] for k in numbers] for numbers in together)
            if all(side.law.normal == "unilateral" for side in group)
        ]
        self._sides = [side for group in self._groups for side in group]
        self.faces = len({end for side in self._sides for end in side.ends})

    def first(self, meshes: Sequence[SurfaceMesh], wanted: float, completed: Completed) -> Made:
        """Return first meshes with bands where forces of contacts are known, else none.

        They have so many lines that one more line reaches the wanted error."""
        laid = LaidBands(first=sum(LEFT * error > wanted for error in ERRORS[:-1]))
        forces = {side.name: known_force(self._posed, side, meshes) for side in self._sides}
        known = {name: force for name, force in forces.items() if force}
        return self._more(laid, meshes, known, completed)

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
                laid = replace(laid, first=0)  # such bands show where the next ones lie
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
            made, new = self._one_more(laid, meshes, forces, solution)
            grown = [name for name, lines in new.lines.items() if lines != laid.lines.get(name)]
            made = completed(made) if grown else []
            if made:
                counts = {name: laid.made.get(name, 0) + 1 for name in grown}
                return made, replace(new, made=laid.made | counts)
            laid = replace(laid, long=new.long | laid.long)
            if not grown or laid.lines or not laid.first:
                return [], laid
            laid = replace(laid, first=max(laid.first - 2, 0))

    def _one_more(
        self,
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
    ) -> Made:
        """Return meshes with one line more in each band."""
        made = [*meshes]
        for group in self._groups:
            known, longs = self._longs(group, laid, meshes, forces, solution)
            laid = replace(laid, long=known)
            own = {
                name: min(laid.lines.get(name, laid.first - 1) + 1, LEVELS - 1) for name in longs
            }
            new = self._on_all(made, longs, own)
            if new is not None:
                made = new
                laid = replace(laid, long={**laid.long, **longs}, lines=laid.lines | own)
        return made, laid

    def _longs(
        self,
        group: Sequence[PosedInterface],
        laid: LaidBands,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
    ) -> tuple[dict[str, Long | None], dict[str, Long]]:
        """Return what is known of contacts, and those of a group that carry anything; none of them
        if one is not long."""
        known, result = dict(laid.long), dict[str, Long]()
        for side in group:
            force = forces.get(side.name, 0.0)
            if force > 0.0 and side.name not in known:
                known[side.name] = self._expected(side, force, meshes, solution)
            long = known[side.name] if force > 0.0 else None
            if long is None and (force > 0.0 or solution is None):
                return known, {}
            if long is not None and solution is not None and side.name in laid.lines:
                long = replace(long, band=followed(long, solution))
            if long is not None:
                result[side.name] = long
        return known, result

    def _on_all(
        self, meshes: Sequence[SurfaceMesh], longs: Mapping[str, Long], levels: Mapping[str, int]
    ) -> list[SurfaceMesh] | None:
        """Return meshes with the bands of a group on all its faces, or None without such."""
        laid, result = dict[tuple[int, str], list[Laid]](), [*meshes]
        for name, long in longs.items():
            for end, chart, band in zip(
                long.side.ends, long.charts, self._bands_of(long), strict=True
            ):
                laid.setdefault(end, []).append((chart, band, levels[name]))
        for (body, part), bands in laid.items():
            mesh = banded(result[body], part, *bands)
            if mesh is None:
                return None
            result[body] = mesh
        return result if laid else None

    def _bands_of(self, long: Long) -> list[ContactBand]:
        """Return the band on the secondary, and the same band on the primary, if that is a body."""
        own, band = long.charts[0], long.band
        if len(long.charts) == 1:
            return [band]
        chart = long.charts[1]
        x, normal = own.at(band.points), own.normal(band.points)
        places = opposite(chart, x, normal, long.side.direction)[0]
        if chart.wraps:  # a band that goes round ends where it begins
            period = chart.high[0] - chart.low[0]
            places[:, 0] = np.unwrap(places[:, 0], period=period)
            places[:, 0] -= period * np.floor((places[:, 0].mean() - chart.low[0]) / period)
        way = np.gradient(places, axis=0)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        across = np.column_stack([way[:, 1], -way[:, 0]])
        return [band, replace(band, points=places, across=across)]

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
        (charts, _, ridge), modulus = shape, self._modulus(side)
        first, last, halved = self._mirrored(side, shape, meshes)
        whole = force * (1.0 + halved)
        forecast = forecast_of(ridge, self._line(side, shape, meshes), whole, modulus)
        if not _is_long(forecast):
            return None
        band = replace(band_of(ridge, forecast), mirrored=(first, last), halved=halved)
        return Long(side, charts, ridge, band)

    def _mirrored(
        self, side: PosedInterface, shape: _Shape, meshes: Sequence[SurfaceMesh]
    ) -> list[bool]:
        """Return at which ends of its ridge a contact goes on, and whether it does across."""
        (chart, *_), _, ridge = shape
        middle = len(ridge.s) // 2
        place, across = ridge.points[[0, -1, middle]], ridge.across[0]
        ways = np.array([[-across[1], across[0]]] * 2 + [across])
        ways = np.einsum("nk,knd->nd", ways, chart.tangents(place))
        always = ridge.closed, ridge.closed, False
        return [
            known or self._mirrors(side.body, meshes, *each)
            for known, *each in zip(always, chart.at(place), ways, strict=True)
        ]

    def _line(self, side: PosedInterface, shape: _Shape, meshes: Sequence[SurfaceMesh]) -> Line:
        """Return where the ridge of a contact lies, and the planes of symmetry at its ends."""
        (chart, *_), _, ridge = shape
        ends = np.array([[0.0, 1e-4], [1.0, 1.0 - 1e-4]]) * (ridge.s[-1] - ridge.s[0]) + ridge.s[0]
        planes = [
            (place, place - inner)
            for (place, inner), here in zip(
                (chart.at(ridge.at(both)[0]) for both in ends),
                self._mirrored(side, shape, meshes)[:2],
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
        depths = [_overlap(shape, step.pairs[name]) for name, shape in shapes.items()]
        depth = sum(depths) / len(group)
        if not 0.0 < depth < math.inf:
            return {}
        thick, result = [float(np.ptp(mesh.x, axis=0).min()) for mesh in meshes], {}
        for side in group:
            if side.name in shapes:
                deep = 0.5 * min(thick[b] for b in side.bodies)
                line, shape = self._line(side, shapes[side.name], meshes), shapes[side.name]
                whole = force_at(shape[2], line, depth, self._modulus(side), deep)
                result[side.name] = whole / (1.0 + self._mirrored(side, shape, meshes)[2])
        return result

    def _modulus(self, side: PosedInterface) -> float:
        """Return E* of a contact [stress]."""
        return 1.0 / self._posed.softness(side)

    def _shape(self, side: PosedInterface, solution: Solution | None) -> _Shape | None:
        """Return the shape of a contact, looked for once; None if it has no straight ridge."""
        return self.once(side.name, lambda: self._looked_for(side, solution))

    def _looked_for(self, side: PosedInterface, solution: Solution | None) -> _Shape | None:
        charts = self._charts(side, None)
        if len(charts) < len(side.ends):
            return None
        start = lowest_sample(self._gap(side, charts, solution), charts[0])
        if start is None:
            return None
        middle = charts[0].at(start[None])
        charts = self._charts(side, middle[0])
        gap = self._gap(side, charts, solution)
        ridge = ridge_of(gap, charts[0], charts[0].local(middle)[0])
        if ridge is None:
            return None
        return charts, gap, ridge

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

    def _charts(self, side: PosedInterface, middle: Array | None) -> list[Chart]:
        """Return the charts of the faces of a contact that have any."""
        found = (chart_of(self._boundaries[b], part, middle) for b, part in side.ends)
        return [chart for chart in found if chart is not None]


def _overlap(shape: _Shape, pair: PairResult) -> float:
    """Return how deep a contact overlaps between nodes, by what the nearest one has moved."""
    (charts, gap, ridge), least = shape, int(shape[2].gap.argmin())
    place = charts[0].at(ridge.points[[least]])
    near = [int(np.linalg.norm(pair.x - place, axis=1).argmin())]
    moved = float((gap(charts[0].local(pair.x[near])) - pair.gap[near])[0])
    return max(moved - float(ridge.gap[least]), 0.0)


def _is_long(forecast: Forecast) -> bool:
    """Return whether a contact is longer than an ellipse that rings surround, or is no ellipse and
    longer than wide.

    Crowns of the fourth power on a block were told to 2.7 to 4 % in 7 to 13 s with ratios of 1.6 to
    2.9; without a band that of 1.6 had no result in 130 s.
    """
    low, high = forecast.ends
    ratio = ELONGATED if forecast.elliptic else 1.0
    return high - low > 2.0 * ratio * forecast.usual
