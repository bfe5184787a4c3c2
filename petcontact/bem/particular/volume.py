"""The volume loads of a body in every load state, and a particular solution for them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...arrays import Array
from ...geometry.rotation import lifted
from ...given.bodies import NO_RISE, Body, Loads
from ...given.sites import Sites
from ...given.tables.material import Material
from ...given.values import Given
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.ring_mesh import RingMesh, TwistedRingMesh
from ...round_off import CHAINED
from .fit import fitted, points_in
from .polynomials import BodyBox, padded
from .rings import RingBox
from .solution import ParticularSolution, particular_solution

BOXES: dict[type, Any] = {RingMesh: RingBox, TwistedRingMesh: RingBox}
"""Class of the box by the kind of a mesh, where it is not `BodyBox`."""


@dataclass(frozen=True)
class VolumeSolution:
    """Particular solutions in K load states, None where nothing acts.

    Attributes
    ----------
    states : tuple of ParticularSolution or None
    forces : tuple of ParticularSolution or None
        The same for the forces alone, whose resultant temperatures must not disturb.
    notes : tuple of str
        What polynomials miss of expressions.
    missed : float
        The largest root mean square of the stress by what polynomials miss: Eα/(1-ν) times a
        temperature, a force times half the length of the box [stress].
    """

    states: tuple[ParticularSolution | None, ...]
    forces: tuple[ParticularSolution | None, ...]
    notes: tuple[str, ...]
    missed: float

    def nodal_values(self, mesh: BoundaryMesh) -> Array:
        """Displacement, traction, and traction of the forces alone, at the nodes in each state, (3,
        K, n, d)."""
        nodal: dict[ParticularSolution | None, Array] = {
            None: np.zeros((2, mesh.n_nodes, mesh.components))
        }
        for state in {*self.states, *self.forces} - {None}:
            assert state is not None
            traction = np.einsum("nij,nj->ni", state.stress(mesh.x), mesh.normal)
            moved = np.array([state.displacement(mesh.x), traction])
            nodal[state] = lifted(moved, mesh.components)
        pairs = zip(self.states, self.forces, strict=True)
        return np.stack(
            [np.concatenate([nodal[state], nodal[force][1:]]) for state, force in pairs], axis=1
        )

    def values_at(self, points: Array, shares: dict[int, float]) -> tuple[Array, Array, Array]:
        """At points (m, d), with shares of states by their number: u (m, d), σ (m, d, d), and βT
        (m,) [stress]."""
        m, d = points.shape
        u, stress, heat = np.zeros((m, d)), np.zeros((m, d, d)), np.zeros(m)
        for number, share in shares.items():
            if (state := self.states[number]) is not None and share:
                u += share * state.displacement(points)
                stress += share * state.stress(points)
                heat += share * state.thermal_stress(points)
        return u, stress, heat


def volume_solution(body: Body, mesh: BoundaryMesh) -> VolumeSolution | None:
    """Return the solutions for a body, or None where no step has volume loads. State
    0 is unloaded, state k the end of step k.

    Raises
    ------
    InputError
        If an expression cannot be evaluated in the body.
    """
    if all(loads.is_none for loads in body.loads):
        return None
    posed = _Posed(body.material, mesh)
    states, forces = (
        [None, *map(posed.solution, loads_of_steps)]
        for loads_of_steps in (body.loads, [replace(s, temperature=NO_RISE) for s in body.loads])
    )
    return VolumeSolution(tuple(states), tuple(forces), tuple(posed.notes), posed.missed)


@dataclass
class _Posed:
    """A body and its box, in which loads become polynomials."""

    material: Material
    mesh: BoundaryMesh
    notes: list[str] = field(default_factory=list)
    missed: float = 0.0
    known: dict[Given, Array] = field(default_factory=dict)
    solved: dict[Loads, ParticularSolution | None] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.box = BOXES.get(type(self.mesh), BodyBox).around(self.mesh)
        self._points: Array | None = None

    def solution(self, loads: Loads) -> ParticularSolution | None:
        """For the loads of one state, None where there are none; of the same loads the same
        object."""
        if loads not in self.solved:
            self.solved[loads] = None if loads.is_none else self._solution(loads)
        return self.solved[loads]

    def _solution(self, loads: Loads) -> ParticularSolution:
        density = self.material.density or 0.0
        parts = [self._centrifugal(loads, density)]
        for data, factor in ((loads.acceleration, density), (loads.force, 1.0)):
            stress = factor * self.box.half.max()
            if data:
                parts.append([factor * self._polynomial(datum, stress) for datum in data])
        size = max(len(p) for part in parts for p in part)
        force = sum(np.array([padded(p, size) for p in part]) for part in parts)
        along = list(np.tensordot(self.box.axes, force, 1))
        heat = self._polynomial(
            loads.temperature,
            self.material.model_copy(update={"plane": "stress"}).thermal_stress,
        )
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

    def _polynomial(self, datum: Given, stress: float) -> Array:
        """Return the polynomial of a number, or of other data by a fit; a value of 1 makes about a
        `stress`."""
        if not datum.varies:
            return np.full((1,) * self.mesh.dim, float(datum.source))
        if datum not in self.known:
            if self._points is None:
                self._points = points_in(self.mesh, self.box)

            def values_at(points: Array) -> Array:
                return datum.at(Sites(points))

            self.known[datum], missed, mean = fitted(values_at, self._points, self.box)
            self.missed = max(self.missed, mean * stress)
            if missed > CHAINED:
                self.notes.append(
                    f"{datum.key}: the polynomial that stands for it misses it by {missed:.1e} of "
                    "its largest value; stresses may be as far off"
                )
        return self.known[datum]
