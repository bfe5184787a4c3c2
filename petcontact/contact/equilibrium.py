"""Whether contact tractions of any size can hold the loads: a linear program over the cone of what the law allows."""

from __future__ import annotations

import itertools

import numpy as np
import scipy

from ..arrays import Array, Index
from .laws import SignoriniCoulomb
from .system import Modes

SMALL = 1e-8
"""Push that counts as none, relative to the loads."""
ROUNDS = 8
"""Linear programs at most, each with the sides that the one before it asked for."""
NEW = 4
"""Sides that are added to all polygons at a time."""


def unbalanced_load(modes: Modes | None, law: SignoriniCoulomb) -> Array | None:
    """What of the loads no admissible traction holds, (r,); None where all can be held.

    Minimises Σ|Eσ + f| over p >= 0 where unilateral and σ_t in a polygon around the disk of radius r(p), which gets further
    sides where σ_t leaves the disk: what it says cannot be held cannot. A load that passes may still not be held: the
    tractions that would do it need not follow from the elastic problem.
    """
    if modes is None or not np.any(modes.load):
        return None
    r, m, k = modes.resultant.shape
    scale = np.maximum(np.abs(modes.resultant).max(axis=(1, 2), initial=0.0), 1e-300)
    size = float(np.abs(modes.load / scale).max(initial=0.0))
    present = np.ones(m, dtype=bool) if law.absent is None else ~law.absent
    # unknowns: σ (node after node, normal last), and the slacks s+, s- >= 0
    equal = np.hstack([(modes.resultant / scale[:, None, None]).reshape(r, m * k), np.eye(r), -np.eye(r)])
    coulomb = np.isfinite(law.coefficient) & present
    cap = np.where(present, law.bound, 0.0) / size  # the unknowns are σ over the size of the loads
    lower, upper = np.full((m, k), -np.inf), np.full((m, k), np.inf)
    lower[:, :-1], upper[:, :-1] = -cap[:, None], cap[:, None]
    upper[law.unilateral, -1] = 0.0
    lower[~present, -1] = upper[~present, -1] = 0.0
    bounds = np.concatenate([
        np.column_stack([lower.ravel(), upper.ravel()]), np.tile([0.0, np.inf], (2 * r, 1)),
    ])  # fmt: skip
    capped = np.flatnonzero(np.isfinite(cap))
    slope, ways = np.where(coulomb, law.coefficient, 0.0), directions(k - 1)
    sides = [_sides(np.flatnonzero(coulomb), way, slope, k) for way in ways]
    limit = [np.zeros(int(coulomb.sum())) for _ in sides]
    for _ in range(ROUNDS):
        polygon = scipy.sparse.vstack(sides)
        whole = scipy.sparse.hstack([polygon, scipy.sparse.csr_array((polygon.shape[0], 2 * r))]).tocsr()
        given = polygon.shape[0] > 0
        answer = scipy.optimize.linprog(
            np.concatenate([np.zeros(m * k), np.ones(2 * r)]), A_ub=whole if given else None,
            b_ub=np.concatenate(limit) if given else None, A_eq=equal, b_eq=-modes.load / scale / size, bounds=bounds,
            method="highs",
        )  # fmt: skip
        if not answer.success:
            return None
        if answer.fun > SMALL:
            slack = answer.x[m * k : m * k + r] - answer.x[m * k + r :]
            return np.asarray(-slack * scale * size)
        sigma = answer.x[: m * k].reshape(m, k)
        length = np.linalg.norm(sigma[:, :-1], axis=1)
        radius = np.minimum(np.where(coulomb, slope * np.abs(sigma[:, -1]), np.inf), cap)
        excess = length - radius
        beyond = np.argsort(-excess)[: np.count_nonzero(excess > SMALL * length.max(initial=0.0))][:NEW]
        if not len(beyond):
            return None
        for way in sigma[beyond, :-1] / length[beyond, None]:
            sides += [_sides(np.flatnonzero(coulomb), way, slope, k), _sides(capped, way, np.zeros(m), k)]
            limit += [np.zeros(int(coulomb.sum())), cap[capped]]
    return None


def directions(dimension: int) -> Array:
    """Unit vectors to all neighbours of a grid point: ±1 on a line, eight in a plane."""
    ways = np.array([way for way in itertools.product((-1.0, 0.0, 1.0), repeat=dimension) if any(way)])
    return np.asarray(ways / np.linalg.norm(ways, axis=1)[:, None])


def _sides(nodes: Index, way: Array, slope: Array, k: int) -> scipy.sparse.csr_array:
    """way · σ_t + slope σ_n at some of all nodes, rows over all σ."""
    rows = np.repeat(np.arange(len(nodes)), k)
    columns = (k * nodes[:, None] + np.arange(k)).ravel()
    entries = np.column_stack([np.broadcast_to(way, (len(nodes), k - 1)), slope[nodes]]).ravel()
    return scipy.sparse.csr_array((entries, (rows, columns)), shape=(len(nodes), k * len(slope)))


unheld = unbalanced_load  # until pipeline/ has the new name
