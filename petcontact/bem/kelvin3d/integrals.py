"""Kelvin's solution in space and its traction, integrated over panels (the kernels of 4.10 in three
dimensions).

With r = y - x from the target x to the source y, n the outward normal at y and w = n·r:

    U = 1/(16πµ(1-ν)) [(3-4ν) I/r + r r/r³]
    T = -1/(8π(1-ν)) [w ((1-2ν) I/r³ + 3 r r/r⁵) - (1-2ν)(r n - n r)/r³]

U[i, j] and T[i, j] take component j at the source to component i at the target. Near flat panels
are integrated in closed form (native/space/near.c, by the recursions of `moments`), near curved
ones in polar coordinates about the nearest point (native/space/polar.c); from afar Gauss points
serve as sources, as many as a bound of their error asks for.
"""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...mesh.curved.curved_panels import CurvedPanels
from ...mesh.panels import Panels
from .compiled import compiled_integrals
from .rules import MOST_POINTS, tolerance_of


def integrals(
    points: Array,
    panels: Panels | CurvedPanels,
    poisson_ratio: float,
    *,
    tolerance: float | None = None,
) -> tuple[Array, Array]:
    """Both kernels integrated over panels against their bases, at target points.

    Parameters
    ----------
    points : (m, 3) array
        [length]
    panels : Panels or CurvedPanels
        n panels of k nodes.
    poisson_ratio : float
    tolerance : float, optional
        Of the quadrature, of flat panels where they are far; by default `rules.TOLERANCE`.

    Returns
    -------
    G : (3, 3, n k, m) array
        2µ ∫ U_ij L_b dS [length], i the component at the target, j the component at the panel;
        panel after panel on the third axis.
    H : (3, 3, n k, m) array
        ∫ T_ij L_b dS [-]; the principal value, without the free term, at a node of the panel
        itself.
    """
    shape = (3, 3, len(panels.index) * panels.n_nodes, len(points))
    kernel_g, kernel_h = np.empty(shape), np.empty(shape)
    tolerance, most = tolerance_of(panels, tolerance), MOST_POINTS[type(panels)]
    compiled_integrals(points, panels, poisson_ratio, tolerance, most, kernel_g, kernel_h)
    return kernel_g, kernel_h
