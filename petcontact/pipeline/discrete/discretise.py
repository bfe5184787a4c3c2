"""From a problem to its discrete contact problem: meshes that match, data in every load state, laws."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import scipy

from ...arrays import Array, Mask
from ...bem.boundary_data import BoundaryData
from ...bem.particular.volume import volume_solution
from ...compliance.interface import Interface, slices
from ...contact.law_protocol import ContactLaw
from ...contact.laws import SignoriniCoulomb, Tresca
from ...contact.methods.registry import ContactNodes, law_of
from ...errors import InputError
from ...geometry.surface import Boundary
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.contact_search import face
from ...mesh.pairs.matching import PairParts, matched
from ...mesh.pairs.periodic import partner_nodes
from ...mesh.pairs.ray_casting import along
from ...model.expressions import evaluate
from ...model.problem import Problem
from ...refinement.meshes import mesh_of
from .interfaces import InterfaceSpec, as_problem, check_parts, interfaces_of
from .load_states import body_motions, boundary_data, check_held

OUTWARD = 1e-9
"""Cosine between a direction and some outward normal from which on it points outward."""

FINER = 0.9
"""Elements of the secondary smaller than this, over those of the primary, are finer ones."""
MeshMaker = Callable[[int, Callable[[], Problem], Any], BoundaryMesh]
"""The mesh of a body by its number, a function that poses the body as a problem of its own, and its boundary; primaries are
matched afterwards."""


@dataclass
class Discrete:
    """A problem on meshes.

    Attributes
    ----------
    problem : Problem
    boundaries : list of Outline or surfaces
    meshes : list of BoundaryMesh
    sides : list of InterfaceSpec
    interfaces : list of Interface
        Held normally, all of them, where none may open and no friction depends on pressure: then u_n is known.
    law : ContactLaw
    data : list of BoundaryData, one a body
        State 0 is the unloaded one, state k the end of step k.
    distance : list of float
        The smallest distance or gap of each interface, infinite where nothing is faced [length].
    wear : (M,) array
        Coefficient of Archard's law at the nodes of all interfaces [1/stress].
    warnings : list of str
    """

    problem: Problem
    boundaries: list[Boundary]
    meshes: list[BoundaryMesh]
    sides: list[InterfaceSpec]
    interfaces: list[Interface]
    law: ContactLaw
    data: list[BoundaryData]
    distance: list[float]
    wear: Array
    warnings: list[str] = field(default_factory=list)

    @property
    def holds_normals(self) -> bool:
        """Whether all normal displacements of contact are data of the bodies."""
        return all(face.held for face in self.interfaces)


def discretise(problem: Problem, make_mesh: MeshMaker | None = None, law: Any = None) -> Discrete:
    """Meshes, data and laws of a problem; the bodies' own meshes are what their options ask for, or `make_mesh`.

    Raises
    ------
    InputError
        If a part does not exist or has two conditions, data are not finite, or a coefficient or bound is negative.
    """
    sides = interfaces_of(problem)
    if not sides:
        return without_contact(problem, make_mesh)
    boundaries, meshes = meshed(problem, sides, make_mesh)
    notes: list[str] = []
    interfaces, distance = [], []
    for side in sides:
        if side.periodic:
            interfaces.append(_periodic(problem, side, meshes[side.body]))
            distance.append(0.0)
            continue
        interface, smallest, mismatch = _interface(side, meshes, all(side.holds_normal for side in sides))
        interfaces.append(interface)
        distance.append(smallest)
        notes += mismatch
    given, (interfaces, law) = law, _with_law(law, sides, interfaces, meshes)
    data = [boundary_data(problem, b, meshes[b], interfaces) for b in range(len(meshes))]
    if given is None and isinstance(law, Tresca) and _held_by_friction(interfaces, meshes, boundaries, data, law.bound):
        # equilibrium of what only contact holds is exact where all its tractions are looked for
        interfaces = [replace(face, held=False) for face in interfaces]
        law = _law(sides, interfaces, meshes)
        data = [boundary_data(problem, b, meshes[b], interfaces) for b in range(len(meshes))]
    notes += add_volume_loads(problem, meshes, data)
    return Discrete(problem, boundaries, meshes, sides, interfaces, law, data, distance,
                    _wear(sides, interfaces, meshes), notes)  # fmt: skip


def without_contact(problem: Problem, make_mesh: MeshMaker | None = None) -> Discrete:
    """The bodies of a problem, of which no part is in contact, on meshes; there is no law.

    Raises
    ------
    InputError
        As `discretise`; or if a body can move freely, or there is an obstacle.
    """
    for obstacle in problem.obstacle:
        raise InputError(f"obstacle {obstacle.name!r}: no part is in contact; a [[contact]] says what it touches")
    boundaries, meshes = meshed(problem, [], make_mesh)
    data = [boundary_data(problem, b, mesh, []) for b, mesh in enumerate(meshes)]
    for boundary, mesh, known in zip(boundaries, meshes, data, strict=True):
        if body_motions(boundary, known, mesh).shape[2]:
            check_held(known, mesh, np.zeros(0))
    notes = add_volume_loads(problem, meshes, data)
    return Discrete(problem, boundaries, meshes, [], [], Tresca(np.zeros(0), meshes[0].dim - 1), data, [],
                    np.zeros(0), notes)  # fmt: skip


def meshed(
    problem: Problem, sides: list[InterfaceSpec], make_mesh: MeshMaker | None
) -> tuple[list[Boundary], list[BoundaryMesh]]:
    """Boundaries and meshes of the bodies, which match where parts face one another."""
    boundaries: list[Boundary] = [body.geometry.outline() for body in problem.body]
    check_parts(problem, boundaries, sides)
    own = []
    for b, (body, boundary) in enumerate(zip(problem.body, boundaries, strict=True)):
        one = functools.partial(as_problem, body, boundary, sides, b)
        own.append(mesh_of(one(), boundary) if make_mesh is None else make_mesh(b, one, boundary))
    pairs = [PairParts((s.body, s.part), s.primary, s.direction, s.periodic) for s in sides if s.primary is not None]
    return boundaries, matched(boundaries, own, pairs) if pairs else own


def add_volume_loads(problem: Problem, meshes: list[BoundaryMesh], data: list[BoundaryData]) -> list[str]:
    """Put particular solutions for volume loads into the data; what is to be reported of them."""
    notes: list[str] = []
    for b, mesh in enumerate(meshes):
        if (solution := volume_solution(problem, b, mesh)) is not None:
            data[b] = replace(data[b], volume=solution.on(mesh))
            notes += solution.notes
    return notes


def _held_by_friction(
    interfaces: list[Interface], meshes: list[BoundaryMesh], boundaries: list[Boundary], data: list[BoundaryData],
    bound: Array,
) -> bool:  # fmt: skip
    """Whether friction alone keeps a body where it is, whose contacts hold the normal displacement.

    Raises
    ------
    InputError
        If not even friction does.
    """
    found, places = False, slices(interfaces)
    for b, (mesh, boundary) in enumerate(zip(meshes, boundaries, strict=True)):
        mine = [bound[places[face.name]] for face in interfaces if face.body == b]
        if body_motions(boundary, data[b], mesh).shape[2]:
            check_held(data[b], mesh, np.concatenate([*mine, np.zeros(0)]))
            found = True
    return found


def with_laws_of(discrete: Discrete, problem: Problem) -> Discrete:
    """The same meshes and data with the friction, steps and obstacles of a problem of the same bodies and pairs."""
    sides = interfaces_of(problem)
    if not sides:
        return replace(discrete, problem=problem, warnings=list(discrete.warnings))
    nodes = _contact_nodes(sides, discrete.interfaces, discrete.meshes)
    return replace(discrete, problem=problem, sides=sides, law=law_of(None, nodes), warnings=list(discrete.warnings),
                   wear=_wear(sides, discrete.interfaces, discrete.meshes))  # fmt: skip


def _interface(side: InterfaceSpec, meshes: list[BoundaryMesh], held: bool) -> tuple[Interface, float, list[str]]:
    mesh = meshes[side.body]
    nodes = mesh.nodes_of(side.part)
    notes: list[str] = []
    facing = None
    if side.direction is not None and not (mesh.normal[nodes] @ side.direction).max() > OUTWARD:
        raise InputError(f"{side.key}.direction: must point out of part {side.part!r}, from the secondary to the primary; "
                         f"{side.direction.round(6).tolist()} does not")  # fmt: skip
    if side.primary is not None:
        b, part = side.primary
        facing = face(mesh, side.part, meshes[b], part, side.direction)
        normal, present = facing.normal, facing.met
        if not present.any():
            notes.append(f"pair {side.name!r}: no node of the secondary faces the primary along its normals: "
                         "they never touch")  # fmt: skip
        elif not facing.matched:
            advice = "; the coarser side is the better secondary" if facing.sizes[0] < FINER * facing.sizes[1] else ""
            notes.append(f"pair {side.name!r}: elements of the two sides do not match: forces pass exactly, the pressure is "
                         f"about twice as far off as on elements that do{advice}")  # fmt: skip
    else:
        normal, present = along(side.direction, mesh.normal[nodes]).copy(), np.ones(len(nodes), dtype=bool)
    if side.law.gap == "geometry":
        gap = facing.distance if facing is not None and side.law.normal == "unilateral" else np.zeros(len(nodes))
    else:
        gap = evaluate(side.law.gap, mesh.variables(nodes), len(nodes), f"{side.key}.gap")
    gap = np.where(present, gap, np.inf)
    smallest = float(gap.min(initial=np.inf))
    tangent = mesh.tangents_to(normal)
    if facing is None:
        return Interface(side.name, side.body, nodes, normal, tangent, gap, obstacle=side.obstacle,
                         held=held), smallest, notes  # fmt: skip
    assert side.primary is not None
    sag = facing.sag if side.law.gap == "geometry" and side.law.normal == "unilateral" else 0.0
    return Interface(side.name, side.body, nodes, normal, tangent, gap, side.primary[0], facing.primary, facing.values,
                     facing.loads, None, facing.distance, sag), smallest, notes  # fmt: skip


def _periodic(problem: Problem, side: InterfaceSpec, mesh: BoundaryMesh) -> Interface:
    """Its sides stay together but for the jump, and carry opposite tractions: node by node, whatever lies between."""
    assert side.primary is not None
    nodes, partner = mesh.nodes_of(side.part), partner_nodes(mesh, side.part, side.primary[1])
    normal, gap, same = mesh.normal[nodes], np.zeros(len(nodes)), scipy.sparse.csr_array(scipy.sparse.identity(len(nodes)))
    jump = np.array([(0.0, 0.0), *(getattr(state[side.part], "jump", ()) for state in problem.conditions(side.body))])
    return Interface(side.name, side.body, nodes, normal, mesh.tangents_to(normal), gap, side.body, partner, same, same,
                     jump=jump)  # fmt: skip


def _with_law(
    given: Any, sides: list[InterfaceSpec], interfaces: list[Interface], meshes: list[BoundaryMesh]
) -> tuple[list[Interface], ContactLaw]:
    """The law, and interfaces that look for as many components as it has: a law of the user's may have the normal one."""
    nodes = _contact_nodes(sides, interfaces, meshes)
    wanted = getattr(given, "k", None) if hasattr(given, "project") or given is None else given(nodes).k
    if interfaces[0].held and wanted == meshes[0].dim:
        interfaces = [replace(face, held=False) for face in interfaces]
        nodes = _contact_nodes(sides, interfaces, meshes)
    return interfaces, law_of(given, nodes)


def _contact_nodes(sides: list[InterfaceSpec], interfaces: list[Interface], meshes: list[BoundaryMesh]) -> ContactNodes:
    return ContactNodes(
        np.concatenate([meshes[face.body].x[face.nodes] for face in interfaces]),
        np.concatenate([face.normal for face in interfaces]),
        np.concatenate([meshes[face.body].weight[face.nodes] for face in interfaces]),
        slices(interfaces),
        _law(sides, interfaces, meshes),
    )


def _law(sides: list[InterfaceSpec], interfaces: list[Interface], meshes: list[BoundaryMesh]) -> ContactLaw:
    parts: list[tuple[Array, Array, Mask, Mask]] = []
    for side, interface in zip(sides, interfaces, strict=True):
        m, law, absent = len(interface.nodes), side.law, ~np.isfinite(interface.gap)
        mu, bound = (_not_negative(side, interface, meshes, key) for key in ("friction_coefficient", "friction_bound"))
        if bound is None:
            bound = np.full(m, np.inf if mu is not None or law.normal == "bonded" else 0.0)
        parts.append((np.full(m, np.inf) if mu is None else mu, bound, np.full(m, law.normal == "unilateral"), absent))
    coefficient, bound, opens, absent = (np.concatenate(values) for values in zip(*parts, strict=True))
    if interfaces[0].held:
        return Tresca(bound, meshes[0].dim - 1)
    return SignoriniCoulomb(coefficient, bound, opens, meshes[0].dim, absent)


def _wear(sides: list[InterfaceSpec], interfaces: list[Interface], meshes: list[BoundaryMesh]) -> Array:
    found = [_not_negative(side, face, meshes, "wear_coefficient") for side, face in zip(sides, interfaces, strict=True)]
    return np.concatenate([np.zeros(len(face.nodes)) if values is None else values
                           for face, values in zip(interfaces, found, strict=True)])  # fmt: skip


def _not_negative(side: InterfaceSpec, interface: Interface, meshes: list[BoundaryMesh], key: str) -> Array | None:
    """Values (m,) of what the law of an interface has under a key; None where it is not given."""
    value, mesh, nodes = getattr(side.law, key), meshes[side.body], interface.nodes
    if value is None:
        return None
    values = evaluate(value, mesh.variables(nodes), len(nodes), f"{side.key}.{key}")
    if np.any(values < 0.0):
        k = int(np.argmin(values))
        place = ", ".join(f"{name} = {at:g}" for name, at in zip("xyz", mesh.x[nodes[k]], strict=False))
        raise InputError(f"{side.key}.{key}: must be >= 0, is {values[k]:g} at {place}")
    return values
