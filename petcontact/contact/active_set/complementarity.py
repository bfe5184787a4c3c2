"""Sets of frictional contact by complementary pivots, which cannot cycle.

With polygons for friction cones the law is a linear complementarity problem. Its unknowns are the
pressures p, the shear β_j along the directions d_j to the corners of a polygon, and the slip λ of
each node,

    0 <= p ⟂ gap >= 0,  0 <= β_j ⟂ d_j·v_t + λ >= 0,  0 <= λ ⟂ min(μp, g) - Σβ >= 0.

S is positive definite in the inner product of the weights. The matrix is therefore copositive for
every μ >= 0, and Lemke's pivots end in a solution (D. Stewart and J. Trinkle, Int. J. Numer.
Methods Eng. 39 (1996) 2673-2691; A. Klarbring and J.-S. Pang, SIAM J. Optim. 8 (1998) 595-613).
Soft springs hold rigid motions that only contact holds. The springs are moved after the bodies
until Newton's method needs no springs. Springs that carry as much as before they were moved show
that nothing else carries it. In the plane the polygon is the cone itself.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy

from ...arrays import Array, Mask, scattered
from ...round_off import CHAINED, ROUNDED, TINY
from ..equilibrium import directions
from ..friction_law import lengths
from ..laws import STEEP, SignoriniCoulomb
from ..linearisation import Linearisation
from ..system import ContactSystem

FAR = 1e2
"""Motion of bodies by the loads on springs alone, over the largest displacement or gap [-]. A
hundredth of the loads then closes all gaps."""
SOFT = (1e3, 1e8)
"""Least and largest compliance of the springs over that of the bodies [-]. Stiffer springs would
have to be moved many times; softer ones leave no digits."""
LARGEST = 1200
"""Largest number of unknowns; all pivots take a second or two then, about 1 ms each."""
Pieces = tuple[Linearisation, Array]
"""The pieces of the law on which nodes lie, and their σ (m, k)."""


def complementary_guesses(
    system: ContactSystem, law: SignoriniCoulomb, near: Mask, others: Pieces | None = None
) -> Iterator[tuple[Array, Array, Array]]:
    """Yield τ, σ and v (m, k) of solutions with springs that approach the solution without springs.

    Pivots are on the nodes in `near`, (m,). The others keep their pieces and σ if `others` gives
    these; the caller must then check them. Without `others` they are open, and join `near` where
    they overlap. There is no guess in three cases. Contact may pull with Coulomb's law, which is no
    complementarity problem. There are too many nodes. S would take too many products to assemble.
    """
    near = near if others else near | ~law.unilateral
    pairs = _Complementarity(law, near, others)
    if not pairs.fits or (system.matrix_free and system.u_0.size > LARGEST):
        return
    root = np.sqrt(np.repeat(system.weight, law.k))
    sprung = _sprung(system, root)
    # the springs are moved after the bodies four times
    for _ in range(4):
        while True:
            solution = pairs.solution(sprung.whole + sprung.springs, sprung.v_0 + sprung.load, root)
            if solution is None:
                return
            y, slips = solution
            v = ((sprung.v_0 + sprung.whole @ y + sprung.displacement(y)) / root).reshape(
                system.u_0.shape
            )
            over = pairs.present & ~near & (v[:, -1] > 0.0)
            if others or not over.any():
                break
            near = near | over
            pairs = _Complementarity(law, near)
        sigma = (y / root).reshape(v.shape)
        tau = pairs.tau(sigma, v, slips)
        yield np.where(near[:, None], tau, others[0].tau) if others else tau, sigma, v
        if others or system.modes is None or not sprung.follow(y):
            return


@dataclass
class _Sprung:
    """A system with springs.

    Attributes
    ----------
    whole, v_0 : (m k, m k) and (m k,) arrays
        Weighted S and u_0.
    springs, load : (m k, m k) and (m k,) arrays
        Displacement of the springs by tractions and by loads.
    carried : float
        Largest displacement of the springs before they were moved.
    """

    whole: Array
    v_0: Array
    springs: Array
    load: Array
    carried: float = np.inf

    def displacement(self, y: Array) -> Array:
        """Return that of the springs by tractions and loads."""
        return np.asarray(self.load + self.springs @ y)

    def follow(self, y: Array) -> bool:
        """Move the springs after the bodies; return whether they carried half of before or
        less."""
        moved = self.displacement(y)
        self.v_0 = self.v_0 + moved
        before, self.carried = self.carried, float(np.abs(moved).max())
        return self.carried <= 0.5 * before


def _sprung(system: ContactSystem, root: Array) -> _Sprung:
    """Return the weighted system with springs as soft as the bodies may move far."""
    modes, base = system.modes, root * system.u_0.ravel()
    whole = root[:, None] * system.compliance() / root
    if modes is None:
        return _Sprung(whole, base, np.zeros_like(whole), np.zeros_like(base))
    # remove the arbitrary part of S for tractions out of balance, and its rigid motions
    motion = root[:, None] * modes.motion.reshape(base.size, -1)
    balance = modes.resultant.reshape(len(modes.load), -1) / root
    fit, spread = np.linalg.pinv(motion), np.linalg.pinv(balance)
    base -= whole @ (spread @ modes.load)
    whole -= (whole @ spread) @ balance
    whole -= motion @ (fit @ whole)
    soft = motion @ (fit @ fit.T)
    far = float(np.abs(base).max()) / (float(np.abs(soft @ modes.load).max()) or np.inf)
    soft *= np.clip(FAR * far, *(np.abs(np.diag(whole)).max() * np.array(SOFT)))
    return _Sprung(whole, base, soft @ balance, soft @ modes.load)


class _Complementarity:
    """The unknowns p, β and λ of nodes, in this order, weighted by the root of the weights.

    v = 0 on held components; the other nodes keep their pieces.
    """

    def __init__(self, law: SignoriniCoulomb, near: Mask, others: Pieces | None = None) -> None:
        self._law, self._ways = law, directions(law.k - 1)
        self.present = np.ones(len(near), dtype=bool) if law.absent is None else ~law.absent
        present = self.present & near
        cone, capped = np.isfinite(law.coefficient), np.isfinite(law.bound)
        slides = present & (law.coefficient > 0.0) & (law.bound > 0.0)
        slides &= law.unilateral | cone | capped
        held = np.zeros((len(near), law.k), dtype=bool)
        held[:, -1] = present & ~law.unilateral
        held[:, :-1] = (held[:, -1] & ~cone & ~capped)[:, None]
        derivative, self._given = np.broadcast_to(np.eye(law.k), (*held.shape, law.k)), 0.0 * held
        if others:
            pieces, sigma = others
            held |= pieces.stick & ~near[:, None]
            derivative = np.where(near[:, None, None], derivative, pieces.derivative)
            self._given = np.where(near[:, None], 0.0, sigma)
        self._held = np.flatnonzero(held)
        node, component = np.divmod(self._held, law.k)
        self._columns = np.zeros((held.size, len(node)))
        for row in range(law.k):
            self._columns[law.k * node + row, np.arange(len(node))] = derivative[
                node, row, component
            ]
        self._presses = np.flatnonzero(present & law.unilateral)
        self._slides = np.flatnonzero(slides)
        self._follows = np.flatnonzero(slides & law.unilateral)
        self._capped = np.flatnonzero(slides & capped)
        self._first_limit = len(self._presses) + len(self._ways) * len(self._slides)
        self._size = self._first_limit + len(self._follows) + len(self._capped)
        self.fits = self._size <= LARGEST and not (slides & ~law.unilateral & cone).any()

    def solution(self, matrix: Array, v_0: Array, root: Array) -> tuple[Array, Mask] | None:
        """Return y with v = v_0 + matrix y, and which nodes slip (m,), or None if the pivots
        fail or tractions at held nodes are not unique."""
        spread, held, given = self._spread(len(root)), self._held, root * self._given.ravel()
        inner = np.column_stack([matrix @ spread, v_0 + matrix @ given])
        of_held = matrix @ self._columns
        try:
            at_held = np.linalg.solve(of_held[held], inner[held])
        except np.linalg.LinAlgError:  # two contacts may hold one node
            return None
        inner -= of_held @ at_held
        both = spread.T @ inner
        # scale the unknowns by the stiffness that the held nodes leave
        unit = float(np.abs(np.diag(both)).max(initial=0.0)) or 1.0
        both[:, :-1] /= unit
        self._limit(both, unit * root[:: self._law.k])
        z = lemke(both[:, :-1], both[:, -1]) if self.fits else None
        if z is None:
            return None
        y = spread @ z / unit + given - self._columns @ (at_held @ np.append(z / unit, 1.0))
        slips, row = np.zeros(len(root) // self._law.k, dtype=bool), self._first_limit
        for nodes in (self._follows, self._capped):
            slips[nodes] |= z[row : row + len(nodes)] > 0.0
            row += len(nodes)
        return y, slips

    def tau(self, sigma: Array, v: Array, slips: Mask) -> Array:
        """Return τ on the piece of the law on which a solution lies.

        v alone does not show the piece, because of the round-off of the springs.
        """
        law, tau, tangential = self._law, -sigma, self._law.groups[0]
        opened = law.unilateral & (sigma[:, -1] >= 0.0)
        tau[opened, -1] = -np.abs(v[opened, -1]) - TINY
        tau[:, tangential] *= 1.0 - CHAINED
        shear, far = lengths(sigma[slips, tangential]), lengths(v[slips, tangential])
        far *= float(np.abs(sigma).max()) / (float(np.abs(v).max()) or 1.0)
        far += (1.0 + CHAINED) * law.radius(tau[:, -1])[slips]
        tau[slips, tangential] *= (far / np.where(shear > 0.0, shear, 1.0))[:, None]
        return tau

    def _spread(self, size: int) -> Array:
        """Return the columns y (m k) of the unknowns."""
        k, p, s = self._law.k, len(self._presses), len(self._slides)
        spread = np.zeros((size, self._size))
        spread[k * self._presses + k - 1, np.arange(p)] = -1.0
        for j, way in enumerate(self._ways):
            for c, share in enumerate(way):
                spread[k * self._slides + c, p + j * s + np.arange(s)] = share
        return spread

    def _limit(self, both: Array, unit: Array) -> None:
        """Fill in the rows and columns of λ."""
        law, p, s = self._law, len(self._presses), len(self._slides)
        row = self._first_limit
        for nodes, is_cone in ((self._follows, True), (self._capped, False)):
            rows, columns = row + np.arange(len(nodes)), np.searchsorted(self._slides, nodes)
            row += len(nodes)
            for j in range(len(self._ways)):
                both[rows, p + j * s + columns] = -1.0
                both[p + j * s + columns, rows] = 1.0
            if is_cone:
                # for an infinite coefficient: a bound is reached at a thousandth of it
                slope = np.minimum(law.coefficient[nodes], STEEP)
                both[rows, np.searchsorted(self._presses, nodes)] = slope
            else:
                both[rows, -1] = unit[nodes] * law.bound[nodes]


def lemke(matrix: Array, offset: Array) -> Array | None:
    """Return z >= 0 with w = offset + matrix z >= 0 and zᵀw = 0 by Lemke's pivots, or None for a
    ray.

    A random column of the artificial unknown prevents ties between pivots (R. W. Cottle, J.-S. Pang
    and R. E. Stone, The linear complementarity problem (1992), chapter 4).

    Examples
    --------
    >>> lemke(np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0]))
    array([1.33333333, 2.33333333])
    """
    n = len(offset)
    if offset.min(initial=0.0) >= 0.0:
        return np.zeros(n)
    # x_B = last column + other columns x_N; unknowns: w (0 to n - 1), z (n to 2n - 1), z_0 (2n)
    cover = 1.0 + np.random.default_rng(2019).random(n)
    table = np.asfortranarray(np.column_stack([matrix, cover, offset]))
    basic, nonbasic = np.arange(n), n + np.arange(n + 1)
    column, row, size = n, int(np.argmin(offset / cover)), float(np.abs(offset).max())
    # most problems take fewer pivots than unknowns
    for _ in range(3 * n):
        leaves = basic[row]
        table = _exchanged(table, row, column)
        basic[row], nonbasic[column] = nonbasic[column], leaves
        left = table[basic == 2 * n, -1].max(initial=0.0)
        column = int(np.argmax(nonbasic == (leaves + n) % (2 * n)))
        rate = table[:, column]
        falls = np.flatnonzero(rate < -CHAINED * np.abs(rate).max())
        if left <= ROUNDED * size or not len(falls):
            z = scattered(table[:, -1], basic, 2 * n + 1)
            return z[n : 2 * n] if left <= CHAINED * size else None
        steps = np.maximum(table[falls, -1], 0.0) / -rate[falls]
        row = int(falls[np.argmin(steps)])
    return None


def _exchanged(table: Array, row: int, column: int) -> Array:
    """Return a table after the exchange of a basic unknown with a nonbasic one."""
    pivot, rate = table[row, column], table[:, column].copy()
    new = table[row] / -pivot
    new[column] = 1.0 / pivot
    table[:, column], rate[row] = 0.0, 0.0
    table = scipy.linalg.blas.dger(1.0, rate, new, a=table, overwrite_a=1)
    table[row] = new
    return table
