"""Height of curved faces above the straight elements and flat panels that stand for them."""

from __future__ import annotations

import numpy as np
import scipy

from ...arrays import Array, largest_by
from ...round_off import SINGLE
from .ray_casting import Faces

SMOOTH = 0.5
"""Least cosine between the normals of neighbours on one curved face; a smaller one is an edge."""


def sag(faces: Faces) -> Array:
    """Return h²/(8R) = hθ/8 of each face, (n,) [length].

    θ is the largest angle to a neighbour of about the length h. For elements that follow the curve
    it is 0, since neighbours meet smoothly. Neighbours are recognised by coinciding sides.

    Examples
    --------
    >>> import numpy as np
    >>> from petcontact.mesh.pairs.intersections import Curves
    >>> turn = np.linspace(0.0, 2.0 * np.pi, 41)
    >>> points = np.column_stack([np.cos(turn), np.sin(turn)])
    >>> polygon = Curves(points[:-1], points[1:], np.zeros(40))
    >>> round(float(sag(polygon).max()), 5)  # 1 - cos(π/40) = 0.00308
    0.00308
    """
    number, start, end = faces.rims()
    x, normal = faces.at(number, 0.5 * (start + end))
    count = np.bincount(number, minlength=len(faces))
    centre = np.column_stack([np.bincount(number, column, len(faces)) / count for column in x.T])
    reach = np.linalg.norm(x - centre[number], axis=1)
    i, j = (
        scipy.spatial.cKDTree(x)
        .query_pairs(SINGLE * float(reach.min(initial=np.inf)), output_type="ndarray")
        .T
    )
    cosine = np.sum(normal[i] * normal[j], axis=1)
    smooth = (cosine > SMOOTH) & (number[i] != number[j])
    height = np.where(
        smooth, (reach[i] + reach[j]) * np.arccos(np.clip(cosine, -1.0, 1.0)) / 8.0, 0.0
    )
    # the arc cosine has an error of 1e-8 at small angles
    height[cosine > 1.0 - 1e-14] = 0.0
    return largest_by(number[np.concatenate([i, j])], np.tile(height, 2), len(faces))
