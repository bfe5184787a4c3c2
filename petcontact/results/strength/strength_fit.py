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

import functools
import math
from collections.abc import Sequence

import numpy as np

from ...arrays import Array, Complex, Index
from ...fields.boundary.places import sizes
from ...geometry.rotation import lifted
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import Keeping, record
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


@record
class _LeastSquares:
    """A weighted fit to the nodes beside a place, factorised.

    Attributes
    ----------
    scale : (n,) array
        Weights of the nodes.
    left, size, right : arrays
        Singular vectors and values of the weighted matrix, each column of which has length 1.
    lengths : (k,) array
        What the columns are divided by.
    """

    scale: Array
    left: Array
    size: Array
    right: Array
    lengths: Array

    def solved(self, data: Array) -> tuple[Array, Array]:
        """The unknowns (k,), without what data (n, 2, c) do not tell apart: singular values below
        the share of the data that no unknowns explain; and the share of each that is not told."""
        data = (data * self.scale[:, None, None]).ravel()
        parts = self.left.T @ data
        unexplained = np.linalg.norm(data - self.left @ parts) / (np.linalg.norm(data) or 1.0)
        told = self.size > max(float(unexplained), HALF) * self.size[0]
        unknowns = self.right[told].T @ (parts[told] / self.size[told]) / self.lengths
        return unknowns, np.sqrt(np.sum(self.right[~told] ** 2, axis=0))


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
        mesh = self._mesh = fields.mesh
        self._key = "sides", *place.key
        self._at = mesh.once(self._key, lambda: _NodesBeside(mesh, place))
        u, traction = self._at.along(fields.data)
        u = 2.0 * fields.body.material.shear_modulus * u
        self._data = np.stack([u, traction * self._at.r[:, None]], axis=1)
        self._strained = self._data.copy()
        self._strained[:, 0] -= u.sum(axis=0) / max(len(u), 1)

    def fit(
        self, expansion: Expansion, between: tuple[float, float] = (0.0, 1.0), alike: bool = False
    ) -> Array:
        """Return K of the modes of an expansion, by nodes between shares of the farthest, how far
        each may be off by what these do not tell apart, and by what no node tells, (3, k).

        All nodes that are fitted count alike, or by what they are expected to be off. What a mode
        is not told apart from is up to as large as all that is strained, over how much that mode
        differs from a uniform stress between the nearest and the farthest node.
        """
        fit = expansion, between, alike
        equations = self._mesh.once((*self._key, *fit), lambda: self._at.equations(*fit))
        if equations is None:
            return np.full((3, len(expansion.modes)), math.nan)
        axes = slice(0, 2) if expansion.components == 2 else slice(2, None)
        data = self._data[..., axes]
        if expansion.components == 2:
            data = np.einsum("nij,nkj->nki", self._at.turn, data)
        strained = np.linalg.norm(equations.scale[:, None, None] * self._strained[..., axes])
        found, untold = equations.solved(data)
        most = strained / equations.lengths
        every = iter(np.stack([found, untold * most, most], axis=1))
        values = list[Array]()
        for power in (mode.exponent for mode in expansion.modes):
            value = next(every) if power.imag == 0.0 else np.hypot(next(every), next(every))
            value[1:] /= 1.0 - self._at.range ** (1.0 - power.real)
            values.append(value * self._at.unit**-power.real)
        return np.reshape(values, (-1, 3)).T


class _NodesBeside(Keeping):
    """The nodes on the two sides of a place, and the equations of all fits to what is there."""

    def __init__(self, mesh: BoundaryMesh, place: Place) -> None:
        axes = np.stack([place.along, place.inward])
        self._nodes, flat, start, self.unit = _on_sides(mesh, place, axes)
        self.r = np.linalg.norm(flat, axis=1)
        turned = np.arctan2(flat[:, 1], flat[:, 0]) - start
        self._theta = start + np.remainder(turned + math.pi, 2.0 * math.pi) - math.pi
        cosine, sine = np.cos(self._theta), np.sin(self._theta)
        self.turn = np.array([[cosine, sine], [-sine, cosine]]).transpose(2, 0, 1)
        self._normal = np.einsum("nij,nj->ni", self.turn, mesh.normal[self._nodes] @ axes.T)
        self._axes = lifted(axes, max(mesh.components, mesh.dim))
        if mesh.components == 3:
            self._axes = np.vstack([self._axes, np.cross(*self._axes)])
        self.range = float(self.r.min(initial=self.unit)) / self.unit
        self._weight = np.sqrt(mesh.measure[self._nodes] / self.r)
        self._followed = _followed(mesh, self._nodes, self.r)
        # around a ring equilibrium is not that of the plane
        self._around = bool(np.any(mesh.images(place.x[None])[-1] != place.x))
        self._sides = np.stack([start == 0.0, start > 0.0], axis=1)
        end = 2.0 * float(sizes(mesh)[list(place.elements)].max(initial=0.0))
        self._end, self._size = max(end, place.core), place.size

    def along(self, data: Sequence[Array]) -> list[Array]:
        """Vectors at all nodes of the body at these nodes, along the axes of the place."""
        return [values[self._nodes] @ self._axes.T for values in data]

    def equations(
        self, expansion: Expansion, between: tuple[float, float], alike: bool
    ) -> _LeastSquares | None:
        """Those of a fit, as of `Sides.fit`; None where they are too few."""
        near = (between[0] <= self.r / self.unit) & (self.r / self.unit <= between[1])
        least = min(mode.exponent.real for mode in expansion.modes)
        most = 2.0 * expansion.components * int(near.sum()) / ENOUGH
        matrix, left_out = self._terms(expansion, most)
        if matrix.shape[-1] > most:
            return None
        scale = near * self._weight * (self.r / self.unit) ** -least
        scale /= 1.0 if alike else self._off(least, left_out)
        matrix = (matrix * scale[:, None, None, None]).reshape(-1, matrix.shape[-1])
        lengths = np.maximum(np.linalg.norm(matrix, axis=0), np.finfo(float).tiny)
        left, size, right = np.linalg.svd(matrix / lengths, full_matrices=False)
        return _LeastSquares(scale, left, size, right, lengths)

    def _off(self, least: float, left_out: float) -> Array:
        """How far rows (n,) are expected to be off, over r^λ, with the least λ of the modes and the
        least exponent that is left out [-].

        What the elements at the place miss, or its core does otherwise, acts farther out like
        r^-1, where the terms of that with smaller exponents are fitted.
        """
        polluted = (self._end / self.r) ** (least + 1.0)
        return np.asarray(self._followed + polluted + (self.r / self._size) ** (left_out - least))

    def _terms(self, expansion: Expansion, most: float) -> tuple[Array, float]:
        """What is fitted: the modes, a translation, and as many of the other terms as there are
        equations for; and the exponent of the first that is left out."""
        columns = [
            self._columns(expansion, mode.exponent, mode.coefficients[:, None])
            for mode in expansion.modes
        ]
        still = np.zeros((len(self.r), 2, expansion.components, expansion.components))
        still[:, 0] = self.turn if expansion.components == 2 else 1.0
        columns.append(still)
        left_out, powers = REGULAR, self._powers(expansion)
        free = [(power, None) for power in powers]
        for power, coefficients in (*free[:1], *expansion.polluted, *free[1:]):
            columns_of = functools.partial(self._columns, expansion, power, coefficients)
            more = self.once((expansion, power), columns_of)  # of all fits
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
        grows, count = (self.r / self.unit) ** power, 2 * expansion.components
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
