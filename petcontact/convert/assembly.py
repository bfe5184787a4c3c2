"""A config that is proposed for the bodies of a CAD file or of a mesh: which of their parts may
touch, and where supports and loads may go."""

from __future__ import annotations

import functools
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import scipy.spatial

from ..arrays import Array, Index, shown
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

NEAR = 0.3
"""Distance of two parts, over the size of the smaller one of their cells, up to which they may
touch. The chords of cells on a circle, eight around it, lie 0.1 of their size off it."""
OPPOSED = -0.7
"""Product of the normals of parts that face each other: within 45 degrees."""
FEWEST = 3
"""Nodes of a part that lie beside another one; parts that meet at a corner have fewer."""
NEIGHBOURS = 6
"""Nodes of the other body that are looked at: those of the nearest cell and of its neighbours."""
PER_SIDE = 60
"""Elements along the diagonal of a plane body."""
Meshes = dict[str, BoundaryMesh]
Ends = tuple[list[str], list[str]]


def proposed(source: str, target: Path) -> Converted:
    """Return a config for the bodies of a file that can be meshed.

    Raises
    ------
    InputError
        If the file cannot be read, or no body of it can be meshed.
    """
    path, notes, meshes = os.path.relpath(source, target.parent), list[str](), Meshes()
    geometries = dict[str, Keyed]()
    for name, key in _bodies_of(source).items():
        try:
            meshes[name] = _mesh(Gmsh(source, **key).outline())
        except InputError as error:
            notes.append(f"{name} is left out: {str(error).removeprefix(f'{source}: ')}")
        geometries[name] = {"shape": "gmsh", "file": path, **key}
    if not meshes:
        raise InputError(f"{source}: {notes[0]}")
    pairs = touching(meshes)
    ends = {end for pair in pairs for side in pair for end in side}
    alone = meshes.keys() - {end.partition(".")[0] for end in ends} if len(meshes) > 1 else ()
    notes += [f"{name} touches no other body" for name in sorted(alone)]
    lines, given = _head(source, target.name, len(meshes), len(pairs), notes), _far(meshes, ends)
    for name, mesh in meshes.items():
        lines += _body(name, geometries[name], mesh, ends, given)
    return Converted("\n".join([*lines, *_contacts(pairs), ""]), notes=notes)


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


def touching(meshes: Meshes) -> list[Ends]:
    """Return the parts "body.part" of each two bodies that may touch, those with less area first.

    A node is near another body where one of its nearest nodes there has an opposite normal, and a
    tangent plane that is closer than `NEAR`.
    """
    names, result = list(meshes), list[Ends]()
    for a, one in enumerate(names):
        for two in names[a + 1 :]:
            found = _near(meshes[one], meshes[two])
            found |= {(part, other) for other, part in _near(meshes[two], meshes[one])}
            sides = [
                (body, sorted({pair[k] for pair in found})) for k, body in enumerate((one, two))
            ]
            sides.sort(key=lambda side: sum(_area(meshes[side[0]], part) for part in side[1]))
            ends = [[f"{body}.{part}" for part in parts] for body, parts in sides]
            result += [(ends[0], ends[1])] if found else []
    return result


def _near(mesh: BoundaryMesh, other: BoundaryMesh) -> set[tuple[str, str]]:
    """Return the parts of a mesh that have nodes near parts of another one, and these."""
    row, there = _beside(mesh, other)
    own, far = _sizes(mesh)[row], _sizes(other)[there]
    off, normal = other.x[there] - mesh.x[row], other.normal[there]
    met = np.abs(np.einsum("ij,ij->i", off, normal)) < NEAR * np.minimum(own, far)
    met &= np.linalg.norm(off, axis=1) < np.maximum(own, far)
    met &= np.einsum("ij,ij->i", mesh.normal[row], normal) < OPPOSED
    places = np.column_stack([mesh.node_part[row], other.node_part[there], row])[met]
    parts, count = np.unique(np.unique(places, axis=0)[:, :2], axis=0, return_counts=True)
    return {(mesh.part_names[p], other.part_names[q]) for p, q in parts[count >= FEWEST].tolist()}


def _beside(mesh: BoundaryMesh, other: BoundaryMesh) -> tuple[Index, Index]:
    """Return nodes of a mesh and nodes of another one, of which some are nearest to each."""
    reach = float(max(_sizes(mesh).max(), _sizes(other).max()))
    count = min(NEIGHBOURS, len(other.x))
    found = scipy.spatial.cKDTree(other.x).query(mesh.x, k=count, distance_upper_bound=reach)[1]
    row, column = np.nonzero(found < len(other.x))
    return row, found[row, column]


def _sizes(mesh: BoundaryMesh) -> Array:
    """Return the size of the element of each node [length]."""
    area = np.bincount(mesh.element, mesh.weight)
    return np.asarray(area[mesh.element] ** (1.0 / (mesh.dim - 1)))


def _area(mesh: BoundaryMesh, part: str) -> float:
    return float(mesh.weight[mesh.nodes_of(part)].sum())


def _centre(mesh: BoundaryMesh, part: str) -> Array:
    nodes = mesh.nodes_of(part)
    centre = mesh.weight[nodes] @ mesh.x[nodes] / mesh.weight[nodes].sum()
    return np.where(np.abs(centre) < WRITTEN * np.abs(mesh.x).max(), 0.0, centre)


def _far(meshes: Meshes, ends: set[str]) -> list[str]:
    """Return the lowest of the parts that touch nothing, and the highest one of another body."""
    heights = {
        (name, part): float(_centre(mesh, part)[-1])
        for name, mesh in meshes.items()
        for part in mesh.part_names
        if f"{name}.{part}" not in ends
    }
    low = min(heights, key=lambda end: heights[end], default=None)
    others = [end for end in heights if low and (end[0] != low[0] or len(meshes) == 1)]
    high = max(others, key=lambda end: heights[end], default=None)
    return [".".join(end) for end in (low, high) if end]


def _body(
    name: str, geometry: Keyed, mesh: BoundaryMesh, ends: set[str], given: list[str]
) -> list[str]:
    """Return the table of a body, with its parts and proposed conditions as comments."""
    table = ", ".join(f"{key} = {json.dumps(value)}" for key, value in geometry.items())
    lines = [
        "",
        "[[body]]",
        f"name = {json.dumps(name)}",
        "material = { young_modulus = 210_000.0, poisson_ratio = 0.3 }     # of steel",
        f"geometry = {{ {table} }}",
    ]
    for part in mesh.part_names:
        touches = "touches another body" if f"{name}.{part}" in ends else "free"
        lines.append(
            f"# part {json.dumps(part)}: {touches}, area {_area(mesh, part):.4g}, centre "
            f"{shown(_centre(mesh, part), 4)}"
        )
    still = [0.0] * mesh.dim
    for end, value in zip(given, (still, [*still[1:], -0.01]), strict=False):
        if end.partition(".")[0] == name:
            part = json.dumps(end.partition(".")[2])
            lines += ["#>[[body.boundary]]", f"#>part = {part}", '#>condition = "displacement"']
            lines.append(f"#>value = {value}")
    return lines


def _contacts(pairs: list[Ends]) -> list[str]:
    lines = list[str]()
    for number, ends in enumerate(pairs, 1):
        sides = [json.dumps(side if len(side) > 1 else side[0]) for side in ends]
        lines += ["", "[[contact]]", f'name = "contact{number}"', f"secondary = {sides[0]}"]
        lines += [f"primary = {sides[1]}", "friction_coefficient = 0.15"]
    return lines
