"""Adaptive solution of an assembly: edges of contact and stick are found and graded, on mesh after mesh."""

from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Any

import numpy as np

from ..arrays import Array, Index
from ..contact.laws import OPEN, SLIP
from ..contact.state import Start
from ..geometry.outline import Outline, as_outline
from ..geometry.surface import Boundary
from ..mesh.basis import lagrange
from ..mesh.curve_mesh import CurveMesh, as_curve
from ..model.assembly import Assembly
from ..model.problem import Problem
from ..refinement.contact_edges import Edge, edges, merged, zone_at
from ..refinement.known_data import fields, offsets
from ..refinement.ladder import CONTACT_LADDER, Rung, believed, check_accuracy
from ..refinement.marks import UNSEEN, Body, RungMesh
from ..results.steps.solution import AssemblySolution, PairResult, StepResult
from .assemble import Discrete, discretise
from .load_steps import Monitor, prepare_assembly, run_steps
from .sides import interfaces_of

FEW = 8
"""Closed nodes of a contact below which its edges are looked for once more on the same rung."""
AGAIN = 3
"""How often."""
OUTSIDE = 1e6
"""Shear, in units of the pressure, that no coefficient of friction holds."""
FADE = 0.02
"""Share of a part at either end over which the norm of differences fades out."""


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
    check_accuracy(accuracy)
    began = time.perf_counter()
    climb = _Climb(assembly, comm, monitor)
    differences, counts, estimate = list[float](), list[int](), math.inf
    for rung in CONTACT_LADDER:
        for attempt in range(AGAIN):
            before = climb.solution
            solution = climb.level(rung)
            counts.append(sum(mesh.n_elements for mesh in solution.meshes.values()))
            if solution.status != "converged" or not _few(solution) or attempt == AGAIN - 1:
                break
        if solution.status != "converged" or climb.missed > 0.0:
            break
        if before is not None:
            differences.append(relative_difference(before, solution))
            estimate = believed(differences)
        if estimate <= accuracy:
            break
    # where nothing carries anything there is no p whose error could be known
    known = {"estimated_error": estimate} if any(p.pressure.any() for s in solution.tried for p in s.pairs.values()) else {}
    info = {**solution.info, "accuracy": accuracy, **known, "levels": counts, "differences": differences,
            "edges": {name: [edge.s for edge in items] for name, items in climb.edges.items()}}  # fmt: skip
    status, reason = solution.status, solution.reason
    if status == "converged" and climb.missed > 0.0:
        status, reason = "not converged", f"no mesh resolves the given data: {climb.missed:.1e} of them is missed"
    elif status == "converged" and estimate > accuracy:
        status, reason = "not converged", f"estimated error {estimate:.1e} > {accuracy:g} on the finest mesh"
    timings = {**solution.timings, "adapt": time.perf_counter() - began - sum(solution.timings.values())}
    return replace(solution, status=status, reason=reason, info=info, timings=timings)


class _Climb:
    """Meshes one after another, and what the last one showed.

    Attributes
    ----------
    solution : AssemblySolution or None
        The last one.
    edges : dict of lists of Edge by interface
        Those that it shows.
    missed : float
        What its mesh leaves of the given data beyond what is asked (or 0) [-].
    """

    def __init__(self, assembly: Assembly, comm: Any, monitor: Monitor | None) -> None:
        self.assembly, self.comm, self.monitor = assembly, comm, monitor
        self.solution: AssemblySolution | None = None
        self.edges: dict[str, list[Edge]] = {}
        self.missed = 0.0
        self._bodies: dict[int, Body] = {}
        self._names = {(side.body, side.part): side.name for side in interfaces_of(assembly)}

    def level(self, rung: Rung) -> AssemblySolution:
        """The solution on the mesh of a rung."""
        self.missed = 0.0

        def make(number: int, problem: Problem, boundary: Boundary) -> CurveMesh:
            if number not in self._bodies:
                self._bodies[number] = self._body(number, problem, as_outline(boundary, "--adapt"))
            made = self._mesh(number, rung)
            self.missed = max(self.missed, made.missed)
            return made.mesh

        discrete = discretise(self.assembly, make)
        problem = prepare_assembly(self.assembly, self.comm, discrete)
        warm = None if self.solution is None else _warm(self.solution, discrete)
        self.solution = run_steps(problem, warm=warm, monitor=self.monitor)
        self.edges = found_edges(self.solution, rung.edge)
        return self.solution

    def _body(self, number: int, problem: Problem, outline: Outline) -> Body:
        """What the meshes of a body share; its data are those of all steps."""
        body = Body.of(problem, outline)
        steps = self.assembly.conditions(number)
        for condition in {id(c): c for step in steps for c in step.values() if c not in problem.boundary}.values():
            rest = tuple(other for other in problem.boundary if other.part != condition.part)
            later = fields(problem.model_copy(update={"boundary": (*rest, condition)}), outline)
            here = [side.part == condition.part for side in outline.sides]
            body = replace(body, data=[[*row, *more] if mine else row
                                       for row, more, mine in zip(body.data, later, here, strict=True)])  # fmt: skip
        return body

    def _mesh(self, number: int, rung: Rung) -> RungMesh:
        """Graded to corners, to points that the user gave, and to the edges on secondary parts."""
        body = self._bodies[number]
        found = {part: self.edges.get(name, []) for (b, part), name in self._names.items() if b == number}
        largest, inner = list[float](), dict[int, list[tuple[float, float]]]()
        for k, (side, start) in enumerate(zip(body.outline.sides, offsets(body.outline), strict=True)):
            unseen = side.part in found and self.solution is None
            largest.append(side.length / UNSEEN if unseen else np.inf)
            inside = [e for e in found.get(side.part, []) if 1e-6 * side.length < e.s - start < (1.0 - 1e-6) * side.length]
            if inside:
                inner[k] = [(e.s - start, rung.edge * e.width) for e in inside]
        return body.mesh(rung, largest, None, inner)


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
