"""Adaptive solution: solve, find the transition points, refine towards them, estimate, repeat.

Meshes come from a ladder of gradings, each with an error about ten times smaller than the one before: more order and
a milder grading where the solution is smooth, smaller elements of low order at corners and transition points. The
solution of one rung places the transition points of the next one and is its start. The difference of two rungs is the
error of the lower one; the error of the upper one, which is returned, is that times the reduction by which the
ladder converges.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..arrays import Index
from ..bem.boundary_data import evaluate_boundary
from ..bem.kernels import kernel_for
from ..bem.operators import BoundaryOperators
from ..contact.state import Monitor
from ..mesh.hp_grading import graded_mesh
from ..model.case import Case
from ..model.compatibility import check_compatible
from ..model.problem import Problem
from ..refinement.contact_line import ContactLine, relative_difference, transition, without_specks
from ..refinement.marks import LADDER, Body, Rung, first_rung, marks_for
from ..results.solution import Solution, Zone
from ..runtime.petsc import petsc
from .initial_state import carried_over
from .prepare import prepare_operators
from .run import probed, run

UNTRIED = 0.8
"""Pace, of the ladder's own, that is expected of a body on which only two rungs were compared."""
FIRST_LOOK = 12
"""Least number of elements on a contact side when nothing is known of its zones."""


def adapt(
    case: Case | Problem,
    accuracy: float,
    *,
    comm: Any = None,
    monitor: Monitor | None = None,
) -> Solution:
    """The solution with an estimated error of u_t below a wanted one, on meshes that follow it.

    Parameters
    ----------
    case : Case or Problem
        Its `[mesh]` table only gives `graded_points`; its method, unless it names one, is semismooth Newton.
    accuracy : float
        Wanted error of u_t: relative, L2(Γ_C) [-].
    comm : PETSc.Comm, optional
        PETSc.COMM_WORLD by default.
    monitor : callable, optional
        Called with the state so far after each iteration of each solve; a reason that it returns ends the solve there.

    Returns
    -------
    Solution
        `info["accuracy"]` and `info["estimated_error"]` say what was wanted and what is estimated. The status is "not
        converged" when the finest mesh of the ladder was not enough.

    Raises
    ------
    ValueError
        If the accuracy does not lie in (0, 1).
    InputError, SolverError
        As `solve`.
    """
    if not 0.0 < accuracy < 1.0:
        raise ValueError(f"the accuracy lies between 0 and 1, got {accuracy}")
    case = Case.of(case)
    method = case.method.model_copy(update={"name": "semismooth-newton", "rule": None, "start": "zero"})
    case = case.model_copy(update={"method": method})
    comm = comm if comm is not None else petsc().COMM_WORLD
    began = time.perf_counter()
    outline = case.geometry.outline()
    check_compatible(case, outline)
    body = Body.of(case, outline)
    first = first_rung(accuracy)
    # the second rung is cheap and places the transition points well enough for every other one
    climbed, differences, estimate = [0], list[float](), math.inf
    levels = [solve_level(case, body, LADDER[0], None, comm, monitor)]
    for k in [*range(1, min(2, first - 1)), *range(max(1, first - 1), len(LADDER))]:
        if levels[-1].solution.status == "failed" or (estimate <= accuracy and climbed[-1] >= first):
            break
        levels.append(solve_level(case, body, LADDER[k], levels[-1], comm, monitor))
        climbed.append(k)
        differences.append(relative_difference(levels[-1].lines, levels[-2].lines))
        estimate = estimated_error(differences, climbed)
    return _finished(body, levels, accuracy, estimate, differences, time.perf_counter() - began)


def estimated_error(differences: list[float], climbed: list[int]) -> float:
    """Error of the last rung from the differences of all rungs climbed.

    The last difference is the error of the last rung but one. What the ladder gains in the last step is known from
    its typical errors, raised to the power at which the steps before were slower than they should have been. As long as
    there were none that power is UNTRIED, and nothing better than the rung's typical error is claimed.
    """
    errors = np.log([LADDER[k].error for k in climbed])
    pace = UNTRIED
    if len(differences) > 1 and differences[-1] > 0.0:
        seen = np.log(differences[-1] / differences[-2]) / (errors[-2] - errors[-3])
        pace = float(np.clip(seen, 0.25, 1.0)) if seen < 0.8 else 1.0
    estimate = float(differences[-1] * np.exp(pace * (errors[-1] - errors[-2])))
    return max(estimate, LADDER[climbed[-1]].error) if len(differences) == 1 else estimate


@dataclass(frozen=True)
class Level:
    """A rung solved: the solution, and u_t and σ_t along each contact side."""

    solution: Solution
    operators: BoundaryOperators
    lines: list[ContactLine]


def solve_level(
    case: Case,
    body: Body,
    rung: Rung,
    previous: Level | None,
    comm: Any,
    monitor: Monitor | None,
) -> Level:
    """Mesh for a rung and what the previous level showed, and its solution."""
    began = time.perf_counter()
    marks = marks_for(body, rung.grading, rung.resolved, previous.lines if previous is not None else None)
    largest = [
        side.length / FIRST_LOOK if contact and previous is None else np.inf
        for side, contact in zip(body.outline.sides, body.contact, strict=True)
    ]
    mesh, side_of_element = graded_mesh(body.outline, marks, rung.grading, largest)
    operators = BoundaryOperators(mesh, evaluate_boundary(case, mesh), kernel_for(mesh, case.material))
    prepared = prepare_operators(operators, case, comm, {"mesh": time.perf_counter() - began})
    try:
        start = None if previous is None else carried_over(previous.solution.contact, mesh, operators.data.contact_nodes)
        solution = run(prepared, case, start=start, monitor=monitor, probe=False)
    finally:
        prepared.close()
    return Level(solution, operators, contact_lines(body, solution, side_of_element))


def contact_lines(body: Body, solution: Solution, side_of_element: Index) -> list[ContactLine]:
    """u_t and σ_t along each contact side of a solution."""
    mesh, contact = solution.mesh, solution.contact
    element = mesh.element[contact.nodes]
    sign = np.where(contact.state == 1, -np.sign(contact.sigma_t[:, 0]), 0.0).astype(np.int64)
    lines = []
    for k in np.flatnonzero(body.contact):
        chosen = side_of_element[element] == k
        # without friction there are no transitions: one zone, whatever the sign of u_t
        free = chosen & (contact.friction_bound == 0.0)
        sign[free] = 1 if contact.u_t[free, 0].sum() >= 0.0 else -1
        mine = np.flatnonzero(side_of_element == k)
        offset = mesh.side_start[mine[0]]
        breaks = np.append(mesh.side_start[mine], mesh.side_start[mine[-1]] + mesh.length[mine[-1]]) - offset
        lines.append(ContactLine(
            contact.arc_length[chosen] - offset, contact.weight[chosen], element[chosen], breaks,
            contact.u_t[chosen, 0], contact.sigma_t[chosen, 0], contact.friction_bound[chosen],
            without_specks(sign[chosen], element[chosen]),
        ))  # fmt: skip
    return lines


def transition_zones(body: Body, level: Level) -> list[Zone]:
    """Zones of a level with their ends at the estimated transition points, by arc length along the part."""
    zones: list[Zone] = []
    offset: dict[str, float] = {}
    lines = iter(level.lines)
    for side, contact in zip(body.outline.sides, body.contact, strict=True):
        start = offset.get(side.part, 0.0)
        offset[side.part] = start + side.length
        if not contact:
            continue
        line = next(lines)
        ends = [0.0, *sorted(min(max(transition(line, cut), 0.0), side.length) for cut in line.cuts), side.length]
        for zone, a, b in zip(line.zones(), ends[:-1], ends[1:], strict=True):
            sign = int(line.sign[zone.start])
            if zones and zones[-1].part == side.part and zones[-1].sign == sign and zones[-1].end == start + a:
                a = zones.pop().start - start
            zones.append(Zone(side.part, start + a, start + b, sign))
    return zones


def _finished(
    body: Body, levels: list[Level], accuracy: float, estimate: float, differences: list[float], seconds: float
) -> Solution:
    solution = probed(levels[-1].solution, levels[-1].operators)
    info = {
        **solution.info,
        "accuracy": accuracy,
        "estimated_error": estimate,
        "levels": [level.solution.mesh.n_elements for level in levels],
        "differences": differences,
    }
    status, reason = solution.status, solution.reason
    if status == "converged" and estimate > accuracy:
        status, reason = "not converged", f"estimated error {estimate:.1e} > {accuracy:g} on the finest mesh"
    timings: dict[str, float] = {}
    for level in levels:
        for name, value in level.solution.timings.items():
            timings[name] = timings.get(name, 0.0) + value
    timings["adapt"] = max(0.0, seconds - sum(timings.values()))
    return replace(
        solution, info=info, status=status, reason=reason, timings=timings, zones=transition_zones(body, levels[-1])
    )
