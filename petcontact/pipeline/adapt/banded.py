"""Meshes whose panels follow long contacts: forecast from the shapes, then from solutions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...arrays import Array, Mask
from ...contact.state import Start
from ...fields.boundary.places import all_at, located, sizes
from ...geometry.arcs import cross
from ...geometry.charts import Chart, chart_of
from ...given.conditions import Displacement, Symmetry
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.panels.bands import LEVELS, banded
from ...refinement.panels.face_gaps import face_gap, opposite
from ...refinement.panels.forecast import WIDER, Forecast, band_of, forecast_of
from ...refinement.panels.ridge import Ridge, lowest_sample, ridge_of
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


@dataclass(frozen=True)
class _Long:
    """A long contact: its interface, the charts of its faces, its ridge, and the expected band."""

    side: PosedInterface
    charts: tuple[Chart, ...]
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


class Bands:
    """The bands of the long contacts of a problem, and the numbers of lines that they have had.

    Parameters
    ----------
    posed : Posed

    Attributes
    ----------
    level : dict of int
        Lines between the ridge and the edge of each band.
    faces : int
        Number of faces that may have bands.
    """

    def __init__(self, posed: Posed) -> None:
        self._posed, self._boundaries = posed, posed.boundaries
        ends = [end for side in posed.interfaces for end in side.ends]
        self._sides = [
            side
            for side in posed.interfaces
            if side.law.normal == "unilateral" and all(ends.count(end) == 1 for end in side.ends)
        ]
        self.faces = sum(len(side.bodies) for side in self._sides)
        self._long = dict[str, _Long | None]()
        self.level = dict[str, int]()
        self._start, self._made = 0, dict[str, int]()

    def first(
        self, meshes: Sequence[SurfaceMesh], wanted: float, completed: Completed
    ) -> list[SurfaceMesh]:
        """Return first meshes with bands where forces of contacts are known, else none.

        They have so many lines that one more line reaches the wanted error."""
        self._start = sum(LEFT * error > wanted for error in ERRORS[:-1])
        forces = {side.name: known_force(self._posed, side, meshes) for side in self._sides}
        return self._laid(
            meshes, {name: force for name, force in forces.items() if force}, completed
        )

    def next(
        self, solution: Solution, meshes: Sequence[SurfaceMesh], completed: Completed
    ) -> list[SurfaceMesh]:
        """Return meshes with bands that follow a solution, with more lines than before, or none."""
        steps = step_ends(solution.steps or solution.tried)
        forces = {}
        for side in self._sides:
            pairs = [step.pairs[side.name] for step in steps]
            forces[side.name] = max(float(pair.weight @ pair.pressure) for pair in pairs)
        return self._laid(meshes, forces, completed, solution)

    def apart(self, solutions: tuple[Solution, Solution], errors: TailErrors) -> float:
        """Return the relative error of p and q by their change from one band to the next [-].

        It is infinite unless all contacts that carry anything have bands on both. Ends at which p
        is infinite are left out.
        """
        before, after = solutions
        worst = 0.0
        for old, new in zip(step_ends(before.steps), step_ends(after.steps), strict=True):
            for side in self._posed.interfaces:
                if not new.pairs[side.name].size.any():
                    continue
                if self._made.get(side.name, 0) < 2:
                    return np.inf
                weight = errors.weight(side, new) * self._of(side).away(new.pairs[side.name].x)
                worst = max(worst, _difference((before, old), (after, new), side, weight))
        return LEFT * worst

    def start(self, problem: PreparedProblem) -> Start | None:
        """Return a start without tractions that is closed in the bands, or None without bands.

        Pairs without a band overlap everywhere."""
        if not self.level:
            return None
        v = list[Array]()
        for side, interface in zip(problem.discrete.sides, problem.system.interfaces, strict=True):
            x = problem.discrete.meshes[side.body].x[interface.nodes]
            v.append(np.zeros((len(x), problem.system.k)))
            v[-1][:, -1] = 1.0
            if side.name in self.level:
                long = self._of(side)
                v[-1][:, -1] = np.where(long.band.holds(long.charts[0].local(x)), 1.0, -1.0)
        return np.concatenate(v), np.zeros((sum(map(len, v)), problem.system.k))

    def _laid(
        self,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        completed: Completed,
        solution: Solution | None = None,
    ) -> list[SurfaceMesh]:
        """Return meshes with one line more in each band, or none if no band is new.

        First bands that cost too much have two lines less: the next ones then cost less, too, and
        show the error.
        """
        while True:
            made, levels = self._one_more(meshes, forces, solution)
            grown = [name for name, level in levels.items() if level != self.level.get(name)]
            made = completed(made) if grown else []
            if made:
                self._made |= {name: self._made.get(name, 0) + 1 for name in grown}
                self.level = levels
            if made or not grown or self.level or not self._start:
                return made
            self._start = max(self._start - 2, 0)

    def _one_more(
        self,
        meshes: Sequence[SurfaceMesh],
        forces: Mapping[str, float],
        solution: Solution | None,
    ) -> tuple[list[SurfaceMesh], dict[str, int]]:
        """Return meshes with one line more in each band, and the numbers of lines."""
        made, levels = [*meshes], dict(self.level)
        for side in self._sides:
            level = min(self.level.get(side.name, self._start - 1) + 1, LEVELS - 1)
            if not forces.get(side.name, 0.0) > 0.0:
                continue
            long = self._known(side, forces[side.name], meshes)
            if long is None:
                continue
            if solution is not None and side.name in self.level:
                long = replace(long, band=followed(long, solution))
            new = self._on_both(made, long, level)
            if new is not None:
                made, levels[side.name], self._long[side.name] = new, level, long
        return made, levels

    def _on_both(
        self, meshes: list[SurfaceMesh], long: _Long, level: int
    ) -> list[SurfaceMesh] | None:
        side, result = long.side, [*meshes]
        for (body, part), chart, band in zip(
            side.ends, long.charts, self._bands_of(long), strict=False
        ):
            mesh = banded(meshes[body], part, chart, band, level)
            if mesh is None:
                return None
            result[body] = mesh
        return result

    def _bands_of(self, long: _Long) -> list[ContactBand]:
        """Return the band on the secondary, and the same band on the primary, if that is a body."""
        own, band = long.charts[0], long.band
        if len(long.charts) == 1:
            return [band]
        chart = long.charts[1]
        x, normal = own.at(band.points), own.normal(band.points)
        places = opposite(chart, x, normal, long.side.direction)[0]
        step = 0.1 * band.widest
        beside = own.at(band.points + step * band.across)
        across = opposite(chart, beside, normal, long.side.direction)[0] - places
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        way = np.gradient(places, axis=0)
        # the faces look at one another: what is right-handed on one is left-handed on the other
        turned = cross(across, way)
        across = np.where(turned[:, None] > 0.0, across, -across)
        return [band, replace(band, points=places, across=across)]

    def _of(self, side: PosedInterface) -> _Long:
        """Return a long contact that has a band."""
        long = self._long[side.name]
        assert long is not None
        return long

    def _known(
        self, side: PosedInterface, force: float, meshes: Sequence[SurfaceMesh]
    ) -> _Long | None:
        """Return what is expected of a contact, looked for once; None if it is not long."""
        if side.name not in self._long:
            self._long[side.name] = self._expected(side, force, meshes)
        return self._long[side.name]

    def _expected(
        self, side: PosedInterface, force: float, meshes: Sequence[SurfaceMesh]
    ) -> _Long | None:
        """Return the contact that a force makes, or None if it is not long or has no ridge."""
        chart, other = self._charts(side, None)
        if chart is None or (side.primary is not None and other is None):
            return None
        gap = face_gap(chart, side.law.gap, side.direction, other)
        start = lowest_sample(gap, chart)
        if start is None:
            return None
        middle = chart.at(start[None])[0]
        chart, other = self._charts(side, middle)
        assert chart is not None
        gap = face_gap(chart, side.law.gap, side.direction, other)
        ridge = ridge_of(gap, chart, chart.local(middle[None])[0])
        if ridge is None or ridge.closed or not ridge.straight:
            return None
        modulus = 1.0 / self._posed.softness(side)
        places = chart.at(ridge.points)
        forecast = forecast_of(ridge, places, force, modulus)
        if not _is_long(forecast):
            return None
        charts = (chart,) if other is None else (chart, other)
        first, last = (self._mirrors(side.body, meshes, x) for x in places[[0, -1]])
        band = replace(band_of(ridge, forecast), mirrored=(first, last))
        return _Long(side, charts, ridge, band)

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

    def _charts(
        self, side: PosedInterface, middle: Array | None
    ) -> tuple[Chart | None, Chart | None]:
        own, *others = [chart_of(self._boundaries[b], part, middle) for b, part in side.ends]
        return own, (others[0] if others else None)


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
