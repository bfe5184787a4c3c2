"""Meshes whose panels follow the edges of elliptical contacts on faces of boxes, and of their stick zones, before panels are
cut one by one."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ...geometry.surface import BoxSurface
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...model.problem import Problem
from ...refinement.panels.rings import ringed, stick_of, zone_of
from ...results.records import step_ends
from ...results.solution import Solution
from ..discrete.interfaces import interfaces_of

RINGS = {1: 0.09, 2: 0.04, 3: 0.02}
"""Rings of panels about the core of a contact, and the estimate with them, measured on Hertz' contact."""
FALL = 0.15
"""Estimate that rings have to reach at most, over that before: an edge is known the better the smaller it is."""


Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]
"""Meshes with what else they need; none where they cost too much."""


class EllipticContacts:
    """How many rings each elliptical contact has so far.

    Panels as wide at a circular edge as those of rings are nine times as many, and the error is larger: p is a root there,
    which no polynomial follows across.

    Parameters
    ----------
    problem : Problem
    """

    def __init__(self, problem: Problem) -> None:
        boxes = [isinstance(body.geometry.outline(), BoxSurface) for body in problem.body]
        faces = {side.name: [(side.body, side.part), *([side.primary] if side.primary else [])]
                 for side in interfaces_of(problem)}  # fmt: skip
        every = [face for both in faces.values() for face in both]
        self._faces = {name: both for name, both in faces.items()
                       if all(boxes[body] and every.count((body, part)) == 1 for body, part in both)}  # fmt: skip
        self._rings = dict.fromkeys(self._faces, 0)

    def meshes(self, solution: Solution, estimate: float, wanted: float, completed: Completed) -> list[SurfaceMesh]:
        """The meshes of the bodies, with more rings than before where these make an estimate smaller; none where not.

        Where contact is at the end of the last step; it must not be elsewhere before. The last rings, which shall do, are
        about the edges of stick zones too, unless the meshes would not be completed then: rings before them are wider than
        those at these edges, which they show well enough.
        """
        for sticks in (True, False):
            rings, meshes = self._ringed(solution, estimate, wanted, sticks)
            meshes = completed(meshes) if rings else []
            if meshes:
                self._rings |= rings
                return meshes
        return []

    def _ringed(
        self, solution: Solution, estimate: float, wanted: float, sticks: bool
    ) -> tuple[dict[str, int], list[SurfaceMesh]]:
        """How many rings which contacts get, and the meshes with them."""
        meshes, ends, rings = (
            [as_surface(mesh) for mesh in solution.meshes.values()],
            step_ends(solution.steps),
            dict[str, int](),
        )
        for name, both in self._faces.items():
            more = [n for n, reached in RINGS.items() if n > self._rings[name] and reached < estimate]
            if not more or solution.bilateral:
                continue
            count = next((n for n in more if RINGS[n] <= max(wanted, FALL * estimate)), more[-1])
            pair, closed = ends[-1].pairs[name], np.any([step.pairs[name].pressure > 0.0 for step in ends], axis=0)
            zone = zone_of(pair.x, pair.weight, pair.pressure, closed)
            if zone is None:
                continue
            last = RINGS[count] <= wanted or count == max(RINGS)
            stick = stick_of(pair.x, pair.weight, pair.state, pair.slip_increment, zone) if sticks and last else None
            made = [ringed(meshes[body], part, zone, count, stick) for body, part in both]
            if any(mesh is None for mesh in made):
                continue
            for (body, _), mesh in zip(both, made, strict=True):
                assert mesh is not None
                meshes[body] = mesh
            rings[name] = count
        return rings, meshes
