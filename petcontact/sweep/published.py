"""Iteration counts that Zhang & Ran (2019) published, found by what a case is, not by what its file
is called."""

from __future__ import annotations

import csv
import functools
from importlib.resources import files

from ..model.bodies import Displacement, Traction
from ..model.problem import Problem
from ..untyped import Keyed

SOURCE = "Zhang & Ran (2019), Tables 1 and 2"
FREE: tuple[str, tuple[float, ...]] = ("traction", (0.0, 0.0))
# E, ν, corners of the rectangle, g, conditions of the sides: sections 5.1 and 5.2
EXAMPLES: dict[int, Keyed] = {
    number: {
        "material": (young, poisson, "strain"),
        "corners": ((0.0, 0.0), corner),
        "bounds": {"bottom": bound},
        "sides": {
            "bottom": ("contact", None),
            "top": ("displacement", (0.0, 0.0)),
            "left": ("traction", left),
            "right": ("traction", right),
        },
    }
    for number, young, poisson, corner, bound, left, right in (
        (1, 10_000.0, 0.3, (8.0, 4.0), 150.0, (400.0, 0.0), (0.0, 0.0)),
        (2, 2_500.0, 0.2, (10.0, 2.0), 450.0, (1700.0, 0.0), (-1100.0, 0.0)),
    )
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
    h, rule, rho = case.mesh.element_size, case.method.rule, case.method.rho
    if h is None or rule is None or rho is None:
        return None
    if case.mesh.graded or case.mesh.resolved_order != 0:
        return None
    # twelve digits: 0.1 and 0.30000000000000004 - 0.2 are one h
    return published_counts().get((number, rule, float(f"{rho:.12g}"), float(f"{h:.12g}")))


def example_number(case: Problem) -> int | None:
    """1 or 2 if a case poses an example of the paper, else None."""
    if len(case.body) > 1 or any((case.step, case.contact, case.obstacle, case.point_force)):
        return None
    if case.mesh.element_sizes or case.geometry.shape != "rectangle":
        return None
    contacts = {b.part: b for b in case.boundary if b.condition == "contact"}
    given = {b.part: b.value for b in case.boundary if isinstance(b, (Displacement, Traction))}
    sides = {b.part: (b.condition, given.get(b.part)) for b in case.boundary}
    material = case.material
    posed = {
        "material": (material.young_modulus, material.poisson_ratio, material.plane),
        "corners": (case.geometry.lower_left, case.geometry.upper_right),
        "bounds": {
            part: contact.plain and contact.friction_bound for part, contact in contacts.items()
        },
        "sides": {"left": FREE, "right": FREE, **sides},
    }
    return next((number for number, example in EXAMPLES.items() if posed == example), None)
