"""From a problem to its discrete contact problem: meshes that match, data in every load state,
laws."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import BoundaryData
from ...bem.compatibility import check_compatible
from ...bem.particular.volume import VolumeSolution, volume_solution
from ...compliance.interface import Interface, slices
from ...contact.law_protocol import ContactLaw
from ...contact.laws import Tresca
from ...errors import InputError
from ...geometry.surface import Boundary
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.contact_search import Facing
from ...mesh.pairs.matching import PairParts, matched
from ...model.interfaces import PosedInterface
from ...model.loads import loads_by_step
from ...model.problem import Problem
from ...refinement.meshes import mesh_of
from ...results.report import Finding
from ..choice import contact_sizes, needed_memory, resolved_bem, suitable_bem
from ..judge.findings import new_finding, refuse
from ..judge.meshes import check_meshes, check_stiffness, too_long_to_bend
from .facing import contact_interface, facing_of, mismatch, periodic_interface
from .interfaces import as_problem, check_parts
from .laws import law_between, wear_between, with_law
from .load_states import body_motions, boundary_data, check_held

POSED = ("body", "contact", "obstacle", "step")
"""Fields of a problem that its discrete one follows from; the others are those of the method."""
MeshMaker = Callable[[int, Callable[[], Problem], Any], BoundaryMesh]
"""The mesh of a body by its number, a function that poses the body as a problem of its own, and its
boundary; primaries are matched afterwards."""


@dataclass
class Discrete:
    """A problem on meshes.

    Attributes
    ----------
    problem : Problem
    boundaries : list of Outline or surfaces
    meshes : list of BoundaryMesh
    interfaces : list of Interface
        Those of the problem, in their order, on the meshes.
        Held normally, all of them, where none may open and no friction depends on pressure: then
        u_n is known.
    law : ContactLaw
    data : list of BoundaryData, one a body
        State 0 is the unloaded one, state k the end of step k.
    distance : list of float
        The smallest distance or gap of each interface, infinite where nothing is faced [length].
    wear : (M,) array
        Coefficient of Archard's law at the nodes of all interfaces [1/stress].
    findings, of_meshes : lists of Finding
        What is found of interfaces and data, and of the meshes.
    facings : list of Facing
        Of each side what it faces; None where that is no body.
    volumes : list of VolumeSolution
        Of each body; None where nothing loads its volume.
    adapted : bool
        Whether the meshes are not those of the problem's options: what a user could choose better
        is not advised then.
    """

    problem: Problem
    boundaries: list[Boundary]
    meshes: list[BoundaryMesh]
    interfaces: list[Interface]
    law: ContactLaw
    data: list[BoundaryData]
    distance: list[float]
    wear: Array
    findings: list[Finding] = field(default_factory=list)
    of_meshes: list[Finding] = field(default_factory=list)
    facings: list[Facing | None] = field(default_factory=list)
    volumes: list[VolumeSolution | None] = field(default_factory=list)
    adapted: bool = False

    @property
    def sides(self) -> tuple[PosedInterface, ...]:
        """The interfaces as they are posed."""
        return self.problem.interfaces

    @functools.cached_property
    def motions(self) -> list[Array]:
        """The rigid motions (n, d, r) of each body that no condition holds."""
        return list(map(body_motions, self.boundaries, self.data, self.meshes))

    @functools.cached_property
    def sizes(self) -> list[float]:
        """Largest extent of each body along an axis [length]."""
        return [float(np.ptp(mesh.x, axis=0).max()) for mesh in self.meshes]

    @property
    def holds_normals(self) -> bool:
        """Whether all normal displacements of contact are data of the bodies."""
        return all(face.held for face in self.interfaces)


def discretise(
    problem: Problem,
    make_mesh: MeshMaker | None = None,
    law: Any = None,
    like: Discrete | None = None,
) -> Discrete:
    """Meshes, data and laws of a problem; the bodies' own meshes are what their options ask for, or
    `make_mesh`.

    Parameters
    ----------
    problem : Problem
    make_mesh : MeshMaker, optional
    law : optional
        As in `solve`.
    like : Discrete, optional
        Of a problem that differs in friction, gaps, loads, motions or the method only: its meshes
        are taken, what their sides face, and the data that are the same.

    Raises
    ------
    InputError
        If a part does not exist or has two conditions, data are not finite, a coefficient or bound
        is negative, or the operators do not fit the machine.
    """
    if like is not None and all(
        getattr(problem, key) == getattr(like.problem, key) for key in POSED
    ):
        return replace(like, problem=problem)
    boundaries, meshes = meshed(problem, make_mesh, like)
    bem = suitable_bem(problem, meshes)
    problem = problem if bem is problem.bem else problem.model_copy(update={"bem": bem})
    if like is None:
        _check_size(problem, meshes)
    refuse(check_stiffness(problem))
    if not problem.interfaces:
        _check_obstacles(problem)
    facings = (
        [facing_of(interface, meshes) for interface in problem.interfaces]
        if like is None
        else like.facings
    )
    interfaces, distance, findings = _on_meshes(problem, meshes, facings)
    interfaces, law, data = _law_and_data(problem, boundaries, meshes, interfaces, law)
    data, volumes = _with_volume_loads(problem, meshes, data, like)
    notes = [note for volume in volumes if volume is not None for note in volume.notes]
    findings += [new_finding("volume loads", note) for note in notes]
    if like is None:
        of_meshes = check_meshes(problem, meshes, boundaries, make_mesh is not None)
        refuse(of_meshes)
        if make_mesh is None:
            for interface, facing in zip(problem.interfaces, facings, strict=True):
                of_meshes += mismatch(interface, facing)
    return Discrete(
        problem,
        boundaries,
        meshes,
        interfaces,
        law,
        data,
        distance,
        wear_between(problem.interfaces, interfaces, meshes),
        findings,
        of_meshes if like is None else like.of_meshes,
        facings,
        volumes,
        make_mesh is not None,
    )


def _check_obstacles(problem: Problem) -> None:
    """Refuse obstacles where no part is in contact.

    Raises
    ------
    InputError
    """
    for obstacle in problem.obstacle:
        raise InputError(
            f"obstacle {obstacle.name!r}: no part is in contact; a [[contact]] says what it touches"
        )


def _on_meshes(
    problem: Problem, meshes: list[BoundaryMesh], facings: Sequence[Facing | None]
) -> tuple[list[Interface], list[float], list[Finding]]:
    """The interfaces on meshes, the smallest distance or gap of each [length], and what is found
    of them."""
    interfaces, distance, findings = list[Interface](), list[float](), list[Finding]()
    for posed, facing in zip(problem.interfaces, facings, strict=True):
        if posed.periodic:
            made = periodic_interface(problem, posed, meshes[posed.body]), 0.0, list[Finding]()
        else:
            made = contact_interface(posed, meshes, facing, problem.holds_normals)
        interfaces.append(made[0])
        distance.append(made[1])
        findings += made[2]
    return interfaces, distance, findings


def _law_and_data(
    problem: Problem,
    boundaries: list[Boundary],
    meshes: list[BoundaryMesh],
    interfaces: list[Interface],
    given: Any,
) -> tuple[list[Interface], ContactLaw, list[BoundaryData]]:
    """The law, the data of all bodies, and the interfaces with the directions that both need.

    Raises
    ------
    InputError
        If a body can move freely.
    """
    interfaces, law = with_law(given, problem.interfaces, interfaces, meshes)
    data = [boundary_data(problem, b, mesh, interfaces) for b, mesh in enumerate(meshes)]
    if given is not None or not isinstance(law, Tresca):
        return interfaces, law, data
    motions = list(map(body_motions, boundaries, data, meshes))
    if not any(free.shape[2] for free in motions):
        return interfaces, law, data
    _check_friction_holds(interfaces, meshes, data, motions, law.bound)
    # equilibrium of what only contact holds is exact where all its tractions are looked for
    interfaces = [replace(interface, held=False) for interface in interfaces]
    law = law_between(problem.interfaces, interfaces, meshes)
    data = [boundary_data(problem, b, mesh, interfaces) for b, mesh in enumerate(meshes)]
    return interfaces, law, data


def _check_size(problem: Problem, meshes: list[BoundaryMesh]) -> None:
    """Refuse what does not fit the machine before what faces what is looked for, which of many
    panels takes long."""
    directions = meshes[0].components - problem.holds_normals
    needed_memory(resolved_bem(problem.bem), meshes, *contact_sizes(problem, meshes), directions)


def meshed(
    problem: Problem, make_mesh: MeshMaker | None, like: Discrete | None = None
) -> tuple[list[Boundary], list[BoundaryMesh]]:
    """Boundaries and meshes of the bodies, which match where parts face one another."""
    boundaries = list(like.boundaries) if like else problem.boundaries
    check_parts(problem, boundaries)
    posed = [
        functools.partial(as_problem, problem, b, boundary) for b, boundary in enumerate(boundaries)
    ]
    if like is not None:
        for one, boundary in zip(posed, boundaries, strict=True):
            check_compatible(boundary, one())
        return boundaries, like.meshes
    own = [
        mesh_of(one(), boundaries[b]) if make_mesh is None else make_mesh(b, one, boundaries[b])
        for b, one in enumerate(posed)
    ]
    pairs = [
        PairParts((i.body, i.part), i.primary, i.direction, i.periodic)
        for i in problem.interfaces
        if i.primary is not None
    ]
    return boundaries, matched(boundaries, own, pairs, too_long_to_bend) if pairs else own


def add_volume_loads(
    problem: Problem, meshes: list[BoundaryMesh], data: list[BoundaryData]
) -> list[BoundaryData]:
    """The data with particular solutions for volume loads."""
    return _with_volume_loads(problem, meshes, data, None)[0]


def _with_volume_loads(
    problem: Problem, meshes: list[BoundaryMesh], data: list[BoundaryData], like: Discrete | None
) -> tuple[list[BoundaryData], list[VolumeSolution | None]]:
    """Data with the particular solutions of volume loads, and these; of loads that are those of
    `like` the same ones."""
    found, volumes = [], []
    for b, (mesh, known) in enumerate(zip(meshes, data, strict=True)):
        if like is not None and _loads_volume_alike(problem, like.problem, b):
            volume, at_nodes = like.volumes[b], like.data[b].volume
        else:
            volume = volume_solution(problem, b, mesh)
            at_nodes = None if volume is None else volume.on(mesh)
        volumes.append(volume)
        posed = known if at_nodes is None else replace(known, volume=at_nodes)
        found.append(like.data[b] if like is not None and posed.equals(like.data[b]) else posed)
    return found, volumes


def _loads_volume_alike(problem: Problem, other: Problem, number: int) -> bool:
    """Whether a body has the same material and volume loads in both."""
    same = problem.body[number].material == other.body[number].material
    return same and loads_by_step(problem, number) == loads_by_step(other, number)


def _check_friction_holds(
    interfaces: list[Interface],
    meshes: list[BoundaryMesh],
    data: list[BoundaryData],
    motions: list[Array],
    bound: Array,
) -> None:
    """Refuse bodies that not even friction holds, whose contacts hold the normal displacement.

    Raises
    ------
    InputError
    """
    places = slices(interfaces)
    for b, (mesh, known, free) in enumerate(zip(meshes, data, motions, strict=True)):
        mine = [bound[places[face.name]] for face in interfaces if face.body == b]
        if free.shape[2]:
            check_held(known, mesh, np.concatenate([*mine, np.zeros(0)]))
