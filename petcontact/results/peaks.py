"""The largest stresses of a solution, in its bodies and on their surfaces.

Stress is sampled on the boundary, below every contact and all over the body. Where it has no bound
(`unbounded`) the samples say how near they lie, and no more: such a place is named, and stress
within its reach, which does not depend on the mesh, is left out. Of the samples that are left the
largest counts; inside the body it is climbed to its top.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ..arrays import Array, Mask, shown
from ..fields.boundary.places import located, sizes
from ..round_off import SINGLE, SUMMED, first_largest
from .evaluated import Evaluated
from .number import Number
from .peak_places import places_inside
from .records import StepResult, step_ends
from .unbounded import Unbounded, unbounded_places

QUANTITIES = {"von Mises": "von_mises", "first principal": "first_principal"}
"""Of `StressState`, by their names in the verdict."""
NOTHING = 1e-6
"""Stress, over the largest component in the body, that is none: ten times the defect up to which
the boundary integral equations are taken for solved."""
MORE = 1e-3
"""Share by which a stress inside is more than all on the surface, to be named besides."""
CLIMBS, FINEST, GRID = 20, 1e-3, 25
"""Most steps of a climb, each to the best of a grid, which is as wide as the places of the one
before are apart, or twice as wide where the way leads on; it ends with a grid of this share of the
first, which is as wide as samples are apart. A maximum is flat: its value is right to the square of
that. A grid has about so many places: three along each direction of space, five inside plane bodies
and on surfaces, all of them along a curve."""
SHALLOW = 0.5
"""Distance of stress inside from an element, over half the length of that, up to which it is that
of the surface: displacements jump from element to element, and the stress that a jump makes falls
like 1/r. Below the edge of a pressure of 100 on a bolted plate the first principal one was 390, 88,
40 and 6 at 0.02, 0.1, 0.2 and 0.5, and 19 is the largest on the surface."""


def stress_peaks(solution: Evaluated, ends: Sequence[StepResult] | None = None) -> list[Number]:
    """Return the largest stresses of `QUANTITIES`, where they are finite somewhere, after some
    increments, by default the ends of steps: inside, on the surface, and where they have no bound.

    They are those away from places without a bound; there is none where all stress only falls from
    these, and none inside unless it is larger there than on the surface.
    """
    # numbers of an altered file, or of a solve that failed, may overflow
    with np.errstate(all="ignore"):
        ends = step_ends(solution.steps or solution.tried) if ends is None else ends
        samples = [_Samples(solution, body, step) for step in ends for body in solution.meshes]
        return [number for name in QUANTITIES for number in _largest(samples, name)]


def _largest(samples: Sequence[_Samples], name: str) -> list[Number]:
    """Return the largest of one stress over bodies and steps."""
    key = QUANTITIES[name]
    peaks = [(peak, some) for some in samples for peak in some.peaks(key)]
    tops, above = list[Number | None](), -np.inf
    for on in (True, False):
        of_kind = (each for each in peaks if bool(each[0].part) == on)
        largest = max(of_kind, key=lambda each: float(each[0].value[0]), default=None)
        tops.append(largest and largest[1].top(key, largest[0], above))
        above = float(tops[0].value[0]) + MORE * tops[0].size if tops[0] else above
    unbounded = {
        (some.body, place.sides): some.without_bound(name, place)
        for some in reversed(samples)
        for place in some.exceeding(key, tops[0])
    }
    named = [
        replace(top, name=f"{name} stress {where}", alone=FINEST**2 * top.size)
        for top, where in zip(reversed(tops), ("inside", "on the surface"), strict=True)
        if top is not None
    ]
    return [*named, *unbounded.values()]


def largest_at(solution: Evaluated, body: str, points: Array, stress: Array) -> str:
    """Return in words the largest of stresses (n,) at points (n, d) after the last increment.

    Next to a place without a bound the number only says how near the points lie.
    """
    k = first_largest(stress)
    near = [
        each.sides
        for each in unbounded_places(solution, solution.last)[body]
        if each.leaves_out(points[k : k + 1])[0]
    ]
    where = f", next to {near[0]}, where stress has no bound" if near else ""
    return f"{stress[k]:.4g} at {shown(points[k], 4)}{where}"


class _Samples:
    """Stress of a body after a step at samples: on its boundary first, then inside."""

    def __init__(self, solution: Evaluated, body: str, step: StepResult) -> None:
        self._fields, self.body, self._step = solution.body_fields(body, step), body, step
        self._places = unbounded_places(solution, step)[body]
        mesh = self._fields.mesh
        element, boundary = solution.boundary_state(body, step)
        inside = places_inside(solution, body, step)
        inside = inside[~(self._too_near(inside) | self._near_unbounded(inside))]
        beyond, foot = located(mesh, self._around(boundary.x), within=sizes(mesh))
        self._element = np.append(element, beyond[beyond >= 0])
        self._states = [boundary, self._fields.on_boundary(beyond[beyond >= 0], foot[beyond >= 0])]
        if self._fields.known and len(inside):
            self._states.append(self._fields.at(inside, outside=np.nan))
        self._x = np.vstack([state.x for state in self._states])
        self._beside = self._near_unbounded(self._x)
        u, material = self._fields.found.u, self._fields.body.material
        strain = float(np.abs(u).max()) / float(np.ptp(mesh.x, axis=0).max())
        largest = float(np.nanmax(np.abs(boundary.components), initial=0.0))
        # a rigid motion leaves round-off of E times displacement over the size of the body
        self._least = max(NOTHING * largest, SUMMED * material.young_modulus * strain)

    def without_bound(self, name: str, place: Unbounded) -> Number:
        """Return the number that says that a stress has no bound at a place, in no step."""
        end = 0, 0, np.array([np.inf]), "stress", 0.0, np.inf, 0.0
        return Number(f"{name} stress at {place.sides}", self.body, *end, place.x, place.sides)

    def peaks(self, key: str) -> Iterator[Number]:
        """Yield the largest samples on the boundary and inside, away from unbounded places; they
        have no names yet."""
        values = self._values(key)
        count = len(self._element)
        usable = np.isfinite(values) & ~self._beside
        for rows in (np.arange(count), np.arange(count, len(values))):
            rows = rows[usable[rows]]
            if len(rows):
                k = int(rows[first_largest(values[rows])])
                mesh = self._fields.mesh
                part = mesh.part_names[mesh.part[self._element[k]]] if k < count else ""
                end = self._step.step, self._step.cycle, values[k : k + 1], "stress"
                yield Number("", self.body, *end, place=self._x[k], part=part)

    def exceeding(self, key: str, peak: Number | None) -> list[Unbounded]:
        """Return the unbounded places next to which a sample is larger than a peak."""
        values = self._values(key)[: len(self._element)]
        bound = self._least if peak is None else max(float(peak.value[0]), self._least)
        return [
            place
            for place in self._places
            if not place.elements or values[np.isin(self._element, place.elements)].max() > bound
        ]

    def top(self, key: str, peak: Number, above: float) -> Number | None:
        """The top near a sample; None where it is not above a bound, or where the way up leads
        inside to a place without a bound.

        Between places of a grid stress is larger than at the best of them by less than it varies
        from place to place. On the surface the way leads no nearer to a place without a bound than
        its reach, so that what is found does not depend on where the samples lie.
        """
        value, place = float(peak.value[0]), peak.place
        assert place is not None  # those of `peaks` have one
        if abs(value) <= self._least:
            return peak if value > above else None
        ways, apart = self._ways(place, peak.part)
        step = first = 0.5 * float(np.sort(np.linalg.norm(self._x - place, axis=1))[len(place) + 1])
        for _ in range(CLIMBS):
            x, values = self._values_near(key, place + step * ways, peak.part)
            beside = self._near_unbounded(x)
            values[beside & bool(peak.part)] = -np.inf
            k, reached = first_largest(values), 0.0
            if values[k] > value + FINEST**2 * abs(value):
                if beside[k]:
                    return None
                reached = float(np.linalg.norm(x[k] - place))
                value, place = float(values[k]), x[k]
            leads_on = reached > (1.0 - apart) * step
            least = float(values[np.isfinite(values)].min(initial=value))
            if not leads_on and 2.0 * value - least <= above:
                return None
            step *= 2.0 if leads_on else apart
            if step < FINEST * first:
                break
        return replace(peak, value=np.array([value]), place=place) if value > above else None

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

    def _values_near(self, key: str, points: Array, part: str) -> tuple[Array, Array]:
        """Points inside, or the feet of points on a part of the surface, and the stress there."""
        mesh = self._fields.mesh
        if part:
            element, foot = located(mesh, points, part, within=sizes(mesh))
            state = self._fields.on_boundary(element[element >= 0], foot[element >= 0])
        else:
            state = self._fields.at(points[~self._too_near(points)], outside=np.nan)
        return state.x, np.nan_to_num(getattr(state, key), nan=-np.inf, posinf=-np.inf)

    def _around(self, x: Array) -> Array:
        """The points just beyond the reach of places without a bound that are nearest to points
        (n, d) farther out, where stress may be largest."""
        beyond = [np.zeros((0, x.shape[1]))]
        for place in self._places:
            away = place.away(x)
            out = (away > place.reach) & (away < 2.0 * place.reach)
            share = ((1.0 + SINGLE) * place.reach / away[out])[:, None]
            beyond.append((1.0 - share) * place.nearest_to(x[out]) + share * x[out])
        return np.vstack(beyond)

    def _too_near(self, x: Array) -> Mask:
        """Which points (q, d) inside are nearer to an element than `SHALLOW` times its size."""
        reach = SHALLOW * sizes(self._fields.mesh)
        return located(self._fields.mesh, x, within=reach)[0] >= 0

    def _near_unbounded(self, x: Array) -> Mask:
        """Which points (q, d) lie next to places without a bound."""
        left_out = (place.leaves_out(x) for place in self._places)
        return np.asarray(np.any([np.zeros(len(x), dtype=bool), *left_out], axis=0))

    def _values(self, key: str) -> Array:
        """Return the stress at all samples; values that are not finite are -∞."""
        values = np.concatenate([getattr(state, key) for state in self._states])
        values = np.where(np.abs(values) < self._least, 0.0, values)
        return np.where(np.isfinite(values), values, -np.inf)
