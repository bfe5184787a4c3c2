"""Robin solves for many ρ that share one reduction of S to Hessenberg's form."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from ..arrays import Array
from ..contact.system import Modes
from ..linalg.hessenberg import HessenbergForm
from ..linalg.ksp import is_asked_for
from ..runtime.petsc import stage
from .contact_compliance import ContactCompliance, DenseCompliance

LARGEST = 3000
"""Contact unknowns up to which S is formed: its reduction takes 7 ms for 320, 0.5 s for 1280, 6 s
for 3000."""


class HessenbergCompliance(DenseCompliance):
    """S = Q H Qᵀ: (I + ρS)⁻¹ = Q (I + ρH)⁻¹ Qᵀ costs O(m²) for every ρ; motions and several ρ take
    LUs of I + ρS.

    Parameters
    ----------
    operator : ContactCompliance
        Whose S it is; it is closed with this one.
    comm : PETSc.Comm
    """

    def __init__(self, operator: ContactCompliance, comm: Any) -> None:
        super().__init__(operator.matrix(), comm, operator.surrogate)
        self._operator = operator

    @functools.cached_property
    def _form(self) -> HessenbergForm:
        """Made by the first Robin solve: Newton's method asks for none."""
        return HessenbergForm(self._matrix)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r and δv = S δσ."""
        if modes is not None or np.ptp(rho) > 0.0:
            return super().robin(rho, r, modes, work)
        sigma, dv = self._form.solve(float(rho.flat[0]), r.ravel())
        return dv.reshape(r.shape), sigma.reshape(r.shape)

    @property
    def kind(self) -> str:
        """How ρ is solved for."""
        return "; ".join(filter(None, ["Hessenberg form of S", super().kind]))

    def close(self) -> None:
        """Close the operator whose S it is."""
        super().close()
        self._operator.close()


def shares(cases: int, size: int) -> bool:
    """Whether the form of S of `size` contact unknowns pays for so many cases."""
    # the form costs some eight to fourteen LU of I + ρS: one case changes ρ up to ten times
    return cases >= 2 and size <= LARGEST


def shared_by(cases: int, operator: ContactCompliance, size: int, comm: Any) -> ContactCompliance:
    """S itself, or its Hessenberg form where that is the cheaper one for several cases; options of
    the KSP keep the KSP."""
    if not shares(cases, size) or comm.getSize() > 1 or is_asked_for(""):
        return operator
    with stage("factor"):
        return HessenbergCompliance(operator, comm)
