"""The discrete contact problem of a problem: matching meshes, data in every load state, laws."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ...arrays import Array
from ...bem.boundary_data import BoundaryData
from ...bem.compatibility import check_compatible
from ...bem.particular.volume import VolumeSolution, volume_solution
from ...compliance.interface import Interface
from ...contact.law_protocol import ContactLaw, GivenLaw
from ...contact.laws import Tresca
from ...geometry.surface import Boundary
from ...given.body_data import Body
from ...given.interface_data import PosedInterface
from ...given.posed import WHOLE_LOAD, Posed
from ...mesh.boundary_mesh import BoundaryMesh
from ...mesh.pairs.contact_search import Facing
from ...model.load_steps import Step
from ...model.problem import Problem
from ...refinement.body_meshes import mesh_of
from ...results.report import Finding
from ..choice import posed_memory, suitable_bem
from ..judge.findings import new_finding, refuse
from ..judge.measured import followed_noise
from ..judge.meshes import check_distances, check_meshes, check_stiffness, too_long_to_bend
from .body_parts import body_alone, check_parts
from .facing import (
    contact_interface,
    facings_of,
    mismatch,
    nearest_only,
    periodic_interface,
    untouched,
)
from .load_states import body_motions, boundary_data, check_held
from .nodal_laws import Laws, laws_between, wear_between, with_law

POSED = ("body", "contact", "obstacle", "step")
"""Fields of a problem that determine the discrete one. The other fields are the method's."""
MeshMaker = Callable[[int, Body, Boundary], BoundaryMesh]
"""Function that returns the mesh of a body. Its arguments are the body's number, the body with a
condition on each part, and its boundary. Primaries are matched afterwards."""


@dataclass
class Discrete:
    """A problem on meshes.

    Attributes
    ----------
    problem : Problem
    boundaries : list of Outline or surfaces
    meshes : list of BoundaryMesh
    interfaces : list of Interface
        The problem's interfaces on the meshes, in the problem's order. All hold their normals if
        none may open and no friction depends on pressure, because u_n is then known.
    laws : Laws
        Friction in all load states.
    data : list of BoundaryData
        Known data of each body. State 0 is unloaded, state k is the end of step k.
    distance : list of float
        Smallest distance or gap of each interface, infinite if no node has a primary opposite
        [length].
    wear : (M,) array
        Coefficient of Archard's law at the nodes of all interfaces [1/stress].
    findings, of_meshes : lists of Finding
        Findings about interfaces and data, and about the meshes.
    facings : list of Facing
        How the two sides of each interface lie opposite; None if the primary is not a body.
    volumes : list of VolumeSolution
        Particular solution of each body; None without volume loads.
    """

    problem: Problem
    boundaries: list[Boundary]
    meshes: list[BoundaryMesh]
    interfaces: list[Interface]
    laws: Laws
    data: list[BoundaryData]
    distance: list[float]
    wear: Array
    findings: list[Finding] = field(default_factory=list)
    of_meshes: list[Finding] = field(default_factory=list)
    facings: list[Facing | None] = field(default_factory=list)
    volumes: list[VolumeSolution | None] = field(default_factory=list)

    @property
    def law(self) -> ContactLaw:
        """The law at the end of the last step."""
        return self.laws.last

    @property
    def sides(self) -> tuple[PosedInterface, ...]:
        """The interfaces as the problem poses them."""
        return self.posed.interfaces

    @property
    def posed(self) -> Posed:
        """The problem without its config, which is all that later stages read of it."""
        return self.problem.posed

    @property
    def config(self) -> str:
        """The problem as TOML."""
        return self.problem.toml()

    def with_increments(self, counts: Mapping[int, int], jump: int | None = None) -> Discrete:
        """Return the same problem with other numbers of increments, by the number of the step, and
        of cycles taken at once.

        A problem without steps has one then.
        """
        given = self.problem.step or ((Step(name=WHOLE_LOAD.name),) if counts else ())
        steps = tuple(
            step.model_copy(update={"increments": counts[number]}) if number in counts else step
            for number, step in enumerate(given, 1)
        )
        cycle = self.problem.cycle
        if cycle is not None and jump is not None:
            cycle = cycle.model_copy(update={"jump": jump})
        changes = {"step": steps, "cycle": cycle}
        return replace(self, problem=self.problem.model_copy(update=changes))

    def with_steps_of(self, other: Problem) -> Discrete:
        """Return the same problem with the increments of another one."""
        problem = self.problem.model_copy(update={"step": other.step})
        return replace(self, problem=problem)

    @functools.cached_property
    def motions(self) -> list[Array]:
        """Rigid motions (n, d, r) of each body that no condition holds [-]."""
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
    law: GivenLaw | None = None,
    like: Discrete | None = None,
) -> Discrete:
    """Return the meshes, data and laws of a problem.

    Parameters
    ----------
    problem : Problem
    make_mesh : MeshMaker, optional
        Makes the mesh of each body. By default the body's options determine it.
    law : optional
        As in `solve`.
    like : Discrete, optional
        A discrete problem that differs in friction, gaps, loads, motions or the method only. Its
        meshes and facings are used again, and all data that do not change.

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
    bem = suitable_bem(problem.posed, meshes)
    problem = problem if bem is problem.bem else problem.model_copy(update={"bem": bem})
    if like is None:
        # operators that do not fit are refused before the search for contact, which takes long
        posed_memory(problem.posed, meshes, meshes[0].components - problem.posed.holds_normals)
    refuse(check_stiffness(problem.posed))
    facings = facings_of(problem.interfaces, meshes) if like is None else like.facings
    interfaces, distance, findings = _on_meshes(problem, meshes, facings)
    findings += check_distances(problem.interfaces, boundaries, distance)
    findings += followed_noise(problem.interfaces, boundaries)
    refuse(findings)
    interfaces, laws, data = _law_and_data(problem, boundaries, meshes, interfaces, law)
    data, volumes = with_volume_loads(problem.bodies, meshes, data, like)
    notes = [note for volume in volumes if volume is not None for note in volume.notes]
    findings += [new_finding("volume loads", note) for note in notes]
    if like is None:
        of_meshes = [*check_meshes(problem.posed, meshes, boundaries, make_mesh is not None)]
        refuse(of_meshes)
        if make_mesh is None:
            for interface, facing in zip(problem.interfaces, facings, strict=True):
                of_meshes += mismatch(interface, facing)
    return Discrete(
        problem,
        boundaries,
        meshes,
        interfaces,
        laws,
        data,
        distance,
        wear_between(problem.interfaces, interfaces, meshes),
        findings,
        of_meshes if like is None else like.of_meshes,
        facings,
        volumes,
    )


def _on_meshes(
    problem: Problem, meshes: list[BoundaryMesh], facings: Sequence[Facing | None]
) -> tuple[list[Interface], list[float], list[Finding]]:
    """Return the interfaces on meshes, the smallest distance or gap of each [length], and
    findings."""
    interfaces, distance, findings = list[Interface](), list[float](), list[Finding]()
    for posed, facing in zip(problem.interfaces, facings, strict=True):
        if posed.periodic:
            own, far = (
                periodic_interface(problem.bodies[posed.body], posed, meshes[posed.body]),
                0.0,
            )
        else:
            own, far, notes = contact_interface(posed, meshes, facing, problem.posed.holds_normals)
            findings += notes
        interfaces.append(own)
        distance.append(far)
    interfaces = list(nearest_only(problem.interfaces, interfaces))
    return interfaces, distance, [*findings, *untouched(problem.interfaces, interfaces)]


def _law_and_data(
    problem: Problem,
    boundaries: list[Boundary],
    meshes: list[BoundaryMesh],
    interfaces: list[Interface],
    given: GivenLaw | None,
) -> tuple[list[Interface], Laws, list[BoundaryData]]:
    """Return the interfaces with their contact directions, the laws, and the data of all bodies.

    Raises
    ------
    InputError
        If the conditions of a body hold it at too few nodes.
    """
    interfaces, laws = with_law(given, problem.interfaces, interfaces, meshes)
    data = [boundary_data(*body, interfaces) for body in zip(problem.bodies, meshes, strict=True)]
    if given is not None or not isinstance(laws.last, Tresca):
        return interfaces, laws, data
    for known, mesh in zip(data, meshes, strict=True):
        check_held(known, mesh)
    motions = list(map(body_motions, boundaries, data, meshes))
    if not interfaces or not any(free.shape[2] for free in motions):
        return interfaces, laws, data
    # the equilibrium of bodies that only contact holds is exact if all tractions are unknowns
    interfaces = [replace(interface, held=False) for interface in interfaces]
    laws = laws_between(problem.interfaces, interfaces, meshes)
    data = [boundary_data(*body, interfaces) for body in zip(problem.bodies, meshes, strict=True)]
    return interfaces, laws, data


def meshed(
    problem: Problem, make_mesh: MeshMaker | None, like: Discrete | None = None
) -> tuple[list[Boundary], list[BoundaryMesh]]:
    """Return the boundaries and the meshes of the bodies; meshes match where parts are opposite."""
    boundaries = list(like.boundaries) if like else problem.boundaries
    check_parts(problem, boundaries)
    bodies = [body_alone(problem.posed, b, boundary) for b, boundary in enumerate(boundaries)]
    if like is not None:
        for body, boundary in zip(bodies, boundaries, strict=True):
            check_compatible(boundary, body)
        return boundaries, like.meshes
    own = [
        mesh_of(body, boundaries[b]) if make_mesh is None else make_mesh(b, body, boundaries[b])
        for b, body in enumerate(bodies)
    ]
    pairs = [interface for interface in problem.interfaces if interface.primary is not None]
    if pairs:
        from ...mesh.pairs.matching import matched

        own = matched(boundaries, own, pairs, too_long_to_bend)
    return boundaries, own


def with_volume_loads(
    bodies: Sequence[Body],
    meshes: list[BoundaryMesh],
    data: list[BoundaryData],
    like: Discrete | None,
) -> tuple[list[BoundaryData], list[VolumeSolution | None]]:
    """Return the data with particular solutions for volume loads, and these solutions.

    Solutions and data of `like` are used again if the loads do not change.
    """
    complete, volumes = [], []
    for b, (body, mesh, mesh_data) in enumerate(zip(bodies, meshes, data, strict=True)):
        if like is not None and like.problem.bodies[b].loads_volume_as(body):
            volume, at_nodes = like.volumes[b], like.data[b].volume
        else:
            volume = volume_solution(body, mesh)
            at_nodes = None if volume is None else volume.nodal_values(mesh)
        volumes.append(volume)
        posed = mesh_data if at_nodes is None else replace(mesh_data, volume=at_nodes)
        complete.append(like.data[b] if like is not None and posed.equals(like.data[b]) else posed)
    return complete, volumes
