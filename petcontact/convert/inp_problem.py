"""A problem from an input file of Abaqus or CalculiX; what of it does not fit is named."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import tomli_w

from ..arrays import connected
from ..errors import InputError
from ..given.tables.mistakes import NAME
from ..untyped import Keyed
from .inp_body import InpBody, boundary_faces
from .inp_elements import check_elements, count
from .inp_file import Face, read_inp
from .inp_references import Reference, bolt, cut, obstacle, spread
from .inp_statements import Statements

Pair = tuple[Keyed, Reference | None, str]
"""A contact, the node at which a bolt is pulled there, and its interaction."""


@dataclass
class Converted:
    """The files of a problem.

    Attributes
    ----------
    toml : str
    meshes : dict of str to str
        Contents of .msh files by name.
    notes : list of str
        What of the file was not taken, a line each.
    """

    toml: str = ""
    meshes: dict[str, str] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)


def convert_inp(path: str | Path, name: str) -> Converted:
    """The problem of an input file, as a config and a mesh of the surface of each body.

    Bodies are what hangs together by nodes, with the material of their *SOLID SECTION. Taken are
    *SURFACE, *CONTACT PAIR and *TIE with *FRICTION and *CLEARANCE, *BOUNDARY of nodes that cover
    faces, also FIXED, *DLOAD and *DSLOAD of pressure, tractions and forces of the volume, *CLOAD,
    and *TEMPERATURE that is uniform or linear in a body. *RIGID BODY and kinematic couplings are
    obstacles to which a surface is bonded, distributing ones tractions, *PRE-TENSION SECTION a cut
    with a preload. OP=NEW takes loads of earlier steps away. Edges of elements of second order are
    curved.

    Raises
    ------
    InputError
        If the file cannot be read, holds no body, one of several materials, or bodies of revolution
        beside others.
    """
    reader = Statements(read_inp(path))
    reader.notes += check_elements(reader.file)
    reader.read()
    bodies = _bodies(reader)
    if len({body.kind == "CAX" for body in bodies}) > 1:
        raise InputError(
            f"{path}: bodies of revolution (CAX) beside others; a problem has one kind"
        )
    meshes = {f"{name}-{body.name}.msh": body for body in bodies}
    pairs = list(_pairs(reader, bodies))
    data: Keyed = {
        "title": Path(path).stem,
        "symmetry": "axial" if bodies[0].kind == "CAX" else "",
        "body": [body.table(mesh) for mesh, body in meshes.items()],
        "obstacle": [obstacle(reader, one, 0, bodies[0].kind) for one in _rigid(reader, pairs)],
        "contact": [one[0] | (bolt(reader, one[1], 0) if one[1] else {}) for one in pairs],
        "step": list(_steps(reader, bodies, pairs)),
    }
    lost = [*_uncovered(reader, bodies), *_unused(reader, bodies), *_lost_forces(reader, bodies)]
    notes = list(dict.fromkeys([*reader.notes, *lost]))  # bodies and steps may say the same
    text = tomli_w.dumps({key: value for key, value in data.items() if value})
    return Converted(
        f"#:schema petcontact.schema.json\n# From {Path(path).name}.\n{_head(notes)}{text}",
        {mesh: body.msh() for mesh, body in meshes.items()},
        notes,
    )


def _head(notes: list[str]) -> str:
    return "".join(f"# not taken: {note}\n" for note in notes)


def _bodies(reader: Statements) -> list[InpBody]:
    """What hangs together by nodes; surfaces that are given by nodes get the faces of these."""
    elements = {number: reader.file.elements[number][1] for number in sorted(reader.file.elements)}
    groups = connected(elements)
    if reader.covering:
        every = [pair for group in groups for pair in boundary_faces(reader.file, group).items()]
        for surface, nodes in reader.covering.items():
            reader.surfaces[surface] += [face for face, own in every if nodes.issuperset(own)]
    groups = cut(reader, groups)
    for one in [one for one in reader.references if one.kind == "rigid"]:
        ends = {"secondary": one.surface, "primary": one.name}
        reader.pairs.append({"interaction": "", "kind": "TIE", **ends})
        reader.used.add(one.surface)
    reader.notes += spread(reader, reader.file.elements[groups[0][0]][0][:3])
    names = _names(reader, groups)
    return [InpBody(reader, group, name) for group, name in zip(groups, names, strict=True)]


def _names(reader: Statements, groups: list[list[int]]) -> Iterator[str]:
    """Yield the names of bodies: that of an instance which is one body, else a number."""
    owners = [sorted({reader.file.instances[number] for number in group}) for group in groups]
    for number, owner in enumerate(owners, 1):
        alone = len(owner) == 1 and [*itertools.chain(*owners)].count(owner[0]) == 1
        yield owner[0] if alone and re.match(NAME, owner[0]) else f"body{number}"


def _uncovered(reader: Statements, bodies: list[InpBody]) -> Iterator[str]:
    """Node sets that hold no face."""
    for name, values in reader.held[-1].items():
        nodes = [*{*reader.file.members(name)} - reader.apart]
        # what lies on an axis of revolution stays there
        still = bodies[0].kind == "CAX" and {*values} == {1}
        if (
            nodes
            and not any(name in body.sets for body in bodies)
            and not (still and all(reader.file.nodes[node][0] == 0.0 for node in nodes))
        ):
            yield (
                f"*BOUNDARY: {name} ({count(nodes, 'node')}) covers no face of a body that is not "
                f"in contact; not taken"
            )


def _lost_forces(reader: Statements, bodies: list[InpBody]) -> Iterator[str]:
    """Forces at nodes of no body, or across the plane of one."""
    forces = {
        (node, freedom)
        for step in reader.forces
        for (node, freedom), force in step.items()
        if force and node not in reader.apart
    }
    if lost := [n for n, _ in sorted(forces.difference(*(body.freedoms for body in bodies)))]:
        yield f"*CLOAD: {count(lost, 'node')} of no body, or across its plane; not taken"


def _unused(reader: Statements, bodies: list[InpBody]) -> Iterator[str]:
    """Surfaces and pressed faces that came to nothing."""
    parts = {face: part for body in bodies for face, part in body.parts.items()}
    for name, faces in reader.surfaces.items():
        if inside := [number for number, k in faces if (number, k) not in parts]:
            yield f"*SURFACE {name}: faces inside of {count(inside, 'element')}; not taken"
    if idle := [name for name in reader.surfaces if name not in reader.used]:
        yield f"*SURFACE {', '.join(idle)}: in no contact pair or load; not taken"
    given = set[Face]().union(*reader.pressed, *reader.tractions)
    pressed = given.difference(*(body.free for body in bodies))
    if lost := [number for number, _ in pressed]:
        yield (
            f"load on faces of {count(lost, 'element')} that lie inside, are held or in "
            f"contact; not taken"
        )


def _pairs(reader: Statements, bodies: list[InpBody]) -> Iterator[Pair]:
    """Contacts, each with the node at which a bolt is pulled there, and its interaction."""
    nodes = {one.name for one in reader.references}
    for number, pair in enumerate(reader.pairs, 1):
        ends = {
            side: [f"{body.name}.{pair[side]}" for body in bodies if pair[side] in body.surfaces]
            or [pair[side]] * (pair[side] in nodes)
            for side in ("secondary", "primary")
        }
        if not all(ends.values()):
            reader.notes.append(
                f"*{pair['kind']} {pair['secondary']}, {pair['primary']}: each surface must lie on "
                f"a body; not taken"
            )
            continue
        law = dict(reader.laws[0].get(pair["interaction"], {}))
        if pair["kind"] == "TIE" or law.get("normal") == "bonded":
            law = {"normal": "bonded"}
        gap = reader.clearances.get((pair["secondary"], pair["primary"]))
        sides = {side: end if len(end) > 1 else end[0] for side, end in ends.items()}
        given = {"name": f"pair{number}", **sides, **law, **({} if gap is None else {"gap": gap})}
        named = "" if law.get("normal") == "bonded" else pair["interaction"]
        yield given, pair.get("bolt"), named


def _rigid(reader: Statements, pairs: list[Pair]) -> list[Reference]:
    """Reference nodes to which a surface is bonded; one may have several surfaces."""
    names = {one.name: one for one in reader.references}
    return [
        names[name]
        for name in dict.fromkeys(str(p["primary"]) for p, _, _ in pairs)
        if name in names
    ]


def _steps(reader: Statements, bodies: list[InpBody], pairs: list[Pair]) -> Iterator[Keyed]:
    """Load steps, where there are several: what has another value than in the step before."""
    for number, name in enumerate(reader.steps if len(reader.steps) > 1 else ()):
        changes: dict[str, list[Keyed]] = {"boundary": [], "loads": [], "point_force": []}
        for body in bodies if number else ():
            own = {"body": body.name}
            changes["boundary"] += [
                {**own, **now}
                for now, before in zip(
                    body.conditions(number), body.conditions(number - 1), strict=True
                )
                if now != before
            ]
            changes["point_force"] += [
                force for force in body.forces(number) if force not in body.forces(number - 1)
            ]
            now, before = body.volume(number), body.volume(number - 1)
            if now != before:
                changes["loads"].append({**own, **now})
        if number:
            changes |= _followers(reader, pairs, bodies[0].kind, number)
        yield {"name": name, **{k: v for k, v in changes.items() if v}}


def _followers(
    reader: Statements, pairs: list[Pair], kind: str, step: int
) -> dict[str, list[Keyed]]:
    """What reference nodes and *CHANGE FRICTION change in a step."""
    moved = [
        [obstacle(reader, one, k, kind) for one in _rigid(reader, pairs)] for k in (step, step - 1)
    ]
    laws = [
        [
            {
                "name": pair["name"],
                **(bolt(reader, at, k) if at else {}),
                **{word: v for word, v in reader.laws[k].get(name, {}).items() if word != "normal"},
            }
            for pair, at, name in pairs
        ]
        for k in (step, step - 1)
    ]
    return {
        key: [now for now, was in zip(*states, strict=True) if now != was]
        for key, states in (("obstacle", moved), ("contact", laws))
    }
