"""Kelvin's solution of plane strain and its traction, integrated over boundary elements (the
kernels of 4.10).

With r = x - y, n the outward normal at x, and the direction start -> end running with the body on
its left:

    U = 1/(8πµ(1-ν)) [-(3-4ν) ln r I + r r/r²]
    T = -1/(4π(1-ν)) [(r·n/r²) ((1-2ν) I + 2 r r/r²) + (1-2ν)/r² (n r - r n)]

U[i, j] and T[i, j] take the traction or displacement component j at x to component i at y. Both are
a multiple of I plus a deviator (a complex number m stands for [[Re m, Im m], [Im m, -Re m]]) plus,
in T, a rotation by 90 degrees.
"""

from __future__ import annotations

from ...arrays import Array
from ...mesh.elements import Elements, Targets
from .arc_elements import Arcs
from .compiled import ELEMENTS, element_members, integrated
from .segments import Segments

__all__ = ["Elements", "Targets", "integrals"]


def integrals(
    targets: Targets, elements: Elements, poisson_ratio: float, length: float
) -> tuple[Array, Array]:
    """Both kernels integrated over elements against their Lagrange bases, at targets.

    Parameters
    ----------
    targets : Targets
        m points.
    elements : Elements
        n elements of order p.
    poisson_ratio : float
        ν of plane strain; for plane stress pass ν/(1+ν).
    length : float
        Length that scales the argument of the logarithm [length].

    Returns
    -------
    G : (2, 2, n(p+1), m) array
        2µ ∫ U_ij L_b ds [length], i the component at the target, j the component at the element;
        element after element on the third axis.
    H : (2, 2, n(p+1), m) array
        ∫ T_ij L_b ds [-]; the principal value, without the free term, at a node of the element
        itself.
    """
    curve = element_members(elements, elements.index, poisson_ratio, length, 1.0)
    return integrated("petcontact_plane_integrals", ELEMENTS, curve, targets, elements, 2, 2)


def shape_of(elements: Elements) -> Arcs | Segments:
    """Geometry of elements that are all straight or all arcs."""
    if elements.curved.any():
        return Arcs.bent(elements.start, elements.end, elements.curvature)
    return Segments.through(elements.start, elements.end)
