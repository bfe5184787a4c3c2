"""From an assembly to its discrete contact problem: meshes that match, data in every load state, laws, bodies eliminated."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..arrays import Array, Index, Mask
from ..compliance.bodies import BodiesSystem, Interface
from ..compliance.body.base import BodyCompliance, BodyOperators, Loading, free_motions
from ..compliance.body.dense import DenseBody
from ..contact.laws import Frictional
from ..errors import InputError
from ..geometry.outline import Outline, as_outline
from ..mesh.contact_pairs import PairSides, face, match, mesh_of_sides, side_meshes
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..model.assembly import ONE_BODY, Assembly, Body, changed_condition
from ..model.base import nearest
from ..model.expressions import evaluate
from ..model.problem import Contact, Displacement, Problem, Traction
from ..refinement.meshes import mesh_of


@dataclass(frozen=True)
class Side:
    """One interface as the config has it.

    Attributes
    ----------
    name, key : str
        Name, and the place in the config for errors.
    body : int
    part : str
    primary : (int, str), optional
        Body and part of the primary.
    obstacle : int, optional
    law : Contact or Pair
        Whose normal, gap and friction it has.
    direction : (2,) array, optional
    """

    name: str
    key: str
    body: int
    part: str
    primary: tuple[int, str] | None
    obstacle: int | None
    law: Any
    direction: Array | None


@dataclass
class Discrete:
    """An assembly on meshes.

    Attributes
    ----------
    assembly : Assembly
    outlines : list of Outline
    meshes : list of CurveMesh
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
    outlines: list[Outline]
    meshes: list[CurveMesh]
    sides: list[Side]
    interfaces: list[Interface]
    law: Frictional
    loadings: list[Loading]
    distance: list[float]
    warnings: list[str] = field(default_factory=list)


def interfaces_of(assembly: Assembly) -> list[Side]:
    """Contact conditions and contact pairs, in the order of the config."""
    result = []
    several = len(assembly.body) > 1 or assembly.body[0].name != ONE_BODY
    for b, body in enumerate(assembly.body):
        for k, condition in enumerate(body.boundary):
            if isinstance(condition, Contact):
                name = f"{body.name}.{condition.part}" if several else condition.part
                key = f"body[{b}].boundary[{k}]" if several else f"boundary[{k}]"
                result.append(Side(name, f"{key} ({condition.part})", b, condition.part, None, None, condition, None))
    obstacles = [o.name for o in assembly.obstacle]
    for k, pair in enumerate(assembly.contact):
        key = f"contact[{k}]"
        a, part = assembly.side(f"{key}.secondary", pair.secondary)
        direction = None if pair.direction is None else np.array(pair.direction) / np.hypot(*pair.direction)
        if pair.primary in obstacles:
            result.append(Side(pair.name, key, a, part, None, obstacles.index(pair.primary), pair, direction))
        else:
            primary = assembly.side(f"{key}.primary", pair.primary, obstacles)
            result.append(Side(pair.name, key, a, part, primary, None, pair, direction))
    return result


MeshMaker = Callable[[int, Problem, Outline], CurveMesh]
"""The mesh of a body by its number, the body as a problem of its own, and its outline; primaries are matched afterwards."""


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
    what = "several bodies, gaps, unilateral or Coulomb contact, load steps"
    outlines = [as_outline(body.geometry.outline(), what) for body in assembly.body]
    _check_parts(assembly, outlines, sides)
    pairs = [_pair_sides(side, outlines) for side in sides]
    joints = []
    for b, (body, outline) in enumerate(zip(assembly.body, outlines, strict=True)):
        problem = as_problem(body, outline, sides, b)
        mesh = as_curve(mesh_of(problem)) if make_mesh is None else make_mesh(b, problem, outline)
        joints.append(side_meshes(outline, mesh))
    match(outlines, joints, [pair for pair in pairs if pair is not None])
    meshes = [mesh_of_sides(outline, parts) for outline, parts in zip(outlines, joints, strict=True)]
    notes: list[str] = []
    interfaces, distance = [], []
    for side, pair in zip(sides, pairs, strict=True):
        interface, smallest, mismatch = _interface(side, pair, meshes)
        interfaces.append(interface)
        distance.append(smallest)
        notes += mismatch
    loadings = [_loading(assembly, b, meshes[b]) for b in range(len(meshes))]
    law = _law(sides, interfaces, meshes)
    return Discrete(assembly, outlines, meshes, sides, interfaces, law, loadings, distance, notes)


def _check_parts(assembly: Assembly, outlines: list[Outline], sides: list[Side]) -> None:
    for b, (body, outline) in enumerate(zip(assembly.body, outlines, strict=True)):
        taken: list[str] = []
        for k, condition in enumerate(body.boundary):
            _known_part(f"body {body.name!r}: boundary[{k}].part", condition.part, outline.parts)
            if condition.part in taken:
                raise InputError(f"body {body.name!r}: boundary[{k}].part: {condition.part!r} has a condition already")
            taken.append(condition.part)
        for side in sides:
            if isinstance(side.law, Contact):
                continue
            for what, number, part in (("secondary", side.body, side.part), ("primary", *(side.primary or (-1, "")))):
                if number != b:
                    continue
                _known_part(f"{side.key}.{what}: body {body.name!r}", part, outline.parts)
                if part in taken:
                    raise InputError(f"{side.key}.{what}: {part!r} of body {body.name!r} has a boundary condition already")


def _known_part(key: str, part: str, parts: tuple[str, ...]) -> None:
    if part not in parts:
        raise InputError(f"{key}: no part {part!r}{nearest(part, list(parts)) or '; parts are ' + ', '.join(parts)}")


def _pair_sides(side: Side, outlines: list[Outline]) -> PairSides | None:
    if side.primary is None:
        return None
    b, part = side.primary
    return PairSides((side.body, _numbers(outlines[side.body], side.part)), (b, _numbers(outlines[b], part)), side.direction)


def _numbers(outline: Outline, part: str) -> Index:
    return np.array([k for k, side in enumerate(outline.sides) if side.part == part])


def as_problem(body: Body, outline: Outline, sides: list[Side], number: int) -> Problem:
    """One body as a problem of its own, for what only needs to know which parts are held, loaded or in contact."""
    conditions: list[Any] = [c for c in body.boundary if not isinstance(c, Contact)]
    touching = {s.part for s in sides if s.body == number}
    touching |= {s.primary[1] for s in sides if s.primary and s.primary[0] == number}
    conditions += [Contact(part=part) for part in outline.parts if part in touching]
    named = {c.part for c in conditions}
    conditions += [Traction(part=part, value=(0.0, 0.0)) for part in outline.parts if part not in named]
    return Problem(material=body.material, geometry=body.geometry, mesh=body.mesh, boundary=tuple(conditions))


def _interface(side: Side, pair: PairSides | None, meshes: list[CurveMesh]) -> tuple[Interface, float, list[str]]:
    mesh = meshes[side.body]
    nodes = mesh.nodes_of(side.part)
    notes: list[str] = []
    facing = None
    if pair is not None and side.primary is not None:
        b, part = side.primary
        facing = face(mesh, side.part, meshes[b], part, pair)
        normal, present = facing.normal, facing.met
        if not facing.matched and bool(present.any()):
            notes.append(f"pair {side.name!r}: elements of the two sides do not match; values are interpolated, which "
                         "costs 1e-2 to 1e-1 of the pressure")  # fmt: skip
    else:
        normal = mesh.normal[nodes] if side.direction is None else np.broadcast_to(side.direction, (len(nodes), 2)).copy()
        present = np.ones(len(nodes), dtype=bool)
    if side.law.gap == "geometry":
        gap = facing.distance if facing is not None and side.law.normal == "unilateral" else np.zeros(len(nodes))
    else:
        gap = evaluate(side.law.gap, mesh.variables(nodes), len(nodes), f"{side.key}.gap")
    gap = np.where(present, gap, np.inf)
    smallest = float(gap.min(initial=np.inf))
    if facing is None:
        return Interface(side.name, side.body, nodes, normal, gap, obstacle=side.obstacle), smallest, notes
    assert side.primary is not None
    return Interface(side.name, side.body, nodes, normal, gap, side.primary[0], facing.primary, facing.values, facing.loads,
                     None), smallest, notes  # fmt: skip


def _law(sides: list[Side], interfaces: list[Interface], meshes: list[CurveMesh]) -> Frictional:
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
    return Frictional(coefficient, bound, unilateral, 2, absent)


def _not_negative(value: Any, names: dict[str, Array], m: int, key: str, x: Array) -> Array | None:
    if value is None:
        return None
    values = evaluate(value, names, m, key)
    if np.any(values < 0.0):
        k = int(np.argmin(values))
        raise InputError(f"{key}: must be >= 0, is {values[k]:g} at x = {x[k, 0]:g}, y = {x[k, 1]:g}")
    return values


def _loading(assembly: Assembly, number: int, mesh: CurveMesh) -> Loading:
    """Known data of a body: nothing in state 0, the conditions with the changes of steps 1 to k in state k."""
    body = assembly.body[number]
    known = np.ones((mesh.n_nodes, 2), dtype=bool)
    conditions = {c.part: c for c in body.boundary if not isinstance(c, Contact)}
    for condition in conditions.values():
        if isinstance(condition, Displacement):
            nodes = mesh.nodes_of(condition.part)
            for c, component in enumerate(condition.value):
                known[nodes, c] = component == "free"
    names = [b.name for b in assembly.body]
    values, pushes = [np.zeros((mesh.n_nodes, 2))], [np.zeros((len(body.point_force), 2))]
    cache: dict[str, tuple[Any, Array]] = {}
    for s, step in enumerate(assembly.step or (None,)):
        for k, change in enumerate(step.boundary if step else ()):
            if names.index(change.body or names[0]) == number:
                key = f"step[{s}].boundary[{k}]"
                conditions[change.part] = changed_condition(
                    body.model_copy(update={"boundary": tuple(conditions.values())}), change, key
                )
        value = np.zeros((mesh.n_nodes, 2))
        for part, condition in conditions.items():
            nodes = mesh.nodes_of(part)
            if part not in cache or cache[part][0] is not condition:
                cache[part] = (condition, _given(condition, mesh, nodes, f"body {body.name!r}: {part}"))
            value[nodes] = cache[part][1]
        values.append(value)
        forces = assembly.point_forces(number, s + 1, 1.0)
        pushes.append(np.array([f.force for f in forces]).reshape(len(forces), 2))
    point = np.array([f.at for f in body.point_force]).reshape(-1, 2)
    return Loading(known, np.array(values), point, np.array(pushes))


def _given(condition: Displacement | Traction, mesh: CurveMesh, nodes: Index, key: str) -> Array:
    names, count = mesh.variables(nodes), len(nodes)
    if isinstance(condition, Traction) and condition.pressure is not None:
        return -evaluate(condition.pressure, names, count, f"{key}.pressure")[:, None] * mesh.normal[nodes]
    assert condition.value is not None
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
    """Eliminate each body, one rank a body where there are several, and compose them; the same on every rank."""
    began = time.perf_counter()
    rank, size = comm.getRank(), comm.getSize()
    bodies: list[BodyCompliance | None] = []
    for b, mesh in enumerate(discrete.meshes):
        bodies.append(_eliminated(discrete, b, mesh) if b % size == rank else None)
    if size > 1:
        world = comm.tompi4py()
        bodies = [world.bcast(body, root=b % size) for b, body in enumerate(bodies)]
    timings["eliminate"] = timings.get("eliminate", 0.0) + time.perf_counter() - began
    x = [discrete.meshes[i.body].x[i.nodes] for i in discrete.interfaces]
    centres = [np.array(o.centre) for o in discrete.assembly.obstacle]
    return BodiesSystem([body for body in bodies if body is not None], discrete.interfaces, x, centres)


def _eliminated(discrete: Discrete, number: int, mesh: CurveMesh) -> BodyCompliance:
    loading = discrete.loadings[number]
    material, contact = discrete.assembly.body[number].material, contact_nodes(discrete, number)
    modes = free_motions(mesh, loading.traction_known, discrete.outlines[number].exterior)
    return DenseBody(BodyOperators.of(mesh, material, loading, contact), modes)
