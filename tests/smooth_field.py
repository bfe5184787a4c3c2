"""A body with an arc, a hole and corners, and a smooth elastic field in it, by Kolosov's
formulas."""

from __future__ import annotations

import numpy as np

from petcontact import Circle, Material, MeshOptions, SideBySide
from petcontact.mesh.grading import mesh_outline

STEEL = Material(young_modulus=200.0, poisson_ratio=0.3)
TOE = (
    {"part": "toe", "to": (1, 0), "radius": 1.0},
    {"part": "bottom", "to": (4, 0)},
    {"part": "right", "to": (4, 2)},
    {"part": "top", "to": (0, 2)},
    {"part": "left", "to": (0, 1)},
)
BODY = SideBySide(loops=(TOE, Circle(part="hole", center=(2, 1), radius=0.4)))


def kolosov(z, phi, psi, material=STEEL):
    """Displacement (n, 2) and σ_xx, σ_yy, σ_xy (n, 3) at z = x + iy of potentials, given with their
    derivatives: φ, φ', φ'' and ψ, ψ'."""
    nu, mu = material.plane_strain_ratio, material.shear_modulus
    (value, slope, bend), (other, other_slope) = phi, psi
    u = ((3 - 4 * nu) * value - z * slope.conj() - other.conj()) / (2 * mu)
    total, difference = 4 * slope.real, 2 * (z.conj() * bend + other_slope)
    xx, yy = 0.5 * (total - difference.real), 0.5 * (total + difference.real)
    return np.column_stack([u.real, u.imag]), np.column_stack([xx, yy, 0.5 * difference.imag])


def pull(stress, normal):
    """Tractions (n, 2) of stresses (n, 3) on faces with normals (n, 2)."""
    (xx, yy, xy), (nx, ny) = stress.T, normal.T
    return np.column_stack([xx * nx + xy * ny, xy * nx + yy * ny])


def exact(x, material=STEEL):
    """The field of φ = z³ + (1+2i)z², ψ = 2z²."""
    z = x[:, 0] + 1j * x[:, 1]
    phi = z**3 + (1 + 2j) * z**2, 3 * z**2 + 2 * (1 + 2j) * z, 6 * z + 2 * (1 + 2j)
    return kolosov(z, phi, (2 * z**2, 4 * z), material)


def boundary_data(mesh, material=STEEL):
    u, stress = exact(mesh.x, material)
    return u, pull(stress, mesh.normal)


def meshed(body=BODY, **options):
    return mesh_outline(body.outline(), MeshOptions(**options))
