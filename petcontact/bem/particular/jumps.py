"""Volume loads that jump along curves: a particular solution for each piece, made continuous.

A piece D has the polynomial solution P of its loads. What P and its traction t are on the border of
D makes a field F by Somigliana's identity, whose jumps across the border are those of P. Hence P in
D less F, summed over all pieces, has no jump, and is in equilibrium with the loads everywhere.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ...arrays import Array, Index, Mask, linked
from ...given.tables.material import Material
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.ring_mesh import RingMesh
from ...round_off import SOLVED
from ..kernels import kernel_for
from .polynomial_solution import ParticularSolution

LINES = 97
"""Lines of the grid along each direction on which pieces are told apart. A border is an arc in each
of its cells, which errs by the fourth power of their size."""
MARGIN = 0.3
"""Share of the size of the body by which the grid reaches beyond it: borders may end there."""
FEWEST = 12
"""Least number of points of the body in a piece; smaller ones are left to the polynomials."""
BISECTIONS = 45
"""Halvings of the side of a cell down to round-off."""
ORDER = 3
"""Order of the elements of borders; it is about that of the error of their arcs."""
ON_BORDER = 1e-8
"""Distance from a border within which a point lies on it, over the largest coordinate [-]: fields
of rings lose half of their digits so near."""

Values = Callable[[Array], Array]
"""Function from points (m, d) to the values of all loads that vary, (m, c)."""


@dataclass(frozen=True, eq=False)
class Pieces:
    """The pieces of a plane in which loads have no jump.

    Attributes
    ----------
    values : callable
        See `Values`.
    axes : tuple of (n,) arrays
        Coordinates of the lines of a grid [length].
    label : (n, n) array
        Number of the piece of each point of the grid, -1 of points that belong to none.
    """

    values: Values
    axes: tuple[Array, Array]
    label: Index

    @property
    def count(self) -> int:
        """Number of pieces."""
        return int(self.label.max()) + 1

    def around(self, x: Array) -> Index:
        """Return the pieces (m, 4) at the corners of the cells of the grid that hold points."""
        i, j = (
            np.clip(np.searchsorted(axis, column) - 1, 0, len(axis) - 2)
            for axis, column in zip(self.axes, x.T, strict=True)
        )
        return np.stack([self.label[i + a, j + b] for a in (0, 1) for b in (0, 1)], axis=1)

    def alone(self, x: Array) -> Index:
        """Return the pieces of those points (m, d) by which no border passes."""
        near = self.around(x)
        whole = (near == near[:, :1]).all(axis=1)
        return np.asarray(near[whole, 0])

    def of(self, x: Array, expected: Sequence[Values]) -> Index:
        """Return the piece of each point (m,), by what the loads of each piece are expected to be
        where a border passes by."""
        near = self.around(x)
        piece = near[:, 0].copy()
        doubtful = np.flatnonzero((near != near[:, :1]).any(axis=1) | (piece < 0))
        if len(doubtful):
            values = self.values(x[doubtful])
            off = np.stack([np.abs(f(x[doubtful]) - values).sum(axis=1) for f in expected], axis=1)
            there = (near[doubtful, :, None] == np.arange(self.count)).any(axis=1)
            off[~there & there.any(axis=1, keepdims=True)] = np.inf
            piece[doubtful] = off.argmin(axis=1)
        return piece

    def beside_borders(self, x: Array, piece: Index, expected: Sequence[Values]) -> Array:
        """Return points (m, 2) that lie on borders a little beside them, in their own pieces.

        On an element itself the field of a border is not known.
        """
        result = x.copy()
        near = self.around(x)
        rows = np.flatnonzero((near != near[:, :1]).any(axis=1))
        least = ON_BORDER * max(float(np.abs(axis).max()) for axis in self.axes)
        for way in least * np.vstack([np.eye(2), -np.eye(2)]):
            own = self.of(x[rows] + way, expected) == piece[rows]
            result[rows[own]] += way
        return result

    def border(self, number: int) -> tuple[Array, Array, Array]:
        """Return the arcs around a piece, which lies on their left: starts, ends (k, 2) [length]
        and curvatures (k,) [1/length]."""
        ends = np.array(list(_crossed(self.label == number)), dtype=np.int64).reshape(-1, 2, 2, 2)
        x = np.stack([axis[ends[..., k]] for k, axis in enumerate(self.axes)], axis=-1)
        start, end = self._jump(x[:, 0]), self._jump(x[:, 1])
        size = np.linalg.norm(end - start, axis=1)
        kept = size > SOLVED * max(np.ptp(axis) for axis in self.axes)
        start, end, size = start[kept], end[kept], size[kept]
        across = 0.5 * (end - start)[:, ::-1] * [1.0, -1.0]
        middle = 0.5 * (start + end)
        peak = self._jump(np.stack([middle - across, middle + across], axis=1))
        rise = 2.0 * np.einsum("kd,kd->k", peak - middle, across) / size
        curvature = 8.0 * rise / (size**2 + 4.0 * rise**2)
        return start, end, np.where(np.abs(rise) > SOLVED * size, curvature, 0.0)

    def _jump(self, ends: Array) -> Array:
        """Return the points (k, 2) at which loads jump between two ends (k, 2, 2)."""
        return bisected(self.values, ends)[0]


def _crossed(inside: Mask) -> Iterator[tuple[Array, Array]]:
    """Yield the sides, by the places (2, 2) of their ends on the grid, where a border enters a cell
    and where it leaves it; the piece `inside` (n, m) is on its left."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    n, m = inside.shape
    there = np.stack([inside[a : n - 1 + a, b : m - 1 + b] for a, b in corners], axis=-1)
    after, sides = np.roll(there, -1, axis=-1), np.stack([corners, np.roll(corners, -1, axis=0)], 1)
    for cell in np.argwhere(there.any(axis=-1) & ~there.all(axis=-1)):
        into, out = (
            np.flatnonzero(a[tuple(cell)] & ~b[tuple(cell)])
            for a, b in ((after, there), (there, after))
        )
        for k in out:
            yield cell + sides[k], cell + sides[into[((k - into) % 4).argmin()]]


def bisected(values: Values, ends: Array) -> tuple[Array, Array]:
    """Return the point (k, d) between two ends (k, 2, d) at which values change most, and the
    change there (k,)."""
    low, high = ends[:, 0].copy(), ends[:, 1].copy()
    below, above = values(low), values(high)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        there = values(middle)
        upper = np.abs(above - there).sum(axis=1) > np.abs(there - below).sum(axis=1)
        low, below = (np.where(upper[:, None], a, b) for a, b in ((middle, low), (there, below)))
        high, above = (np.where(upper[:, None], b, a) for a, b in ((middle, high), (there, above)))
    return 0.5 * (low + high), np.abs(above - below).sum(axis=1)


def pieces_of(values: Values, mesh: BoundaryMesh, points: Array) -> Pieces | None:
    """Return the pieces of a plane body in which loads have no jump, or None if there is one only.

    Parameters
    ----------
    values : callable
        See `Values`.
    mesh : BoundaryMesh
    points : (m, d) array
        Points all over the body [length].
    """
    if not isinstance(mesh, CurveMesh):
        return None
    axes = _lines(mesh)
    x = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
    pairs, at = _neighbours(), values(x)
    change = np.abs(at[pairs[1]] - at[pairs[0]]).sum(axis=1)
    jumps = change > SOLVED * np.abs(at).sum(axis=1).max()
    # across a jump the change stays as large, however near the two points are
    left = bisected(values, x[pairs[:, jumps].T])[1]
    jumps[jumps] = left > 0.5 * change[jumps]
    label = linked(pairs[:, ~jumps], len(x))
    whole = Pieces(values, axes, label.reshape(LINES, LINES))
    counts = np.bincount(whole.alone(points), minlength=label.max() + 1)
    if not np.count_nonzero(counts) > 1 or counts[counts > 0].min() < FEWEST:
        return None
    names = np.where(counts > 0, np.cumsum(counts > 0) - 1, -1)
    return Pieces(values, axes, names[whole.label])


@functools.cache
def _neighbours() -> Index:
    """Return the numbers of the points of the grid that are neighbours, (2, k)."""
    number = np.arange(LINES * LINES).reshape(LINES, LINES)
    ways = (number[:-1], number[1:]), (number[:, :-1], number[:, 1:])
    return np.hstack([np.stack([a.ravel(), b.ravel()]) for a, b in ways])


def _lines(mesh: BoundaryMesh) -> tuple[Array, Array]:
    """Return the coordinates of the lines of a grid on a body and around it [length]."""
    low, high = mesh.x.min(axis=0), mesh.x.max(axis=0)
    reach = MARGIN * (high - low).max()
    first = low - reach
    if isinstance(mesh, RingMesh):
        first[0] = max(first[0], 0.0)
    r, z = (np.linspace(*ends, LINES) for ends in zip(first, high + reach, strict=True))
    return r, z


@dataclass(frozen=True, eq=False)
class JumpingSolution:
    """As `ParticularSolution`, for loads that jump.

    Attributes
    ----------
    material : Material
    pieces : Pieces
    solutions : tuple of ParticularSolution
        Of each piece.
    expected : tuple of callables
        Values of the loads of each piece, see `Values`.
    borders : tuple of BoundaryMesh
        Around each piece.
    """

    material: Material
    pieces: Pieces
    solutions: tuple[ParticularSolution, ...]
    expected: tuple[Values, ...]
    borders: tuple[BoundaryMesh | None, ...]

    @classmethod
    def between(
        cls,
        mesh: BoundaryMesh,
        pieces: Pieces,
        solutions: Sequence[ParticularSolution],
        expected: Sequence[Values],
    ) -> JumpingSolution:
        """Return the solution in the body of a mesh."""
        kind: type[CurveMesh] = RingMesh if isinstance(mesh, RingMesh) else CurveMesh
        borders = list[BoundaryMesh | None]()
        for number in range(pieces.count):
            start, end, curvature = pieces.border(number)
            k = len(start)
            none = np.zeros(k, dtype=np.int64)
            made = (
                kind(
                    start,
                    end,
                    curvature,
                    none + ORDER,
                    none,
                    np.arange(k),
                    np.zeros(k),
                    ("border",),
                    mesh.unit_length,
                )
                if k
                else None
            )
            borders.append(made)
        return cls(solutions[0].material, pieces, tuple(solutions), tuple(expected), tuple(borders))

    def displacement(self, x: Array) -> Array:
        """At points (m, d), (m, d) [length]."""
        return self._summed(x)[0]

    def stress(self, x: Array) -> Array:
        """At points (m, d), (m, d, d) [stress]."""
        return self._summed(x)[1]

    def thermal_stress(self, x: Array) -> Array:
        """βT at points (m, d), (m,) [stress]."""
        piece = self.pieces.of(x, self.expected)
        return np.choose(piece, [each.thermal_stress(x) for each in self.solutions])

    def _summed(self, x: Array) -> tuple[Array, Array]:
        u, stress = np.zeros((len(x), 2)), np.zeros((len(x), 2, 2))
        piece = self.pieces.of(x, self.expected)
        x = self.pieces.beside_borders(x, piece, self.expected)
        for number, (solution, border) in enumerate(zip(self.solutions, self.borders, strict=True)):
            own = piece == number
            u[own] += solution.displacement(x[own])
            stress[own] += solution.stress(x[own])
            if border is not None:
                moved, stressed = _field(border, solution, x)
                u -= moved
                stress -= stressed
        return u, stress


def _field(border: BoundaryMesh, solution: ParticularSolution, x: Array) -> tuple[Array, Array]:
    """Return u (m, 2) and σ (m, 2, 2) of the field that a solution on a border makes."""
    kernel = kernel_for(border, solution.material)
    at_nodes = solution.displacement(border.x)
    traction = np.einsum("nij,nj->ni", solution.stress(border.x), border.normal)
    u, components = np.zeros((len(x), 2)), np.zeros((len(x), 3))
    for batch in border.batches():
        known = at_nodes[batch.nodes, :, None], traction[batch.nodes, :, None]
        moved, stressed, _ = kernel.field(
            border.points(x), batch.elements, known[0], known[1] / kernel.traction_scale
        )
        u += moved[..., 0]
        components += kernel.traction_scale * stressed[..., 0]
    xx, yy, xy = components.T
    return u, np.stack([np.stack([xx, xy], 1), np.stack([xy, yy], 1)], axis=1)
