"""All increments in one file for ParaView: VTKHDF, which is HDF5 (VTK File Formats, "VTKHDF",
version 2.2).

One unstructured grid whose geometry is stored once: the boundaries of all bodies and the cells
inside of them, with fields by increment. Values that a place does not have, tractions inside and
stress of superelements, are NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path

import h5py
import numpy as np

from ...arrays import Array
from ...fields.stress_state import Field
from ...runtime.atomic_write import temporary_name
from ...untyped import Group, Mesh
from ..data import SolutionData
from ..records import StepResult
from .boundary import boundary_cells
from .inner_fields import fields_of_bodies, filled_bodies, grid_inside, inside_cells

CELL_TYPES = {"line": 3, "triangle": 5, "quad": 9, "hexahedron": 12, "triangle6": 22, "quad9": 28}
"""VTK's numbers."""


def write_vtkhdf(
    path: str | Path,
    solution: SolutionData,
    resolution: tuple[int, ...] | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write the boundary and the inside of every body after every increment as one .vtkhdf file
    (ParaView 5.12 on).

    Point data: displacement, stress (xx, yy, zz, xy, yz, xz), von_mises, and traction, which is NaN
    inside. Cell data: `body` and `part` by number, `contact` (0 stick, 1 slip, 2 open; -1
    elsewhere), `traction_error`, the estimated error of the traction, NaN inside. Panels are cells
    as of `write_boundary_vtu`. The time of an increment is the number of its step less 1 plus its
    load factor.

    Parameters
    ----------
    path : str or Path
    solution : Solution
    resolution : numbers of grid cells along the axes, optional
    progress : callable, optional
        Called with the share of the fields that is there.

    Raises
    ------
    InputError
        If the resolution does not fit.
    OutputError
        If the file cannot be written.
    """
    grids = {
        name: grid_inside(solution.meshes[name], resolution) for name in filled_bodies(solution)
    }
    steps = solution.steps or solution.tried
    inside = fields_of_bodies(solution, grids, steps, progress)
    with temporary_name(path) as temporary, h5py.File(temporary, "w") as file:
        root = file.create_group("VTKHDF")
        root.attrs["Version"] = (2, 2)
        root.attrs.create(
            "Type", b"UnstructuredGrid", dtype=h5py.string_dtype("ascii", len("UnstructuredGrid"))
        )
        for k, step in enumerate(steps):
            geometry, data = _increment(solution, step, inside)
            if k == 0:
                _write_geometry(root, geometry)
                _write_steps(root, [solution.time(step) for step in steps], data)
            for group, fields in data.items():
                for key, values in fields.items():
                    root[group][key][k * len(values) : (k + 1) * len(values)] = values


Fields = dict[str, Array]


def _increment(
    solution: SolutionData, step: StepResult, inside: Mapping[str, Iterator[Field]]
) -> tuple[list[Mesh], dict[str, Fields]]:
    """Points with cells by kind of all pieces, and PointData and CellData after an increment."""
    meshes = []
    for number, name in enumerate(solution.meshes):
        pieces = [boundary_cells(solution, name, step)]
        if name in inside:
            pieces.append(inside_cells(next(inside[name])))
        # -1: cells inside belong to no part and have no state of contact
        missing = {"body": number, "part": -1, "contact": -1, "traction_error": np.nan}
        for mesh in pieces:
            for key, value in missing.items():
                mesh.cell_data.setdefault(key, [np.full(len(block), value) for block in mesh.cells])
        meshes += pieces
    kinds = {"displacement": 3, "traction": 3, "stress": 6, "von_mises": 1}
    points = {
        key: np.concatenate(
            [
                np.reshape(
                    mesh.point_data.get(key, np.full((len(mesh.points), width), np.nan)),
                    (len(mesh.points), width),
                )
                for mesh in meshes
            ]
        ).squeeze()
        for key, width in kinds.items()
    }
    cells = {
        key: np.concatenate([np.concatenate(mesh.cell_data[key]) for mesh in meshes])
        for key in ("body", "part", "contact", "traction_error")
    }
    return meshes, {"PointData": points, "CellData": cells}


def _write_geometry(root: Group, meshes: list[Mesh]) -> None:
    """Points and cells of all pieces, one after another."""
    first = np.cumsum([0, *(len(mesh.points) for mesh in meshes)])
    blocks = [
        (CELL_TYPES[block.type], block.data + start)
        for mesh, start in zip(meshes, first, strict=False)
        for block in mesh.cells
    ]
    sizes = np.concatenate([np.full(len(data), data.shape[1]) for _, data in blocks])
    connectivity = np.concatenate([data.ravel() for _, data in blocks])
    root["Points"] = np.concatenate([np.asarray(mesh.points, dtype=float) for mesh in meshes])
    root["Connectivity"] = connectivity.astype(np.int64)
    root["Offsets"] = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    root["Types"] = np.concatenate(
        [np.full(len(data), kind, dtype=np.uint8) for kind, data in blocks]
    )
    for key, count in (
        ("NumberOfPoints", first[-1]),
        ("NumberOfCells", len(sizes)),
        ("NumberOfConnectivityIds", len(connectivity)),
    ):
        root[key] = np.array([count], dtype=np.int64)


def _write_steps(root: Group, times: list[float], data: dict[str, Fields]) -> None:
    """When the increments are, and where their fields begin; the geometry is that of all."""
    count = len(times)
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = count
    steps["Values"] = np.array(times)
    still = np.zeros(count, dtype=np.int64)
    steps["PartOffsets"] = still
    steps["PointOffsets"] = still
    steps["NumberOfParts"] = np.ones(count, dtype=np.int64)
    steps["CellOffsets"] = steps["ConnectivityIdOffsets"] = np.zeros((count, 1), dtype=np.int64)
    for group, fields in data.items():
        for key, values in fields.items():
            shape = (count * len(values), *values.shape[1:])
            root.create_dataset(
                f"{group}/{key}", shape, values.dtype, compression="gzip", shuffle=True
            )
            steps[f"{group}Offsets/{key}"] = len(values) * np.arange(count, dtype=np.int64)
