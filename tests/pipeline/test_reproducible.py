"""The same case gives the same bits: in one process, in two processes, whatever ran before."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from digests import digest

ROOT = Path(__file__).parents[2]
PROGRAM = """
from petcontact.runtime.petsc import petsc
from digests import digest
print(digest({number}, "{formulation}", petsc().COMM_SELF))
"""


@pytest.mark.parametrize("formulation", ["condensed", "full"])
def test_the_same_bits_in_one_process(comm, formulation):
    first = digest(1, formulation, comm)
    digest(2, formulation, comm)
    assert digest(1, formulation, comm) == first


@pytest.mark.slow
def test_the_same_bits_in_two_processes():
    path = os.pathsep.join([str(ROOT), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    command = [sys.executable, "-c", PROGRAM.format(number=1, formulation="condensed")]
    seen = {
        subprocess.run(
            command,
            capture_output=True,
            text=True,
            timeout=300,
            check=True,
            env=os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": str(seed)},
        ).stdout
        for seed in (1, 2)
    }
    assert len(seen) == 1 and len(seen.pop().strip()) == 64


def test_another_case_has_other_bits(comm):
    assert digest(1, "condensed", comm) != digest(2, "condensed", comm)
