"""The same case gives the same bits: in one process, in two processes, whatever ran before."""

from __future__ import annotations

import pytest
from digests import digest


@pytest.mark.parametrize("formulation", ["condensed", "full"])
def test_the_same_bits_in_one_process(comm, formulation):
    first = digest(1, formulation, comm)
    digest(2, formulation, comm)
    assert digest(1, formulation, comm) == first


def test_another_case_has_other_bits(comm):
    assert digest(1, "condensed", comm) != digest(2, "condensed", comm)
