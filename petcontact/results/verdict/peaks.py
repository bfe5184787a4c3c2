"""The largest stresses on the boundaries of the bodies, over the steps."""

from __future__ import annotations

import numpy as np

from ...arrays import Array
from ...fields.peak import corner_at
from ...frozen import frozen
from ...model.problem import ONE_BODY
from ...runtime.terminal import printable
from ..data import SolutionData
from ..records import StepResult, step_ends
from .text import vector, wrapped

ROUND_OFF = 1e-13
"""Stress, over E times displacement over the size of the body, that is none."""
QUANTITIES = {"von Mises": "von_mises", "first principal": "first_principal"}
"""Of `StressState`, by their names in the verdict."""


@frozen
class BoundaryPeak:
    """The largest value of a stress on the boundaries at the ends of the steps.

    Attributes
    ----------
    value : float
        [stress]
    place : (d,) array
        [length]
    body, part : str
    step : StepResult
    corner : bool
        Whether it is next to the end of a part or a corner of the outline, where stress may be
        infinite: the value then depends on the mesh.
    """

    value: float
    place: Array
    body: str
    part: str
    step: StepResult
    corner: bool


def stress_peaks(solution: SolutionData) -> dict[str, BoundaryPeak]:
    """By the names of `QUANTITIES`; without those that are nowhere finite."""
    found: dict[str, BoundaryPeak] = {}
    materials = {body.name: body.material for body in solution.problem.body}
    for step in step_ends(solution.steps or solution.tried):
        for body, mesh in solution.meshes.items():
            # numbers of an altered file, or of a solve that failed, may overflow
            try:
                with np.errstate(all="ignore"):
                    element, state = solution.boundary_state(body, step)
                    stresses = {name: getattr(state, key) for name, key in QUANTITIES.items()}
            except np.linalg.LinAlgError:
                continue
            size = float(np.abs(solution.increment(step).bodies[body].u).max()) / float(
                np.ptp(mesh.x, axis=0).max()
            )
            least = ROUND_OFF * materials[body].young_modulus * size
            for name, values in stresses.items():
                values = np.where(np.abs(values) < least, 0.0, values)
                k = int(np.argmax(np.where(np.isfinite(values), values, -np.inf)))
                if np.isfinite(values[k]) and (name not in found or values[k] > found[name].value):
                    part, place = mesh.part_names[mesh.part[element[k]]], state.x[k]
                    found[name] = BoundaryPeak(
                        float(values[k]), place, body, part, step, bool(corner_at(mesh, place))
                    )
    return found


def peak_lines(solution: SolutionData) -> list[str]:
    """Value and place of each peak, with the body and the step where there are several."""
    unit = solution.problem.units.stress
    lines = []
    for name, peak in stress_peaks(solution).items():
        head = f"  peak {name} stress{f' [{printable(unit)}]' if unit else ''}: "
        lines += wrapped(head, _words(peak, solution))
    return lines


def _words(peak: BoundaryPeak, solution: SolutionData) -> list[str]:
    if peak.value == 0.0:
        return ["0"]
    size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())
    place = vector(np.where(np.abs(peak.place) < 1e-9 * size, 0.0, peak.place), 4)
    words = [
        f"{peak.value:.4g} at {place}",
        printable(peak.part if peak.body == ONE_BODY else f"{peak.body}.{peak.part}"),
    ]
    if len(solution.problem.step) > 1:
        words.append(f"step {peak.step.step} ({printable(peak.step.name)})")
    return words + ["next to a corner"] * peak.corner
