"""A user's script as mypy and an editor see it: the mypy step of scripts/test checks it.

Each line that is wrong says so; mypy fails where an expected error is not there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, assert_type

import numpy as np

import petcontact
from petcontact import Contact, Displacement, Material, Problem, Rectangle, Solution, load, solve

taken: Callable[[str | Problem], Solution] = solve
solution = solve(load("case.toml"), petsc_options={"ksp_type": "gmres"})
assert_type(solution, Solution)
assert_type(solution.contact.u_t, np.ndarray[Any, np.dtype[np.float64]])
assert_type(petcontact.__version__, str)
solve(3.0)  # type: ignore[arg-type]
missing = solution.no_such_field  # type: ignore[attr-defined]
block = Problem(
    material=Material(1e4, 0.3),
    geometry=Rectangle((0, 0), (8, 4)),
    boundary=[Contact("bottom", friction_bound=1.0), Displacement("top", (0, "free"))],
)
assert_type(block.material, Material)
kind: str = block.kind
Contact(3)  # type: ignore[arg-type]
Problem(materal=Material(1e4, 0.3))  # type: ignore[call-arg]
