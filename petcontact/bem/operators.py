"""The boundary integral equations (4.10) as columns of G and H, reached by blocks of exact entries.

Unknown 2i + c belongs to node i and direction c: a displacement [length] where the traction is known, else a traction
times ℓ/2µ [length], ℓ being the length of the logarithm. Equation 2i + a is component a of (4.10) at node i. With that
scaling every entry is a pure number, and none depends on the units of length and stress.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..mesh.curve_mesh import Batch, BoundaryMesh
from ..model.problem import Material
from .boundary_data import BoundaryData
from .column_blocks import Tile, as_slice, common, put, some
from .kelvin2d.integrals import integrals

TILE = (512, 96)
"""Targets and nodes of one tile: its temporaries fit a core's second-level cache."""
SMALL = 1000
"""Nodes of meshes whose tiles reach over all parts: there the calls cost more than kernels that are not needed."""
RESIDUAL_NODES = 4096
"""Nodes whose kernels a residual holds at a time."""


@dataclass(frozen=True)
class BoundaryOperators:
    """The mixed operator A_0, the contact columns G_Ct and the load, reached by blocks of exact entries.

    Attributes
    ----------
    mesh : BoundaryMesh
    data : BoundaryData
    material : Material
    log_length : float
        The length that makes the argument of the kernel's logarithm a pure number (`Outline.log_length`).
    """

    mesh: BoundaryMesh
    data: BoundaryData
    material: Material
    log_length: float

    @property
    def traction_scale(self) -> float:
        """2µ/ℓ: tractions are unknowns times it [stress/length]."""
        return 2.0 * self.material.shear_modulus / self.log_length

    def system_entries(self, rows: Index, columns: Index) -> Array:
        """Entries of A_0, (2 len(rows), 2 len(columns)), between collocation nodes in increasing order."""
        return self._blocks(rows, columns, outer=False)[0]

    def outer_entries(self, rows: Index, columns: Index) -> Array:
        """Entries beside A_0, (2 len(rows), number of nodes with such a column among the columns).

        A contact node has its column of G_Ct times `traction_scale`, a loaded node what its known data add to the load
        over `load_scale`.
        """
        return self._blocks(rows, columns, system=False)[0]

    def all_entries(self, rows: Index, columns: Index) -> list[Array]:
        """`system_entries` and `outer_entries` at the price of one."""
        return self._blocks(rows, columns)

    def _blocks(self, rows: Index, columns: Index, *, system: bool = True, outer: bool = True) -> list[Array]:
        a_0 = np.empty((len(columns), 2, len(rows), 2)) if system else None
        beside = np.zeros((np.count_nonzero(self.outer_slot[columns] >= 0), len(rows), 2)) if outer else None
        for tile in self.tiles(columns):
            self.fill(rows, tile, system=a_0, beside=beside)
        return [block.reshape(-1, 2 * len(rows)).T for block in (a_0, beside) if block is not None]

    @functools.cached_property
    def outer_slot(self) -> Index:
        """Place of each node among those with a column of `outer_entries`, -1 elsewhere, (n,)."""
        loaded = np.any(self.data.value != 0.0, axis=1)
        assert not loaded[self.data.contact_nodes].any(), "known data other than zero in contact"
        has = loaded | (self._contact_slot >= 0)
        return np.where(has, np.cumsum(has) - 1, -1)

    @functools.cached_property
    def load_scale(self) -> float:
        """Largest of the known data, by which columns of the load are divided."""
        return float(max(np.abs(self._given).max(initial=0.0), np.abs(self._moved).max(initial=0.0))) or 1.0

    def load(self, rows: Index) -> Array:
        """The load G t̂ - (½ + H) û at some nodes, (2 len(rows),)."""
        load = np.zeros((len(rows), 2))
        for tile in self.tiles():
            self.fill(rows, tile, load=load)
        return load.ravel()

    def residual(self, rows: Index, u: Array, traction: Array) -> Array:
        """½u + Hu - Gt at some nodes, (len(rows), 2) [length], from exact entries: zero for the discrete solution."""
        result = 0.5 * u[rows]
        targets, scaled = self.mesh.targets(rows), traction / (2.0 * self.material.shear_modulus)
        for batch in self.mesh.batches():
            per_element = batch.elements.order + 1
            step = max(1, RESIDUAL_NODES // per_element)
            for first in range(0, len(batch.elements.index), step):
                elements = self.mesh.elements(batch.elements.index[first : first + step])
                nodes = batch.nodes[first * per_element : (first + step) * per_element]
                kernel_g, kernel_h = integrals(targets, elements, self.material.plane_strain_ratio, self.log_length)
                assert kernel_g is not None and kernel_h is not None
                for a in range(2):
                    for j in range(2):
                        result[:, a] += u[nodes, j] @ kernel_h[a, j] - scaled[nodes, j] @ kernel_g[a, j]
        return result

    def split(self, unknowns: Array, sigma_t: Array) -> tuple[Array, Array]:
        """Displacement and traction (n, 2) on the whole boundary from the unknowns (2n,) and σ_t (m, 1) on Γ_C."""
        data = self.data
        coefficients = unknowns.reshape(-1, 2)
        u = np.where(data.traction_known, coefficients, data.value)
        traction = np.where(data.traction_known, data.value, coefficients * self.traction_scale)
        traction[data.contact_nodes, data.contact_direction] = sigma_t[:, 0]
        return np.einsum("ic,icj->ij", u, data.frame), np.einsum("ic,icj->ij", traction, data.frame)

    # -- tiles ----------------------------------------------------------------------------------------------------

    def tiles(self, columns: Index | None = None) -> list[Tile]:
        """Columns (all nodes, or some in increasing order) cut into pieces of one part and order.

        All nodes of a small mesh come in one piece an order, else in pieces of about TILE[1]; some, asked for by a
        compression, in as few pieces as can be, since there the calls cost more than the numbers.
        """
        whole = columns is None
        nodes = np.arange(self.mesh.n_nodes) if columns is None else columns
        group, places = self._group[nodes], np.arange(len(nodes))
        small = whole and len(nodes) <= SMALL
        if whole:
            # orders may change from element to element
            group = group % 8 if small else group
            places = np.argsort(group, kind="stable")
            nodes, group = nodes[places], group[places]
        slot = self._contact_slot[nodes] if whole else self.outer_slot[nodes]
        if not whole:
            slot = np.where(slot >= 0, np.cumsum(slot >= 0) - 1, -1)
        cuts = np.flatnonzero(group[1:] != group[:-1]) + 1
        result = []
        for first, last in itertools.pairwise([0, *cuts.tolist(), len(nodes)]):
            per_element = int(group[first] % 8) + 1
            step = max(1, TILE[1] // per_element) * per_element if whole and not small else last - first
            for start in range(first, last, step):
                piece = slice(start, min(start + step, last))
                place = as_slice(places[piece]) if whole else piece
                result.append(self._tile(nodes[piece], place, slot[piece], per_element, shifted=not whole))
        return result

    def _tile(self, nodes: Index, place: Any, slot: Index, per_element: int, *, shifted: bool) -> Tile:
        """Nodes of one part and order, where their columns go, and where those beside A_0 go (-1 for none)."""
        elements, pick = self.mesh.element[nodes], None
        if per_element > 1:
            new = np.concatenate([[True], elements[1:] != elements[:-1]])
            elements = elements[new]
            if len(nodes) < per_element * len(elements):
                pick = (np.cumsum(new) - 1) * per_element + nodes - self.mesh.first_node[self.mesh.element[nodes]]
        beside = np.flatnonzero(slot >= 0)
        moved = self._moved[nodes]
        shift = moved[beside] / self.load_scale if shifted and len(beside) and moved.any() else None
        return Tile(
            batch=Batch(self.mesh.elements(elements), nodes), place=place, pick=pick,
            known=self.data.traction_known[nodes], frame=self.data.frame[nodes], given=self._given[nodes], moved=moved,
            beside=beside, beside_place=as_slice(slot[beside]), push=self._push[nodes[beside]], shift=shift,
        )  # fmt: skip

    @functools.cached_property
    def _group(self) -> Index:
        """Nodes of one part and order have one number."""
        return (self.mesh.part * 8 + self.mesh.order)[self.mesh.element]

    @functools.cached_property
    def _contact_slot(self) -> Index:
        """Place of each node among the contact nodes, -1 elsewhere."""
        slot = np.full(self.mesh.n_nodes, -1)
        slot[self.data.contact_nodes] = np.arange(len(self.data.contact_nodes))
        return slot

    @functools.cached_property
    def _given(self) -> Array:
        """Known tractions over `traction_scale` as vectors, (n, 2) [length]."""
        known = np.where(self.data.traction_known, self.data.value, 0.0)
        return np.asarray(np.einsum("ic,icj->ij", known, self.data.frame)) / self.traction_scale

    @functools.cached_property
    def _moved(self) -> Array:
        """Known displacements as vectors, (n, 2) [length]."""
        known = np.where(self.data.traction_known, 0.0, self.data.value)
        return np.asarray(np.einsum("ic,icj->ij", known, self.data.frame))

    @functools.cached_property
    def _push(self) -> Array:
        """Tractions behind the columns of `outer_entries`, (n, 2)."""
        push = self._given / self.load_scale
        push[self.data.contact_nodes] = self.data.tangent
        return push

    def _kernels(self, rows: Index, tile: Tile, displacement: bool, traction: bool) -> tuple[Array | None, Array | None]:
        kernels = integrals(
            self.mesh.targets(rows), tile.batch.elements, self.material.plane_strain_ratio, self.log_length,
            displacement=displacement, traction=traction,
        )  # fmt: skip
        if kernels[0] is not None and self.log_length != 1.0:
            kernels[0][...] /= self.log_length
        if tile.pick is None:
            return kernels
        kernel_g, kernel_h = (None if k is None else k[:, :, tile.pick] for k in kernels)
        return kernel_g, kernel_h

    def fill(
        self, rows: Index, tile: Tile, *, system: Array | None = None, beside: Array | None = None,
        load: Array | None = None,
    ) -> None:  # fmt: skip
        """One tile into what is given of system[column, direction, row, component], beside[column, row, component] and
        load[row, component] (added). Beside A_0 stand the contact columns, or those of `outer_entries` (zero before)."""
        beside = beside if len(tile.beside) else None
        loads = load is not None
        pushes = (loads and bool(tile.given.any())) or (beside is not None and bool(tile.push.any()))
        moves = (loads and bool(tile.moved.any())) or (beside is not None and tile.shift is not None)
        wants_g = system is not None and not tile.known.all()
        wants_h = system is not None and bool(tile.known.any())
        if not (wants_g or wants_h or pushes or moves):
            return
        kernel_g, kernel_h = self._kernels(rows, tile, wants_g or pushes, wants_h or moves)
        if system is not None:
            for c in range(2):
                put(system, (tile.place, c), kernel_h, tile.frame[:, c], tile.known[:, c])
                put(system, (tile.place, c), kernel_g, -tile.frame[:, c], ~tile.known[:, c])
        if load is not None:
            for a in range(2):
                if pushes and kernel_g is not None:
                    load[:, a] += tile.given[:, 0] @ kernel_g[a, 0] + tile.given[:, 1] @ kernel_g[a, 1]
                if moves and kernel_h is not None:
                    load[:, a] -= tile.moved[:, 0] @ kernel_h[a, 0] + tile.moved[:, 1] @ kernel_h[a, 1]
        if beside is not None:
            if pushes:
                every = np.ones(len(tile.push), dtype=bool)
                put(beside, (tile.beside_place,), some(kernel_g, tile.beside), tile.push, every)
            if tile.shift is not None:
                kernel, (x, y) = some(kernel_h, tile.beside), tile.shift.T
                for a in range(2):
                    beside[tile.beside_place, :, a] -= kernel[a, 0] * x[:, None] + kernel[a, 1] * y[:, None]
        self._add_free_term(rows, tile, system, beside, load if moves else None)

    def _add_free_term(
        self, rows: Index, tile: Tile, system: Array | None, beside: Array | None, load: Array | None
    ) -> None:
        """½ I, where a node of the tile is its own target."""
        nodes = tile.batch.nodes
        if nodes[-1] < rows[0] or nodes[0] > rows[-1]:
            return
        row, column = common(rows, nodes)
        if not len(row):
            return
        if system is not None:
            place = np.arange(len(system))[tile.place][column]
            for c in range(2):
                system[place, c, row] += 0.5 * tile.known[column, c, None] * tile.frame[column, c]
        if load is not None:
            load[row] -= 0.5 * tile.moved[column]
        if beside is not None and tile.shift is not None:
            mine, own = common(nodes[tile.beside], rows)
            beside[np.arange(len(beside))[tile.beside_place][mine], own] -= 0.5 * tile.shift[mine]
