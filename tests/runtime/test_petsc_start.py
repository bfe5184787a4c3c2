"""Starting PETSc in a process that no launcher started: no daemon beside it, and nothing left behind for its children."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

PROGRAM = """
import os
from pathlib import Path
import petcontact
petcontact.initialise()
children = "".join(path.read_text() for path in Path("/proc/self/task").glob("*/children")).split()
assert len(children) == {children}, children
assert {{key: value for key, value in os.environ.items() if key.startswith("OMPI_MCA_ess")}} == {given}
assert "OMPI_MCA_pml" not in os.environ
from petsc4py import PETSc
assert PETSc.COMM_WORLD.tompi4py().allreduce(2) == 2
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="children are looked for as Linux tells them")
@pytest.mark.parametrize("given", [{}, {"OMPI_MCA_ess_singleton_isolated": "0"}])
def test_alone(given):
    from mpi4py import MPI

    daemon = bool(given) and MPI.Get_library_version().startswith("Open MPI v4")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI", "PMI"))} | given
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(children=int(daemon), given=given)], env=environment,
                          capture_output=True, text=True, timeout=60)  # fmt: skip
    assert done.returncode == 0, done.stderr
