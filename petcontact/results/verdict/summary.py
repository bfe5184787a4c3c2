"""The closing lines of a solve, within 80 columns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ...fields.boundary.places import sizes
from ...mesh.curve_mesh import as_curve
from ...model.problem import ONE_BODY
from ...refinement.zones import Zone
from ...round_off import SOLVED
from ...runtime.terminal import printable
from ..data import SolutionData
from ..report import Accuracy, Finding
from .peaks import peak_lines
from .steps import Teller, law_words, step_lines, wear_lines
from .text import digits, wrapped

SHOWN = 6
"""Steps that the verdict shows: the first ones and the last."""


def verdict(solution: SolutionData, verbose: bool = False) -> str:
    """How a solve ended, within 80 columns: status and title, warnings, what contact does and the
    largest stresses, each with its error; residuals and times.

    Parameters
    ----------
    solution : SolutionData
    verbose : bool
        Also meshes, methods, moments, what acts on primaries, and times by stage.
    """
    title = printable(solution.problem.title)
    tell = Teller(solution, verbose)
    lines = wrapped(f"{solution.status}: ", [title], separator=" ") if title else [solution.status]
    said, _, notes = solution.reason.partition("; ")
    # the reason of a solution that is accepted are its residuals, and notes
    why = notes if solution.converged else solution.reason
    lines += wrapped("  ", [why], separator=" ") if why else []
    for text in alike([each for each in solution.findings if each.severity == "warning"]):
        lines += wrapped("  warning: ", [text], separator=" ")
    lines += _sizes(solution) if verbose else []
    lines += (_zones_and_forces if solution.kind == "bilateral" else _steps)(tell)
    lines += peak_lines(tell)
    lines += [*_accuracy(solution), *_path(solution.accuracy.path)]
    lines += _residuals(solution, said if solution.converged else "")
    return "\n".join([*lines, *_times(solution, verbose)])


def _residuals(solution: SolutionData, said: str) -> list[str]:
    """What equations and laws leave over, and of the paper's problem how the method ended."""
    items = said.split(", ") if said else []
    if solution.kind == "bilateral":
        items += [_method(solution), f"|R_rho| {solution.last.residual:.2e}"]
        items.append(f"elastic residual {solution.last.residuals['elastic']:.1e}")
    return wrapped("  ", items)


def _times(solution: SolutionData, verbose: bool) -> list[str]:
    seconds, memory = solution.timings, solution.provenance.peak_memory
    items = [f"{sum(seconds.values()):.2f}"]
    if verbose:
        items = [f"{name} {value:.3f}" for name, value in seconds.items()]
    items += [f"peak memory {memory / 1e9:.2f} GB"] * bool(memory)
    return wrapped("  time [s]: ", items)


def _sizes(solution: SolutionData) -> list[str]:
    """Meshes, how bodies are stored, and why the Krylov solver ended."""
    lines = list[str]()
    for name, mesh in solution.meshes.items():
        label = "" if name == ONE_BODY else f"body {printable(name)}: "
        low, high = int(mesh.order.min()), int(mesh.order.max())
        order = low if low == high else f"{low}-{high}"
        size = f"{mesh.n_elements} elements of order {order}, {mesh.x.size} unknowns"
        free = solution.provenance.motions.get(name, 0)
        held = f"{free} motion{'s' if free > 1 else ''} held by contact only"
        lines += wrapped(f"  {label}", [size, *[held] * bool(free)])
    if solution.kind == "bilateral":
        lines.append(f"  {len(solution.contact.nodes)} contact nodes")
    provenance = solution.provenance
    solver = ": ".join(filter(None, (provenance.solver, provenance.ksp_reason)))
    return [*lines, *(wrapped("  ", [solver], separator=" ") if solver else [])]


def alike(findings: Sequence[Finding]) -> list[str]:
    """Findings in words; what is found at several interfaces is said once, and of what is found in
    several steps the worst.

    >>> alike([Finding("sag", "warning", "facets", f"pair {name!r}") for name in "ab"])
    ["pairs 'a', 'b': facets"]
    >>> alike([Finding("slip", "warning", f"by {k}", f"step '{k}'", measured=k) for k in (2, 7, 3)])
    ["3 steps, the worst is step '7': by 7"]
    """
    places: dict[tuple[str, str], list[Finding]] = {}
    for each in findings:
        noun = each.where.partition(" ")[0]
        text = (
            each.kind
            if noun == "step"
            else str(replace(each, where="") if noun == "pair" else each)
        )
        places.setdefault((text, noun), []).append(each)
    return [_together(text, noun, some) for (text, noun), some in places.items()]


def _together(text: str, noun: str, findings: Sequence[Finding]) -> str:
    """Findings at places of one kind in words, all with one text or in steps."""
    several = len(findings) > 1
    if noun == "step":
        worst = max(findings, key=lambda each: np.nan_to_num(each.measured))
        return f"{len(findings)} steps, the worst is {worst}" if several else str(worst)
    names = ", ".join(each.where.removeprefix("pair ") for each in findings)
    return f"pair{'s' if several else ''} {names}: {text}" if noun == "pair" else text


def _steps(tell: Teller) -> list[str]:
    """Each step by its last increment, wear, and bodies that touch nothing."""
    solution, lines = tell.solution, list[str]()
    tried = solution.tried
    ends = [k for k, step in enumerate(tried) if step.load_factor == 1.0 or k == len(tried) - 1]
    shown = ends if len(ends) <= SHOWN else [*ends[: SHOWN - 1], ends[-1]]
    for before, k in zip([-1, *ends[:-1]], ends, strict=True):
        if k in shown:
            lines += step_lines(tell, tried[before + 1 : k + 1], laws=k == ends[0])
        elif k == ends[SHOWN - 1]:
            lines.append(f"  ... {len(ends) - SHOWN} more steps ...")
    if solution.wear is not None:
        lines += wear_lines(solution.wear, solution.pairs)
    return lines if solution.nodes else [*lines, *_displaced(tell)]


def _path(error: float) -> list[str]:
    """The error that the increments leave in p and q, where they leave one."""
    if np.isnan(error):
        return ["  error of the path not known: compare with more increments"]
    line = f"  error of the path: {error:.1e} of p, against another number of increments"
    return [line] * bool(error > SOLVED)


def _zones_and_forces(tell: Teller) -> list[str]:
    """Of one body in bilateral contact: law, zones, forces and slip of each part."""
    solution, step, lines = tell.solution, tell.solution.last, list[str]()
    for posed in solution.problem.interfaces:
        if posed.name not in step.pairs:
            continue
        part, pair = posed.part, step.pairs[posed.name]
        lines += wrapped(f"  {printable(part)}: ", law_words(posed))
        lines += wrapped("    ", zones) if (zones := _zones(solution, part)) else []
        area = float(pair.weight.sum())
        words = {"force": "force", "largest slip": "largest |u_t|"}
        words |= {} if zones else {"slipping": "slip on"}
        words |= (
            {"dissipated energy": "dissipated energy", "moment": "moment"} if tell.verbose else {}
        )
        items = list(tell.items(step, posed.name, words))
        lines += wrapped(
            "    ",
            [f"{each} of {area:.5g}" if each.startswith("slip on") else each for each in items],
        )
    lines += _held(tell)
    if solution.tension_share > 0.0:
        lines.append(
            f"  the contact pulls on {100.0 * solution.tension_share:.3g} % of it: bilateral "
            f"contact cannot open"
        )
    return lines


def _held(tell: Teller) -> list[str]:
    """What holds the parts of bodies beside their contacts."""
    lines = list[str]()
    for number in tell.numbers.values():
        what, on, part = number.name.partition(" on ")
        if what in HELD and on:
            part = printable(part)
            name = part if number.of == ONE_BODY else f"{printable(number.of)}.{part}"
            lines += wrapped(f"  {name}: ", [f"{HELD[what]} {tell.number(number)}"])
    return lines


HELD = {"force": "held by", "moment": "held by the moment"}
"""What holds a part, in words."""


def _displaced(tell: Teller) -> list[str]:
    """Of each body its largest displacement, and what holds it, after the last increment."""
    lines = list[str]()
    for number in tell.numbers.values():
        if number.name == "largest displacement":
            lines += wrapped(f"  {printable(number.of)}: ", [f"max |u| {tell.number(number)}"])
    return [*lines, *_held(tell)]


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
    method, history = solution.problem.method, solution.last.history
    name = solution.provenance.method or method.resolved_name
    iterations = f"{solution.iterations} iteration{'s' if solution.iterations != 1 else ''}"
    if name != "projection" or not history.rho:
        return f"{name}: {iterations}"
    rule = solution.provenance.rule or method.rule or "modified"
    return f"{name}, rule {rule}: {iterations}, rho {history.rho[0]:.6g} -> {solution.last.rho:.6g}"


def _zones(solution: SolutionData, part: str) -> list[str]:
    """Zones of a part, their ends with the digits that two meshes agree on, or that the elements
    resolve in the middle of which they may lie."""

    def half(at: float) -> float:
        mesh = as_curve(solution.meshes[solution.sides[part][0]])
        nodes = mesh.nodes_of(part)
        nearest = nodes[np.argmin(np.abs(mesh.arc_length[nodes] - at))]
        return float(sizes(mesh)[mesh.element[nearest]])

    errors = solution.accuracy.zone_errors
    errors = errors or [(half(zone.start), half(zone.end)) for zone in solution.zones]
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
