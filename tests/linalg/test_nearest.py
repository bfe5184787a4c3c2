"""Points near others: all distances and the tree find the same."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.linalg import nearest as module
from petcontact.linalg.nearest import nearest, within


@pytest.mark.parametrize("d", [2, 3])
def test_both_ways_find_the_same(d, monkeypatch):
    random = np.random.default_rng(d)
    points, places = random.random((90, d)), random.random((40, d))
    reach = 0.3 * random.random(40)
    few = [
        nearest(points, places),
        nearest(points, places, 5),
        nearest(points, places, 2, 0.1),
        within(points, places, reach),
    ]
    monkeypatch.setattr(module, "FEW", 0)
    many = [
        nearest(points, places),
        nearest(points, places, 5),
        nearest(points, places, 2, 0.1),
        within(points, places, reach),
    ]
    for (a, b), (c, e) in zip(few, many, strict=True):
        assert np.allclose(a, c, rtol=1e-14) and np.array_equal(b, e) and a.shape == c.shape
    assert 0 < len(few[3][0]) < 90 * 40 and 0 < np.count_nonzero(few[2][1] == 90) < 80
