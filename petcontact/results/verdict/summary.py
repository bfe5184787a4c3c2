"""The closing lines of a solve, within 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...mesh.boundary_mesh import BoundaryMesh
from ...model.problem import ONE_BODY
from ...refinement.zones import Zone
from ...runtime.terminal import printable
from ..data import SolutionData
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
    if "peak_memory" in solution.info:
        lines.append(f"  peak memory: {solution.info['peak_memory'] / 1e9:.2f} GB")
    return "\n".join(lines)


def _size(mesh: BoundaryMesh) -> str:
    low, high = int(mesh.order.min()), int(mesh.order.max())
    return (
        f"{mesh.n_elements} elements of order {low if low == high else f'{low}-{high}'}, "
        f"{mesh.x.size} unknowns"
    )


def _free(solution: SolutionData, body: str) -> str:
    free = solution.info.get("motions", {}).get(body, 0)
    return f", {free} motion{'s' if free > 1 else ''} held by contact only" if free else ""


def _warnings(solution: SolutionData) -> list[str]:
    texts = of_several_pairs(solution.info.get("warnings", []))
    return [line for text in texts for line in wrapped("  warning: ", [text], separator=" ")]


def of_several_pairs(warnings: Sequence[str]) -> list[str]:
    """Warnings, those that several pairs have alike as one.

    >>> of_several_pairs(["pair 'a': facets", "pair 'b': facets", "pair 'b': a gap", "turns"])
    ["pairs 'a', 'b': facets", "pair 'b': a gap", 'turns']
    """
    names: dict[str, list[str]] = {}
    for text in warnings:
        pair, colon, rest = text.partition(": ") if text.startswith("pair '") else ("", "", text)
        names.setdefault(f"{colon}{rest}", []).append(pair.removeprefix("pair "))
    return [
        f"pair{'s' if len(each) > 1 else ''} {', '.join(each)}{text}" if each[0] else text
        for text, each in names.items()
    ]


def _steps(solution: SolutionData) -> list[str]:
    """Status, bodies, and each step by its last increment."""
    lines = wrapped(f"  {solution.status}: ", [solution.reason], separator=" ")
    for name, mesh in solution.meshes.items():
        label = "" if name == ONE_BODY else f"body {printable(name)}: "
        lines.append(f"  {label}{_size(mesh)}{_free(solution, name)}")
    if (solver := solution.info.get("solver", DENSE)) not in ("", DENSE):
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
    return [*lines, *_accuracy(solution)]


def _zones_and_forces(solution: SolutionData) -> list[str]:
    """Status, method, zones, forces and error of one body in bilateral contact."""
    contact, info = solution.contact, solution.info
    lines = [f"  {solution.status}: {solution.reason}"]
    size = f"{_size(solution.mesh)}, {len(contact.nodes)} contact nodes"
    lines += [f"  {size}{_free(solution, next(iter(solution.meshes)))}", f"  {_method(solution)}"]
    lines.append(
        "  " + ": ".join(filter(None, (info.get("solver", ""), info.get("ksp_reason", ""))))
    )
    for part in dict.fromkeys(zone.part for zone in solution.zones):
        lines += wrapped(f"  {printable(part)}: ", _zones(solution, part))
    lines += [*_slip_areas(solution), *_forces(solution), *_warnings(solution)]
    lines += _accuracy(solution)
    peak = info.get(
        "largest_slip", np.hypot.reduce(contact.u_t, axis=1).max()
    )  # without squares, which may overflow
    # the error is one in the mean over Γ_C: the largest value may be some times less certain
    count = digits(10.0 * info["estimated_error"], 1.0) if "accuracy" in info else 6
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
    info, what = (
        solution.info,
        "u_t" if solution.kind == "bilateral" else "p and q" if solution.nodes else "u",
    )
    if "error_unknown" in info:
        return wrapped(f"  error of {what} not known: ", [info["error_unknown"]], separator=" ")
    if "estimated_error" not in info:
        return [f"  error of {what} not known: contact carries nothing"] * ("accuracy" in info)
    if not np.isfinite(info["estimated_error"]):
        return [
            f"  error of {what} not known: too few meshes are solved; {info['accuracy']:.1e} wanted"
        ]
    error = f"  error of {what}: {info['estimated_error']:.1e} estimated"
    if "resultant_error" in info:
        error += f" in L2, of resultants {info['resultant_error']:.1e}"
        if "accuracy" not in info:
            return [error]
        elements = wrapped("  elements: ", [str(count) for count in info["levels"]])
        return [f"{error}, {info['accuracy']:.1e} wanted", *elements]
    if "accuracy" not in info:
        return [f"{error}, against half as many elements", *_ends(info)]
    meshes = ", ".join(str(count) for count in info["levels"])
    return [
        *wrapped(f"{error}, {info['accuracy']:.1e} wanted; elements ", [meshes], separator=" "),
        *_ends(info),
    ]


def _ends(info: dict[str, Any]) -> list[str]:
    """What the error is with the ends of parts, of which that above is without, and where tractions
    are singular."""
    if "error_with_ends" not in info:
        return []
    line = f"  with the ends of parts {info['error_with_ends']:.1e}"
    places = [
        f"{printable(name)} at s = {', '.join(f'{s:.5g}' for s in at)}"
        for name, at in info["singular"].items()
    ]
    return wrapped(f"{line}; tractions are singular: ", places) if places else [line]


def _method(solution: SolutionData) -> str:
    method, history = solution.problem.method, solution.history
    name = solution.info.get("method", method.resolved_name)
    iterations = f"{solution.iterations} iteration{'s' if solution.iterations != 1 else ''}"
    if name != "projection" or not history.rho:
        return f"{name}: {iterations}"
    rule = solution.info.get("rule", method.rule or "modified")
    return f"{name}, rule {rule}: {iterations}, rho {history.rho[0]:.6g} -> {solution.rho:.6g}"


def _zones(solution: SolutionData, part: str) -> list[str]:
    """Zones of a part, their ends with the digits that two meshes agree on, or that one mesh
    resolves."""
    errors = solution.info.get("zone_errors") or [(0.0, 0.0)] * len(solution.zones)
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
