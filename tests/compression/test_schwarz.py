"""Inverses on patches: corrected by low rank they are those of the matrix as it is."""

from __future__ import annotations

import numpy as np
import pytest
import scipy

from petcontact.compression.hmatrix.schwarz import LocalSolves, Subdomain

NODES, WIDE = 40, 60


class Source:
    """Entries of a matrix with 60 columns, of which the last 20 are beside the first 20 nodes; one
    component a node."""

    def __init__(self, matrix):
        self.matrix = matrix

    def block(self, nodes):
        columns = np.concatenate([nodes, NODES + nodes[nodes < WIDE - NODES]])
        return self.matrix[np.ix_(nodes, columns)].T, columns


def expansion(random, stuck):
    """P: of stuck nodes the unknown is the column beside, of others mostly their own."""
    factors = np.eye(WIDE, NODES) + 0.05 * np.eye(WIDE, NODES, 1)
    for node in stuck:
        factors[:, node] = 0.0
        factors[NODES + node, node] = -random.uniform(0.5, 1.0)
    return scipy.sparse.csr_array(factors)


@pytest.mark.parametrize("changes", [(2,), (1, 3), (2, 12, 3), (2, 0, 2)])
def test_corrections_are_inversions(changes):
    random = np.random.default_rng(len(changes))
    matrix = (
        random.standard_normal((NODES, WIDE))
        + 8.0 * np.eye(NODES, WIDE)
        + 8.0 * np.eye(NODES, WIDE, NODES)
    )
    nodes = [np.arange(0, 28), np.arange(12, NODES)]
    patches = [
        Subdomain([mine], mine, np.flatnonzero((mine < 20) == (k == 0)), True)
        for k, mine in enumerate(nodes)
    ]
    first = np.zeros(2, dtype=np.int64)
    local = LocalSolves([Source(matrix)], first, patches, NODES)
    residual = random.standard_normal(NODES)
    stuck, every, corrected = set[int](), np.ones(NODES, dtype=bool), 0
    local.update(expansion(random, stuck), every)
    before = local.copy()
    at_first = before.solve(residual)
    for count in (4, *changes):
        stuck ^= set(random.choice(20, count, replace=False).tolist())
        factors = expansion(random, stuck)
        inverted, low = local.update(factors, every)
        assert inverted + low == 2
        corrected += low
        anew = LocalSolves([Source(matrix)], first, patches, NODES)
        assert anew.update(factors, every) == (2, 0)
        assert np.allclose(
            local.solve(residual),
            anew.solve(residual),
            rtol=0.0,
            atol=2e-5 * np.abs(residual).max(),
        )
        assert np.array_equal(before.solve(residual), at_first)
    assert corrected > 0
