"""Chebyshev polynomials on a box around a body along its principal axes. Coefficients are of the
size of values.

A polynomial is an array (D+1,)*d of coefficients, whose indices are the degrees along the axes.
Operations keep the shape; the caller leaves room for what rises in degree (see `padded`).
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.linalg
from numpy.polynomial import chebyshev, legendre

from ...arrays import Array, Index
from ...mesh.basis import gauss
from ...mesh.boundary_mesh import BoundaryMesh
from ...record import Keeping

SAMPLES = 250
"""Points of the boundary at which inverse Laplacians are kept small, at least."""


def total_degrees(degree: int, d: int) -> Index:
    """Return the exponents (d, N) of total degree up to `degree`."""
    exponents = np.indices((degree + 1,) * d).reshape(d, -1)
    return exponents[:, exponents.sum(axis=0) <= degree]


def spread_over(mesh: BoundaryMesh, count: int) -> tuple[Array, Array]:
    """Return points (n, d) that are spread over the boundary, about `count` of them, and their
    shares of it (n,).

    Each element has those of a product of Gauss' rules, so that what is symmetric stays so. Nodes
    do not do: between those of a few elements a polynomial of a high degree may be of any size.
    """
    numbers, faces = mesh.faces(*mesh.part_names)
    area = np.bincount(mesh.element, mesh.weight, mesh.n_elements)[numbers]
    some = np.arange(0, len(area), -(-len(area) // count))
    needed = count * area[some] / area[some].sum()
    points, weights = list[Array](), list[Array]()
    along = np.ceil(needed ** (1.0 / (mesh.dim - 1))).astype(int)
    for n in np.unique(along).tolist():
        own, (shares, weight) = some[along == n], _product_rule(n, mesh.dim - 1)
        number, share = np.repeat(own, len(shares)), np.tile(shares, (len(own), 1))
        points.append(faces.at(number, faces.spread(number, share))[0])
        weights.append(np.tile(weight, len(own)) * faces.area(number, share))
    weight = np.concatenate(weights)
    return np.vstack(points), weight / weight.sum()


def _product_rule(n: int, d: int) -> tuple[Array, Array]:
    """Return the points (n^d, d) of the product of Gauss' rules on [0, 1], and their weights."""
    xi, weight = gauss(n - 1)
    points = 0.5 + 0.5 * np.stack(np.meshgrid(*[xi] * d), axis=-1).reshape(-1, d)
    return points, functools.reduce(np.multiply.outer, [0.5 * weight] * d).ravel()


def extent(mesh: BoundaryMesh, axes: Array) -> tuple[Array, Array]:
    """Return the least and the largest coordinates (d,) of the boundary along axes (d, d): those of
    nodes and of the ends of elements, as no node lies at a corner."""
    _, faces = mesh.faces(*mesh.part_names)
    number, start, _ = faces.rims()
    along = np.vstack([mesh.x, faces.at(number, start)[0]]) @ axes.T
    return along.min(axis=0), along.max(axis=0)


def degree(p: Array) -> int:
    """Return the total degree of a polynomial."""
    return int(np.add.reduce(np.indices(p.shape))[p != 0.0].max(initial=0))


def padded(p: Array, size: int) -> Array:
    """Return the polynomial with `size` coefficients along each axis; those cut off are zero."""
    result = np.zeros((size,) * p.ndim)
    kept = tuple(slice(0, min(size, count)) for count in p.shape)
    result[kept] = p[kept]
    return result


def up_to(p: Array, degree: float) -> Array:
    """Return the part of Chebyshev polynomials of total degree up to `degree`."""
    return np.where(np.add.reduce(np.indices(p.shape)) <= degree, p, 0.0)


@dataclass(frozen=True, eq=False)
class BodyBox(Keeping):
    """A box around a body, in which ξ = axes (x - centre)/half lies in [-1, 1]^d.

    Attributes
    ----------
    centre : (d,) array
    axes : (d, d) array
        A unit vector a row.
    half : (d,) array
        Half the lengths of its sides [length].
    samples, weight : (n, d), (n,) arrays
        ξ at points all over the boundary, and their shares of it.
    radius : float
        The smallest of gyration of the boundary [length].
    highest : float
        Degrees above it are not tried.
    """

    centre: Array
    axes: Array
    half: Array
    samples: Array
    weight: Array
    radius: float
    highest: ClassVar[float] = math.inf

    @classmethod
    def around(cls, mesh: BoundaryMesh) -> BodyBox:
        """Return the box along the principal axes of the boundary where it is long, otherwise along
        those of the coordinates."""
        samples, weight = spread_over(mesh, SAMPLES)
        away = samples - weight @ samples
        moments, vectors = np.linalg.eigh(np.einsum("n,ni,nj->ij", weight, away, away))
        # the box of a body twice as long as thick lies along its principal axes
        axes = vectors.T if moments[-1] > 4.0 * moments[0] else np.eye(mesh.dim)
        low, high = extent(mesh, axes)
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        local = (samples @ axes.T - middle) / half
        return cls(middle @ axes, axes, half, local, weight, float(np.sqrt(moments[0])))

    def across(self, axis: Sequence[float] | None) -> Array:
        """The part of a vector across an axis of rotation, in space that along z by default, (d,
        d)."""
        if len(self.centre) == 2:
            return np.eye(2)
        along = np.array(axis or (0.0, 0.0, 1.0))
        return np.asarray(np.eye(3) - np.outer(along, along) / (along @ along))

    def grid(self, line: Array) -> Array:
        """Points (n^d, d) of the box by n places in [-1, 1] along each axis."""
        d = len(self.half)
        points = np.stack(np.meshgrid(*[line] * d, indexing="ij"), axis=-1).reshape(-1, d)
        return np.asarray(self.centre + (points * self.half) @ self.axes)

    def local(self, x: Array) -> Array:
        """ξ (m, d) at x (m, d)."""
        return (x - self.centre) @ self.axes.T / self.half

    def derivative(self, p: Array, axis: int) -> Array:
        """Return the derivative along an axis of the box [1/length]."""
        return padded(chebyshev.chebder(p, axis=axis) / self.half[axis], len(p))

    def laplacian(self, p: Array) -> Array:
        """Return the sum of the second derivatives [1/length²]."""
        return np.asarray(
            sum(self.derivative(self.derivative(p, axis), axis) for axis in range(p.ndim))
        )

    def inverse_laplacian(self, p: Array, orders: tuple[int, ...] = (1, 2)) -> Array:
        """Return q with lap q = p, two degrees higher [length²].

        Of all these it is that of mean 0 with the smallest derivatives of some orders on the
        boundary: it depends on the body, not on its axes, and is about as large as p makes it.
        Where those of order 1 alone are small it is rougher.
        """
        result, n = np.zeros_like(p), degree(p)
        if p.any():
            inverse = self.once((n, orders), lambda: self._inverse(n, orders))
            result[tuple(total_degrees(n + 2, p.ndim))] = (
                inverse @ p[tuple(total_degrees(n, p.ndim))]
            )
        return result

    def _inverse(self, n: int, orders: tuple[int, ...]) -> Array:
        """Return the matrix of `inverse_laplacian` from coefficients of total degree n to those of
        n + 2."""
        d, unit = len(self.half), self.half.min()
        half = self.half / unit
        given, wanted = total_degrees(n, d), total_degrees(n + 2, d)
        slope = np.pad(chebyshev.chebder(np.eye(n + 3)), ((0, 1), (0, 0)))
        size = 1.0 / (1.0 + np.sum((wanted / half[:, None]) ** 2, axis=0))
        laplacian = _laplacian(given, wanted, slope @ slope, half)
        # columns of q: particular ones, and what has no Laplacian
        q, r = scipy.linalg.qr((laplacian * size).T)
        particular, harmonic = np.split(q, [len(laplacian)], axis=1)
        steep = np.vstack([*self._steepness(wanted, slope, orders)]) * size
        left = np.linalg.lstsq(steep @ harmonic, steep @ particular, rcond=None)[0]
        particular = particular - harmonic @ left
        inverse = scipy.linalg.solve_triangular(r[: len(laplacian)], particular.T).T
        inverse = size[:, None] * inverse
        # one step of refinement, for bodies that are thin
        return np.asarray(
            unit**2 * (inverse + inverse @ (np.eye(len(laplacian)) - laplacian @ inverse))
        )

    def _steepness(self, wanted: Index, slope: Array, orders: tuple[int, ...]) -> Iterator[Array]:
        """Yield rows of what `_inverse` makes least, for polynomials of degrees `wanted`: the mean,
        which derivatives leave open, and all derivatives of an order together, which turn with the
        axes."""
        unit = self.half.min()
        tables = [chebyshev.chebvander(xi, len(slope) - 1) for xi in self.samples.T]
        for times in total_degrees(max(orders), len(self.half)).T:
            if (order := int(times.sum())) in (0, *orders):
                values = _derivative(tables, times, slope, self.half / unit, wanted)
                ways = math.factorial(order) / math.prod(map(math.factorial, times))
                share = np.sqrt(ways * self.weight)[:, None] * (self.radius / unit) ** (order - 1)
                yield share * values if order in orders else self.weight[None] @ values

    def integral_of_strain(self, p: Array) -> list[Array]:
        """u whose strain is p I, by the components along the axes, for p that are linear or, in the
        plane, harmonic.

        E. Cesàro's line integral from the centre, u = ∫ (p x + (1-s) ((x·grad p) x - r² grad p))
        ds, p at s x.
        """
        d, m = p.ndim, degree(p)
        line = np.cos(np.pi * (np.arange(m + 2) + 0.5) / (m + 2))
        x = np.stack(np.meshgrid(*(h * line for h in self.half), indexing="ij"))
        slopes, u = [self.derivative(p, axis) for axis in range(d)], np.zeros_like(x)
        for s, weight in zip(*legendre.leggauss(m // 2 + 2), strict=True):
            basis = chebyshev.chebvander(0.5 * (1.0 + s) * line, len(p) - 1)
            slope = np.stack([_along_axes(basis, component) for component in slopes])
            turned = np.sum(x * slope, axis=0) * x - np.sum(x * x, axis=0) * slope
            u += 0.5 * weight * (_along_axes(basis, p) * x + 0.5 * (1.0 - s) * turned)
        # coefficients from values at the points where Chebyshev polynomials are orthogonal
        back = chebyshev.chebvander(line, m + 1).T / (0.5 * (m + 2))
        back[0] *= 0.5
        return [padded(up_to(_along_axes(back, component), m + 1), len(p)) for component in u]


def _laplacian(given: Index, wanted: Index, curvature: Array, half: Array) -> Array:
    """Return the matrix of the Laplacian from coefficients of the degrees `wanted` to those of the
    degrees `given`, (d, n) each, in units of `half`."""
    result = np.zeros((given.shape[1], wanted.shape[1]))
    for axis, h in enumerate(half):
        others = [k for k in range(len(half)) if k != axis]
        same = np.all(given[others][:, :, None] == wanted[others][:, None], axis=0)
        result += same * curvature[np.ix_(given[axis], wanted[axis])] / h**2
    return result


def _derivative(
    tables: Sequence[Array], times: Index, slope: Array, half: Array, wanted: Index
) -> Array:
    """Return a derivative, so many times along each axis, of the polynomials of degrees `wanted` at
    the nodes whose Chebyshev polynomials `tables` has."""
    along = [
        (table @ np.linalg.matrix_power(slope, k) / h**k)[:, number]
        for table, k, h, number in zip(tables, times, half, wanted, strict=True)
    ]
    return np.asarray(np.prod(along, axis=0))


def _along_axes(matrix: Array, p: Array) -> Array:
    """The matrix times p along each axis."""
    for axis in range(p.ndim):
        p = np.moveaxis(np.tensordot(matrix, p, (1, axis)), 0, axis)
    return p


def values(p: Array, xi: Array) -> Array:
    """Values (m,) at ξ (m, d), by Clenshaw's rule along each axis."""
    result = p[..., None]
    for along in xi.T:
        result = chebyshev.chebval(along, result, tensor=False)
    return result
