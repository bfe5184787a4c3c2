"""From an assembly to its discrete contact problem: meshes that match, data in every load state, laws, bodies eliminated."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..bem.boundary_data import check_components
from ..compliance.bodies import BodiesSystem, Interface
from ..compliance.body.base import BodyCompliance, BodyOperators, Loading, free_motions
from ..compliance.body.dense import DenseBody
from ..contact.laws import Frictional
from ..errors import InputError, SolverError
from ..geometry.surface import Boundary
from ..mesh.boundary_mesh import BoundaryMesh
from ..mesh.curve_mesh import CurveMesh
from ..mesh.pairs.facing import face
from ..mesh.pairs.hits import along
from ..mesh.pairs.matching import PairParts, matched
from ..model.assembly import Assembly
from ..model.expressions import evaluate
from ..model.problem import Displacement, Problem, Traction
from ..model.solver_options import Bem
from ..refinement.meshes import mesh_of
from ..results.steps.solution import BodyResult
from .choice import LARGEST, check_memory, is_compressed, resolved_bem
from .sides import Side, as_problem, check_parts, interfaces_of
from .trust.elastic import ELASTIC_LIMIT, SAFE
from .trust.meshes import check_meshes, check_stiffness

OUTWARD = 1e-9
"""Cosine between a direction and some outward normal from which on it points outward."""


@dataclass
class Discrete:
    """An assembly on meshes.

    Attributes
    ----------
    assembly : Assembly
    boundaries : list of Outline or surfaces
    meshes : list of BoundaryMesh
    sides : list of Side
    interfaces : list of Interface
    law : Frictional
    loadings : list of Loading, one a body
        State 0 is the unloaded one, state k the end of step k.
    distance : list of float
        The smallest distance or gap of each interface, infinite where nothing is faced [length].
    warnings : list of str
    """

    assembly: Assembly
    boundaries: list[Boundary]
    meshes: list[BoundaryMesh]
    sides: list[Side]
    interfaces: list[Interface]
    law: Frictional
    loadings: list[Loading]
    distance: list[float]
    warnings: list[str] = field(default_factory=list)


HIDDEN = 1.3
"""Area that feels the tractions of the secondary, over that of the secondary which meets something, that is told."""
MeshMaker = Callable[[int, Problem, Any], BoundaryMesh]
"""The mesh of a body by its number, the body as a problem of its own, and its boundary; primaries are matched afterwards."""


def discretise(assembly: Assembly, make_mesh: MeshMaker | None = None) -> Discrete:
    """Meshes, data and laws of an assembly; the bodies' own meshes are what their options ask for, or `make_mesh`.

    Raises
    ------
    InputError
        If a part does not exist or has two conditions, data are not finite, or a coefficient or bound is negative.
    """
    sides = interfaces_of(assembly)
    if not sides:
        raise InputError('contact: no part is in contact; [[contact]] or condition = "contact" on a part says which')
    boundaries: list[Boundary] = [body.geometry.outline() for body in assembly.body]
    check_parts(assembly, boundaries, sides)
    problems = [as_problem(body, boundaries[b], sides, b) for b, body in enumerate(assembly.body)]
    own = [mesh_of(problem) if make_mesh is None else make_mesh(b, problem, boundaries[b])
           for b, problem in enumerate(problems)]  # fmt: skip
    pairs = [PairParts((s.body, s.part), s.primary, s.direction) for s in sides if s.primary is not None]
    meshes = matched(boundaries, own, pairs)
    notes: list[str] = []
    interfaces, distance = [], []
    for side in sides:
        interface, smallest, mismatch = _interface(side, meshes)
        interfaces.append(interface)
        distance.append(smallest)
        notes += mismatch
    loadings = [_loading(assembly, b, meshes[b]) for b in range(len(meshes))]
    law = _law(sides, interfaces, meshes)
    return Discrete(assembly, boundaries, meshes, sides, interfaces, law, loadings, distance, notes)


def _interface(side: Side, meshes: list[BoundaryMesh]) -> tuple[Interface, float, list[str]]:
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
            notes.append(f"pair {side.name!r}: elements of the two sides do not match; values are interpolated, which "
                         "costs 1e-2 to 1e-1 of the pressure")  # fmt: skip
        area = float(mesh.weight[nodes][present].sum())
        if float(meshes[b].weight[facing.primary] @ (facing.loads @ np.ones(len(nodes)))) > HIDDEN * area:
            notes.append(f"pair {side.name!r}: of the primary is faced what lies behind other parts of it, too: forces do "
                         "not balance; give what is met a part of its own")  # fmt: skip
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
        return Interface(side.name, side.body, nodes, normal, tangent, gap, obstacle=side.obstacle), smallest, notes
    assert side.primary is not None
    return Interface(side.name, side.body, nodes, normal, tangent, gap, side.primary[0], facing.primary, facing.values,
                     facing.loads, None), smallest, notes  # fmt: skip


def _law(sides: list[Side], interfaces: list[Interface], meshes: list[BoundaryMesh]) -> Frictional:
    parts: list[tuple[Array, Array, Mask, Mask]] = []
    for side, interface in zip(sides, interfaces, strict=True):
        mesh, nodes, law = meshes[side.body], interface.nodes, side.law
        m = len(nodes)
        names = mesh.variables(nodes)
        mu = _not_negative(law.friction_coefficient, names, m, f"{side.key}.friction_coefficient", mesh.x[nodes])
        bound = _not_negative(law.friction_bound, names, m, f"{side.key}.friction_bound", mesh.x[nodes])
        if bound is None:
            bound = np.full(m, np.inf if mu is not None or law.normal == "bonded" else 0.0)
        parts.append((mu if mu is not None else np.full(m, np.inf), bound, np.full(m, law.normal == "unilateral"),
                      ~np.isfinite(interface.gap)))  # fmt: skip
    coefficient, bound, unilateral, absent = (np.concatenate(values) for values in zip(*parts, strict=True))
    return Frictional(coefficient, bound, unilateral, meshes[0].dim, absent)


def _not_negative(value: Any, names: dict[str, Array], m: int, key: str, x: Array) -> Array | None:
    if value is None:
        return None
    values = evaluate(value, names, m, key)
    if np.any(values < 0.0):
        k = int(np.argmin(values))
        place = ", ".join(f"{name} = {value:g}" for name, value in zip("xyz", x[k], strict=False))
        raise InputError(f"{key}: must be >= 0, is {values[k]:g} at {place}")
    return values


def loadings_from(discrete: Discrete, step: int, ends: dict[str, BodyResult]) -> list[Loading]:
    """The data from a step on (from 1), after the step before ended with these fields; of bodies by name.

    What is known instead of another thing starts where that ended: a component that was free from its displacement, one
    that was held from its traction. Loadings of bodies of which the same is known are the old ones.
    """
    result = []
    for number, (body, mesh, old) in enumerate(zip(discrete.assembly.body, discrete.meshes, discrete.loadings, strict=True)):
        known = _traction_known(discrete.assembly, number, mesh, step)
        if np.array_equal(known, old.traction_known):
            result.append(old)
            continue
        new, end = _loading(discrete.assembly, number, mesh, step), ends[body.name]
        start = np.where(known, end.traction, end.u)
        new.value[step - 1] = np.where(known == old.traction_known, new.value[step - 1], start)
        result.append(new)
    return result


def _traction_known(assembly: Assembly, number: int, mesh: BoundaryMesh, step: int) -> Mask:
    """Components (n, d) whose traction is known in a step."""
    known = np.ones(mesh.x.shape, dtype=bool)
    for part, condition in assembly.conditions(number)[step - 1].items():
        if isinstance(condition, Displacement):
            check_components(condition.value, mesh, f"body {assembly.body[number].name!r}: {part}")
            nodes = mesh.nodes_of(part)
            for c, component in enumerate(condition.value):
                known[nodes, c] = component == "free"
    return known


def _loading(assembly: Assembly, number: int, mesh: BoundaryMesh, step: int = 1) -> Loading:
    """Known data of a body: nothing in state 0, the conditions with the changes of steps 1 to k in state k; what is known is
    that of one step."""
    body, shape = assembly.body[number], mesh.x.shape
    known = _traction_known(assembly, number, mesh, step)
    values, pushes = [np.zeros(shape)], [np.zeros((len(body.point_force), mesh.dim))]
    cache: dict[str, tuple[Any, Array]] = {}
    for s, conditions in enumerate(assembly.conditions(number)):
        value = np.zeros(shape)
        for part, condition in conditions.items():
            nodes = mesh.nodes_of(part)
            if part not in cache or cache[part][0] is not condition:
                cache[part] = (condition, _given(condition, mesh, nodes, f"body {body.name!r}: {part}"))
            value[nodes] = cache[part][1]
        values.append(value)
        forces = assembly.point_forces(number, s + 1, 1.0)
        pushes.append(np.array([f.force for f in forces]).reshape(len(forces), mesh.dim))
    point = np.array([f.at for f in body.point_force]).reshape(-1, mesh.dim)
    return Loading(known, np.array(values), point, np.array(pushes))


def _given(condition: Displacement | Traction, mesh: BoundaryMesh, nodes: Index, key: str) -> Array:
    names, count = mesh.variables(nodes), len(nodes)
    if isinstance(condition, Traction) and condition.pressure is not None:
        return -evaluate(condition.pressure, names, count, f"{key}.pressure")[:, None] * mesh.normal[nodes]
    assert condition.value is not None
    check_components(condition.value, mesh, key)
    columns = [np.zeros(count) if component == "free" and isinstance(condition, Displacement)
               else evaluate(component, names, count, f"{key}.value[{c}]")
               for c, component in enumerate(condition.value)]  # fmt: skip
    return np.column_stack(columns)


def contact_nodes(discrete: Discrete, number: int) -> Index:
    """Nodes of a body that may carry contact tractions, in increasing order."""
    found = [i.nodes for i in discrete.interfaces if i.body == number]
    found += [i.primary_nodes for i in discrete.interfaces if i.primary == number and i.primary_nodes is not None]
    return np.unique(np.concatenate(found)) if found else np.empty(0, dtype=np.int64)


def build(discrete: Discrete, comm: Any, timings: dict[str, float]) -> BodiesSystem:
    """Eliminate the bodies and compose them; the same on every rank.

    Compressed bodies are those of all ranks together, dense ones are dealt out to them, and then shared.

    Raises
    ------
    SolverError
        If a body cannot be eliminated.
    """
    began = time.perf_counter()
    every = discrete.assembly.body
    check_stiffness([body.name for body in every], [body.material.young_modulus for body in every])
    discrete.warnings += check_meshes([body.name for body in every], discrete.meshes)
    bem = resolved_bem(discrete.assembly.bem)
    bodies = [_compressed(discrete, b, bem, comm) for b in range(len(discrete.meshes))]
    dense = [b for b, body in enumerate(bodies) if body is None]
    rank, size = comm.getRank(), comm.getSize()
    for b in dense[rank::size]:
        check_memory(discrete.meshes[b])
        bodies[b] = DenseBody(*_operators(discrete, b))
    if size > 1:
        world = comm.tompi4py()
        for k, b in enumerate(dense):
            bodies[b] = world.bcast(bodies[b], root=k % size)
    timings["eliminate"] = timings.get("eliminate", 0.0) + time.perf_counter() - began
    x = [discrete.meshes[i.body].x[i.nodes] for i in discrete.interfaces]
    centres = [np.array(o.centre_in(discrete.meshes[0].dim)) for o in discrete.assembly.obstacle]
    return BodiesSystem([body for body in bodies if body is not None], discrete.interfaces, x, centres)


def _operators(discrete: Discrete, number: int) -> tuple[BodyOperators, Array]:
    """The operators of a body, and its rigid motions."""
    mesh, loading = discrete.meshes[number], discrete.loadings[number]
    material, contact = discrete.assembly.body[number].material, contact_nodes(discrete, number)
    modes = free_motions(mesh, loading.traction_known, discrete.boundaries[number].exterior)
    return BodyOperators.of(mesh, material, loading, contact), modes


def _compressed(discrete: Discrete, number: int, bem: Bem, comm: Any) -> BodyCompliance | None:
    """A body on compressed operators; None where dense ones are predicted, or found, to do better."""
    mesh = discrete.meshes[number]
    if not is_compressed(bem, mesh):
        return None
    if not isinstance(mesh, CurveMesh):
        if bem.mat_type == "hmatrix":
            raise InputError('bem.mat_type: "hmatrix" is for one body in bilateral contact; choose "auto" or "dense"')
        return None
    from ..compliance.body.compressed import CompressedBody

    if bem.mat_type == "hodlr" or mesh.n_nodes > LARGEST:
        return CompressedBody(*_operators(discrete, number), bem, comm)
    try:
        body = CompressedBody(*_operators(discrete, number), bem, comm)
    except SolverError:
        return None
    # what all loads and an even traction do satisfies the integral equations well enough
    shares, alpha = np.ones(len(body.u_0)), np.zeros(body.modes.shape[2])
    even = np.full(body.u_0.shape[1:], float(np.abs(body.loading.value).max(initial=0.0)) or 1.0)
    u, traction = body.boundary(shares, even, alpha)
    return body if body.residual(shares, u, traction, alpha) <= SAFE * ELASTIC_LIMIT else None
