"""The same case on the same ranks gives the same bits."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))
import launch

pytestmark = pytest.mark.mpi

PROGRAM = """
from petcontact.runtime.petsc import petsc
from digests import digest
value = digest(1, "condensed", petsc().COMM_WORLD)
if petsc().COMM_WORLD.getRank() == 0:
    print("DIGEST", value)
"""


def test_the_same_bits_on_the_same_ranks():
    seen = set()
    for _ in range(2):
        done = launch.run(2, "-c", PROGRAM)
        assert done.returncode == 0, done.stderr
        seen.add(next(line for line in done.stdout.splitlines() if line.startswith("DIGEST")))
    assert len(seen) == 1
