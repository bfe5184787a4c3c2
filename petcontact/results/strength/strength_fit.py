"""The fit of displacements and tractions beside a place without a bound.

Displacements u and tractions t at the nodes on both sides of the place, on all elements but those
that end there, are fitted by fields of its `Expansion`: a translation, the modes, what errors at
the place add (-λ), and fields that satisfy equilibrium but no condition on the sides, with the
exponents of all regular terms, of loads (1, 2, 3), and of what curved sides add to the modes
(λ + 1, λ + 2). Rows are 2µ u and r t, both over r^λ, each weighted by the length of the boundary
over r, and by how far the row is expected to be off: by what polynomials of its element leave of
r^λ, by what is wrong at the place itself, and by the terms that are left out.
"""

from __future__ import annotations

import math

import numpy as np

from ...arrays import Array, Complex, Index
from ...fields.boundary.places import sizes
from ...geometry.rotation import lifted
from ...mesh.boundary_mesh import BoundaryMesh
from ...refinement.corner_modes import REGULAR, Expansion
from ...round_off import HALF, SINGLE
from ..body_fields import BodyFields
from .place import Place

NEAREST, FARTHEST = 1e-5, 0.3
"""Nodes that are fitted lie between these distances, over the size of the feature. Farther out
there are terms that `REGULAR` leaves out; nearer r^λ is as small as what solvers leave over."""
ENOUGH, FEWEST = 3.0, 12
"""Equations of a fit over its unknowns, at least: terms with the largest exponents are left out.
Nodes that are fitted, at least, where as many are nearer than the next corner: with four equations
each they are enough for two modes, a translation, a rotation and uniform stress."""
APART = 1e-2
"""Exponents that are nearer to each other count as one in a fit."""


def _solved(matrix: Array, data: Array) -> Array:
    """The unknowns of least squares, without what the data do not tell apart: singular values below
    the share of the data that no unknowns explain."""
    left, size, right = np.linalg.svd(matrix, full_matrices=False)
    parts = left.T @ data
    unexplained = np.linalg.norm(data - left @ parts) / (np.linalg.norm(data) or 1.0)
    told = size > max(float(unexplained), HALF) * size[0]
    return np.asarray(right[told].T @ (parts[told] / size[told]))


def _on_sides(mesh: BoundaryMesh, place: Place, axes: Array) -> tuple[Index, Array, Array, float]:
    """The nodes (n,) on the two sides of a place that are fitted, where they lie in axes (n, 2),
    the angles of their sides (n,), and up to what distance they lie."""
    ends = np.exp(1j * np.array([0.0, place.angle]))
    ways = np.stack([ends.real, ends.imag], axis=1) @ axes
    normals = np.stack([[0.0, -1.0], [-ends[1].imag, ends[1].real]]) @ axes
    away = mesh.x - place.x
    flat = away @ axes.T
    r, width = np.linalg.norm(flat, axis=1), np.linalg.norm(away - flat @ axes, axis=1)
    # nodes are of the side that they lie along and whose normal they have
    fits = away @ ways.T / np.maximum(r, np.finfo(float).tiny)[:, None] + mesh.normal @ normals.T
    side, elements = fits.argmax(axis=1), list(place.elements)
    # which nodes lie on the edge of what is fitted does not depend on round-off
    usable = (
        (fits.max(axis=1) > 1.0)
        & (max(NEAREST * place.size, place.core) < (1.0 - SINGLE) * r)
        & (width <= (1.0 + SINGLE) * place.width)
        & np.isin(mesh.part[mesh.element], mesh.part[elements])
        & ~np.isin(mesh.element, elements)
    )
    # on coarse meshes some lie farther away
    enough = np.sort(r[usable & (r < place.size)])[:FEWEST].max(initial=0.0)
    reach = (1.0 + SINGLE) * max(FARTHEST * place.size, float(enough))
    nodes = np.flatnonzero(usable & (r < reach))
    return nodes, flat[nodes], place.angle * side[nodes], reach


def _followed(mesh: BoundaryMesh, nodes: Index, r: Array) -> Array:
    """How far the polynomials of the elements of nodes (n,) at distances (n,) from a place are off
    from powers of the distance, which have their nearest singularity there, (n,) [-].

    A function of t in [-1, 1] that is singular at t = -1/x is off by ρ^-(p + 1) from its best
    polynomial of degree p, and ρ = (1 + √(1 - x²))/x. Source: L. N. Trefethen, Approximation Theory
    and Approximation Practice, 2013, theorem 8.2.
    """
    element = mesh.element[nodes]
    count = np.bincount(element, minlength=mesh.n_elements)[element]
    middle = (np.bincount(element, r, mesh.n_elements)[element]) / count
    x = np.minimum(sizes(mesh)[element] / middle, 1.0)
    rho = (1.0 + np.sqrt(1.0 - x**2)) / x
    return np.asarray(rho ** -(mesh.order[element] + 1.0))


class Sides:
    """Displacement and traction on the two sides of a place."""

    def __init__(self, fields: BodyFields, place: Place) -> None:
        mesh, axes = fields.mesh, np.stack([place.along, place.inward])
        nodes, flat, start, self._unit = _on_sides(mesh, place, axes)
        self._r = np.linalg.norm(flat, axis=1)
        turned = np.arctan2(flat[:, 1], flat[:, 0]) - start
        self._theta = start + np.remainder(turned + math.pi, 2.0 * math.pi) - math.pi
        cosine, sine = np.cos(self._theta), np.sin(self._theta)
        self._turn = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
        self._normal = np.einsum("nij,nj->ni", self._turn, mesh.normal[nodes] @ axes.T)
        whole = lifted(axes, max(mesh.components, mesh.dim))
        if mesh.components == 3:
            whole = np.vstack([whole, np.cross(*whole)])
        u, traction = (values[nodes] @ whole.T for values in fields.data)
        u = 2.0 * fields.body.material.shear_modulus * u
        self._data = np.stack([u, traction * self._r[:, None]], axis=1)
        self._weight = np.sqrt(mesh.measure[nodes] / self._r)
        self._followed = _followed(mesh, nodes, self._r)
        # around a ring equilibrium is not that of the plane
        self._around = bool(np.any(mesh.images(place.x[None])[-1] != place.x))
        self._sides = np.stack([start == 0.0, start > 0.0], axis=1)
        self._free = dict[tuple[int, complex], Array]()  # of all fits
        end = 2.0 * float(sizes(mesh)[list(place.elements)].max(initial=0.0))
        self._end, self._size = max(end, place.core), place.size

    def fit(
        self, expansion: Expansion, between: tuple[float, float] = (0.0, 1.0), alike: bool = False
    ) -> list[float]:
        """Return K of the modes of an expansion, by nodes between shares of the farthest; all that
        are fitted count alike, or by what they are expected to be off."""
        near = (between[0] <= self._r / self._unit) & (self._r / self._unit <= between[1])
        least = min(mode.exponent.real for mode in expansion.modes)
        data = self._data[..., 2:]
        if expansion.components == 2:
            data = np.einsum("nij,nkj->nki", self._turn, self._data[..., :2])
        most = 2.0 * expansion.components * int(near.sum()) / ENOUGH
        matrix, left_out = self._terms(expansion, most)
        scale = near * self._weight * (self._r / self._unit) ** -least
        scale /= 1.0 if alike else self._off(least, left_out)
        if matrix.shape[-1] > most:
            return [math.nan] * len(expansion.modes)
        matrix = (matrix * scale[:, None, None, None]).reshape(data.size, -1)
        size = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
        parts = iter(
            (_solved(matrix / size, (data * scale[:, None, None]).ravel()) / size).tolist()
        )
        values = list[float]()
        for power in (mode.exponent for mode in expansion.modes):
            value = next(parts) if power.imag == 0.0 else math.hypot(next(parts), next(parts))
            values.append(value * self._unit**-power.real)
        return values

    def _off(self, least: float, left_out: float) -> Array:
        """How far rows (n,) are expected to be off, over r^λ, with the least λ of the modes and the
        least exponent that is left out [-].

        What the elements at the place miss, or its core does otherwise, acts farther out like
        r^-1, where the terms of that with smaller exponents are fitted.
        """
        polluted = (self._end / self._r) ** (least + 1.0)
        return np.asarray(self._followed + polluted + (self._r / self._size) ** (left_out - least))

    def _terms(self, expansion: Expansion, most: float) -> tuple[Array, float]:
        """What is fitted: the modes, a translation, and as many of the other terms as there are
        equations for; and the exponent of the first that is left out."""
        columns = [
            self._columns(expansion, mode.exponent, mode.coefficients[:, None])
            for mode in expansion.modes
        ]
        still = np.zeros((len(self._r), 2, expansion.components, expansion.components))
        still[:, 0] = self._turn if expansion.components == 2 else 1.0
        columns.append(still)
        left_out, powers = REGULAR, self._powers(expansion)
        free = [(power, None) for power in powers]
        for power, coefficients in (*free[:1], *expansion.polluted, *free[1:]):
            key = expansion.components, power
            if key not in self._free:
                self._free[key] = self._columns(expansion, power, coefficients)
            more = self._free[key]
            if sum(each.shape[-1] for each in (*columns, more)) > most:
                left_out = max(power, powers[0], key=lambda each: each.real).real
                break
            columns.append(more)
        return np.concatenate(columns, axis=-1), left_out

    def _powers(self, expansion: Expansion) -> list[complex]:
        """The exponents of terms without conditions on the sides, increasing."""
        shadows = [mode.exponent + k for mode in expansion.modes for k in (1.0, 2.0)]
        every = [*expansion.regular, 1.0 + 0.0j, 2.0 + 0.0j, 3.0 + 0.0j, *shadows]
        kept = list[complex]()
        for power in sorted(every, key=lambda each: each.real):
            if power.real < REGULAR and all(abs(power - each) > APART for each in kept):
                kept.append(power)
        return kept

    def _columns(self, expansion: Expansion, power: complex, fields: Complex | None) -> Array:
        """Displacement and traction times r, (n, 2, c, k), of fields with an exponent: in the plane
        by default of all in equilibrium, around a ring of whatever they are on either side."""
        grows, count = (self._r / self._unit) ** power, 2 * expansion.components
        if fields is None and self._around:
            each = np.einsum("n,ns,ij->nisj", np.abs(grows), self._sides, np.eye(count))
            return np.reshape(each, (len(grows), 2, expansion.components, 2 * count))
        rows = expansion.rows(power, self._theta) @ (np.eye(count) if fields is None else fields)
        rows *= grows[:, None, None]
        radial, around = self._normal[:, 0, None], self._normal[:, 1, None]
        if expansion.components == 2:
            u = rows[:, :2]
            traction = np.stack(
                [
                    rows[:, 4] * radial + rows[:, 2] * around,
                    rows[:, 2] * radial + rows[:, 3] * around,
                ],
                axis=1,
            )
        else:
            u, traction = rows[:, :1], (rows[:, 2] * radial + rows[:, 1] * around)[:, None]
        result = np.stack([u, traction], axis=1)
        parts = (result.real, -result.imag) if power.imag else (result.real,)
        return np.concatenate(parts, axis=-1)
