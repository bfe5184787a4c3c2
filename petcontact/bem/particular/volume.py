"""The volume loads of a body in every load state, and a particular solution for them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ...arrays import Array
from ...geometry.rotation import lifted
from ...given.body_data import NO_RISE, Body
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import record, replace

if TYPE_CHECKING:
    from .fitted_loads import Solved


@record
class VolumeSolution:
    """Particular solutions in K load states, None where nothing acts.

    Attributes
    ----------
    states : tuple of Solved or None
    forces : tuple of Solved or None
        The same for the forces alone, whose resultant temperatures must not disturb.
    notes : tuple of str
        What polynomials miss of expressions.
    missed : float
        The largest root mean square of the stress by what polynomials miss: Eα/(1-ν) times a
        temperature, a force times half the length of the box [stress].
    """

    states: tuple[Solved | None, ...]
    forces: tuple[Solved | None, ...]
    notes: tuple[str, ...]
    missed: float

    def nodal_values(self, mesh: BoundaryMesh) -> Array:
        """Displacement, traction, and traction of the forces alone, at the nodes in each state, (3,
        K, n, d)."""
        nodal: dict[Solved | None, Array] = {None: np.zeros((2, mesh.n_nodes, mesh.components))}
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
    from .fitted_loads import FittedLoads

    posed = FittedLoads(body.material, mesh)
    states, forces = (
        [None, *map(posed.solution, loads_of_steps)]
        for loads_of_steps in (body.loads, [replace(s, temperature=NO_RISE) for s in body.loads])
    )
    return VolumeSolution(tuple(states), tuple(forces), tuple(posed.notes), posed.missed)
