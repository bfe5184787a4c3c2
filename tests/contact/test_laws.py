"""The laws: what they project to, how they follow, and what a vanishing residual means."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from petcontact.contact.equilibrium import directions, unbalanced_load
from petcontact.contact.laws import SignoriniCoulomb, Tresca, law_residual
from petcontact.contact.system import Modes

SEEDS = st.integers(0, 10_000)


def random_law(rng, m, k):
    kind = rng.integers(0, 4, m)
    coefficient = np.where(kind % 2 == 0, rng.choice([0.0, 0.3, 2.0], m), np.inf)
    bound = np.where(kind == 0, np.inf, rng.choice([0.0, 0.5, 1.5], m))
    return SignoriniCoulomb(coefficient, bound, rng.random(m) < 0.7, k, rng.random(m) < 0.1)


@given(SEEDS, st.sampled_from([2, 3]), st.booleans())
def test_the_derivative_is_that_of_the_projection(seed, k, tresca):
    rng = np.random.default_rng(seed)
    law = Tresca(rng.random(8), k) if tresca else random_law(rng, 8, k)
    tau = 2.0 * rng.standard_normal((8, k))
    step, derivative = 1e-6, law.linearise(tau)
    for b in range(k):
        moved = np.zeros(k)
        moved[b] = step
        # not across an edge of the law
        same = law.states(tau + moved) == law.states(tau - moved)
        numeric = (law.project(tau + moved) - law.project(tau - moved)) / (2.0 * step)
        near_cap = np.abs(numeric - derivative[:, :, b]).max(axis=1) > 1e-4
        assert np.count_nonzero(near_cap & same) == 0


@given(SEEDS, st.sampled_from([2, 3]), st.floats(1e-3, 1e3))
def test_what_satisfies_the_conditions_has_no_residual_and_conversely(seed, k, rho):
    """Signorini with Coulomb friction, written out node by node."""
    rng = np.random.default_rng(seed)
    m, mu = 12, 0.4
    law = SignoriniCoulomb(np.full(m, mu), np.full(m, np.inf), np.ones(m, dtype=bool), k)
    closed = rng.random(m) < 0.7
    slips = closed & (rng.random(m) < 0.5)
    pressure = np.where(closed, rng.random(m) + 0.1, 0.0)
    direction = rng.standard_normal((m, k - 1))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    v, sigma = np.zeros((m, k)), np.zeros((m, k))
    v[:, -1], sigma[:, -1] = np.where(closed, 0.0, -rng.random(m) - 0.1), -pressure
    v[:, :-1] = np.where(slips | ~closed, rng.random(m) + 0.1, 0.0)[:, None] * direction
    share = np.where(slips, 1.0, 0.9 * rng.random(m))
    sigma[:, :-1] = -(mu * pressure * share)[:, None] * direction
    assert np.abs(law_residual(law, v, sigma, rho)).max() < 1e-12 * (1.0 + rho)
    assert np.array_equal(law.states(rho * v - sigma), np.where(closed, slips, 2))
    for spoilt in (1.1, 0.5):
        wrong = sigma.copy()
        wrong[slips] *= np.array([spoilt] * (k - 1) + [1.0])
        if slips.any():
            assert np.abs(law_residual(law, v, wrong, rho)).max() > 1e-3 * min(1.0, rho)


def test_bonded_bilateral_frictionless_and_absent_nodes():
    tau = np.array([[3.0, -2.0]] * 5)
    law = SignoriniCoulomb(
        np.array([np.inf, np.inf, 0.5, 0.5, 0.5]), np.array([np.inf, 0.0, np.inf, 0.25, np.inf]),
        np.array([False, False, False, True, False]), 2, np.array([False, False, False, False, True]),
    )  # fmt: skip
    assert law.project(tau).tolist() == [[3.0, -2.0], [0.0, -2.0], [1.0, -2.0], [0.0, 0.0], [0.0, 0.0]]
    assert law.states(tau).tolist() == [0, 1, 1, 2, 2]


@pytest.mark.parametrize("k", [2, 3])
def test_loads_that_no_traction_holds_are_known_beforehand(k):
    """A block on a floor: pushed within the cone of friction, beyond it, and lifted."""
    m, mu = 5, 0.3
    law = SignoriniCoulomb(np.full(m, mu), np.full(m, np.inf), np.ones(m, dtype=bool), k)
    motion = np.broadcast_to(np.eye(k), (m, k, k)).copy()

    def modes(*load):
        return Modes(motion, np.moveaxis(motion, 2, 0), np.array([load[0], *[0.0] * (k - 2), load[1]]))

    # v_n is the overlap: a force of +1 along it presses
    assert unbalanced_load(None, law) is None and unbalanced_load(modes(0.29, 1.0), law) is None
    assert unbalanced_load(modes(0.0, -1.0), law)[-1] == pytest.approx(-1.0)
    push = unbalanced_load(modes(0.5, 1.0), law)
    assert push[0] == pytest.approx(0.2) and np.abs(push[1:]).max() < 1e-9


def test_polygons_of_the_cone_are_regular():
    assert directions(1).tolist() == [[-1.0], [1.0]]
    assert len(directions(2)) == 8 and np.allclose(np.linalg.norm(directions(2), axis=1), 1.0)
