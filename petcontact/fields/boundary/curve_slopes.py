"""Recovered slopes along curves."""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Index
from ...mesh.basis import best_slopes, lagrange_slopes
from ...mesh.curve_mesh import CurveMesh
from ..joints import runs_on

MOST_POINTS, BEYOND = 5, 2
"""Largest number of points on an element, and on each of its neighbours."""
CHUNK = 1 << 16
"""Number of places that are evaluated at once."""


class CurveSlopes:
    """Slopes on curves by interpolation along the arc length, see `recovery`.

    Parameters
    ----------
    mesh : CurveMesh
        n nodes, no element of order 0.
    values : (n, k) array
    x : (n, 2) array
        Positions that belong to the values [length].
    linear : (n_elements, k, 2) array
        Linear parts, see `linear_parts` [1/length].
    label : (n_elements,) array
        Only elements with one label are neighbours.
    """

    def __init__(
        self, mesh: CurveMesh, values: Array, x: Array, linear: Array, label: Index
    ) -> None:
        self._mesh, self._count = mesh, values.shape[1]
        before, after = mesh.neighbours()
        self._linear = linear
        if linear.any():
            values = np.hstack([values, x])
        joined_after = (label == label[after]) & (mesh.part == mesh.part[after]) & runs_on(mesh)
        joined_before = joined_after[before] & (before != np.arange(mesh.n_elements))
        count, half = mesh.n_elements, 0.5 * mesh.length
        self._s = np.full((count, MOST_POINTS + 2 * BEYOND), np.nan)
        self._slope = np.zeros((*self._s.shape, values.shape[1]))
        # the places nearest to the ends of each element: distance from the end, and slope
        distance = np.full((2, count, BEYOND), np.nan)
        slope = np.zeros((2, count, BEYOND, values.shape[1]))
        for order in np.unique(mesh.order).tolist():
            of_order, z = np.flatnonzero(mesh.order == order), best_slopes(order)
            nodal = values[mesh.first_node[of_order][:, None] + np.arange(order + 1)]
            slopes = np.einsum("bz,ebk->ezk", lagrange_slopes(order, z), nodal)
            slopes /= half[of_order, None, None]
            slopes = self._with_linear(
                slopes, *np.broadcast_arrays(of_order[:, None], 0.5 * (1.0 + z))
            )
            self._s[of_order, :order] = z * half[of_order, None]
            self._slope[of_order, :order] = slopes
            near = min(order, BEYOND)
            distance[:, of_order, :near] = (1.0 + z[:near]) * half[
                of_order, None
            ]  # the zeros are symmetric
            slope[0][of_order, :near] = slopes[:, :near]
            slope[1][of_order, :near] = slopes[:, ::-1][:, :near]
        # an only neighbour gives two points, else each gives one
        for k in range(BEYOND):
            first, last = MOST_POINTS + k, MOST_POINTS + BEYOND + k
            use_before = joined_before & ~(joined_after & (k > 0))
            use_after = joined_after & ~(joined_before & (k > 0))
            self._s[:, first] = np.where(use_before, -half - distance[1, before, k], np.nan)
            self._s[:, last] = np.where(use_after, half + distance[0, after, k], np.nan)
            self._slope[:, first], self._slope[:, last] = slope[1, before, k], slope[0, after, k]

    def at(self, element: Index, place: Array) -> Array:
        """See `Slopes.at`."""
        parts = [
            self._at(element[k : k + CHUNK], place[k : k + CHUNK])
            for k in range(0, max(len(element), 1), CHUNK)
        ]
        return np.concatenate(parts)

    def _at(self, element: Index, place: Array) -> Array:
        mesh = self._mesh
        s, x = self._s[element], (place - 0.5) * mesh.length[element]
        there = ~np.isnan(s)
        s = np.where(there, s, 0.0)
        basis = np.where(there, 1.0, 0.0)
        for j in range(s.shape[1]):
            others = there[:, j, None] & there
            others[:, j] = False
            step = np.where(others, s - s[:, j, None], 1.0)
            basis *= np.where(others, (x - s[:, j])[:, None] / step, 1.0)
        slope = self._with_linear(
            np.einsum("qj,qjk->qk", basis, self._slope[element]), element, place
        )
        along = mesh.tangents_to(mesh.at(element, place)[1])
        return np.asarray(slope[:, : self._count, None] * along)

    def _with_linear(self, slopes: Array, element: Index, place: Array) -> Array:
        """Return slopes (..., k + 2) of the values and the position that are exact for linear
        parts."""
        if slopes.shape[-1] == self._count:
            return slopes
        normal = self._mesh.at(element.ravel(), place.ravel())[1]
        along = self._mesh.tangents_to(normal).reshape((*slopes.shape[:-1], 2))
        lost = np.einsum("...ka,...a->...k", self._linear[element], along - slopes[..., -2:])
        return np.concatenate([slopes[..., :-2] + lost, along], axis=-1)
