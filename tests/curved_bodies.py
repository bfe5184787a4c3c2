"""Bodies of curved panels: spheres from icosahedra, random quadratic panels, Gmsh files of them."""

from __future__ import annotations

import itertools
from pathlib import Path

import meshio
import numpy as np

from petcontact.mesh.curved.curved_panels import CurvedPanels, make_curved_panels

GOLDEN = 0.5 * (1.0 + 5.0**0.5)
TIPS = np.array([(0, a, b * GOLDEN) for a in (-1, 1) for b in (-1, 1)])
TIPS = np.concatenate([np.roll(TIPS, k, axis=1) for k in range(3)])


def icosphere(pieces: int) -> np.ndarray:
    """Six points (20 n², 6, 3) of the triangles of a unit sphere, each edge of an icosahedron cut
    into n."""
    beside = np.linalg.norm(TIPS[:, None] - TIPS, axis=2) < 2.1
    cells = []
    for face in itertools.combinations(range(12), 3):
        if not beside[np.ix_(face, face)].all():
            continue
        a, b, c = TIPS[list(face)]
        if np.linalg.det([a, b, c]) < 0.0:
            b, c = c, b
        at = lambda i, j, a=a, b=b, c=c: a + (i * (b - a) + j * (c - a)) / pieces  # noqa: E731
        for i in range(pieces):
            for j in range(pieces - i):
                cells.append([at(i, j), at(i + 1, j), at(i, j + 1)])
                if i + j < pieces - 1:
                    cells.append([at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)])
    corners = np.array(cells)
    corners /= np.linalg.norm(corners, axis=2, keepdims=True)
    middles = corners + np.roll(corners, -1, axis=1)
    return np.concatenate(
        [corners, middles / np.linalg.norm(middles, axis=2, keepdims=True)], axis=1
    )


def written(
    file: Path, parts: dict[str, np.ndarray | list[np.ndarray]], kinds: dict[int, str] | None = None
) -> str:
    """The path of a `.msh` file of cells (n, nodes, 3) of each part, or of several kinds of cells,
    by name."""
    kinds = {3: "triangle", 4: "quad", 6: "triangle6", 8: "quad8", 9: "quad9", **(kinds or {})}
    blocks = [
        (k, one)
        for k, own in enumerate(parts.values(), 1)
        for one in (own if isinstance(own, list) else [own])
    ]
    every = np.concatenate([own.reshape(-1, 3) for _, own in blocks])
    _, first, number = np.unique(every.round(9), axis=0, return_index=True, return_inverse=True)
    ends = np.cumsum([own.shape[0] * own.shape[1] for _, own in blocks])
    cells = [
        (kinds[own.shape[1]], n.reshape(own.shape[:2]))
        for (_, own), n in zip(blocks, np.split(number.ravel(), ends[:-1]), strict=True)
    ]
    tags = [np.full(len(own), k) for k, own in blocks]
    mesh = meshio.Mesh(
        every[first],
        cells,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data={name: np.array([k + 1, 2]) for k, name in enumerate(parts)},
    )
    meshio.write(file, mesh, file_format="gmsh22", binary=False)
    return str(file)


def a_curved_panel(
    corners: int, order: int, rng: np.random.Generator, bend: float = 0.15
) -> CurvedPanels:
    """A panel whose middles are moved at random, by up to a share of its size; its area factor
    varies by 2 at most."""
    while True:
        angle = np.sort(rng.uniform(0.0, 0.5, corners)) + 2.0 * np.pi * np.arange(corners) / corners
        corner = np.column_stack(
            [np.cos(angle), rng.uniform(0.5, 1.0) * np.sin(angle), np.zeros(corners)]
        )
        points = np.concatenate([corner, 0.5 * (corner + np.roll(corner, -1, axis=0))])
        points = points if corners == 3 else np.concatenate([points, corner.mean(axis=0)[None]])
        points = points + bend * rng.uniform(-1.0, 1.0, points.shape)
        points = points @ np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.normal(size=3)
        panels = make_curved_panels(points[None], order, np.arange(1))[0]
        if panels.distortion[0] <= 2.0:
            return panels


def vector_area(mesh):
    """The integral of the normal, ½ ∮ x × dx around each curved panel: 0 of a closed surface."""
    triangle, total = np.isnan(mesh.corners[:, 3, 0]), np.zeros(3)
    for mine, count in ((triangle, 3), (~triangle, 4)):
        a, m = mesh.corners[mine, :count], mesh.middles[mine, :count]
        c = np.roll(a, -1, axis=1)
        for s, weight in zip(*np.polynomial.legendre.leggauss(3), strict=True):
            x = 0.5 * s * (s - 1) * a + (1 - s * s) * m + 0.5 * s * (s + 1) * c
            dx = (s - 0.5) * a - 2 * s * m + (s + 0.5) * c
            total += 0.5 * weight * np.cross(x, dx).sum(axis=(0, 1))
    return total
