"""The closing lines of a solve, within 80 columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ..arrays import Array
from ..refinement.zones import Zone
from ..runtime.terminal import printable
from .solution import Solution


def verdict(solution: Solution) -> str:
    """How a solve ended: status, size, method, KSP, zones, residuals, time by stage."""
    case, mesh, contact = solution.case, solution.mesh, solution.contact
    orders = [int(order) for order in np.unique(mesh.order)]
    order = str(orders[0]) if len(orders) == 1 else f"{orders[0]}-{orders[-1]}"
    lines = [printable(case.title)] if case.title else []
    lines.append(f"  {solution.status}: {solution.reason}")
    lines.append(
        f"  {mesh.n_elements} elements of order {order}, {mesh.x.size} unknowns, {len(contact.nodes)} contact nodes"
    )
    lines.append(f"  {_method(solution)}")
    lines.append("  " + ": ".join(filter(None, (solution.info.get("solver", ""), solution.info.get("ksp_reason", "")))))
    for part in dict.fromkeys(zone.part for zone in solution.zones):
        lines += wrapped(f"  {printable(part)}: ", _zones(solution, part))
    lines += _slip_areas(solution)
    lines += _forces(solution)
    if "estimated_error" in solution.info:
        lines.append(_accuracy(solution))
    peak = solution.info.get("largest_slip", np.sqrt(np.sum(contact.u_t**2, axis=1)).max())
    # the error is one in the mean over Γ_C: the largest value may be some times less certain
    digits = _digits(10.0 * solution.info["estimated_error"], 1.0) if "accuracy" in solution.info else 6
    lines.append(
        f"  max |u_t| {peak:.{digits}g}, |R_rho| {solution.residual:.2e}, elastic residual {solution.elastic_residual:.1e}"
    )
    return "\n".join([*lines, *cost(solution.timings, solution.info)])


def cost(timings: Mapping[str, float], info: Mapping[str, Any]) -> list[str]:
    """Lines for time by stage, and for the largest memory of all ranks together."""
    lines = wrapped("  time [s]: ", [f"{name} {seconds:.3f}" for name, seconds in timings.items()])
    if "peak_memory" in info:
        lines.append(f"  peak memory: {info['peak_memory'] / 1e9:.2f} GB")
    return lines


def _forces(solution: Solution) -> list[str]:
    """Resultants on the parts that hold the body, and how much of the contact pulls."""
    case, unit = solution.case, solution.case.units.force
    held = {condition.part for condition in case.boundary if condition.condition != "traction"}
    forces = [f"{printable(name)} {_vector(force)}" for name, force in solution.reactions().items() if name in held]
    lines = wrapped(f"  forces [{printable(unit)}]: " if unit else "  forces: ", forces)
    if solution.tension_share > 0.0:
        lines.append(f"  tension on {100.0 * solution.tension_share:.3g} % of the contact, which a bilateral one transmits")
    return lines


def _slip_areas(solution: Solution) -> list[str]:
    """How much of contact parts without zones slips."""
    contact, zoned = solution.contact, {zone.part for zone in solution.zones}
    lines = []
    for part in dict.fromkeys(contact.part.tolist()):
        mine = contact.part == part
        area, slips = contact.weight[mine].sum(), contact.weight[mine & (contact.state == 1)].sum()
        if part not in zoned:
            lines.append(f"  {printable(part)}: slip on {slips:.6g} of {area:.6g}")
    return lines


def _vector(values: Array) -> str:
    return "(" + ", ".join(f"{value:.5g}" for value in values) + ")"


def _accuracy(solution: Solution) -> str:
    """What is estimated and, of an adaptive solve, what was wanted; relative, L2 on the contact parts."""
    info = solution.info
    if "accuracy" not in info:
        return f"  error of u_t: {info['estimated_error']:.1e} estimated, against half as many elements"
    meshes = ", ".join(str(count) for count in info["levels"])
    return (
        f"  error of u_t: {info['estimated_error']:.1e} estimated, {info['accuracy']:.1e} wanted; "
        f"elements {meshes}"
    )


def _method(solution: Solution) -> str:
    method, history = solution.case.method, solution.history
    name = solution.info.get("method", method.resolved_name)
    iterations = f"{solution.iterations} iteration{'s' if solution.iterations != 1 else ''}"
    if name != "projection" or not history.rho:
        return f"{name}: {iterations}"
    rule = solution.info.get("rule", method.rule or "modified")
    return f"{name}, rule {rule}: {iterations}, rho {history.rho[0]:.6g} -> {solution.rho:.6g}"


def _zones(solution: Solution, part: str) -> list[str]:
    """Zones of a part, their ends with the digits that two meshes agree on, or that one mesh resolves."""
    errors = solution.info.get("zone_errors") or [(0.0, 0.0)] * len(solution.zones)
    return [_zone(zone, *pair) for zone, pair in zip(solution.zones, errors, strict=True) if zone.part == part]


def _zone(zone: Zone, start_error: float, end_error: float) -> str:
    sign = {0: "", 1: " +", -1: " -"}[zone.sign]
    start, end = (f"{at:.{_digits(error, at)}g}" for at, error in ((zone.start, start_error), (zone.end, end_error)))
    return f"{zone.name}{sign} {start} .. {end}"


def _digits(error: float, value: float) -> int:
    """Significant digits of a value whose error is known, 1 to 7."""
    if not error > 0.0 or value == 0.0:
        return 7
    return int(np.clip(np.floor(np.log10(abs(value) / error)) + 1.0, 1, 7)) if np.isfinite(error) else 1


def wrapped(head: str, items: list[str], width: int = 80, separator: str = ",") -> list[str]:
    """Items joined by commas, or words (separator " "), broken into lines that are indented under the first."""
    if separator == " ":
        items = " ".join(items).split()
    lines, line = [], head
    for k, item in enumerate(items):
        text = item + (separator.strip() if k < len(items) - 1 else "")
        if len(line) + len(text) + 1 > width and line.strip() and line != head:
            lines.append(line.rstrip())
            line = " " * len(head)
        line += text + " "
    return [*lines, line.rstrip()]
