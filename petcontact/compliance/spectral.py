"""One eigendecomposition of S for every ρ, rule and case of a sweep: a Robin solve is then two small products.

S has real positive eigenvalues, and in the inner product of the node weights it is symmetric up to the error of the
discretisation: there its eigenbasis is nearly orthogonal (condition 1.01 to 1.02 on the paper's examples at every h).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..contact.system import Modes
from ..errors import SolverError
from ..runtime.petsc import petsc, stage
from .contact_compliance import ContactCompliance, DenseCompliance

FEWEST_CASES = 3
"""Cases from which the eigendecomposition, some forty times an LU of I + ρS, pays."""
LARGEST = 3000
"""Contact unknowns up to which S is formed: its eigendecomposition takes 1.1 s for 1280, 1.8 s for 1600, 19 s for 3000."""
CONDITION = 100.0
"""Largest condition of the eigenbasis (of Frobenius norms, 1 for an orthogonal one) that is used."""
MISS = 1e-11
"""Largest relative difference between S and its eigendecomposition, on a random vector."""


class SpectralCompliance(DenseCompliance):
    """S = V Λ V⁻¹: (I + ρS)⁻¹ = V (I + ρΛ)⁻¹ V⁻¹ costs O(m²) for every ρ; motions and several ρ take the KSP.

    Parameters
    ----------
    operator : ContactCompliance
        Whose S it is; it is closed with this one.
    weight : (m,) array
    comm : PETSc.Comm

    Raises
    ------
    SolverError
        If S has no well-conditioned basis of eigenvectors with positive eigenvalues.
    """

    def __init__(self, operator: ContactCompliance, weight: Array, comm: Any) -> None:
        super().__init__(operator.matrix(), comm, operator.surrogate)
        self._operator = operator
        root = np.repeat(np.sqrt(weight), len(self._matrix) // len(weight))
        values, basis = np.linalg.eig(self._matrix * (root[:, None] / root))
        if np.iscomplexobj(values) or not values.min(initial=1.0) > 0.0:
            raise SolverError("factor", "S has eigenvalues that are not positive", "use a finer mesh")
        inverse = np.linalg.inv(basis)
        self._values, self._basis, self._inverse = values, basis / root[:, None], inverse * root
        condition = float(np.linalg.norm(basis) * np.linalg.norm(inverse)) / len(values)
        probe = np.random.default_rng(2019).standard_normal(len(values))
        exact = self._matrix @ probe
        missed = np.linalg.norm(self._basis @ (values * (self._inverse @ probe)) - exact) / np.linalg.norm(exact)
        if not (missed <= MISS and condition <= CONDITION):
            found = f"the eigenbasis of S is off by {missed:.1e}, its condition {condition:.0f}"
            raise SolverError("factor", found, "choose -ksp_type")

    def robin(self, rho: Array, r: Array, modes: Modes | None, work: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r, δv = S δσ, both from the same coefficients."""
        if modes is not None or np.ptp(rho) > 0.0:
            return super().robin(rho, r, modes, work)
        coefficients = (self._inverse @ r.ravel()) / (1.0 + float(rho.flat[0]) * self._values)
        both = self._basis @ np.stack([self._values * coefficients, coefficients], axis=1)
        return both[:, 0].reshape(r.shape), both[:, 1].reshape(r.shape)

    @property
    def kind(self) -> str:
        """How ρ is solved for."""
        return "; ".join(filter(None, ["eigenbasis of S", super().kind]))

    def close(self) -> None:
        """Close the operator whose S it is."""
        super().close()
        self._operator.close()


def shares(cases: int, size: int) -> bool:
    """Whether the eigendecomposition of S of `size` contact unknowns pays for so many cases."""
    return cases >= FEWEST_CASES and size <= LARGEST


def shared_by(cases: int, operator: ContactCompliance, weight: Array, size: int, comm: Any) -> ContactCompliance:
    """S itself, or its eigenbasis where that is the cheaper one for several cases.

    Options of the KSP other than `preonly` with `lu` (and so -ksp_monitor, too) keep the KSP.
    """
    if not shares(cases, size) or comm.getSize() > 1 or _wants_ksp():
        return operator
    with stage("factor"):
        try:
            return SpectralCompliance(operator, weight, comm)
        except (SolverError, np.linalg.LinAlgError):
            # strongly graded meshes: the KSP does without an eigenbasis
            return operator


def _wants_ksp() -> bool:
    given = petsc().Options().getAll()
    ours = {key: value for key, value in given.items() if key.startswith(("ksp_", "pc_"))}
    usual = {"ksp_type": "preonly", "pc_type": "lu"}
    return any(usual.get(key, "") != value for key, value in ours.items())
