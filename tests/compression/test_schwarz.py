"""Local solves on patches of a matrix whose columns change: what they give, and what they keep."""

from __future__ import annotations

import numpy as np
import scipy

from petcontact.compression.hmatrix.schwarz import LocalSolves, Subdomain


class Entries:
    """A full matrix as a source, column by column."""

    def __init__(self, matrix):
        self.matrix = matrix

    def block(self, nodes):
        return self.matrix[np.ix_(nodes, nodes)].T, nodes


def test_rows_of_an_inverse_that_follows_changes_are_kept_once():
    """The rows are those of the inverse of A P for three P in turn: the first, one that changes
    many columns, and one that changes few. Until a change corrects them they are kept once."""
    size, rng = 40, np.random.default_rng(3)
    matrix = np.eye(size) + 0.02 * rng.standard_normal((size, size))
    every, own = np.arange(size), np.arange(12)
    patch = Subdomain([every], every, own, True)
    local = LocalSolves([Entries(matrix)], np.array([0, size]), [patch], size)
    r, sizes = rng.standard_normal(size), []
    for scale, count in [(1.0, 0), (2.0, 30), (3.0, 4)]:
        factors = np.ones(size)
        factors[:30] = 2.0 if scale == 3.0 else 1.0
        factors[:count] = scale
        expansion = scipy.sparse.csr_array(scipy.sparse.diags(factors))
        local.update(expansion, np.ones(size, dtype=bool))
        exact = np.linalg.solve(matrix @ np.diag(factors), r)
        np.testing.assert_allclose(local.solve(r)[own], exact[own], rtol=1e-4, atol=1e-5)
        sizes.append(local.nbytes)
    rows, lu = 4 * len(own) * size, 4 * size**2
    assert np.diff(sizes).tolist() == [lu, rows]
