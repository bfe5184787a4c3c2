"""Blocks of equations on an active set, and what they begin with, against the formulas."""

from __future__ import annotations

import numpy as np
import pytest

from petcontact.contact.active_set.solvers import _block
from petcontact.contact.laws import SignoriniCoulomb
from petcontact.contact.linearisation import Linearisation


@pytest.mark.parametrize("k", [2, 3])
def test_blocks_and_tractions_are_those_of_the_derivative(k):
    rng, m = np.random.default_rng(k), 30
    law = SignoriniCoulomb(2.0 * rng.random(m), np.full(m, np.inf), np.ones(m, dtype=bool), k)
    at = Linearisation.from_law(law, rng.normal(size=(m, k)))
    s = rng.normal(size=(m * k, m * k))
    rho = 1.0 + rng.random((m, k))
    so_far = rng.normal(size=(m, k))
    assert set(at.states.tolist()) == {0, 1, 2}
    whole = np.zeros((m * k, m * k))
    for i in range(m):
        whole[k * i : k * i + k, k * i : k * i + k] = at.derivative[i]
    active = np.flatnonzero(at.active)
    expected = (np.eye(m * k) - whole) / rho.ravel()[:, None] + s @ whole
    block, has_slack = _block(s, at, rho, active)
    np.testing.assert_allclose(block, expected[np.ix_(active, active)], rtol=0.0, atol=1e-13)
    assert has_slack == (k == 3)  # in the plane what slips has no unknown along it
    y = np.where(at.stick, so_far, -at.tau)
    sigma, slack = at.first_traction(so_far, rho)
    np.testing.assert_allclose(
        sigma.ravel(), whole @ y.ravel() + at.constant.ravel(), rtol=0.0, atol=1e-13
    )
    np.testing.assert_allclose(slack, np.where(at.stick, 0.0, (y - sigma) / rho), atol=1e-13)
