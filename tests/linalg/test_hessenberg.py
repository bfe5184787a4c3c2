"""Equations with I + ρS by Hessenberg's form against what they are."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.errors import SolverError
from petcontact.linalg.hessenberg import HessenbergForm


@pytest.mark.parametrize("n", [1, 2, 7, 40])
def test_solutions_satisfy_the_equations(n):
    random = np.random.default_rng(n)
    matrix, rhs = random.standard_normal((n, n)), random.standard_normal(n)
    form = HessenbergForm(matrix)
    for rho in (1e-9, 0.3, 1.0, 1e9):
        whole = np.eye(n) + rho * matrix
        x, product = form.solve(rho, rhs.copy())
        # backward stable, as elimination with pivoting is
        scale = np.linalg.norm(whole) * np.linalg.norm(x)
        assert np.linalg.norm(whole @ x - rhs) <= 1e-13 * n * scale
        assert np.linalg.norm(product - matrix @ x) <= 1e-13 * n * np.linalg.norm(
            matrix
        ) * np.linalg.norm(x)


def test_a_singular_matrix_is_an_error():
    with pytest.raises(SolverError, match="not finite"), np.errstate(all="ignore"):
        HessenbergForm(-np.eye(3)).solve(1.0, np.ones(3))
