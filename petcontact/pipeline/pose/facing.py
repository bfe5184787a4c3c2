"""A contact on meshes: the points opposite the secondary's nodes, the normals and the gaps."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from ...arrays import Array, Mask
from ...compliance.interface import Interface
from ...errors import InputError
from ...fields.boundary.maxima import smallest_gap
from ...geometry.rotation import lifted
from ...given.body_data import Body
from ...given.interface_data import Law, PosedInterface
from ...given.sites import Sites
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.contact_search import Facing, face
from ...mesh.pairs.periodic import partner_nodes
from ...mesh.pairs.ray_casting import along
from ...refinement.panels.panel_cuts import LONGER
from ...results.report import Finding
from ...round_off import ROUNDED, SINGLE, WRITTEN
from ...untyped import Keyed
from ..judge.findings import new_finding


def facing_of(side: PosedInterface, meshes: list[BoundaryMesh]) -> Facing | None:
    """Return how an interface's secondary lies opposite its primary, or None if that is no body.

    Raises
    ------
    InputError
        If the direction does not point out of the part, or the two sides of a contact that cannot
        open do not meet.
    """
    if side.periodic:
        return None
    mesh, direction = meshes[side.body], side.direction
    if (
        direction is not None
        and not (mesh.normal[mesh.nodes_of(side.part)] @ direction).max() > WRITTEN
    ):
        raise InputError(
            f"{side.key}.direction: must point out of part {side.part!r}, from the secondary to "
            f"the primary; {direction.round(6).tolist()} does not"
        )
    if side.primary is None:
        return None
    b, part = side.primary
    return face(mesh, side.part, meshes[b], part, direction)


def facings_of(sides: Sequence[PosedInterface], meshes: list[BoundaryMesh]) -> list[Facing | None]:
    """Return how the secondary of each interface lies opposite its primary, see `facing_of`.

    Raises
    ------
    InputError
        If the two sides of a contact that cannot open do not meet.
    """
    facings = [facing_of(side, meshes) for side in sides]
    meeting = {
        side.group
        for side, facing in zip(sides, facings, strict=True)
        if facing is None or facing.met.any()
    }
    for side in sides:
        if side.law.normal != "unilateral" and side.group not in meeting:
            raise InputError(
                f"{side.key}: no node of the secondary faces the primary along its normals; "
                f"faces of a {side.law.normal} contact must meet"
            )
    return facings


def nearest_only(
    sides: Sequence[PosedInterface], interfaces: Sequence[Interface]
) -> Iterator[Interface]:
    """Yield the interfaces, of several primaries with the nodes that meet this one first.

    The others face nothing there.
    """
    pairs = zip(sides, interfaces, strict=True)
    for _, group in itertools.groupby(pairs, lambda pair: (pair[0].group, pair[0].ends[0])):
        faces = [interface for _, interface in group]
        apart = np.array([f.gap if f.distance is None else f.distance for f in faces])
        nearest = apart.argmin(axis=0)
        for k, own in enumerate(faces):
            lost = nearest != k
            distance = None if own.distance is None else np.where(lost, np.inf, own.distance)
            faces[k] = replace(own, gap=np.where(lost, np.inf, own.gap), distance=distance)
        yield from faces


def untouched(
    sides: Sequence[PosedInterface], interfaces: Sequence[Interface]
) -> Iterator[Finding]:
    """Yield a finding for each contact of which no node faces a primary."""
    met = dict[str, bool]()
    for side, own in zip(sides, interfaces, strict=True):
        met[side.group] = met.get(side.group, False) or bool(np.isfinite(own.gap).any())
    for name in [name for name, any_met in met.items() if not any_met]:
        text = "no node of the secondary faces the primary along its normals: they never touch"
        yield new_finding("facing", text, f"pair {name!r}")


def mismatch(side: PosedInterface, facing: Facing | None) -> list[Finding]:
    """Return a finding if the elements of an interface do not match."""
    if facing is None or facing.matched or not facing.met.any():
        return []
    text = (
        "elements of the two sides do not match: forces pass exactly, the pressure is about twice "
        "as far off as on elements that do"
    )
    finer = LONGER * facing.sizes[0] < facing.sizes[1]
    advice = "the coarser side is the better secondary" if finer else ""
    if facing.ends_within:
        text += (
            ", and more at the rim of the secondary, which lies inside elements of the primary: "
            "let some end there"
        )
        advice = ""
    return [new_finding("matching", text, f"pair {side.name!r}", advice=advice)]


def contact_interface(
    side: PosedInterface, meshes: list[BoundaryMesh], facing: Facing | None, held: bool
) -> tuple[Interface, float, list[Finding]]:
    """Return an interface on meshes, its smallest distance or gap [length], and findings.

    A finding says that the obstacle fits a curved part, or that the parts are not closed.
    """
    mesh, law = meshes[side.body], side.law
    nodes = mesh.nodes_of(side.part)
    opposite: Keyed = {"obstacle": side.obstacle, "held": held}
    normal, gap = along(side.direction, mesh.smooth_normal[nodes]).copy(), np.zeros(len(nodes))
    if facing is not None:
        assert side.primary is not None
        normal, drawn = facing.normal, law.gap is None and law.normal == "unilateral"
        gap = np.where(facing.met, facing.distance if drawn else 0.0, np.inf)
        opposite = {
            "primary": side.primary[0],
            "primary_nodes": facing.primary,
            "values": facing.values,
            "loads": facing.loads,
            "distance": facing.distance,
            "sag": facing.sag if drawn else None,
        }
    if law.gap is not None:
        gap = gap + law.gap.at(mesh.sites(nodes))
    if any(each.interference or each.clearance for each in side.laws):
        _demand_effect(side, mesh.sites(nodes))
        opposite["overlap"] = np.array([_overlap(each, mesh.sites(nodes)) for each in side.laws])
    opposite["preloaded"] = side.preloaded
    tangent = mesh.slip_directions(normal)
    return (
        Interface(side.name, side.body, nodes, normal, tangent, gap, **opposite),
        # what is given may jump within an element
        smallest_gap(mesh, nodes, gap) if law.gap is None else float(gap.min(initial=np.inf)),
        list(_findings(side, mesh, facing, np.isfinite(gap))),
    )


def _demand_effect(side: PosedInterface, sites: Sites) -> None:
    """Refuse a new uniform interference under a preload, which finds the uniform overlap.

    It is uniform by its values, whether a number, an expression or a function gives them.
    """
    for before, law in itertools.pairwise(side.laws):
        new = law.interference
        if not isinstance(law.preload, float) or new is None or new == before.interference:
            continue
        values = new.at(sites)
        if values.any() and np.ptp(values) <= ROUNDED * np.abs(values).max():
            raise InputError(
                f"{new.key}: a uniform interference has no effect while a preload gives the force "
                f"of contact {side.name!r}; give one of the two"
            )


def _overlap(law: Law, sites: Sites) -> Array:
    """Return the overlap beyond the gap that a law gives to the parts, (m,) [length]."""
    both = (1.0, law.interference), (-1.0, law.clearance)
    given = [sign * datum.at(sites) for sign, datum in both if datum is not None]
    return np.asarray(sum(given, np.zeros(len(sites))))


def _findings(
    side: PosedInterface, mesh: BoundaryMesh, facing: Facing | None, met: Mask
) -> Iterator[Finding]:
    """Find what an obstacle without a gap fits, and gaps that do not count.

    Faces that lie across an axis may well lie on a flat obstacle.
    """
    where = f"pair {side.name!r}"
    by_shape, unilateral = side.law.gap is None, side.law.normal == "unilateral"
    if not met.any():
        return
    if facing is None:
        normal = mesh.smooth_normal[mesh.nodes_of(side.part)]
        bent = np.linalg.norm(np.ptp(normal, axis=0)) > SINGLE
        across = np.abs(normal).max(axis=1).min() > 1.0 - SINGLE
        # a play or an overlap is that of a pin in its hole
        fits = side.pressed or any(each.clearance for each in side.laws)
        if by_shape and unilateral and not fits and (bent or not across):
            yield new_finding(
                "fitting gap",
                "no gap is given, so that the obstacle fits the "
                f"{'curved face as a cup does' if bent else 'slanted face'}",
                where,
                advice="give the gap to a flat or another one as an expression",
            )
    elif by_shape and not unilateral:
        off = np.where(facing.met, np.abs(facing.distance) - facing.sag, 0.0)
        far = float(facing.distance[off.argmax()])
        if off.max() > SINGLE * np.abs(mesh.x).max():
            how = "overlap" if far < 0.0 else "are apart"
            text = f"the parts {how} by up to {abs(far):.3g}, and are joined as they lie"
            yield new_finding("closed gap", text, where, measured=abs(far))


def periodic_interface(body: Body, side: PosedInterface, mesh: BoundaryMesh) -> Interface:
    """Return the interface between the two sides of a periodic strip.

    At each pair of nodes the displacements differ by the jump, and the tractions are opposite.
    """
    assert side.primary is not None
    nodes, partner = mesh.nodes_of(side.part), partner_nodes(mesh, side.part, side.primary[1])
    normal = mesh.normal[nodes]
    gap = np.zeros(len(nodes))
    same = scipy.sparse.csr_array(scipy.sparse.identity(len(nodes)))
    jump = np.array(
        [
            (0.0, 0.0),
            *(getattr(state[side.part], "jump", ()) for state in body.conditions),
        ]
    )
    return Interface(
        side.name,
        side.body,
        nodes,
        normal,
        mesh.slip_directions(normal),
        gap,
        side.body,
        partner,
        same,
        same,
        jump=lifted(jump, mesh.components),
    )
