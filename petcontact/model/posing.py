"""The way from a `Problem`, which has texts, to a `Posed`, which has functions of the place."""

from __future__ import annotations

from typing import Any

from ..given.posed import Cycle, Posed, Step
from .cycle import cycle_steps


def posed(problem: Any) -> Posed:
    """Return a `Problem` as it is solved."""
    return Posed(
        problem.kind,
        problem.symmetry == "axial",
        problem.twisted,
        problem.bodies,
        problem.interfaces,
        tuple(map(tuple, problem.obstacles_at)),
        tuple(
            Step(step.name, step.increments, "increments" in step.model_fields_set, step.until)
            for step in problem.step
        ),
        _cycle(problem),
        problem.method,
        problem.bem,
        problem.petsc,
        problem.outline,
    )


def _cycle(problem: Any) -> Cycle | None:
    """The cycle of a problem, with the numbers of its steps."""
    cycle = problem.cycle
    if cycle is None:
        return None
    return Cycle(cycle_steps(problem), cycle.count, cycle.jump, cycle.tolerance)
