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


def exact(x, material=STEEL):
    """A field from Kolosov's formulas with φ = z³ + (1+2i)z², ψ = 2z²: displacement and σ_xx, σ_yy,
    σ_xy."""
    nu, mu = material.plane_strain_ratio, material.shear_modulus
    z = x[:, 0] + 1j * x[:, 1]
    phi, slope, bend = z**3 + (1 + 2j) * z**2, 3 * z**2 + 2 * (1 + 2j) * z, 6 * z + 2 * (1 + 2j)
    u = ((3 - 4 * nu) * phi - z * slope.conj() - 2 * z.conj() ** 2) / (2 * mu)
    total, difference = 4 * slope.real, 2 * (z.conj() * bend + 4 * z)
    stress = [
        0.5 * (total - difference.real),
        0.5 * (total + difference.real),
        0.5 * difference.imag,
    ]
    return np.column_stack([u.real, u.imag]), np.column_stack(stress)


def boundary_data(mesh, material=STEEL):
    u, s = exact(mesh.x, material)
    n = mesh.normal
    return u, np.column_stack(
        [s[:, 0] * n[:, 0] + s[:, 2] * n[:, 1], s[:, 2] * n[:, 0] + s[:, 1] * n[:, 1]]
    )


def meshed(body=BODY, **options):
    return mesh_outline(body.outline(), MeshOptions(**options))
