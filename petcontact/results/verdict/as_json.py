"""A verdict for programs."""

from __future__ import annotations

import json

import numpy as np

from ...untyped import Keyed
from ..data import SolutionData
from ..format.number_tables import plain
from ..numbers.number import Number
from .text import unit_of


def as_json(solution: SolutionData) -> str:
    """The status, warnings, accuracy and numbers of a solution as one JSON object.

    A value is a number, or a list of components. An error is null where it is not known, and
    `bounded` is false of a number that has no bound.
    """
    accuracy = solution.accuracy
    table = {
        "title": solution.problem.title,
        "status": solution.status,
        "reason": solution.reason,
        "warnings": solution.warnings,
        "error": plain(accuracy.error),
        "wanted": accuracy.wanted,
        "path_error": plain(accuracy.path),
        "numbers": [_number(solution, number) for number in solution.numbers],
        "time": sum(solution.timings.values()),
    }
    return json.dumps(table, indent=1, ensure_ascii=False, allow_nan=False)


def _number(solution: SolutionData, number: Number) -> Keyed:
    names = [step.name for step in solution.steps if step.step == number.step]
    power = next(iter(solution.meshes.values())).weight_power
    values = number.value.tolist()
    return {
        "name": number.name,
        "of": number.of,
        "step": number.step,
        "step_name": names[0] if names else "",
        "cycle": number.cycle,
        "value": plain(values if len(values) > 1 else values[0]),
        "error": plain(number.error),
        "bounded": not np.isinf(number.error),
        "unit": unit_of(number.unit, solution.problem.units, power) or None,
        "place": None if number.place is None else plain(number.place),
        "part": number.part or None,
    }
