"""The lines of a verdict on the largest stresses, in the bodies and on their surfaces."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...model.problem import ONE_BODY
from ...runtime.terminal import printable
from ..data import SolutionData
from ..peaks import StressPeak, stress_peaks
from .text import vector, wrapped

LISTED = 3
"""Places without a bound that are named; of more of them the number is told."""


def peak_lines(solution: SolutionData) -> list[str]:
    """The largest von Mises and first principal stress, inside and on the surface, and where stress
    has no bound."""
    unit = solution.problem.units.stress
    lines, unbounded = list[str](), dict[str, None]()
    for name, peaks in stress_peaks(solution).items():
        head = f"  largest {name} stress{f' [{printable(unit)}]' if unit else ''}: "
        words = [
            _words(peak, where, solution)
            for peak, where in ((peaks.inside, "inside"), (peaks.surface, "on the surface"))
            if peak is not None
        ]
        unbounded |= {
            f"{_place(place.x, solution)} ({_named(body, printable(place.sides))})": None
            for body, place in peaks.unbounded
        }
        if words:
            lines += wrapped(head, " and ".join(words).split(), separator=" ")
    if unbounded:
        more = [f"{len(unbounded) - LISTED} more places"] * (len(unbounded) > LISTED)
        listed = ", ".join([*list(unbounded)[:LISTED], *more])
        lines += wrapped("  stress has no bound at ", [listed], separator=" ")
    return lines


def _words(peak: StressPeak, where: str, solution: SolutionData) -> str:
    if peak.value == 0.0:
        return "0"
    text = f"{peak.value:.4g} {where} at {_place(peak.place, solution)}"
    if name := _named(peak.body, printable(peak.part)):
        text += f" ({name})"
    if len(solution.problem.step) > 1:
        text += f" in step {peak.step.step} ({printable(peak.step.name)})"
    return text


def _named(body: str, part: str) -> str:
    """A part of a body; of the only body the part."""
    return part if body == ONE_BODY else ".".join(filter(None, (printable(body), part)))


def _place(x: Array, solution: SolutionData) -> str:
    size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())
    return vector(np.where(np.abs(x) < 1e-4 * size, 0.0, x), 4)
