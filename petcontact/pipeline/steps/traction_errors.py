"""Estimates of the errors of tractions, made when they are asked for."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Mask, States
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
    faced : (m,) array
        Which nodes face something.
    """

    make: Callable[[], Tails]
    faced: Mask

    @functools.cached_property
    def _tails(self) -> Tails:
        return self.make()

    def __call__(self, pressure: Array, sigma_t: Array, state: States) -> tuple[Array, Array]:
        """Of p (m,) and σ_t (m, d-1), (m,) each [stress]."""
        of_p = self._tails.pressure_errors(pressure, state == OPEN, self.faced)
        return of_p, self._tails.errors(sigma_t)


def traction_errors(discrete: Discrete) -> list[TractionErrors]:
    """Of each interface of a problem on meshes."""
    return [
        TractionErrors(
            functools.partial(Tails, discrete.meshes[face.body], face.nodes), np.isfinite(face.gap)
        )
        for face in discrete.interfaces
    ]
