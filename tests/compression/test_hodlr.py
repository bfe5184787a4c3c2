"""The compressed operators against dense ones, and their direct solver against dense solves."""

from __future__ import annotations

import numpy as np
import pytest
from hodlr_kernels import CASES, Mixed, Partial, case, circle, compressed, dense
from marks import slow

from petcontact.compression.hodlr import compress, factor


def turned(values):
    """Cases with corners and gradings with one of the values each; the other pairs are slow."""
    quick = [name for name in CASES if name in ("star", "graded")]
    return [
        (pytest.param if name in quick and quick.index(name) == column else slow)(name, value)
        for name in CASES
        for column, value in enumerate(values)
    ]


def row_error(matrix, exact):
    """Largest 2-norm of a wrong row, relative to the longest row."""
    difference = matrix @ np.eye(exact.shape[1]) - exact
    return np.linalg.norm(difference, axis=1).max() / np.linalg.norm(exact, axis=1).max()


@pytest.fixture
def rng():
    return np.random.default_rng(5)


@pytest.mark.parametrize(("name", "tol"), turned([1e-4, 1e-8, 1e-12]))
def test_rows_to_the_tolerance(name, tol, rng):
    operator = Mixed(case(name, rng))
    matrix = compressed(operator, tol)
    # many small loops close together are sampled at the limit
    assert row_error(matrix, dense(operator)) <= (25 if name == "holes" else 5) * tol


@pytest.mark.parametrize(("name", "threads"), turned([1, 3]))
def test_an_operator_beside_another_shares_its_rows(name, threads, rng):
    nodes = case(name, rng)
    operator, tol = Mixed(nodes), 1e-8
    beside = Partial(
        nodes, rng.random(len(nodes)) < 0.4 if name == "star" else np.arange(len(nodes)) % 150 < 70
    )

    def both(rows, columns):
        return [operator(rows, columns), beside(rows, columns)]

    matrix = compressed(
        operator, tol, threads=threads, serve=(both, [operator.col_offsets, beside.col_offsets])
    )
    other = matrix.with_columns(beside, beside.col_offsets)
    exact = np.hstack([dense(operator), dense(beside)])
    wrong = (
        np.hstack([matrix @ np.eye(len(exact)), other @ np.eye(exact.shape[1] - len(exact))])
        - exact
    )
    longest = np.linalg.norm(exact, axis=1).max()
    assert np.linalg.norm(wrong, axis=1).max() <= (25 if name == "holes" else 5) * tol * longest
    for mine, level in zip(other.parts[0].levels, matrix.parts[0].levels, strict=True):
        assert mine.row_combine is level.row_combine


@pytest.mark.parametrize(("name", "tol"), turned([1e-5, 1e-10]))
def test_solver_inverts_what_is_compressed(name, tol, rng):
    """By one thread, and where little is asked by three, which hand over their subtrees."""
    operator = Mixed(case(name, rng))
    matrix = compressed(operator, tol, threads=1 if tol < 1e-5 else 3)
    assert row_error(matrix, dense(operator)) <= (25 if name == "holes" else 5) * tol
    inverse = factor(matrix)
    b = rng.standard_normal((matrix.shape[0], 3))
    backward = 1e-11 * np.linalg.norm(matrix @ np.eye(matrix.shape[0]), 2)
    x = inverse(b)
    assert np.all(np.linalg.norm(matrix @ x - b, axis=0) <= backward * np.linalg.norm(x, axis=0))
    assert np.linalg.norm(inverse(b[:, 1]) - x[:, 1]) <= 1e-8 * np.linalg.norm(x[:, 1])


def test_pivots_that_wait(rng):
    """Of every leaf the others see row 0 and column 0; what is left over is singular, the whole is
    not."""
    leaf, leaves = 8, 8
    exact = np.eye(2 * leaf * leaves)
    first = 2 * leaf * np.arange(leaves)
    exact[np.ix_(first, first)] = 0.3 * np.cos(np.subtract.outer(first, first))
    exact[first, first] = exact[first + 1, first + 1] = 0.0
    exact[first, first + 1] = exact[first + 1, first] = 1.0

    def entries(rows, columns):
        i, j = ((2 * k[:, None] + np.arange(2)).ravel() for k in (rows, columns))
        return exact[np.ix_(i, j)]

    offsets = 2 * np.arange(leaf * leaves + 1)
    matrix = compress(entries, circle(leaf * leaves).points, offsets, offsets, 1e-10, leaf)
    assert np.abs(matrix @ np.eye(len(exact)) - exact).max() <= 1e-12
    inverse, b = factor(matrix), rng.standard_normal(len(exact))
    assert np.abs(inverse(b) - np.linalg.solve(exact, b)).max() <= 1e-12


@pytest.mark.parametrize("n", [1, 2, 9, 24, 25])
def test_few_nodes(n, rng):
    operator = Mixed(circle(n), np.arange(n) % 2 == 0)
    matrix, exact = compressed(operator), dense(operator)
    assert row_error(matrix, exact) <= 1e-8
    b = rng.standard_normal(2 * n)
    assert np.allclose(matrix @ factor(matrix)(b), b, rtol=0, atol=1e-10)


def test_probe_confirms_a_right_matrix_and_detects_a_wrong_one(rng):
    operator = Mixed(case("star", rng))
    matrix = compressed(operator, 1e-9)
    exact = dense(operator)
    estimate = matrix.error_estimate(operator, rng, probes=len(operator.nodes))
    wrong_rows = (
        np.linalg.norm(matrix @ np.eye(len(exact)) - exact, axis=1).max()
        / np.linalg.norm(exact, axis=1).max()
    )
    assert 0.8 * wrong_rows < estimate < 1.3 * wrong_rows

    def wrong(rows, columns):
        block = operator(rows, columns)
        block[:, np.repeat(columns == 311, 2)] *= 1.001
        return block

    assert matrix.error_estimate(wrong, rng) > 1e-7


@pytest.mark.parametrize(
    "change",
    [
        {"tol": 0.0},
        {"leaf": 0},
        {"threads": 0},
        {"points": np.zeros((3, 2))},
        {"col_offsets": [0, 1]},
    ],
)
def test_bad_arguments(change):
    operator = Mixed(circle(16))
    given = {
        "entries": operator,
        "points": operator.nodes.points,
        "row_offsets": operator.row_offsets,
        "col_offsets": operator.col_offsets,
    }
    with pytest.raises(ValueError, match="must be"):
        compress(**(given | change))


def test_no_columns_at_all_and_a_vector_of_the_wrong_length():
    matrix = compressed(Partial(circle(80), np.zeros(80, dtype=bool)))
    assert np.array_equal(matrix @ np.empty(0), np.zeros(160))
    with pytest.raises(ValueError, match="as many columns as rows"):
        factor(matrix)
    with pytest.raises(ValueError, match="31 rows given where this rank has 32"):
        compressed(Mixed(circle(16))).mult(np.zeros(31))
