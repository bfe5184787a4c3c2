"""One body of a Gmsh mesh that has several, by its physical surface, in space its physical
volume."""

from __future__ import annotations

import numpy as np

from ..arrays import Mask
from ..errors import InputError
from ..untyped import Mesh
from .gmsh_surface import is_surface

FLAT = ("triangle", "quad")
"""Beginnings of the types of plane cells."""


def body_of(mesh: Mesh, file: str, name: str) -> Mesh:
    """Return the mesh of one body.

    It has the cells of the physical surface and all lines, in space the cells of the physical
    volume and all surface cells.

    Raises
    ------
    InputError
        If the file has no such physical group, or nothing is in it.

    Examples
    --------
    >>> import meshio
    >>> cells = [("line", [[0, 1]]), ("triangle", [[0, 1, 2], [1, 3, 2]])]
    >>> tags = {"gmsh:physical": [np.array([1]), np.array([5, 6])]}
    >>> names = {"side": np.array([1, 1]), "left": np.array([5, 2]), "right": np.array([6, 2])}
    >>> mesh = meshio.Mesh(np.zeros((4, 3)), cells, cell_data=tags, field_data=names)
    >>> [block.data.tolist() for block in body_of(mesh, "two.msh", "right").cells]
    [[[0, 1]], [[1, 3, 2]]]
    """
    in_space = is_surface(mesh)
    rim = FLAT if in_space else ("line",)
    what = "volume" if in_space else "surface"
    groups = bodies_of(mesh)
    if name not in groups:
        group_names = ", ".join(sorted(groups)) or "none"
        raise InputError(f"{file}: surface: no physical {what} {name!r}; there are {group_names}")
    inside = [np.asarray(tag) == groups[name] for tag in mesh.cell_data["gmsh:physical"]]
    if not np.concatenate(inside).any():
        raise InputError(f"{file}: surface: nothing is in the physical {what} {name!r}")
    return _kept(
        mesh,
        [
            np.ones(len(own), dtype=bool) if block.type.startswith(rim) else own
            for block, own in zip(mesh.cells, inside, strict=True)
        ],
    )


def bodies_of(mesh: Mesh) -> dict[str, int]:
    """Return the numbers of the physical surfaces, in space of the physical volumes, by name."""
    dim = 2 + is_surface(mesh)
    return {str(name): int(tag) for name, (tag, own) in mesh.field_data.items() if own == dim}


def _kept(mesh: Mesh, kept: list[Mask]) -> Mesh:
    """Return the mesh of some cells, with their tags."""
    import meshio

    blocks = [
        (block.type, block.data[own], np.asarray(tag)[own])
        for block, own, tag in zip(mesh.cells, kept, mesh.cell_data["gmsh:physical"], strict=True)
        if own.any()
    ]
    return meshio.Mesh(
        mesh.points,
        [(kind, cells) for kind, cells, _ in blocks],
        cell_data={"gmsh:physical": [tag for _, _, tag in blocks]},
        field_data=mesh.field_data,
    )
