"""Surface meshes in space: flat or curved panels of order 0 to 3 with interior nodes.

Panels need not match across edges.
"""

from __future__ import annotations

import functools
from collections.abc import Iterator
from typing import ClassVar

import numpy as np
import scipy

from ..arrays import Array, Index, ranked
from ..geometry.rotation import SPACE, Motions
from ..geometry.surface import CUTS
from ..record import field, record
from .basis import COINCIDE
from .boundary_mesh import Batch, BoundaryMesh
from .curved.curved_panels import CurvedPanels, make_curved_panels
from .curved.smooth_normals import smooth_normals
from .pairs.panel_faces import PanelFaces
from .panels import Panels, make_panels, monomials, reference_nodes

TRIANGLE, CURVED = 4, 8
"""Added to the order of triangles (`TRIANGLE`) and of curved panels (`CURVED`) to make the kind."""


@record
class SurfaceMesh(BoundaryMesh):
    """Discontinuous panels on the surface of a body (see `boundary_mesh.BoundaryMesh`).

    Attributes
    ----------
    corners : (n_elements, 4, 3) array
        Counter-clockwise seen from outside; the last corner of triangles is NaN [length].
    order : (n_elements,) array
        Order p of each panel, 0 to 3.
    part : (n_elements,) array
        Number of the part in `part_names`.
    part_names : tuple of str
    middles : (n_elements, 5, 3) array, optional
        Middles of the sides of curved panels, from the one after the first corner on, and the
        centre of quadrilaterals. They are NaN on flat panels and where triangles have none
        [length].
    """

    corners: Array
    order: Index
    part: Index
    part_names: tuple[str, ...]
    middles: Array = field(default_factory=lambda: np.empty((0, 5, 3)))
    dim: ClassVar[int] = 3
    components: ClassVar[int] = 3
    weight_power = 2
    motions: ClassVar[Motions] = SPACE
    stresses: ClassVar[tuple[str, ...]] = ("xx", "yy", "zz", "xy", "xz", "yz")
    x: Array = field(init=False)
    normal: Array = field(init=False)
    weight: Array = field(init=False)
    element: Index = field(init=False)
    first_node: Index = field(init=False)
    kind: Index = field(init=False)
    _groups: dict[int, Panels | CurvedPanels] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        middles = self.middles if len(self.middles) else np.full((len(self.corners), 5, 3), np.nan)
        triangle, curved = np.isnan(self.corners[:, 3, 0]), ~np.isnan(middles[:, 0, 0])
        kind = self.order + TRIANGLE * triangle + CURVED * curved
        counts = np.where(triangle, (self.order + 1) * (self.order + 2) // 2, (self.order + 1) ** 2)
        first = np.concatenate([[0], np.cumsum(counts)])
        x, normal, weight = np.empty((first[-1], 3)), np.empty((first[-1], 3)), np.empty(first[-1])
        groups: dict[int, Panels | CurvedPanels] = {}
        for number in np.unique(kind).tolist():
            members = np.flatnonzero(kind == number)
            corners = 3 if number & TRIANGLE else 4
            nodes = first[members][:, None] + np.arange(counts[members[0]])
            if number & CURVED:
                points = np.concatenate(
                    [self.corners[members, :corners], middles[members, : 2 * corners - 3]], axis=1
                )
                groups[number], x[nodes], weight[nodes], normal[nodes] = make_curved_panels(
                    points, number % TRIANGLE, members
                )
            else:
                flat, x[nodes], weight[nodes] = make_panels(
                    self.corners[members, :corners], number % TRIANGLE, members
                )
                groups[number], normal[nodes] = flat, flat.frame[:, None, 2]
        element = np.repeat(np.arange(len(counts)), counts)
        values = {
            "middles": middles,
            "x": x,
            "normal": normal,
            "weight": weight,
            "element": element,
            "first_node": first,
            "kind": kind,
            "_groups": groups,
        }
        vars(self).update(values)

    @functools.cached_property
    def smooth_normal(self) -> Array:
        """As in `BoundaryMesh`; on curved panels they are those of `smooth_normals`, (n, 3)."""
        normal = self.normal.copy()
        curved = [group for group in self._groups.values() if isinstance(group, CurvedPanels)]
        for group, unit in zip(curved, smooth_normals(curved), strict=True):
            normal[self.first_node[group.index][:, None] + np.arange(group.n_nodes)] = unit
        return normal

    @functools.cached_property
    def spheres(self) -> tuple[Array, Array]:
        """As in `BoundaryMesh`; the radius is the distance of the corners from the middle."""
        centre, radius = np.empty((self.n_elements, 3)), np.empty(self.n_elements)
        for batch in self.batches():
            panels = batch.elements
            centre[panels.index], radius[panels.index] = panels.centre, panels.size
        return centre, radius

    @property
    def boxes(self) -> tuple[Array, Array]:
        """Least and largest coordinates of the points of each panel, (n_elements, 3) each
        [length]."""
        points = np.concatenate([self.corners, self.middles], axis=1)
        return np.nanmin(points, axis=1), np.nanmax(points, axis=1)

    @property
    def unit_length(self) -> float:
        """A quarter of the edge of the cube with the same surface [length]."""
        return 0.25 * float(np.sqrt(self.weight.sum() / 6.0))

    def sides_of(self, panels: Index) -> tuple[Index, Index, Array]:
        """Return the panel of each side of panels and its number there, (s,) each, and the sides'
        starts, ends and middles, (3, s, 3) [length]."""
        count = np.where(self.kind[panels] & TRIANGLE, 3, 4)
        owner, k = ranked(count)
        panel, after = panels[owner], (k + 1) % count[owner]
        corners = self.corners[panel]
        row = np.arange(len(panel))
        return panel, k, np.stack([corners[row, k], corners[row, after], self.middles[panel, k]])

    def reordered(self, elements: Index) -> SurfaceMesh:
        """Return the mesh of the panels `elements`, in this order."""
        corners, middles = self.corners[elements], self.middles[elements]
        return SurfaceMesh(
            corners, self.order[elements], self.part[elements], self.part_names, middles
        )

    @staticmethod
    def tangents_to(normal: Array) -> Array:
        """Return orthonormal tangents (m, 2, 3) to unit vectors.

        They are near the two coordinate axes that are farthest from the vector.
        """
        away = np.abs(normal).argmax(axis=1)
        axes = np.eye(3)
        i, j = np.where(away == 0, 1, 0), np.where(away == 2, 1, 2)
        first = axes[i] - normal[np.arange(len(normal)), i, None] * normal
        first /= np.linalg.norm(first, axis=1, keepdims=True)
        second = np.cross(normal, first)
        second *= np.sign(second[np.arange(len(normal)), j])[:, None]
        # no negative zeros: the box's tangents are the axes themselves
        return np.asarray(np.stack([first, second], axis=1) + 0.0)

    def at(self, element: Index, place: Array) -> tuple[Array, Array]:
        """See `BoundaryMesh.at`; places are local coordinates (q, 2) of panels."""
        # samples are many times as many as panels: each panel is taken once
        numbers, row = np.unique(element, return_inverse=True)
        return PanelFaces.from_groups(list(self._groups.values()), numbers).at(row, place)

    @staticmethod
    def lower_degree(kind: int, less: int = 1) -> Array:
        """See `BoundaryMesh.lower_degree`."""
        corners, order = (3 if kind & TRIANGLE else 4), kind % TRIANGLE
        return monomials(
            reference_nodes(corners, order)[0], reference_nodes(corners, max(order - less, 0))[1]
        )

    @functools.cached_property
    def places(self) -> Array:
        """Local coordinates of all nodes on their panels, (n, 2) [-]."""
        result = np.empty((self.n_nodes, 2))
        for panels in self._groups.values():
            nodes = self.first_node[panels.index][:, None] + np.arange(panels.n_nodes)
            result[nodes.ravel()] = panels.nodes.reshape(-1, 2)
        return result

    def batches(self) -> Iterator[Batch]:
        """Return all panels, grouped by shape and order."""
        return (
            Batch(
                panels, (self.first_node[panels.index][:, None] + np.arange(panels.n_nodes)).ravel()
            )
            for panels in self._groups.values()
        )

    def faces(self, *parts: str) -> tuple[Index, PanelFaces]:
        """Return the numbers of the panels of parts, and these panels for contact search."""
        numbers = self.elements_of(*parts)
        return numbers, PanelFaces.from_groups(list(self._groups.values()), numbers)

    def basis_at(self, element: Index, place: Array) -> scipy.sparse.csr_array:
        """Return the sparse matrix (q, n) from nodal values to values at local coordinates (q, 2)
        of panels (q,)."""
        rows = [np.empty(0, dtype=np.int64)]
        columns = [np.empty(0, dtype=np.int64)]
        entries = [np.empty(0)]
        for chosen, panels in self.by_kind(element):
            basis = panels.basis(place[chosen][:, None])[:, 0]
            gap = np.abs(place[chosen][:, None] - panels.nodes).max(axis=2)
            hit = gap.min(axis=1) < COINCIDE
            basis[hit] = gap[hit] < COINCIDE
            rows.append(np.repeat(chosen, panels.n_nodes))
            columns.append(
                (self.first_node[element[chosen]][:, None] + np.arange(panels.n_nodes)).ravel()
            )
            entries.append(basis.ravel())
        triples = np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))
        result = scipy.sparse.csr_array(
            scipy.sparse.coo_array(triples, shape=(len(element), self.n_nodes))
        )
        result.eliminate_zeros()
        return result

    def elements(self, numbers: Index) -> Panels | CurvedPanels:
        """Return panels of one kind as the kernels need them."""
        group = self._groups[int(self.kind[numbers[0]])]
        return group.take(np.searchsorted(group.index, numbers))

    def targets(self, nodes: Index | slice) -> Array:
        """Return collocation nodes as the kernels need them."""
        return self.x[nodes]

    def triangles(self) -> Array:
        """Return flat triangles (t, 3, 3) that stand for the panels [length].

        Curved panels have triangles between all their points.
        """
        points = np.concatenate([self.corners, self.middles], axis=1)
        triangle, curved = self.kind & TRIANGLE > 0, self.kind & CURVED > 0
        return np.concatenate(
            [
                points[(triangle == (corners == 3)) & (curved == bent)][:, cut].reshape(-1, 3, 3)
                for (corners, bent), cuts in CUTS.items()
                for cut in cuts
            ]
        )

    def points(self, x: Array) -> Array:
        """Return points (m, 3) that are no nodes, as the kernels need them."""
        return x


def as_surface(mesh: object) -> SurfaceMesh:
    """Return the mesh of a body in space, with its type."""
    assert isinstance(mesh, SurfaceMesh)
    return mesh
