"""Surfaces that Gmsh meshes with curved triangles of the second order; its Python package is an
extra (`[cad]`)."""

from __future__ import annotations

import contextlib
import importlib.util
from pathlib import Path

import meshio
import numpy as np


def has_gmsh():
    """Whether there is Gmsh's Python package."""
    return importlib.util.find_spec("gmsh") is not None


def meshed(file: Path, build, name, size):
    """The path of a `.msh` file of one solid.

    `build` makes it with `gmsh.model.occ`; `name` is the part of a face by its lowest and highest
    z; `size` of triangles is a number or an expression in x, y and z.
    """
    import gmsh

    gmsh.initialize(readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    build(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    parts: dict[str, list[int]] = {}
    for _, tag in gmsh.model.getEntities(2):
        _, _, low, _, _, high = gmsh.model.getBoundingBox(2, tag)
        parts.setdefault(name(low, high), []).append(tag)
    for part, tags in parts.items():
        gmsh.model.addPhysicalGroup(2, tags, name=part)
    if isinstance(size, str):
        field = gmsh.model.mesh.field.add("MathEval")
        gmsh.model.mesh.field.setString(field, "F", size)
        gmsh.model.mesh.field.setAsBackgroundMesh(field)
        for source in ("FromPoints", "ExtendFromBoundary", "FromCurvature"):
            gmsh.option.setNumber(f"Mesh.MeshSize{source}", 0)
    else:
        for bound in ("Min", "Max"):
            gmsh.option.setNumber(f"Mesh.MeshSize{bound}", size)
    gmsh.option.setNumber(
        "Mesh.Algorithm", 6
    )  # of the same points the same triangles, whatever the number of threads
    gmsh.model.mesh.generate(2)
    gmsh.model.mesh.setOrder(2)
    gmsh.write(str(file))
    gmsh.finalize()
    return str(file)


def graded(size, within, most):
    """`size` as far as `within` from the origin, then larger in proportion to the distance, up to
    `most`."""
    return f"min({most}, {size} + 0.8*max(0, sqrt(x*x + y*y + z*z) - {within}))"


def half_ball(file: Path, radius, sign, size):
    """On the plane z = 0 at the origin (sign 1), or below it (-1): parts contact (round) and held
    (flat)."""
    turn = (-0.5, 0.0) if sign > 0 else (0.0, 0.5)

    def build(occ):
        occ.addSphere(
            0.0,
            0.0,
            sign * radius,
            radius,
            angle1=turn[0] * 3.141592653589793,
            angle2=turn[1] * 3.141592653589793,
        )

    return meshed(
        file, build, lambda low, high: "held" if high - low < 1e-3 * radius else "contact", size
    )


def block_below(file: Path, half, size):
    """Of twice `half`, and half as high, under z = 0: parts contact (its top), held (its bottom)
    and side."""

    def build(occ):
        occ.addBox(-half, -half, -half, 2.0 * half, 2.0 * half, half)

    def name(low, high):
        return "side" if high - low > 1e-3 * half else "contact" if high > -0.5 * half else "held"

    return meshed(file, build, name, size)


def in_four(file):
    """The path of the same surfaces with each curved triangle cut into four flat ones between its
    points."""
    with contextlib.redirect_stdout(None):
        mesh = meshio.read(file)
    cells, tags = [], []
    for block, tag in zip(mesh.cells, mesh.cell_data["gmsh:physical"], strict=True):
        if block.type == "triangle6":
            cells.append(block.data[:, [[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]].reshape(-1, 3))
            tags.append(np.repeat(tag, 4))
    used, corners = np.unique(np.concatenate(cells), return_inverse=True)
    tags = [np.concatenate(tags)]
    flat = meshio.Mesh(
        mesh.points[used],
        [("triangle", corners.reshape(-1, 3))],
        field_data=mesh.field_data,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    )
    name = str(Path(file).with_suffix("")) + "_flat.msh"
    meshio.write(name, flat, file_format="gmsh22", binary=False)
    return name
