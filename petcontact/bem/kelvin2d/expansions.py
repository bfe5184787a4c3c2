"""Displacement and stress of a group of elements far from it, by the series of its complex
potentials.

With Goursat's potentials about the group's centre c, z = y - c (κ = 3-4ν, units in which 2µ = 1):

    u = κφ - z φ̄' - χ̄,    σ_xx + σ_yy = 4 Re φ',    (σ_xx - σ_yy)/2 - iσ_xy = -(z̄ φ'' + χ')

Somigliana's identity gives, t, u and s = x - c complex at x, ζ = s - z and C = 1/(4π(1-ν)),

    φ' =  C/2 ∫ t ds/ζ - iC/2 ∫ u dx/ζ²
    χ' = -C/2 ∫ (κ t̄ ds/ζ + s̄ t ds/ζ²) - iC/2 ∫ ((u dx̄ - ū dx)/ζ² - 2 s̄ u dx/ζ³)

and 1/ζ = -Σ s^k z^(-k-1) turns both into Laurent series; the free constant of u is C ∫ t ds (κ ln ℓ
+ ½).
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array, Complex
from ...mesh.basis import gauss, lagrange
from ...mesh.elements import Elements
from ...mesh.pairs.intersections import Curves
from ...record import record
from .kernel import Kelvin2D

TERMS = 44
POINTS, FEWER, SMALL = 32, 12, 1.0 / 32.0
"""Gauss points an element: the moments are polynomials of degree TERMS on a group that is one
straight element. Of elements that are `SMALL` beside the radius of their group, terms of degree n
are below binomial(44, n) / 32^n: 3e-17 for n = 19, so that `FEWER` points do for densities of order
5."""


@record
class Expansion:
    """The field of one group of elements.

    Attributes
    ----------
    centre : complex
    radius : float
        Of a disk about the centre with all elements inside [length].
    rate, other, winding : (TERMS,) arrays
        Coefficients of z^(-k-1) in φ', χ' and ∫ dx/ζ, lengths in radii.
    constant : complex
    factor : float
        κ.
    unit_length : float
        Of the kernel [length].
    """

    centre: complex
    radius: float
    rate: Complex
    other: Complex
    winding: Complex
    constant: complex
    factor: float
    unit_length: float

    def near(self, points: Array) -> Array:
        """Return which points (m, 2) are too near for `at`, (m,)."""
        # beyond 2.5 radii TERMS terms of the series are exact to 1e-14
        return np.asarray(
            np.abs(points[:, 0] + 1j * points[:, 1] - self.centre) < 2.5 * self.radius
        )

    def fields_at(self, points: Array) -> tuple[Array, Array, Array]:
        """Return displacement (m, 2), stress over `traction_scale` (m, 3), and how often the group
        winds round each point (m,)."""
        z: Complex = (points[:, 0] + 1j * points[:, 1] - self.centre) / self.radius
        k = np.arange(TERMS)
        powers = np.empty((TERMS, len(z)), dtype=np.complex128)
        np.divide(1.0, z, out=powers[0])
        for i in range(1, TERMS):
            np.multiply(powers[i - 1], powers[0], out=powers[i])
        # the antiderivatives but for their logarithms, and the derivative of φ'
        integral = [-np.append(series[1:] / k[1:], 0.0) for series in (self.rate, self.other)]
        columns = np.stack([self.rate, self.other, self.winding, *integral, -(k + 1) * self.rate])
        rate, conjugate_part, winding, phi, chi, second = columns @ powers
        log = np.log(np.abs(self.radius * z))
        u = self.radius * (self.factor * phi - z * rate.conj() - chi.conj()) + self.constant
        u += 2.0 * self.radius * self.factor * self.rate[0] * log
        mean = 2.0 * rate.real
        deviator = -(z.conj() * powers[0] * second + conjugate_part)
        stress = np.stack([mean + deviator.real, mean - deviator.real, -deviator.imag], axis=1)
        return (
            np.stack([u.real, u.imag], axis=1),
            self.unit_length * stress,
            winding.imag / (2.0 * np.pi),
        )


def _quadrature(elements: Elements, ends: Array) -> tuple[Complex, Complex, Array, Array]:
    """Gauss points of all elements, the first of each before the second ones, dx/ds there, and the
    rule (q,) and its weights."""
    curves, count = Curves(elements.start, elements.end, elements.curvature), len(elements.index)
    small = float(curves.length.max()) < SMALL * float(np.ptp(ends, axis=0).max())
    rule, weight = gauss((FEWER if small else POINTS) - 1)
    number = np.tile(np.arange(count), len(rule))
    x, normal = curves.at(number, np.repeat(0.5 * (1.0 + rule), count))
    along = 0.5 * curves.length[number] * (normal @ [1j, -1.0])
    return x @ [1.0, 1j], along, rule, weight


def expansion(kernel: Kelvin2D, elements: Elements, u: Array, scaled: Array) -> Expansion:
    """Return the field of some elements of one kind.

    Parameters
    ----------
    kernel : Kelvin2D
    elements : Elements
        Straight and bent.
    u, scaled : (n(p+1), 2) arrays
        Displacement [length] at their nodes, and traction over the kernel's `traction_scale`
        [length].
    """
    order = elements.order
    ends = np.concatenate([elements.start, elements.end])
    x, dx, rule, gauss_weight = _quadrature(elements, ends)
    product = lagrange(order, rule) * gauss_weight
    # values at the points, times the weights
    u_x, t = (
        np.einsum(
            "bq,nb->qn", product, (values[:, 0] + 1j * values[:, 1]).reshape(-1, order + 1)
        ).ravel()
        for values in (u, scaled / kernel.unit_length)
    )
    centre = complex(*(0.5 * (ends.min(axis=0) + ends.max(axis=0))))
    around = np.hypot(*(ends - [centre.real, centre.imag]).T)
    radius = float(max(np.abs(x - centre).max(), around.max()))
    weight = np.repeat(gauss_weight, len(elements.index))
    moments = _moments((x - centre) / radius, dx / radius, weight, u_x, t)
    return _series(kernel, centre, radius, moments)


def _moments(s: Complex, dx: Complex, weight: Array, u_x: Complex, t: Complex) -> Complex:
    """Return the sums of densities times s^0, s^1 ..., (7, TERMS); s and dx are over the radius."""
    ds = np.abs(dx)
    densities = np.stack(
        [
            t * ds,
            t.conj() * ds,
            s.conj() * t * ds,
            u_x * dx,
            u_x * dx.conj() - u_x.conj() * dx,
            s.conj() * u_x * dx,
            weight * dx,
        ]
    )
    moments = np.empty((len(densities), TERMS), dtype=np.complex128)
    power = np.ones_like(s)
    for i in range(TERMS):
        moments[:, i] = densities @ power
        power = power * s
    return moments


def _series(kernel: Kelvin2D, centre: complex, radius: float, moments: Complex) -> Expansion:
    """Return the coefficients that follow from the moments of the densities (module)."""
    k = np.arange(TERMS)
    single, conjugate, lifted, double, other_double, lifted_double, winding = moments
    ratio = kernel.material.plane_strain_ratio
    scale, factor = 1.0 / (4.0 * np.pi * (1.0 - ratio)), 3.0 - 4.0 * ratio

    def squared(series: Complex) -> Complex:
        """Coefficients of ∫ density/ζ², from the moments of the density."""
        return np.append(0.0, k[1:] * series[:-1])

    def cubed(series: Complex) -> Complex:
        return np.concatenate([[0.0, 0.0], -0.5 * k[1:-1] * k[2:] * series[:-2]])

    rate = -0.5 * scale * single - 0.5j * scale * squared(double) / radius
    second = 0.5 * scale * (factor * conjugate - squared(lifted))
    second = second - 0.5j * scale * (squared(other_double) - 2.0 * cubed(lifted_double)) / radius
    constant = scale * radius * single[0] * (factor * np.log(kernel.unit_length) + 0.5)
    return Expansion(
        centre, radius, rate, second, -winding, complex(constant), factor, kernel.unit_length
    )
