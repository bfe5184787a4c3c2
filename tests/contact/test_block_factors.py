"""Blocks on active sets that change little are solved by the factors of an earlier one."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.contact.active_set.block_factors import BlockFactors
from petcontact.linalg.dense_solver import DenseSolver


def solved(factors, dense, active, changed, border):
    """The answer on a set whose columns `changed` are doubled, bordered by ones, and the exact
    one."""
    factor = np.where(np.isin(active, changed), 2.0, 1.0)
    size = len(active) + border
    matrix = np.zeros((size, size), order="F")
    matrix[: len(active), : len(active)] = dense[np.ix_(active, active)] * factor
    matrix[len(active) :, : len(active)] = 1.0
    matrix[: len(active), len(active) :] = 1.0
    rhs = np.cos(np.arange(size))
    answer = factors.solve(dense, active, factor[:, None], matrix, rhs)
    return answer, np.linalg.solve(matrix, rhs)


@pytest.mark.parametrize("border", [0, 1])
def test_near_blocks_are_solved_by_the_factors_of_the_first(border, monkeypatch):
    random = np.random.default_rng(3)
    dense = np.eye(80) + 0.3 * random.standard_normal((80, 80)) / np.sqrt(80)
    factors, first = BlockFactors(), np.arange(60)
    assert solved(factors, dense, first, [], border)[0] == pytest.approx(
        solved(factors, dense, first, [], border)[1], rel=1e-10
    )
    taken = []
    monkeypatch.setattr(DenseSolver, "take", lambda _, matrix: taken.append(matrix))
    for active, changed in (
        (first, [7]),
        (np.arange(2, 60), []),
        (np.arange(62), [1, 5]),
        (np.delete(np.arange(61), [4]), [9]),
    ):
        answer, exact = solved(factors, dense, active, changed, border)
        assert answer == pytest.approx(exact, rel=1e-10, abs=1e-10)
    assert not taken
    monkeypatch.undo()
    for active, matrix in ((np.arange(20, 80), dense), (first, dense.copy())):
        answer, exact = solved(factors, matrix, active, [], border)
        assert answer == pytest.approx(exact, rel=1e-10, abs=1e-10)
