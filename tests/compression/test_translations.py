"""Clusters that share the blocks of a translate: accuracy is that of clusters fitted one by one."""

from __future__ import annotations

import numpy as np
import pytest
from hodlr_kernels import Mixed, circle, compressed, dense, polygon, together

from petcontact.compression.hodlr import Stretch, factor

SQUARE = np.array([[0.0, 0.0], [8.0, 0.0], [8.0, 4.0], [0.0, 4.0]])
PER_SIDE, LEAF = 96, 8


def outline(name):
    """A square; one that is so thin that its long elements are as large as its ends; a tiny hole
    close to a side."""
    if name == "thin":
        return polygon(SQUARE * [1.0, 0.02], PER_SIDE)
    square = polygon(SQUARE, PER_SIDE)
    return (
        square
        if name == "square"
        else together(square, circle(40, 0.04, (3.3, 0.05), clockwise=True))
    )


def sides(**first):
    """All of them repeat; `first` is of the first one."""
    ends = [(i * PER_SIDE, (i + 1) * PER_SIDE) for i in range(4)]
    return [Stretch(*ends[0], **first), *(Stretch(*end) for end in ends[1:])]


def followers(matrix):
    return sum(
        cluster.follows
        for part in matrix.parts
        for level in part.levels
        for cluster in level.clusters
    )


@pytest.mark.parametrize(("name", "tol"), [("square", 1e-10), ("thin", 1e-6), ("hole", 1e-8)])
def test_rows_and_solutions_to_the_tolerance(name, tol):
    operator = Mixed(outline(name))
    exact, matrix = dense(operator), compressed(operator, tol, LEAF, stretches=sides())
    error = np.linalg.norm(matrix @ np.eye(len(exact)) - exact, axis=1).max()
    # without sharing the thin one and that with the hole are off by as much
    assert error <= (5 if name == "square" else 40) * tol * np.linalg.norm(exact, axis=1).max()
    assert followers(matrix) > 20
    b = np.cos(np.arange(len(exact)))
    x = factor(matrix, use_up=True)(b)
    assert np.abs(exact @ x - b).max() <= 1e4 * tol
