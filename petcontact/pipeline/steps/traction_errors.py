"""Estimates of the errors of tractions, made when they are asked for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, States
from ...compliance.interface import Interface
from ...contact.law_protocol import OPEN
from ...refinement.panels.tail import Tails
from ..pose.discretise import Discrete


@dataclass
class TractionErrors:
    """Estimated errors of the tractions of a contact, in any increment.

    Attributes
    ----------
    make : callable
        Returns the `Tails` of the mesh, which the estimate needs.
    interface : Interface
    """

    make: Callable[[], Tails]
    interface: Interface

    @functools.cached_property
    def _tails(self) -> Tails:
        return self.make()

    def __call__(self, pressure: Array, sigma_t: Array, state: States) -> tuple[Array, Array]:
        """Of p (m,) and σ_t (m, d-1), (m,) each [stress].

        They are at least the difference of the tractions on both sides. It is 0 where elements
        match; elsewhere the primary holds other polynomials than the secondary.
        """
        face, tails = self.interface, self._tails
        of_p = tails.pressure_errors(pressure, state == OPEN, np.isfinite(face.gap))
        of_q = tails.errors(sigma_t)
        if face.values is None or face.loads is None:
            return of_p, of_q
        stress = np.column_stack([sigma_t, pressure])
        traction = np.einsum("mk,mkd->md", stress, face.directions)
        apart = face.values @ (face.loads @ traction) - traction
        apart = np.einsum("md,mkd->mk", apart, face.directions)
        return (
            np.maximum(of_p, np.abs(apart[:, -1])),
            np.maximum(of_q, np.linalg.norm(apart[:, :-1], axis=1)),
        )


def traction_errors(discrete: Discrete) -> list[TractionErrors]:
    """Of each interface of a problem on meshes."""
    bodies, meshes = discrete.posed.bodies, discrete.meshes
    return [
        TractionErrors(functools.partial(Tails, meshes[b], face.nodes, bodies[b].mirrors), face)
        for face, b in ((face, face.body) for face in discrete.interfaces)
    ]
