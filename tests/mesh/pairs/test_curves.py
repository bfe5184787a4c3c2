"""What rays and perpendiculars meet: sorted out beforehand, where curves are many, the same as of
all."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.mesh.pairs import curves
from petcontact.mesh.pairs.curves import Curves


@pytest.mark.parametrize("count", [600, 2400])
def test_few_curves_are_looked_at_where_they_are_many(count):
    """Rays between two straight parts of equal elements: some hundred curves for each 64 points,
    however many there are."""
    ends = np.column_stack([np.linspace(0.0, 1.0, count + 1), np.zeros(count + 1)])
    part = Curves(ends[:-1], ends[1:], np.zeros(count))
    looked_at = []
    x = np.column_stack([np.linspace(0.0, 1.0, count), np.full(count, 0.1)])
    for _, number, _, _ in part._met(curves._crossings, x, np.tile([0.0, -1.0], (count, 1))):
        looked_at.append(len(number))
    assert max(looked_at) < 200
