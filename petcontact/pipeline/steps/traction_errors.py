"""Estimates of the errors of tractions, made when they are asked for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ...arrays import Array, Index, States
from ...contact.law_protocol import OPEN, SLIP
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.panels.edges import rim_powers
from ...refinement.panels.tail import Tails
from ..pose.discretise import Discrete


@dataclass
class TractionErrors:
    """Estimated errors of the tractions of a contact, in any increment.

    Attributes
    ----------
    make : callable
        Gives what they need of its mesh.
    """

    make: Callable[[], Tails]

    @functools.cached_property
    def _tails(self) -> Tails:
        return self.make()

    def __call__(self, pressure: Array, sigma_t: Array, state: States) -> tuple[Array, Array]:
        """Of p (m,) and σ_t (m, d-1), (m,) each [stress]."""
        states = state == OPEN, state == SLIP
        error = self._tails.of_pressure(pressure, *states)
        return error, self._tails.of_shear(sigma_t, pressure, error, *states)


def traction_errors(discrete: Discrete) -> list[TractionErrors]:
    """Of each contact of a problem on meshes."""
    found, bodies = list[TractionErrors](), discrete.problem.body
    for side, face in zip(discrete.sides, discrete.interfaces, strict=True):
        mesh, primary = (
            discrete.meshes[side.body],
            bodies[side.primary[0]] if side.primary else None,
        )
        touching = bodies[side.body], side.part, primary, side.law.friction_coefficient or 0.0
        found.append(TractionErrors(functools.partial(_tails, mesh, face.nodes, *touching)))
    return found


def _tails(mesh: BoundaryMesh, nodes: Index, *touching: Any) -> Tails:
    """With the powers that tractions have at the rim."""
    return Tails(mesh, nodes, rim_powers(mesh, *touching))
