"""The boundary integral equations (4.10): blocks of exact entries of A_0, of contact columns and of
loads.

Unknown d·i + c belongs to node i and direction c: a displacement [length] where the traction is
known, else a traction over the kernel's `traction_scale` [length]. Equation d·i + a is component a
of (4.10) at node i. With that scaling every entry is a pure number, and none depends on the units
of length and stress.
"""

from __future__ import annotations

import functools

import numpy as np

from ..arrays import Array, Index, Mask
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import record, replace
from ..untyped import Keyed
from .boundary_data import BoundaryData
from .kernel import ColumnData, ColumnFiller, Kernel
from .kernels import column_filler
from .right_hand_sides import RightHandSides, columns_beside

RESIDUAL_NODES = 4096
"""Number of nodes whose kernels a residual keeps in memory at a time."""


@record
class BoundaryOperators:
    """The mixed operator A_0, the contact columns G_Ct and the load as blocks of exact entries.

    Attributes
    ----------
    mesh : BoundaryMesh
    data : BoundaryData
    kernel : Kernel
        Of the mesh's dimension d.
    translated : tuple of int, optional
        Axes of translations, whose loads follow those of the K states.
    """

    mesh: BoundaryMesh
    data: BoundaryData
    kernel: Kernel
    translated: tuple[int, ...] = ()

    def __getstate__(self) -> Keyed:
        """Leave out addresses of compiled code: they mean nothing in another process."""
        return {key: value for key, value in vars(self).items() if key != "_filler"}

    @property
    def traction_scale(self) -> float:
        """Return the factor of the unknowns that are tractions [stress/length]."""
        return self.kernel.traction_scale

    @property
    def n_unknowns(self) -> int:
        """Return the number of unknowns, d for each node."""
        return self.kernel.dim * self.mesh.n_nodes

    def system_entries(self, rows: Index, columns: Index) -> Array:
        """Return entries of A_0, (d len(rows), d len(columns)), between collocation nodes in
        increasing order."""
        return self._blocks(rows, columns, outer=False)[0]

    def outer_entries(self, rows: Index, columns: Index) -> Array:
        """Return entries of the `right_hand_sides` of some nodes, (d len(rows), number of them)."""
        return self._blocks(rows, columns, system=False)[0]

    def all_entries(self, rows: Index, columns: Index) -> list[Array]:
        """Return `system_entries` and `outer_entries` for the cost of one of them."""
        return self._blocks(rows, columns)

    def _blocks(
        self, rows: Index, columns: Index, *, system: bool = True, outer: bool = True
    ) -> list[Array]:
        d, rhs = self.kernel.dim, self.right_hand_sides
        a_0 = np.empty((len(columns), d, len(rows), d)) if system else None
        beside = np.empty((rhs.count[columns].sum(), len(rows), d)) if outer else None
        self.fill_columns(rows, columns, a_0, beside)
        return [
            entries.reshape(-1, d * len(rows)).T for entries in (a_0, beside) if entries is not None
        ]

    def fill_columns(
        self, rows: Index, columns: Index, system: Array | None, right_hand_sides: Array | None
    ) -> None:
        """As `ColumnFiller.fill`: columns of A_0 and of the `right_hand_sides`."""
        self._filler.fill(rows, columns, system, right_hand_sides)
        if system is None or not len(self.mesh.corner_nodes):
            return
        corners = np.intersect1d(self.mesh.corner_nodes, columns)
        for node, gain_g, gain_h in self.kernel.corner_columns(self.mesh, rows, corners):
            column = np.flatnonzero(columns == node)
            for c, (is_free, frame) in enumerate(
                zip(self.data.traction_known[node], self.data.frame[node], strict=True)
            ):
                system[column, c] += np.tensordot(gain_h if is_free else -gain_g, frame, (1, 0)).T

    @property
    def compiled(self) -> tuple[int, int] | None:
        """Addresses of a C function that does what `fill_columns` does, and of its context (see
        native/hmatrix.c)."""
        return None if len(self.mesh.corner_nodes) else self._filler.compiled

    @functools.cached_property
    def _filler(self) -> ColumnFiller:
        """Return the filler for A_0 and the `right_hand_sides`."""
        return column_filler(self.kernel, self.mesh, self._column_data)

    @property
    def _column_data(self) -> ColumnData:
        rhs = self.right_hand_sides
        first = np.append(rhs.first, len(rhs.node))
        return ColumnData(
            self.data.traction_known, self.data.frame, first, rhs.traction, rhs.displacement
        )

    @functools.cached_property
    def _columns(self) -> tuple[RightHandSides, Array]:
        return columns_beside(self.data, self.traction_scale, self.translated)

    @property
    def right_hand_sides(self) -> RightHandSides:
        """Columns beside A_0: one for each contact node and direction, and what known data and
        volume loads add to the load."""
        return self._columns[0]

    @property
    def amplitudes(self) -> Array:
        """Return the factors of the right-hand sides in the load of each state and translation, (q,
        K + t)."""
        return self._columns[1]

    @functools.cached_property
    def of_contact(self) -> Mask:
        """Return which right-hand sides are those of contact directions, (q,)."""
        rhs, data = self.right_hand_sides, self.data
        # of a node the contact directions come first
        looked_for = np.zeros(self.mesh.n_nodes, dtype=np.int64)
        looked_for[data.contact_nodes] = data.contact_shape[1]
        return np.asarray(np.arange(len(rhs.node)) - rhs.first[rhs.node] < looked_for[rhs.node])

    @functools.cached_property
    def point_loads(self) -> Array:
        """Return what point forces add to the load of each state, (d n, K)."""
        mesh, loads = self.mesh, np.zeros((self.n_unknowns, self.data.states))
        if self.data.point.size:
            for state, force in enumerate(self.data.force):
                loads[:, state] = self.point_displacement(np.arange(mesh.n_nodes), force).ravel()
        return loads

    def point_displacement(self, nodes: Index, force: Array) -> Array:
        """Displacement (len(nodes), d) of the infinite plane or space at some nodes by forces (f,
        d) at the points."""
        return self.kernel.point_displacement(self.mesh.x[nodes], self.data.point, force)

    def residual(self, rows: Index, u: Array, traction: Array) -> Array:
        """½u + Hu - Gt of (4.10) at some nodes in increasing order, (len(rows), d) [length], from
        exact entries: zero for the discrete solution."""
        scaled, numbers = traction / self.traction_scale, np.arange(len(u) + 1)
        filler = self._filler.with_data(
            replace(self._column_data, rhs_first=numbers, rhs_traction=scaled, rhs_displacement=u)
        )
        result = np.zeros((len(rows), self.kernel.dim))
        for first in range(0, len(u), RESIDUAL_NODES):
            columns = numbers[first : min(first + RESIDUAL_NODES, len(u))]
            products = np.empty((len(columns), *result.shape))
            filler.fill(rows, columns, None, products)
            result -= products.sum(axis=0)
        for node, gain_g, gain_h in self.kernel.corner_columns(
            self.mesh, rows, self.mesh.corner_nodes
        ):
            is_free, frame = self.data.traction_known[node], self.data.frame[node]
            for vectors, gain, chosen in (
                (u[node], gain_h, is_free),
                (-scaled[node], gain_g, ~is_free),
            ):
                result += np.tensordot(
                    gain, np.where(chosen, frame @ vectors, 0.0) @ frame, (1, 0)
                ).T
        return result

    def split(self, unknowns: Array, shares: Array, sigma: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, d) on the whole boundary from the unknowns (d n,), for load
        states weighted by `shares` (K,) and the tractions in the contact directions (m, k)."""
        data = self.data
        value = np.tensordot(shares, data.value, 1)
        coefficients = unknowns.reshape(value.shape)
        u = np.where(data.traction_known, coefficients, value)
        traction = np.where(data.traction_known, value, coefficients * self.traction_scale)
        traction[data.contact_nodes[:, None], data.contact_directions] = sigma
        u = data.vectors(u)
        return u if data.rigid is None else u + np.tensordot(shares, data.rigid, 1), data.vectors(
            traction
        )
