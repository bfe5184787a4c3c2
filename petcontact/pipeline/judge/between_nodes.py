"""Search for overlaps of surfaces between the nodes, where the contact method does not look."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable

import numpy as np
import scipy

from ...arrays import Array, Index, Mask, States, marked
from ...compliance.reduced_bodies import Interface
from ...contact.law_protocol import OPEN
from ...given.interface_data import PosedInterface
from ...given.sites import Sites
from ...mesh.approximation import ACROSS, WITHIN
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.ray_casting import Faces, along
from ...mesh.rough_places import narrow_places
from ...record import record
from ...round_off import HALF, first_largest

MOVED = 1e-3
"""Assumed approach over the size of the mesh, where no node shows how far bodies approach [-]."""
GapAt = Callable[[Index, Array, Array, Array], Array]
"""Function that returns the initial gap (q,) at points of elements [length].

Its arguments are the elements, the positions in them, the points and the normals (q, d). The gap is
infinite where nothing is opposite.
"""


@record
class Sampling:
    """The surface between the nodes of one unilateral contact.

    Attributes
    ----------
    mesh : BoundaryMesh
    nodes : (m,) array
        Nodes of the contact.
    element : (n,) array
        Numbers of the elements in the contact.
    faces : Faces
        The shapes of these elements.
    gap_at : callable
        See `GapAt`.
    across : int
        Points of the grid along each direction of an element.
    narrow : tuple of (k,) and (k, d-1) arrays
        Numbers of faces, and shares of them, at which a narrow gap shows besides.
    """

    mesh: BoundaryMesh
    nodes: Index
    element: Index
    faces: Faces
    gap_at: GapAt
    across: int
    narrow: tuple[Index, Array]

    def overlap(
        self,
        v_n: Array,
        gap: Array,
        states: States,
        within: float,
        closed: bool = False,
        unfaced: bool = False,
    ) -> tuple[float, tuple[Index, Array] | None]:
        """Return the largest overlap between nodes, at least 0 [length], and its position (see
        `point`).

        By default only elements whose nodes are all open are searched, first on a grid. The search
        then continues with the neighbours of the deepest point if a larger overlap is possible
        there. It is possible where the overlap varies by enough between neighbouring points of the
        grid, since both faces are smooth. Neighbours come twice as near each time, down to what a
        minimum is known to (`HALF`).

        Parameters
        ----------
        v_n, gap : (m,) arrays
            Overlap of the nodes beyond the gap, and the gap [length].
        states : (m,) array
            0 stick, 1 slip, 2 open.
        within : float
            Accepted error of the overlap [length].
        closed : bool, optional
            Search all elements whose nodes all face the other side, those in contact too.
        unfaced : bool, optional
            Search elements that have nodes with nothing opposite, too: a ball may be smaller than
            an element. Their approach is the mean one of the other nodes, or `MOVED`.
        """
        faced = np.isfinite(gap)
        approach = v_n[faced] + gap[faced]
        closer = np.full(self.mesh.n_nodes, MOVED * float(np.ptp(self.mesh.x)))
        if faced.any():
            closer[:] = np.mean(approach)
            closer[self.nodes[faced]] = approach
        share, values, distance, adjacent = self._grid
        seen = self.nodes[((states != OPEN) & (not closed)) | (~faced & (not unfaced))]
        touched = marked(self.mesh.element[seen], self.mesh.n_elements)
        asked = np.flatnonzero(~touched[self.element])
        if not len(asked):
            return 0.0, None
        worst, position = self._narrowest(closer, touched)
        over, share = (values @ closer - distance).reshape(share.shape[:2])[asked], share[asked]
        reach = 1.0 / (self.across - 1)
        while reach > HALF:
            best, deepest = over.argmax(axis=1), over.max(axis=1)
            least = np.where(np.isfinite(over) & adjacent[best], over, np.inf).min(axis=1)
            k = first_largest(deepest)
            if deepest[k] > worst:
                worst, position = float(deepest[k]), (asked[k : k + 1], share[k : k + 1, best[k]])
            room = 2.0 * deepest > worst + within + least
            if not room.any():
                break
            reach = 0.5 * reach
            around = reach * np.array([*itertools.product((-1, 0, 1), repeat=share.shape[2])])
            asked, share = asked[room], np.clip(share[room, best[room], None] + around, 0.0, 1.0)
            values, distance = self._looked_at(
                np.repeat(asked, len(around)), share.reshape(-1, share.shape[2])
            )
            over = (values @ closer - distance).reshape(len(asked), -1)
            adjacent = np.ones((len(around), len(around)), dtype=bool)
        return worst, position

    def _narrowest(self, closer: Array, touched: Mask) -> tuple[float, tuple[Index, Array] | None]:
        """Return the largest overlap where a narrow gap shows, and its position."""
        row, share = self.narrow
        if not len(row):
            return 0.0, None
        values, gap = self._at_narrow
        depth = np.where(touched[self.element[row]], 0.0, values @ closer - gap)
        k = first_largest(depth)
        return (
            (float(depth[k]), (row[k : k + 1], share[k : k + 1])) if depth[k] > 0 else (0.0, None)
        )

    @functools.cached_property
    def _at_narrow(self) -> tuple[scipy.sparse.csr_array, Array]:
        return self._looked_at(*self.narrow)

    def point(self, number: Index, share: Array) -> Array:
        """Return the point at a share (1, d-1) of a face, (d,) [length]."""
        return np.asarray(self.faces.at(number, self.faces.spread(number, share))[0][0])

    @functools.cached_property
    def _grid(self) -> tuple[Array, scipy.sparse.csr_array, Array, Mask]:
        """Return the grid of all faces: its shares (n, g, d-1), the results of `_looked_at` on it,
        and which of its points are neighbours, (g, g).

        Ends or corners of the faces belong to the grid.
        """
        grid, faces = _grid(self.across, self.mesh.dim - 1), len(self.faces)
        share = np.tile(grid, (faces, 1))
        adjacent = np.abs(grid[:, None] - grid).max(axis=2) < 1.5 / (self.across - 1)
        looked_at = self._looked_at(np.repeat(np.arange(faces), len(grid)), share)
        return share.reshape(faces, *grid.shape), *looked_at, adjacent

    def _looked_at(self, number: Index, share: Array) -> tuple[scipy.sparse.csr_array, Array]:
        """Return the matrix (q, n) from nodal values to the given shares of faces, and the gap
        there (q,)."""
        share = 0.5 + WITHIN * (share - 0.5)
        local, element = self.faces.spread(number, share), self.element[number]
        return self.mesh.basis_at(element, local), self.gap_at(
            element, local, *self.faces.at(number, local)
        )


@functools.cache
def _grid(count: int, directions: int) -> Array:
    """Return equidistant points of the unit interval or square, (count^directions, directions)."""
    points = np.stack(np.meshgrid(*[np.linspace(0.0, 1.0, count)] * directions), axis=-1)
    return np.asarray(points).reshape(-1, directions)


def places_between(
    side: PosedInterface, interface: Interface, meshes: list[BoundaryMesh]
) -> Sampling | None:
    """Return the surface between the nodes of a contact.

    It is None where the parts cannot separate, or where the gap is known only at nodes.
    """
    at_nodes_only = side.law.gap is not None and not side.law.gap.everywhere
    if side.law.normal != "unilateral" or at_nodes_only:
        return None
    mesh = meshes[side.body]
    element, faces = mesh.faces(side.part)
    # a function may have a narrow minimum, and is cheaper to evaluate than a ray is to cast
    fine = 1 + math.ceil(2 * ACROSS / len(element) ** (1.0 / (mesh.dim - 1)))
    across = faces.SAMPLES if side.law.gap is None else max(faces.SAMPLES, fine)
    narrow = narrow_places(mesh, side.part, [] if side.law.gap is None else [side.law.gap])
    return Sampling(mesh, interface.nodes, element, faces, _gap_at(side, meshes), across, narrow)


def _gap_at(side: PosedInterface, meshes: list[BoundaryMesh]) -> GapAt:
    mesh, gap = meshes[side.body], side.law.gap
    if gap is not None:
        return lambda element, local, x, normal: gap.near(
            Sites(x, normal, mesh.arc_lengths(element, local)), np.inf
        )
    if side.primary is None:
        return lambda element, local, x, normal: np.zeros(len(x))
    opposite = meshes[side.primary[0]].faces(side.primary[1])[1]
    return lambda element, local, x, normal: (
        opposite.cast(x, np.array(along(side.direction, normal))).distance
    )
