"""Meshes whose panels follow long contacts: forecast from the shapes, then from solutions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from ...arrays import Array, Mask
from ...contact.state import Start
from ...fields.boundary.places import all_at, located, sizes
from ...geometry.charts import Chart, chart_of
from ...given.conditions import Displacement, Symmetry
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...record import Keeping, field, record, replace
from ...refinement.panels.bands import LEVELS, Laid, banded
from ...refinement.panels.face_gaps import face_gap, opposite
from ...refinement.panels.forecast import WIDER, Forecast, band_of, force_at, forecast_of
from ...refinement.panels.ridge import Gap, Ridge, lowest_sample, ridge_of
from ...refinement.panels.rings import SHRINK
from ...refinement.panels.zone import ELONGATED, ContactBand
from ...results.records import PairResult, StepResult, step_ends
from ...results.solution import Solution
from ..steps.increment import PreparedProblem
from .known_forces import known_force
from .surface_errors import TailErrors

LEFT = SHRINK / (1.0 - SHRINK)
"""Error of p over its change from a band with one line less between the ridge and the edge [-]. The
L2 error of polynomials next to a root is proportional to the width of the last panel, which falls
by `SHRINK` with each line."""
ERRORS = (0.052, 0.033, 0.023)
"""Change of p by one more line, with none, one and two lines before, of Hertz' ellipse 1:20."""
NEAR = 0.01
"""Distance of a node from a panel of another mesh of its face over the size of the panel, up to
which it lies on it [-]."""
Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]


_Shape = tuple[list[Chart], Gap, Ridge]
"""The charts of the faces of a contact, its gap on the first one, and the ridge of that."""


@record
class _Long:
    """A long contact: its interface, the charts of its faces, its ridge, and the expected band."""

    side: PosedInterface
    charts: list[Chart]
    ridge: Ridge
    band: ContactBand

    def away(self, x: Array) -> Mask:
        """Return which points (n, 3) are away from ends where p is infinite."""
        return self.is_inside(self.band.coordinates(self.charts[0].local(x))[1])

    def is_inside(self, along: Array) -> Mask:
        """Return which places along the ridge are a half-width away from ends where p is
        infinite."""
        ends = [end for end, here in zip(self.band.ends, self.band.infinite, strict=True) if here]
        away = [np.abs(along - end) > self.band.widest for end in ends]
        return np.asarray(np.all(away, axis=0) if away else np.full(len(along), True))


@record
class LaidBands:
    """The bands that meshes have.

    Attributes
    ----------
    long : dict
        The long contacts by interface; None for one that is not long.
    lines : dict of int
        Lines between the ridge and the edge of each band.
    made : dict of int
        On how many meshes each contact has had a new band.
    first : int
        Lines of first bands.
    """

    long: dict[str, _Long | None] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    made: dict[str, int] = field(default_factory=dict)
    first: int = 0

    def of(self, side: PosedInterface) -> _Long:
        """Return a long contact that has a band."""
        long = self.long[side.name]
        assert long is not None
        return long

    def apart(self, before: Solution, after: Solution, errors: TailErrors) -> float:
        """Return the relative error of p and q by their change from one band to the next [-].

        It is infinite unless all contacts that carry anything have bands on both. Ends at which p
        is infinite are left out.
        """
        worst = 0.0
        for old, new in zip(step_ends(before.steps), step_ends(after.steps), strict=True):
            for side in after.posed.interfaces:
                if not new.pairs[side.name].size.any():
                    continue
                if self.made.get(side.name, 0) < 2:
                    return np.inf
                weight = errors.weight(side, new) * self.of(side).away(new.pairs[side.name].x)
                worst = max(worst, _difference((before, old), (after, new), side, weight))
        return LEFT * worst

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return a start without tractions that is closed in the bands, or None without bands.

        Pairs without a band overlap everywhere."""
        if not self.lines:
            return None
        v = list[Array]()
        for side, interface in zip(problem.discrete.sides, problem.system.interfaces, strict=True):
            x = problem.discrete.meshes[side.body].x[interface.nodes]
            v.append(np.zeros((len(x), problem.system.k)))
            v[-1][:, -1] = 1.0
            if side.name in self.lines:
                long = self.of(side)
                v[-1][:, -1] = np.where(long.band.holds(long.charts[0].local(x)), 1.0, -1.0)
        return np.concatenate(v), np.zeros((sum(map(len, v)), problem.system.k))


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
        self._groups = [
            group
            for group in _connected(posed.interfaces)
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
        for group in self._groups:
            for side in group:
                pairs = [step.pairs[side.name] for step in steps]
                forces[side.name] = max(float(pair.weight @ pair.pressure) for pair in pairs)
            if not any(forces[side.name] for side in group):
                forces |= self._of_overlaps(group, steps[-1])
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
    ) -> tuple[dict[str, _Long | None], dict[str, _Long]]:
        """Return what is known of contacts, and those of a group that carry anything; none of them
        if one is not long."""
        known, result = dict(laid.long), dict[str, _Long]()
        for side in group:
            force = forces.get(side.name, 0.0)
            if force > 0.0 and side.name not in known:
                known[side.name] = self._expected(side, force, meshes)
            long = known[side.name] if force > 0.0 else None
            if long is None and (force > 0.0 or solution is None):
                return known, {}
            if long is not None and solution is not None and side.name in laid.lines:
                long = replace(long, band=followed(long, solution))
            if long is not None:
                result[side.name] = long
        return known, result

    def _on_all(
        self, meshes: Sequence[SurfaceMesh], longs: Mapping[str, _Long], levels: Mapping[str, int]
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

    def _bands_of(self, long: _Long) -> list[ContactBand]:
        """Return the band on the secondary, and the same band on the primary, if that is a body."""
        own, band = long.charts[0], long.band
        if len(long.charts) == 1:
            return [band]
        chart = long.charts[1]
        x, normal = own.at(band.points), own.normal(band.points)
        places = opposite(chart, x, normal, long.side.direction)[0]
        way = np.gradient(places, axis=0)
        way /= np.linalg.norm(way, axis=1, keepdims=True)
        across = np.column_stack([way[:, 1], -way[:, 0]])
        return [band, replace(band, points=places, across=across)]

    def _expected(
        self, side: PosedInterface, force: float, meshes: Sequence[SurfaceMesh]
    ) -> _Long | None:
        """Return the contact that a force makes, or None if it is not long or has no ridge."""
        shape = self._shape(side)
        if shape is None:
            return None
        (charts, _, ridge), modulus = shape, 1.0 / self._posed.softness(side)
        places = charts[0].at(ridge.points)
        forecast = forecast_of(ridge, places, force, modulus)
        if not _is_long(forecast):
            return None
        first, last = (self._mirrors(side.body, meshes, x) for x in places[[0, -1]])
        band = replace(band_of(ridge, forecast), mirrored=(first, last))
        return _Long(side, charts, ridge, band)

    def _of_overlaps(self, group: Sequence[PosedInterface], step: StepResult) -> dict[str, float]:
        """Return the forces that end overlaps between nodes, which contacts of a group share: a
        roller may be pressed into one of two plates before it moves."""
        shapes = {side.name: shape for side in group if (shape := self._shape(side))}
        depths, forces = [0.0], dict[str, float]()
        for name, (charts, gap, ridge) in shapes.items():
            pair, least = step.pairs[name], int(ridge.gap.argmin())
            place = charts[0].at(ridge.points[[least]])
            near = [int(np.linalg.norm(pair.x - place, axis=1).argmin())]
            moved = float((gap(charts[0].local(pair.x[near])) - pair.gap[near])[0])
            depths.append(max(moved - float(ridge.gap[least]), 0.0))
        depth = sum(depths) / len(group)
        for side in group:
            if side.name in shapes and 0.0 < depth < math.inf:
                charts, _, ridge = shapes[side.name]
                modulus = 1.0 / self._posed.softness(side)
                forces[side.name] = force_at(ridge, charts[0].at(ridge.points), depth, modulus)
        return forces

    def _shape(self, side: PosedInterface) -> _Shape | None:
        """Return the shape of a contact, looked for once; None if it has no straight ridge."""
        return self.once(side.name, lambda: self._looked_for(side))

    def _looked_for(self, side: PosedInterface) -> _Shape | None:
        charts = self._charts(side, None)
        if len(charts) < len(side.ends):
            return None
        gap = face_gap(charts[0], side.law.gap, side.direction, *charts[1:])
        start = lowest_sample(gap, charts[0])
        if start is None:
            return None
        middle = charts[0].at(start[None])
        charts = self._charts(side, middle[0])
        gap = face_gap(charts[0], side.law.gap, side.direction, *charts[1:])
        ridge = ridge_of(gap, charts[0], charts[0].local(middle)[0])
        if ridge is None or ridge.closed or not ridge.straight:
            return None
        return charts, gap, ridge

    def _mirrors(self, body: int, meshes: Sequence[SurfaceMesh], x: Array) -> bool:
        """Return whether a face of a plane of symmetry, or on rollers, ends at a point (3,)."""
        planes = [
            part
            for part, condition in self._posed.bodies[body].conditions[0].items()
            if isinstance(condition, Symmetry)
            or (isinstance(condition, Displacement) and condition.free.count(False) == 1)
        ]
        there = set(meshes[body].part_names) & set(planes)
        return any(len(all_at(meshes[body], x, part)[0]) > 0 for part in there)

    def _charts(self, side: PosedInterface, middle: Array | None) -> list[Chart]:
        """Return the charts of the faces of a contact that have any."""
        found = (chart_of(self._boundaries[b], part, middle) for b, part in side.ends)
        return [chart for chart in found if chart is not None]


def _connected(sides: Sequence[PosedInterface]) -> list[list[PosedInterface]]:
    """Return groups of interfaces that have no part in common with others."""
    groups = list[list[PosedInterface]]()
    for side in sides:
        shares = [any(set(side.ends) & set(other.ends) for other in group) for group in groups]
        own = [other for group, near in zip(groups, shares, strict=True) if near for other in group]
        apart = [group for group, near in zip(groups, shares, strict=True) if not near]
        groups = [*apart, [*own, side]]
    return groups


def followed(long: _Long, solution: Solution) -> ContactBand:
    """Return a band with the width, the length and the place along the ridge that a solution has.

    Hertz' slices have ∫ p x²/∫ p = a²/4. Along the ridge the second moment of the load is compared
    with the one that is expected. Ends that are sharp stay.
    """
    pair = max(
        (step.pairs[long.side.name] for step in step_ends(solution.steps or solution.tried)),
        key=lambda each: float(each.weight @ each.pressure),
    )
    band = long.band
    across, along = band.coordinates(long.charts[0].local(pair.x))
    force = pair.weight * pair.pressure * long.is_inside(along)
    if not force.any():
        return band
    usual = band.load * np.gradient(band.s) * long.is_inside(band.s)
    expected = 0.25 * float(usual @ band.half**2 / usual.sum()) / WIDER**2
    half = band.half * math.sqrt(float(force @ across**2 / force.sum()) / expected)
    if any(band.sharp):
        return replace(band, half=half)
    both = _spread(band.s, usual), _spread(along, force)
    s, ends = (_moved(places, *both) for places in (band.s, np.array(band.ends)))
    return ContactBand(
        *long.ridge.at(s), s, half, band.load, (float(ends[0]), float(ends[1])), band.sharp
    )


def _moved(places: Array, old: tuple[float, float], new: tuple[float, float]) -> Array:
    """Return places (n,) moved from one mean and standard deviation to others, slightly longer."""
    return new[0] + WIDER * new[1] / old[1] * (places - old[0])


def _spread(values: Array, weight: Array) -> tuple[float, float]:
    """Return the mean and the standard deviation of values."""
    mean = float(weight @ values / weight.sum())
    return mean, float(np.sqrt(weight @ (values - mean) ** 2 / weight.sum()))


def _is_long(forecast: Forecast) -> bool:
    """Return whether a contact is longer than an ellipse that rings surround."""
    low, high = forecast.ends
    return high - low > 2.0 * ELONGATED * forecast.usual


def _difference(
    before: tuple[Solution, StepResult],
    after: tuple[Solution, StepResult],
    side: PosedInterface,
    weight: Array,
) -> float:
    """Return the relative L2 difference of p and q of an interface, at the nodes of the second
    mesh, with weights (m,) [-]."""
    old, new = (step.pairs[side.name] for _, step in (before, after))
    mesh = as_surface([*before[0].meshes.values()][side.body])
    element, place = located(mesh, new.x, side.part, NEAR * sizes(mesh))
    found = element >= 0
    basis = mesh.basis_at(element[found], place[found])[:, before[0].nodes[side.name]]
    square = (basis @ _tractions(old) - _tractions(new)[found]) ** 2
    of_p, of_q = weight[found] @ square[:, 0], weight[found] @ square[:, 1:].sum(axis=1)
    size = float(weight @ new.size**2)
    return math.sqrt(max(float(of_p), float(of_q)) / size) if size > 0.0 else 0.0


def _tractions(pair: PairResult) -> Array:
    """Return p and the vector σ_t, (m, 4) [stress]."""
    return np.column_stack([pair.pressure, np.einsum("mk,mkd->md", pair.sigma_t, pair.tangent)])
