"""The closing lines of a solve, within 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import ONE_BODY
from ...refinement.zones import Zone
from ...runtime.terminal import printable
from ..data import SolutionData
from ..report import Accuracy, Finding
from .peaks import peak_lines
from .steps import step_lines, wear_lines
from .text import digits, vector, wrapped

DENSE = "condensed, dense"
"""What bodies are stored as where nothing else is asked for or chosen, which goes without saying
where there are several."""
SHOWN = 6
"""Steps that the verdict shows: the first ones and the last."""


def verdict(solution: SolutionData) -> str:
    """How a solve ended: status, sizes, what the contact does, error, time by stage.

    Of the paper's problem, one body in bilateral contact, the contact is described by its zones;
    else by resultants, closed part, slip and energy of each interface at the end of each step.
    Without contact: reactions and the largest displacement.
    """
    title = printable(solution.problem.title)
    lines = [title] if title else []
    lines += _zones_and_forces(solution) if solution.kind == "bilateral" else _steps(solution)
    lines += peak_lines(solution) if solution.steps or solution.kind == "bilateral" else []
    lines += wrapped(
        "  time [s]: ", [f"{name} {seconds:.3f}" for name, seconds in solution.timings.items()]
    )
    if solution.provenance.peak_memory:
        lines.append(f"  peak memory: {solution.provenance.peak_memory / 1e9:.2f} GB")
    return "\n".join(lines)


def _size(mesh: BoundaryMesh) -> str:
    low, high = int(mesh.order.min()), int(mesh.order.max())
    return (
        f"{mesh.n_elements} elements of order {low if low == high else f'{low}-{high}'}, "
        f"{mesh.x.size} unknowns"
    )


def _free(solution: SolutionData, body: str) -> str:
    free = solution.provenance.motions.get(body, 0)
    return f", {free} motion{'s' if free > 1 else ''} held by contact only" if free else ""


def _warnings(solution: SolutionData) -> list[str]:
    texts = alike([each for each in solution.findings if each.severity == "warning"])
    return [line for text in texts for line in wrapped("  warning: ", [text], separator=" ")]


def alike(findings: Sequence[Finding]) -> list[str]:
    """Findings in words; what is found at several interfaces is said once.

    >>> alike([Finding("sag", "warning", "facets", f"pair {name!r}") for name in "ab"])
    ["pairs 'a', 'b': facets"]
    """
    places: dict[tuple[str, bool], list[str]] = {}
    for each in findings:
        of_pair = each.where.startswith("pair ")
        text = str(replace(each, where="") if of_pair else each)
        places.setdefault((text, of_pair), []).append(each.where.removeprefix("pair "))
    return [
        f"pair{'s' if len(names) > 1 else ''} {', '.join(names)}: {text}" if of_pair else text
        for (text, of_pair), names in places.items()
    ]


def _steps(solution: SolutionData) -> list[str]:
    """Status, bodies, and each step by its last increment."""
    lines = wrapped(f"  {solution.status}: ", [solution.reason], separator=" ")
    for name, mesh in solution.meshes.items():
        label = "" if name == ONE_BODY else f"body {printable(name)}: "
        lines.append(f"  {label}{_size(mesh)}{_free(solution, name)}")
    if (solver := solution.provenance.solver) not in ("", DENSE):
        lines += wrapped("  ", [solver], separator=" ")
    tried = solution.tried
    ends = [k for k, step in enumerate(tried) if step.load_factor == 1.0 or k == len(tried) - 1]
    shown = ends if len(ends) <= SHOWN else [*ends[: SHOWN - 1], ends[-1]]
    for before, k in zip([-1, *ends[:-1]], ends, strict=True):
        if k in shown:
            lines += step_lines(tried[before + 1 : k + 1])
        elif k == ends[SHOWN - 1]:
            lines.append(f"  ... {len(ends) - SHOWN} more steps ...")
    if solution.wear is not None:
        lines += wear_lines(solution.wear, solution.pairs)
    if not solution.nodes:
        lines += _displaced(solution)
    lines += _warnings(solution)
    return [*lines, *_accuracy(solution), *_path(solution.accuracy.path)]


def _path(error: float) -> list[str]:
    """The error that the increments leave in p and q, where they leave one."""
    if np.isnan(error):
        return ["  error of the path not known: other increments are not solved"]
    line = f"  error of the path: {error:.1e} of p, against another number of increments"
    return [line] * bool(error > 0.0)


def _zones_and_forces(solution: SolutionData) -> list[str]:
    """Status, method, zones, forces and error of one body in bilateral contact."""
    contact, accuracy = solution.contact, solution.accuracy
    lines = [f"  {solution.status}: {solution.reason}"]
    size = f"{_size(solution.mesh)}, {len(contact.nodes)} contact nodes"
    lines += [f"  {size}{_free(solution, next(iter(solution.meshes)))}", f"  {_method(solution)}"]
    lines.append(
        "  " + ": ".join(filter(None, (solution.provenance.solver, solution.provenance.ksp_reason)))
    )
    for part in dict.fromkeys(zone.part for zone in solution.zones):
        lines += wrapped(f"  {printable(part)}: ", _zones(solution, part))
    lines += [*_slip_areas(solution), *_forces(solution), *_warnings(solution)]
    lines += _accuracy(solution)
    peak = accuracy.largest_slip
    if np.isnan(peak):  # without squares, which may overflow
        peak = np.hypot.reduce(contact.u_t, axis=1).max()
    # the error is one in the mean over Γ_C: the largest value may be some times less certain
    count = 6 if accuracy.wanted is None else digits(10.0 * accuracy.error, 1.0)
    lines.append(
        f"  max |u_t| {peak:.{count}g}, |R_rho| {solution.residual:.2e}, elastic residual "
        f"{solution.elastic_residual:.1e}"
    )
    return lines


def _forces(solution: SolutionData) -> list[str]:
    """Resultants on the parts that hold the body, and how much of the contact pulls."""
    unit = solution.problem.units.stress_times(next(iter(solution.meshes.values())).weight_power)
    held = {
        condition.part
        for condition in solution.problem.body[0].boundary
        if condition.condition != "traction"
    }
    forces = [
        f"{printable(name)} {vector(force, 5)}"
        for name, force in solution.reactions().items()
        if name in held
    ]
    lines = wrapped(f"  forces [{printable(unit)}]: " if unit else "  forces: ", forces)
    if solution.tension_share > 0.0:
        lines.append(
            f"  tension on {100.0 * solution.tension_share:.3g} % of the contact, which a "
            f"bilateral one transmits"
        )
    return lines


def _displaced(solution: SolutionData) -> list[str]:
    """Of each body its largest displacement, and the resultants on the parts that hold it, after
    the last increment."""
    units, lines, power = (
        solution.problem.units,
        list[str](),
        next(iter(solution.meshes.values())).weight_power,
    )
    length, unit = (
        f" {printable(text)}" if text else "" for text in (units.length, units.stress_times(power))
    )
    for body in solution.problem.body:
        mesh, u = solution.meshes[body.name], solution.bodies[body.name].u
        size, traction = np.linalg.norm(u, axis=1), solution.bodies[body.name].traction
        name, most = f"  {printable(body.name)}: ", int(np.argmax(size))
        items = [f"max |u| {size[most]:.6g}{length} at {vector(mesh.x[most], 4)}"]
        for part in (c.part for c in body.boundary if c.condition != "traction"):
            nodes = mesh.nodes_of(part)
            force = vector(mesh.weight[nodes] @ traction[nodes], 5)
            items.append(f"{printable(part)} held by {force}{unit}")
        lines += wrapped(name, items)
    return lines


def _slip_areas(solution: SolutionData) -> list[str]:
    """How much of contact parts without zones slips."""
    contact, zoned = solution.contact, {zone.part for zone in solution.zones}
    lines = []
    for part in dict.fromkeys(contact.part.tolist()):
        mine = contact.part == part
        area, slips = contact.weight[mine].sum(), contact.weight[mine & (contact.state == 1)].sum()
        if part not in zoned:
            lines.append(f"  {printable(part)}: slip on {slips:.6g} of {area:.6g}")
    return lines


def _accuracy(solution: SolutionData) -> list[str]:
    """The relative error, L2 on the contact parts, and what was wanted; or why it is not known."""
    accuracy = solution.accuracy
    what = {"bilateral": "u_t", "elastic": "u"}.get(solution.kind, "p and q")
    if accuracy.unknown:
        return wrapped(f"  error of {what} not known: ", [accuracy.unknown], separator=" ")
    if not accuracy.is_known:
        adaptive = accuracy.wanted is not None
        return [f"  error of {what} not known: contact carries nothing"] * adaptive
    wanted = "" if accuracy.wanted is None else f", {accuracy.wanted:.1e} wanted"
    if not np.isfinite(accuracy.error):
        return [f"  error of {what} not known: too few meshes are solved; {wanted[2:]}"]
    error, elements = (
        f"  error of {what}: {accuracy.error:.1e} estimated",
        map(str, accuracy.elements),
    )
    if not np.isnan(accuracy.resultants):  # on surfaces
        lines = [f"{error} in L2, of resultants {accuracy.resultants:.1e}{wanted}"]
        return [*lines, *(wrapped("  elements: ", [*elements]) if wanted else [])]
    if not wanted:
        return [f"{error}, against half as many elements", *_ends(accuracy)]
    meshes = [", ".join(elements)]
    return [*wrapped(f"{error}{wanted}; elements ", meshes, separator=" "), *_ends(accuracy)]


def _ends(accuracy: Accuracy) -> list[str]:
    """The error with the ends of parts, which that above leaves out, and where tractions are
    singular."""
    if np.isnan(accuracy.with_ends):
        return []
    line = f"  with the ends of parts {accuracy.with_ends:.1e}"
    places = [
        f"{printable(name)} at s = {', '.join(f'{s:.5g}' for s in at)}"
        for name, at in accuracy.singular.items()
    ]
    return wrapped(f"{line}; tractions are singular: ", places) if places else [line]


def _method(solution: SolutionData) -> str:
    method, history = solution.problem.method, solution.history
    name = solution.provenance.method or method.resolved_name
    iterations = f"{solution.iterations} iteration{'s' if solution.iterations != 1 else ''}"
    if name != "projection" or not history.rho:
        return f"{name}: {iterations}"
    rule = solution.provenance.rule or method.rule or "modified"
    return f"{name}, rule {rule}: {iterations}, rho {history.rho[0]:.6g} -> {solution.rho:.6g}"


def _zones(solution: SolutionData, part: str) -> list[str]:
    """Zones of a part, their ends with the digits that two meshes agree on, or that one mesh
    resolves."""
    errors = solution.accuracy.zone_errors or [(0.0, 0.0)] * len(solution.zones)
    return [
        _zone(zone, *pair)
        for zone, pair in zip(solution.zones, errors, strict=True)
        if zone.part == part
    ]


def _zone(zone: Zone, start_error: float, end_error: float) -> str:
    sign = {0: "", 1: " +", -1: " -"}[zone.sign]
    start, end = (
        f"{at:.{digits(error, at)}g}"
        for at, error in ((zone.start, start_error), (zone.end, end_error))
    )
    return f"{zone.name}{sign} {start} .. {end}"
