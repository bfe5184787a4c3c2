"""Outlines from Gmsh meshes (`shape = "gmsh"`): the boundary lines of a 2D mesh, physical line
groups being the parts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from ..arrays import LARGEST_COORDINATE, AnyArray, Array, shown
from ..errors import InputError
from ..round_off import CHAINED, WRITTEN
from ..untyped import Mesh
from .arcs import turn_through
from .outline import Outline, Side, arc, oriented

CORNERS = {"triangle": 3, "triangle6": 3, "triangle7": 3, "quad": 4, "quad8": 4, "quad9": 4}
"""Corners of the cells whose edges say where the boundary is; corners come first in a cell's list
of nodes."""

UNNAMED = "unnamed"
"""The part of the boundary lines of a mesh with cells that are in no physical group: it is free
where it has no condition."""
NODES = {"line": 2, "triangle": 3, "quad": 4}
"""Number of nodes of the cells whose names do not end with it."""


def gmsh_outline(mesh: Mesh, file: str, axial: bool = False) -> Outline:
    """Return the outline of a plane mesh that meshio has read.

    Each boundary line of the mesh is a side of its own. A line of second order becomes the circular
    arc through its three nodes. If there are 2D cells, only lines of exactly one cell count, and
    those in no group are the part `UNNAMED`. Lines of a half section on the axis x = 0 need no
    group.

    Raises
    ------
    InputError
        If the mesh names no part somewhere, or its boundary lines do not close.
    """
    points = np.asarray(mesh.points[:, :2], dtype=float)
    lines = _lines(mesh, file)
    edges = _boundary_edges(mesh)
    if edges is not None and not edges:
        raise InputError(f"{file}: damaged (each edge belongs to two cells or more: no boundary)")
    if axial:
        lines |= _on_axis(lines, edges, points)
    if edges is not None:
        lines = {
            (a, b): lines.get((a, b), (a, b, middle, UNNAMED)) for (a, b), middle in edges.items()
        }
    return Outline(oriented(list(_loops(lines, points, file))))


def read_msh(file: str) -> Mesh:
    """The mesh of a Gmsh file, as meshio has it.

    Raises
    ------
    InputError
        If there is no such file or it is no Gmsh mesh.
    """
    if not Path(file).is_file():
        raise InputError(f"{file}: no such file (geometry.file is relative to the config's folder)")
    import meshio

    try:
        mesh = meshio.gmsh.read(file)
    except (
        Exception
    ) as error:  # meshio meets damaged files with whatever exception its parser runs into
        reason = (
            str(error).splitlines()[0]
            if isinstance(error, meshio.ReadError) and str(error)
            else _damage(file)
        )
        raise InputError(
            f"{file}: not a Gmsh mesh that can be read ({reason}); save it as format 2.2 or 4.1 "
            f"without Mesh.SaveAll"
        ) from None
    if mesh.points.dtype.kind != "f" or not np.all(np.abs(mesh.points) <= LARGEST_COORDINATE):
        raise InputError(
            f"{file}: coordinates that are not finite, or larger than {LARGEST_COORDINATE:g}"
        )
    for block in mesh.cells:
        _demand_cells(file, block.type, np.asarray(block.data), len(mesh.points))
    for name in mesh.field_data:
        if not str(name).isprintable():
            raise InputError(f"{file}: {str(name)[:40]!r} is no name of a physical group")
    return mesh


def _demand_cells(file: str, kind: str, cells: AnyArray, count: int) -> None:
    """Refuse cells with another number of nodes than their kind, and nodes that do not exist.

    For meshio a negative number counts from the end.
    """
    number = re.search(r"\d+$", kind)
    nodes = NODES.get(kind) if number is None else int(number.group())
    if nodes is not None and cells.shape[1:] != (nodes,):
        raise InputError(f"{file}: damaged (cells of type {kind} have no {nodes} nodes)")
    whole = cells.dtype.kind in "iu"
    if not whole or (cells.size and not 0 <= cells.min() <= cells.max() < count):
        raise InputError(f"{file}: damaged (a cell has a node that is not there)")


def _damage(file: str) -> str:
    """What is wrong with a file whose numbers cannot be read."""
    sections = re.findall(rb"^\$([A-Za-z]+)", Path(file).read_bytes(), re.MULTILINE)
    if sections and not sections[-1].startswith(b"End"):
        return f"it is cut off inside ${sections[-1].decode()}"
    return "its sections do not hold what they announce" if sections else "it has no sections"


Line = tuple[int, int, int | None, str]
"""First, last and middle node of a boundary line, and its part."""
Edges = dict[tuple[int, int], int | None]
"""Edges of exactly one cell by the sorted pair of their end nodes: the middle node, if there is
one."""


def _lines(mesh: Mesh, file: str) -> dict[tuple[int, int], Line]:
    """Lines in physical groups, by the sorted pair of their end nodes."""
    names = {
        int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 1
    }
    tags = mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells))
    result: dict[tuple[int, int], Line] = {}
    for block, physical in zip(mesh.cells, tags, strict=True):
        if block.type not in ("line", "line3"):
            if block.type.startswith("line"):
                raise InputError(
                    f"{file}: lines of type {block.type}; boundary lines of first or second order "
                    "are read"
                )
            continue
        for row, nodes in enumerate(block.data.tolist()):
            tag = 0 if physical is None else int(physical[row])
            if tag == 0:
                continue
            edge = (min(nodes[:2]), max(nodes[:2]))
            part = names.get(tag, str(tag))
            if edge in result and result[edge][3] != part:
                raise InputError(
                    f"{file}: a boundary line is in two physical groups, {result[edge][3]!r} and "
                    f"{part!r}"
                )
            result[edge] = (nodes[0], nodes[1], nodes[2] if len(nodes) == 3 else None, part)
    if not result:
        raise InputError(
            f"{file}: no line is in a physical group; physical line groups are the parts of the "
            "boundary of a body whose nodes all lie in one plane z = const"
        )
    return result


def _on_axis(
    lines: dict[tuple[int, int], Line], edges: Edges | None, points: Array
) -> dict[tuple[int, int], Line]:
    """Lines on the axis that no group has: edges of one cell, without cells what closes chains that
    begin and end there."""
    used, count = np.unique(np.array(list(lines)), return_counts=True)
    places = points[used] if edges is None else points[np.array(list(edges)).ravel()]
    near = np.abs(points[:, 0]) <= WRITTEN * np.hypot(*np.ptp(places, axis=0))
    if edges is None:
        ends = used[(count == 1) & near[used]]
        ends = ends[np.argsort(points[ends, 1])]
        on_axis = [
            tuple(sorted(pair))
            for pair in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=False)
        ]
    else:
        on_axis = [edge for edge in edges.keys() - set(lines) if near[list(edge)].all()]
    return {(a, b): (a, b, None, "axis") for a, b in on_axis}


def _boundary_edges(mesh: Mesh) -> Edges | None:
    """The edges of exactly one cell, None where there are no 2D cells."""
    edges = []
    for block in mesh.cells:
        corners = CORNERS.get(block.type)
        if corners is not None:
            cells = np.asarray(block.data, dtype=np.int64)
            for k in range(corners):
                # the middles of the edges follow the corners
                middle = (
                    cells[:, corners + k] if cells.shape[1] > corners else np.full(len(cells), -1)
                )
                ends = np.sort(cells[:, [k, (k + 1) % corners]], axis=1)
                edges.append(np.column_stack([ends, middle]))
    if not edges:
        return None
    every = np.vstack(edges)
    _, first, count = np.unique(every[:, :2], axis=0, return_index=True, return_counts=True)
    found = every[first[count == 1]].tolist()
    return {(a, b): None if middle < 0 else middle for a, b, middle in found}


def _loops(lines: dict[tuple[int, int], Line], points: Array, file: str) -> Iterator[list[Side]]:
    """Lines chained into closed loops of sides."""
    at_node: dict[int, list[tuple[int, int]]] = {}
    for edge in lines:
        for node in edge:
            at_node.setdefault(node, []).append(edge)
    for node, edges in at_node.items():
        if len(edges) != 2:
            raise InputError(
                f"{file}: {len(edges)} boundary line{'s meet' if len(edges) > 1 else ' ends'} at "
                f"{shown(points[node])}; the lines of the physical groups must form closed loops "
                "with shared nodes"
            )
    left = dict.fromkeys(lines)
    while left:
        edge = next(iter(left))
        node = first = lines[edge][0]
        loop: list[Side] = []
        while True:
            del left[edge]
            a, b, middle, part = lines[edge]
            following = b if node == a else a
            loop += _side(
                points[node], None if middle is None else points[middle], points[following], part
            )
            node = following
            if node == first:
                break
            one, other = at_node[node]
            edge = other if one == edge else one
        yield _from_start_of_part(loop)


def _from_start_of_part(loop: list[Side]) -> list[Side]:
    """The loop begun where a part begins, so that arc length runs through each part."""
    for k, side in enumerate(loop):
        if side.part != loop[k - 1].part:
            return loop[k:] + loop[:k]
    return loop


def _side(start: Array, middle: Array | None, end: Array, part: str) -> list[Side]:
    chord = end - start
    if middle is not None:
        offset = middle - start
        if abs(chord[0] * offset[1] - chord[1] * offset[0]) > CHAINED * float(chord @ chord):
            return arc(start, end, turn_through(start, middle, end), part)
    return [Side(start, end, part)]
