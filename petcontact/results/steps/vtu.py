"""Load steps for ParaView: fields inside and on the boundary of every body, an increment a time, tied by a .pvd file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ...arrays import Array, Index, States
from ...errors import InputError
from ...fields.interior import Field, normal_stress_out_of_plane
from ...fields.interior_grid import triangulate
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.curve_mesh import CurveMesh
from ...mesh.surface_mesh import SurfaceMesh
from ...model.assembly import Body
from ...model.units import Units
from ...runtime.atomic_write import temporary_name
from ..surface_vtu import cells_inside, write_cells, write_surface_vtu
from ..vtu import write_boundary_vtu, write_vtu
from .solution import AssemblySolution, StepResult


@dataclass(frozen=True)
class _Contact:
    nodes: Index
    state: States
    friction_bound: Array


@dataclass(frozen=True)
class _Units:
    units: Units


@dataclass(frozen=True)
class BodyBoundary:
    """One body after an increment, as `write_boundary_vtu` takes it."""

    mesh: BoundaryMesh
    u: Array
    traction: Array
    contact: _Contact
    case: _Units

    @staticmethod
    def of(solution: AssemblySolution, step: StepResult, name: str) -> BodyBoundary:
        """Of a body by its name; the states are those of the interfaces whose secondary it is."""
        mine = [pair for pair, (body, _) in solution.sides.items() if body == name]
        nodes = np.concatenate([np.empty(0, dtype=np.int64), *(solution.nodes[pair] for pair in mine)])
        state = np.concatenate([np.empty(0, dtype=np.int8), *(step.pairs[pair].state for pair in mine)])
        bound = np.concatenate([np.empty(0), *(step.pairs[pair].bound for pair in mine)])
        contact = _Contact(nodes, state, np.where(np.isfinite(bound), bound, np.finfo(np.float64).max))
        body = step.bodies[name]
        return BodyBoundary(solution.meshes[name], body.u, body.traction, contact, _Units(solution.assembly.units))


@dataclass(frozen=True)
class _Kind:
    """How bodies with meshes of one kind are written: points and cells inside for a resolution, boundary, values inside."""

    resolution: tuple[int, ...]
    grid: Callable[..., tuple[Array, Index]]
    boundary: Callable[..., None]
    inside: Callable[..., object]


def _write_plane(path: Path, grid: tuple[Array, Index], values: tuple[Array, Array], body: Body, units: Units) -> None:
    write_vtu(path, Field(*grid, *values, normal_stress_out_of_plane(values[1], body.material)), units)


def _write_space(path: Path, grid: tuple[Array, Index], values: tuple[Array, Array], body: Body, units: Units) -> None:
    write_cells(path, *grid, *values)


KINDS = {
    CurveMesh: _Kind((100, 100), triangulate, write_boundary_vtu, _write_plane),
    SurfaceMesh: _Kind((16, 16, 16), cells_inside, write_surface_vtu, _write_space),
}  # fmt: skip


def kind_of(mesh: BoundaryMesh, resolution: tuple[int, ...] | None) -> _Kind:
    """How bodies with such a mesh are written, with their usual resolution or the one that is asked for.

    Raises
    ------
    InputError
        If the resolution has not as many numbers as the body has dimensions.
    """
    kind = KINDS[type(mesh)]
    if resolution is None:
        return kind
    if len(resolution) != mesh.dim:
        raise InputError(f"--grid {'x'.join(map(str, resolution))}: the body has {mesh.dim} dimensions")
    return replace(kind, resolution=resolution)


def write_collection(
    path: str | Path, solution: AssemblySolution, resolution: tuple[int, ...] | None = None
) -> list[Path]:
    """Write STEM.pvd and the .vtu files that it names: of each increment and body the field (but of an infinite plate) and
    the boundary.

    Returns
    -------
    list of Path
        What was written, the .pvd last.

    Raises
    ------
    InputError
        If the resolution does not fit.
    OutputError
        If a file cannot be written.
    """
    path = Path(path).with_suffix(".pvd")
    kinds = {name: kind_of(mesh, resolution) for name, mesh in solution.meshes.items()}
    infinite = {body.name for body in solution.assembly.body if getattr(body.geometry, "exterior", False)}
    grids = {name: kinds[name].grid(mesh, kinds[name].resolution)
             for name, mesh in solution.meshes.items() if name not in infinite}  # fmt: skip
    written, rows = list[Path](), list[str]()
    for k, step in enumerate(solution.steps, 1):
        for part, name in enumerate(solution.meshes):
            plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
            files = [path.with_name(f"{path.stem}-{k:03d}-{plain}-boundary.vtu")]
            kinds[name].boundary(files[0], BodyBoundary.of(solution, step, name))
            if name in grids:
                files.append(path.with_name(f"{path.stem}-{k:03d}-{plain}.vtu"))
                values = solution.fields_at(grids[name][0], name, step)
                kinds[name].inside(files[1], grids[name], values, solution.assembly.body[part], solution.assembly.units)
            written += files
            rows += [f'    <DataSet timestep="{step.step - 1 + step.load_factor:.12g}" part="{2 * part + i}" '
                     f"file={quoteattr(file.name)}/>" for i, file in enumerate(files)]  # fmt: skip
    text = "\n".join(['<VTKFile type="Collection" version="0.1">', "  <Collection>", *rows, "  </Collection>", "</VTKFile>"])
    with temporary_name(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return [*written, path]
