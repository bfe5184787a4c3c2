"""Points near others: the same by all distances, in order along a line, and by a tree."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.linalg import nearest
from petcontact.linalg.nearest import Nearest, within

SIZES = [(1, 1, 2), (40, 7, 2), (300, 60, 3), (5, 400, 3)]


def points_of(n, m, d):
    chance = np.random.default_rng(n + m)
    # coordinates on a grid: many distances are those of the reach
    return chance.integers(0, 12, (n, d)) / 4.0, chance.integers(-4, 16, (m, d)) / 4.0


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("limit", [0, 10**6])
def test_pairs_within_a_reach_are_all_that_are_not_further(size, limit, monkeypatch):
    monkeypatch.setattr(nearest, "MOST_CLOSE", limit)
    points, places = points_of(*size)
    reach = np.arange(len(places)) % 3 * 0.25
    apart = np.linalg.norm(places[:, None] - points, axis=2)
    for found, expected in zip(
        within(points, places, reach), np.nonzero(apart <= reach[:, None]), strict=True
    ):
        np.testing.assert_array_equal(found, expected)
    assert not any(map(len, within(points[:0], places, reach)))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("limit", [0, 10**6])
def test_the_nearest_come_first(size, limit, monkeypatch):
    monkeypatch.setattr(nearest, "MOST_APART", limit)
    points, places = points_of(*size)
    apart = np.linalg.norm(places[:, None] - points, axis=2)
    for count in (1, 4):
        found = np.take_along_axis(apart, Nearest(points)(places, count), axis=1)
        np.testing.assert_array_equal(found, np.sort(apart, axis=1)[:, :count])
