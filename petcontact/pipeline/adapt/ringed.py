"""Meshes whose panels form rings along the edges of elliptical contacts and of their stick zones.

They come before panels are cut one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from ...given.interface_data import PosedInterface
from ...given.posed import Posed
from ...mesh.surface_mesh import SurfaceMesh, as_surface
from ...refinement.panels.face_patches import patches_of
from ...refinement.panels.rings import ringed, sector
from ...refinement.panels.small_contact import SmallContact, overlapping_contact, small_contact
from ...refinement.panels.zone import ContactEllipse, stick_of, zone_of
from ...results.records import step_ends
from ...results.solution import Solution
from ..judge.first_panels import lowest_between
from .first_mesh import FirstMeshes

RINGS = (0.09, 0.04, 0.02)
"""Estimated error with one, two and three rings around the core of a contact, measured on Hertz'
contact by scripts/verify_space --only adaptive."""
FALL = 0.15
"""Largest ratio of the estimate with new rings to the present one. A smaller estimate means that
the edge is known better."""
MOVED = 0.003
"""Displacement of an edge over the radius, from which the same number of rings is set again [-]."""

Completed = Callable[[list[SurfaceMesh]], list[SurfaceMesh]]
"""Function that returns complete meshes, or none where these cost too much."""
Rings = list[tuple[int, ContactEllipse]]
"""The numbers of rings that an elliptical contact has had, and the zones that they followed."""


class EllipticContacts:
    """Lays rings along the edges of elliptical contacts.

    A contact gets more rings, or the same number again if its edge has moved. Without rings, panels
    as narrow at a circular edge are nine times as many. Their error is larger, since p is a square
    root at the edge, which no polynomial across the edge follows.

    Parameters
    ----------
    posed : Posed
    first : FirstMeshes
        First meshes of the bodies.
    """

    def __init__(self, posed: Posed, first: FirstMeshes) -> None:
        self._surfaces = [shape if shape.known else None for shape in posed.boundaries]
        faces = {side.name: side.ends for side in posed.interfaces}
        ends = [face for both in faces.values() for face in both]
        self._faces = {
            name: both
            for name, both in faces.items()
            if all(self._surfaces[body] and ends.count((body, part)) == 1 for body, part in both)
        }
        self._first = first

    def meshes(
        self,
        before: Mapping[str, Rings],
        solution: Solution,
        small: Mapping[str, ContactEllipse],
        errors: tuple[float, float],
        completed: Completed,
    ) -> tuple[list[SurfaceMesh], Mapping[str, Rings]]:
        """Return meshes with more rings if these reduce the estimate, else none; and all rings of
        each contact.

        The rings follow the contact at the end of the last step; earlier steps must lie inside. The
        last rings also follow the edges of stick zones, unless the meshes cannot be completed then.
        Earlier rings are wide enough to show these edges. `small` holds expected contacts that are
        smaller than a panel.
        """
        for sticks in (True, False):
            rings, meshes = self._ringed(before, solution, small, errors, sticks)
            meshes = completed(meshes) if rings else []
            if meshes:
                more = {name: [*before.get(name, []), ring] for name, ring in rings.items()}
                return meshes, {**before, **more}
        return [], before

    def _ringed(
        self,
        before: Mapping[str, Rings],
        solution: Solution,
        small: Mapping[str, ContactEllipse],
        errors: tuple[float, float],
        sticks: bool,
    ) -> tuple[dict[str, tuple[int, ContactEllipse]], list[SurfaceMesh]]:
        """Return the number of rings and the zone of each contact, and the meshes with them."""
        meshes = [as_surface(mesh) for mesh in solution.meshes.values()]
        rings = dict[str, tuple[int, ContactEllipse]]()
        for name, both in self._faces.items():
            asked = _asked(before.get(name, []), solution, name, small.get(name), errors)
            if asked is None:
                continue
            count, zone = asked
            last = RINGS[count - 1] <= errors[1] or count == len(RINGS)
            pair = step_ends(solution.steps or solution.tried)[-1].pairs[name]
            stick = (
                stick_of(pair.x, pair.weight, pair.state, pair.slip_increment, zone)
                if sticks and last
                else None
            )
            made = [
                self._filled(
                    (meshes[body], self._first.plain[body]), body, part, zone, count, stick
                )
                for body, part in both
            ]
            filled = [mesh for mesh in made if mesh is not None]
            if len(filled) == len(both):
                for (body, _), mesh in zip(both, filled, strict=True):
                    meshes[body] = mesh
                rings[name] = count, zone
        return rings, meshes

    def _filled(
        self,
        mesh: tuple[SurfaceMesh, SurfaceMesh],
        body: int,
        part: str,
        zone: ContactEllipse,
        count: int,
        stick: ContactEllipse | None,
    ) -> SurfaceMesh | None:
        """Return the mesh with rings on a part, or None if they do not fit."""
        surface = self._surfaces[body]
        assert surface is not None
        patches = patches_of(surface, *mesh, part, zone, sector(count, zone, stick))
        return next(
            (made for patch in patches if (made := ringed(patch, zone, count, stick)) is not None),
            None,
        )


def _asked(
    made: Rings,
    solution: Solution,
    name: str,
    small: ContactEllipse | None,
    errors: tuple[float, float],
) -> tuple[int, ContactEllipse] | None:
    """Return the number of rings of a contact and its zone; None if rings are of no use."""
    estimate, wanted = errors
    more = [n for n in _possible(made) if RINGS[n - 1] < estimate]
    if not more or solution.kind == "bilateral":
        return None
    enough = max(wanted, FALL * estimate)
    count = next((n for n in more if RINGS[n - 1] <= enough), more[-1])
    pairs = [step.pairs[name] for step in step_ends(solution.steps or solution.tried)]
    closed = np.any([pair.pressure > 0.0 for pair in pairs], axis=0)
    zone = small or zone_of(pairs[-1].x, pairs[-1].weight, pairs[-1].pressure, closed)
    before = [old for n, old in made if n == count]
    if zone is None or any(zone.apart(old) < MOVED for old in before):
        return None
    return count, zone


def _possible(made: Rings) -> list[int]:
    """Return the rings that a contact may get: not fewer than before, the same ones twice."""
    numbers = [n for n, _ in made]
    counts = range(max(numbers, default=1), len(RINGS) + 1)
    return [n for n in counts if numbers.count(n) < 2]


def zone_about(expected: SmallContact) -> ContactEllipse:
    """Return the ellipse of a small contact."""
    return ContactEllipse(expected.centre, (expected.axes * expected.half[:, None]).T)


def small_contacts(posed: Posed, solution: Solution) -> list[tuple[PosedInterface, SmallContact]]:
    """Return contacts after the last step that lie between nodes or are smaller than their
    panels."""
    contacts, step = [], solution.tried[-1]
    depth = step.residuals.get("between", 0.0) if step.status != "converged" else 0.0
    for side in posed.interfaces:
        mesh = as_surface(solution.meshes[posed.bodies[side.body].name])
        pair = step.pairs[side.name]
        nodes = solution.nodes[side.name]
        expected = small_contact(mesh, nodes, pair.pressure, pair.gap, 1.0 / posed.softness(side))
        if depth > 0.0 and not pair.pressure.any():
            lowest = lowest_between(mesh.element[nodes], pair.gap, mesh.n_elements).min()
            expected = overlapping_contact(mesh, nodes, pair.gap, depth) if lowest < 0.0 else None
        if expected is not None and expected.too_large(mesh, side.part).any():
            contacts.append((side, expected))
    return contacts
