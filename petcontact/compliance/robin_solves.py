"""Robin solves for many ρ that share one reduction of S to Hessenberg form."""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array
from ..contact.system import Modes
from ..linalg.hessenberg import HessenbergForm
from ..linalg.ksp import is_asked_for
from ..runtime.petsc import stage
from ..untyped import Comm
from .contact_compliance import ContactCompliance, DenseCompliance

LARGEST = 3000
"""Largest number of contact unknowns for which S is reduced. The reduction takes 7 ms for 320
unknowns, 0.5 s for 1280 and 6 s for 3000."""


class HessenbergCompliance(DenseCompliance):
    """S = Q H Qᵀ with an upper Hessenberg matrix H.

    (I + ρS)⁻¹ = Q (I + ρH)⁻¹ Qᵀ costs O(m²) for each ρ. If there are motions, or ρ differs between
    components, I + ρS is factorised instead.

    Parameters
    ----------
    operator : ContactCompliance
        The operator that provides S; `close` closes it, too.
    comm : PETSc.Comm
    """

    def __init__(self, operator: ContactCompliance, comm: Comm) -> None:
        super().__init__(operator.matrix(), comm, operator.surrogate)
        self._operator = operator

    @functools.cached_property
    def _form(self) -> HessenbergForm:
        """The form, made by the first Robin solve, because Newton's method needs none."""
        return HessenbergForm(self._matrix)

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """Return δv = S δσ and δσ for which (I + ρS) δσ = r."""
        if modes is not None or np.ptp(rho) > 0.0:
            return super().robin(rho, r, modes, work)
        sigma, dv = self._form.solve(float(rho.flat[0]), r.ravel())
        return dv.reshape(r.shape), sigma.reshape(r.shape)

    @property
    def kind(self) -> str:
        """Text that names the method of Robin solves."""
        return "; ".join(filter(None, ["Hessenberg form of S", super().kind]))

    def close(self) -> None:
        """Free every PETSc object, those of the operator that provides S included."""
        super().close()
        self._operator.close()


def shares(cases: int, size: int) -> bool:
    """Return whether a reduction of S, with `size` contact unknowns, pays for this many cases."""
    # the reduction costs as much as 8 to 14 LU of I + ρS, and one case changes ρ up to ten times
    return cases >= 2 and size <= LARGEST


def shared_by(cases: int, operator: ContactCompliance, size: int, comm: Comm) -> ContactCompliance:
    """Return S itself, or its Hessenberg form if that is cheaper for this many cases.

    It is S itself if the user gave options for the KSP.
    """
    if not shares(cases, size) or comm.getSize() > 1 or is_asked_for():
        return operator
    with stage("factor"):
        return HessenbergCompliance(operator, comm)
