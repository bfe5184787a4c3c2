"""A displacement that is in equilibrium with a polynomial force and temperature in a volume, a polynomial itself."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np

from ...arrays import Array
from ...model.problem import Material
from .polynomials import degrees, derivative, inverse_laplacian, laplacian, padded, times, times_square, values

STRESS_FREE = {2: np.inf, 3: 1}
"""Degrees up to which a harmonic temperature strains a free body without stress, by the number of dimensions."""


@dataclass(frozen=True, eq=False)
class ParticularSolution:
    """u and σ of Navier's equations μ lap u + (λ+μ) grad div u + b - β grad T = 0, σ = 2μ ε + (λ div u - βT) I.

    Attributes
    ----------
    material : Material
    centre : (d,) array
        Polynomials are in ξ = (x - centre)/length.
    length : float
    u : (d, D+1, ...) array
        [length]
    temperature : (D+1, ...) array
    """

    material: Material
    centre: Array
    length: float
    u: Array
    temperature: Array

    def displacement(self, x: Array) -> Array:
        """At points (m, d), (m, d) [length]."""
        xi = (x - self.centre) / self.length
        return np.stack([values(component, xi) for component in self.u], axis=1)

    def stress(self, x: Array) -> Array:
        """At points (m, d), (m, d, d) [stress]."""
        xi, d = (x - self.centre) / self.length, len(self.u)
        result = np.empty((len(x), d, d))
        for (i, j), component in self._stress.items():
            result[:, i, j] = result[:, j, i] = values(component, xi)
        return result

    def thermal_stress(self, x: Array) -> Array:
        """βT at points (m, d), (m,) [stress]."""
        return self.material.thermal_stress * values(self.temperature, (x - self.centre) / self.length)

    @functools.cached_property
    def _stress(self) -> dict[tuple[int, int], Array]:
        """Polynomials of σ_ij, i <= j."""
        mu, ratio, d = self.material.shear_modulus, self.material.plane_strain_ratio, len(self.u)
        du = [[derivative(self.u[i], j) / self.length for j in range(d)] for i in range(d)]
        even = 2.0 * mu * ratio / (1.0 - 2.0 * ratio) * sum(du[i][i] for i in range(d))
        even = even - self.material.thermal_stress * self.temperature
        return {(i, j): mu * (du[i][j] + du[j][i]) + (even if i == j else 0.0) for i in range(d) for j in range(i, d)}


def particular_solution(
    force: list[Array], temperature: Array, material: Material, centre: Array, length: float
) -> ParticularSolution:
    """A particular solution for polynomials in ξ = (x - centre)/length.

    Of the force it is Galerkin's, 2μ u = 2(1-ν) lap F - grad div F with lap lap F = -b/(1-ν); of a temperature that leaves a
    free body without stress (linear; in the plane harmonic) it is that strain; of the rest of it grad Φ with
    (λ+2μ) lap Φ = βT.

    Parameters
    ----------
    force : d arrays
        b [force/volume].
    temperature : array
        T.
    material : Material
    centre : (d,) array
    length : float
    """
    d, mu, ratio = len(force), material.shear_modulus, material.plane_strain_ratio
    size = 5 + max(int(degrees(p)[p != 0.0].max(initial=0)) for p in (*force, temperature))
    heat = padded(temperature, size)
    # F and lap F, of b in ξ
    h = [inverse_laplacian(padded(b, size) * (-(length**2) / (1.0 - ratio))) for b in force]
    div = np.asarray(sum(derivative(inverse_laplacian(component), i) for i, component in enumerate(h)))
    u = np.array([(2.0 * (1.0 - ratio) * component - derivative(div, i)) / (2.0 * mu) for i, component in enumerate(h)])
    scale = length * material.thermal_stress * (1.0 - 2.0 * ratio) / (2.0 * mu)
    harmonic = np.where(degrees(heat) <= STRESS_FREE[d], heat - inverse_laplacian(laplacian(heat)), 0.0)
    phi = inverse_laplacian(heat - harmonic)
    # of degree m: (2x T - r² grad T / m)/(m + 1), of degree 0 x T, whose strain is T I
    m = degrees(heat)
    over = harmonic / (m + 1.0)
    for i in range(d):
        free = times(np.where(m == 0, 1.0, 2.0) * over, i) - times_square(derivative(over / np.maximum(m, 1), i))
        u[i] += scale * (derivative(phi, i) / (1.0 - ratio) + free / (1.0 + (d - 2.0) * ratio))
    return ParticularSolution(material, centre, length, u, heat)
