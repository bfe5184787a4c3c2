"""What tells the numbers of a solution, for all lines of a verdict."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from ...runtime.terminal import printable
from ..data import SolutionData
from ..numbers.number import Number
from ..records import StepResult
from .text import is_resolved, place_of, told, unit_of

AXIAL = {"force": "axial force", "moment": "torque"}
"""What a force and a moment of a body of revolution are."""


class Teller:
    """Tells the numbers of a solution.

    Attributes
    ----------
    solution : SolutionData
    numbers : dict of Number by key
    some : bool
        Whether the error of any number is known.
    notes : list of str
        Whether forces of plane bodies are per length or whole, and of what units numbers are that
        have none.
    axial : bool
        Whether the bodies are those of revolution, whose vectors are told along the axis.
    size : float
        Largest coordinate [length].
    stiffest : float
        Largest Young's modulus [stress].
    verbose : bool
        Whether all numbers are shown.
    ends : list of StepResult
        The last solutions of the steps.
    """

    def __init__(self, solution: SolutionData, verbose: bool) -> None:
        self.solution, self.verbose = solution, verbose
        self.numbers = {number.key: number for number in solution.numbers}
        self.some = any(0.0 < number.error < np.inf for number in self.numbers.values())
        self.axial = solution.problem.symmetry == "axial"
        self.size = max(float(np.abs(mesh.x).max()) for mesh in solution.meshes.values())
        self.stiffest = max(body.material.young_modulus for body in solution.problem.body)
        mesh = next(iter(solution.meshes.values()))
        self.power = mesh.weight_power
        units = solution.problem.units
        self.notes = [mesh.of_forces] * bool(mesh.of_forces)
        self.notes += ["units of the config"] * (not (units.length or units.stress))
        self.ends = list({(step.step, step.cycle): step for step in solution.steps}.values())

    def unit(self, kind: str) -> str:
        """The user's name of a unit."""
        return unit_of(kind, self.solution.problem.units, self.power)

    def number(self, number: Number, unit: bool = True, place: bool = True) -> str:
        """With its unit, and where it is."""
        text = told(number, self.unit(number.unit) if unit else "", self.some)
        # what is not resolved has no place
        located = is_resolved(number) and (number.size > 0.0 or np.isinf(number.error))
        if number.place is None or not place or not located:
            return text
        return f"{text} at {place_of(number.place, self.size)}"

    def get(self, step: StepResult, of: str, name: str) -> Number | None:
        """A number at the end of a step."""
        return self.numbers.get((name, of, step.step, step.cycle))

    def turns(self, moment: Number) -> bool:
        """Whether a moment is told: where it says something, or there is no force beside it."""
        if self.verbose or moment.size == 0.0:
            return self.verbose
        name = moment.name.replace("held by moment", "held by").replace("moment", "force")
        force = self.numbers.get((name, *moment.key[1:]))
        return self.axial or (force is not None and force.size == 0.0)

    def items(self, step: StepResult, of: str, names: Mapping[str, str]) -> Iterator[str]:
        """Yield the numbers of `names` that the solution has, each after its words."""
        for name, words in names.items():
            number = self.get(step, of, name)
            if number is not None:
                yield f"{words} {self.number(number)}"

    def share(self, number: Number, whole: float) -> str:
        """An area in per cent of another one."""
        parts = 100.0 * number.value / whole, 100.0 * number.error / whole
        share = replace(number, value=parts[0], error=parts[1], scale=0.0)
        if share.error >= max(share.size, 100.0 - share.size):
            return "not known"
        either = share.error < 0.05 and min(share.size, abs(100.0 - share.size)) < 0.05
        return f"{share.size:.0f} %" if either else told(share, "%", self.some)


def label(step: StepResult) -> str:
    """The number and the name of a step, and its cycle."""
    cycle = f", cycle {step.cycle}" if step.cycle else ""
    return f"step {step.step} ({printable(step.name)}){cycle}"
