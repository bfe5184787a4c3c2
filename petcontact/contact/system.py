"""The bodies as a contact method sees them: v = u_0 + S σ on Γ_C, a Robin solve, and a surrogate T
of S.

All vectors on Γ_C are (m, k) arrays, equal on every rank. Each node has k components: the
tangential ones first, then the normal one if the law has it. v is the displacement of the contact
nodes, of one body or relative to its partner. σ is the traction on them.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol, TypeGuard

import numpy as np
import scipy

from ..arrays import Array, Mask
from ..record import record, replace
from ..round_off import CHAINED, SUMMED
from .linearisation import Linearisation as Linearisation


@record
class Modes:
    """Rigid motions that only contact holds: v = u_0 + S σ + M α, with E σ + f = 0.

    Attributes
    ----------
    motion : (m, k, r) array
        M: v of each motion with α = 1.
    resultant : (r, m, k) array
        E: the work of σ on each motion; most often that of weight · M.
    load : (r,) array
        f: the work of all other loads on each motion.
    left_out : (r, p) array, optional
        Orthonormal combinations of motions of unit size that are not solved for: they stay 0.
    """

    motion: Array
    resultant: Array
    load: Array
    left_out: Array | None = None

    @cached_property
    def size(self) -> Array:
        """Largest displacement of each motion, (r,)."""
        size = np.abs(self.motion).max(axis=(0, 1), initial=0.0)
        return np.where(size > 0.0, size, 1.0)

    @cached_property
    def fit(self) -> Array:
        """Amplitudes of the motions nearest to a displacement, (r, m k)."""
        motion = self.motion.reshape(-1, len(self.load))
        if self.left_out is None:
            return np.linalg.pinv(motion)
        basis = self.basis / self.size[:, None]
        return np.asarray(basis @ np.linalg.pinv(motion @ basis))

    @cached_property
    def basis(self) -> Array:
        """Orthonormal combinations of motions of unit size that are solved for, (r, q)."""
        if self.left_out is None:
            return np.eye(len(self.load))
        return np.asarray(scipy.linalg.null_space(self.left_out.T))

    def beyond_errors(self, derivative: Array, weight: Array, error: Array) -> Modes:
        """Return the modes without those that contact resists by errors of its normals only.

        Such a motion is the rotation of a ball on a smooth plane: over all nodes ‖Π'Mα‖ < ‖εMα‖.
        It is neither solved for nor in equilibrium. Loads on it are left out if they are as small
        as what such errors make of the other loads. Larger ones stay, and nothing holds them.

        Parameters
        ----------
        derivative : (m, k, k) array
            Π' where all nodes are closed and stick.
        weight : (m,) array
        error : (m,) array
            ε, error of the normals [rad].
        """
        unit = np.sqrt(weight)[:, None, None] * self.motion / self.size
        resisted, rough, whole = (
            each.reshape(-1, len(self.load))
            for each in (derivative @ unit, error[:, None, None] * unit, unit)
        )
        values, vectors = np.linalg.eigh(resisted.T @ resisted - rough.T @ rough)
        gone = vectors[:, values < 0.0]
        if not gone.size:
            return self
        load, share = self.load / self.size, np.linalg.norm(rough) / np.linalg.norm(whole)
        left = replace(self, left_out=gone)
        small = np.abs(gone.T @ load).max() <= share * np.linalg.norm(load)
        return replace(
            left,
            resultant=left.solved_for(self.resultant),
            load=left.solved_for(self.load) if small else self.load,
        )

    def solved_for(self, work: Array) -> Array:
        """Return work (r, ...) on the motions without that on those that are left out."""
        if self.left_out is None:
            return work
        unit = work.reshape(len(work), -1) / self.size[:, None]
        least, unit = SUMMED * np.abs(unit).max(initial=0.0), self.basis @ (self.basis.T @ unit)
        # of a motion that is left out as a whole no digit stays
        kept = np.where(np.abs(unit) > least, unit, 0.0) * self.size[:, None]
        return np.asarray(kept.reshape(work.shape))

    def unbalanced(self, sigma: Array) -> Array:
        """Return the forces and moments Eσ + f out of balance, one for each rigid motion, (r,)."""
        return self.load + np.tensordot(self.resultant, sigma, 2)

    def defect(self, sigma: Array, motions: Array) -> float:
        """Return the largest |Eσ + f| over the work of all tractions and loads [-].

        It is taken on combinations (r, q) of motions of unit size.
        """
        work = (
            np.abs(self.load) + np.tensordot(np.abs(self.resultant), np.abs(sigma), 2)
        ) / self.size
        most = float(np.abs(motions.T @ (self.unbalanced(sigma) / self.size)).max(initial=0.0))
        return most / float(work.max()) if most > 0.0 else 0.0


class RigidModeConstraint:
    """Rigid motions that border a block of S, in scaled coordinates.

    Motions that move no active component are left out.

    Parameters
    ----------
    modes : Modes or None
    linearised : Linearisation
    sigma : (m, k) array
        Traction whose resultant the equations complete.
    scale : float
        Size of the columns, that of the block's entries [length/stress].
    rows : float, optional
        Size of the rows; that of the columns by default.

    Attributes
    ----------
    length : float
        Size of the columns [length/stress].
    resisted : (r, q) array
        Combinations of motions that active components resist.
    free : (r, p) array
        Combinations of motions of unit size that no active component resists.
    """

    def __init__(
        self,
        modes: Modes | None,
        linearised: Linearisation,
        sigma: Array,
        scale: float,
        rows: float | None = None,
    ) -> None:
        self.length = scale or 1.0
        if modes is None:
            self.resisted = self.free = np.zeros((0, 0))
            self.columns, self.rhs = np.zeros((int(linearised.active.sum()), 0)), np.zeros(0)
            self.rows, self._unit = self.columns.T, 1.0
            return
        size, within = modes.size, modes.basis
        factor = np.linalg.qr(modes.motion[linearised.active] / size @ within, mode="r")
        values, vectors = np.linalg.svd(factor, full_matrices=True)[1:]
        followed = np.zeros(within.shape[1], dtype=bool)
        followed[: len(values)] = values > CHAINED * max(1.0, float(values.max(initial=0.0)))
        basis, self.free = within @ vectors[followed].T, within @ vectors[~followed].T
        if modes.left_out is not None:
            self.free = np.column_stack([self.free, modes.left_out])
        work = np.einsum(
            "rib,ibc->ric", modes.resultant / size[:, None, None], linearised.derivative
        )[:, linearised.active]
        # where all nodes slide one way nothing resists a motion along it, though it moves
        # components that are active
        turned, strength, _ = np.linalg.svd(
            np.asarray(np.linalg.qr((basis.T @ work).T, mode="r")).T
        )
        resisted = np.append(strength, np.zeros(basis.shape[1] - len(strength))) > CHAINED * float(
            strength.max(initial=0.0)
        )
        if not resisted.all():
            self.free = np.column_stack([self.free, basis @ turned[:, ~resisted]])
            basis = basis @ turned[:, resisted]
        self.resisted = basis / size[:, None]
        self.columns = modes.motion[linearised.active] @ self.resisted * self.length
        works = basis.T @ work
        self._unit = (rows or self.length) / (float(np.abs(works).max(initial=0.0)) or 1.0)
        self.rows = self._unit * works
        self.rhs = self.work(-modes.unbalanced(sigma))

    def spread(self, active: Mask) -> tuple[Array, Array]:
        """Return columns and rows on all components, (q, m, k)."""
        both = np.zeros((2, len(self.rhs), *active.shape))
        both[0][:, active], both[1][:, active] = self.columns.T, self.rows
        return both[0], both[1]

    def border(self, matrix: Array) -> None:
        """Write the rigid motions into the last rows and columns of a matrix."""
        n = len(matrix) - len(self.rhs)
        matrix[:n, n:], matrix[n:, :n], matrix[n:, n:] = self.columns, self.rows, 0.0

    def work(self, resultant: Array) -> Array:
        """Return the values of the rows for a traction with the resultant Eσ (r,)."""
        return np.asarray(self._unit * (self.resisted.T @ resultant))

    def motion(self, coordinates: Array) -> Array:
        """Return the rigid motions δα of a solution of the bordered system."""
        return np.asarray(self.resisted @ coordinates * self.length)


class Surrogate(Protocol):
    """T, symmetric and spectrally equivalent to S; products and solves need no elastic solve.

    Attributes
    ----------
    rtol : float
        Relative tolerance of iterative solves on part of the components.
    fast : bool
        Whether products and solves cost almost nothing.
    predicts : bool, optional
        Whether T costs less than the steps of Newton's method that its predictions save; True if it
        is missing.
    """

    rtol: float

    @property
    def fast(self) -> bool: ...

    def apply(self, x: Array) -> Array:
        """Return T x, (m, k) [length]."""
        ...

    def solve(self, x: Array, rho: float | Array | None = None) -> Array:
        """Return T⁻¹ x [stress], or (I + ρT)⁻¹ x, (m, k); ρ may be a number for each component,
        (k,)."""
        ...

    def stick_solve(self, stick: Mask, rhs: Array, rtol: float | None = None) -> Array:
        """Return x (m, k) with T x = rhs on the components of a mask (m, k), and x = 0 elsewhere
        [stress]; `rtol` instead of the attribute where it iterates, 1 for a fixed linear map."""
        ...

    def matrix(self) -> Array:
        """Return T, (m k, m k)."""
        ...

    def fit(self, sigma: Array, displacement: Array) -> None:
        """Scale T to S, from a smooth σ and S σ."""
        ...


class ContactSystem(Protocol):
    """Interface between contact methods and bodies, or any other system with these members.

    Attributes
    ----------
    weight : (m,) array
        Quadrature weights of the contact nodes [length or area].
    modes : Modes or None
    matrix_free : bool
        Whether S is known by its products: `compliance` is then a product a column.
    ksp_iterations : int
        KSP iterations of the last Robin solve.
    elastic_solves, applications : int
        Robin solves, and products with S, so far.

    Examples
    --------
    Blocks on springs of stiffness c over a rough floor, one drawn by less than friction holds, one
    by more:

    >>> class Blocks:
    ...     modes, matrix_free = None, False
    ...     ksp_iterations = elastic_solves = applications = 0
    ...
    ...     def __init__(self, u_0, c):
    ...         self.u_0, self.c, self.weight = u_0, c, np.ones(len(u_0))
    ...
    ...     def apply(self, sigma):
    ...         return sigma / self.c
    ...
    ...     def robin(self, rho, f):
    ...         dv, sigma = self.robin_increment(rho, f - rho * self.u_0)
    ...         return self.u_0 + dv, sigma
    ...
    ...     def robin_increment(self, rho, r):
    ...         sigma = r / (1.0 + rho / self.c)
    ...         return sigma / self.c, sigma
    ...
    ...     def compliance(self):
    ...         return np.eye(len(self.u_0)) / self.c
    ...
    ...     def surrogate(self):
    ...         return None
    >>> from petcontact.contact.criterion import Criterion
    >>> from petcontact.contact.iteration import Iteration
    >>> from petcontact.contact.laws import Tresca
    >>> from petcontact.contact.methods.registry import method_of
    >>> blocks, law = Blocks(np.array([[0.25], [3.0]]), c=2.0), Tresca(np.array([1.0, 1.0]))
    >>> state = method_of("semismooth-newton")(blocks, law, Iteration(Criterion(1e-6), 20))
    >>> state.v.ravel(), state.sigma.ravel(), state.counts
    (array([0. , 2.5]), array([-0.5, -1. ]), {'stick': 1, 'slip': 1})
    """

    modes: Modes | None
    elastic_solves: int
    applications: int

    @property
    def matrix_free(self) -> bool: ...
    @property
    def ksp_iterations(self) -> int: ...

    @property
    def weight(self) -> Array: ...

    @property
    def u_0(self) -> Array:
        """v for σ = 0 without rigid motion, (m, k) [length]."""
        ...

    def apply(self, sigma: Array) -> Array:
        """Return S σ, (m, k) [length]."""
        ...

    def robin(self, rho: float | Array, f: Array) -> tuple[Array, Array]:
        """Return v and σ with v = u_0 + S σ and σ + ρ v = f, the Robin problem (4.4)-(4.8).

        ρ may be a number for each component, (k,).
        """
        ...

    def robin_increment(self, rho: float | Array, r: Array) -> tuple[Array, Array]:
        """Return δv and δσ with δv = S δσ and δσ + ρ δv = r.

        Increments keep the errors of inexact solves out of w_k.
        """
        ...

    def compliance(self) -> Array:
        """Return S as a dense array (m k, m k) [length/stress], equal on every rank."""
        ...

    def surrogate(self) -> Surrogate | None:
        """Return a new, unscaled T, or None if there is none: S must be dense then."""
        ...


class MonolithicSystem(ContactSystem, Protocol):
    """A system that solves its own equations together with linear ones of the law.

    Attributes
    ----------
    defect : float
        Relative residual of its own equations after the last solve.
    """

    defect: float

    def linear_solve(
        self,
        linearised: Linearisation,
        rho: Array,
        tolerance: float,
        constraint: RigidModeConstraint | None,
    ) -> tuple[Array, Array, Array]:
        """Return σ [stress], v [length] and α of a linearised law, near the last solution.

        The solve is inexact while the linearised law is far from the law. In the end it is accurate
        to a tenth of `tolerance`.
        """
        ...


def is_monolithic(system: ContactSystem) -> TypeGuard[MonolithicSystem]:
    """Return whether a system solves its own equations together with those of the law."""
    return hasattr(system, "linear_solve")
