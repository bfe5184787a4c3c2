"""Compressed operators over ranks: each rank a subtree."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi

PROGRAM = """
import json, sys
from petcontact.runtime.petsc import initialise, petsc
initialise(sys.argv[1:])
from examples import example
from petcontact import MeshOptions, Method, solve
case = example(2, mesh=MeshOptions(element_size=10 / 111))
result = []
for method in (case.method, Method(name="semismooth-newton", tolerance=1e-9)):
    solution = solve(case.model_copy(update={"method": method}))
    assert solution.converged, solution.reason
    result.append(solution.contact.u_t[:, 0].tolist() + [float(solution.iterations)])
if petsc().COMM_WORLD.getRank() == 0:
    print("RESULT", json.dumps(result))
"""


def test_ranks_agree():
    dense = launch.result(1, PROGRAM, "-bem_mat_type", "dense")
    for ranks in (1, 2):
        projected, newton = launch.result(ranks, PROGRAM, "-bem_mat_type", "hodlr")
        assert (
            projected[-1] == dense[0][-1]
        )  # iterations; Newton's differ, its inner solves are other ones
        for values, expected in ((projected, dense[0]), (newton, dense[1])):
            scale = max(abs(value) for value in expected[:-1])
            assert (
                max(abs(a - b) for a, b in zip(values[:-1], expected[:-1], strict=True))
                <= 1e-8 * scale
            )
