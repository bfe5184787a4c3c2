"""The paper's examples, for tests and for the programs that they start."""

from __future__ import annotations

import dataclasses

from shapes import closing, drawn, elastic, moved, problem, rectangle

from petcontact import MeshOptions, Method, Problem
from petcontact.contact.methods.registry import method_of
from petcontact.pipeline.run import run


def example(number: int, *, mesh: MeshOptions | None = None, **method) -> Problem:
    """Example 1 or 2 of the paper as printed, on h = 0.1 unless a mesh is given."""
    modulus, ratio, corner, bound, left, right = {
        1: (10_000.0, 0.3, (8.0, 4.0), 150.0, 400.0, 0.0),
        2: (2_500.0, 0.2, (10.0, 2.0), 450.0, 1700.0, -1100.0),
    }[number]
    return problem(
        material=elastic(modulus, ratio),
        geometry=rectangle((0.0, 0.0), corner),
        mesh=mesh or {"element_size": 0.1},
        boundary=[
            closing("bottom", friction_bound=bound),
            moved("top", (0.0, 0.0)),
            drawn("left", (left, 0.0)),
            drawn("right", (right, 0.0)),
        ],
        method={"name": "projection", "rule": "modified", **method},
    )


def run_with(prepared, method: Method, rule=None, **keywords):
    """The solution of a prepared problem by another method."""
    problem = prepared.discrete.problem.model_copy(update={"method": method})
    discrete = dataclasses.replace(prepared.discrete, problem=problem)
    return run(
        dataclasses.replace(prepared, discrete=discrete, method=method_of(method, rule)), **keywords
    )
