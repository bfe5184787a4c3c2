"""The surrogate T of S in space: half spaces, with twice Kelvin's kernel over each contact part.

Consider a half space whose normal displacement is held. Tangential tractions move its surface by
2Gσ, with G = ∫U in its plane. Hence T has the singularity of S. Pressure moves a free surface by
nearly 2Gσ, 1.09 times as much at ν = 0.3. For several bodies T is the sum over the bodies, each
mapped from its nodes to those of contact.

A rectangular part has images across its four sides. They are even where the body beyond the side is
free, and odd where it is held. Each image has the diagonal components alone, so that T stays
symmetric in the weights. Measured eigenvalues of T⁻¹S are in [0.6, 2.7] for the block of problem A;
without images they are in [1.0, 6.2]. For two blocks in unilateral contact they are in [0.15, 2.8].
"""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable

import numpy as np
import scipy

from ..arrays import Array, Index, Mask
from ..bem.operators import BoundaryOperators
from ..round_off import SINGLE
from .layer.operator import fitted

LARGEST = 1000
"""Largest number of contact nodes for which T exists. T is dense; for more nodes its
factorisations cost more than they save."""


class HalfSpace:
    """Dense T on Γ_C times one factor that a contact method adapts to S.

    See `contact.system.Surrogate`.

    Parameters
    ----------
    assemble : callable
        Returns T (m k, m k) [length/stress]. It is called when T is needed and should store its
        result.
    weight : (m,) array
        Node weights [area].
    predicts : bool
        Whether T costs less than the steps of Newton's method that its predictions save.
    """

    fast, rtol = False, 0.0

    def __init__(self, assemble: Callable[[], Array], weight: Array, *, predicts: bool) -> None:
        self.scale, self._assemble, self._weight, self.predicts = 1.0, assemble, weight, predicts
        self._block = functools.lru_cache(maxsize=3)(self._factored)

    def apply(self, x: Array) -> Array:
        """Return T x, (m, k) [length]."""
        return self.scale * (self._matrix @ x.ravel()).reshape(x.shape)

    def solve(self, x: Array, rho: float | Array | None = None) -> Array:
        """Return T⁻¹ x [stress], or (I + ρT)⁻¹ x if ρ is given, (m, k).

        ρ is one number, or one for each component, (k,).
        """
        if rho is None:
            return np.asarray(scipy.linalg.lu_solve(self._factor, x.ravel() / self.scale)).reshape(
                x.shape
            )
        factors = np.broadcast_to(rho, x.shape).ravel()
        return np.linalg.solve(
            np.eye(x.size) + factors[:, None] * self.matrix(), x.ravel()
        ).reshape(x.shape)

    def stick_solve(self, stick: Mask, rhs: Array, rtol: float | None = None) -> Array:
        """Return x (m, k) for which T x = rhs where `stick` (m, k) is true, and x = 0 elsewhere
        [stress]. Factors of the last masks are kept."""
        (held, factor), result = self._block(stick.tobytes()), np.zeros_like(rhs)
        if len(held):  # LAPACK factors no empty matrix
            result.flat[held] = scipy.linalg.lu_solve(factor, rhs.ravel()[held] / self.scale)
        return result

    def _factored(self, stick: bytes) -> tuple[Index, object]:
        held = np.flatnonzero(np.frombuffer(stick, dtype=bool))
        block = self._matrix[held[:, None], held]
        return held, scipy.linalg.lu_factor(block, check_finite=False) if len(held) else None

    def matrix(self) -> Array:
        """Return T, (m k, m k) [length/stress]."""
        return self.scale * self._matrix

    def fit(self, sigma: Array, displacement: Array) -> None:
        """Scale T to S, given a smooth σ and S σ."""
        self.scale *= fitted(self._weight, sigma, self.apply(sigma), displacement)

    @property
    def _matrix(self) -> Array:
        return self._assemble()

    @functools.cached_property
    def _factor(self) -> object:
        return scipy.linalg.lu_factor(self._matrix, check_finite=False)


def half_space(operators: BoundaryOperators, nodes: Index, frame: Array) -> Array:
    """Return T (m k, m k) of one body at contact nodes (m,) along the directions `frame`
    (m, k, 3)."""
    mesh, (m, k) = operators.mesh, frame.shape[:2]
    matrix = np.zeros((m, k, m, k))
    for part in np.unique(mesh.node_part[nodes]):
        own = np.flatnonzero(mesh.node_part[nodes] == part)
        matrix[own[:, None], :, own] = _part(operators, nodes[own], frame[own]).transpose(
            0, 2, 1, 3
        )
    return matrix.reshape(k * m, -1)


def _part(operators: BoundaryOperators, nodes: Index, frame: Array) -> Array:
    """Return T of one part, (m, k, m, k)."""
    mesh, kernel, (m, k) = operators.mesh, operators.kernel, frame.shape[:2]
    panels = np.unique(mesh.element[nodes])
    result = np.zeros((m, k, m, k))

    def add(x: Array, sign: Array | None) -> None:
        for _, elements in mesh.by_kind(panels):
            columns = np.flatnonzero(np.isin(mesh.element[nodes], elements.index))
            block = kernel.integrals(mesh.points(x), elements)[0]
            values = np.einsum("tai,ijct,cbj->tacb", frame, block, frame[columns], optimize=True)
            result[:, :, columns] += values if sign is None else values * np.diag(sign)[:, None]

    add(mesh.x[nodes], None)
    sides = _sides(operators, nodes, frame)
    for moves in itertools.product((0, 1, 2), repeat=len(sides)):
        if any(moves):
            x, sign = mesh.x[nodes], np.ones(k)
            for axis, move in enumerate(moves):
                if move:
                    along, bound, reflection = sides[axis][move - 1]
                    x = x + 2.0 * (bound - x @ along)[:, None] * along
                    sign = sign * reflection
            add(x, sign)
    return 2.0 / kernel.traction_scale * result


Side = tuple[Array, float, Array]
"""One side of a rectangle: the direction normal to it in the plane, the side's coordinate along it,
and the sign of each component's image."""


def _sides(
    operators: BoundaryOperators, nodes: Index, frame: Array
) -> tuple[tuple[Side, Side], ...]:
    """Return the two pairs of opposite sides of a part, or nothing.

    It is nothing unless the part is a rectangle whose sides are parallel to its tangents.
    """
    mesh, data = operators.mesh, operators.data
    tangents = frame[0, :2]
    panels = np.unique(mesh.element[nodes])
    corners = [of_kind[1].corners.reshape(-1, 3) for of_kind in mesh.by_kind(panels)]
    reach = np.concatenate(corners) @ tangents.T
    low, high = reach.min(axis=0), reach.max(axis=0)
    area = float(np.prod(high - low))
    if (
        np.abs(frame - frame[0]).max() > SINGLE
        or abs(mesh.weight[nodes].sum() - area) > SINGLE * area
    ):
        return ()
    middle = mesh.x[nodes[0]] + tangents.T @ (0.5 * (low + high) - tangents @ mesh.x[nodes[0]])
    others = np.flatnonzero(~np.isin(np.arange(mesh.n_nodes), nodes))
    pairs = []
    for axis in range(2):
        pair = []
        for bound, sign in ((low[axis], -1.0), (high[axis], 1.0)):
            side = middle + sign * 0.5 * (high - low)[axis] * tangents[axis]
            beyond = others[np.argmin(np.sum((mesh.x[others] - side) ** 2, axis=1))]
            held = ~data.traction_known[beyond] @ (data.frame[beyond] @ frame[0].T) ** 2
            pair.append((tangents[axis], float(bound), np.where(held > 0.5, -1.0, 1.0)))
        pairs.append((pair[0], pair[1]))
    return pairs[0], pairs[1]
