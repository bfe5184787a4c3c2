"""The same case gives the same bits: in one process, in two processes, whatever ran before."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import example

from petcontact import MeshOptions, solve

ROOT = Path(__file__).parents[1]
MESH = MeshOptions(element_size=0.2)
PROGRAM = """
from petcontact._petsc import petsc
from test_reproducible import digest
print(digest({number}, "{formulation}", petsc().COMM_SELF))
"""


def digest(number, formulation, comm):
    solution = solve(example(number, mesh=MESH, formulation=formulation), comm=comm)
    fields = [solution.u, solution.traction, solution.contact.u_t, solution.contact.sigma_t, np.array(solution.history.rho),
              np.array(solution.history.change), np.array(solution.history.residual)]  # fmt: skip
    return hashlib.sha256(b"".join(np.ascontiguousarray(field).tobytes() for field in fields)).hexdigest()


@pytest.mark.parametrize("formulation", ["condensed", "full"])
def test_the_same_bits_in_one_process(comm, formulation):
    first = digest(1, formulation, comm)
    digest(2, formulation, comm)
    assert digest(1, formulation, comm) == first


def test_the_same_bits_in_two_processes():
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", PROGRAM.format(number=1, formulation="condensed")]
    seen = {
        subprocess.run(command, capture_output=True, text=True, timeout=60, check=True,
                       env=os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": str(seed)}).stdout
        for seed in (1, 2)
    }  # fmt: skip
    assert len(seen) == 1 and len(seen.pop().strip()) == 64


def test_another_case_has_other_bits(comm):
    assert digest(1, "condensed", comm) != digest(2, "condensed", comm)
