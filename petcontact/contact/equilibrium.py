"""Check whether contact tractions of any size can hold the loads.

It is a linear program over the cone of tractions that the law allows.
"""

from __future__ import annotations

import itertools

import numpy as np
import scipy

from ..arrays import Array, Index
from ..round_off import HALF, TINY
from .friction_law import lengths
from .law_protocol import Admissible, ContactLaw, LimitedLaw
from .system import Modes

Forces = tuple[Array, Admissible]
"""Resultants (r, q, k) of tractions, and their limits."""

PROJECTIONS = 200
"""Most projections before the linear program is asked: 1 to 144 were enough in a pin, blade roots,
lap joints and balls, and so many take 3 ms."""


def unbalanced_load(
    modes: Modes | None,
    law: ContactLaw,
    forces: Forces | None = None,
    costs: Array | float = 1.0,
) -> Array | None:
    """Return the part of the loads that no admissible traction holds, (r,), or None.

    None means that all loads can be held, or that the law has no `admissible`. The program
    minimises Σ|Eσ + f| over the law's `Admissible` tractions. The disks of σ_t are replaced by
    polygons around them, which get further sides where σ_t leaves the disk. A load that the program
    rejects cannot be held. A load that it accepts may still not be held, since its tractions need
    not follow from the elastic problem. `forces` replaces the tractions of the nodes. `costs` (r,)
    weigh the terms of the sum: the part of the loads that is cheap is the one that is returned.
    """
    if modes is None or not modes.load.any() or not isinstance(law, LimitedLaw):
        return None
    resultant, limits = forces or (modes.resultant, law.admissible())
    scale = np.maximum(np.abs(resultant).max(axis=(1, 2), initial=0.0), TINY)
    size = float(np.abs(modes.load / scale).max(initial=0.0))
    rows, load = (resultant / scale[:, None, None]).reshape(len(scale), -1), modes.load / scale
    if forces is None and _found(rows, load / size, law, size):
        return None
    left = _unheld(_Friction(law, limits, size), rows, load / size, costs)
    return None if left is None else np.asarray(left * scale * size)


def _unheld(friction: _Friction, rows: Array, load: Array, costs: Array | float) -> Array | None:
    """Return the cheapest part of a load that no admissible σ with rows · σ = -load holds, (r,), or
    None, by linear programs."""
    r, unknowns = rows.shape
    # the unknowns are σ over the size of the loads, node after node, and the slacks s+, s- >= 0
    bounds = np.concatenate([friction.bounds, np.tile([0.0, np.inf], (2 * r, 1))])
    # each linear program has the sides that the one before it asked for
    for _ in range(8):
        polygon = scipy.sparse.vstack(friction.sides)
        none = scipy.sparse.csr_array((polygon.shape[0], 2 * r))
        answer = scipy.optimize.linprog(
            # a push and a turn may weigh the same: digits do not choose, the first motion is named
            np.concatenate([np.zeros(unknowns), np.tile(costs * (1.0 + 1e-3 * np.arange(r)), 2)]),
            A_ub=scipy.sparse.hstack([polygon, none]).tocsr() if polygon.shape[0] else None,
            b_ub=np.concatenate(friction.limits) if polygon.shape[0] else None,
            A_eq=np.hstack([rows, np.eye(r), -np.eye(r)]),
            b_eq=-load,
            bounds=bounds,
            method="highs",
        )
        if not answer.success:
            return None
        slack = answer.x[unknowns : unknowns + r] - answer.x[unknowns + r :]
        if np.abs(slack).sum() > HALF:
            return np.asarray(-slack)
        # a vertex leaves its bounds by the round-off of all tractions, and what HiGHS allows
        if not friction.cuts_off(np.clip(answer.x, *bounds.T)[:unknowns]):
            return None
    return None


def _found(rows: Array, load: Array, law: ContactLaw, size: float) -> bool:
    """Return whether tractions σ over a size with rows · σ = -load are found by projections.

    Projections on the tractions that balance the load and on those that the law allows take turns.
    They converge linearly where some of the first are inside of the second. Of a body that is
    pressed they take a millisecond, and the linear program 2 to 37.

    Source: H. H. Bauschke and J. M. Borwein, On projection algorithms for solving convex
    feasibility problems, SIAM Review 38 (1996) 367-426.
    """
    balance, sigma = np.linalg.pinv(rows), np.zeros((rows.shape[1] // law.k, law.k))
    for _ in range(PROJECTIONS):
        off = rows @ sigma.ravel() + load
        if np.abs(off).sum() <= HALF:
            return True
        sigma = -law.project(size * ((balance @ off).reshape(sigma.shape) - sigma)) / size
    return False


class _Friction:
    """Polygons around the disks of σ_t, over the size of the loads: sides A σ <= b.

    Attributes
    ----------
    sides, limits : lists of sparse arrays and of arrays
        Rows of A and of b.
    bounds : (m k, 2) array
        The least and the largest components of σ.
    """

    def __init__(self, law: ContactLaw, limits: Admissible, size: float) -> None:
        self._law, self._normal, self._tangential = law, law.groups[1:], law.groups[0]
        self._cap, self._cohesion = limits.cap / size, limits.cohesion / size
        self._slope = np.where(bool(self._normal), limits.slope, 0.0)
        self._cone = np.flatnonzero(np.isfinite(self._cohesion))
        ways = directions(self._tangential.stop - self._tangential.start)
        self.sides = [_sides(self._cone, way, self._slope, law) for way in ways]
        self.limits = [self._cohesion[self._cone]] * len(self.sides)
        upper = np.tile(self._cap[:, None], law.k)
        lower = -upper
        for group in self._normal:
            lower[:, group] = -limits.push[:, None] / size
            upper[:, group] = limits.pull[:, None] / size
        self.bounds = np.column_stack([lower.ravel(), upper.ravel()])

    def cuts_off(self, unknowns: Array) -> bool:
        """Add sides where σ (m k,) is outside its disk; False if it is nowhere."""
        sigma = unknowns.reshape(-1, self._law.k)
        length = lengths(sigma[:, self._tangential])
        pressure = -sigma[:, self._normal[0]][:, 0] if self._normal else np.zeros(len(sigma))
        excess = length - np.minimum(self._cohesion + self._slope * pressure, self._cap)
        # so many sides are added to all polygons at a time
        beyond = np.argsort(-excess)[:4]
        beyond = beyond[excess[beyond] > HALF * np.abs(sigma).max(initial=0.0)]
        capped, flat = np.flatnonzero(np.isfinite(self._cap)), np.zeros(len(sigma))
        for way in sigma[beyond, self._tangential] / length[beyond, None]:
            self.sides += [_sides(self._cone, way, self._slope, self._law)]
            self.sides += [_sides(capped, way, flat, self._law)]
            self.limits += [self._cohesion[self._cone], self._cap[capped]]
        return len(beyond) > 0


def directions(dimension: int) -> Array:
    """Return unit vectors to all neighbours of a grid point: ±1 on a line, eight in a plane."""
    ways = np.array(
        [way for way in itertools.product((-1.0, 0.0, 1.0), repeat=dimension) if any(way)]
    )
    return np.asarray(ways / np.linalg.norm(ways, axis=1)[:, None])


def _sides(nodes: Index, way: Array, slope: Array, law: ContactLaw) -> scipy.sparse.csr_array:
    """Return rows over all σ that give way · σ_t + slope σ_n at the given nodes."""
    k = law.k
    entries = np.zeros((len(nodes), k))
    entries[:, law.groups[0]] = way
    for group in law.groups[1:]:
        entries[:, group] = slope[nodes, None]
    rows = np.repeat(np.arange(len(nodes)), k)
    columns = (k * nodes[:, None] + np.arange(k)).ravel()
    return scipy.sparse.csr_array(
        (entries.ravel(), (rows, columns)), shape=(len(nodes), k * len(slope))
    )
