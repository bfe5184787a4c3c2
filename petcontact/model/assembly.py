"""Names of before there was one `Problem`, for the folders that still import them from here."""

from __future__ import annotations

from .problem import ONE_BODY, Body, Obstacle, Pair, PointForce, Problem, changed_condition

Assembly = Problem


def assembly_of(problem: Problem) -> Problem:
    """The problem itself."""
    return problem


__all__ = ["ONE_BODY", "Assembly", "Body", "Obstacle", "Pair", "PointForce", "assembly_of", "changed_condition"]
