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
# a folder of the same name for all would be made and removed by several at once
assert {children} or not list(Path(os.environ["TMPDIR"]).iterdir())
assert {{key: value for key, value in os.environ.items() if key.startswith("OMPI_MCA_ess")}} == {given}
assert not {{"OMPI_MCA_pml", "OMPI_MCA_orte_create_session_dirs"}} & set(os.environ)
from petsc4py import PETSc
assert PETSc.COMM_WORLD.tompi4py().allreduce(2) == 2
"""


@pytest.mark.skipif(not os.path.exists("/proc/self/task"), reason="children are looked for as Linux tells them")
@pytest.mark.parametrize("given", [{}, {"OMPI_MCA_ess_singleton_isolated": "0"}])
def test_alone(given, tmp_path):
    from mpi4py import MPI

    daemon = bool(given) and MPI.Get_library_version().startswith("Open MPI v4")
    environment = {key: value for key, value in os.environ.items() if not key.startswith(("OMPI", "PMI"))}
    environment |= {"TMPDIR": str(tmp_path), **given}
    done = subprocess.run([sys.executable, "-c", PROGRAM.format(children=int(daemon), given=given)], env=environment,
                          capture_output=True, text=True, timeout=60)  # fmt: skip
    assert done.returncode == 0, done.stderr
