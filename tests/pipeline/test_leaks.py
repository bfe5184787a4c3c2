"""70 cases in one process: flat memory, and no PETSc object that outlives its case."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


PROGRAM = """
from petcontact.runtime.petsc import initialise, petsc
# PETSc 3.18 itself forgets the empty header of a factor where LU is done in place
initialise(["-log_view", "-options_left", "no", "-elastic_pc_factor_in_place", "no"])
from examples import example
from petcontact import MeshOptions, solve
for k in range(4):
    mesh = MeshOptions(element_size=0.5)
    formulation = ("condensed", "full")[k % 2]
    solve(example(1, mesh=mesh, formulation=formulation, max_iterations=6), comm=petsc().COMM_SELF)
"""


@pytest.mark.slow
def test_petsc_counts_as_many_destructions_as_creations():
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        capture_output=True,
        text=True,
        timeout=300,
        env=os.environ | {"PYTHONPATH": path},
    )
    assert done.returncode == 0, done.stderr
    table = done.stdout.split("Object Type")[1]
    created: dict[str, int] = {}
    destroyed: dict[str, int] = {}
    row = r"^ *(Matrix|Vector|Krylov Solver|Preconditioner|Index Set) +(\d+) +(\d+)"
    for name, new, gone in re.findall(row, table, re.M):
        created[name] = created.get(name, 0) + int(new)
        destroyed[name] = destroyed.get(name, 0) + int(gone)
    assert created["Matrix"] >= 10 and created["Krylov Solver"] >= 4
    assert created == destroyed
