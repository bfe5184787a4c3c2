"""Displacement and stress of one body after an increment, inside it and on its boundary."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from ..arrays import Array, Index, shown
from ..bem.kernel import COMPONENTS
from ..bem.particular.loaded_inside import InsideLoads
from ..bem.particular.volume import VolumeSolution
from ..errors import InputError, the_body
from ..fields.boundary.places import best_places, located, widths
from ..fields.boundary.surface_stress import BoundaryField
from ..fields.interior import InteriorField, Progress, points_in, stress_across
from ..fields.stress_state import StressState
from ..given.body_data import Body
from ..mesh.boundary_mesh import BoundaryMesh
from ..record import record
from ..round_off import SINGLE
from ..runtime.hints import demand_name, nearest
from ..untyped import ArrayLike
from .records import BodyResult


def quantities(d: int) -> list[str]:
    """Return the names that `quantity` takes, for displacements with d components."""
    stresses = [
        f"sigma_{'xyz'[i]}{'xyz'[j]}"
        for i, j in sorted({*COMPONENTS[d], (2, 2)}, key=COMPONENTS[3].index)
    ]
    return [
        "von_mises",
        "principal_1",
        "principal_2",
        "principal_3",
        *stresses,
        "u",
        *(f"u{axis}" for axis in "xyz"[:d]),
    ]


def quantity(state: StressState, name: str) -> Array:
    """Return a stress, a principal stress or a displacement (n,) by its name.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    demand_name("no quantity", name, quantities(state.u.shape[1]))
    if name == "von_mises":
        return state.von_mises
    if name.startswith("principal"):
        return np.asarray(state.principal[:, int(name[-1]) - 1])
    if name.startswith("sigma"):
        return np.asarray(state.tensor[:, "xyz".index(name[-2]), "xyz".index(name[-1])])
    return np.asarray(
        np.linalg.norm(state.u, axis=1) if name == "u" else state.u[:, "xyz".index(name[-1])]
    )


LAYER = np.array([0.3, 0.4, 0.3, 0.17, 0.11, 0.075])
"""By the order of an element: depth of the layer under it in which stresses are interpolated, over
its half length, in space over the distance of the corners from the middle of a square as wide."""
CLOSE = 0.03
"""Share of the layer in which stresses are those on the boundary, where nothing can be
interpolated, as at corners; over twice that they pass into those inside."""


@record
class BodyFields:
    """What `SolutionData` evaluates of a body after an increment.

    Attributes
    ----------
    body : Body
    mesh : BoundaryMesh
    found : BodyResult
    volume : VolumeSolution, optional
        For volume loads.
    state : (n,) int array
        Of contact, at the nodes: the stress on the boundary is smooth over one state only.
    shares : dict of int to float
        Of the loads at the ends of steps.
    """

    body: Body
    mesh: BoundaryMesh
    found: BodyResult
    volume: VolumeSolution | None
    state: Index
    shares: dict[int, float]

    @functools.cached_property
    def loads(self) -> InsideLoads:
        """The displacement and the stress that volume loads add."""
        return InsideLoads.from_body(self.body, self.mesh, self.volume, self.shares)

    @functools.cached_property
    def data(self) -> tuple[Array, Array]:
        """Displacement and traction (n, d) without those of volume loads."""
        return self.loads.without(self.found.u, self.found.traction)

    @functools.cached_property
    def boundary(self) -> BoundaryField:
        """The field on the boundary, without volume loads."""
        return BoundaryField(self.mesh, *self.data, self.body.material, self.state)

    @functools.cached_property
    def inside(self) -> InteriorField:
        """The field inside, without volume loads."""
        return _inside([self])

    @functools.cached_property
    def samples(self) -> tuple[Index, StressState]:
        """The elements and the state of points of the boundary, see `Evaluated.boundary_state`."""
        every = zip((self.mesh.element, self.mesh.places), best_places(self.mesh), strict=True)
        element, place = (np.concatenate(both) for both in every)
        return element, self.on_boundary(element, place)

    @property
    def known(self) -> bool:
        """Whether the stress is known: the stress in a superelement is not."""
        return self.body.has_inside

    def on_boundary(self, element: Index, place: Array) -> StressState:
        """Return the field at places of elements (see `Hits`); a superelement has NaN stress."""
        x, u, stress = self.boundary.at(element, place)
        if not self.known:
            stress = np.full_like(stress, np.nan)
        return self.whole(x, u, stress, self.loads.volume_at(x))

    def at(
        self,
        points: ArrayLike,
        part: str | None = None,
        progress: Progress | None = None,
        outside: float | None = None,
    ) -> StressState:
        """At points (m, d) inside the body and on its boundary; with `part` on that part of it
        alone.

        Points outside get a given value, or are refused.

        Raises
        ------
        InputError
            If a point lies outside or not on the part, there is no such part, or the body is a
            superelement.
        """
        return states_at([self], points, part, progress, outside)[0]

    def whole(
        self, x: Array, u: Array, stress: Array, loads: tuple[Array, Array, Array]
    ) -> StressState:
        """Return the field with what volume loads add to u and to the stress."""
        stress = stress + loads[1]
        across = stress_across(self.mesh, x, u + loads[0], stress, self.body.material, loads[2])
        return StressState(x, u + loads[0], self.mesh.with_hoop(stress, across), across)


def states_at(
    increments: Sequence[BodyFields],
    points: ArrayLike,
    part: str | None = None,
    progress: Progress | None = None,
    outside: float | None = None,
) -> list[StressState]:
    """Return `BodyFields.at` after several increments.

    The increments share the integrals over the elements.
    """
    first = increments[0]
    if not first.known:
        name = first.body.name
        raise InputError(f"{the_body(name)} is a superelement: fields inside it are not known")
    points = points_in(points, first.mesh.dim)
    if part is not None and part not in first.mesh.part_names:
        raise InputError(f"no part {part!r}{nearest(part, list(first.mesh.part_names))}")
    element, place = located(first.mesh, points, part)
    on, inside = np.flatnonzero(element >= 0), np.flatnonzero(element < 0)
    if part is not None and len(inside):
        raise InputError(f"part {part!r}: the point {shown(points[inside[0]])} does not lie on it")
    x, order = points[inside], np.argsort(np.concatenate([inside, on]), kind="stable")
    u, stress = _states_inside(increments, x, progress, outside)
    result = []
    for s, fields in enumerate(increments):
        within = fields.whole(x, u[..., s], stress[..., s], fields.loads.values_at(x))
        if len(on):
            rim = fields.on_boundary(element[on], place[on])
            within = StressState.joined([within, rim]).take(order)
        result.append(within)
    return result


def _inside(increments: Sequence[BodyFields]) -> InteriorField:
    """Return the field inside the body after some increments, without volume loads."""
    first, data = increments[0], zip(*(fields.data for fields in increments), strict=True)
    u, traction = (np.stack(values, axis=2) for values in data)
    return InteriorField(first.mesh, u, traction, first.body.material)


def _states_inside(
    increments: Sequence[BodyFields], x: Array, progress: Progress | None, outside: float | None
) -> tuple[Array, Array]:
    """Return u (m, d, s) and σ (m, d(d+1)/2, s) at points inside, without volume loads."""
    field = increments[0].inside if len(increments) == 1 else _inside(increments)
    u, stress = field.at(x, progress, outside)
    _next_to_boundary(increments, field, x, stress)
    return u, stress


def _next_to_boundary(
    increments: Sequence[BodyFields], field: InteriorField, x: Array, stress: Array
) -> None:
    """Replace stresses (m, c, s) so near to an element that the jumps between elements show.

    A parabola along the normal goes through the stress on the boundary and the stresses at two
    points below it. At corners these points are next to the boundary, too. There the stress on the
    boundary is taken at distances up to `CLOSE`, and the stress is kept farther away.
    """
    mesh = increments[0].mesh
    layer = LAYER[mesh.order] * widths(mesh)
    element, place = located(mesh, x, within=layer)
    rows = np.flatnonzero((element >= 0) & np.isfinite(stress).all(axis=(1, 2)))
    foot, normal = mesh.at(element[rows], place[rows])
    depth = layer[element[rows], None]
    below = np.stack([foot - depth * normal, foot - 2.0 * depth * normal])
    met = located(mesh, below.reshape(-1, mesh.dim), within=(1.0 - SINGLE) * layer)[0]
    free = (met < 0).reshape(2, -1).all(axis=0)
    s = np.linalg.norm(x[rows] - foot, axis=1) / depth[:, 0]
    taken = free | (s < 2.0 * CLOSE)
    if not taken.any():
        return
    rows, free, s, below = rows[taken], free[taken], s[taken, None, None], below[:, taken]
    rim = np.stack(
        [
            fields.boundary.at(element[rows], place[rows])[2]
            - fields.loads.points_at(foot[taken])[1]
            for fields in increments
        ],
        axis=2,
    )
    share = np.clip(2.0 - s / CLOSE, 0.0, 1.0)
    blended = share * rim + (1.0 - share) * stress[rows]
    if free.any():
        first, second = np.split(
            field.at(below[:, free].reshape(-1, mesh.dim), outside=np.nan)[1], 2
        )
        s, rim = s[free], rim[free]
        blended[free] = (
            0.5 * (1.0 - s) * (2.0 - s) * rim + s * (2.0 - s) * first - 0.5 * s * (1.0 - s) * second
        )
    stress[rows] = np.where(np.isfinite(blended), blended, stress[rows])
