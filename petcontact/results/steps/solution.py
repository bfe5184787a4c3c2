"""The outcome of load steps: what every increment left on interfaces, bodies and obstacles."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ...arrays import Array, Index, States
from ...bem.kernels import kernel_for
from ...contact.state import History
from ...errors import InputError
from ...fields.interior import field_at
from ...geometry.rotation import Axial
from ...mesh.boundary_mesh import BoundaryMesh
from ...model.assembly import Assembly
from ...model.base import nearest


@dataclass(frozen=True)
class PairResult:
    """Nodal fields of one interface after an increment; the secondary's nodes.

    Attributes
    ----------
    x, normal : (m, d) arrays
        Nodes [length], and n, from the secondary to the primary.
    tangent : (m, d-1, d) array
        τ: in the plane n turned by +90°.
    weight : (m,) array
        Quadrature weights [length, in space area].
    arc_length : (m,) array
        Along the secondary's part, 0 in space [length].
    pressure : (m,) array
        p = -σ_n [stress].
    sigma_t : (m, d-1) array
        Shear traction on the secondary along τ [stress].
    bound : (m,) array
        Of |σ_t|: µp, g, the smaller, 0, or infinite where bonded [stress].
    gap : (m,) array
        What is left of the gap, infinite where nothing is faced [length].
    slip, slip_increment : (m, d-1) arrays
        w, relative tangential displacement, and what this increment added [length].
    state : (m,) array
        0 stick, 1 slip, 2 open.
    force : (d,) array
        On the secondary [force/length, in space force].
    moment : float, in space (3,) array
        Of it about the origin [force, in space force · length].
    dissipated : float
        Energy that friction took in this increment, by the trapezoidal rule [force, in space force · length].
    dissipated_error : float
        A bound of its error: what pressures that grow, and slip, on ways of their own could change; nan in older files.
    """

    x: Array
    normal: Array
    tangent: Array
    weight: Array
    arc_length: Array
    pressure: Array
    sigma_t: Array
    bound: Array
    gap: Array
    slip: Array
    slip_increment: Array
    state: States
    force: Array
    moment: Axial
    dissipated: float
    dissipated_error: float = np.nan

    @property
    def area(self) -> float:
        """Length, in space area, of the closed part of the interface [length]."""
        return float(self.weight[self.state != 2].sum())

    @property
    def tension_share(self) -> float:
        """Share of the interface that is in tension by more than methods leave at the default tolerance [-]."""
        level = 1e-6 * float(np.abs(self.pressure).max(initial=0.0))
        return float(self.weight[self.pressure < -level].sum() / self.weight.sum())


@dataclass(frozen=True)
class BodyResult:
    """Displacement [length] and traction [stress] (n, d) on the boundary of one body."""

    u: Array
    traction: Array


@dataclass(frozen=True)
class ObstacleResult:
    """Where an obstacle is, and the force and moment about its centre that act on it from outside.

    Displacement and force are (d,), rotation and moment numbers, in space (3,).
    """

    displacement: Array
    rotation: Axial
    force: Array
    moment: Axial


@dataclass(frozen=True)
class StepResult:
    """One increment.

    Attributes
    ----------
    name : str
        Of the step.
    step : int
        Its number, from 1.
    load_factor : float
        How much of the step's change is reached, in (0, 1].
    status : {"converged", "not converged"}
    reason : str
    iterations : int
        Of the method.
    residuals : dict
        normal, tangential, balance, elastic [-].
    pairs, bodies, obstacles : dicts by name
    alpha : (r,) array
        Rigid motions of the bodies.
    history : History
        A row an iteration.
    """

    name: str
    step: int
    load_factor: float
    status: str
    reason: str
    iterations: int
    residuals: dict[str, float]
    pairs: dict[str, PairResult]
    bodies: dict[str, BodyResult]
    obstacles: dict[str, ObstacleResult]
    alpha: Array
    history: History = field(default_factory=History)


@dataclass(frozen=True, repr=False)
class AssemblySolution:
    """What a solve of an assembly returns and a result file of format 2 holds.

    Attributes
    ----------
    assembly : Assembly
    meshes : dict of BoundaryMesh by body
    nodes : dict of (m,) arrays by interface
        Numbers of the secondary's nodes in its body's mesh.
    sides : dict of (body, part) by interface
        Of the secondary.
    steps : list of StepResult
        Increments that were solved, in order.
    status : {"converged", "not converged", "failed"}
    reason : str
    timings : dict of str to float
    info : dict
    failed : StepResult, optional
        The increment at which the solve ended, if it found no solution of it.
    """

    assembly: Assembly
    meshes: dict[str, BoundaryMesh]
    nodes: dict[str, Index]
    sides: dict[str, tuple[str, str]]
    steps: list[StepResult]
    status: str
    reason: str
    timings: dict[str, float]
    info: dict[str, Any] = field(default_factory=dict)
    failed: StepResult | None = None

    @property
    def converged(self) -> bool:
        """Whether every step was reached with all residuals small."""
        return self.status == "converged"

    @property
    def iterations(self) -> int:
        """Iterations of all increments, the failed one too."""
        return sum(step.iterations for step in self.tried)

    @property
    def last(self) -> StepResult:
        """The last increment that was solved; the one that failed where none was."""
        return (self.steps or self.tried)[-1]

    @property
    def tried(self) -> list[StepResult]:
        """The increments that were solved and the one that failed."""
        return self.steps if self.failed is None else [*self.steps, self.failed]

    def fields_at(self, points: Any, body: str | None = None, step: StepResult | None = None) -> tuple[Array, Array]:
        """Displacement (k, d) [length] and stress (k, 3), in space (k, 6) [stress] at points inside a body.

        Parameters
        ----------
        points : (k, d) array
            See `fields.interior.field_at`.
        body : str, optional
            Its name; the first one by default.
        step : StepResult, optional
            An increment; the last one by default.

        Raises
        ------
        InputError
            If there is no such body, or a point is not inside it.
        """
        names, step = [each.name for each in self.assembly.body], step or self.last
        if body is not None and body not in names:
            raise InputError(f"no body {body!r}{nearest(body, names) or '; bodies are ' + ', '.join(names)}")
        number = 0 if body is None else names.index(body)
        mesh, found, material = self.meshes[names[number]], step.bodies[names[number]], self.assembly.body[number].material
        points = np.asarray(points, dtype=np.float64)
        try:
            u, stress = field_at(mesh, found.u, found.traction, material, points)
        except InputError as error:
            others = f"; body=... names another: {', '.join(names)}" if body is None and len(names) > 1 else ""
            raise InputError(f"body {names[number]!r}: {error}{others}") from None
        forces = self.assembly.point_forces(number, step.step, step.load_factor)
        if forces:
            at, force = np.array([f.at for f in forces]), np.array([f.force for f in forces])
            kernel = kernel_for(mesh, material)
            u, stress = u + kernel.point_displacement(points, at, force), stress + kernel.point_stress(points, at, force)
        return u, stress

    def at(self, points: Any, body: str | None = None) -> Array:
        """Displacement at points (k, d) inside a body at the end, (k, d) [length]."""
        return self.fields_at(points, body)[0]

    def stress_at(self, points: Any, body: str | None = None) -> Array:
        """Stress there, σ_xx, σ_yy, σ_xy (k, 3); in space xx, yy, zz, xy, xz, yz, (k, 6) [stress]."""
        return self.fields_at(points, body)[1]

    def reactions(self) -> dict[str, dict[str, Array]]:
        """By body, the resultant of the tractions on each part at the end, (d,) each [stress · length, in space · area]."""
        found = dict[str, dict[str, Array]]()
        for name, mesh in self.meshes.items():
            forces = mesh.weight[:, None] * self.last.bodies[name].traction
            found[name] = {part: forces[mesh.node_part == k].sum(axis=0) for k, part in enumerate(mesh.part_names)}
        return found

    def save(self, path: str | Path) -> None:
        """Write a result file, see `write_solution`; `read_result` reads it."""
        from ..hdf5 import write_solution

        write_solution(path, self)

    def __repr__(self) -> str:
        title = f" {self.assembly.title!r}" if self.assembly.title else ""
        elements = sum(mesh.n_elements for mesh in self.meshes.values())
        return (f"<AssemblySolution{title}: {self.status}, {len(self.steps)} increments, {self.iterations} iterations, "
                f"{len(self.meshes)} bodies, {elements} elements>")  # fmt: skip

    def verdict(self) -> str:
        """Lines that say how the solve ended."""
        from .summary import verdict

        return verdict(self)
