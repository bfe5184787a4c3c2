"""Recovered slopes on panels."""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, Index, Mask
from ...mesh.surface_mesh import SurfaceMesh
from .gradients import surface_gradient
from .places import best_places, middles, sizes

SAMPLES = 2.0
"""Number of samples over that of the coefficients of a fit [-]."""
SOFT = 0.3
"""Constant of a sample's weight (SOFT + d)^-2, with its distance d in half-widths of the panel."""
AMPLIFIED = (3.0, 3.0, 6.0, 6.0, 20.0)
"""Largest error at a corner of a panel over that of the samples (Lebesgue constant), by degree. If
it is exceeded, a lower degree is fitted. With 20 for all degrees, large panels at the border of a
part showed a third of a distant peak on small panels."""


class PanelSlopes:
    """Slopes on panels by fits of polynomials of total degree p + 1 in the tangent plane.

    See `recovery`.

    Parameters
    ----------
    mesh : SurfaceMesh
        n nodes.
    values : (n, k) array
    x : (n, 3) array
        Positions that belong to the values [length].
    linear : (n_elements, k, 3) array
        Linear parts, see `linear_parts` [1/length].
    label : (n_elements,) array
        Only elements with one label are neighbours.
    """

    def __init__(
        self, mesh: SurfaceMesh, values: Array, x: Array, linear: Array, label: Index
    ) -> None:
        self._mesh, self._values, self._label = mesh, np.hstack([values, x]), label
        self._linear = linear
        self._owner, place = best_places(mesh)
        self._sample = self._own(self._owner, place)
        self._x, self._normal = mesh.at(self._owner, place)
        self._middle, self._middle_normal = mesh.at(*middles(mesh))
        self._level = np.floor(np.log2(sizes(mesh)) + 0.5).astype(np.int64)
        # those of a lower degree come first
        degrees = range(int(mesh.order.max()) + 2)
        self._exponents = np.array([(a, total - a) for total in degrees for a in range(total + 1)])
        shape = mesh.n_elements, len(self._exponents), 3 * self._values.shape[1]
        self._fit = np.zeros(shape)
        self._asked, self._has_fit = np.zeros((2, mesh.n_elements), dtype=bool)

    def at(self, element: Index, place: Array) -> Array:
        """See `Slopes.at`."""
        self._fit_to(np.unique(element))
        result = self._own(element, place)
        rows = np.flatnonzero(self._has_fit[element])
        element, place = element[rows], place[rows]
        local = self._local(element, self._mesh.at(element, place)[0][:, None])[:, 0]
        fitted = np.einsum("qj,qjg->qg", _powers(local, self._exponents), self._fit[element])
        slopes = fitted.reshape(len(rows), *result.shape[1:])
        result[rows] = self._with_linear(slopes, element, place)
        return result[:, :-3]

    def _fit_to(self, asked: Index) -> None:
        """Fit polynomials to the samples around those panels that have none yet."""
        mesh, asked = self._mesh, asked[~self._asked[asked]]
        self._asked[asked] = True
        groups = np.column_stack([mesh.part, self._label, mesh.order, self._level])
        for part, label, order, level in np.unique(groups[asked], axis=0).tolist():
            samples = np.flatnonzero(
                (mesh.part[self._owner] == part) & (self._label[self._owner] == label)
            )
            panels = asked[np.all(groups[asked] == (part, label, order, level), axis=1)]
            samples = self._thinned(samples, level, max(order, 1))
            degree = min(order + 1, _degree(len(samples)))
            while degree > 0 and len(panels):
                panels = self._fitted(panels, samples, degree)
                degree -= 1

    def _own(self, element: Index, place: Array) -> Array:
        """Return slopes of the values and then of the position, (q, k + 3, 3).

        They use the nodes of each panel alone.
        """
        slopes = surface_gradient(self._mesh, self._values, element, place)
        return self._with_linear(slopes, element, place)

    def _with_linear(self, slopes: Array, element: Index, place: Array) -> Array:
        """Return slopes of the values and the position that are exact for linear parts,
        (q, k + 3, 3)."""
        normal = self._mesh.at(element, place)[1]
        plane = np.eye(3) - normal[:, :, None] * normal[:, None]
        return np.concatenate(
            [slopes[:, :-3] + self._linear[element] @ (plane - slopes[:, -3:]), plane], axis=1
        )

    def _thinned(self, samples: Index, level: int, order: int) -> Index:
        """Return samples that are as far apart as those on panels of this level and order.

        Smaller panels give one sample for each cube. Otherwise all samples nearest to a panel could
        lie on small panels at one side, and would not determine the polynomial at the others.
        """
        small = self._level[self._owner[samples]] < level
        cube = np.floor(self._x[samples[small]] / (2.0**level / order)).astype(np.int64)
        return np.concatenate(
            [samples[~small], samples[small][np.unique(cube, axis=0, return_index=True)[1]]]
        )

    def _nearest(self, panels: Index, samples: Index, count: int) -> tuple[Index, Array, Array]:
        """Return the samples nearest to each panel, (n, count), their places and their distances.

        Both are in half-widths of the panel. The distance is infinite on other faces.
        """
        # they are chosen among four times as many, by distance in space
        near = scipy.spatial.cKDTree(self._x[samples]).query(
            self._middle[panels], k=min(len(samples), 4 * count)
        )[1]
        near = samples[near.reshape(len(panels), -1)]
        local = self._local(panels, self._x[near])
        distance = np.linalg.norm(local, axis=2)
        facing = np.einsum("ncd,nd->nc", self._normal[near], self._middle_normal[panels])
        # panels on one smooth face have normals that turn by less
        distance[np.less(facing, 0.7)] = np.inf
        chosen = np.argsort(distance, axis=1, kind="stable")[:, :count]
        near, distance = (np.take_along_axis(a, chosen, axis=1) for a in (near, distance))
        return near, np.take_along_axis(local, chosen[:, :, None], axis=1), distance

    def _fitted(self, panels: Index, samples: Index, degree: int) -> Index:
        """Fit polynomials of a degree on some panels of one group to its samples.

        Return the panels whose fit these samples do not determine.
        """
        exponents = self._exponents[: (degree + 1) * (degree + 2) // 2]
        near, local, distance = self._nearest(
            panels, samples, min(len(samples), int(np.ceil(SAMPLES * len(exponents))))
        )
        weight = (SOFT + distance) ** -2
        u, size, v = np.linalg.svd(
            weight[:, :, None] * _powers(local, exponents), full_matrices=False
        )
        # smaller singular values: the samples do not determine the fit
        determined: Mask = np.greater(size[:, -1], 1e-6 * size[:, 0])
        inverse = 1.0 / np.where(determined[:, None], size, 1.0)
        fit = (v.transpose(0, 2, 1) * inverse[:, None]) @ (u.transpose(0, 2, 1) * weight[:, None])
        corners = np.where(
            np.isnan(self._mesh.corners[panels]),
            self._mesh.corners[panels, :1],
            self._mesh.corners[panels],
        )
        at_corners = _powers(self._local(panels, corners), exponents) @ fit
        determined &= np.abs(at_corners).sum(axis=2).max(axis=1) < AMPLIFIED[degree]
        nodal = self._sample[near].reshape(*near.shape, -1)
        self._fit[panels, : len(exponents)] = np.where(determined[:, None, None], fit @ nodal, 0.0)
        self._has_fit[panels] = determined
        return panels[~determined]

    def _local(self, element: Index, x: Array) -> Array:
        """Return points (n, q, 3) in the tangent plane at the middle of panels (n,), (n, q, 2).

        The coordinates are in half-widths of the panel.
        """
        middle = self._middle[element][:, None]
        frame = self._mesh.tangents_to(self._middle_normal[element])
        corners = np.einsum("ncd,nkd->nkc", frame, self._mesh.corners[element] - middle)
        return np.asarray(
            np.einsum("ncd,nqd->nqc", frame, x - middle)
            / np.nanmax(np.abs(corners), axis=1)[:, None]
        )


def _degree(samples: int) -> int:
    """Return the largest degree that this number of samples determines with some reserve."""
    degree = 0
    while SAMPLES * (degree + 2) * (degree + 3) / 2 <= 1.5 * samples:
        degree += 1
    return degree


def _powers(local: Array, exponents: Index) -> Array:
    """Return ξ^a η^b at points (..., 2) for all exponents, (..., K)."""
    return np.asarray(np.prod(np.power(local[..., None, :], exponents), axis=-1))
