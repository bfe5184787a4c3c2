"""Reference nodes of an input file: surfaces and bolts that one node holds, moves or loads."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..arrays import connected
from ..record import record
from ..untyped import Keyed
from .inp_file import Face, InpFile
from .inp_forces import outward, turning_traction
from .inp_keywords import Keyword, numbers_in

KINDS = {
    "KINEMATIC": "rigid",
    "KINEMATIC COUPLING": "rigid",
    "RIGID BODY": "rigid",
    "DISTRIBUTING": "spread",
    "DISTRIBUTING COUPLING": "spread",
    "PRE-TENSION SECTION": "cut",
}
"""How a surface follows a node, by the keyword: as a rigid one, by forces that are spread over it,
or as the cut of a bolt."""
UNDER = ("KINEMATIC", "DISTRIBUTING")
"""Keywords that say how the surface of the *COUPLING before them follows."""
READ = {*KINDS, "COUPLING", "ELEMENT, TYPE=DCOUP3D"}
"""Keywords that are read here."""
MISSING = (
    "not taken; a node and a SURFACE or NSET that follows it in all directions are read, of a bolt "
    "SURFACE and NODE"
)


@record
class Reference:
    """A node outside of the bodies, and a surface that follows it.

    Attributes
    ----------
    name : str
        Of the obstacle to which a rigid surface is bonded.
    kind : str
        "rigid", "spread" or "cut".
    node, turning : int
        Node, and the one whose displacements are its rotations, or the same.
    surface : str
    normal : (3,) tuple or ()
        Along which the node pulls at the cut of a bolt, where it is given; () for outwards of the
        surface.
    """

    name: str
    kind: str
    node: int
    turning: int
    surface: str
    normal: tuple[float, ...] = ()


def references_of(read: Any) -> list[Reference]:
    """Return the reference nodes of a file; nodes that follow one make a surface of their own."""
    found, head, file = list[Reference](), Keyword("", {}, [], 0), read.file
    for keyword in file.rest:
        head = head if keyword.name in UNDER else keyword
        if (kind := KINDS.get(keyword.name)) is None:
            continue
        given, listed = head.parameters, "COUPLING" in keyword.name
        nodes = [row[0] for row in keyword.rows if listed] or [*filter(None, [given.get("NSET")])]
        node = given.get("REF NODE", given.get("NODE", _of_element(file, given.get("ELSET", ""))))
        surface = given.get("SURFACE", "").upper()
        if nodes:
            surface = f"AROUND{node}"
            read.surfaces[surface] = []
            read.covering[surface] = {n for word in nodes for n in file.members(word)}
        rows = [row[listed:] for row in keyword.rows if keyword.name.startswith("KINEMATIC")]
        if node and surface and _follows(rows, file):
            ends = (file.members(node)[0], file.members(given.get("ROT NODE", node))[0])
            found.append(Reference(f"node{ends[0]}", kind, *ends, surface, _normal(read, keyword)))
        else:
            read.note(keyword, MISSING)
    return found


def _normal(read: Any, keyword: Keyword) -> tuple[float, ...]:
    """Return the normal of the section of a bolt, where it is given."""
    if keyword.name != "PRE-TENSION SECTION" or not keyword.rows:
        return ()
    with numbers_in(read.file.path, keyword):
        return tuple(float(word or 0.0) for word in keyword.rows[0])


def _of_element(file: InpFile, name: str) -> str:
    """Return the node of an element DCOUP3D, or ""."""
    rows = [
        keyword.rows[0]
        for keyword in file.rest
        if keyword.name == "ELEMENT, TYPE=DCOUP3D"
        and keyword.parameters.get("ELSET", "").upper() == name.upper()
    ]
    return rows[0][1] if rows else ""


def _follows(rows: list[list[str]], file: InpFile) -> bool:
    """Return whether rows of degrees of freedom name all displacements, or none."""
    ends = [(int(row[0]), int([*row, row[0]][1])) for row in rows if row]
    named = {freedom for first, last in ends for freedom in range(first, last + 1)}
    solid = next(iter(file.elements.values()))[0].startswith("C3D")
    return not named or named.issuperset((1, 2, 3) if solid else (1, 2))


def motions(read: Any, reference: Reference, step: int) -> dict[int, float | str]:
    """Return where a reference node is held, by degree of freedom, rotations from 4."""
    held: dict[int, float | str] = {}
    for name, values in read.held[step].items():
        nodes = read.file.members(name)
        if reference.node in nodes:
            held |= values
        if reference.turning != reference.node and reference.turning in nodes:
            held |= {freedom + 3: value for freedom, value in values.items() if freedom <= 3}
    return held


def loads(read: Any, reference: Reference, step: int) -> list[float]:
    """Return the components of the force and of the moment at a reference node, (6,)."""
    forces, shift = read.forces[step], 3 * (reference.turning != reference.node)
    return [
        *(forces.get((reference.node, freedom), 0.0) for freedom in (1, 2, 3)),
        *(forces.get((reference.turning, freedom - shift), 0.0) for freedom in (4, 5, 6)),
    ]


def obstacle(read: Any, reference: Reference, step: int, kind: str) -> Keyed:
    """Return the rigid body to which a surface is bonded, as it is at the end of a step."""
    held, acting = motions(read, reference, step), loads(read, reference, step)
    axial, dim = kind == "CAX", 3 if kind == "C3D" else 2
    # a ring that is rigid keeps its radius
    move = [held.get(c + 1, 0.0 if axial and not c else "free") for c in range(dim)]
    says: Keyed = {"name": reference.name, "displacement": move, "force": acting[:dim]}
    if dim == 3:
        says |= {"rotation": [held.get(c, "free") for c in (4, 5, 6)], "moment": acting[3:]}
    elif not axial:
        says |= {"rotation": held.get(6, "free"), "moment": acting[5]}
    return says if step else says | {"centre": list(read.file.nodes[reference.node][:dim])}


def bolt(read: Any, reference: Reference, step: int) -> Keyed:
    """Return the tension of a bolt at the end of a step, or by how much it is shortened."""
    held, way = motions(read, reference, step).get(1), _way(read, reference)
    if isinstance(held, str):
        return {"preload": "locked"}
    if held is not None:
        return {"clearance": way * held}
    force = way * loads(read, reference, step)[0]
    if force < 0.0:
        read.notes.append(
            f"*PRE-TENSION SECTION {reference.surface}: {-force:g} would push the bolt apart, by "
            "the sign of the force and the way of the normal, and a preload pulls; not taken"
        )
    return {"preload": max(force, 0.0)}


def _way(read: Any, reference: Reference) -> float:
    """Return 1 where the normal of a section points out of the elements of its surface, or none is
    given, and -1 where it points into them."""
    if not any(reference.normal):
        return 1.0
    file, out = read.file, np.zeros(3)
    for number, k in read.surfaces[reference.surface]:
        own = np.array([file.nodes[n] for n in file.corners((number, k))])
        middle = np.mean([file.nodes[n] for n in file.elements[number][1]], axis=0)
        normal = outward(own[:, : 2 + (len(own) > 2)])
        out[: len(normal)] += normal * np.sign(normal @ (own.mean(axis=0) - middle)[: len(normal)])
    share = float(out @ reference.normal / np.linalg.norm(out) / np.linalg.norm(reference.normal))
    if round(abs(share), 2) < 1.0:
        read.notes.append(
            f"*PRE-TENSION SECTION {reference.surface}: its normal is at "
            f"{math.degrees(math.acos(abs(share))):.0f}° to that of its faces; the bolt is pulled "
            "along that of its faces"
        )
    return math.copysign(1.0, share)


def spread(read: Any, kind: str) -> Iterator[str]:
    """Spread forces and moments at reference nodes over faces; yield what has no meaning here."""
    file, done = read.file, set[int]()
    for reference in [one for one in read.references if one.kind == "spread"]:
        faces, node = read.surfaces[reference.surface], reference.node
        read.used.add(reference.surface)
        if any(motions(read, reference, k) for k in range(len(read.held))):
            yield (
                f"*BOUNDARY: {node} is a node that spreads forces, and would hold the mean motion "
                f"of {reference.surface}; not taken"
            )
        if node in done or not faces:
            yield f"{reference.surface}: follows node {node} without a face of its own; not taken"
            continue
        done.add(node)
        dim = 3 if kind == "C3D" else 2
        cells = [np.array([file.nodes[n][:dim] for n in file.cell(face)]) for face in faces]
        for k, step in enumerate(read.tractions):
            acting = np.array(loads(read, reference, k))
            at = np.array(file.nodes[node][:dim])
            if acting.any():
                pull = turning_traction(cells, at, acting[:3], acting[3:], kind == "CAX")
                step |= {face: step.get(face, 0.0) + pull / read.width(face) for face in faces}


def cut(read: Any, groups: list[list[int]]) -> list[list[int]]:
    """Return groups of elements, of which those with a section of a bolt are cut there, into a
    pair."""
    for reference in [one for one in read.references if one.kind == "cut"]:
        own, other = {*read.surfaces[reference.surface]}, f"{reference.surface}-2"
        (group,) = [one for one in groups if {number for number, _ in own} & {*one}][:1] or [[]]
        parts, read.surfaces[other] = _cut(read.file, group, own)
        if len(parts) < 2 or len(read.surfaces[other]) < len(own):
            read.notes.append(
                f"*PRE-TENSION SECTION {reference.surface}: cuts no body in two; not taken"
            )
            continue
        groups = [one for one in groups if one is not group] + parts
        pair = {"secondary": reference.surface, "primary": other, "bolt": reference}
        read.pairs.append({"interaction": "", "kind": "TIE", **pair})
        read.used |= {reference.surface, other}
    return groups


def _cut(file: InpFile, group: list[int], own: set[Face]) -> tuple[list[list[int]], list[Face]]:
    """Return what of elements hangs together by other faces than some, and the faces opposite."""
    section = {frozenset(file.corners(face)) for face in own}
    places = {face: frozenset(file.corners(face)) for n in group for face in file.faces(n)}
    numbers = {place: k for k, place in enumerate(dict.fromkeys(places.values()))}
    sides: dict[int, list[int]] = {number: [] for number in group}
    for (number, _), place in places.items():
        sides[number] += [numbers[place]] * (place not in section)
    opposite = [face for face, place in places.items() if place in section and face not in own]
    return connected(sides) if group else [], opposite
