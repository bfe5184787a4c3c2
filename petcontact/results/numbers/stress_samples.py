"""Stress of a body at samples, its tops, and the climb to them."""

from __future__ import annotations

import itertools
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...arrays import Array, Mask, shown
from ...fields.boundary.places import all_at, located, sizes, widths
from ...fields.stress_state import StressState
from ...record import Keeping
from ...round_off import SUMMED, first_largest
from ..evaluated import Evaluated
from ..records import StepResult
from ..strength.place import Place
from ..strength.singular_places import singular_places
from ..strength.strengths import (
    AROUND,
    RING,
    TOP,
    growth,
    level,
    tops,
)
from .number import Number
from .peak_places import places_inside

NOTHING = 1e-6
"""Stress, over the largest component in the body, that is none: ten times the defect up to which
the boundary integral equations are taken for solved."""
SMALLER = 0.8
"""Size of an element over that on the mesh before, up to which it is refined [-]."""
CLIMBS, FINEST, GRID = 20, 1e-3, 25
"""Most steps of a climb, each to the best of a grid, which is as wide as the places of the one
before are apart, or twice as wide where the way leads on; it ends with a grid of this share of the
first, which is as wide as samples are apart. A maximum is flat: its value is right to the square of
that. A grid has about so many places: three along each direction of space, five inside plane bodies
and on surfaces, all of them along a curve."""
AWAY = 8.0
"""Distance from a sample to a top over half of that to the next samples, at most: beside graded
elements the next one on the other side may be four times as far away. A way that leads farther,
though no sample there is larger, leads to a place without a bound or into an element."""
SHALLOW = 0.5
"""Distance of stress inside from an element, over half the length of that, up to which it is that
of the surface: displacements jump from element to element, and the stress that a jump makes falls
like 1/r. Below the edge of a pressure of 100 on a bolted plate the first principal one was 390, 88,
40 and 6 at 0.02, 0.1, 0.2 and 0.5, and 19 is the largest on the surface."""
FLAT = 1e-3
"""Share by which stress differs where it is one: that of a twisted shaft rises by 5e-4 towards its
ends, and by 7e-3 from a distance to half of it where λ is 0.99."""
TRIED = 8
"""Samples that are climbed from, the largest first, until one leads to a top."""
ROUND = 25
"""Places on the arc about a place without a bound, first from side to side, then about the best."""


class Samples(Keeping):
    """Stress of a body after a step at samples: on its boundary first, then inside."""

    def __init__(self, solution: Evaluated, body: str, step: StepResult) -> None:
        self._solution, self.body, self._step = solution, body, step
        self._fields = solution.body_fields(body, step)
        self._near = dict[Hashable, StressState]()
        self._found = dict[str, Array]()
        mesh, places = self._fields.mesh, singular_places(solution, step)[body]
        element, boundary = solution.boundary_state(body, step)
        inside = places_inside(solution, body, step)
        inside = inside[~self._too_near(inside)]
        self._element, self._states = element, [boundary]
        if self._fields.known and len(inside):
            self._states.append(self._fields.at(inside, outside=np.nan))
        self._x = np.vstack([state.x for state in self._states])
        self._away = np.min(
            [np.full(len(self._x), np.inf), *(place.away(self._x) for place in places)],
            axis=0,
        )
        u, material = self._fields.found.u, self._fields.body.material
        self._whole = float(np.ptp(mesh.x, axis=0).max())
        strain = float(np.abs(u).max()) / self._whole
        largest = float(np.nanmax(np.abs(boundary.components), initial=0.0))
        # a rigid motion leaves round-off of E times displacement over the size of the body
        self._least = max(NOTHING * largest, SUMMED * material.young_modulus * strain)
        self._reach = {each: each.reach(mesh) for each in filter(self._grows, places)}

    @property
    def fields_known(self) -> bool:
        """Whether stress inside the body is known."""
        return self._fields.known

    def _grows(self, place: Place) -> bool:
        """Whether stress may grow towards a place.

        It does by what its sides do, but where the elements that end there have the same stress as
        larger ones on the mesh before. How much K adds does not count: that is known only to its
        error, which differs from mesh to mesh."""
        rows = np.flatnonzero(np.isin(self._element, place.elements))
        now = self._values("von_mises")[rows]
        coarser, at = self._solution.coarser, (self._step.step, self._step.cycle)
        ends = [each for each in coarser.steps if (each.step, each.cycle) == at] if coarser else []
        if coarser is None or not ends or not now.any():
            return bool(now.any() or not len(rows))
        other, size = coarser.meshes[self.body], sizes(self._fields.mesh)[self._element[rows]]
        element, there = located(other, self._x[rows], within=sizes(other))
        if (element < 0).any() or (size > SMALLER * sizes(other)[element]).any():
            return True
        before = coarser.body_fields(self.body, ends[-1]).on_boundary(element, there).von_mises
        return bool((np.abs(now - before) > self._least).any())

    def endless(self, key: str) -> list[tuple[float, Place]]:
        """Return the largest stress at samples about each place without a bound, and the place."""
        values = self._values(key)
        return self.once(
            ("endless", key),
            lambda: [(level(each.away(self._x), each, values), each) for each in self._reach],
        )

    def without_bound(self, name: str, place: Place) -> Number:
        """Return the number that says that a stress has no bound at a place, in no step."""
        where = "" if place.is_edge else f" {shown(place.x)}"
        end = 0, 0, np.array([np.inf]), "stress", 0.0, np.inf, 0.0
        name = f"{name} stress at {place.sides}{where}"
        return Number(name, self.body, *end, place.x, place.sides, place.x)

    def look_around(self, arcs: Sequence[tuple[Place, float, float]]) -> None:
        """Find the stress on arcs about places, each between two angles, all at once."""
        new = [arc for arc in arcs if arc not in self._near]
        if new:
            points = np.vstack([self._arc(*arc) for arc in new])
            state = self._fields.at(points, outside=np.nan)
            for k, arc in enumerate(new):
                self._near[arc] = state.take(slice(k * ROUND, (k + 1) * ROUND))

    def _arc(self, place: Place, low: float, high: float) -> Array:
        """Points of an arc; those at its sides lie on the surface, which may be curved."""
        mesh, theta = self._fields.mesh, np.linspace(low, high, ROUND)
        points, ends = place.around(theta), (theta == 0.0) | (theta == place.angle)
        element, foot = located(mesh, points, within=sizes(mesh))
        ends &= (element >= 0) & (len(place.elements) > 0)
        points[ends] = mesh.at(element[ends], foot[ends])[0]
        return points

    def largest_on_arc(
        self, key: str, place: Place, low: float = 0.0, high: float | None = None
    ) -> tuple[float, Array, float, float]:
        """Return the largest stress at the distance of a place between two angles, by default those
        of its sides, where it is, and the angles of the points beside that."""
        arc = place, low, place.angle if high is None else high
        self.look_around([arc])
        state, theta = self._near[arc], np.linspace(*arc[1:], ROUND)
        values = np.nan_to_num(getattr(state, key), nan=-np.inf)
        k = first_largest(values)
        ends = float(theta[max(k - 1, 0)]), float(theta[min(k + 1, ROUND - 1)])
        return float(values[k]), state.x[k], *ends

    def beside(self, name: str, key: str, place: Place) -> Number:
        """Return the largest stress at the distance of a place without a bound, or at a top up to
        twice as far away."""
        best, x, low, high = self.largest_on_arc(key, place)
        closer = self.largest_on_arc(key, place, low, high)
        best, x = max((best, x), closer[:2], key=lambda each: each[0])
        largest = self._number(x, max(best, 0.0), int(located(self._fields.mesh, x[None])[0][0]))
        near = place.away(self._x) < RING * place.distance
        values = np.where(near & ~self._leaves_out(self._x, 1.0), self._values(key), -np.inf)
        if values.max() > best:
            largest = self.top(key, self._sample(key, first_largest(values)), best) or largest
        return replace(
            largest,
            name=f"{name} beside {place.sides}",
            alone=max(largest.alone, FINEST * best),
            beside=place.x,
        )

    def _number(self, x: Array, value: float, element: int) -> Number:
        """A stress at a point of an element, -1 inside; it has no name yet."""
        mesh, end = self._fields.mesh, (self._step.step, self._step.cycle)
        part = mesh.part_names[mesh.part[element]] if element >= 0 else ""
        return Number("", self.body, *end, np.array([value]), "stress", place=x, part=part)

    def _sample(self, key: str, k: int) -> Number:
        """The stress at a sample."""
        element = self._element[k] if k < len(self._element) else -1
        return self._number(self._x[k], float(self._values(key)[k]), int(element))

    def peaks(self, key: str, inside: bool) -> Iterator[Number]:
        """Yield the largest samples that are tops, on the boundary or inside, up to twice as far
        from places without a bound as stress is told beside them."""
        values, count = self._values(key), len(self._element)
        # inside nothing is larger, on the surface nothing on it
        seen = len(values) if inside else count
        usable = np.isfinite(values) & ~self._leaves_out(self._x, RING)
        usable[:count] &= not inside
        least = values - FLAT * np.abs(values)
        rows = tops(
            self._x[:seen], values[:seen], TOP * self._away[:seen], usable[:seen], least[:seen]
        )
        yield from (self._sample(key, k) for k in itertools.islice(rows, TRIED))

    def top(self, key: str, peak: Number, above: float) -> Number | None:
        """The top near a sample; None where it is not above a bound, or where the way up leads to a
        place without a bound.

        Between samples, and between places of a grid, stress is larger than at the best of them by
        less than it varies from place to place.
        """
        value, place = float(peak.value[0]), peak.place
        assert place is not None  # those of `peaks` have one
        if abs(value) <= self._least:
            return peak if value > above else None
        away = np.linalg.norm(self._x - place, axis=1)
        nearest = np.argsort(away)[: AROUND + 1]
        if 2.0 * value - float(self._values(key)[nearest].min()) <= above:
            return None
        step = 0.5 * float(away[nearest[len(place) + 1]])
        reached = self._climbed(key, value, place, peak.part, step, above)
        if reached is None or reached[0] <= above:
            return None
        best, x = reached
        grown = best * float(growth(self._solution, self._step, self.body, x[None])[0, 0])
        alone = max(self._apart(key, x, peak.part), grown)
        return replace(peak, value=np.array([best]), place=x, alone=alone)

    def _apart(self, key: str, place: Array, part: str) -> float:
        """How far elements of the surface that meet at a place differ there, which no refinement
        elsewhere takes away; under one load, since a jump of the temperature is one of stress."""
        if not part:
            return 0.0
        x, u, stress = self._fields.boundary.at(*all_at(self._fields.mesh, place, part))
        moved, added, heat = (each[:1] for each in self._fields.loads.volume_at(x))
        loads = moved.repeat(len(x), 0), added.repeat(len(x), 0), heat.repeat(len(x), 0)
        values = getattr(self._fields.whole(x, u, stress, loads), key)
        return float(np.ptp(values)) if len(values) else 0.0

    def _climbed(
        self, key: str, value: float, start: Array, part: str, first: float, above: float
    ) -> tuple[float, Array] | None:
        """The top that is reached from a value at a place, by grids of some first half width."""
        ways, apart = self._ways(start, part)
        place, step, most = start, first, value + FLAT * abs(value)
        for _ in range(CLIMBS):
            x, values = self._values_near(key, place, step, ways, part)
            k, reached = first_largest(values), 0.0
            if values[k] > value + FINEST**2 * abs(value):
                far = np.linalg.norm(x[k] - start) > AWAY * first
                if far or self._leaves_out(x[k : k + 1], 1.0)[0]:
                    return (value, place) if value <= most else None
                reached = float(np.linalg.norm(x[k] - place))
                value, place = float(values[k]), x[k]
            leads_on = reached > (1.0 - apart) * step
            least = float(values[np.isfinite(values)].min(initial=value))
            if not leads_on and 2.0 * value - least <= above:
                return None
            step *= 2.0 if leads_on else apart
            if step < FINEST * first:
                break
        # at the rim of what is too near to the surface stress grows on to that
        at_rim = not part and self._too_near(place + step * ways).any()
        return None if at_rim else (value, place)

    def _ways(self, place: Array, part: str) -> tuple[Array, float]:
        """The ways (k, d) from a place to those of a grid of half width 1, inside or on
        the plane that touches the surface, and how far apart these are."""
        mesh, axes = self._fields.mesh, np.eye(len(place))
        if part:
            foot = located(mesh, place[None], part, within=sizes(mesh))
            axes = mesh.tangents_to(mesh.at(*foot)[1])[0]
        count = round(GRID ** (1.0 / len(axes)))
        grid = np.meshgrid(*[np.linspace(-1.0, 1.0, count)] * len(axes))
        return np.reshape(grid, (len(axes), -1)).T @ axes, 1.0 / count

    def _values_near(
        self, key: str, place: Array, step: float, ways: Array, part: str
    ) -> tuple[Array, Array]:
        """Points of a grid about a place, or their feet on a part of the surface, and the stress
        there."""
        # one top is looked for by several names, and again beside places without a bound
        known = place.tobytes(), step, part
        state = self.once(known, lambda: self._state_near(place + step * ways, part))
        return state.x, np.nan_to_num(getattr(state, key), nan=-np.inf, posinf=-np.inf)

    def _state_near(self, points: Array, part: str) -> StressState:
        """Stress at points inside, or at the feet of points on a part of the surface."""
        mesh = self._fields.mesh
        if part:
            element, foot = located(mesh, points, part, within=sizes(mesh))
            return self._fields.on_boundary(element[element >= 0], foot[element >= 0])
        return self._fields.at(points[~self._too_near(points)], outside=np.nan)

    def _too_near(self, x: Array) -> Mask:
        """Which points (q, d) inside are nearer to an element than `SHALLOW` times its size."""
        reach = SHALLOW * widths(self._fields.mesh)
        return located(self._fields.mesh, x, within=reach)[0] >= 0

    def _leaves_out(self, x: Array, times: float) -> Mask:
        """Which points (q, d) lie nearer to places without a bound than some times the distance at
        which stress is told, or next to elements that end there."""
        beside = {place: max(reach, times * place.distance) for place, reach in self._reach.items()}
        left_out = (place.away(x) < reach for place, reach in beside.items())
        return np.asarray(np.any([np.zeros(len(x), dtype=bool), *left_out], axis=0))

    def _values(self, key: str) -> Array:
        """Return the stress at all samples; values that are not finite are -∞."""
        if key not in self._found:
            values = np.concatenate([getattr(state, key) for state in self._states])
            values = np.where(np.abs(values) < self._least, 0.0, values)
            self._found[key] = np.where(np.isfinite(values), values, -np.inf)
        return self._found[key]
