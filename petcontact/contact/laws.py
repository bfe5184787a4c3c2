"""The laws of the package: Tresca friction in bilateral contact, and Signorini contact with Coulomb
or Tresca friction."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .. import native
from ..arrays import Array, Mask, States
from ..record import record
from .friction_law import ball_derivative, lengths, project_ball
from .law_protocol import SLIP, STICK, Admissible, ContactLaw, friction_bound
from .linearisation import Linearisation

_RESIDUAL = native.function("petcontact_coulomb_residual", "iiDDDDDBBD")
_COULOMB = native.function("petcontact_coulomb", "iiDDDBBDDBDBB")

STEEP = 1e3
"""Coefficient of friction that replaces an infinite one where unilateral contact has a friction
bound. At the edge of contact the shear could be anything up to the bound. A bound that falls to 0
at once leaves problems without a solution; here a thousandth of it as pressure reaches it."""


@record
class Tresca:
    """Bilateral contact of one body, u_n = 0, with a given friction bound: Π(τ) = [τ]_g,
    (2.5)-(2.6).

    Attributes
    ----------
    bound : (m,) array
        g >= 0 [stress].
    k : int
        d - 1.

    Examples
    --------
    >>> law = Tresca(np.array([2.0, 2.0]))
    >>> tau = np.array([[1.0], [-5.0]])
    >>> law.project(tau), law.states(tau), law.linearise(tau).ravel()
    (array([[ 1.],
           [-2.]]), array([0, 1], dtype=int8), array([1., 0.]))
    """

    bound: Array
    k: int = 1

    @property
    def groups(self) -> tuple[slice, ...]:
        """One ρ for all components."""
        return (slice(0, self.k),)

    def project(self, tau: Array) -> Array:
        """Return the projection [τ]_g on the ball of radius g, (m, k) [stress]."""
        return project_ball(tau, self.bound)

    def linearise(self, tau: Array) -> Array:
        """Return the derivative of [τ]_g."""
        return ball_derivative(tau, self.bound)[0]

    def residual(self, v: Array, sigma: Array, rho: float | Array) -> Array:
        """Return σ + Π(ρv - σ), (m, k) [stress]."""
        tau = rho * v - sigma
        if type(self) is not Tresca or tau.shape[1] > 1:
            return np.asarray(sigma + self.project(tau))
        limit = self.bound[:, None]
        return np.asarray(sigma + np.minimum(np.maximum(tau, -limit), limit))  # (2.10)

    def states(self, tau: Array) -> States:
        """Return 0 for stick and 1 for slip; slip where g = 0."""
        return np.where(_slips(tau, self.bound), SLIP, STICK).astype(np.int8)

    def admissible(self) -> Admissible:
        """Return the limits of the tractions, |σ_t| <= g."""
        none = np.full(len(self.bound), np.inf)
        return Admissible(self.bound, none, np.zeros(len(self.bound)), none, none)

    def bound_at(self, sigma: Array) -> Array:
        """Return the bound g, (m,) [stress]."""
        return self.bound


@record
class SignoriniCoulomb:
    """Normal and tangential contact: p = max(τ_n, 0), or τ_n where bilateral, and [τ_t] on the ball
    of radius r(p).

    r is the least of μ|p| and g: Coulomb's law, Tresca's, or both; frictionless with g = 0; bonded
    where both are infinite and the contact is bilateral. It vanishes where the contact is open. v_n
    is the overlap beyond the gap, σ_n = -p.

    Attributes
    ----------
    coefficient : (m,) array
        μ >= 0 [-]; infinite where friction does not depend on pressure.
    bound : (m,) array
        g >= 0 [stress]; infinite where there is none.
    unilateral : (m,) bool array
        Whether the parts may separate.
    k : int
        d, the dimension.
    absent : (m,) bool array, optional
        Nodes that face nothing and carry nothing.

    Examples
    --------
    Coulomb friction at nodes that stick, slip, and are open: τ = ρv - σ has the tangential
    components first.

    >>> each = np.ones(3)
    >>> law = SignoriniCoulomb(0.5 * each, np.inf * each, each > 0.0, 2)
    >>> tau = np.array([[0.4, 1.0], [-3.0, 1.0], [0.1, -1.0]])
    >>> law.project(tau), law.states(tau)
    (array([[ 0.4,  1. ],
           [-0.5,  1. ],
           [ 0. ,  0. ]]), array([0, 1, 2], dtype=int8))
    """

    coefficient: Array
    bound: Array
    unilateral: Mask
    k: int
    absent: Mask | None = None

    @cached_property
    def groups(self) -> tuple[slice, ...]:
        """Components that share a ρ: the tangential ones, and the normal one."""
        return slice(0, self.k - 1), slice(self.k - 1, self.k)

    def radius(self, pressure: Array) -> Array:
        """Return the bound r(p) of the shear at a pressure, (m,) [stress]."""
        limit = np.abs(pressure)
        if self._all_coulomb:
            limit *= self.coefficient
        else:
            limit = np.multiply(
                self.coefficient, limit, out=np.full(len(pressure), np.inf), where=self._coulomb
            )
        return np.where(self.unilateral & (pressure <= 0.0), 0.0, np.minimum(limit, self.bound))

    def project(self, tau: Array) -> Array:
        """Return the projection Π(τ) on the tractions that the law allows, (m, k) [stress]."""
        result = np.empty(tau.shape)
        self._fill(tau, projection=result)
        return result

    def linearise(self, tau: Array) -> Array:
        """Return the derivative of Π: that of the ball, and that of its radius by the pressure."""
        derivative = np.empty((len(tau), self.k, self.k))
        self._fill(tau, derivative=derivative)
        return derivative

    def states(self, tau: Array) -> States:
        """Return 0 stick, 1 slip, 2 open."""
        states = np.empty(len(tau), dtype=np.int8)
        self._fill(tau, states=states)
        return states

    def admissible(self) -> Admissible:
        """Return the limits p >= 0 and |σ_t| <= min(µp, g) where unilateral, and |σ_t| <= g
        elsewhere.

        In bilateral contact that pulls, |σ_t| <= µ|p| is not convex, and is left out.
        """
        present = np.ones(len(self.bound), dtype=bool) if self.absent is None else ~self.absent
        cone = self._coulomb & self.unilateral & present
        return Admissible(
            np.where(present, self.bound, 0.0),
            np.where(cone, 0.0, np.inf),
            np.where(cone, self.coefficient, 0.0),
            np.where(present & ~self.unilateral, np.inf, 0.0),
            np.where(present, np.inf, 0.0),
        )

    def bound_at(self, sigma: Array) -> Array:
        """Return the bound r(p) of the shear, (m,) [stress]."""
        return self.radius(-sigma[:, -1])

    @cached_property
    def _all_coulomb(self) -> bool:
        return bool(self._coulomb.all())

    @cached_property
    def _coulomb(self) -> Mask:
        return np.isfinite(self.coefficient)

    def linearised(self, tau: Array) -> Linearisation | None:
        """Return the linearisation in one pass, in C.

        It is None where `linearise`, `project` and `states` must be called, as for a subclass that
        has its own ones.
        """
        if type(self) is not SignoriniCoulomb:
            return None
        projection = np.empty(tau.shape)
        constant = np.empty(tau.shape)
        derivative = np.empty((*tau.shape, self.k))
        active = np.empty(tau.shape, dtype=bool)
        stick = np.empty(tau.shape, dtype=bool)
        states = np.empty(len(tau), np.int8)
        self._fill(tau, projection, derivative, states, constant, active, stick)
        return Linearisation(tau, constant, derivative, active, stick, states)

    def residual(self, v: Array, sigma: Array, rho: float | Array) -> Array:
        """Return σ + Π(ρv - σ), (m, k) [stress]."""
        rho = np.asarray(rho, dtype=float)
        if type(self) is not SignoriniCoulomb or rho.ndim == 2:
            return np.asarray(sigma + self.project(rho * v - sigma))
        self._check(v)
        kept = [native.contiguous(x) for x in (v, sigma, rho if rho.ndim else np.full(self.k, rho))]
        result = np.empty(v.shape)
        _RESIDUAL(*v.shape, *kept, *self._given, result)
        return result

    def _fill(
        self,
        tau: Array,
        projection: Array | None = None,
        derivative: Array | None = None,
        states: States | None = None,
        *linearised: Array | Mask,
    ) -> None:
        """Compute those of the law's arrays at τ that are given."""
        self._check(tau)
        _COULOMB(
            len(tau),
            self.k,
            native.contiguous(tau),
            *self._given,
            projection,
            derivative,
            states,
            *(linearised or (None, None, None)),
        )

    def _check(self, vectors: Array) -> None:
        if self.k not in (2, 3) or vectors.shape != (len(self.bound), self.k):
            raise ValueError(
                f"a law of {len(self.bound)} nodes and k = {self.k}, which is 2 or 3, "
                f"got vectors {vectors.shape}"
            )

    @cached_property
    def _given(self) -> list[Array | Mask | None]:
        """Return the arrays that C reads."""
        given = (
            (self.coefficient, float),
            (self.bound, float),
            (self.unilateral, bool),
            (self.absent, bool),
        )
        return [
            None if array is None else np.ascontiguousarray(array, dtype=kind)
            for array, kind in given
        ]


def dissipation(
    law: ContactLaw, before: Array, after: Array, slid: Array, bound: Array | None = None
) -> tuple[Array, Array]:
    """Return the energy that friction dissipates at each node in slip, and a bound of its error.

    Both are (m,) [stress · length]. In slip |σ_t| is the law's bound. The trapezoidal rule takes
    its mean over the tractions before and after. This is exact if the bound is constant, or if slip
    is proportional to it. The error is at most the change by taking either end alone.

    Parameters
    ----------
    law : ContactLaw
    before, after : (m, k) arrays
        σ at the start and at the end of an increment [stress].
    slid : (m, d-1) array
        Slip in between [length].
    bound : (m,) array, optional
        The bound for the tractions after, if it is known [stress].

    Examples
    --------
    Pressed from p = 0 to 10 while it slips by 0.3 with µ = 0.5, and held at p = 10 meanwhile:

    >>> law = SignoriniCoulomb(np.array([0.5]), np.array([np.inf]), np.array([True]), 2)
    >>> after, slid = np.array([[-5.0, -10.0]]), np.array([[0.3]])
    >>> dissipation(law, 0.0 * after, after, slid), dissipation(law, after, after, slid)
    ((array([0.75]), array([0.75])), (array([1.5]), array([0.])))
    """
    way = lengths(slid)
    work = -np.sum(after[:, : slid.shape[1]] * slid, axis=1)
    bounds = friction_bound(law, before), friction_bound(law, after) if bound is None else bound
    old, new = (np.where(np.isfinite(limits) & (way > 0.0), limits, 0.0) for limits in bounds)
    # what sticks has slipped by round-off, and is not on the bound
    change = np.where(work >= 0.5 * new * way, 0.5 * (old - new) * way, 0.0)
    return work + change, np.abs(change)


def _slips(tau: Array, radius: Array) -> Mask:
    return np.asarray((lengths(tau) > radius) | (radius == 0.0))
