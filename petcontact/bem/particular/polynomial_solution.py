"""A polynomial displacement that is in equilibrium with a polynomial force and temperature in a
volume."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...arrays import Array
from ...given.tables.material import Material
from .polynomials import degree, padded, up_to, values

STRESS_FREE = {2: np.inf, 3: 1}
"""Degrees up to which a harmonic temperature strains a free body without stress, by the number of
dimensions."""


@dataclass(frozen=True, eq=False)
class ParticularSolution:
    """u and σ of Navier's equations μ lap u + (λ+μ) grad div u + b - β grad T = 0, σ = 2μ ε + (λ
    div u - βT) I.

    Attributes
    ----------
    material : Material
    box : BodyBox or RingBox
        In which the polynomials are.
    u, free : (d, D+1, ...) arrays
        With stress and without, along the axes of the box [length].
    temperature, straining : (D+1, ...) arrays
        The whole, and what `u` belongs to.
    """

    material: Material
    box: Any
    u: Array
    free: Array
    temperature: Array
    straining: Array

    def displacement(self, x: Array) -> Array:
        """At points (m, d), (m, d) [length]."""
        xi = self.box.local(x)
        along = np.stack([values(component, xi) for component in self.u + self.free], axis=1)
        return np.asarray(along @ self.box.axes)

    def stress(self, x: Array) -> Array:
        """At points (m, d), (m, d, d) [stress]."""
        xi, d = self.box.local(x), len(self.u)
        result = np.empty((len(x), d, d))
        for (i, j), component in self._stress.items():
            result[:, i, j] = result[:, j, i] = values(component, xi)
        return np.asarray(self.box.axes.T @ result @ self.box.axes)

    def thermal_stress(self, x: Array) -> Array:
        """βT at points (m, d), (m,) [stress]."""
        return self.material.thermal_stress * values(self.temperature, self.box.local(x))

    @functools.cached_property
    def _stress(self) -> dict[tuple[int, int], Array]:
        """Polynomials of σ_ij along the axes of the box, i <= j."""
        mu, ratio, d = self.material.shear_modulus, self.material.plane_strain_ratio, len(self.u)
        du = [[self.box.derivative(self.u[i], j) for j in range(d)] for i in range(d)]
        even = 2.0 * mu * ratio / (1.0 - 2.0 * ratio) * sum(du[i][i] for i in range(d))
        even = even - self.material.thermal_stress * self.straining
        return {
            (i, j): mu * (du[i][j] + du[j][i]) + (even if i == j else 0.0)
            for i in range(d)
            for j in range(i, d)
        }


@functools.singledispatch
def particular_solution(
    box: Any, force: list[Array], temperature: Array, material: Material
) -> ParticularSolution:
    """A particular solution for polynomials on the box around a body.

    Of the force it is Galerkin's, 2μ u = 2(1-ν) lap F - grad div F with lap lap F = -b/(1-ν); of a
    temperature that leaves a free body without stress (linear; in the plane harmonic) it is that
    strain; of the rest of it grad Φ with (λ+2μ) lap Φ = βT. Harmonic parts of F and Φ are such that
    its stresses are about as large as the loads make them.

    Parameters
    ----------
    box : BodyBox
    force : d arrays
        b along the axes of the box [force/volume].
    temperature : array
        T.
    material : Material
    """
    d, mu, ratio = len(force), material.shear_modulus, material.plane_strain_ratio
    size = 5 + max(degree(p) for p in (*force, temperature))
    heat = padded(temperature, size)
    # lap F, then div F
    h = [box.inverse_laplacian(padded(b, size) / (ratio - 1.0)) for b in force]
    div = np.asarray(
        sum(box.derivative(box.inverse_laplacian(component), i) for i, component in enumerate(h))
    )
    u = np.array(
        [
            (2.0 * (1.0 - ratio) * component - box.derivative(div, i)) / (2.0 * mu)
            for i, component in enumerate(h)
        ]
    )
    scale = material.thermal_stress * (1.0 - 2.0 * ratio) / (2.0 * mu)
    harmonic = up_to(heat - box.inverse_laplacian(box.laplacian(heat), (1,)), STRESS_FREE[d])
    phi = box.inverse_laplacian(heat - harmonic)
    u += scale / (1.0 - ratio) * np.array([box.derivative(phi, i) for i in range(d)])
    free = scale / (1.0 + (d - 2.0) * ratio) * np.array(box.integral_of_strain(harmonic))
    return ParticularSolution(material, box, u, free, heat, heat - harmonic)
