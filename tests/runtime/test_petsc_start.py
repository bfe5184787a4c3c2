"""Starting PETSc: what Open MPI need not do for ranks of one machine, and nothing left behind for
children."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from petcontact.runtime.petsc import _local

PROGRAM = """
import os, subprocess
from pathlib import Path
import petcontact
petcontact.initialise()
children = "".join(path.read_text() for path in Path("/proc/self/task").glob("*/children")).split()
assert len(children) == {children}, children
# a folder of the same name for all would be made and removed by several at once
assert {children} or not list(Path(os.environ["TMPDIR"]).iterdir())
assert {{key: value for key, value in os.environ.items() if key.startswith("OMPI_MCA_ess")}} == {given}
assert not {{"OMPI_MCA_pml", "OMPI_MCA_orte_create_session_dirs"}} & set(os.environ)
seen = subprocess.run(["env", "-0"], capture_output=True, text=True).stdout.split("\\0")
assert {children} or not {{line.partition("=")[0] for line in seen if line}} - set(os.environ), seen
from petsc4py import PETSc
assert PETSc.COMM_WORLD.tompi4py().allreduce(2) == 2
"""


@pytest.mark.skipif(
    not os.path.exists("/proc/self/task"), reason="children are looked for as Linux tells them"
)
@pytest.mark.parametrize("given", [{}, {"OMPI_MCA_ess_singleton_isolated": "0"}])
def test_alone(given, tmp_path):
    from mpi4py import MPI

    daemon = bool(given) and MPI.Get_library_version().startswith("Open MPI v4")
    environment = {
        key: value for key, value in os.environ.items() if not key.startswith(("OMPI", "PMI"))
    }
    environment |= {"TMPDIR": str(tmp_path), **given}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM.format(children=int(daemon), given=given)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("here", "given", "wanted"), [("4", None, "ob1"), ("2", None, None), ("4", "ucx", "ucx")]
)
def test_networks_are_left_out_where_all_ranks_are_on_one_machine(monkeypatch, here, given, wanted):
    for name in [name for name in os.environ if name.startswith(("OMPI", "PMI"))]:
        monkeypatch.delenv(name)
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "4")
    monkeypatch.setenv("OMPI_COMM_WORLD_LOCAL_SIZE", here)
    if given:
        monkeypatch.setenv("OMPI_MCA_pml", given)
    before = dict(os.environ)
    with _local():
        assert dict(os.environ).get("OMPI_MCA_pml") == wanted
        assert "OMPI_MCA_ess_singleton_isolated" not in os.environ
    assert dict(os.environ) == before
