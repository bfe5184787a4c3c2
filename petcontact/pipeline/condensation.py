"""A body condensed to its contact parts, for other codes and for petcontact itself."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array, Index, scattered
from ..bem.boundary_data import BoundaryData
from ..compliance.interface import Interface
from ..errors import InputError, in_body, the_body
from ..given.body_data import Body
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.ring_mesh import RingMesh
from ..record import record
from ..results.data import SolutionData
from ..runtime.atomic_write import temporary_name, write_text
from ..runtime.hints import demand_name
from ..runtime.petsc import options
from ..runtime.world import world
from ..untyped import Comm, Keyed
from .eliminate import eliminated_alone
from .pose.discretise import Discrete, with_volume_loads
from .pose.load_states import boundary_data
from .pose.nodal_laws import with_law

FORMATS = (".npz", ".inp")


@record
class CondensedBody:
    """u = u_0 + S t + R α and RᵀW t + F = 0 at the n nodes of a body's contact parts; component c
    of node i is d i + c.

    Attributes
    ----------
    name : str
        Of the body.
    x, weight : (n, d), (n,) arrays
        Nodes [length] and quadrature weights [length, in space area].
    arrays : dict
        What `read_superelement` reads (`geometry/condensed_surface.py`): `compliance` S, `u_0`,
        `modes` R, `resultant` F, and the faces.
    """

    name: str
    x: Array
    weight: Array
    arrays: Keyed

    def stiffness(self) -> Array:
        """Nodal forces (d n, d n) for displacements: the symmetric part of W S⁻¹, on what rigid
        motions leave [force/length]."""
        weight = np.repeat(self.weight, self.x.shape[1])
        motions = self.arrays["modes"].reshape(len(weight), -1)
        flexibility, r = self.arrays["compliance"] / weight, motions.shape[1]
        size = float(np.abs(flexibility).max())
        bordered = np.block([[flexibility / size, motions], [motions.T, np.zeros((r, r))]])
        whole = np.linalg.inv(bordered)[: len(weight), : len(weight)] / size
        return np.asarray(0.5 * (whole + whole.T))

    def save(self, path: str | Path) -> None:
        """Write a .npz file, which a body of shape "superelement" takes, or the stiffness as an
        Abaqus .inp file.

        Raises
        ------
        InputError
            If the suffix is neither.
        OutputError
            If the file cannot be written.
        """
        if superelement_format(path) == ".inp":
            write_text(path, self._abaqus())
            return
        with temporary_name(path) as temporary, open(temporary, "wb") as file:
            np.savez_compressed(file, **self.arrays)

    def _abaqus(self) -> str:
        """*NODE and *MATRIX INPUT (lower triangle, row node and freedom, column node and freedom,
        entry)."""
        stiffness, d = self.stiffness(), self.x.shape[1]
        lines = [
            f"** petcontact: condensed stiffness of body {self.name}, symmetric part",
            "*NODE, NSET=CONTACT",
        ]
        lines += [
            ", ".join([str(k), *(repr(float(value)) for value in point)])
            for k, point in enumerate(self.x, 1)
        ]
        lines.append("*MATRIX INPUT, NAME=PETCONTACT, TYPE=SYMMETRIC")
        for row, column in zip(*np.tril_indices(len(stiffness)), strict=True):
            entry = (row // d + 1, row % d + 1, column // d + 1, column % d + 1)
            lines.append(f"{', '.join(map(str, entry))}, {float(stiffness[row, column])!r}")
        return "\n".join([*lines, "*MATRIX ASSEMBLE, STIFFNESS=PETCONTACT", ""])


def superelement_format(path: str | Path) -> str:
    """The format that a file name's suffix says.

    Raises
    ------
    InputError
        If it is none of FORMATS.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in FORMATS:
        raise InputError(
            f"{path}: a superelement is .npz, for petcontact and numpy, or .inp, for Abaqus"
        )
    return suffix


def condensed_body(
    solution: SolutionData, name: str | None = None, comm: Comm = None
) -> CondensedBody:
    """A body of a solution on its mesh, condensed to its contact parts, whose nodes may carry
    tractions in all directions.

    Parameters
    ----------
    solution : Solution
        Of any problem; its contact, friction and load steps play no part, but the loads do.
    name : str, optional
        Of the body; may be left out where there is one.
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default.

    Raises
    ------
    InputError
        If there is no such body, or it is in no contact.
    """
    problem, bodies = solution.problem, list(solution.meshes)
    if name is None and len(bodies) > 1:
        raise InputError(f"--body: there are {', '.join(bodies)}; name the one to condense")
    name = bodies[0] if name is None else name
    demand_name("no body", name, bodies, "bodies are")
    number, mesh = bodies.index(name), solution.meshes[name]
    ends = [end for interface in problem.interfaces for end in interface.ends]
    parts = [part for part in mesh.part_names if (number, part) in ends]
    if not parts:
        raise InputError(f"{the_body(name)} is in no contact")
    faces = [_free_face(mesh, number, part) for part in parts]
    meshes = list(solution.meshes.values())
    data = [boundary_data(*body, faces) for body in zip(problem.bodies, meshes, strict=True)]
    _check_steps(problem.bodies[number], mesh, faces, data[number])
    data = with_volume_loads(problem.bodies, meshes, data, None)[0]
    laws = with_law(None, [], [], meshes)[1]
    discrete = Discrete(problem, problem.boundaries, meshes, faces, laws, data, [], np.zeros(0))
    with options(problem.petsc):
        body = eliminated_alone(discrete, number, comm if comm is not None else world())
    assert body.compliance is not None
    arrays = _faces(mesh, parts) | {
        "compliance": body.compliance,
        "u_0": body.u_0,
        "modes": body.modes[body.contact],
        "resultant": body.resultant,
    }
    return CondensedBody(name, mesh.x[body.contact], mesh.weight[body.contact], arrays)


def _check_steps(
    body: Body,
    mesh: BoundaryMesh,
    faces: list[Interface],
    first: BoundaryData,
) -> None:
    """Refuse a body of which a later step holds or frees other components than the first one."""
    for step in range(2, len(body.conditions) + 1):
        traction_known = boundary_data(body, mesh, faces, step).traction_known
        if not np.array_equal(traction_known, first.traction_known):
            raise InputError(
                f"{in_body(body.name)}step {step} holds what is free before, or "
                "the other way round; a superelement has one compliance: condense the problem of "
                "one of the steps"
            )


def _free_face(mesh: BoundaryMesh, body: int, part: str) -> Interface:
    """A part of a body that may carry tractions in all directions."""
    nodes = mesh.nodes_of(part)
    normal = mesh.smooth_normal[nodes]
    directions = mesh.slip_directions(normal)
    return Interface(part, body, nodes, normal, directions, np.zeros(len(nodes)))


def _faces(mesh: BoundaryMesh, parts: list[str]) -> Keyed:
    """The elements of some parts, as a superelement's file has them."""
    chosen = np.flatnonzero(np.isin(mesh.part, [mesh.part_names.index(part) for part in parts]))
    corners, more = _corners(mesh, chosen)
    real = ~np.isnan(corners[..., 0])
    points, numbers = np.unique(corners[real], axis=0, return_inverse=True)
    elements = scattered(numbers.ravel(), real.ravel(), real.size, -1).reshape(real.shape)
    names = np.array(mesh.part_names)[mesh.part[chosen]].tolist()
    return {
        "points": points,
        "elements": elements[:, : mesh.corners.shape[1]],
        "order": mesh.order[chosen],
        "part": np.array([parts.index(name) for name in names]),
        "part_names": np.array(parts),
        **({"middles": elements[:, 4:]} if elements.shape[1] > 4 else {}),
        **more,
    }


@functools.singledispatch
def _corners(mesh: Any, chosen: Index) -> tuple[Array, Keyed]:
    """Corners of elements, and middles of sides, and what else describes elements of a curve."""
    return np.concatenate([mesh.corners[chosen], mesh.middles[chosen]], axis=1), {}


@_corners.register
def _(mesh: CurveMesh, chosen: Index) -> tuple[Array, Keyed]:
    more = {key: getattr(mesh, key)[chosen] for key in ("curvature", "line", "side_start")}
    more["unit_length"] = np.array(mesh.unit_length)
    more["axial"] = np.array(int(isinstance(mesh, RingMesh)))
    return mesh.corners[chosen], more
