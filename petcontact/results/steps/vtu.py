"""Load steps for ParaView: fields inside and on the boundary of every body, an increment a time, tied by a .pvd file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from ...arrays import Array, Index, States
from ...bem.kelvin2d import point_force
from ...fields.interior import Field, field_at, normal_stress_out_of_plane
from ...fields.interior_grid import triangulate
from ...mesh.curve_mesh import CurveMesh
from ...model.units import Units
from ...runtime.atomic_write import temporary_name
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

    mesh: CurveMesh
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


def body_field(solution: AssemblySolution, step: StepResult, name: str, grid: tuple[Array, Index]) -> Field:
    """Displacement and stress inside a body after an increment, on points and triangles from `triangulate`."""
    number = [body.name for body in solution.assembly.body].index(name)
    mesh, body, material = solution.meshes[name], step.bodies[name], solution.assembly.body[number].material
    points, cells = grid
    u, stress = field_at(mesh, body.u, body.traction, material, points)
    forces = solution.assembly.point_forces(number, step.step, step.load_factor)
    if forces:
        at, force = np.array([f.at for f in forces]), np.array([f.force for f in forces])
        u = u + point_force.displacement(points, at, force, material, mesh.unit_length)
        stress = stress + point_force.stress(points, at, force, material)
    return Field(points, cells, u, stress, normal_stress_out_of_plane(stress, material))


def write_collection(path: str | Path, solution: AssemblySolution, resolution: tuple[int, int]) -> list[Path]:
    """Write STEM.pvd and the .vtu files that it names: of each increment and body the field (but of an infinite plate) and
    the boundary.

    Returns
    -------
    list of Path
        What was written, the .pvd last.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    path = Path(path).with_suffix(".pvd")
    infinite = {body.name for body in solution.assembly.body if getattr(body.geometry, "exterior", False)}
    grids = {name: triangulate(mesh, resolution) for name, mesh in solution.meshes.items() if name not in infinite}
    written, rows = list[Path](), list[str]()
    for k, step in enumerate(solution.steps, 1):
        for part, name in enumerate(solution.meshes):
            plain = "".join(c if c.isalnum() or c in "-_" else "-" for c in name)
            files = [path.with_name(f"{path.stem}-{k:03d}-{plain}-boundary.vtu")]
            write_boundary_vtu(files[0], BodyBoundary.of(solution, step, name))
            if name in grids:
                files.append(path.with_name(f"{path.stem}-{k:03d}-{plain}.vtu"))
                write_vtu(files[1], body_field(solution, step, name, grids[name]), solution.assembly.units)
            written += files
            rows += [f'    <DataSet timestep="{step.step - 1 + step.load_factor:.12g}" part="{2 * part + i}" '
                     f"file={quoteattr(file.name)}/>" for i, file in enumerate(files)]  # fmt: skip
    text = "\n".join(['<VTKFile type="Collection" version="0.1">', "  <Collection>", *rows, "  </Collection>", "</VTKFile>"])
    with temporary_name(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return [*written, path]
