"""One eigendecomposition of S for every ρ, rule and case of a sweep: a Robin solve is then two small products.

S has real positive eigenvalues, and in the inner product of the node weights it is symmetric up to the error of the
discretisation: there its eigenbasis is nearly orthogonal (condition 1.01 to 1.02 on the paper's examples at every h).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..arrays import Array
from ..bem.operators import BoundaryOperators
from ..contact.system import BodySystem
from ..errors import SolverError
from ..runtime.petsc import petsc, stage
from .base import EliminatedSystem

FEWEST_CASES = 3
"""Cases from which the eigendecomposition, some forty times an LU of I + ρS, pays."""
LARGEST = 3000
"""Contact nodes up to which S is formed: its eigendecomposition takes 1.1 s for 1280, 1.8 s for 1600, 19 s for 3000."""
CONDITION = 100.0
"""Largest condition of the eigenbasis (of Frobenius norms, 1 for an orthogonal one) that is used."""
MISS = 1e-11
"""Largest relative difference between S and its eigendecomposition, on a random vector."""


class SpectralSystem(EliminatedSystem):
    """u_t = u_0 + S σ_t with S = V Λ V⁻¹: (I + ρS)⁻¹ = V (I + ρΛ)⁻¹ V⁻¹ costs O(m²) for every ρ.

    Parameters
    ----------
    system : BodySystem
        On one rank; it is closed with this one.
    operators : BoundaryOperators
        Its operators.

    Raises
    ------
    SolverError
        If S has no well-conditioned basis of eigenvectors with positive eigenvalues.
    """

    def __init__(self, system: BodySystem, operators: BoundaryOperators, comm: Any) -> None:
        super().__init__(operators, comm)
        self._system, self.u_0 = system, system.u_0
        self._matrix = system.compliance()
        root = np.repeat(np.sqrt(self.weight), self.u_0.shape[1])
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

    def apply(self, sigma_t: Array) -> Array:
        """S σ_t."""
        self.applications += 1
        return np.asarray(self._matrix @ sigma_t.ravel()).reshape(sigma_t.shape)

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """(I + ρS) δσ = r, δu = S δσ, both from the same coefficients."""
        self.elastic_solves += 1
        self.applications += 1
        coefficients = (self._inverse @ r.ravel()) / (1.0 + rho * self._values)
        both = self._basis @ np.stack([self._values * coefficients, coefficients], axis=1)
        return both[:, 0].reshape(r.shape), both[:, 1].reshape(r.shape)

    def compliance(self) -> Array:
        """S."""
        return self._matrix

    def boundary(self, sigma_t: Array) -> tuple[Array, Array]:
        """That of the system whose S it is."""
        return self._system.boundary(sigma_t)

    def describe(self) -> str:
        """Formulation and operator, and how ρ is solved for."""
        return f"{self._system.describe().split(';')[0]}; eigenbasis of S"

    def close(self) -> None:
        """Close the system whose S it is."""
        self._system.close()


def shares(cases: int, size: int) -> bool:
    """Whether the eigendecomposition of S on `size` contact nodes pays for so many cases."""
    return cases >= FEWEST_CASES and size <= LARGEST


def shared_by(cases: int, system: BodySystem, operators: BoundaryOperators, comm: Any) -> BodySystem:
    """The system itself, or the spectral one where that is the cheaper one for several cases.

    Options of the KSP other than `preonly` with `lu` (and so -ksp_monitor, too) keep the KSP.
    """
    size = len(system.weight)
    if not shares(cases, size) or comm.getSize() > 1 or _wants_ksp():
        return system
    with stage("factor"):
        try:
            return SpectralSystem(system, operators, comm)
        except (SolverError, np.linalg.LinAlgError):
            # strongly graded meshes: the KSP does without an eigenbasis
            return system


def _wants_ksp() -> bool:
    given = petsc().Options().getAll()
    ours = {key: value for key, value in given.items() if key.startswith(("ksp_", "pc_"))}
    usual = {"ksp_type": "preonly", "pc_type": "lu"}
    return any(usual.get(key, "") != value for key, value in ours.items())
