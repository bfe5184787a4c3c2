"""Adaptive solution: solve, find the transition points, refine towards them, estimate, repeat.

Meshes come from a ladder of gradings, each with an error about ten times smaller than the one before: more order and
a milder grading where the solution is smooth, smaller elements of low order at corners and transition points. The
solution of one rung places the transition points of the next one and is its start. The difference of two rungs is the
error of the lower one; it is the estimate for the upper one, which is returned. What the ladder gains in its last step
is not claimed: the pace of the steps before says little of it.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..bem.boundary_data import evaluate_boundary
from ..bem.compatibility import check_compatible
from ..bem.kernels import kernel_for
from ..bem.operators import BoundaryOperators
from ..contact.rho_rules import Rule
from ..contact.state import Monitor
from ..errors import SolverError
from ..geometry.outline import as_outline
from ..mesh.curve_mesh import as_curve
from ..model.case import Case
from ..model.problem import Problem
from ..refinement.contact_line import ContactLine, difference, largest, transition, without_specks
from ..refinement.ladder import LADDER, MOST_GAIN, Rung, believed, check_accuracy
from ..refinement.marks import Body
from ..refinement.zones import Zone
from ..results.solution import Solution
from ..runtime.petsc import petsc
from .initial_state import carried_over
from .prepare import prepare_operators
from .run import probed, run

DENSE_NODES = 2500
"""Nodes of graded meshes up to which `mat_type = "auto"` stays dense."""
LEAST_SLIP = 1e-3
"""‖u_t‖, relative to the displacement of the whole body, below which errors are relative to that."""
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
    check_accuracy(accuracy)
    method = case.method.model_copy(update={"name": "semismooth-newton", "rule": None, "start": "zero"})
    case = case.model_copy(update={"method": method})
    comm = comm if comm is not None else petsc().COMM_WORLD
    began = time.perf_counter()
    outline = as_outline(case.geometry.outline(), "--adapt").joined
    check_compatible(case, outline)
    body = Body.of(case, outline)
    differences, estimate, trouble = list[float](), math.inf, ""
    levels = [solve_level(case, body, LADDER[0], None, comm, monitor)]
    for rung in LADDER[1:]:
        if levels[-1].solution.status == "failed" or levels[-1].missed > 0.0 or estimate <= accuracy:
            break
        try:
            levels.append(solve_level(case, body, rung, levels[-1], comm, monitor))
        except SolverError as error:
            trouble = f"{error} (on the mesh after the last)"
            break
        differences.append(difference(levels[-2].lines, levels[-1].lines) / displacement_scale(levels[-1].solution))
        truncation = [body.truncation(rung.resolved) for rung in LADDER[: len(levels)]]
        estimate = estimated_error(differences, truncation)
    return _finished(body, levels, accuracy, estimate, differences, time.perf_counter() - began, trouble)


def solve_adaptively(
    case: Case, *, rule: Rule | None = None, comm: Any = None, monitor: Monitor | None = None
) -> Solution:
    """The solution of a case whose mesh is left open: `adapt` to `mesh.accuracy`, then the case's own method on that mesh.

    Raises
    ------
    InputError, SolverError
        As `solve`.
    """
    found = adapt(case, case.mesh.accuracy, comm=comm, monitor=monitor)
    if found.status == "failed" or (rule is None and case.method.resolved_name == "semismooth-newton"):
        return found
    mesh = as_curve(found.mesh)
    operators = BoundaryOperators(mesh, evaluate_boundary(case, mesh), kernel_for(mesh, case.material))
    prepared = prepare_operators(operators, case, comm if comm is not None else petsc().COMM_WORLD, dict(found.timings))
    try:
        solution = run(prepared, case, rule=rule, monitor=monitor)
    finally:
        prepared.close()
    kept = {key: found.info[key] for key in ("accuracy", "estimated_error", "levels", "differences", "largest_slip",
                                             "zone_errors")}  # fmt: skip
    status, reason = solution.status, solution.reason
    if status == "converged":
        status, reason = found.status, reason if found.status == "converged" else found.reason
    return replace(solution, info={**solution.info, **kept}, zones=found.zones, status=status, reason=reason)


def estimated_error(differences: list[float], truncation: list[float]) -> float:
    """Error of the last rung from the differences of neighbouring ones, infinite while there are fewer than two of them.

    The last difference is the error of the last rung but one, and an estimate for the last one that does not flatter.
    Two rungs may be alike by chance, or because elements at a corner are as small as they can be: no step is believed
    to gain more than MOST_GAIN, and nothing more than the sizes of elements at corners allow: errors C T_k there show as
    differences d_k = C (T_k - T_(k+1)).

    Parameters
    ----------
    differences : list of k floats
        Of rungs 0 and 1, 1 and 2, ...
    truncation : list of k + 1 floats
        T of each rung, see `Body.truncation`.
    """
    if len(differences) < 2:
        return math.inf
    least = [max(d, before / MOST_GAIN) for d, before in zip(differences, [0.0, *differences], strict=False)]
    steps = zip(least, truncation[:-1], truncation[1:], strict=True)
    # each difference bounds C, as far as its two meshes differ at corners at all
    bounds = [d / (before - after) for d, before, after in steps if before > 1.01 * after]
    left = truncation[-1] * min(bounds, default=0.0)
    return max(believed(differences), left)


def displacement_scale(solution: Solution) -> float:
    """What errors of u_t are relative to: ‖u_t‖, or U = (∫_Γ|u|²/|Γ| |Γ_C|)^½ times LEAST_SLIP if that is larger.

    Where almost all of Γ_C sticks the error relative to the slip alone would be that of nearly nothing.
    """
    mesh, contact = solution.mesh, solution.contact
    mean_square = float(mesh.weight @ np.sum(solution.u**2, axis=1)) / float(mesh.weight.sum())
    whole = math.sqrt(mean_square * float(contact.weight.sum()))
    slip = math.sqrt(float(contact.weight @ np.sum(contact.u_t**2, axis=1)))
    return max(slip, LEAST_SLIP * whole) or 1.0


@dataclass(frozen=True)
class Level:
    """A rung solved: the solution, u_t and σ_t along each contact side, and the defect of the data beyond the wanted one."""

    solution: Solution
    operators: BoundaryOperators
    lines: list[ContactLine]
    missed: float


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
    longest = [
        side.length / FIRST_LOOK if contact and previous is None else np.inf
        for side, contact in zip(body.outline.sides, body.contact, strict=True)
    ]
    made = body.mesh(rung, longest, previous.lines if previous is not None else None)
    mesh = made.mesh
    operators = BoundaryOperators(mesh, evaluate_boundary(case, mesh), kernel_for(mesh, case.material))
    if case.bem.mat_type == "auto" and mesh.n_nodes <= DENSE_NODES:
        case = case.model_copy(update={"bem": case.bem.model_copy(update={"mat_type": "dense"})})
    prepared = prepare_operators(operators, case, comm, {"mesh": time.perf_counter() - began})
    try:
        start = None if previous is None else carried_over(mesh, previous.solution.contact, operators.data.contact_nodes)
        solution = run(prepared, case, start=start, monitor=monitor, probe=False)
    finally:
        prepared.close()
    return Level(solution, operators, contact_lines(body, solution), made.missed)


def contact_lines(body: Body, solution: Solution) -> list[ContactLine]:
    """u_t and σ_t along each contact side of a solution."""
    mesh, contact = as_curve(solution.mesh), solution.contact
    ends = np.cumsum([side.length for side in body.outline.sides])
    side_of_element = np.searchsorted(ends, np.cumsum(mesh.length) - 0.5 * mesh.length)
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
            without_specks(sign[chosen], element[chosen]), body.kinks[k],
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
        # between the nodes that it parts, whatever an extrapolation says
        found = [float(np.clip(transition(line, cut), line.s[cut - 1], line.s[cut])) for cut in line.cuts]
        ends = [0.0, *found, side.length]
        for zone, a, b in zip(line.zones(), ends[:-1], ends[1:], strict=True):
            sign = int(line.sign[zone.start])
            if zones and zones[-1].part == side.part and zones[-1].sign == sign and zones[-1].end == start + a:
                a = zones.pop().start - start
            zones.append(Zone(side.part, start + a, start + b, sign))
    return zones


def zone_errors(zones: list[Zone], before: list[Zone]) -> list[tuple[float, float]]:
    """How far the ends of zones lie from the nearest ones of a coarser mesh, one pair a zone [length]."""
    def moved(part: str, at: float) -> float:
        ends = [end for zone in before if zone.part == part for end in (zone.start, zone.end)]
        return min((abs(at - end) for end in ends), default=0.0)

    return [(moved(zone.part, zone.start), moved(zone.part, zone.end)) for zone in zones]


def _finished(
    body: Body, levels: list[Level], accuracy: float, estimate: float, differences: list[float], seconds: float,
    trouble: str,
) -> Solution:
    solution = probed(levels[-1].solution, levels[-1].operators)
    zones = transition_zones(body, levels[-1])
    info = {
        **solution.info,
        "accuracy": accuracy,
        "estimated_error": estimate,
        "levels": [level.solution.mesh.n_elements for level in levels],
        "differences": differences,
        "largest_slip": largest(levels[-1].lines),
        "zone_errors": zone_errors(zones, transition_zones(body, levels[-2]) if len(levels) > 1 else []),
    }
    status, reason = solution.status, solution.reason
    if status == "converged" and levels[-1].missed > 0.0:
        status, reason = "not converged", f"no mesh resolves the given data: {levels[-1].missed:.1e} of them is missed"
    elif status == "converged" and estimate > accuracy:
        status, reason = "not converged", trouble or f"estimated error {estimate:.1e} > {accuracy:g} on the finest mesh"
    timings: dict[str, float] = {}
    for level in levels:
        for name, value in level.solution.timings.items():
            timings[name] = timings.get(name, 0.0) + value
    timings["adapt"] = max(0.0, seconds - sum(timings.values()))
    return replace(solution, info=info, status=status, reason=reason, timings=timings, zones=zones)
