"""Iteration counts that Zhang & Ran (2019) published, found by what a case is, not by what its file
is called."""

from __future__ import annotations

import csv
import functools
from importlib.resources import files
from typing import Any

from ..model.problem import Problem

SOURCE = "Zhang & Ran (2019), Tables 1 and 2"
# E, ν, corner of the rectangle at the origin, g, traction on the left and right sides: sections 5.1
# and 5.2
EXAMPLES: dict[int, dict[str, Any]] = {
    1: {
        "young": 10_000.0,
        "poisson": 0.3,
        "corner": (8.0, 4.0),
        "bound": 150.0,
        "left": (400.0, 0.0),
        "right": (0.0, 0.0),
    },
    2: {
        "young": 2_500.0,
        "poisson": 0.2,
        "corner": (10.0, 2.0),
        "bound": 450.0,
        "left": (1700.0, 0.0),
        "right": (-1100.0, 0.0),
    },
}


@functools.cache
def published_counts() -> dict[tuple[int, str, float, float], int]:
    """Iterations by example, rule, ρ and h: 128 entries."""
    text = files(__package__).joinpath("data/published.csv").read_text(encoding="utf-8")
    rows = csv.DictReader(line for line in text.splitlines() if not line.startswith("#"))
    return {
        (int(r["example"]), r["rule"], float(r["rho"]), float(r["h"])): int(r["iterations"])
        for r in rows
    }


def published_count(case: Problem) -> int | None:
    """The published iterations for the example, rule, ρ and h of a case; None if the paper has no
    such case.

    Parameters of the method that the paper states once (ω, τ, c_max, tolerance) are not looked at,
    so that other readings of the text can be compared with the same numbers.
    """
    number = example_number(case)
    if number is None:
        return None
    h, rule = case.mesh.element_size, case.method.rule
    if h is None or rule is None or case.mesh.graded or case.mesh.resolved_order != 0:
        return None
    # twelve digits: 0.1 and 0.30000000000000004 - 0.2 are one h
    return published_counts().get(
        (number, rule, float(f"{case.method.rho:.12g}"), float(f"{h:.12g}"))
    )


def example_number(case: Problem) -> int | None:
    """1 or 2 if a case poses an example of the paper, else None."""
    if len(case.body) > 1 or case.step or case.contact or case.obstacle or case.point_force:
        return None
    if (
        case.geometry.shape != "rectangle"
        or case.material.plane != "strain"
        or case.mesh.element_sizes
    ):
        return None
    given = {b.part: b for b in case.boundary}
    if set(given) - {"bottom", "right", "top", "left"}:
        return None
    bottom, top = given.get("bottom"), given.get("top")
    if (
        bottom is None
        or bottom.condition != "contact"
        or not bottom.plain
        or top is None
        or top.condition != "displacement"
    ):
        return None
    sides = {}
    for name in ("left", "right"):
        side = given.get(name)
        if side is not None and (side.condition != "traction" or side.value is None):
            return None
        sides[name] = (
            side.value if side is not None and side.condition == "traction" else (0.0, 0.0)
        )
    posed = {
        "young": case.material.young_modulus,
        "poisson": case.material.poisson_ratio,
        "corner": case.geometry.upper_right,
        "bound": bottom.friction_bound,
        **sides,
    }
    if case.geometry.lower_left != (0.0, 0.0) or top.value != (0.0, 0.0):
        return None
    return next((number for number, example in EXAMPLES.items() if posed == example), None)
