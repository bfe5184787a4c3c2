"""The closing lines of a solve, within 80 columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from ...errors import ONE_BODY
from ...round_off import SOLVED
from ...runtime.terminal import printable
from ..data import SolutionData
from ..report import Accuracy, Finding
from .largest_stresses import peak_lines
from .pairs import pair_lines
from .steps import progress_lines, reaction_lines, wear_lines
from .teller import Teller
from .text import wrapped

CHECKS = {
    "contact law": ("normal", "tangential"),
    "equilibrium": ("balance", "equilibrium"),
    "elasticity": ("elastic",),
}
"""What is checked, and the residuals of an increment that say how well it holds."""


def verdict(solution: SolutionData, verbose: bool = False) -> str:
    """How a solve ended, within 80 columns: status and title, warnings, what contact does,
    reactions and the largest displacement and stresses, each with its error; checks and times.

    Parameters
    ----------
    solution : SolutionData
    verbose : bool
        Also meshes, methods, all steps, moments, what acts on primaries, residuals and times by
        stage.
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
    lines += [*progress_lines(tell), *pair_lines(tell)]
    if solution.wear is not None:
        lines += wear_lines(tell, solution.wear)
    lines += [*reaction_lines(tell), *peak_lines(tell), *_accuracy(tell)]
    lines += _checks(tell, said if solution.converged else "")
    return "\n".join([*lines, *_times(solution, verbose)])


def _checks(tell: Teller, said: str) -> Iterator[str]:
    """How the method of the paper's problem ended, and what equations and laws leave over."""
    solution = tell.solution
    if solution.kind == "bilateral":
        yield from wrapped("  ", [_method(solution)])
    if tell.verbose and said:
        residual = [f"|R_rho| {solution.last.residual:.2e}"] * (solution.kind == "bilateral")
        yield from wrapped("  ", [*said.split(", "), *residual])
    if solution.converged and (left := list(_left(solution))):
        yield from wrapped("  checks passed: ", left)


def _left(solution: SolutionData) -> Iterator[str]:
    """The largest residuals of all increments, by what they check."""
    for what, names in CHECKS.items():
        values = [step.residuals.get(name, np.nan) for step in solution.steps for name in names]
        if not solution.nodes and what == "contact law":
            continue
        if known := [float(value) for value in values if np.isfinite(value)]:
            yield f"{what} {max(known):.1e}" if max(known) > SOLVED else f"{what} 0"


def _times(solution: SolutionData, verbose: bool) -> list[str]:
    seconds, memory = solution.timings, solution.provenance.peak_memory
    items = [f"{sum(seconds.values()):.2f}"]
    if verbose:
        items = [f"{name} {value:.3f}" for name, value in seconds.items()]
    items += [f"peak memory {memory / 1e9:.2f} GB"] * bool(memory)
    return wrapped("  time [s]: ", items)


def _sizes(solution: SolutionData) -> Iterator[str]:
    """Meshes, how bodies are stored, and why the Krylov solver ended."""
    for name, mesh in solution.meshes.items():
        label = "" if name == ONE_BODY else f"body {printable(name)}: "
        low, high = int(mesh.order.min()), int(mesh.order.max())
        order = low if low == high else f"{low}-{high}"
        size = f"{mesh.n_elements} elements of order {order}, {mesh.x.size} unknowns"
        free = solution.provenance.motions.get(name, 0)
        held = f"{free} motion{'s' if free > 1 else ''} held by contact only"
        yield from wrapped(f"  {label}", [size, *[held] * bool(free)])
    if solution.kind == "bilateral":
        yield f"  {len(solution.contact.nodes)} contact nodes"
    provenance = solution.provenance
    if solver := ": ".join(filter(None, (provenance.solver, provenance.ksp_reason))):
        yield from wrapped("  ", [solver], separator=" ")


def alike(findings: Sequence[Finding]) -> list[str]:
    """Findings in words; what is found at several interfaces is said once, and of what is found in
    several steps the worst, or the first of equal ones.

    >>> alike([Finding("sag", "warning", "facets", f"pair {name!r}") for name in "ab"])
    ["pairs 'a', 'b': facets"]
    >>> alike([Finding("slip", "warning", f"by {k}", f"step '{k}'", measured=k) for k in (2, 7, 3)])
    ["3 steps, the worst is step '7': by 7"]
    >>> alike([Finding("slip", "warning", "by 2", f"step '{k}'", measured=2) for k in (3, 7)])
    ["2 steps, the first is step '3': by 2"]
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
        which = "worst" if len({each.text for each in findings}) > 1 else "first"
        return f"{len(findings)} steps, the {which} is {worst}" if several else str(worst)
    names = ", ".join(each.where.removeprefix("pair ") for each in findings)
    return f"pair{'s' if several else ''} {names}: {text}" if noun == "pair" else text


def _accuracy(tell: Teller) -> list[str]:
    """The relative error, L2 on the contact parts, and what was wanted; or why it is not known."""
    solution, accuracy = tell.solution, tell.solution.accuracy
    what = {"bilateral": "u_t", "elastic": "u"}.get(solution.kind, "p and q")
    unknown = f"  error of {what} not known: "
    if accuracy.unknown:
        return wrapped(unknown, [accuracy.unknown], separator=" ") + _path(accuracy.path)
    if not accuracy.is_known:
        if not solution.converged and tell.numbers:
            return [f"{unknown}a solve that fails is not repeated on another mesh"]
        return [f"{unknown}contact carries nothing"] * (accuracy.wanted is not None)
    wanted = [] if accuracy.wanted is None else [f"{accuracy.wanted:.1e} wanted"]
    if not np.isfinite(accuracy.error):
        return wrapped(unknown, ["too few meshes are solved", *wanted]) + _path(accuracy.path)
    items = [f"{accuracy.error:.1e} estimated", *wanted]
    if not np.isnan(accuracy.resultants):  # on surfaces
        items.append(f"of resultants {accuracy.resultants:.1e}")
    elif not wanted:
        items.append("against half as many elements")
    if not np.isnan(accuracy.tractions):
        items.append(f"of p and q {accuracy.tractions:.1e}")
    ends = f"{accuracy.with_ends:.1e}"
    if float(ends) > float(f"{accuracy.error:.1e}"):
        items.append(f"with the ends of parts {ends}")
    lines = [*wrapped(f"  error of {what}: ", items), *_path(accuracy.path)]
    return [*lines, *_meshes(accuracy)] if tell.verbose else lines


def _path(error: float) -> list[str]:
    """The error that the increments leave in p and q, where they leave one."""
    if np.isnan(error):
        return ["  error of the path not known: compare with more increments"]
    line = f"  error of the path: {error:.1e} of p, against another number of increments"
    return [line] * bool(error > SOLVED)


def _meshes(accuracy: Accuracy) -> list[str]:
    """The meshes of an adaptive solve, and where tractions are singular."""
    places = [
        f"{printable(name)} at s = {', '.join(f'{s:.5g}' for s in at)}"
        for name, at in accuracy.singular.items()
    ]
    return [
        *(wrapped("  elements: ", [*map(str, accuracy.elements)]) if accuracy.wanted else []),
        *(wrapped("  tractions are singular: ", places) if places else []),
    ]


def _method(solution: SolutionData) -> str:
    method, history = solution.problem.method, solution.last.history
    name = solution.provenance.method or method.resolved_name
    iterations = f"{solution.iterations} iteration{'s' if solution.iterations != 1 else ''}"
    if name != "projection" or not history.rho:
        return f"{name}: {iterations}"
    rule = solution.provenance.rule or method.rule or "modified"
    return f"{name}, rule {rule}: {iterations}, rho {history.rho[0]:.6g} -> {solution.last.rho:.6g}"
