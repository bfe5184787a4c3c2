"""Adaptive solution of an assembly: edges of contact and stick are found and graded, on mesh after mesh."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..contact.laws import OPEN, SLIP
from ..contact.state import Start
from ..geometry.outline import Outline, as_outline
from ..geometry.surface import Boundary
from ..mesh.basis import lagrange
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..mesh.hp_grading import Grading, Marks, balanced, graded_mesh
from ..model.assembly import Assembly
from ..model.problem import Problem
from ..refinement.contact_edges import Edge, edges, merged, zone_at
from ..refinement.marks import UNSEEN, Body, marks_for
from ..results.steps.solution import AssemblySolution, PairResult, StepResult
from .assemble import Discrete, discretise
from .load_steps import Monitor, prepare_assembly, run_steps
from .sides import interfaces_of


@dataclass(frozen=True)
class ContactRung:
    """One grading of the ladder.

    Attributes
    ----------
    grading : Grading
    edge : float
        Smallest element at an edge over half the width of its contact [-].
    resolved : float
        Relative error that the smallest elements may leave at corners, see `marks_for` [-].
    """

    grading: Grading
    edge: float
    resolved: float


LADDER = (
    ContactRung(Grading(2, 0.30), 1e-1, 2.5e-3),
    ContactRung(Grading(2, 0.30), 2e-2, 1e-3),
    ContactRung(Grading(3, 0.30), 5e-3, 1e-4),
    ContactRung(Grading(4, 0.30), 1e-3, 1e-5),
    ContactRung(Grading(5, 0.33), 2e-4, 1e-6),
    ContactRung(Grading(5, 0.38), 3e-5, 1e-7),
    ContactRung(Grading(5, 0.45), 5e-6, 2e-8),
)
FEW = 8
"""Closed nodes of a contact below which its edges are looked for once more on the same rung."""
AGAIN = 3
"""How often."""
OUTSIDE = 1e6
"""Shear, in units of the pressure, that no coefficient of friction holds."""
FADE = 0.02
"""Share of a part at either end over which the norm of differences fades out."""
SAFETY = 40.0
"""A difference is at least that before it over this: small ones happen by chance."""


def adapt_assembly(
    assembly: Assembly, accuracy: float, *, comm: Any = None, monitor: Monitor | None = None
) -> AssemblySolution:
    """The solution whose pressure and shear change by less than the accuracy from one mesh to the next, finer one.

    Parameters
    ----------
    assembly : Assembly
        Of `[mesh]` only `graded_points` count.
    accuracy : float
        Wanted error of p and q on all interfaces at the ends of all steps: relative, L2 [-].
    comm, monitor
        As `solve_assembly`.

    Returns
    -------
    AssemblySolution
        `info["accuracy"]` and `info["estimated_error"]`, the last difference, which is the error of the mesh before. "not
        converged" where the finest mesh was not enough.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    InputError, SolverError
        As `solve_assembly`.
    """
    if not 0.0 < accuracy < 1.0:
        raise ValueError(f"the accuracy lies between 0 and 1, got {accuracy}")
    began = time.perf_counter()
    before: AssemblySolution | None = None
    found: dict[str, list[Edge]] = {}
    differences, counts = list[float](), list[int]()
    estimate = math.inf
    for rung in LADDER:
        for attempt in range(AGAIN):
            solution, found = _level(assembly, rung, before, found, comm, monitor)
            difference = relative_difference(before, solution) if before is not None else math.inf
            before = solution
            counts.append(sum(mesh.n_elements for mesh in solution.meshes.values()))
            if solution.status != "converged" or not _few(solution) or attempt == AGAIN - 1:
                break
        if solution.status != "converged":
            break
        if math.isfinite(difference):
            estimate = max(difference, differences[-1] / SAFETY if differences else 0.0)
            differences.append(difference)
        if len(differences) >= 2 and estimate <= accuracy:
            break
    info = {**solution.info, "accuracy": accuracy, "estimated_error": estimate, "levels": counts, "differences": differences,
            "edges": {name: [edge.s for edge in items] for name, items in found.items()}}  # fmt: skip
    status, reason = solution.status, solution.reason
    if status == "converged" and estimate > accuracy:
        status, reason = "not converged", f"estimated error {estimate:.1e} > {accuracy:g} on the finest mesh"
    timings = {**solution.timings, "adapt": time.perf_counter() - began - sum(solution.timings.values())}
    return replace(solution, status=status, reason=reason, info=info, timings=timings)


def _level(
    assembly: Assembly, rung: ContactRung, before: AssemblySolution | None, found: dict[str, list[Edge]], comm: Any,
    monitor: Monitor | None,
) -> tuple[AssemblySolution, dict[str, list[Edge]]]:  # fmt: skip
    """The solution on the mesh of a rung, and the edges that it shows."""
    names = {(side.body, side.part): side.name for side in interfaces_of(assembly)}

    def make(number: int, problem: Problem, boundary: Boundary) -> CurveMesh:
        mine = {part: found.get(name, []) for (body, part), name in names.items() if body == number}
        return _mesh(problem, as_outline(boundary, "--adapt"), rung, mine, before is None)

    discrete = discretise(assembly, make)
    problem = prepare_assembly(assembly, comm, discrete)
    warm = None if before is None else _warm(before, discrete)
    solution = run_steps(problem, warm=warm, monitor=monitor)
    return solution, found_edges(solution, rung.edge)


def _mesh(problem: Problem, outline: Outline, rung: ContactRung, found: dict[str, list[Edge]], unseen: bool) -> CurveMesh:
    """A mesh of one body graded to its corners, to points that the user gave, and to the edges on its secondary parts."""
    body = Body.of(problem, outline)
    marks = marks_for(body, rung.grading, rung.resolved, None)
    offset: dict[str, float] = {}
    largest = []
    for k, side in enumerate(outline.sides):
        start = offset.get(side.part, 0.0)
        offset[side.part] = start + side.length
        secondary = side.part in found
        largest.append(side.length / UNSEEN if secondary and unseen else np.inf)
        inside = [e for e in found.get(side.part, []) if 1e-6 * side.length < e.s - start < (1.0 - 1e-6) * side.length]
        if inside:
            marks[k] = _with_edges(marks[k], [(e.s - start, rung.edge * e.width) for e in inside], rung.grading)
    return graded_mesh(outline, marks, rung.grading, largest)


def _with_edges(marks: Marks, inner: list[tuple[float, float]], grading: Grading) -> Marks:
    """Marks with further points; one that is there already is moved where it is close to an edge."""
    places, sizes = (np.array(values) for values in zip(*inner, strict=True))
    apart = np.abs(marks.position[:, None] - places[None]).min(axis=1)
    kept = apart > 3.0 * sizes.max()
    kept[[0, -1]] = True
    position, size = np.append(marks.position[kept], places), np.append(marks.size[kept], sizes)
    order = np.argsort(position)
    return balanced(Marks(position[order], size[order]), grading)


def found_edges(solution: AssemblySolution, smallest: float) -> dict[str, list[Edge]]:
    """Edges on every interface at the ends of all steps, those that are one merged."""
    result: dict[str, list[Edge]] = {}
    for name in solution.nodes:
        every: list[Edge] = []
        for step in step_ends(solution):
            every += _edges(step.pairs[name])
        result[name] = merged(every, smallest)
    return result


def _edges(pair: PairResult) -> list[Edge]:
    order = np.argsort(pair.arc_length)
    return edges(pair.arc_length[order], pair.pressure[order], pair.sigma_t[order, 0], pair.bound[order], pair.gap[order],
                 pair.slip_increment[order, 0], pair.state[order].astype(np.int64))  # fmt: skip


def step_ends(solution: AssemblySolution) -> list[StepResult]:
    """The last increment of each step."""
    return [step for k, step in enumerate(solution.steps)
            if k + 1 == len(solution.steps) or solution.steps[k + 1].step != step.step]  # fmt: skip


def _few(solution: AssemblySolution) -> bool:
    """Whether a contact is seen by so few nodes that its edges are guesses."""
    pairs = [step.pairs.values() for step in step_ends(solution)]
    closed = [np.count_nonzero(pair.state != 2) for step in pairs for pair in step if np.any(pair.state == 2)]
    return any(0 < count < FEW for count in closed)


def _warm(before: AssemblySolution, discrete: Discrete) -> Start:
    """v and σ on another mesh whose sets are the zones that a solution had after its first increment; of size one."""
    parts = []
    first = before.steps[0]
    for side, interface in zip(discrete.sides, discrete.interfaces, strict=True):
        pair = first.pairs[side.name]
        way = np.where(pair.state == SLIP, -np.sign(pair.sigma_t[:, 0]), 0.0).astype(np.int64)
        s = as_curve(discrete.meshes[side.body]).arc_length[interface.nodes]
        own, state = _edges(pair), pair.state.astype(np.int64)
        state, way = (zone_at(pair.arc_length, values, own, s) for values in (state, way))
        open_, slip = 1.0 * (state == OPEN), np.where(state == SLIP, np.where(way == 0, 1, way), 0)
        parts.append((np.column_stack([slip, -open_]), np.column_stack([-slip * OUTSIDE, open_ - 1.0])))
    v, sigma = (np.concatenate(values).astype(np.float64) for values in zip(*parts, strict=True))
    return v, sigma


def relative_difference(coarse: AssemblySolution, fine: AssemblySolution) -> float:
    """The largest ‖(p, q)_coarse - (p, q)_fine‖/‖p‖ over interfaces and step ends, at the fine nodes.

    Towards the ends of a part, where corners may make p infinite and no mesh its L2 norm exact, the norm fades out.
    """
    worst = 0.0
    for one, other in zip(step_ends(coarse), step_ends(fine), strict=True):
        for name, pair in other.pairs.items():
            mesh = coarse.meshes[coarse.sides[name][0]]
            place = _interpolation(as_curve(mesh), coarse.sides[name][1], coarse.nodes[name], pair.arc_length)
            old, s = one.pairs[name], pair.arc_length
            length = float(pair.weight.sum())
            weight = pair.weight * np.minimum(1.0, np.minimum(s, length - s) / (FADE * length)) ** 2
            size = float(np.sqrt(weight @ pair.pressure**2))
            for change in (place @ old.pressure - pair.pressure, place @ old.sigma_t[:, 0] - pair.sigma_t[:, 0]):
                if size > 0.0:
                    worst = max(worst, float(np.sqrt(weight @ change**2)) / size)
    return worst


def _interpolation(mesh: CurveMesh, part: str, nodes: Index, s: Array) -> Array:
    """Values at the nodes of a part to values at arc lengths along it, (len(s), len(nodes)), element by element."""
    numbers = np.flatnonzero(mesh.part == mesh.part_names.index(part))
    starts = mesh.side_start[numbers]
    order = np.argsort(starts)
    numbers, starts = numbers[order], starts[order]
    element = numbers[np.clip(np.searchsorted(starts, s, side="right") - 1, 0, len(numbers) - 1)]
    xi = np.clip(2.0 * (s - mesh.side_start[element]) / mesh.length[element] - 1.0, -1.0, 1.0)
    slot = np.full(mesh.n_nodes, -1)
    slot[nodes] = np.arange(len(nodes))
    result = np.zeros((len(s), len(nodes)))
    for p in np.unique(mesh.order[element]):
        rows = np.flatnonzero(mesh.order[element] == p)
        columns = slot[mesh.first_node[element[rows]][:, None] + np.arange(p + 1)]
        result[rows[:, None], columns] = lagrange(int(p), xi[rows]).T
    return result


__all__ = ["adapt_assembly", "found_edges", "relative_difference"]
