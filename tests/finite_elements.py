"""Linear finite elements on a grid of bricks, condensed to one face: stiffness of bodies that
petcontact did not make."""

from __future__ import annotations

import itertools

import numpy as np


def grid(counts, size):
    """Points of a grid (n, d) and its cells (k, 2^d), corners in the order of itertools.product."""
    lines = [
        np.linspace(0.0, length, count + 1) for count, length in zip(counts, size, strict=True)
    ]
    points = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1)
    number = np.arange(points[..., 0].size).reshape(points.shape[:-1])
    d = len(counts)
    corner = [
        number[tuple(slice(c, n + c) for c, n in zip(corner, counts, strict=True))].ravel()
        for corner in itertools.product((0, 1), repeat=d)
    ]
    return points.reshape(-1, d), np.stack(corner, axis=1)


def stiffness(points, cells, elasticity):
    """Stiffness (d n, d n) for an elasticity tensor (d, d, d, d), two Gauss points along each
    direction."""
    d = points.shape[1]
    matrix = np.zeros((points.size, points.size))
    signs = np.array(list(itertools.product((-1.0, 1.0), repeat=d)))
    for cell in cells:
        here = np.zeros((len(cell), d, len(cell), d))
        for place in itertools.product((-(3.0**-0.5), 3.0**-0.5), repeat=d):
            factors = 0.5 * (1.0 + signs * place)
            local = np.stack(
                [0.5 * signs[:, c] * np.delete(factors, c, 1).prod(axis=1) for c in range(d)],
                axis=1,
            )
            jacobian = local.T @ points[cell]
            slope = np.linalg.solve(jacobian, local.T).T
            here += np.einsum("aj,ijkl,bl->aibk", slope, elasticity, slope) * np.linalg.det(
                jacobian
            )
        places = (d * cell[:, None] + np.arange(d)).ravel()
        matrix[np.ix_(places, places)] += here.reshape(len(places), -1)
    return matrix


def isotropic(young, poisson, d):
    """λ δ_ij δ_kl + µ (δ_ik δ_jl + δ_il δ_jk), in the plane that of plane strain."""
    mu, one = young / (2.0 + 2.0 * poisson), np.eye(d)
    lam = 2.0 * mu * poisson / (1.0 - 2.0 * poisson)
    return lam * np.einsum("ij,kl->ijkl", one, one) + mu * (
        np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)
    )


def condensed(matrix, kept, force, held=()):
    """Schur complement and load on some freedoms, others held at zero."""
    inner = np.setdiff1d(np.arange(len(matrix)), np.concatenate([kept, held]).astype(int))
    answer = np.linalg.solve(
        matrix[np.ix_(inner, inner)], np.column_stack([matrix[np.ix_(inner, kept)], force[inner]])
    )
    down = matrix[np.ix_(kept, inner)] @ answer
    return matrix[np.ix_(kept, kept)] - down[:, :-1], force[kept] - down[:, -1]


def bottom_faces(points, cells):
    """Points of the face where the last coordinate is 0, and its faces, the body on the left, in
    space seen from below."""
    d = points.shape[1]
    used = np.flatnonzero(points[:, -1] == 0.0)
    place = {int(p): k for k, p in enumerate(used)}
    order = (0, 2) if d == 2 else (0, 2, 6, 4)
    found = [[place[int(cell[c])] for c in order] for cell in cells if points[cell[0], -1] == 0.0]
    return used, np.array(found)
