"""A displacement that is in equilibrium with a force and a temperature in a body of revolution.

Both are polynomials in r and z, of odd powers of r too: cones of temperature are loads as any. With
L_k = ∂²/∂r² + ∂/r∂r - k²/r² + ∂²/∂z², L_k (r^(m+2) z^n) = ((m+2)² - k²) r^m z^n + n(n-1) r^(m+2)
z^(n-2), so that a polynomial q with L_k q = p follows from the highest power of z down. To it
polynomials with L_k q = 0 are added, one a degree, so that it is small on the boundary.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.polynomial import chebyshev
from numpy.polynomial.polynomial import polyder, polyfit, polyval2d

from ...arrays import Array
from ...given.tables.material import Material
from ...mesh.boundary_mesh import BoundaryMesh
from ...round_off import TINY
from .polynomial_solution import ParticularSolution, particular_solution
from .polynomials import SAMPLES, degree, extent, padded, spread_over

MORE = 6
"""Degrees of harmonic polynomials above that of what they are added to, where a load is no
polynomial. The harmonic function that makes a solution smallest is none of its degree. Three fits
of degree 12 to one warm spot (2.5 exp(-2 R²) in a cylinder of 1.9 by 1.6) had steepnesses of 4.3,
4.3 and 3.4. With 6 more they had 3.9, 3.4 and 3.3, as with 20."""


@dataclass(frozen=True, eq=False)
class RingBox:
    """Coordinates ξ = (r, z - z_0)/ℓ in which a body of revolution lies in [0, 1] x [-1, 1].

    Attributes
    ----------
    low, high : (2,) arrays
        Corners of the box around the half section [length].
    samples, weight : (n, 2), (n,) arrays
        Points all over the boundary [length], and their shares of it.
    """

    low: Array
    high: Array
    samples: Array
    weight: Array
    axes: ClassVar[Array] = np.eye(2)
    highest: ClassVar[int] = 12

    @classmethod
    def around(cls, mesh: BoundaryMesh) -> RingBox:
        """Return the box of the boundary."""
        return cls(*extent(mesh, np.eye(2)), *spread_over(mesh, SAMPLES))

    @property
    def centre(self) -> Array:
        """(0, z_0) [length]."""
        return np.array([0.0, 0.5 * (self.low[1] + self.high[1])])

    @property
    def half(self) -> Array:
        """(ℓ, ℓ) [length]."""
        return np.full(2, max(self.high[0], 0.5 * (self.high[1] - self.low[1])))

    def across(self, axis: object) -> Array:
        """The part of a vector across the axis, (2, 2)."""
        return np.diag([1.0, 0.0])

    def local(self, x: Array) -> Array:
        """ξ (m, 2) at x (m, 2)."""
        return (x - self.centre) / self.half

    def grid(self, line: Array) -> Array:
        """Points (n², 2) of the box by n places in [-1, 1] along each axis."""
        points = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
        return np.asarray(self.low + 0.5 * (1.0 + points) * (self.high - self.low))


@dataclass(frozen=True, eq=False)
class RingSolution(ParticularSolution):
    """As `ParticularSolution`, in (r, z); coefficients are those of powers of ξ."""

    def displacement(self, x: Array) -> Array:
        """At points (m, 2), (m, 2) [length]."""
        return np.stack([self._at(x, component) for component in self.u + self.free], axis=1)

    def stress(self, x: Array) -> Array:
        """rr, zz, rz at points (m, 2), as (m, 2, 2) [stress]."""
        mu, nu, size = self.material.shear_modulus, self.material.poisson_ratio, self.box.half[0]
        (rr, rz), (zr, zz) = ((_slope(c, 0) / size, _slope(c, 1) / size) for c in self.u)
        trace = rr + zz + _over_r(self.u[0]) / size
        even = 2.0 * mu * nu / (1.0 - 2.0 * nu) * trace
        even = even - self.material.thermal_stress * self.straining
        stress = np.empty((len(x), 2, 2))
        stress[:, 0, 0] = self._at(x, 2.0 * mu * rr + even)
        stress[:, 1, 1] = self._at(x, 2.0 * mu * zz + even)
        stress[:, 0, 1] = stress[:, 1, 0] = self._at(x, mu * (rz + zr))
        return stress

    def thermal_stress(self, x: Array) -> Array:
        """βT at points (m, 2), (m,) [stress]."""
        return self.material.thermal_stress * self._at(x, self.temperature)

    def _at(self, x: Array, p: Array) -> Array:
        xi = self.box.local(x)
        return np.asarray(polyval2d(xi[:, 0], xi[:, 1], p))


@particular_solution.register
def ring_solution(
    box: RingBox, force: list[Array], temperature: Array, material: Material
) -> RingSolution:
    """As `particular_solution`: Galerkin's for the force, grad Φ for the temperature, but for a
    linear one in z, the nearest on the boundary, which leaves a free body without stress."""
    size = max(degree(p) for p in (*force, temperature))
    # what is a polynomial has lower degrees, and a solution that elements follow
    more = MORE if size == box.highest else 0
    size += 6 + 2 * more
    b_r, b_z, heat = (_powers(p, size) for p in (*force, temperature))
    expansion = material.thermal_stress * (1.0 - 2.0 * material.poisson_ratio)
    expansion *= box.half[0] / (2.0 * material.shear_modulus)
    inverse = functools.partial(_inverse, box=box, more=more)
    rest = heat - _linear(heat, box)
    free = expansion / (1.0 + material.poisson_ratio) * _freely(heat - rest)
    u = _galerkin(b_r, b_z, material, box.half[0], inverse)
    phi = expansion / (1.0 - material.poisson_ratio) * inverse(rest, 0)
    u = [part + _slope(phi, axis) for axis, part in enumerate(u)]
    return RingSolution(material, box, np.array(u), free, heat, rest)


def _galerkin(
    b_r: Array,
    b_z: Array,
    material: Material,
    length: float,
    inverse: Callable[[Array, int], Array],
) -> list[Array]:
    """2µ u = 2(1-ν) lap F - grad div F of a force, with lap lap F = -b/(1-ν)."""
    nu = material.poisson_ratio
    h = [length**2 / (nu - 1.0) * inverse(b, k) for b, k in ((b_r, 1), (b_z, 0))]
    f_r, f_z = inverse(h[0], 1), inverse(h[1], 0)
    div = _slope(f_r, 0) + _over_r(f_r) + _slope(f_z, 1)
    return [
        (2.0 * (1.0 - nu) * part - _slope(div, axis)) / (2.0 * material.shear_modulus)
        for axis, part in enumerate(h)
    ]


def _linear(heat: Array, box: RingBox) -> Array:
    """The polynomial of the terms 1 and z that is nearest to a temperature on the boundary."""
    result, (r, z) = np.zeros_like(heat), box.local(box.samples).T
    result[0, :2] = polyfit(z, polyval2d(r, z, heat), 1, w=np.sqrt(box.weight))
    return result


def _freely(heat: Array) -> Array:
    """u over αℓ for the terms 1 and z of a temperature, whose strain is free of stress."""
    u = np.zeros((2, *heat.shape))
    u[0, 1, :2] = heat[0, :2]
    u[1, 0, 1], u[1, 0, 2], u[1, 2, 0] = heat[0, 0], 0.5 * heat[0, 1], -0.5 * heat[0, 1]
    return u


def _powers(p: Array, size: int) -> Array:
    """Coefficients (size, size) of powers from those of Chebyshev polynomials."""
    powers = np.array([padded(chebyshev.cheb2poly(unit), size) for unit in np.eye(len(p))])
    return np.asarray(powers.T @ p @ powers)


def _slope(p: Array, axis: int) -> Array:
    """Return the derivative by ξ along an axis."""
    return padded(polyder(p, axis=axis), len(p))


def _over_r(p: Array) -> Array:
    """Return p over r for p that are 0 on the axis."""
    return padded(p[1:], len(p))


def _inverse(p: Array, k: int, box: RingBox, more: int) -> Array:
    """Return q with L_k q = p; of all these, up to so many more degrees, that with the smallest
    first and second derivatives on the boundary, see `BodyBox.inverse_laplacian`."""
    q = _one_inverse(p, k)
    if not p.any():
        return q
    # r^k z^j less what its Laplacian, j (j - 1) r^k z^(j-2), is that of
    harmonic = []
    for j in range(degree(q) + 1 - k + more):
        one, bent = np.zeros_like(p), np.zeros_like(p)
        one[k, j], bent[k, max(j - 2, 0)] = 1.0, j * (j - 1.0)
        harmonic.append(one - _one_inverse(bent, k))
    steep = np.column_stack([_steepness(each, box) for each in harmonic])
    lengths = np.maximum(np.linalg.norm(steep, axis=0), TINY)
    share = np.linalg.lstsq(steep / lengths, _steepness(q, box), rcond=None)[0] / lengths
    return np.asarray(q - np.tensordot(share, harmonic, 1))


def _steepness(p: Array, box: RingBox) -> Array:
    """First and second derivatives on the boundary, one after another, so that the squares sum to
    their means."""
    xi, share = box.local(box.samples), np.sqrt(box.weight)
    first = [_slope(p, axis) for axis in (0, 1)]
    every = [*first, *(_slope(each, axis) for each in first for axis in (0, 1))]
    return np.concatenate([share * polyval2d(xi[:, 0], xi[:, 1], each) for each in every])


def _one_inverse(p: Array, k: int) -> Array:
    """Return one q with L_k q = p."""
    left, q = p.copy(), np.zeros_like(p)
    power = np.arange(2, len(p))
    for n in range(len(p) - 1, -1, -1):
        coefficients = left[:-2, n] / (power**2 - k**2)
        q[2:, n] += coefficients
        if n > 1:
            left[2:, n - 2] -= n * (n - 1) * coefficients
    return q
