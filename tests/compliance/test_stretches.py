"""Where a mesh and its conditions repeat themselves, and where they only seem to."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from examples import example
from prepared import operators

from petcontact import MeshOptions
from petcontact.bem.operators import BoundaryOperators
from petcontact.compliance.body.stretches import stretches_of
from petcontact.compression.hodlr import Stretch


def found(**changes):
    ops = operators(example(1, **changes))
    return stretches_of(ops.mesh, ops)


@pytest.mark.parametrize(("size", "order"), [(0.05, 0), (0.1, 3)])
def test_sides_of_equal_elements_and_graded_ones_that_are_none(size, order):
    nodes = [round(length / size) * (order + 1) for length in (8.0, 4.0, 8.0, 4.0)]
    ends = np.cumsum(nodes).tolist()
    expected = [Stretch(b - count, b, order + 1) for b, count in zip(ends, nodes, strict=True)]
    assert found(mesh=MeshOptions(element_size=size, order=order)) == expected
    assert found(mesh=MeshOptions(order=2, grading=0.4, levels=9)) == []


def test_a_drift_is_no_round_off():
    """Each element is as long as the next but for 1e-10."""
    ops = operators(example(1, mesh=MeshOptions(element_size=0.05)))
    moved = {
        name: x + 1e-8 * x * (8.0 - x) / 8.0 * (x[:, 1:] == 0.0)
        for name, x in vars(ops.mesh).items()
        if name in ("start", "end")
    }
    assert [s.start for s in stretches_of(replace(ops.mesh, **moved), ops)] == [160, 240, 400]


def test_entries_that_do_not_repeat_are_noticed(monkeypatch):
    """A kernel of a user's own may know where it is."""
    plain = BoundaryOperators.system_entries

    def entries(self, rows, columns):
        return plain(self, rows, columns) * (1.0 + 1e-7 * self.mesh.x[columns, 0].repeat(2))

    monkeypatch.setattr(BoundaryOperators, "system_entries", entries)
    stretches = found(mesh=MeshOptions(element_size=0.05))
    assert [(s.start, s.stop) for s in stretches] == [(160, 240), (400, 480)]
