"""Known displacements and tractions at the nodes of a mesh, their directions, and the rigid motions
that they leave free."""

from __future__ import annotations

import itertools
from functools import cached_property

import numpy as np

from ..arrays import Array, Index, Mask, marked
from ..geometry.rotation import lifted
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import record, replace
from ..round_off import ROUNDED, SOLVED

TINY = 1e-4
"""Size of the smallest element over that of the body, above which a motion smaller than the body
costs no digits."""
LEFT = 0.1
"""Share of known displacements that is left beside their common rigid motion. Where more is left,
no rigid motion is taken out [-]."""


@record
class BoundaryData:
    """Known values at each of n nodes in K load states, in d orthogonal directions for each node.

    Attributes
    ----------
    frame : (n, d, d) array
        `frame[i, c]` is direction c of node i: the axes, or tangents and normal where the normal
        displacement of a contact is known, in the order in which they are nearest to the axes, so
        that the diagonal of the system is not small.
    traction_known : (n, d) bool array
        True where the traction component is known (the displacement is the unknown), also in the
        contact directions, whose traction is what a method looks for.
    value : (K, n, d) array
        The known displacement [length] or traction [stress] in each state; 0 in the contact
        directions.
    contact_nodes : (m,) array
        Numbers of the nodes that may carry contact tractions, increasing.
    contact_directions : (m, k) array
        The directions c of each contact node whose traction a method looks for: all, or its d-1
        tangents.
    point : (f, d) array
        Points at which forces act [length].
    force : (K, f, d) array
        [force/length, in space force]
    volume : (3, K, n, d) array, optional
        Of a particular solution for the volume loads of each state, displacement [length] and
        traction [stress]; and of one for the forces alone the traction, whose resultant is given.
    rigid : (K, n, d) array, optional
        Rigid motions that were taken out of the known displacements, to be added to whatever
        follows from them [length].
    """

    frame: Array
    traction_known: Mask
    value: Array
    contact_nodes: Index
    contact_directions: Index
    point: Array
    force: Array
    volume: Array | None = None
    rigid: Array | None = None

    @property
    def states(self) -> int:
        """Return the number of load states K."""
        return len(self.value)

    @property
    def contact_shape(self) -> tuple[int, int]:
        """Return the number of contact nodes m and the number of unknown tractions of each, k."""
        m, k = self.contact_directions.shape
        return m, k

    @property
    def contact_frame(self) -> Array:
        """Return the contact directions as vectors, (m, k, d)."""
        return np.asarray(self.frame[self.contact_nodes[:, None], self.contact_directions])

    @property
    def contact_unknowns(self) -> Index:
        """Numbers of the displacements in the contact directions among the unknowns d·node + c, (m
        k,)."""
        return (self.frame.shape[1] * self.contact_nodes[:, None] + self.contact_directions).ravel()

    @property
    def sliding(self) -> Array:
        """Return the rigid motions along the contact directions, (K, m, k)."""
        if self.rigid is None:
            return np.zeros((self.states, *self.contact_directions.shape))
        return np.asarray(
            np.einsum("mcj,kmj->kmc", self.contact_frame, self.rigid[:, self.contact_nodes])
        )

    @property
    def known_traction(self) -> Array:
        """Return the known tractions as vectors, (K, n, d) [stress]."""
        return self.vectors(np.where(self.traction_known, self.value, 0.0))

    @property
    def known_displacement(self) -> Array:
        """Return the known displacements as vectors, (K, n, d) [length]."""
        return self.vectors(np.where(self.traction_known, 0.0, self.value))

    @property
    def displaced(self) -> Array:
        """Return what H acts on in the loads: known displacements less those of the particular
        solution, (K, n, d) [length]."""
        return self.known_displacement - (0.0 if self.volume is None else self.volume[0])

    @property
    def loaded(self) -> Mask:
        """Whether anything acts or is displaced in each state, (K,)."""
        acting = [
            self.value,
            self.force,
            *([] if self.volume is None else self.volume),
            *([] if self.rigid is None else [self.rigid]),
        ]
        return np.asarray(np.any([values.any(axis=(1, 2)) for values in acting], axis=0))

    def vectors(self, components: Array) -> Array:
        """Return vectors (..., n, d) from their components along the frames (..., n, d)."""
        return (
            np.asarray(np.einsum("...ic,icj->...ij", components, self.frame))
            if self._turned
            else components
        )

    @cached_property
    def _turned(self) -> bool:
        """Return whether any frame differs from the axes of the coordinates."""
        return bool((self.frame != np.eye(self.frame.shape[1])).any())

    def components(self, vectors: Array) -> Array:
        """Components along the frames of vectors (n, d, r) that vary by their last axis, (n, d,
        r)."""
        return np.asarray(np.einsum("icj,ijr->icr", self.frame, vectors))

    def has_matrix_of(self, data: BoundaryData) -> bool:
        """Return whether other data know the same quantities in the same directions, so that A_0 is
        the same and only values differ."""
        names = ("frame", "traction_known", "contact_nodes", "contact_directions")
        return self.states == data.states and all(
            np.array_equal(getattr(self, n), getattr(data, n)) for n in names
        )

    def equals(self, data: BoundaryData) -> bool:
        """Return whether other data have the same matrix and the same values."""
        pairs = [
            (getattr(self, name), getattr(data, name))
            for name in ("value", "point", "force", "volume", "rigid")
        ]
        return self.has_matrix_of(data) and all(
            own is given or (own is not None and given is not None and np.array_equal(own, given))
            for own, given in pairs
        )

    def reordered(self, nodes: Index) -> BoundaryData:
        """Return the data with node nodes[i] as node i."""
        position = np.argsort(nodes)[self.contact_nodes]
        order = np.argsort(position)
        return replace(
            self,
            frame=self.frame[nodes],
            traction_known=self.traction_known[nodes],
            value=self.value[:, nodes],
            contact_nodes=position[order],
            contact_directions=self.contact_directions[order],
            volume=None if self.volume is None else self.volume[:, :, nodes],
            rigid=None if self.rigid is None else self.rigid[:, nodes],
        )


def contact_frames(mesh: BoundaryMesh, nodes: Index) -> tuple[Array, Index]:
    """Frames (m, d, d) of tangents and normal, and where in them the tangents and then the normal
    went, (m, d)."""
    normal, d = mesh.smooth_normal[nodes], mesh.components
    vectors = np.concatenate([mesh.slip_directions(normal), lifted(normal, d)[:, None]], axis=1)
    # of all orders that in which the directions are nearest to the axes
    orders = np.array(list(itertools.permutations(range(d))))
    along = np.abs(vectors[:, orders, np.arange(d)]).sum(axis=2)
    order = orders[np.argmax(along, axis=1)]
    return np.take_along_axis(vectors, order[:, :, None], axis=1), np.argsort(order, axis=1)


def _at_rest(rows: Array) -> Array:
    """Return amplitudes (r, s) of the combinations of r motions that do not move the components in
    the rows (k, r)."""
    _, strengths, ways = np.linalg.svd(rows, full_matrices=True)
    strengths = np.append(strengths, np.zeros(len(ways) - len(strengths)))
    return np.asarray(ways[strengths <= 1e-12 * max(1.0, strengths.max(initial=0.0))].T)


def without_rigid_motion(data: BoundaryData, mesh: BoundaryMesh) -> BoundaryData:
    """Return the known displacements without their common rigid motion, where that motion costs
    digits.

    Large motions swallow what strains the body: of tractions on elements of size h all those below
    their round-off over h. Curved elements do not hold a rotation, and are strained by what they
    miss of it: displacements that are nothing else are taken out, on elements of order 1 or more,
    whose nodes tell a rotation from data that are constant on each of them. Motions that leave
    known normals of contact at rest are taken out only; none is of an infinite plate, at rest far
    away.
    """
    given = ~data.traction_known
    extent = float(np.ptp(mesh.x, axis=0).max())
    largest = np.abs(data.value[:, given]).max(initial=0.0)
    if largest == 0.0 or mesh.weight @ np.sum(mesh.x * mesh.normal, axis=1) < 0.0:
        return data
    tiny = float(mesh.measure.min()) ** (1.0 / (mesh.dim - 1)) < TINY * extent
    modes = unit_motions(mesh)
    along = data.components(modes)
    contact = marked(data.contact_nodes, mesh.n_nodes)
    free = _at_rest(along[given & contact[:, None]])
    elsewhere = given & ~contact[:, None]
    amplitudes = (
        free @ np.linalg.lstsq(along[elsewhere] @ free, data.value[:, elsewhere].T, rcond=None)[0]
    )
    value, there = data.value.copy(), np.abs(data.value[:, elsewhere]).max(initial=0.0)
    left = data.value[:, elsewhere] - (along[elsewhere] @ amplitudes).T
    if not ((largest > extent or tiny) and np.abs(left).max(initial=0.0) <= LEFT * there):
        size, rest = (
            np.abs(values).max(axis=1, initial=0.0) for values in (data.value[:, elsewhere], left)
        )
        held = (mesh.order > 0)[mesh.element][elsewhere.any(axis=1)].all()
        turned = (
            held
            & (rest <= SOLVED * size)
            & (
                np.abs(amplitudes[len(mesh.motions.along) :]).max(axis=0, initial=0.0)
                > SOLVED * size
            )
        )
        if not turned.any():
            return data
        amplitudes = amplitudes * turned
        left = np.where(turned[:, None], 0.0, data.value[:, elsewhere])
    value[:, elsewhere] = np.where(np.abs(left) > ROUNDED * there, left, 0.0)
    return replace(data, value=value, rigid=np.moveaxis(modes @ amplitudes, 2, 0))


def unit_motions(mesh: BoundaryMesh) -> Array:
    """The rigid motions, rotations about the body's middle, of about unit size, (n, d, r) [-]."""
    size = half_extent(mesh)
    return mesh.motions.modes(mesh.x / size, _middle(mesh) / size)


def half_extent(mesh: BoundaryMesh) -> float:
    """Return the largest distance of a node from the boundary's middle along an axis [length]."""
    return float(np.abs(mesh.x - _middle(mesh)).max())


def _middle(mesh: BoundaryMesh) -> Array:
    return np.asarray(mesh.weight @ mesh.x / mesh.weight.sum())


def free_motions(data: BoundaryData, mesh: BoundaryMesh) -> Array:
    """Return the rigid motions (n, d, r) that change no known displacement [-]."""
    motions = unit_motions(mesh)
    seen = data.components(motions)[~data.traction_known]
    if len(seen) == 0:
        return motions
    values, vectors = np.linalg.eigh(seen.T @ seen / len(seen))
    free = vectors[:, values < 1e-12]
    if not free.shape[1]:
        return motions[..., :0]
    # translations along the axes stay what they are where they are free
    basis = free @ np.linalg.qr(free.T)[0]
    return np.asarray(motions @ np.where(np.abs(basis) < 1e-12, 0.0, basis))


def motion_name(motion: Array, mesh: BoundaryMesh) -> str:
    """Return `rotate` or `translate along (...)`, the words for a rigid motion (n, d)."""
    mean = mesh.weight @ motion / mesh.weight.sum()
    if np.abs(motion - mean).max() > 1e-6 * np.abs(motion).max():
        return "rotate"
    return f"translate along ({', '.join(f'{value:.2g}' for value in mean / np.linalg.norm(mean))})"
