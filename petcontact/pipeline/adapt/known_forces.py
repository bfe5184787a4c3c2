"""Forces of contacts that are known before a solve: those of free obstacles, and loads of bodies
that nothing but one contact holds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import BoundaryData
from ...geometry.charts import chart_of, disc_of
from ...geometry.rotation import SPACE
from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh
from ..pose.discretise import with_volume_loads
from ..pose.load_states import boundary_data

SLIGHT = 0.1
"""Component of the direction of a contact up to which what is held along it does not count [-]."""


def known_force(posed: Posed, side: PosedInterface, meshes: Sequence[SurfaceMesh]) -> float | None:
    """Return the largest force that presses both sides together at the end of any step, or None.

    `meshes` are any meshes of the bodies.
    """
    way, forces = way_of(posed, side), None
    if way is None:
        return None
    if side.obstacle is not None:
        forces = of_obstacle(posed, side.obstacle, -way)
    elif side.primary is not None:
        forces = of_body(posed, side.primary[0], meshes, side, -way)
    if forces is None:
        forces = of_body(posed, side.body, meshes, side, way)
    return None if forces is None else float(forces.max())


def way_of(posed: Posed, side: PosedInterface) -> Array | None:
    """Return the unit vector (3,) from a secondary to its primary, or None if its face is none that
    is known."""
    surface = posed.boundaries[side.body]
    chart = disc_of(surface, side.part) or chart_of(surface, side.part)
    if chart is None or side.direction is not None:
        return None if chart is None else side.direction
    load = load_of(posed, side)
    if load.any() and not chart.flat:
        return np.asarray(-load / np.linalg.norm(load))
    return np.asarray(chart.normal(0.5 * (chart.low + chart.high)[None])[0])


def load_of(posed: Posed, side: PosedInterface) -> Array:
    """Return the load (3,) of the obstacle of an interface at the end of the last step [force]."""
    if side.obstacle is None:
        return np.zeros(3)
    return np.array(posed.obstacles_at[-1][side.obstacle].loads(SPACE)[:3], dtype=float)


def of_obstacle(posed: Posed, number: int, way: Array) -> Array | None:
    """Return the force on an obstacle along a way at the end of each step, or None if it is held
    there."""
    forces = []
    for obstacles in posed.obstacles_at[1:]:
        moved = obstacles[number].motions(SPACE)[:3]
        force = obstacles[number].loads(SPACE)[:3]
        if any(abs(n) > SLIGHT and u != "free" for n, u in zip(way, moved, strict=True)):
            return None
        forces.append(float(way @ np.array(force, dtype=float)))
    return np.array(forces)


def of_body(
    posed: Posed,
    number: int,
    meshes: Sequence[SurfaceMesh],
    side: PosedInterface,
    way: Array,
    passed_by: tuple[int, ...] = (),
) -> Array | None:
    """Return the load of a body along a way at the end of each step, or None if more than a contact
    `side` holds it there.

    Obstacles and bodies that touch it elsewhere pass their own loads on; `passed_by` are the bodies
    to which it does itself.
    """
    if number in passed_by:
        return None
    mesh, body = meshes[number], posed.bodies[number]
    data = boundary_data(body, mesh, ())
    if _holds(data, way):
        return None
    (data,), _ = with_volume_loads((body,), [mesh], [data], None)
    load = data.known_traction - (0.0 if data.volume is None else data.volume[2])
    result = (np.einsum("n,knd->kd", mesh.weight, load) + data.force.sum(axis=1))[1:] @ way
    for other in posed.interfaces:
        if other is not side and number in other.bodies:
            if other.obstacle is not None:
                passed = of_obstacle(posed, other.obstacle, way)
            else:
                far = next(b for b, _ in other.ends if b != number)
                passed = of_body(posed, far, meshes, other, way, (*passed_by, number))
            if passed is None:
                return None
            result = result + passed
    return np.asarray(result)


def is_held(posed: Posed, number: int, mesh: SurfaceMesh, way: Array) -> bool:
    """Return whether conditions hold a body along a way."""
    return _holds(boundary_data(posed.bodies[number], mesh, ()), way)


def _holds(data: BoundaryData, way: Array) -> bool:
    return bool(np.any((np.abs(data.frame @ way) > SLIGHT) & ~data.traction_known))
