"""Displacement (4.9) and stress inside a body, from boundary data by exact element integrals."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from ..arrays import Array, Index, shown
from ..bem.kernels import EXPANSIONS, kernel_for
from ..errors import InputError
from ..given.tables.material import Material
from ..mesh.boundary_mesh import Batch, BoundaryMesh, pieces
from ..mesh.curve_mesh import CurveMesh
from ..mesh.ring_mesh import RingMesh
from ..untyped import ArrayLike
from .joints import joints_of
from .smoothing import smoothed
from .stress_state import Field

ENTRIES = 400_000
"""Largest number of pairs of a node and a point that are integrated at once, to limit memory."""
TOGETHER = 0.22
"""Elements of one series, over n_elements^(2/3). A point sums n/s series of s elements, and
integrates over some s²/n elements that are too near for their series; measured at n = 1e5, where a
series takes 0.3 µs a point and an element 0.15 µs, the sum is least for s = 480."""
SERIES = 10_000
"""Largest number of points at which a series is summed at once."""


Progress = Callable[[float], None]
"""Function that is called with the share of the work that is done, from 0 to 1."""


@functools.singledispatch
def stress_across(
    mesh: BoundaryMesh, x: Array, u: Array, stress: Array, material: Material, heat: object = 0.0
) -> Array:
    """Return the normal stress (m,) along the third axis: σ_zz, or the hoop stress of bodies of
    revolution [stress].

    Parameters
    ----------
    mesh : BoundaryMesh
    x, u : (m, d) arrays
        Points of its body and their displacement [length].
    stress : (m, d(d+1)/2) array
        Stress at the points [stress].
    material : Material
    heat : (m,) array, optional
        -EαT, which a temperature T adds in plane strain and in bodies of revolution [stress].
    """
    return np.asarray(stress[:, 2])


@stress_across.register
def _(
    mesh: CurveMesh,
    x: Array,
    u: Array,
    stress: Array,
    material: Material,
    heat: Array | float = 0.0,
) -> Array:
    if material.plane == "stress":
        return np.zeros(len(stress))
    return np.asarray(material.poisson_ratio * (stress[:, 0] + stress[:, 1]) + heat)


@stress_across.register
def _(
    mesh: RingMesh, x: Array, u: Array, stress: Array, material: Material, heat: Array | float = 0.0
) -> Array:
    across = material.poisson_ratio * (stress[:, 0] + stress[:, 1]) + heat
    # on the axis the hoop stress is the radial one
    radial = (stress[:, 0] - across) / material.young_modulus
    return np.asarray(across + material.young_modulus * mesh.over_radius(x, u[:, 0], radial))


def points_in(points: ArrayLike, dim: int) -> Array:
    """Return points as an array (m, dim).

    Raises
    ------
    InputError
        If the array has another shape, or a coordinate is not finite.
    """
    array: Array = np.atleast_2d(np.asarray(points, dtype=float))
    if array.ndim != 2 or array.shape[1] != dim or not np.all(np.isfinite(array)):
        raise InputError(
            f"points: an array (m, {dim}) of finite coordinates is needed, got shape {array.shape}"
        )
    return array


def field_at(
    mesh: BoundaryMesh,
    u: Array,
    traction: Array,
    material: Material,
    points: Array,
    progress: Progress | None = None,
) -> tuple[Array, Array]:
    """Return displacement (m, d) and stress (m, d(d+1)/2) at points, from u and traction (n, d) of
    one state.

    The integrals over elements are exact at every distance, so that both are as accurate as the
    boundary data and their slopes, also close to the boundary (`InteriorField`).

    Parameters
    ----------
    mesh, material
        Of the body.
    u, traction : (n, d) arrays
        At its nodes [length], [stress].
    points : (m, d) array
        Inside the body [length].
    progress : callable, optional
        Called with the share of the elements that is done.

    Examples
    --------
    >>> s = solve("block.toml")
    >>> u, stress = field_at(s.mesh, s.u, s.traction, s.problem.material, [[4.0, 2.0]])
    """
    field = InteriorField(mesh, u[..., None], traction[..., None], material).at(points, progress)
    return field[0][..., 0], field[1][..., 0]


class InteriorField:
    """Displacement and stress inside a body, by Somigliana's identities.

    Data on constant elements are made smooth first, see `smoothing`. The integrals over elements
    are exact at every distance. Next to joints of elements the data are made continuous, see
    `joints`. Hence u and σ are as accurate as the boundary data and their slopes, O(h^(p+1)) and
    O(h^p), at every distance from the boundary. At corners with bounded stress the error of σ may
    still grow like the logarithm of the distance.

    Parameters
    ----------
    mesh : BoundaryMesh
        n nodes.
    u, traction : (n, d, s) arrays
        Boundary displacement [length] and traction [stress] at the nodes, in s states. All states
        share the integrals.
    material : Material
    """

    def __init__(self, mesh: BoundaryMesh, u: Array, traction: Array, material: Material) -> None:
        shape = (-1, *u.shape[1:])
        self._motion = _rigid_motion(mesh, u)
        u = (u - self._motion(mesh.x)).reshape(len(u), -1)
        self._mesh, u, traction = smoothed(mesh, u, traction.reshape(len(u), -1))
        self._kernel = kernel_for(self._mesh, material)
        traction = traction / self._kernel.traction_scale
        self._u, self._scaled = u.reshape(shape), traction.reshape(shape)
        self._next_to_joints = joints_of(self._mesh, self._u, self._scaled)
        # in an infinite plate with holes every winding number is less by one, and a rigid motion of
        # the boundary data has no field inside
        self._filled = float(mesh.weight @ np.einsum("nd,nd->n", mesh.x, mesh.normal) > 0.0)
        self._series = dict[int, list[Any]]()

    @functools.cached_property
    def _groups(self) -> list[Batch]:
        """Neighbouring elements, each group of which has one series."""
        count = self._mesh.n_elements
        return list(pieces(self._mesh, math.ceil(TOGETHER * count ** (2.0 / 3.0))))

    def at(
        self, points: Array, progress: Progress | None = None, outside: float | None = None
    ) -> tuple[Array, Array]:
        """Return displacement and stress at points inside the body.

        Parameters
        ----------
        points : (m, d) array
            Not on the boundary [length].
        progress : callable, optional
            Called with the share of the elements that has been integrated, each time it grows.
        outside : float, optional
            Value at points outside the body. By default such points are an error.

        Returns
        -------
        u : (m, d, s) array
            Displacement by equation (4.9) [length].
        stress : (m, d(d+1)/2, s) array
            σ_xx, σ_yy, σ_xy, or in space σ_xx, σ_yy, σ_zz, σ_xy, σ_xz, σ_yz, by the derivative of
            (4.9) [stress].

        Raises
        ------
        InputError
            If a point is not finite, or lies outside the body and `outside` is missing.
        """
        points, (_, d, states) = points_in(points, self._mesh.dim), self._u.shape
        displacement, stress, wound = totals = [
            np.zeros((len(points), *each)) for each in ((d, states), (d * (d + 1) // 2, states), ())
        ]
        many = self._mesh.n_nodes * len(points) > ENTRIES
        groups = self._groups if many else list(pieces(self._mesh, self._mesh.n_elements))
        for number, group in enumerate(groups):
            if progress is not None:
                progress(number / len(groups))
            near = self._add_far(number, points, totals) if many else np.arange(len(points))
            self._add(group, points, near, totals)
        self._add_next_to_joints(points, totals)
        # the winding is 1 inside, 1/2 on the boundary, 0 outside
        beyond = np.flatnonzero(~(wound > self._filled - 0.1))
        if len(beyond) and outside is None:
            raise InputError(
                f"points: {shown(points[beyond[0]])} does not lie inside the body ({len(beyond)} "
                f"of {len(points)} do not)"
            )
        displacement += self._filled * self._motion(points)
        displacement[beyond] = stress[beyond] = outside
        return displacement, self._kernel.traction_scale * stress

    def _add(self, group: Batch, points: Array, near: Index, totals: list[Array]) -> None:
        """Add the integrals over some elements at those points (m, d) that have a number `near`."""
        step = max(1, ENTRIES // len(group.nodes))
        for rows in filter(len, np.split(near, np.arange(step, len(near), step))):
            targets, u = self._mesh.points(points[rows]), self._u[group.nodes]
            parts = self._kernel.field(targets, group.elements, u, self._scaled[group.nodes])
            for total, part in zip(totals, parts, strict=True):
                total[rows] += part

    def _add_far(self, number: int, points: Array, totals: list[Array]) -> Index:
        """Add the series of a group of elements, which are made once, at distant points (m, d);
        return the numbers of the other points."""
        group, expand = self._groups[number], EXPANSIONS.get(type(self._kernel))
        if expand is None:
            return np.arange(len(points))
        if number not in self._series:
            data = self._u[group.nodes], self._scaled[group.nodes]
            self._series[number] = [
                expand(self._kernel, group.elements, u, traction)
                for u, traction in zip(*(np.moveaxis(each, 2, 0) for each in data), strict=True)
            ]
        series = self._series[number]
        near = series[0].near(points)
        far = np.flatnonzero(~near)
        for rows in filter(len, np.split(far, np.arange(SERIES, len(far), SERIES))):
            parts = [each.fields_at(points[rows]) for each in series]
            for k, total in enumerate(totals[:2]):
                total[rows] += np.stack([part[k] for part in parts], axis=2)
            totals[2][rows] += parts[0][2]
        return np.flatnonzero(near)

    def _add_next_to_joints(self, points: Array, totals: list[Array]) -> None:
        """Add the fields of the data's change at the ends of elements, see `joints`."""
        for rows, share, elements, u, traction in self._next_to_joints(points):
            changes = self._kernel.field(self._mesh.points(points[rows]), elements, u, traction)
            for total, change in zip(totals[:2], changes[:2], strict=True):
                total[rows] += share[:, None, None] * change


def _rigid_motion(mesh: BoundaryMesh, u: Array) -> Callable[[Array], Array]:
    """Return the rigid motion nearest to displacements (n, d, s), as a function of points (m, d).

    It is zero for states in which a tenth of the displacements or more would remain.
    """
    centre = mesh.x.mean(axis=0)
    size = np.abs(mesh.x - centre).max()
    modes = mesh.motions.modes(mesh.x / size, centre / size)
    amplitudes = np.linalg.lstsq(
        modes.reshape(-1, modes.shape[2]),
        u.reshape(modes.shape[0] * mesh.components, -1),
        rcond=None,
    )[0]
    # only motions that leave less than a tenth of the displacements are worth subtracting
    amplitudes *= np.abs(u - modes @ amplitudes).max(axis=(0, 1)) < 0.1 * np.abs(u).max(axis=(0, 1))
    return lambda x: np.asarray(mesh.motions.modes(x / size, centre / size) @ amplitudes)


def field_on_grid(
    mesh: CurveMesh,
    u: Array,
    traction: Array,
    material: Material,
    resolution: tuple[int, int],
    progress: Progress | None = None,
) -> Field:
    """Return displacement and stress on a grid that fills the body up to its boundary.

    Parameters
    ----------
    mesh, u, traction, material, progress
        See `field_at`.
    resolution : (int, int)
        Numbers of grid cells along x and y over the bounding box, at least 2.

    Raises
    ------
    InputError
        If the resolution is too small.
    """
    from .interior_grid import triangulate

    points, cells = triangulate(mesh, resolution)
    displacement, stress = field_at(mesh, u, traction, material, points, progress)
    across = stress_across(mesh, points, displacement, stress, material)
    return Field(points, displacement, stress, across, cells)
