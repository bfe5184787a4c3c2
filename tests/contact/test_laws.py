"""The laws: what they project to, how they follow, and what a vanishing residual means (Lemma 2.1 of
the paper); the norms of tractions and displacements."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from reduced_system import coulomb

from petcontact.contact.equilibrium import unbalanced_load
from petcontact.contact.friction_law import contact_norm, group_norms, project_ball, ratio
from petcontact.contact.law_protocol import bound_excess, law_residual
from petcontact.contact.laws import SignoriniCoulomb, Tresca
from petcontact.contact.linearisation import Linearisation
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


@given(SEEDS, st.sampled_from([2, 3]))
def test_the_projection_is_the_law_node_by_node(seed, k):
    """Also where τ or the bound is 0, and in another order of memory."""
    rng = np.random.default_rng(seed)
    law = random_law(rng, 20, k)
    tau = 2.0 * rng.standard_normal((20, k)) * (rng.random((20, k)) < 0.8)
    at = Linearisation.from_law(law, np.asfortranarray(tau))
    projection = law.project(np.asfortranarray(tau))
    for i, (*shear, normal) in enumerate(tau):
        opened = law.absent[i] or (law.unilateral[i] and normal <= 0.0)
        p = 0.0 if opened else normal
        coulomb = law.coefficient[i] * abs(p) if np.isfinite(law.coefficient[i]) else np.inf
        radius = 0.0 if law.unilateral[i] and p <= 0.0 else min(coulomb, law.bound[i])
        size = np.linalg.norm(shear)
        expected = [*(np.array(shear) * (radius / size if size > radius else 1.0)), p]
        np.testing.assert_allclose(projection[i], expected, rtol=0.0, atol=1e-14)
        assert at.states[i] == (2 if opened else size > radius or radius == 0.0)
        np.testing.assert_array_equal(at.active[i], at.derivative[i].any(axis=0))
        np.testing.assert_array_equal(at.stick[i], (at.derivative[i] == np.eye(k)).all(axis=1))
        constant = np.where(at.stick[i], 0.0, at.derivative[i] @ tau[i] - projection[i])
        np.testing.assert_allclose(at.constant[i], constant, rtol=0.0, atol=1e-14)


@given(SEEDS, st.sampled_from([2, 3]), st.floats(1e-3, 1e3))
def test_what_satisfies_the_conditions_has_no_residual_and_conversely(seed, k, rho):
    """Signorini with Coulomb friction, written out node by node."""
    rng = np.random.default_rng(seed)
    m, mu = 12, 0.4
    law = coulomb(m, mu, k)
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


def floor(k, m=5):
    """M and E of a block that translates over m nodes; a force of +1 along the last axis
    presses."""
    motion = np.broadcast_to(np.eye(k), (m, k, k)).copy()
    return lambda *load: Modes(motion, np.moveaxis(motion, 2, 0), np.array(load))


@pytest.mark.parametrize("k", [2, 3])
def test_loads_that_no_traction_holds_are_known_beforehand(k):
    """A block on a floor: pushed within the cone of friction, beyond it, and lifted."""
    law, still, push = coulomb(5, 0.3, k), [0.0] * (k - 2), floor(k)
    assert unbalanced_load(None, law) is None
    assert unbalanced_load(push(0.29, *still, 1.0), law) is None
    assert unbalanced_load(push(0.0, *still, -1.0), law)[-1] == pytest.approx(-1.0)
    left = unbalanced_load(push(0.5, *still, 1.0), law)
    assert left[0] == pytest.approx(0.2) and np.abs(left[1:]).max() < 1e-9


@given(SEEDS, st.sampled_from([2, 3]), st.floats(0.0, 1.2))
def test_projections_hold_a_load_where_the_linear_program_does(seed, k, share):
    """Loads of random tractions in the cone, turned out of it by a share; without the program
    those well inside it are known to be held."""
    rng = np.random.default_rng(seed)
    law, push = coulomb(5, 0.3, k), floor(k)
    way = rng.standard_normal(k - 1)
    modes = push(*(0.3 * share * way / np.linalg.norm(way)), 1.0)
    with patch("petcontact.contact.equilibrium.PROJECTIONS", 0):
        left = unbalanced_load(modes, law)
    found = unbalanced_load(modes, law)
    assert (found is None) == (left is None) and (left is None or found == pytest.approx(left))
    if share < 0.9:
        with patch("scipy.optimize.linprog", None):
            assert unbalanced_load(modes, law) is None


@pytest.mark.parametrize("k", [2, 3])
def test_a_vertex_that_leaves_its_bounds_by_round_off_asks_for_no_direction(k):
    """HiGHS gives pressures of -1e-17 where σ_t = 0: what of it lies beyond µp has no direction."""
    law = coulomb(5, 0.3, k)
    solve = scipy.optimize.linprog

    def nearly(*args, **options):
        answer = solve(*args, **options)
        answer.x = np.where(answer.x == 0.0, 1e-17, answer.x)
        answer.x[: 5 * k].reshape(5, k)[:, :-1] = 0.0
        return answer

    with (
        patch("scipy.optimize.linprog", nearly),
        patch("petcontact.contact.equilibrium.PROJECTIONS", 0),
    ):
        assert unbalanced_load(floor(k)(*[0.0] * (k - 1), 1.0), law) is None


@pytest.mark.parametrize("k", [1, 2])
def test_tresca_holds_its_bound_and_no_more(k):
    law, push = Tresca(np.full(5, 2.0), k), floor(k)
    along = np.full(k, 1.0) / np.sqrt(k)
    assert unbalanced_load(push(*(9.99 * along)), law) is None
    left = unbalanced_load(push(*(10.1 * along)), law)
    assert np.abs(left).sum() == pytest.approx(
        0.1 * np.sqrt(k), rel=1e-3
    )  # the least sum of components beyond the disk


@given(SEEDS, st.sampled_from([2, 3]), st.sampled_from([1e-6, 1.0, 1e6]))
def test_excess_is_relative_to_the_bound_of_each_node(seed, k, size):
    """What the law allows has none; what is beyond by a share has that share, however large other
    nodes' tractions are."""
    rng = np.random.default_rng(seed)
    law = coulomb(6, 0.3, k)
    pressure = size * 10.0 ** rng.uniform(-4, 0, 6)
    direction = rng.standard_normal((6, k - 1))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    sigma = np.column_stack([0.3 * pressure[:, None] * direction, -pressure])
    assert bound_excess(law, sigma) <= 1e-12
    sigma[2, :-1] *= 1.0 + 1e-3
    assert bound_excess(law, sigma) == pytest.approx(1e-3, rel=1e-6)
    sigma[2] = [*[0.0] * (k - 1), 0.5 * size]
    assert bound_excess(law, sigma) == pytest.approx(0.5 * size / np.delete(pressure, 2).max())


# squares of numbers below 1e-60 underflow in any norm
sizes = st.one_of(st.just(0.0), st.floats(1e-60, 1e6))
finite = st.builds(lambda size, sign: size * sign, sizes, st.sampled_from([-1.0, 1.0]))


@st.composite
def vectors(draw):
    shape = (draw(st.integers(1, 8)), draw(st.integers(1, 2)))
    bound = draw(arrays(float, shape[0], elements=sizes))
    return draw(arrays(float, shape, elements=finite)), bound


@given(vectors(), st.floats(1e-3, 1e6))
def test_lemma_2_1_friction_condition_gives_zero_residual(data, rho):
    x, bound = data
    size = np.linalg.norm(x, axis=1, keepdims=True)
    slips = size[:, 0] > 0.0
    # slip: σ_t = -g u/|u|; stick: u = 0 with any |σ_t| <= g
    direction = np.divide(x, size, out=np.zeros_like(x), where=size > 0)
    residual = law_residual(Tresca(bound), x, -bound[:, None] * direction, rho)
    assert np.abs(residual[slips]).max(initial=0.0) <= 1e-9 * (1.0 + bound.max())
    sigma = project_ball(x, bound)
    assert np.abs(law_residual(Tresca(bound), np.zeros_like(x), sigma, rho)).max() <= 1e-9 * (
        1.0 + bound.max()
    )


@pytest.mark.parametrize("rho", [0.0, -1.0, np.nan])
def test_residual_refuses_rho(rho):
    with pytest.raises(ValueError, match="positive"):
        law_residual(Tresca(np.ones(2)), np.zeros((2, 1)), np.zeros((2, 1)), rho)


def test_shapes_are_checked():
    with pytest.raises(ValueError, match="shape"):
        law_residual(Tresca(np.ones(2)), np.zeros((2, 1)), np.zeros((3, 1)), 1.0)
    with pytest.raises(ValueError, match="radii"):
        project_ball(np.zeros(3), np.ones(3))
    with pytest.raises(ValueError, match="negative"):
        project_ball(np.zeros((1, 1)), -np.ones(1))


def test_norm_and_balance():
    weight = np.array([0.5, 1.5])
    u, sigma = np.array([[2.0], [0.0]]), np.array([[-6.0], [1.0]])
    assert contact_norm(u, weight) == pytest.approx(np.sqrt(2.0))
    (moved, _), (traction, _), (none, _) = group_norms(weight, (slice(0, 1),), u, sigma, 0 * u)
    assert moved == pytest.approx(np.sqrt(2.0)) and none == 0.0
    assert ratio(moved, traction, 7.0) == pytest.approx(np.sqrt((18.0 + 1.5) / 2.0))
    assert ratio(none, traction, 7.0) == 7.0
    assert Tresca(np.array([6.0, 6.0])).states(3.0 * u - sigma).tolist() == [1, 0]


def test_norms_neither_overflow_nor_underflow():
    weight, groups = np.array([0.5, 1.5]), (slice(0, 1), slice(1, 2))
    x = np.array([[3.0, 0.0], [4.0, 0.0]])
    expected = np.sqrt(0.5 * 9.0 + 1.5 * 16.0)
    for scale in (1e-200, 1.0, 1e200):
        (found,) = group_norms(weight, groups, scale * x)
        np.testing.assert_allclose(found, [scale * expected, scale * expected, 0.0], rtol=1e-14)
    assert np.isnan(group_norms(weight, groups, np.nan * x)[0]).all()
    assert group_norms(weight, groups[:1], np.inf * x[:, :1]) == [[np.inf, np.inf]]
