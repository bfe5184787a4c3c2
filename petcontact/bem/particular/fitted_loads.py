"""Volume loads as polynomials in the box about a body, and the particular solutions for them."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...arrays import Array
from ...errors import InputError
from ...given.body_data import Loads
from ...given.sites import Sites
from ...given.tables.material import Material
from ...given.values import Given
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.ring_mesh import RingMesh, TwistedRingMesh
from ...record import Keeping
from ...round_off import CHAINED
from .fit import GRID, fitted, points_in, winding
from .jumps import JumpingSolution, Pieces, pieces_of
from .polynomial_solution import ParticularSolution, particular_solution
from .polynomials import BodyBox, padded, values
from .revolved_solution import RingBox

BOXES: dict[type, Any] = {RingMesh: RingBox, TwistedRingMesh: RingBox}
"""Class of the box by the kind of a mesh, where it is not `BodyBox`."""
Solved = ParticularSolution | JumpingSolution
"""A particular solution in a load state."""
LINES = (-0.764, -0.236, 0.0, 0.382, 0.9)
"""Places of lines through a box, over half its width, along which loads may be narrow."""


@dataclass
class FittedLoads(Keeping):
    """A body and its box, in which loads become polynomials."""

    material: Material
    mesh: BoundaryMesh
    notes: list[str] = field(default_factory=list)
    missed: float = 0.0
    known: dict[tuple[Given, Pieces | None, int], Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.box = BOXES.get(type(self.mesh), BodyBox).around(self.mesh)

    @functools.cached_property
    def points(self) -> Array:
        """Points of the body at which loads are fitted, (m, d) [length]."""
        return points_in(self.mesh, self.box)

    def solution(self, loads: Loads) -> Solved | None:
        """For the loads of one state, None where there are none; of the same loads the same
        object."""
        return None if loads.is_none else self.once(loads, lambda: self._solution(loads))

    def _solution(self, loads: Loads) -> Solved:
        """Return the solution; where loads jump along curves, of the pieces between these."""
        data = (*loads.acceleration, *loads.force, loads.temperature)
        rough = [datum for datum in data if math.isinf(datum.degree)]

        def values_at(x: Array) -> Array:
            return np.column_stack([datum.near(Sites(x)) for datum in rough])

        for datum in rough:
            largest = float(np.abs(datum.at(Sites(self.points))).max())
            _check_seen(datum, self.mesh, self.box, largest)
        pieces = pieces_of(values_at, self.mesh, self.points) if rough else None
        if pieces is None:
            return self._in_piece(loads, None, 0)
        numbers = range(pieces.count)
        solutions = [self._in_piece(loads, pieces, number) for number in numbers]
        expected = [
            functools.partial(self._values, [self.known[datum, pieces, number] for datum in rough])
            for number in numbers
        ]
        return JumpingSolution.between(self.mesh, pieces, solutions, expected)

    def _values(self, polynomials: list[Array], x: Array) -> Array:
        """Return the values (m, c) of polynomials at points (m, d)."""
        xi = self.box.local(x)
        return np.column_stack([values(p, xi) for p in polynomials])

    def _in_piece(self, loads: Loads, pieces: Pieces | None, number: int) -> ParticularSolution:
        """Return the solution for the loads of a piece; of all of the body if there are none."""
        density = self.material.density or 0.0
        polynomial = functools.partial(self._polynomial, pieces, number)
        parts = [self._centrifugal(loads, density)]
        for data, factor in ((loads.acceleration, density), (loads.force, 1.0)):
            stress = factor * self.box.half.max()
            if data:
                parts.append([factor * polynomial(datum, stress) for datum in data])
        size = max(len(p) for part in parts for p in part)
        force = sum(np.array([padded(p, size) for p in part]) for part in parts)
        along = list(np.tensordot(self.box.axes, force, 1))
        hot = self.material.model_copy(update={"plane": "stress"}).thermal_stress
        heat = polynomial(loads.temperature, hot)
        return particular_solution(self.box, along, heat, self.material)

    def _centrifugal(self, loads: Loads, density: float) -> list[Array]:
        """ρω² times the vector from the axis, a polynomial of degree 1 a component."""
        d, across = self.mesh.dim, self.box.across(loads.axis)
        middle = across @ (self.box.centre - np.array(loads.centre or (0.0,) * d))
        result = np.zeros((d, *(2,) * d))
        result[(slice(None), *(0,) * d)] = middle
        for j, way in enumerate(np.eye(d, dtype=int)):
            result[(slice(None), *way)] = across @ self.box.axes[j] * self.box.half[j]
        return list(density * loads.angular_velocity**2 * result)

    def _polynomial(self, pieces: Pieces | None, number: int, datum: Given, stress: float) -> Array:
        """Return the polynomial of a number, or of other data by a fit in a piece; a value of 1
        makes about a `stress`."""
        if not datum.varies:
            return np.full((1,) * self.mesh.dim, float(datum.source))
        if (datum, pieces, number) not in self.known:
            points = self.points
            if pieces is not None:
                points = points[(pieces.around(points) == number).all(axis=1)]

            def values_at(points: Array) -> Array:
                return datum.at(Sites(points))

            found, missed, mean = fitted(values_at, points, self.box)
            self.known[datum, pieces, number] = found
            self.missed = max(self.missed, mean * stress)
            if missed > CHAINED:
                self.notes.append(
                    f"{datum.key}: the polynomial that stands for it misses it by {missed:.1e} of "
                    "its largest value; stresses may be as far off"
                )
        return self.known[datum, pieces, number]


def _check_seen(datum: Given, mesh: BoundaryMesh, box: BodyBox | RingBox, largest: float) -> None:
    """Refuse a load in a volume that is narrower than the points apart which it is fitted at.

    It is looked at along lines through the box. Its width is the length of the longest pieces on
    which it is more than half as large as anywhere.

    Raises
    ------
    InputError
    """
    for axis in range(mesh.dim):
        found = [_on_line(datum, mesh.dim, box, axis, share) for share in LINES]
        most = max([largest, *(float(value.max(initial=0.0)) for *_, value in found)])
        wide = (
            2.0
            * box.half[axis]
            * max(
                float(np.diff(at)[np.minimum(value[1:], value[:-1]) > 0.5 * most].sum())
                for at, _, value in found
            )
        )
        if not 0.0 < wide < 2.0 * box.half[axis] / GRID[mesh.dim]:
            continue
        if any((winding(mesh, x[value > 0.5 * most]) > 0.5).any() for _, x, value in found):
            raise InputError(
                f"{datum.words} is narrower than loads in a volume may be: it is more than half "
                f"as large as {most:.3g} on {wide:.1e} only; make it wider, or bond a body of "
                "that width"
            )


def _on_line(
    datum: Given, d: int, box: BodyBox | RingBox, axis: int, share: float
) -> tuple[Array, Array, Array]:
    """Return fractions of a line through the box, the points there, and the size of a load."""

    def way(fractions: Array) -> Sites:
        line = np.full((len(fractions), d), share)
        line[:, axis] = 2.0 * fractions - 1.0
        return Sites(box.centre + (line * box.half) @ box.axes)

    fractions = datum.features(way)[1]
    sites = way(fractions)
    return fractions, sites.x, np.abs(datum.near(sites))
