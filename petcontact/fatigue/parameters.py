"""Fatigue parameters of stress histories at points: one function and one line of the table each.

All take the stress at the moments of a cycle, in three dimensions, and the material's constants;
they know nothing of bodies, meshes or contact.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..arrays import Array
from ..given.tables.material import Material
from .planes import critical_planes
from .smallest_ball import smallest_ball

Values = tuple[Array, Array | None]
"""A parameter at n points (n,) [stress], and the normals (n, 3) of the critical planes; None where
a parameter has none."""
Parameter = Callable[[Array, Material, float], Values]
"""A function of the stress (k, n, 3, 3) [stress], the material and the sensitivity. This is k of
Findley, or α of Crossland and Dang Van: the weight of normal or hydrostatic stress [-]."""


def smith_watson_topper(stress: Array, material: Material, sensitivity: float) -> Values:
    """Largest over planes of σ_n,max Δε_n/2, 0 where nothing opens (Smith, Watson, Topper 1970;
    Szolwinski, Farris 1996).

    ε_n is the elastic strain across the plane, ((1+ν)σ_n - ν tr σ)/E. Under uniaxial stress it is
    σ_max σ_a/E.

    Examples
    --------
    >>> cycle = np.zeros((2, 1, 3, 3))
    >>> cycle[:, 0, 0, 0] = 300.0, -100.0
    >>> damage = smith_watson_topper(cycle, Constants(200e3, 0.3))
    >>> round(float(damage.value[0]), 6), damage.normal[0].round(3).tolist()
    (0.3, [1.0, 0.0, 0.0])
    """
    e, nu = material.young_modulus, material.poisson_ratio

    def value(stress: Array, normal: Array) -> Array:
        across, _ = on_planes(stress, normal)
        strain = ((1.0 + nu) * across - nu * np.trace(stress, axis1=2, axis2=3)[:, :, None]) / e
        amplitude = 0.5 * (strain.max(axis=0) - strain.min(axis=0))
        return np.asarray(np.maximum(across.max(axis=0), 0.0) * amplitude)

    return critical_planes(stress, value)


def findley(stress: Array, material: Material, sensitivity: float) -> Values:
    """Largest over planes of τ_a + k σ_n,max (Findley 1959), τ_a the radius of the smallest circle
    round the shear's path.

    Under σ_a cos ωt it is σ_a/2 (k + √(1 + k²)).
    """

    def value(stress: Array, normal: Array) -> Array:
        across, shear = on_planes(stress, normal)
        amplitude = smallest_ball(np.moveaxis(shear, 0, 2))[1]
        return np.asarray(amplitude + sensitivity * across.max(axis=0))

    return critical_planes(stress, value)


def crossland(stress: Array, material: Material, sensitivity: float) -> Values:
    """√J2,a + α σ_H,max (Crossland 1956): half the diameter of the deviator's path in the norm
    √(s:s/2), and the largest hydrostatic stress tr σ/3. Under σ_a cos ωt it is σ_a (1/√3 + α/3)."""
    _, radius = smallest_ball(_vectors(deviator(stress)))
    return np.asarray(radius / np.sqrt(2.0) + sensitivity * hydrostatic(stress).max(axis=0)), None


def dang_van(stress: Array, material: Material, sensitivity: float) -> Values:
    """Largest over the cycle of τ(t) + α σ_H(t) (Dang Van 1973): τ is half the difference of the
    largest and the smallest principal value of the deviator less the middle of the smallest ball
    round its path, the stress that grains shake down to. Under σ_a cos ωt it is σ_a (1/2 + α/3)."""
    parts = deviator(stress)
    middle = _tensor(smallest_ball(_vectors(parts))[0])
    principal = np.linalg.eigvalsh(parts - middle)
    shear = 0.5 * (principal[..., 2] - principal[..., 0])
    return np.asarray((shear + sensitivity * hydrostatic(stress)).max(axis=0)), None


PARAMETERS: dict[str, tuple[Parameter, bool]] = {
    "smith-watson-topper": (smith_watson_topper, False),
    "findley": (findley, True),
    "crossland": (crossland, True),
    "dang-van": (dang_van, True),
}
"""By the name in the command: the function, and whether it has a sensitivity."""


def on_planes(stress: Array, normal: Array) -> tuple[Array, Array]:
    """Normal stress (k, n, q) and shear vectors (k, n, q, 3) of stress (k, n, 3, 3) on planes with
    normals (n, q, 3)."""
    traction = np.einsum("knij,nqj->knqi", stress, normal, optimize=True)
    across = np.einsum("knqi,nqi->knq", traction, normal)
    return across, traction - across[..., None] * normal


def hydrostatic(stress: Array) -> Array:
    """tr σ/3 of tensors (..., 3, 3)."""
    return np.asarray(np.trace(stress, axis1=-2, axis2=-1) / 3.0)


def deviator(stress: Array) -> Array:
    """σ - tr σ/3 I."""
    return np.asarray(stress - hydrostatic(stress)[..., None, None] * np.eye(3))


def _vectors(tensor: Array) -> Array:
    """Symmetric tensors (k, n, 3, 3) as paths (n, k, 6) of vectors with the same norm."""
    i, j = np.triu_indices(3)
    return np.asarray(np.moveaxis(tensor[..., i, j] * np.where(i == j, 1.0, np.sqrt(2.0)), 0, 1))


def _tensor(vector: Array) -> Array:
    """The tensors (n, 3, 3) of vectors (n, 6)."""
    i, j = np.triu_indices(3)
    result = np.empty((len(vector), 3, 3))
    result[:, i, j] = result[:, j, i] = vector / np.where(i == j, 1.0, np.sqrt(2.0))
    return result
