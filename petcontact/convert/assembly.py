"""A config that is proposed for the bodies of a CAD file or of a mesh: which of their parts may
touch, and where supports and loads may go."""

from __future__ import annotations

import functools
import json
import math
import os
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, shown
from ..errors import InputError
from ..geometry.cad.part import CadSurface, is_cad, solids_of
from ..geometry.gmsh import read_msh
from ..geometry.gmsh_bodies import bodies_of
from ..geometry.outline import Outline
from ..given.tables.solver_options import MeshOptions
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.grading import mesh_outline
from ..mesh.panelling import facet_mesh
from ..model.shapes.files import Gmsh
from ..round_off import WRITTEN
from ..untyped import Keyed
from .inp_problem import Converted
from .touching_parts import Ends, Meshes, area, centre, gaps_of, touching

PER_SIDE = 60
"""Elements along the diagonal of a plane body."""
MOVED = 0.01
"""Proposed displacement beyond the gaps [length]."""
PUSHED = "#>[body.loads]"
"""First line of what pushes a body that nothing but contact holds."""


def proposed(source: str, target: Path) -> Converted:
    """Return a config for the bodies of a file that can be meshed.

    Raises
    ------
    InputError
        If the file cannot be read, or no body of it can be meshed.
    """
    keys, notes = _bodies_of(source), list[str]()
    solids = _solids(source, keys, notes)
    meshes = {name: _mesh(solid) for name, solid in solids.items()}
    pairs = touching(meshes)
    ends = {end for pair in pairs for side in pair for end in side}
    notes += _alone(meshes, ends)
    lines = _head(source, target.name, len(meshes), len(pairs), notes)
    gaps = gaps_of(pairs, meshes, solids)
    given = _given(meshes, ends, _least(pairs, gaps))
    for name, mesh in meshes.items():
        keys[name] = {"file": os.path.relpath(source, target.parent), **keys[name]}
        lines += _body(name, {"shape": "gmsh", **keys[name]}, mesh, ends, given)
    lines += _contacts(pairs, gaps, given)
    return Converted("\n".join([*lines, ""]), notes=notes)


def _alone(meshes: Meshes, ends: set[str]) -> list[str]:
    """Return notes on bodies that touch no other one."""
    alone = meshes.keys() - {end.partition(".")[0] for end in ends} if len(meshes) > 1 else ()
    return [f"{name} touches no other body" for name in sorted(alone)]


def _least(pairs: list[Ends], gaps: dict[int, float]) -> dict[str, float]:
    """Return the least gap of each body to others, 0 where they touch [length]."""
    least = dict[str, float]()
    for number, ends in enumerate(pairs):
        for body in (end[0].partition(".")[0] for end in ends):
            least[body] = min(gaps.get(number, 0.0), least.get(body, math.inf))
    return least


def with_contacts(found: Converted) -> Converted:
    """Return the problem of an input file; where it has no contact, those of faces that are near
    each other as proposals."""
    if tomllib.loads(found.toml).get("contact") or len(found.meshes) < 2:
        return found
    meshes = Meshes()
    with tempfile.TemporaryDirectory(prefix="petcontact-") as folder, suppress(InputError):
        for file, text in found.meshes.items():
            (Path(folder) / file).write_text(text)
            solid = Gmsh(str(Path(folder) / file)).outline()
            meshes[file.rpartition("-")[2].removesuffix(".msh")] = _mesh(solid)
    pairs = touching(meshes)
    if not pairs:
        return found
    lines = [f"#>{line}" if line else line for line in _contacts(pairs, {}, {})]
    note = "bodies are near each other and no *CONTACT PAIR says how they touch: see #> at the end"
    return Converted("\n".join([found.toml, *lines, ""]), found.meshes, [*found.notes, note])


def _head(source: str, title: str, bodies: int, contacts: int, notes: list[str]) -> list[str]:
    return [
        "#:schema petcontact.schema.json",
        f"# Proposed for {Path(source).name}. Number of bodies: {bodies}, of contacts: {contacts}.",
        "# Give materials, supports and loads: lines with #> are proposals, without these signs.",
        *(f"# {note}" for note in notes),
        f"title = {json.dumps(title)}",
        'units = { length = "mm", stress = "MPa" }',
    ]


def _bodies_of(source: str) -> dict[str, Keyed]:
    """Return the keys of [geometry] that tell each body of a file, by a name for it."""
    if is_cad(source):
        return {name: {"solid": number} for number, name in solids_of(source).items()}
    names = bodies_of(read_msh(source))
    return {name: {"surface": name} for name in names} if len(names) > 1 else {"body": {}}


def _solids(source: str, keys: dict[str, Keyed], notes: list[str]) -> dict[str, Any]:
    """Return the boundaries of the bodies that can be meshed; note the others."""
    solids = dict[str, Any]()
    for name, key in keys.items():
        try:
            boundary = Gmsh(source, **key).outline()
            _mesh(boundary)
        except InputError as error:
            notes.append(f"{name} is left out: {str(error).removeprefix(f'{source}: ')}")
        else:
            solids[name] = boundary
    if not solids:
        raise InputError(f"{source}: {notes[0]}")
    return solids


@functools.singledispatch
def _mesh(boundary: Any) -> BoundaryMesh:
    """Return a mesh of a boundary, fine enough to see what it is near to."""
    return facet_mesh(boundary, 1)


@_mesh.register
def _(boundary: CadSurface) -> BoundaryMesh:
    return _mesh(boundary.facets())


@_mesh.register
def _(boundary: Outline) -> BoundaryMesh:
    size = boundary.diameter / PER_SIDE
    return mesh_outline(boundary, MeshOptions(element_size=size, order=1))


def _given(meshes: Meshes, ends: set[str], gaps: dict[str, float]) -> dict[str, list[str]]:
    """Return proposed conditions of bodies: the largest is held at its back, another one moved
    towards it by more than its gap, or pushed where all of it may touch."""
    every = [(name, part) for name, mesh in meshes.items() for part in mesh.part_names]
    centres = {end: centre(meshes[end[0]], end[1]) for end in every}
    free = [end for end in every if ".".join(end) not in ends]
    if not free:
        return {}
    first = max(dict(free), key=lambda name: _volume(meshes[name]))
    held = _back(meshes[first], [end[1] for end in free if end[0] == first])
    place, dim = centres[first, held], meshes[first].dim
    far = [end for end in free if end[1] != held and (end[0] != first or len(meshes) == 1)]
    far = far or [end for end in every if end[0] != first]
    given = {first: _displaced(held, [0.0] * dim)}
    if far:
        end = max(far, key=lambda end: _rounded(float(np.linalg.norm(centres[end] - place))))
        moved = _moved(meshes, end, place, gaps.get(end[0], 0.0), moves=end in free)
        given[end[0]] = given.get(end[0], []) + moved
    return given


def _moved(
    meshes: Meshes, end: tuple[str, str], to: Array, gap: float, *, moves: bool
) -> list[str]:
    """Return conditions that move a part towards a place along an axis, beyond a gap, or push its
    body there."""
    mesh, part = meshes[end[0]], end[1]
    way = to - centre(mesh, part)
    way = np.sign(way) * (np.arange(mesh.dim) == np.argmax(np.abs(way))) + 0.0
    if moves:
        return _displaced(part, (_rounded(gap + MOVED) * way).tolist())
    force = [_rounded(1000.0 / _volume(mesh) * c) for c in way]
    return [PUSHED, f"#>force = {force}     # 1000 in all"]


def _back(mesh: BoundaryMesh, free: list[str]) -> str:
    """Return the free part that looks away from the others, or the farthest where they surround
    it."""
    others = [part for part in mesh.part_names if part not in free] or free
    nodes = np.concatenate([mesh.nodes_of(part) for part in others])
    weight = mesh.weight[nodes] / mesh.weight[nodes].sum()
    front, middle = weight @ mesh.normal[nodes], weight @ mesh.x[nodes]

    def away(part: str) -> float:
        own = mesh.nodes_of(part)
        return _rounded(
            -float(front @ (mesh.weight[own] @ mesh.normal[own])) / area(mesh, part)
            if np.linalg.norm(front) > 0.5
            else float(np.linalg.norm(centre(mesh, part) - middle))
        )

    return max(free, key=away)


def _rounded(value: float) -> float:
    """Return a number of so few digits that those of alike parts are equal."""
    return float(f"{value:.3g}")


def _volume(mesh: BoundaryMesh) -> float:
    return float(mesh.weight @ np.einsum("ij,ij->i", mesh.x - mesh.x[0], mesh.normal)) / mesh.dim


def _displaced(part: str, value: list[float]) -> list[str]:
    return [
        "#>[[body.boundary]]",
        f"#>part = {json.dumps(part)}",
        '#>condition = "displacement"',
        f"#>value = {value}",
    ]


def _body(
    name: str, geometry: Keyed, mesh: BoundaryMesh, ends: set[str], given: dict[str, list[str]]
) -> Iterator[str]:
    """Yield the table of a body, with its parts and proposed conditions as comments."""
    table = ", ".join(f"{key} = {json.dumps(value)}" for key, value in geometry.items())
    yield from [
        "",
        "[[body]]",
        f"name = {json.dumps(name)}",
        "material = { young_modulus = 210_000.0, poisson_ratio = 0.3 }     # of steel",
        f"geometry = {{ {table} }}",
    ]
    for part in mesh.part_names:
        touches = "touches another body" if f"{name}.{part}" in ends else "free"
        yield (
            f"# part {json.dumps(part)}: {touches}, area {area(mesh, part):.4g}, centre "
            f"{shown(centre(mesh, part), 4)}"
        )
    yield from given.get(name, [])


def _contacts(
    pairs: list[Ends], gaps: dict[int, float], given: dict[str, list[str]]
) -> Iterator[str]:
    loose = {name for name, conditions in given.items() if PUSHED in conditions}
    screwed = _screwed(pairs, gaps)
    for number, ends in enumerate(pairs):
        sides = [json.dumps(side if len(side) > 1 else side[0]) for side in ends]
        yield from ["", "[[contact]]", f'name = "contact{number + 1}"']
        yield from [f"secondary = {sides[0]}", f"primary = {sides[1]}"]
        if number in screwed:
            yield 'normal = "bonded"     # as a thread; if it slides, leave this out'
            continue
        if number in gaps:
            yield f"gap = {gaps[number]:.6g}"
        if loose & {end[0].partition(".")[0] for end in ends}:
            yield "# without friction, of which a body that it alone holds takes long"
        else:
            yield "friction_coefficient = 0.15"
        if number in screwed.values():
            yield "#>preload = 1000.0     # of the bolt"


def _screwed(pairs: list[Ends], gaps: dict[int, float]) -> dict[int, int]:
    """Return pairs of a nut and its bolt, and of the nut and what it is pulled against: it touches
    two bodies, one of them all around and nowhere else."""
    bodies = [tuple(end[0].partition(".")[0] for end in ends) for ends in pairs]
    found = dict[int, int]()
    for k in [k for k, gap in gaps.items() if gap < WRITTEN]:
        for nut in bodies[k]:
            others = [j for j, pair in enumerate(bodies) if nut in pair and j != k]
            if len(others) == 1 and set(bodies[others[0]]) != set(bodies[k]):
                found[k] = others[0]
    return found
