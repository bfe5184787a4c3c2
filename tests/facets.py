"""Surfaces of facets as Gmsh files, each meshed for itself: boxes and rings."""

from __future__ import annotations

from pathlib import Path

import curved_bodies
import numpy as np

from petcontact.refinement.panels.quartering import cut


def written(file: Path, parts, *, triangles=False):
    """The path of a `.msh` file of the quadrilaterals (n, 4, 3) of each part, by name; cut in two
    if wanted."""
    if triangles:
        halves = [[0, 1, 2], [0, 2, 3]]
        parts = {name: cells[:, halves].reshape(-1, 3, 3) for name, cells in parts.items()}
    return curved_bodies.written(file, parts)


def grid(u, v, place):
    """Quadrilaterals (n, 4, 3) between grid lines; `place` takes arrays of u and v to points."""
    a, b = np.meshgrid(u, v, indexing="ij")
    x = np.stack(place(a, b), axis=-1)
    return np.stack([x[:-1, :-1], x[1:, :-1], x[1:, 1:], x[:-1, 1:]], axis=2).reshape(-1, 4, 3)


def box(file, lower, upper, counts, *, triangles=True, power=1.0):
    """A box whose sides are cut into `counts` pieces, graded towards the lower ends, or along lines
    that are given."""
    x, y, z = (
        a + (b - a) * np.linspace(0.0, 1.0, n + 1) ** power if isinstance(n, int) else n
        for a, b, n in zip(lower, upper, counts, strict=True)
    )
    parts = {}
    for side, k in (("left", 0), ("right", -1)):
        parts[side] = grid(y, z, lambda a, b, k=k: (np.full_like(a, x[k]), a, b))
    for side, k in (("front", 0), ("back", -1)):
        parts[side] = grid(x, z, lambda a, b, k=k: (a, np.full_like(a, y[k]), b))
    for side, k in (("bottom", 0), ("top", -1)):
        parts[side] = grid(x, y, lambda a, b, k=k: (a, b, np.full_like(a, z[k])))
    return written(file, parts, triangles=triangles)


def ring(file, radii, height, counts, *, turn=0.0, triangles=False):
    """A ring about the z axis: radii (inner, outer), z from 0, pieces (around, along z, along the
    radius).

    Parts inner, outer, bottom, top; without an inner radius it is a pin, whose ends are triangles
    but for their rim.
    """
    around, up, out = counts
    angle = turn + 2.0 * np.pi * np.arange(around + 1) / around
    z, r = np.linspace(0.0, height, up + 1), np.linspace(*radii, out + 1)
    parts = {
        "outer": grid(angle, z, lambda a, b: (radii[1] * np.cos(a), radii[1] * np.sin(a), b)),
        "inner": grid(angle, z, lambda a, b: (radii[0] * np.cos(a), radii[0] * np.sin(a), b)),
        "bottom": grid(angle, r, lambda a, b: (b * np.cos(a), b * np.sin(a), 0.0 * a)),
        "top": grid(angle, r, lambda a, b: (b * np.cos(a), b * np.sin(a), 0.0 * a + height)),
    }
    return written(file, parts, triangles=triangles)


def quartered(mesh, marked):
    """The mesh with each marked panel (n_elements,) replaced by four."""
    return cut(mesh, np.repeat(marked[:, None], 2, axis=1))
