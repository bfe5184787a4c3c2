"""70 cases in one process: flat memory, and no PETSc object that outlives its case."""

from __future__ import annotations

import gc
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from examples import example

from petcontact import MeshOptions, solve

ROOT = Path(__file__).parents[2]
MESH = MeshOptions(element_size=0.4)


def resident() -> int:
    """Resident memory of this process [bytes]."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.slow
def test_70_cases_in_flat_memory(comm):
    def batch(count):
        for k in range(count):
            formulation = ("condensed", "full")[k % 2]
            options = {"ksp_type": "gmres", "pc_type": "jacobi"} if k % 3 == 0 else {}
            solve(
                example(1 + k % 2, mesh=MESH, formulation=formulation, max_iterations=6),
                comm=comm,
                petsc_options=options,
            )
        gc.collect()
        return resident()

    start = batch(20)  # caches and arenas fill
    end = batch(50)
    # an elastic matrix has 115 kB: if every second case lost one, that would be 2.9 MB
    assert end - start < 1_500_000


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
