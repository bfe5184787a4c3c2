"""Columns beside A_0: those of contact directions, those of known data and volume loads for the
load of each state, and rigid translations.

With a particular solution u_p, t_p for the volume loads (½ + H) u - G t is (½ + H) u_p - G t_p
instead of 0, so that what is known acts together with -t_p and -u_p (C. A. Brebbia, J. C. F.
Telles, L. C. Wrobel, Boundary Element Techniques, Springer 1984, section 6.3).
"""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array, Index, ranked
from ..record import record
from ..round_off import ROUNDED
from .boundary_data import BoundaryData

Columns = tuple[Index, Array, Array, Array]
"""Nodes (q,), tractions over the scale and displacements (q, d), and amplitudes (q, K)."""


@record
class RightHandSides:
    """Columns beside A_0, each of one node: G times a traction minus (½ + H) times a displacement
    there.

    Attributes
    ----------
    node : (q,) array
        Increasing.
    traction, displacement : (q, d) arrays
        In units of the kernel's `traction_scale` and of length.
    n_nodes : int
        Of the whole mesh.
    """

    node: Index
    traction: Array
    displacement: Array
    n_nodes: int

    @functools.cached_property
    def count(self) -> Index:
        """Return the number of columns of each node, (n,)."""
        return np.bincount(self.node, minlength=self.n_nodes)

    @functools.cached_property
    def first(self) -> Index:
        """Return the number of the first column of each node, (n,)."""
        return np.cumsum(self.count) - self.count

    def near(self, columns: RightHandSides) -> bool:
        """Return whether the columns are equal except for round-off."""
        pairs = ((self.traction, columns.traction), (self.displacement, columns.displacement))
        return np.array_equal(self.node, columns.node) and all(
            bool(np.all(np.abs(values - others) <= ROUNDED * np.abs(others).max(initial=0.0)))
            for values, others in pairs
        )

    def columns_of(self, nodes: Index) -> tuple[Index, Index]:
        """Return the columns of some nodes and the node of each column."""
        owner, within = ranked(self.count[nodes])
        return self.first[nodes][owner] + within, owner


def columns_beside(
    data: BoundaryData, traction_scale: float, translated: tuple[int, ...] = ()
) -> tuple[RightHandSides, Array]:
    """Return the right-hand sides and their amplitudes in each state, (q, K + t). Those of contact
    come first at each node. The last states are translations along t axes.

    Of data that are there in one state only a loaded node has one column, over the largest of them;
    else one for each component that is known and not 0 in any state, and as many for volume loads
    as they are linearly independent.
    """
    (m, k), d = data.contact_shape, data.frame.shape[1]
    contact = np.repeat(data.contact_nodes, k), data.contact_frame.reshape(m * k, d)
    groups = [(*contact, np.zeros((m * k, d)), np.zeros((m * k, data.states)))]
    groups += (
        _of_components(data, traction_scale)
        if data.loaded[:-1].any()
        else [_of_last_state(data, traction_scale)]
    )
    n, t = len(data.frame), len(translated)
    shift = np.tile(np.eye(d)[list(translated)], (n, 1))
    groups.append((np.repeat(np.arange(n), t), 0.0 * shift, shift, np.zeros((n * t, data.states))))
    node, traction, displacement, amplitudes = (
        np.concatenate(columns) for columns in zip(*groups, strict=True)
    )
    moved = np.zeros((len(node), t))
    moved[len(node) - n * t :] = np.tile(np.eye(t), (n, 1))
    order = np.argsort(node, kind="stable")
    return RightHandSides(node[order], traction[order], displacement[order], n), np.hstack(
        [amplitudes, moved]
    )[order]


def _of_last_state(data: BoundaryData, traction_scale: float) -> Columns:
    """Return one column for each node."""
    traction, u = data.known_traction[-1], data.known_displacement[-1]
    if data.volume is not None:
        u, traction = u - data.volume[0, -1], traction - data.volume[1, -1]
    traction = traction / traction_scale
    scale = max(float(np.abs(vectors).max(initial=0.0)) for vectors in (u, traction)) or 1.0
    loaded = np.flatnonzero(traction.any(axis=1) | u.any(axis=1))
    amplitudes = np.zeros((len(loaded), data.states))
    amplitudes[:, -1] = scale
    return loaded, traction[loaded] / scale, u[loaded] / scale, amplitudes


def _of_components(data: BoundaryData, traction_scale: float) -> list[Columns]:
    """Return one column for each known component of a node, and one for each node and independent
    load of the volume."""
    loaded, component = np.nonzero(np.any(data.value != 0.0, axis=0))
    unit = data.frame[loaded, component]
    traction_known = data.traction_known[loaded, component, None]
    values = np.where(data.traction_known, data.value / traction_scale, data.value)[
        :, loaded, component
    ]
    columns = [
        (loaded, np.where(traction_known, unit, 0.0), np.where(traction_known, 0.0, unit), values.T)
    ]
    if data.volume is not None:
        u, traction = data.volume[0], data.volume[1] / traction_scale
        ways, sizes, shapes = np.linalg.svd(
            np.concatenate([u, traction], axis=2).reshape(len(u), -1), full_matrices=False
        )
        for way, size, shape in zip(
            ways.T, sizes, -shapes.reshape(len(shapes), len(data.frame), -1), strict=True
        ):
            if size > ROUNDED * sizes[0]:
                d = data.frame.shape[1]
                columns.append(
                    (
                        np.arange(len(shape)),
                        shape[:, d:],
                        shape[:, :d],
                        np.tile(size * way, (len(shape), 1)),
                    )
                )
    return columns
